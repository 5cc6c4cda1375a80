//! Which edges meet: free ones, shared ones, and the gaps between them.
//!
//! The edges are those of faces and the borders of whole surfaces. Faces that share an edge in the file have it with the
//! same number; everything else is told by coincidence: every edge is sampled at equal parameters, and each sample's
//! distance to the nearest other edge is measured: nearest point of a polyline, then Newton on the curve, so that the
//! figure is never too small by more than rounding and never larger than the polyline's. One edge may run along several
//! others. Cost: edges that overlap in x, times samples; a few seconds for some thousand edges, on all threads.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::document::{Document, EntityId};
use crate::kernel::geom::trim::{EdgeRole, Sheet};
use crate::kernel::geom::{Aabb, Curve, Side};
use crate::kernel::job::Job;

/// Samples of an edge at which its distance to the others is measured.
pub const SAMPLES: usize = 17;
/// Segments of the polyline of one polynomial piece.
const PER_SPAN: usize = 8;

/// How one edge meets the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meets {
    /// It is a single point.
    Pole,
    /// No sample lies on another edge.
    Free,
    /// All samples lie on other edges, at most `gap` off.
    Shared {
        /// The largest distance.
        gap: f64,
    },
    /// Some samples lie on other edges, at most `gap` off, and some do not.
    Partly {
        /// The share of samples that do, 0..1.
        share: f64,
        /// The largest distance of those.
        gap: f64,
    },
}

/// Names an edge as patch specifications do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
pub struct EdgeAt {
    /// The number of the face or surface.
    pub face: usize,
    /// The loop: 0 is the outer one.
    pub ring: usize,
    /// The edge of the loop; of a whole surface one of its borders in the order of [`Side::ALL`].
    pub edge: usize,
}

/// One edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Which one.
    pub at: EdgeAt,
    /// How it meets the others.
    pub meets: Meets,
    /// The edges that it meets, in order. More than one along its whole length is not manifold.
    pub with: Vec<EdgeAt>,
    /// Whether the file itself says that it is shared.
    pub by_file: bool,
    /// Where the largest gap is, or the middle of the edge.
    pub place: DVec3,
    /// Its length, by its polyline.
    pub length: f64,
}

/// An edge as it is searched.
struct Candidate {
    at: EdgeAt,
    /// The number that faces share; none for the border of a whole surface.
    id: Option<u64>,
    curve: Curve,
    polyline: Vec<(f64, DVec3)>,
    bounds: Aabb,
    /// Whether it is smaller than what counts as one point.
    pole: bool,
}

fn candidates(sheets: impl Iterator<Item = Sheet>, joining: f64) -> Vec<Candidate> {
    let candidate = |at: EdgeAt, id: Option<u64>, curve: Curve| {
        let polyline = curve.sampled(PER_SPAN);
        let tight = Aabb::of(polyline.iter().map(|s| s.1));
        let (pole, bounds) = (tight.diagonal() <= joining, tight.grown(joining));
        Candidate { at, id, curve, polyline, bounds, pole }
    };
    let mut out = Vec::new();
    for (face, sheet) in sheets.enumerate() {
        match sheet {
            Sheet::Whole(surface) => {
                for side in Side::ALL {
                    // Fails on no valid surface.
                    if let Ok(curve) = surface.border(side) {
                        out.push(candidate(EdgeAt { face, ring: 0, edge: side as usize }, None, curve));
                    }
                }
            }
            Sheet::Trimmed(trimmed) => {
                for (ring, r) in trimmed.rings().iter().enumerate() {
                    for (edge, e) in r.edges.iter().enumerate().filter(|(_, e)| e.role == EdgeRole::Model) {
                        out.push(candidate(EdgeAt { face, ring, edge }, Some(e.id), e.curve.as_ref().clone()));
                    }
                }
            }
        }
    }
    out
}

/// The edges of all faces and whole surfaces, in order. Two edges are one where they are at most `joining` apart. A
/// cancelled job leaves out the rest.
pub fn edges(document: &Document, joining: f64, job: &Job) -> Vec<Edge> {
    edges_of(document.sheets().map(|(_, sheet)| sheet), joining, job)
}

/// For each patch, how far its borders are from those of the patches next to it; `None` without any.
pub type SeamGaps = Vec<(EntityId, Option<f64>)>;

/// How far the borders of each healed patch are from those of other patches that they run along; `None` for a patch
/// that has no neighbour. Two borders run along each other where they are at most `joining` apart.
pub fn seam_gaps(document: &Document, joining: f64) -> SeamGaps {
    let mut gaps: SeamGaps = document.patches().map(|(id, _)| (id, None)).collect();
    let found =
        edges_of(document.patches().map(|(_, patch)| Sheet::Whole(Arc::clone(&patch.surface))), joining, &Job::new());
    for edge in found {
        if let Meets::Shared { gap } | Meets::Partly { gap, .. } = edge.meets
            && let Some((_, widest)) = gaps.get_mut(edge.at.face)
        {
            *widest = Some(widest.unwrap_or(0.0).max(gap));
        }
    }
    gaps
}

