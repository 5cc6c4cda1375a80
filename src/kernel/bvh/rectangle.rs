//! Rectangles in space: their distance, exactly, and a quick test that two are farther apart than a given length.
//!
//! The distance is the least of 16 edge-edge and 8 corner-face distances, and 0 where an edge of one pierces the
//! other. The quick test (Gottschalk, Lin, Manocha: OBBTree, 1996) projects on up to ten axes; each projection's gap
//! is a lower bound of the distance.

use glam::DVec3;

/// A rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Its middle.
    pub center: DVec3,
    /// Orthonormal directions of its edges.
    pub axes: [DVec3; 2],
    /// Half the edge lengths, not negative.
    pub half: [f64; 2],
}

impl Rectangle {
    /// From nearly orthonormal directions, which are made so.
    pub fn new(center: DVec3, axes: [DVec3; 2], half: [f64; 2]) -> Self {
        let u = axes[0].normalize_or(DVec3::X);
        let v = (axes[1] - u * axes[1].dot(u)).normalize_or(u.any_orthonormal_vector());
        Self { center, axes: [u, v], half }
    }

    /// Corners in order around the rectangle.
    pub fn corners(&self) -> [DVec3; 4] {
        let (u, v) = (self.axes[0] * self.half[0], self.axes[1] * self.half[1]);
        [self.center - u - v, self.center + u - v, self.center + u + v, self.center - u + v]
    }

    /// The unit normal, the cross product of the directions.
    pub fn normal(&self) -> DVec3 {
        self.axes[0].cross(self.axes[1])
    }

    /// The distance to a point.
    pub fn distance_to(&self, p: DVec3) -> f64 {
        let d = p - self.center;
        let out = |k: usize| {
            let along = d.dot(self.axes[k]);
            along - along.clamp(-self.half[k], self.half[k])
        };
        let height = d.dot(self.normal());
        DVec3::new(out(0), out(1), height).length()
    }

    /// The distance to another rectangle.
    pub fn distance(&self, other: &Self) -> f64 {
        let (a, b) = (self.corners(), other.corners());
        let edge = |c: &[DVec3; 4], i: usize| (c[i], c[(i + 1) % 4]);
        if (0..4).any(|i| other.pierced(edge(&a, i)) || self.pierced(edge(&b, i))) {
            return 0.0;
        }
        let mut least = f64::INFINITY;
        for p in a {
            least = least.min(other.distance_to(p));
        }
        for p in b {
            least = least.min(self.distance_to(p));
        }
        for i in 0..4 {
            for j in 0..4 {
                least = least.min(segment_distance(edge(&a, i), edge(&b, j)));
            }
        }
        least
    }

    /// Whether a segment passes through it.
    fn pierced(&self, (p, q): (DVec3, DVec3)) -> bool {
        let n = self.normal();
        let (hp, hq) = ((p - self.center).dot(n), (q - self.center).dot(n));
        if hp * hq > 0.0 || hp == hq {
            return false;
        }
        let d = p + (q - p) * (hp / (hp - hq)) - self.center;
        d.dot(self.axes[0]).abs() <= self.half[0] && d.dot(self.axes[1]).abs() <= self.half[1]
    }
}

/// The distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9), safe where they are parallel or
/// points: a clamped end is re-projected, and both clamped solutions are tried.
fn segment_distance((p1, q1): (DVec3, DVec3), (p2, q2): (DVec3, DVec3)) -> f64 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, b) = (d1.length_squared(), d2.length_squared(), d1.dot(d2));
    let (c, f) = (d1.dot(r), d2.dot(r));
    let on = |t: f64, length: f64| if length > 0.0 { (t / length).clamp(0.0, 1.0) } else { 0.0 };
    let gap = |s: f64, t: f64| (r + d1 * s - d2 * t).length();
    let denominator = a * e - b * b;
    let s = if denominator > 0.0 { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let t = on(b * s + f, e);
    let mut least = gap(on(b * t - c, a), t);
    // Ends against the other segment: what remains when the interior solution is ill-conditioned.
    for s in [0.0, 1.0] {
        least = least.min(gap(s, on(b * s + f, e)));
    }
    for t in [0.0, 1.0] {
        least = least.min(gap(on(b * t - c, a), t));
    }
    least
}

/// A parallelogram as the separation test takes it: directions need not be exactly orthonormal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Nearly orthonormal directions.
    pub axes: [DVec3; 2],
    /// Half lengths.
    pub half: [f64; 2],
}

