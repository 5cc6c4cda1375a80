//! An intersection of whole surfaces cut down to trimmed faces.
//!
//! Curves are cut where they leave the loops of either face: between two points inside and outside the place is found by
//! bisection on the straight piece between them, in the parameters of both surfaces, so the new end is within the curve's
//! error bound of both. A piece between two points is looked at in four places; a loop that it enters and leaves between
//! two of these is missed. Contacts outside either face are dropped. Coincident regions are kept whole and told as
//! unresolved where a trimmed face takes part. Cost: a few point tests for every point.

use std::sync::Arc;

use super::result::{CurveEnd, CurvePoint, Intersection, IntersectionCurve, Unresolved};
use crate::kernel::geom::trim::Face;

/// Parts into which a piece between two points is cut to look for loops.
const PARTS: usize = 4;
/// Halvings until a cut is found.
const HALVINGS: usize = 40;

/// Cuts an intersection down; `faces` gives the face with a number, `None` for what is not trimmed.
pub fn clip(result: &mut Intersection, faces: &dyn Fn(usize) -> Option<Arc<Face>>) {
    let mut known: std::collections::HashMap<usize, Option<Arc<Face>>> = std::collections::HashMap::new();
    let numbers = (result.curves.iter().flat_map(|c| &c.points).flat_map(|p| [p.a, p.b]))
        .chain(result.junctions.iter().flat_map(|j| [j.a, j.b]))
        .chain(result.miters.iter().map(|m| m.a))
        .chain(result.regions.iter().flat_map(|r| r.boundary.iter().flatten()).flat_map(|p| [p.a, p.b]));
    for number in numbers {
        known.entry(number).or_insert_with(|| faces(number));
    }
    let face = |number: usize| known.get(&number).and_then(Option::as_ref);
    if known.values().all(Option::is_none) {
        return;
    }
    let covers = |face: Option<&Arc<Face>>, uv| face.is_none_or(|f| f.contains(uv));
    let inside = |p: &CurvePoint| covers(face(p.a), p.uv) && covers(face(p.b), p.st);
    let mut kept = vec![None; result.junctions.len()];
    let junctions = std::mem::take(&mut result.junctions);
    for (k, j) in junctions.into_iter().enumerate() {
        if covers(face(j.a), j.uv) && covers(face(j.b), j.st) {
            kept[k] = Some(result.junctions.len());
            result.junctions.push(j);
        }
    }
    let mut kept_miters = vec![None; result.miters.len()];
    for (k, m) in std::mem::take(&mut result.miters).into_iter().enumerate() {
        if covers(face(m.a), m.uv) {
            kept_miters[k] = Some(result.miters.len());
            result.miters.push(m);
        }
    }
    for curve in std::mem::take(&mut result.curves) {
        let mut pieces = cut(curve, &inside);
        for piece in &mut pieces {
            for k in 0..2 {
                let kept = match piece.ends[k] {
                    CurveEnd::Junction => &kept,
                    CurveEnd::Miter => &kept_miters,
                    _ => continue,
                };
                piece.end_ids[k] = piece.end_ids[k].and_then(|id| kept.get(id).copied().flatten());
                if piece.end_ids[k].is_none() {
                    piece.ends[k] = CurveEnd::Boundary;
                }
            }
        }
        result.curves.extend(pieces);
    }
    for region in &result.regions {
        let Some(p) = region.boundary.iter().flatten().next() else { continue };
        if face(p.a).is_some() || face(p.b).is_some() {
            let bounds = |face: Option<&Arc<Face>>| {
                let [low, high] = face.map(|f| f.extent()).unwrap_or_default();
                [[low.x, high.x], [low.y, high.y]]
            };
            let reason = "the coincident region is that of the whole surfaces, not of the trimmed faces".into();
            result.unresolved.push(Unresolved {
                a: p.a,
                uv_box: bounds(face(p.a)),
                b: p.b,
                st_box: bounds(face(p.b)),
                reason,
            });
            result.complete = false;
        }
    }
}

fn between(p: &CurvePoint, q: &CurvePoint, t: f64) -> CurvePoint {
    CurvePoint { xyz: p.xyz.lerp(q.xyz, t), uv: p.uv.lerp(q.uv, t), st: p.st.lerp(q.st, t), ..*p }
}

