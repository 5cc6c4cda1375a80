//! Rays and segments.
//!
//! Triangles are tested as Woop, Benthin and Wald do (*Watertight ray/triangle intersection*, 2013): a ray through a
//! shared edge or vertex hits at least one of the triangles there. Boxes are culled in `f32` from where the line enters
//! the root, with a margin; hits are found in `f64`.

use glam::{DVec3, Vec3};

use super::{Node, STACK, TriTree};
use crate::kernel::geom::Aabb;

/// Where a line meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The caller's number of the triangle.
    pub triangle: u32,
    /// The place on the line: `origin + t * direction`.
    pub t: f64,
    /// Barycentric coordinates of the point in the triangle.
    pub barycentric: DVec3,
}

impl TriTree {
    /// The first hit with `0 <= t <= t_max`.
    pub fn first_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(origin, direction, [0.0, t_max], |hit| {
            // Equal distances (a shared edge) go to the lower number, whatever the order of the visit.
            if best.is_none_or(|b| hit.t < b.t || (hit.t == b.t && hit.triangle < b.triangle)) {
                best = Some(hit);
            }
            best.map_or(t_max, |b| b.t)
        });
        best
    }

    /// Whether anything is hit with `0 <= t <= t_max`: cheaper than the first hit.
    pub fn is_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> bool {
        let mut hit = false;
        self.visit(origin, direction, [0.0, t_max], |_| {
            hit = true;
            f64::NEG_INFINITY
        });
        hit
    }

    /// All hits of the segment from `a` (t = 0) to `b` (t = 1), by increasing t, ties by triangle number. A
    /// segment through a shared edge reports every triangle at it.
    pub fn segment_hits(&self, a: DVec3, b: DVec3, hits: &mut Vec<Hit>) {
        hits.clear();
        self.visit(a, b - a, [0.0, 1.0], |hit| {
            hits.push(hit);
            1.0
        });
        hits.sort_unstable_by(|x, y| x.t.total_cmp(&y.t).then(x.triangle.cmp(&y.triangle)));
    }

    /// Calls `found` for every hit in the range of t that may still matter; what it returns is the new end of
    /// the range.
    fn visit(&self, origin: DVec3, direction: DVec3, range: [f64; 2], mut found: impl FnMut(Hit) -> f64) {
        let Some(bounds) = self.bounds else { return };
        // Start where the line enters the (grown) root, so that f32 sees only numbers of the model's size.
        let grown = bounds.grown(1e-5 * bounds.size().max_element() + f64::MIN_POSITIVE);
        let Some([enter, leave]) = clip(&grown, origin, direction, range) else { return };
        let start = origin + direction * enter;
        let ray = Sheared::new(start, direction);
        let o = (start - self.origin).as_vec3();
        let scale = direction.abs().max_element();
        let guard = |x: f64| {
            let x = x / scale;
            (if x.abs() < 1e-18 { 1e18_f64.copysign(x) } else { 1.0 / x }) as f32
        };
        let inverse = Vec3::new(guard(direction.x), guard(direction.y), guard(direction.z));
        // Culling runs in t scaled by the largest component, from the entry point; a little is added to the end.
        let to_cull = |t: f64| ((t - enter) * scale) as f32 * (1.0 + 1e-5) + f32::MIN_POSITIVE;
        let mut end = leave;
        let mut cull = to_cull(end);
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut depth = 0;
        if self.nodes[0].enter(o, inverse, cull).is_none() {
            return;
        }
        let mut at = 0_u32;
        loop {
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.link as usize..(node.link + node.count) as usize {
                    let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                    if let Some((t, barycentric)) = ray.hit(a, b, c) {
                        let t = t + enter;
                        if t >= range[0] && t <= end {
                            end = found(Hit { triangle: self.ids[k], t, barycentric }).min(end);
                            cull = to_cull(end);
                        }
                    }
                }
            } else {
                let (left, right) = (at + 1, at + node.link);
                let hit = |k: u32| self.nodes[k as usize].enter(o, inverse, cull);
                match (hit(left), hit(right)) {
                    (Some(l), Some(r)) => {
                        let (first, second) = if l <= r { (left, (right, r)) } else { (right, (left, l)) };
                        stack[depth] = second;
                        depth += 1;
                        at = first;
                        continue;
                    }
                    (Some(_), None) => {
                        at = left;
                        continue;
                    }
                    (None, Some(_)) => {
                        at = right;
                        continue;
                    }
                    (None, None) => {}
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                let (next, near) = stack[depth];
                if near <= cull {
                    at = next;
                    break;
                }
            }
        }
    }
}

/// The smallest t >= 0 at which a ray hits one of these triangles, found without a tree: for a few rays where nothing
/// else needs one. O(n).
pub fn first_hit(points: &[DVec3], triangles: &[[u32; 3]], origin: DVec3, direction: DVec3) -> Option<f64> {
    let ray = Sheared::new(origin, direction);
    let corner = |k: u32| points.get(k as usize).copied().unwrap_or(DVec3::NAN);
    let hits = triangles.iter().filter_map(|&[a, b, c]| ray.hit(corner(a), corner(b), corner(c)));
    hits.map(|(t, _)| t).filter(|&t| t >= 0.0).min_by(f64::total_cmp)
}

impl Node {
    /// Where the ray enters the box, `None` when it misses it or enters behind `end`.
    fn enter(&self, o: Vec3, inverse: Vec3, end: f32) -> Option<f32> {
        let low = (Vec3::from_array(self.min) - o) * inverse;
        let high = (Vec3::from_array(self.max) - o) * inverse;
        let (a, b) = (low.min(high), low.max(high));
        let near = a.x.max(a.y).max(a.z).max(0.0);
        let far = b.x.min(b.y).min(b.z).min(end);
        (near <= far).then_some(near)
    }
}