/// Whether two patches, the second `shift` away from the first, are certainly farther apart than `reach`.
#[inline]
pub(crate) fn separated(a: &Patch, b: &Patch, shift: DVec3, reach: f64) -> bool {
    let ([u1, v1], [u2, v2]) = (a.axes, b.axes);
    let ([p1, q1], [p2, q2]) = (a.half, b.half);
    let n1 = u1.cross(v1);
    if shift.dot(n1).abs() - p2 * u2.dot(n1).abs() - q2 * v2.dot(n1).abs() > reach {
        return true;
    }
    let n2 = u2.cross(v2);
    if shift.dot(n2).abs() - p1 * u1.dot(n2).abs() - q1 * v1.dot(n2).abs() > reach {
        return true;
    }
    let (uu, uv, vu, vv) = (u1.dot(u2), u1.dot(v2), v1.dot(u2), v1.dot(v2));
    if shift.dot(u1).abs() - p1 - p2 * uu.abs() - q2 * uv.abs() > reach
        || shift.dot(v1).abs() - q1 - p2 * vu.abs() - q2 * vv.abs() > reach
        || shift.dot(u2).abs() - p2 - p1 * uu.abs() - q1 * vu.abs() > reach
        || shift.dot(v2).abs() - q2 - p1 * uv.abs() - q1 * vv.abs() > reach
    {
        return true;
    }
    for (x, hx, ox, hox) in [(u1, p1, v1, q1), (v1, q1, u1, p1)] {
        for (y, hy, oy, hoy) in [(u2, p2, v2, q2), (v2, q2, u2, p2)] {
            let axis = x.cross(y);
            let _ = (hx, hy);
            let gap = shift.dot(axis).abs() - hox * ox.dot(axis).abs() - hoy * oy.dot(axis).abs();
            if gap > 0.0 && gap * gap > reach * reach * axis.length_squared() {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

    fn random(random: &mut Random) -> Rectangle {
        let size = |r: &mut Random| if r.next() < 0.15 { 0.0 } else { 10.0_f64.powf(2.0 * r.signed() - 0.5) };
        let half = [size(random), size(random)];
        // Often parallel to the axes, where edges and faces line up.
        let axes = if random.next() < 0.3 { [DVec3::Y, DVec3::Z] } else { [random.vector(), random.vector()] };
        let center = random.vector() * if random.next() < 0.3 { 0.0 } else { 3.0 };
        Rectangle::new(center, axes, half)
    }

    /// The least distance by the optimality conditions: each of the four coordinates is at either end or free.
    fn brute_force(a: &Rectangle, b: &Rectangle) -> f64 {
        let columns = [a.axes[0], a.axes[1], -b.axes[0], -b.axes[1]];
        let half = [a.half[0], a.half[1], b.half[0], b.half[1]];
        let offset = a.center - b.center;
        let mut least = f64::INFINITY;
        for state in 0..81 {
            let states = [state % 3, state / 3 % 3, state / 9 % 3, state / 27];
            let free: Vec<usize> = (0..4).filter(|&k| states[k] == 2).collect();
            let mut x = [0.0; 4];
            let mut fixed = offset;
            for k in 0..4 {
                if states[k] < 2 {
                    x[k] = if states[k] == 0 { -half[k] } else { half[k] };
                    fixed += columns[k] * x[k];
                }
            }
            // Normal equations of the free ones, by elimination; dependent columns are covered by other states.
            let n = free.len();
            let mut m = vec![vec![0.0; n + 1]; n];
            for (i, &p) in free.iter().enumerate() {
                for (j, &q) in free.iter().enumerate() {
                    m[i][j] = columns[p].dot(columns[q]);
                }
                m[i][n] = -columns[p].dot(fixed);
            }
            let mut regular = true;
            for i in 0..n {
                let best = (i..n).max_by(|&p, &q| m[p][i].abs().total_cmp(&m[q][i].abs())).unwrap();
                m.swap(i, best);
                if m[i][i].abs() < 1e-9 {
                    regular = false;
                    break;
                }
                for r in 0..n {
                    if r != i {
                        let f = m[r][i] / m[i][i];
                        for c in i..=n {
                            m[r][c] -= f * m[i][c];
                        }
                    }
                }
            }
            if !regular {
                continue;
            }
            for (i, &k) in free.iter().enumerate() {
                x[k] = (m[i][n] / m[i][i]).clamp(-half[k], half[k]);
            }
            let d = (0..4).fold(offset, |d, k| d + columns[k] * x[k]);
            least = least.min(d.length());
        }
        least
    }

    #[test]
    fn the_distance_is_that_of_the_optimality_conditions() {
        let mut numbers = Random(7);
        let mut touching = 0;
        for _ in 0..4000 {
            let (a, b) = (random(&mut numbers), random(&mut numbers));
            let (distance, expected) = (a.distance(&b), brute_force(&a, &b));
            let scale = a.center.distance(b.center) + a.half[0] + a.half[1] + b.half[0] + b.half[1];
            assert!((distance - expected).abs() < 1e-7 * scale, "{distance} {expected} {a:?} {b:?}");
            assert!((distance - b.distance(&a)).abs() < 1e-12 * scale);
            touching += usize::from(distance == 0.0);
        }
        assert!((200..2000).contains(&touching), "{touching}");
    }

    #[test]
    fn separated_is_never_wrong_and_rarely_shy() {
        let mut numbers = Random(8);
        let (mut apart, mut missed) = (0, 0);
        for _ in 0..20_000 {
            let (a, b) = (random(&mut numbers), random(&mut numbers));
            let distance = a.distance(&b);
            let reach = distance * (0.5 + numbers.next());
            let patch = |r: &Rectangle| Patch { axes: r.axes, half: r.half };
            let says = separated(&patch(&a), &patch(&b), b.center - a.center, reach);
            assert!(!says || distance > reach * (1.0 - 1e-9), "{a:?} {b:?} {reach}");
            if distance > reach {
                apart += 1;
                missed += usize::from(!says);
            }
        }
        // A corner against a corner or an edge has no axis of its own; that is the price of the quick test.
        assert!(5 * missed < apart, "{missed} of {apart}");
    }
}
