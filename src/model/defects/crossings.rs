//! Pairs of faces that cross each other, or lie on one another over an area.
//!
//! Faces become triangles; where triangles of two faces meet, away from the edges of both, the place is brought onto the
//! two surfaces by alternating projection, and counts when it stays inside both faces. Near the edges, where triangles
//! of neighbours meet by their chord alone, crossings are looked for on the surfaces themselves ([`super::strips`]). So
//! what is listed is true; away from edges, what is less deep than the chord tolerance may be missed. Faces that
//! end on one another are no crossing: that is what edges are for. The length of a crossing is that of its triangles'
//! segments, or that of the edge along which it was found. Its depth is how far it is inside both faces: what would have
//! to be cut off one of them so that they no longer cross there.
//!
//! Overlaps are looked for at the middles of triangles: the nearest place of the other surface is inside the other
//! face, nearer than the tolerance, and its normal is parallel.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::strips::{self, Border};
use super::{Defect, DefectKind, DefectOptions};
use crate::kernel::geom::Aabb;
use crate::kernel::geom::closest::{Closed, Foot, closed_directions, closest_from};
use crate::kernel::geom::closest_curve::closest_between;
use crate::kernel::geom::trim::Sheet;
use crate::kernel::job::Job;
use crate::kernel::mesh::face_mesh::tessellate_face;
use crate::kernel::mesh::tessellate::{SurfaceMesh, TessellateOptions, tessellate};
use crate::kernel::mesh::tri_tree::TriTree;

/// How far triangles may be from a face, as a fraction of its size.
const CHORD: f64 = 2e-3;
/// How parallel normals of faces are that lie on one another.
const PARALLEL: f64 = 0.99;
/// Alternating projections of one place.
const PROJECTIONS: usize = 60;

/// A face with its triangles.
pub(super) struct Part<'s> {
    pub(super) sheet: &'s Sheet,
    closed: Closed,
    mesh: SurfaceMesh,
    pub(super) tree: TriTree,
    pub(super) bounds: Aabb,
    /// Its edges.
    pub(super) borders: Vec<Border>,
    /// How far these are off the surface: no crossing can be told more closely.
    off: f64,
    /// The edges as segments: their tree, and the edge and the parameters of each.
    segments: TriTree,
    of_segment: Vec<(u32, [f64; 2])>,
    chord: f64,
}

impl<'s> Part<'s> {
    fn new(sheet: &'s Sheet) -> Self {
        let surface = sheet.surface();
        let chord = (CHORD * sheet.bounds().diagonal()).max(f64::MIN_POSITIVE);
        let options = TessellateOptions { max_parts: 256, ..TessellateOptions::new(chord) };
        let mesh = match sheet.face() {
            None => tessellate(surface, &options),
            Some(face) => tessellate_face(face, &options, &[Vec::new(), Vec::new()]).mesh,
        };
        let tree = TriTree::new(mesh.points.to_vec(), &mesh.triangles);
        let borders = strips::borders(sheet);
        let off = borders.iter().map(|border| border.off(surface)).fold(0.0, f64::max);
        // Segments are triangles with two equal corners.
        let (mut points, mut segments, mut of_segment) = (Vec::new(), Vec::new(), Vec::new());
        for (k, border) in borders.iter().enumerate() {
            let first = points.len() as u32;
            let samples = border.curve.sampled(8);
            points.extend(samples.iter().map(|s| s.1));
            segments.extend((first..(points.len() as u32).saturating_sub(1)).map(|k| [k, k + 1, k + 1]));
            of_segment.extend(samples.windows(2).map(|w| (k as u32, [w[0].0, w[1].0])));
        }
        let bounds = Aabb::of(mesh.points.iter().copied());
        let segments = TriTree::new(points, &segments);
        Self {
            sheet,
            closed: closed_directions(surface),
            mesh,
            tree,
            bounds,
            borders,
            off,
            segments,
            of_segment,
            chord,
        }
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.triangles[triangle as usize].map(|k| self.mesh.points[k as usize])
    }

    /// The parameters in the middle of a triangle.
    pub(super) fn uv(&self, triangle: u32) -> DVec2 {
        self.mesh.triangles[triangle as usize].iter().map(|&k| self.mesh.uv[k as usize]).sum::<DVec2>() / 3.0
    }

    /// How far a place is from the edges by their polylines, up to a limit.
    fn off_border(&self, p: DVec3, limit: f64) -> f64 {
        self.segments.nearest(p, limit).map_or(limit, |n| n.distance)
    }