/// The pieces of a curve that are inside.
fn cut(curve: IntersectionCurve, inside: &dyn Fn(&CurvePoint) -> bool) -> Vec<IntersectionCurve> {
    let mut runs: Vec<Vec<CurvePoint>> = Vec::new();
    let mut open: Option<Vec<CurvePoint>> = None;
    let mut crossed = false;
    let n = curve.points.len();
    let Some(first) = curve.points.first() else { return Vec::new() };
    let mut before = inside(first);
    if before {
        open = Some(vec![*first]);
    }
    for k in 1..n {
        let (p, q) = (curve.points[k - 1], curve.points[k]);
        // Where the curve crosses from one patch to the next, both points are one.
        let jumps = p.a != q.a || p.b != q.b;
        let parts = if jumps { 1 } else { PARTS };
        for i in 0..parts {
            let (from, to) = (i as f64 / parts as f64, (i + 1) as f64 / parts as f64);
            let end = if i + 1 == parts { q } else { between(&p, &q, to) };
            let now = inside(&end);
            if now != before {
                crossed = true;
                let at = if jumps {
                    if now { q } else { p }
                } else {
                    let (mut low, mut high) = (from, to);
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (low + high);
                        if inside(&between(&p, &q, middle)) == before { low = middle } else { high = middle }
                    }
                    between(&p, &q, if before { low } else { high })
                };
                if now {
                    open = Some(vec![at]);
                } else if let Some(mut run) = open.take() {
                    run.push(at);
                    runs.push(run);
                }
            }
            before = now;
        }
        if let Some(run) = open.as_mut().filter(|_| before) {
            run.push(q);
        }
    }
    if !crossed {
        return if before { vec![curve] } else { Vec::new() };
    }
    let ends_inside = open.is_some();
    runs.extend(open);
    let starts_inside = inside(first);
    // A closed curve that is inside at its joint goes on there.
    if curve.closed && starts_inside && ends_inside && runs.len() > 1 {
        let head = runs.remove(0);
        if let Some(tail) = runs.last_mut() {
            tail.extend(&head[1..]);
        }
    }
    let last = runs.len().saturating_sub(1);
    runs.into_iter()
        .enumerate()
        .filter(|(_, points)| points.len() > 1)
        .map(|(k, points)| {
            let own = [!curve.closed && starts_inside && k == 0, !curve.closed && ends_inside && k == last];
            let ends = [0, 1].map(|e| if own[e] { curve.ends[e] } else { CurveEnd::Boundary });
            let end_ids = [0, 1].map(|e| if own[e] { curve.end_ids[e] } else { None });
            IntersectionCurve { closed: false, ends, end_ids, points, ..curve.clone() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DVec3;

    use super::super::{SsiOptions, intersect};
    use super::*;
    use crate::kernel::geom::ring::{EdgeInput, RingOptions, face};
    use crate::kernel::geom::trim::SurfaceKind;
    use crate::kernel::geom::{Curve, Surface, sweep};
    use crate::kernel::job::Job;

    fn plane(corners: [DVec3; 4]) -> Arc<Surface> {
        Arc::new(Surface::bilinear(corners).unwrap())
    }

    #[test]
    fn two_crossing_planes_meet_inside_the_disk_only() {
        let p = DVec3::new;
        let flat = plane([p(-2.0, -2.0, 0.0), p(2.0, -2.0, 0.0), p(-2.0, 2.0, 0.0), p(2.0, 2.0, 0.0)]);
        let upright = plane([p(0.25, -2.0, -1.0), p(0.25, 2.0, -1.0), p(0.25, -2.0, 1.0), p(0.25, 2.0, 1.0)]);
        // A ring between the radii 0.5 and 1.
        let circle = |r: f64| Arc::new(sweep::arc(DVec3::ZERO, DVec3::X * r, DVec3::Y * r, 0.0, TAU).unwrap());
        let edge = |id, r| vec![EdgeInput { id, curve: Some(circle(r)), guide: None, reversed: false }];
        let made = face(&flat, SurfaceKind::Plane, &[edge(0, 1.0), edge(1, 0.5)], &RingOptions::default()).unwrap();
        let disk = Arc::new(made.face);
        let options = SsiOptions::default();
        let mut found = intersect(&[(0, &*flat)], &[(1, &*upright)], &options, &Job::new()).unwrap();
        assert_eq!(found.curves.len(), 1);
        clip(&mut found, &|n| (n == 0).then(|| Arc::clone(&disk)));
        assert_eq!(found.curves.len(), 2);
        let ends: Vec<f64> = found
            .curves
            .iter()
            .flat_map(|c| [c.points[0].xyz, c.points[c.points.len() - 1].xyz])
            .map(|p| p.truncate().length())
            .collect();
        for r in &ends {
            assert!((r - 1.0).abs() < 1e-4 || (r - 0.5).abs() < 1e-4, "{ends:?}");
        }
        assert!(found.curves.iter().all(|c| c.ends == [CurveEnd::Boundary; 2]));
    }

    /// The plane z = 0 over [-3, 3]^2 without the unit disk.
    fn holed() -> Arc<Face> {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let flat = plane([p(-3.0, -3.0), p(3.0, -3.0), p(-3.0, 3.0), p(3.0, 3.0)]);
        let corners = [p(-3.0, -3.0), p(3.0, -3.0), p(3.0, 3.0), p(-3.0, 3.0)];
        let edge = |id, curve| EdgeInput { id, curve: Some(Arc::new(curve)), guide: None, reversed: false };
        let outer = (0..4).map(|k| edge(k as u64, Curve::segment(corners[k], corners[(k + 1) % 4]).unwrap())).collect();
        let hole = vec![edge(9, sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, TAU).unwrap())];
        Arc::new(face(&flat, SurfaceKind::Plane, &[outer, hole], &RingOptions::default()).unwrap().face)
    }

    /// What a plane with a hole has in common with an upright cylinder, trimmed at z >= `above` where that is given.
    fn cut_by_cylinder(x: f64, radius: f64, above: Option<f64>) -> Intersection {
        let plane = holed();
        let foot = DVec3::new(x, 0.0, -1.0);
        let arc = sweep::arc(foot, DVec3::X * radius, DVec3::Y * radius, 0.0, TAU).unwrap();
        let cylinder = Arc::new(sweep::extruded(&arc, DVec3::Z * 2.0).unwrap());
        let ring = |z: f64| {
            let center = DVec3::new(x, 0.0, z);
            let curve = sweep::arc(center, DVec3::X * radius, DVec3::Y * radius, 0.0, TAU).unwrap();
            vec![EdgeInput { id: 20 + (10.0 * z) as u64, curve: Some(Arc::new(curve)), guide: None, reversed: false }]
        };
        let upper = above.map(|z| {
            let rings = [ring(z), ring(1.0)];
            Arc::new(face(&cylinder, SurfaceKind::Cylinder, &rings, &RingOptions::default()).unwrap().face)
        });
        let surfaces = [plane.surface(), upper.as_ref().map_or(&cylinder, |f| f.surface())].map(Arc::clone);
        let options = SsiOptions::default();
        let mut found = intersect(&[(0, &*surfaces[0])], &[(1, &*surfaces[1])], &options, &Job::new()).unwrap();
        clip(&mut found, &|n| if n == 0 { Some(Arc::clone(&plane)) } else { upper.clone() });
        assert!(found.complete, "{:?}", found.unresolved);
        found
    }

    fn length(curve: &IntersectionCurve) -> f64 {
        curve.points.windows(2).map(|w| w[0].xyz.distance(w[1].xyz)).sum()
    }

    #[test]
    fn a_cylinder_through_the_rim_of_a_hole_leaves_the_arc_outside_of_it() {
        // Circles of radius 1 about 0 and of radius 3/2 about x = 1 meet where x = (1 + 1 - 9/4) / 2 = -1/8.
        let found = cut_by_cylinder(1.0, 1.5, None);
        assert_eq!(found.curves.len(), 1, "one arc, whichever place the cylinder's seam has on it");
        let arc = &found.curves[0];
        assert!(!arc.closed && arc.ends == [CurveEnd::Boundary; 2]);
        let mut ys: Vec<f64> = Vec::new();
        for p in [arc.points[0].xyz, arc.points[arc.points.len() - 1].xyz] {
            assert!((p.x + 0.125).abs() < 1e-4 && (p.truncate().length() - 1.0).abs() < 1e-4, "{p}");
            ys.push(p.y);
        }
        assert!(ys[0] * ys[1] < 0.0);
        let exact = 1.5 * (TAU - 2.0 * 0.75f64.acos());
        assert!((length(arc) / exact - 1.0).abs() < 1e-3, "{} {exact}", length(arc));
        assert!(arc.points.iter().all(|p| p.xyz.truncate().length() > 1.0 - 1e-4));
    }

    #[test]
    fn a_cylinder_inside_the_hole_meets_nothing_and_one_around_it_everything() {
        assert!(cut_by_cylinder(0.0, 0.5, None).curves.is_empty());
        let around = cut_by_cylinder(0.0, 2.0, None);
        assert!(around.curves.len() == 1 && around.curves[0].closed);
        assert!((length(&around.curves[0]) / (2.0 * TAU) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn both_faces_count() {
        // The part of the cylinder that is there ends above the plane, then below it.
        assert!(cut_by_cylinder(1.0, 1.5, Some(0.25)).curves.is_empty());
        let found = cut_by_cylinder(1.0, 1.5, Some(-0.25));
        let exact = 1.5 * (TAU - 2.0 * 0.75f64.acos());
        let total: f64 = found.curves.iter().map(length).sum();
        assert!((total / exact - 1.0).abs() < 1e-3, "{total} {exact}");
    }
}
