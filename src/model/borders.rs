//! How the borders of whole surfaces meet: which are free, which lie on another border, and how far off.
//!
//! Every border is sampled at equal parameters, and each sample's distance to the nearest other border is measured:
//! nearest point of a polyline, then Newton on the curve, so that the figure is never too small by more than
//! rounding and never larger than the polyline's. One border may run along several others. This looks at whole
//! surfaces; where a file trims them, its edges are elsewhere. Cost: borders that overlap in x, times samples.

use glam::DVec3;
use rayon::prelude::*;

use super::document::{Document, EntityId};
use crate::kernel::geom::{Aabb, Curve, Side, Surface};

/// Samples of a border at which its distance to the others is measured.
pub const SAMPLES: usize = 17;
/// Segments of the polyline of one polynomial piece.
const PER_SPAN: usize = 8;

/// How one border meets the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meets {
    /// It is a single point.
    Pole,
    /// No sample lies on another border.
    Free,
    /// All samples lie on other borders, at most `gap` off.
    Shared {
        /// The largest distance.
        gap: f64,
    },
    /// Some samples lie on other borders, at most `gap` off, and some do not.
    Partly {
        /// The share of samples that do, 0..1.
        share: f64,
        /// The largest distance of those.
        gap: f64,
    },
}

/// One border of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// The number of the surface.
    pub surface: usize,
    /// Which of its four borders.
    pub side: Side,
    /// How it meets the others.
    pub meets: Meets,
}

/// A border as it is searched.
struct Candidate {
    surface: usize,
    side: Side,
    curve: Curve,
    polyline: Vec<(f64, DVec3)>,
    bounds: Aabb,
    /// Whether it is smaller than what counts as one point.
    pole: bool,
}

/// The borders of all original surfaces, four for each in the order of [`Side::ALL`]. Two borders are one where
/// they are at most `joining` apart.
pub fn borders(document: &Document, joining: f64) -> Vec<Border> {
    borders_of(document.surfaces().map(|(_, shape)| shape.as_ref()), joining)
}

/// For each patch, how far its borders are from those of the patches next to it; `None` without any.
pub type SeamGaps = Vec<(EntityId, Option<f64>)>;

/// How far the borders of each healed patch are from those of other patches that they run along; `None` for a patch
/// that has no neighbour. Two borders run along each other where they are at most `joining` apart.
pub fn seam_gaps(document: &Document, joining: f64) -> SeamGaps {
    let mut gaps: SeamGaps = document.patches().map(|(id, _)| (id, None)).collect();
    let found = borders_of(document.patches().map(|(_, patch)| patch.surface.as_ref()), joining);
    for border in found {
        if let Meets::Shared { gap } | Meets::Partly { gap, .. } = border.meets
            && let Some((_, widest)) = gaps.get_mut(border.surface)
        {
            *widest = Some(widest.unwrap_or(0.0).max(gap));
        }
    }
    gaps
}

/// The borders of some surfaces, numbered as they come.
fn borders_of<'a>(surfaces: impl Iterator<Item = &'a Surface>, joining: f64) -> Vec<Border> {
    let candidates: Vec<Candidate> = surfaces
        .enumerate()
        .flat_map(|(surface, shape)| {
            Side::ALL.into_iter().filter_map(move |side| {
                let curve = shape.border(side).ok()?; // fails on no valid surface
                let polyline = curve.sampled(PER_SPAN);
                let tight = Aabb::of(polyline.iter().map(|s| s.1));
                let (pole, bounds) = (tight.diagonal() <= joining, tight.grown(joining));
                Some(Candidate { surface, side, curve, polyline, bounds, pole })
            })
        })
        .collect();
    let mut by_x: Vec<usize> = (0..candidates.len()).collect();
    by_x.sort_by(|&a, &b| candidates[a].bounds.min.x.total_cmp(&candidates[b].bounds.min.x));
    let widest = candidates.iter().map(|c| c.bounds.size().x).fold(0.0, f64::max);
    let meets = |own: usize| {
        let border = &candidates[own];
        if border.pole {
            return Meets::Pole;
        }
        let [start, end] = border.curve.domain();
        let first = by_x.partition_point(|&c| candidates[c].bounds.min.x < border.bounds.min.x - widest);
        let near: Vec<&Candidate> = by_x[first..]
            .iter()
            .take_while(|&&c| candidates[c].bounds.min.x <= border.bounds.max.x)
            .filter(|&&c| c != own && !candidates[c].pole && candidates[c].bounds.overlaps(&border.bounds))
            .map(|&c| &candidates[c])
            .collect();
        let (mut on, mut gap) = (0, 0.0f64);
        for k in 0..SAMPLES {
            // Inside the border only: its ends touch its neighbours on the same surface.
            let p = border.curve.eval(start + (end - start) * (k as f64 + 0.5) / SAMPLES as f64);
            let distance = near.iter().filter(|c| c.bounds.contains(p)).map(|c| distance(c, p));
            let distance = distance.fold(f64::INFINITY, f64::min);
            if distance <= joining {
                on += 1;
                gap = gap.max(distance);
            }
        }
        match on {
            0 => Meets::Free,
            SAMPLES => Meets::Shared { gap },
            _ => Meets::Partly { share: on as f64 / SAMPLES as f64, gap },
        }
    };
    (0..candidates.len())
        .into_par_iter()
        .map(|c| Border { surface: candidates[c].surface, side: candidates[c].side, meets: meets(c) })
        .collect()
}

