//! Exact orientation signs for two meshes of which the second is moved by an infinitesimal (e, e^2, e^3).
//!
//! Points of A are exact; every point b of B stands for b + (e, e^2, e^3) with e > 0 smaller than any number.
//! Signs that vanish for the given coordinates are decided by the first derivative along x, then y, then z that
//! does not vanish. All signs then belong to one configuration that exists, in which no vertex lies on a plane
//! of the other mesh and no edges meet: vertex-on-edge hits, coplanar and duplicate triangles need no cases of
//! their own and cannot break the topology (the idea of simulation of simplicity, Edelsbrunner and Muecke,
//! ACM Trans. Graphics 9, 1990, reduced to one translation). Only a triangle without area has no side: its
//! sign is [`Sign::None`].
//!
//! The undisturbed signs come from Shewchuk's adaptive predicates (crate `robust`).

use glam::DVec3;
use robust::{Coord3D, orient3d};

/// The side of a point, never undecided for a triangle with area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Below the plane or clockwise.
    Negative,
    /// Above the plane or counter-clockwise.
    Positive,
    /// The triangle has no area, or the two edges are parallel and in one plane whatever the shift.
    None,
}

impl Sign {
    fn of(value: f64) -> Self {
        match value {
            v if v > 0.0 => Self::Positive,
            v if v < 0.0 => Self::Negative,
            _ => Self::None,
        }
    }

    /// The other side.
    #[must_use]
    pub fn flipped(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
            Self::None => Self::None,
        }
    }

    fn or_else(self, other: impl FnOnce() -> Self) -> Self {
        if self == Self::None { other() } else { self }
    }
}

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// The sign of the determinant (a - d, b - d, c - d), exact.
fn exact(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Sign {
    Sign::of(orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// The side of the (shifted) point `b` of B to the triangle of A; positive below its normal.
pub fn point_of_b(triangle: [DVec3; 3], b: DVec3) -> Sign {
    let [p, q, r] = triangle;
    // Shifting b by s changes the determinant by -(normal . s).
    exact(p, q, r, b).or_else(|| first_component(q - p, r - p, [(p, q), (p, r)]).flipped())
}

/// The side of the point `a` of A to the (shifted) triangle of B.
pub fn point_of_a(triangle: [DVec3; 3], a: DVec3) -> Sign {
    let [p, q, r] = triangle;
    // Shifting the triangle by s is shifting a by -s.
    exact(p, q, r, a).or_else(|| first_component(q - p, r - p, [(p, q), (p, r)]))
}

/// The sign of the tetrahedron of the edge `a` of A and the (shifted) edge `b` of B: on which side a passes b.
pub fn edges(a: [DVec3; 2], b: [DVec3; 2]) -> Sign {
    // Shifting b by s changes the determinant det(a0 - b1, a1 - b1, b0 - b1) by ((a1 - a0) x (b1 - b0)) . s.
    exact(a[0], a[1], b[0], b[1]).or_else(|| first_component(a[1] - a[0], b[1] - b[0], [(a[0], a[1]), (b[0], b[1])]))
}

/// The sign of the first component of u x v that is not zero, exactly; u and v are the (rounded) differences
/// of the point pairs.
fn first_component(u: DVec3, v: DVec3, pairs: [(DVec3, DVec3); 2]) -> Sign {
    let component = |i: usize, j: usize| {
        let [(u0, u1), (v0, v1)] = pairs;
        let (left, right) = (u[i] * v[j], u[j] * v[i]);
        let estimate = left - right;
        if estimate.abs() > 1e-14 * (left.abs() + right.abs()) && estimate.is_normal() {
            return Sign::of(estimate);
        }
        exact_minor([u0[i], u1[i], u0[j], u1[j]], [v0[i], v1[i], v0[j], v1[j]])
    };
    component(1, 2).or_else(|| component(2, 0)).or_else(|| component(0, 1))
}

/// The exact sign of (u1 - u0)(v3 - v2) - (u3 - u2)(v1 - v0) for u = [u0, u1, u2, u3] and v alike.
fn exact_minor(u: [f64; 4], v: [f64; 4]) -> Sign {
    let mut terms = Vec::with_capacity(16);
    let mut add = |x: [f64; 2], y: [f64; 2], sign: f64| {
        for &a in &x {
            for &b in &y {
                let p = a * b;
                terms.extend([sign * p, sign * a.mul_add(b, -p)]);
            }
        }
    };
    add(two_diff(u[1], u[0]), two_diff(v[3], v[2]), 1.0);
    add(two_diff(u[3], u[2]), two_diff(v[1], v[0]), -1.0);
    Sign::of(expansion_sum(&terms))
}

/// a - b as an unevaluated sum of two floats (Knuth).
fn two_diff(a: f64, b: f64) -> [f64; 2] {
    let x = a - b;
    let virtual_b = a - x;
    let virtual_a = x + virtual_b;
    [x, (a - virtual_a) + (virtual_b - b)]
}

/// A float with the sign of the exact sum: a non-overlapping expansion grown term by term (Shewchuk 1997).
fn expansion_sum(terms: &[f64]) -> f64 {
    let mut expansion: Vec<f64> = Vec::with_capacity(terms.len());
    for &term in terms {
        let mut carry = term;
        for part in &mut expansion {
            let sum = carry + *part;
            let virtual_part = sum - carry;
            *part = (carry - (sum - virtual_part)) + (*part - virtual_part);
            carry = sum;
        }
        expansion.push(carry);
    }
    expansion.into_iter().rev().find(|&part| part != 0.0).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn a_point_in_the_plane_is_decided_by_the_shift() {
        // B moves up by e^3, so its point is above A's triangle, and A's point is below B's.
        assert_eq!(point_of_b(TRIANGLE, DVec3::new(0.2, 0.2, 0.0)), point_of_b(TRIANGLE, DVec3::new(0.2, 0.2, 1.0)));
        assert_eq!(point_of_a(TRIANGLE, DVec3::new(0.2, 0.2, 0.0)), point_of_a(TRIANGLE, DVec3::new(0.2, 0.2, -1.0)));
    }

    #[test]
    fn signs_agree_with_a_small_true_shift() {
        // Small integers make many exact zeros; a true shift by exact powers of two then decides as e does.
        let mut state = 12_345_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 60) as f64 % 3.0
        };
        let shift = DVec3::new(2f64.powi(-10), 2f64.powi(-20), 2f64.powi(-30));
        let mut zeros = 0;
        for _ in 0..20_000 {
            let mut point = || DVec3::new(next(), next(), next());
            let (p, q, r, s) = (point(), point(), point(), point());
            zeros += usize::from(exact(p, q, r, s) == Sign::None);
            assert_eq!(point_of_b([p, q, r], s), exact(p, q, r, s + shift));
            assert_eq!(point_of_a([p, q, r], s), exact(p + shift, q + shift, r + shift, s));
            assert_eq!(edges([p, q], [r, s]), exact(p, q, r + shift, s + shift));
        }
        assert!(zeros > 1000);
    }

    #[test]
    fn minors_are_exact_where_rounding_cancels_everything() {
        let (a, b) = (1.0 + f64::EPSILON, 1.0 - f64::EPSILON / 2.0);
        // a b - 1 * 1 = eps / 2 - eps^2 / 2 > 0, lost in plain arithmetic by cancellation at 1.
        assert_eq!(exact_minor([0.0, a, 0.0, 1.0], [0.0, 1.0, 0.0, b]), Sign::Positive);
        assert_eq!(exact_minor([0.0, 3.0, 0.0, 1.5], [0.0, 2.0, 0.0, 1.0]), Sign::None);
    }
}