fn edges_of(sheets: impl Iterator<Item = Sheet>, joining: f64, job: &Job) -> Vec<Edge> {
    let candidates = candidates(sheets, joining);
    let mut by_x: Vec<usize> = (0..candidates.len()).collect();
    by_x.sort_by(|&a, &b| candidates[a].bounds.min.x.total_cmp(&candidates[b].bounds.min.x));
    // The largest x that any edge up to a place of the order reaches bounds how far back one has to look.
    let mut reach: Vec<f64> = Vec::with_capacity(by_x.len());
    for &c in &by_x {
        reach.push(candidates[c].bounds.max.x.max(reach.last().copied().unwrap_or(f64::NEG_INFINITY)));
    }
    let mut by_id: std::collections::HashMap<u64, Vec<usize>> = std::collections::HashMap::new();
    for (k, c) in candidates.iter().enumerate() {
        if let Some(id) = c.id {
            by_id.entry(id).or_default().push(k);
        }
    }
    let one = |own: usize| {
        let edge = &candidates[own];
        let [start, end] = edge.curve.domain();
        let length = edge.polyline.windows(2).map(|w| w[0].1.distance(w[1].1)).sum();
        let middle = edge.curve.eval(0.5 * (start + end));
        let plain = |meets| Edge { at: edge.at, meets, with: Vec::new(), by_file: false, place: middle, length };
        if edge.pole {
            return plain(Meets::Pole);
        }
        let same: Vec<usize> = edge.id.and_then(|id| by_id.get(&id)).map_or(&[][..], Vec::as_slice).to_vec();
        if same.len() > 1 {
            let with = same.iter().filter(|&&k| k != own).map(|&k| candidates[k].at).collect();
            return Edge { with, by_file: true, ..plain(Meets::Shared { gap: 0.0 }) };
        }
        let first = reach.partition_point(|&x| x < edge.bounds.min.x);
        let near: Vec<usize> = by_x[first..]
            .iter()
            .copied()
            .take_while(|&c| candidates[c].bounds.min.x <= edge.bounds.max.x)
            .filter(|&c| c != own && !candidates[c].pole && candidates[c].bounds.overlaps(&edge.bounds))
            .collect();
        let (mut on, mut gap, mut place) = (0, 0.0f64, middle);
        let mut with = std::collections::BTreeMap::new();
        for k in 0..SAMPLES {
            // Inside the edge only: its ends touch its neighbours on the same face.
            let p = edge.curve.eval(start + (end - start) * (k as f64 + 0.5) / SAMPLES as f64);
            let mut nearest = f64::INFINITY;
            for &c in near.iter().filter(|&&c| candidates[c].bounds.contains(p)) {
                let d = distance(&candidates[c], p);
                nearest = nearest.min(d);
                if d <= joining {
                    *with.entry(candidates[c].at).or_insert(0) += 1;
                }
            }
            if nearest <= joining {
                on += 1;
                if nearest > gap {
                    (gap, place) = (nearest, p);
                }
            }
        }
        let meets = match on {
            0 => Meets::Free,
            SAMPLES => Meets::Shared { gap },
            _ => Meets::Partly { share: on as f64 / SAMPLES as f64, gap },
        };
        // What is met at one sample only is an edge that crosses or touches.
        let with = with.into_iter().filter(|(_, count)| *count > 1 || on == 1).map(|(at, _)| at).collect();
        Edge { with, place, ..plain(meets) }
    };
    job.phase("Finding edges that meet");
    let done = std::sync::atomic::AtomicUsize::new(0);
    (0..candidates.len())
        .into_par_iter()
        .filter_map(|c| {
            if job.is_cancelled() {
                return None;
            }
            let edge = one(c);
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(done as f64 / candidates.len() as f64);
            Some(edge)
        })
        .collect()
}