    /// How far a place is from the edges themselves.
    pub(super) fn depth(&self, p: DVec3) -> f64 {
        let Some(near) = self.segments.nearest(p, f64::INFINITY) else { return f64::INFINITY };
        let Some(&(border, [start, end])) = self.of_segment.get(near.triangle as usize) else { return near.distance };
        let along = start + (end - start) * (1.0 - near.barycentric.x);
        let curve = &self.borders[border as usize].curve;
        closest_between(curve, p, curve.domain(), along).distance
    }

    /// The nearest place of the surface, from a start.
    pub(super) fn foot(&self, p: DVec3, start: DVec2) -> Foot {
        closest_from(self.sheet.surface(), self.closed, p, start)
    }
}

/// Finds them.
pub fn find(sheets: &[Sheet], options: &DefectOptions, job: &Job) -> Vec<Defect> {
    job.phase("Comparing faces");
    let parts: Vec<Option<Part<'_>>> =
        sheets.par_iter().map(|sheet| (!job.is_cancelled()).then(|| Part::new(sheet))).collect();
    let mut pairs = Vec::new();
    for (a, first) in parts.iter().enumerate() {
        for (b, second) in parts.iter().enumerate().skip(a + 1) {
            if let (Some(p), Some(q)) = (first, second)
                && p.bounds.grown(options.overlap).overlaps(&q.bounds)
            {
                pairs.push((a, b, p, q));
            }
        }
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    let found: Vec<[Option<Defect>; 2]> = pairs
        .par_iter()
        .map(|&(a, b, p, q)| {
            if job.is_cancelled() {
                return [None, None];
            }
            let overlap = overlap([a, b], p, q, options);
            // Where faces lie on one another their triangles cross at random.
            let crossing = if overlap.is_some() { None } else { crossing([a, b], p, q, options, job) };
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(done as f64 / pairs.len() as f64);
            [crossing, overlap]
        })
        .collect();
    found.into_iter().flatten().flatten().collect()
}

fn defect(kind: DefectKind, faces: [usize; 2], places: &[DVec3], at: DVec3, size: f64) -> Defect {
    let bounds = Aabb::of(places.iter().copied());
    let reach = 0.5 * bounds.diagonal();
    Defect { kind, faces: faces.to_vec(), entities: Vec::new(), edges: Vec::new(), at, reach, size, depth: None }
}

fn crossing(numbers: [usize; 2], p: &Part<'_>, q: &Part<'_>, options: &DefectOptions, job: &Job) -> Option<Defect> {
    let margin = options.joining + 2.0 * (p.chord + q.chord);
    let mut segments: Vec<(f64, [DVec3; 2], [u32; 2])> = Vec::new();
    for [s, t] in p.tree.overlapping_pairs(&q.tree, job) {
        let Some(ends) = common_segment(p.corners(s), q.corners(t)) else { continue };
        let middle = 0.5 * (ends[0] + ends[1]);
        let limit = 4.0 * margin;
        let far = p.off_border(middle, limit).min(q.off_border(middle, limit));
        if far > margin {
            segments.push((far, ends, [s, t]));
        }
    }
    // The deepest places first.
    let mut order: Vec<usize> = (0..segments.len()).collect();
    order.sort_by(|&i, &j| segments[j].0.total_cmp(&segments[i].0).then(i.cmp(&j)));
    let at = order.into_iter().find_map(|k| {
        let (_, ends, triangles) = segments[k];
        confirmed(p, q, 0.5 * (ends[0] + ends[1]), triangles, margin)
    });
    let Some(at) = at else {
        let least = options.tolerance.max(p.off + q.off);
        let found = strips::find(p, q, margin, least, job)?;
        let crossing = defect(DefectKind::Crossing, numbers, &found.places, found.at, found.length);
        return Some(Defect { depth: Some(found.depth), ..crossing });
    };
    let length = segments.iter().map(|(_, [a, b], _)| a.distance(*b)).sum();
    let places: Vec<DVec3> = segments.iter().flat_map(|s| s.1).collect();
    let depth = Some(p.depth(at).min(q.depth(at)));
    Some(Defect { depth, ..defect(DefectKind::Crossing, numbers, &places, at, length) })
}

/// A place on both surfaces, inside both faces and away from their edges, near one where their triangles cross.
fn confirmed(p: &Part<'_>, q: &Part<'_>, start: DVec3, triangles: [u32; 2], margin: f64) -> Option<DVec3> {
    let (mut uv, mut st) = (p.uv(triangles[0]), q.uv(triangles[1]));
    let mut x = start;
    let close = 1e-9 * (p.bounds.diagonal() + q.bounds.diagonal());
    for _ in 0..PROJECTIONS {
        let a = p.foot(x, uv);
        let b = q.foot(a.point, st);
        (uv, st) = (a.uv, b.uv);
        let apart = a.point.distance(b.point);
        x = 0.5 * (a.point + b.point);
        if apart <= close {
            let normals = [(p, uv), (q, st)].map(|(part, at)| part.sheet.surface().jet(at, 1).normal());
            let [Some(m), Some(n)] = normals else { return None };
            let limit = 2.0 * margin;
            let inside = p.sheet.reaches(uv, 0.0) && q.sheet.reaches(st, 0.0);
            let away = p.off_border(x, limit).min(q.off_border(x, limit)) > 0.5 * margin;
            // Faces that touch without crossing have parallel normals.
            return (inside && away && m.cross(n).length() > strips::LEAST_SINE).then_some(x);
        }
        if x.distance(start) > 4.0 * margin {
            return None;
        }
    }
    None
}

/// The area of `p`'s triangles that lie on `q`.
fn overlap(numbers: [usize; 2], p: &Part<'_>, q: &Part<'_>, options: &DefectOptions) -> Option<Defect> {
    // The smaller triangles tell more.
    let (p, q) = if p.mesh.triangles.len() >= q.mesh.triangles.len() { (p, q) } else { (q, p) };
    let margin = options.joining;
    let (mut area, mut places) = (0.0, Vec::new());
    for t in 0..p.mesh.triangles.len() as u32 {
        let [a, b, c] = p.corners(t);
        let middle = (a + b + c) / 3.0;
        if !q.bounds.grown(options.overlap + p.chord).contains(middle) {
            continue;
        }
        let reach = options.overlap + 2.0 * (p.chord + q.chord);
        let Some(near) = q.tree.nearest(middle, reach) else { continue };
        let uv = p.uv(t);
        let jet = p.sheet.surface().jet(p.sheet.surface().clamped(uv), 1);
        let Foot { uv: st, point: y, .. } = q.foot(jet.p(), q.uv(near.triangle));
        let normals = (jet.normal(), q.sheet.surface().jet(st, 1).normal());
        let (Some(m), Some(n)) = normals else { continue };
        let on = y.distance(jet.p()) <= options.overlap && m.dot(n).abs() > PARALLEL && q.sheet.reaches(st, 0.0);
        if on && p.off_border(jet.p(), 2.0 * margin).min(q.off_border(y, 2.0 * margin)) > margin {
            area += 0.5 * (b - a).cross(c - a).length();
            places.push(jet.p());
        }
    }
    let at = *places.get(places.len() / 2)?;
    (area > margin * margin).then(|| defect(DefectKind::Overlap, numbers, &places, at, area))
}

/// The segment that two triangles have in common, when they cross.
fn common_segment(s: [DVec3; 3], t: [DVec3; 3]) -> Option<[DVec3; 2]> {
    let mut points = [DVec3::ZERO; 6];
    let mut count = 0;
    for (one, other) in [(s, t), (t, s)] {
        for k in 0..3 {
            if let Some(x) = pierced(one[k], one[(k + 1) % 3], other) {
                points[count] = x;
                count += 1;
            }
        }
    }
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    let longest = pairs.max_by(|a, b| {
        let length = |(i, j): (usize, usize)| points[i].distance_squared(points[j]);
        length(*a).total_cmp(&length(*b))
    })?;
    let ends = [points[longest.0], points[longest.1]];
    (ends[0] != ends[1]).then_some(ends)
}

/// Where a segment goes through a triangle (Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997).
fn pierced(a: DVec3, b: DVec3, [p, q, r]: [DVec3; 3]) -> Option<DVec3> {
    let (d, e, f) = (b - a, q - p, r - p);
    let h = d.cross(f);
    let det = e.dot(h);
    if det == 0.0 {
        return None;
    }
    let from = a - p;
    let u = from.dot(h) / det;
    let g = from.cross(e);
    let v = d.dot(g) / det;
    let t = f.dot(g) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)).then(|| a + d * t)
}