/// The distance from `p` to a border.
fn distance(border: &Candidate, p: DVec3) -> f64 {
    let (mut best, mut start) = (f64::INFINITY, border.polyline[0].0);
    for pair in border.polyline.windows(2) {
        let ((t0, a), (t1, b)) = (pair[0], pair[1]);
        let d = b - a;
        let along = if d.length_squared() > 0.0 { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
        let distance = (a + d * along).distance(p);
        if distance < best {
            (best, start) = (distance, t0 + (t1 - t0) * along);
        }
    }
    let [low, high] = border.curve.domain();
    let mut t = start;
    let mut found = border.curve.eval(t).distance(p);
    for _ in 0..8 {
        let [c, c1, c2, _] = border.curve.derivatives(t, 2);
        let (slope, bend) = ((c - p).dot(c1), c1.length_squared() + (c - p).dot(c2));
        let step = slope / if bend > 0.0 { bend } else { c1.length_squared() };
        let next = (t - step).clamp(low, high);
        if !next.is_finite() || next == t {
            break;
        }
        t = next;
        found = found.min(border.curve.eval(t).distance(p));
    }
    found
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::sweep;
    use crate::model::document::{Patch, Shape, Unit};

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

    fn meets(borders: &[Border]) -> Vec<Meets> {
        borders.iter().map(|b| b.meets).collect()
    }

    #[test]
    fn shared_borders_have_their_gap_and_others_are_free() {
        let lift = 1e-4;
        let model = document(vec![saddle([0.0, 1.0], [0.0, 1.0], 0.0), saddle([1.0, 2.0], [0.0, 1.0], lift)]);
        let found = borders(&model, 1e-3);
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
        assert!(borders(&model, 1e-5).iter().all(|b| b.meets == Meets::Free));
    }

    #[test]
    fn one_border_along_two_others_is_shared_and_along_one_of_them_partly() {
        let (left, low, high) = (
            saddle([0.0, 1.0], [0.0, 2.0], 0.0),
            saddle([1.0, 2.0], [0.0, 0.7], 0.0),
            saddle([1.0, 2.0], [0.7, 2.0], 0.0),
        );
        let found = borders(&document(vec![left.clone(), low.clone(), high]), 1e-6);
        assert!(matches!(found[1].meets, Meets::Shared { gap } if gap < 1e-14));
        let found = borders(&document(vec![left, low]), 1e-6);
        let Meets::Partly { share, gap } = found[1].meets else { panic!("{:?}", found[1]) };
        assert!((share - 0.35).abs() < 1.0 / SAMPLES as f64 && gap < 1e-14);
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

    #[test]
    fn poles_and_seams_are_told_from_free_borders() {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, -1.5, std::f64::consts::FRAC_PI_2).unwrap();
        let cap = sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, std::f64::consts::TAU).unwrap();
        let found = meets(&borders(&document(vec![cap]), 1e-6));
        assert!(matches!(found[1], Meets::Shared { gap } if gap < 1e-12), "seam: {found:?}");
        assert!(matches!(found[3], Meets::Shared { gap } if gap < 1e-12), "seam: {found:?}");
        assert_eq!((found[0], found[2]), (Meets::Free, Meets::Pole));
    }
}