/// The distance from `p` to an edge.
fn distance(edge: &Candidate, p: DVec3) -> f64 {
    let (mut best, mut start) = (f64::INFINITY, edge.polyline[0].0);
    for pair in edge.polyline.windows(2) {
        let ((t0, a), (t1, b)) = (pair[0], pair[1]);
        let d = b - a;
        let along = if d.length_squared() > 0.0 { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
        let distance = (a + d * along).distance(p);
        if distance < best {
            (best, start) = (distance, t0 + (t1 - t0) * along);
        }
    }
    let [low, high] = edge.curve.domain();
    let mut t = start;
    let mut found = edge.curve.eval(t).distance(p);
    for _ in 0..8 {
        let [c, c1, c2, _] = edge.curve.derivatives(t, 2);
        let (slope, bend) = ((c - p).dot(c1), c1.length_squared() + (c - p).dot(c2));
        let step = slope / if bend > 0.0 { bend } else { c1.length_squared() };
        let next = (t - step).clamp(low, high);
        if !next.is_finite() || next == t {
            break;
        }
        t = next;
        found = found.min(edge.curve.eval(t).distance(p));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::{Surface, sweep};
    use crate::model::document::{Patch, Shape, Unit};

    fn all_of(document: &Document, joining: f64) -> Vec<Edge> {
        edges(document, joining, &Job::new())
    }

    fn document(surfaces: Vec<Surface>) -> Document {
        let mut document = Document::new(Unit::Unknown);
        for surface in surfaces {
            document.add("s", Shape::Surface(Arc::new(surface)), None);
        }
        document
    }

    /// A bilinear patch over x in `x0..x1`, y in `y0..y1` on a saddle.
    fn saddle(x: [f64; 2], y: [f64; 2], lift: f64) -> Surface {
        let p = |x: f64, y: f64| DVec3::new(x, y, x * y + lift);
        Surface::bilinear([p(x[0], y[0]), p(x[1], y[0]), p(x[0], y[1]), p(x[1], y[1])]).unwrap()
    }

    fn meets(borders: &[Edge]) -> Vec<Meets> {
        borders.iter().map(|b| b.meets).collect()
    }

    #[test]
    fn shared_borders_have_their_gap_and_others_are_free() {
        let lift = 1e-4;
        let model = document(vec![saddle([0.0, 1.0], [0.0, 1.0], 0.0), saddle([1.0, 2.0], [0.0, 1.0], lift)]);
        let found = all_of(&model, 1e-3);
        assert_eq!(found.len(), 8);
        // u = max of the first against u = min of the second: parallel lines in space, `lift` apart in z; their
        // distance is that of lines of slope 1 in the plane x = 1.
        let expected = lift / 2f64.sqrt();
        for (k, border) in found.iter().enumerate() {
            let Meets::Shared { gap } = border.meets else {
                assert_eq!(border.meets, Meets::Free, "{k}");
                continue;
            };
            assert!((k == 1 || k == 7) && (gap - expected).abs() < 1e-12, "{k} {gap}");
        }
        assert_eq!(found.iter().filter(|b| b.meets != Meets::Free).count(), 2);
        assert!(all_of(&model, 1e-5).iter().all(|b| b.meets == Meets::Free));
    }

    #[test]
    fn one_border_along_two_others_is_shared_and_along_one_of_them_partly() {
        let (left, low, high) = (
            saddle([0.0, 1.0], [0.0, 2.0], 0.0),
            saddle([1.0, 2.0], [0.0, 0.7], 0.0),
            saddle([1.0, 2.0], [0.7, 2.0], 0.0),
        );
        let found = all_of(&document(vec![left.clone(), low.clone(), high]), 1e-6);
        assert!(matches!(found[1].meets, Meets::Shared { gap } if gap < 1e-14));
        let found = all_of(&document(vec![left, low]), 1e-6);
        let Meets::Partly { share, gap } = found[1].meets else { panic!("{:?}", found[1]) };
        assert!((share - 0.35).abs() < 1.0 / SAMPLES as f64 && gap < 1e-14);
    }

    #[test]
    fn poles_and_seams_are_told_from_free_borders() {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, -1.5, std::f64::consts::FRAC_PI_2).unwrap();
        let cap = sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, std::f64::consts::TAU).unwrap();
        let found = meets(&all_of(&document(vec![cap]), 1e-6));
        assert!(matches!(found[1], Meets::Shared { gap } if gap < 1e-12), "seam: {found:?}");
        assert!(matches!(found[3], Meets::Shared { gap } if gap < 1e-12), "seam: {found:?}");
        assert_eq!((found[0], found[2]), (Meets::Free, Meets::Pole));
    }

    #[test]
    fn seams_of_patches_have_their_gap_and_surfaces_do_not_count() {
        let lift = 2e-4;
        let mut model = document(vec![saddle([2.0, 3.0], [0.0, 1.0], 0.0)]);
        let shapes = [saddle([0.0, 1.0], [0.0, 1.0], 0.0), saddle([1.0, 2.0], [0.0, 1.0], lift)];
        for surface in shapes {
            let (spec, settings, report) = Default::default();
            let patch = Patch { surface: Arc::new(surface), spec, settings, report };
            model.add("p", Shape::Patch(Arc::new(patch)), None);
        }
        let expected = lift / 2f64.sqrt();
        let found = seam_gaps(&model, 1e-3);
        assert!(found.len() == 2 && found.iter().all(|(_, g)| g.is_some_and(|g| (g - expected).abs() < 1e-12)));
        assert!(seam_gaps(&model, 1e-5).iter().all(|(_, g)| g.is_none()));
    }
}
