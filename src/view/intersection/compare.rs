//! The results of both engines over one another: how far the curves of one are from those of the other.
//!
//! The distance is the larger of the two one-sided Hausdorff distances of the polylines, taken at the points of each
//! from the segments of the other. Cost: points times chunks of segments; chunks farther than the best so far are passed
//! over.

use glam::DVec3;

use super::Found;
use crate::kernel::geom::Aabb;
use crate::kernel::ssi::result::IntersectionCurve;

/// Segments of one chunk.
const CHUNK: usize = 32;

/// The result of the other engine beside the one that is shown.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The other engine's result.
    pub other: Found,
    /// How far a point of either is from the other, in model units; infinite when only one has curves, 0 when none has.
    pub apart: f64,
    /// The total length of the curves of the shown result, and of the other.
    pub lengths: [f64; 2],
}

impl Comparison {
    /// Compares a result with that of the other engine.
    pub fn new(shown: &Found, other: Found) -> Self {
        let (a, b) = (&shown.result.curves, &other.result.curves);
        let apart = farthest(a, b).max(farthest(b, a));
        let lengths = [a, b]
            .map(|curves| curves.iter().flat_map(|c| c.points.windows(2)).map(|p| p[0].xyz.distance(p[1].xyz)).sum());
        Self { other, apart, lengths }
    }
}

struct Chunk {
    bounds: Aabb,
    points: Vec<DVec3>,
}

/// The largest distance of a point of `from` to the curves `to`.
fn farthest(from: &[IntersectionCurve], to: &[IntersectionCurve]) -> f64 {
    let mut chunks = Vec::new();
    for curve in to {
        for start in (0..curve.points.len().saturating_sub(1)).step_by(CHUNK) {
            let end = (start + CHUNK + 1).min(curve.points.len());
            let points: Vec<DVec3> = curve.points[start..end].iter().map(|p| p.xyz).collect();
            chunks.push(Chunk { bounds: Aabb::of(points.iter().copied()), points });
        }
    }
    let mut last = 0;
    let mut most = 0.0_f64;
    for p in from.iter().flat_map(|c| &c.points).map(|p| p.xyz) {
        let mut best = f64::INFINITY;
        // The next point is usually near the same chunk.
        let start = last;
        for k in (0..chunks.len()).map(|k| (k + start) % chunks.len()) {
            let chunk = &chunks[k];
            let outside = (chunk.bounds.min - p).max(p - chunk.bounds.max).max(DVec3::ZERO).length();
            if outside >= best {
                continue;
            }
            let near = chunk.points.windows(2).map(|s| to_segment(p, s[0], s[1])).fold(f64::INFINITY, f64::min);
            if near < best {
                (best, last) = (near, k);
            }
        }
        most = most.max(best);
    }
    most
}

fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    let t = if d == DVec3::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + d * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::intersect::Engine;
    use crate::kernel::job::Job;
    use crate::view::intersection::testing::{document, graph, met, square};
    use crate::view::intersection::{Picks, Request, Task, compute};

    #[test]
    fn both_engines_find_the_same_circle() {
        let model = document([graph(|x, y| x * x + y * y), square(DVec3::Z * 0.25, DVec3::X * 1.5, DVec3::Y * 1.5)]);
        let exact = met(&model);
        let ids: Vec<_> = model.entities().iter().map(|e| e.id).collect();
        let picks = Picks { engine: Some(Engine::Mesh), ..Picks::new(Task::Sets, &ids) };
        let other = compute(&Request::new(&picks, &model).unwrap(), &Job::new()).unwrap();
        assert_eq!((exact.engine, other.engine), (Engine::Bvh, Engine::Mesh));
        let both = Comparison::new(&exact, other);
        assert_eq!(both.other.result.curves.len(), 1);
        assert!(both.apart < 4.0 * exact.result.tol, "{}", both.apart);
        for length in both.lengths {
            assert!((length - std::f64::consts::PI).abs() < 1e-4, "{length}");
        }
    }

    #[test]
    fn a_moved_square_is_as_far_away_as_it_was_moved() {
        let model = |z: f64| {
            let floor = square(DVec3::Z * z, DVec3::X * 1.5, DVec3::Y * 1.5);
            met(&document([graph(|x, _| x), floor]))
        };
        // The lines x = 0 and x = 0.1 on the plane z = x.
        let both = Comparison::new(&model(0.0), model(0.1));
        assert!((both.apart - 0.1 * 2f64.sqrt()).abs() < 1e-9, "{}", both.apart);
        let none = met(&document([square(DVec3::ZERO, DVec3::X, DVec3::Y), square(DVec3::Z, DVec3::X, DVec3::Y)]));
        assert_eq!(Comparison::new(&none, none.clone()).apart, 0.0);
        assert_eq!(Comparison::new(&none, model(0.0)).apart, f64::INFINITY);
    }
}