/// The part of the range where the line is inside the box.
pub(super) fn clip(bounds: &Aabb, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<[f64; 2]> {
    if !(direction.is_finite() && origin.is_finite()) || direction == DVec3::ZERO {
        return None;
    }
    let [mut enter, mut leave] = range;
    for k in 0..3 {
        if direction[k] == 0.0 {
            if origin[k] < bounds.min[k] || origin[k] > bounds.max[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((bounds.min[k] - origin[k]) / direction[k], (bounds.max[k] - origin[k]) / direction[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some([enter, leave])
}

/// A ray in coordinates in which it runs along z.
struct Sheared {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Sheared {
    fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.abs();
        let z = if d.x >= d.y && d.x >= d.z {
            0
        } else if d.y >= d.z {
            1
        } else {
            2
        };
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let along = direction[z];
        Self { origin, axes, shear: DVec3::new(direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along) }
    }

    /// t and barycentric coordinates of the hit; none on triangles seen edge-on. The products are not fused, so
    /// that both triangles at an edge compute the same number for it.
    fn hit(&self, a: DVec3, b: DVec3, c: DVec3) -> Option<(f64, DVec3)> {
        let [x, y, z] = self.axes;
        let [a, b, c] = [a, b, c].map(|p| {
            let p = p - self.origin;
            DVec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let barycentric = DVec3::new(u, v, w) / det;
        let t = barycentric.dot(DVec3::new(a.z, b.z, c.z));
        (t.is_finite() && barycentric.is_finite()).then_some((t, barycentric))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{numbers, soup};
    use super::*;

    /// An independent test by solving for the intersection with the plane and the barycentric coordinates.
    fn slow_hit(o: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let m = glam::DMat3::from_cols(b - a, c - a, -d);
        let x = m.inverse() * (o - a);
        (x.x >= 0.0 && x.y >= 0.0 && x.x + x.y <= 1.0).then_some(x.z)
    }

    #[test]
    fn hits_agree_with_brute_force_near_and_far_from_the_origin() {
        for (shift, scale) in [(DVec3::ZERO, 1.0), (DVec3::new(1e4, -2e4, 3e4), 1.0), (DVec3::ZERO, 1e-3)] {
            let (points, triangles) = soup(500, shift, scale);
            let tree = TriTree::new(points.clone(), &triangles);
            let mut next = numbers(99);
            let (mut seen, mut hits) = (0, Vec::new());
            for _ in 0..300 {
                let a = DVec3::new(next(), next(), next()) * (2.0 * scale) + shift;
                let b = DVec3::new(next(), next(), next()) * (2.0 * scale) + shift;
                let mut slow: Vec<(f64, u32)> = (0..500)
                    .filter_map(|k| {
                        let t = slow_hit(a, b - a, triangles[k].map(|i| points[i as usize]))?;
                        (0.0..=1.0).contains(&t).then_some((t, k as u32))
                    })
                    .collect();
                slow.sort_by(|x, y| x.0.total_cmp(&y.0));
                tree.segment_hits(a, b, &mut hits);
                assert_eq!(
                    hits.iter().map(|h| h.triangle).collect::<Vec<_>>(),
                    slow.iter().map(|s| s.1).collect::<Vec<_>>()
                );
                let first = tree.first_hit(a, b - a, 1.0);
                assert_eq!(first.map(|h| h.triangle), slow.first().map(|s| s.1));
                let plain = super::first_hit(&points, &triangles, a, b - a).filter(|&t| t <= 1.0);
                assert!(plain.zip(first).map_or(plain.is_none() && first.is_none(), |(t, h)| (t - h.t).abs() < 1e-9));
                if let Some(h) = first {
                    seen += 1;
                    let [p, q, r] = triangles[h.triangle as usize].map(|i| points[i as usize]);
                    let inside = p * h.barycentric.x + q * h.barycentric.y + r * h.barycentric.z;
                    assert!(inside.distance(a + (b - a) * h.t) < 1e-10 * (scale + shift.length()));
                }
            }
            assert!(seen > 50, "the test must meet something, {seen}");
        }
    }

    #[test]
    fn rays_at_shared_edges_and_vertices_never_slip_through() {
        // A fan of triangles around the origin, its rim beyond the rays.
        let n = 7;
        let rim = |k: u32| {
            let a = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
            DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 0.1 * (3.0 * a).sin())
        };
        let mut points = vec![DVec3::ZERO];
        points.extend((0..n).map(rim));
        let triangles: Vec<[u32; 3]> = (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect();
        let tree = TriTree::new(points.clone(), &triangles);
        let mut next = numbers(3);
        for _ in 0..200 {
            let eye = DVec3::new(next(), next(), 5.0);
            for k in 0..n as usize {
                for s in [0.0, 0.1, 1.0 / 3.0, 0.7] {
                    let target = points[0].lerp(points[1 + k], s);
                    assert!(tree.first_hit(eye, target - eye, 2.0).is_some(), "edge {k} at {s} from {eye}");
                }
            }
        }
    }

    #[test]
    fn a_camera_a_million_diagonals_away_still_picks() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let tree = TriTree::new(points, &[[0, 1, 2]]);
        let eye = DVec3::new(0.3, 0.3, 1e6);
        let hit = tree.first_hit(eye, DVec3::new(0.0, 0.0, -1.0), f64::INFINITY).unwrap();
        assert!((hit.t - 1e6).abs() < 1e-6);
        assert!(tree.first_hit(eye, DVec3::new(0.0, 1e-6, -1.0), f64::INFINITY).is_none());
    }
}
