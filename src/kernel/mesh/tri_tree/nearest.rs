//! Closest points, triangles within a distance of a point, and triangles near a segment.

use glam::{DVec3, Vec3};

use super::rays::clip;
use super::{Node, STACK, TriTree};
use crate::kernel::geom::Aabb;

/// The point of the triangles nearest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The caller's number of the triangle.
    pub triangle: u32,
    /// The point.
    pub point: DVec3,
    /// Its barycentric coordinates in the triangle.
    pub barycentric: DVec3,
    /// Its distance.
    pub distance: f64,
}

impl TriTree {
    /// The nearest point within `limit` of `p` (infinity for no limit).
    pub fn nearest(&self, p: DVec3, limit: f64) -> Option<Nearest> {
        if self.nodes.is_empty() {
            return None;
        }
        let local = p - self.origin;
        let mut best: Option<Nearest> = None;
        let mut reach = limit * limit;
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let mut depth = 1;
        stack[0] = (0, self.nodes[0].distance_squared(local));
        while depth > 0 {
            depth -= 1;
            let (at, lower) = stack[depth];
            if lower > reach {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.link as usize..(node.link + node.count) as usize {
                    let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                    let barycentric = nearest_on_triangle(p, a, b, c);
                    let point = a * barycentric.x + b * barycentric.y + c * barycentric.z;
                    let squared = point.distance_squared(p);
                    let id = self.ids[k];
                    if squared < reach || (squared == reach && best.is_none_or(|b| id < b.triangle)) {
                        reach = squared;
                        best = Some(Nearest { triangle: id, point, barycentric, distance: squared.sqrt() });
                    }
                }
            } else {
                let (left, right) = (at + 1, at + node.link);
                let l = (left, self.nodes[left as usize].distance_squared(local));
                let r = (right, self.nodes[right as usize].distance_squared(local));
                let (near, far) = if l.1 <= r.1 { (l, r) } else { (r, l) };
                stack[depth] = far;
                stack[depth + 1] = near;
                depth += 2;
            }
        }
        best
    }

    /// The caller's numbers of triangles within `reach` of `p`, with their distances, nearest first, ties by number.
    pub fn within(&self, p: DVec3, reach: f64, found: &mut Vec<Nearest>) {
        found.clear();
        let local = p - self.origin;
        let mut stack = [0_u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let Some(node) = self.nodes.get(at as usize) else { return };
            if node.distance_squared(local) > reach * reach {
                continue;
            }
            if node.count == 0 {
                (stack[depth], stack[depth + 1]) = (at + 1, at + node.link);
                depth += 2;
                continue;
            }
            for k in node.link as usize..(node.link + node.count) as usize {
                let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                let barycentric = nearest_on_triangle(p, a, b, c);
                let point = a * barycentric.x + b * barycentric.y + c * barycentric.z;
                let distance = point.distance(p);
                if distance <= reach {
                    found.push(Nearest { triangle: self.ids[k], point, barycentric, distance });
                }
            }
        }
        found.sort_unstable_by(|x, y| x.distance.total_cmp(&y.distance).then(x.triangle.cmp(&y.triangle)));
    }

    /// The caller's numbers, increasing, of triangles whose boxes grown by `margin` meet the segment: all that
    /// come within `margin` of it, and some more.
    pub fn near_segment(&self, a: DVec3, b: DVec3, margin: f64, found: &mut Vec<u32>) {
        found.clear();
        let (a, d) = (a - self.origin, b - a);
        let meets = |min: DVec3, max: DVec3| clip(&Aabb { min, max }.grown(margin), a, d, [0.0, 1.0]).is_some();
        let mut stack = vec![0_u32];
        while let Some(at) = stack.pop() {
            let Some(node) = self.nodes.get(at as usize) else { return };
            if !meets(Vec3::from_array(node.min).as_dvec3(), Vec3::from_array(node.max).as_dvec3()) {
                continue;
            }
            if node.count == 0 {
                stack.extend([at + 1, at + node.link]);
                continue;
            }
            for k in node.link as usize..(node.link + node.count) as usize {
                let own = Aabb::of(self.triangles[k].map(|p| self.points[p as usize] - self.origin));
                if meets(own.min, own.max) {
                    found.push(self.ids[k]);
                }
            }
        }
        found.sort_unstable();
    }
}

impl Node {
    fn distance_squared(&self, p: DVec3) -> f64 {
        let (min, max) = (Vec3::from_array(self.min).as_dvec3(), Vec3::from_array(self.max).as_dvec3());
        (min - p).max(p - max).max(DVec3::ZERO).length_squared()
    }
}

/// Barycentric coordinates of the point of a triangle nearest to `p` (Ericson, *Real-time collision detection*,
/// 2005, 5.1.5). Degenerate triangles are segments or points.
pub fn nearest_on_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return DVec3::X;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return DVec3::Y;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return DVec3::new(1.0 - t, t, 0.0);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return DVec3::Z;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return DVec3::new(1.0 - t, 0.0, t);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return DVec3::new(0.0, 1.0 - t, t);
    }
    let sum = va + vb + vc;
    DVec3::new(va, vb, vc) / sum
}

#[cfg(test)]
mod tests {
    use super::super::tests::{numbers, soup};
    use super::*;

    #[test]
    fn nearest_agrees_with_dense_sampling_from_above_and_brute_force() {
        let (points, triangles) = soup(200, DVec3::ZERO, 1.0);
        let tree = TriTree::new(points.clone(), &triangles);
        let mut next = numbers(5);
        for _ in 0..100 {
            let p = DVec3::new(next(), next(), next()) * 1.5;
            let found = tree.nearest(p, f64::INFINITY).unwrap();
            let mut sampled = f64::INFINITY;
            for t in &triangles {
                let [a, b, c] = t.map(|i| points[i as usize]);
                for i in 0..=20 {
                    for j in 0..=20 - i {
                        let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                        sampled = sampled.min((a + (b - a) * u + (c - a) * v).distance(p));
                    }
                }
            }
            assert!(found.distance <= sampled + 1e-12);
            assert!(sampled - found.distance < 0.02, "{} {sampled}", found.distance);
            assert!(tree.nearest(p, found.distance * 0.999).is_none());
        }
    }
}
