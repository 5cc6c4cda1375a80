//! Control nets in lanes: what the builders work on.
//!
//! A net holds its coordinates one after the other (all x, all y, all z, and w where it is rational), u running
//! fastest, relative to the patch's own origin. [`Shape`] carries the degrees; for the bicubic polynomial it is a
//! constant, so that the loops over the net unroll.

use std::ops::{Add, Mul};

use glam::DVec3;
use pulp::Simd;

use crate::kernel::geom::{BezierPatch, Direction, MAX_DEGREE};
use crate::kernel::num::lanes::{F, F3};

/// Degrees and kind of a net.
pub(crate) trait Shape: Copy + Send + Sync {
    /// Whether there is a weight.
    const RATIONAL: bool;

    /// The degrees in u and v.
    fn degree(self) -> [usize; 2];

    /// The number of control points.
    #[inline(always)]
    fn count(self) -> usize {
        let [p, q] = self.degree();
        (p + 1) * (q + 1)
    }

    /// The number of coordinates of a point.
    #[inline(always)]
    fn dims(self) -> usize {
        if Self::RATIONAL { 4 } else { 3 }
    }

    /// The number of numbers in a net.
    #[inline(always)]
    fn size(self) -> usize {
        self.count() * self.dims()
    }
}

/// The fast path: bicubic, polynomial.
#[derive(Clone, Copy)]
pub(crate) struct Bicubic;

impl Shape for Bicubic {
    const RATIONAL: bool = false;

    #[inline(always)]
    fn degree(self) -> [usize; 2] {
        [3, 3]
    }
}

/// Any degrees.
#[derive(Clone, Copy)]
pub(crate) struct General<const RATIONAL: bool>(pub [usize; 2]);

impl<const R: bool> Shape for General<R> {
    const RATIONAL: bool = R;

    #[inline(always)]
    fn degree(self) -> [usize; 2] {
        self.0
    }
}

/// The net of a patch relative to `origin`, as plain numbers in the order of this module.
pub(crate) fn plain_net(patch: &BezierPatch, origin: DVec3) -> Vec<f64> {
    let dims = if patch.rational { 4 } else { 3 };
    let mut net = Vec::with_capacity(patch.points.len() * dims);
    for k in 0..dims {
        net.extend(patch.points.iter().map(|h| {
            if !patch.rational {
                h[k] - origin[k]
            } else if k == 3 {
                h.w
            } else {
                // (P - origin) w, with the difference taken first: it is the one that may cancel.
                (h[k] / h.w - origin[k]) * h.w
            }
        }));
    }
    net
}

/// Splits a net in the middle of a direction: plain numbers or lanes, the same bits.
#[inline(always)]
pub(crate) fn split<T: Copy + Add<Output = T> + Mul<f64, Output = T>, H: Shape>(
    shape: H,
    direction: Direction,
    net: &[T],
    low: &mut [T],
    high: &mut [T],
) {
    let [p, q] = shape.degree();
    let (width, height) = (p + 1, q + 1);
    let (lines, length, stride, step) = match direction {
        Direction::U => (height, width, 1, width),
        Direction::V => (width, height, width, 1),
    };
    for dim in 0..shape.dims() {
        let range = dim * shape.count()..(dim + 1) * shape.count();
        let (net, low, high) = (&net[range.clone()], &mut low[range.clone()], &mut high[range]);
        for line in 0..lines {
            let at = |i: usize| line * step + i * stride;
            if length == 4 {
                let [a, b, c, d] = [net[at(0)], net[at(1)], net[at(2)], net[at(3)]];
                let (ab, bc, cd) = ((a + b) * 0.5, (b + c) * 0.5, (c + d) * 0.5);
                let (abc, bcd) = ((ab + bc) * 0.5, (bc + cd) * 0.5);
                let middle = (abc + bcd) * 0.5;
                (low[at(0)], low[at(1)], low[at(2)], low[at(3)]) = (a, ab, abc, middle);
                (high[at(0)], high[at(1)], high[at(2)], high[at(3)]) = (middle, bcd, cd, d);
                continue;
            }
            for i in 0..length {
                high[at(i)] = net[at(i)];
            }
            low[at(0)] = net[at(0)];
            for level in 1..length {
                for i in 0..length - level {
                    high[at(i)] = (high[at(i)] + high[at(i + 1)]) * 0.5;
                }
                low[at(level)] = high[at(0)];
            }
        }
    }
}

/// The Cartesian control point at an index.
#[inline(always)]
pub(crate) fn point<S: Simd, H: Shape>(shape: H, net: &[F<S>], at: usize) -> F3<S> {
    let n = shape.count();
    let p = F3::new(net[at], net[n + at], net[2 * n + at]);
    if H::RATIONAL { p * (p.x.with(1.0) / net[3 * n + at]) } else { p }
}

/// The corner control points: (0,0), (1,0), (0,1), (1,1).
#[inline(always)]
pub(crate) fn corners<S: Simd, H: Shape>(shape: H, net: &[F<S>]) -> [F3<S>; 4] {
    let [p, _] = shape.degree();
    let n = shape.count();
    [point(shape, net, 0), point(shape, net, p), point(shape, net, n - p - 1), point(shape, net, n - 1)]
}

/// Bezier coefficients of degree p to powers of s on [-1, 1]: row k gives the coefficient of s^k.
pub(crate) fn power_matrix(p: usize) -> Vec<f64> {
    let mut matrix = vec![0.0; (p + 1) * (p + 1)];
    for i in 0..=p {
        // C(p, i) (1 - s)^(p - i) (1 + s)^i / 2^p
        let mut poly = [0.0; MAX_DEGREE + 1];
        poly[0] = binomial(p, i) * 0.5_f64.powi(p as i32);
        for factor in 0..p {
            let sign = if factor < i { 1.0 } else { -1.0 };
            for k in (1..=factor + 1).rev() {
                poly[k] += sign * poly[k - 1];
            }
        }
        for k in 0..=p {
            matrix[k * (p + 1) + i] = poly[k];
        }
    }
    matrix
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |b, i| b * (n - i) as f64 / (i + 1) as f64)
}

/// Rewrites a net in powers of (s, t) on [-1, 1]^2 about the middle, `out[k]` for s^i t^j at j * (p + 1) + i.
/// `matrices` are those of [`power_matrix`] for the two degrees.
#[inline(always)]
pub(crate) fn powers<S: Simd, H: Shape>(shape: H, net: &[F<S>], matrices: [&[f64]; 2], out: &mut [F<S>]) {
    let [p, q] = shape.degree();
    let (width, height) = (p + 1, q + 1);
    for dim in 0..shape.dims() {
        let range = dim * shape.count()..(dim + 1) * shape.count();
        let (net, out) = (&net[range.clone()], &mut out[range]);
        for (lines, length, stride, step, matrix, from_net) in
            [(height, width, 1, width, matrices[0], true), (width, height, width, 1, matrices[1], false)]
        {
            for line in 0..lines {
                let at = |i: usize| line * step + i * stride;
                if length == 4 {
                    let [a, b, c, d] = if from_net {
                        [net[at(0)], net[at(1)], net[at(2)], net[at(3)]]
                    } else {
                        [out[at(0)], out[at(1)], out[at(2)], out[at(3)]]
                    };
                    let (outer, inner) = (a + d, b + c);
                    let (rise, middle) = (d - a, c - b);
                    out[at(0)] = (outer + inner * 3.0) * 0.125;
                    out[at(1)] = (rise + middle) * 0.375;
                    out[at(2)] = (outer - inner) * 0.375;
                    out[at(3)] = (rise - middle * 3.0) * 0.125;
                    continue;
                }
                let mut source = [net[0]; MAX_DEGREE + 1];
                for i in 0..length {
                    source[i] = if from_net { net[at(i)] } else { out[at(i)] };
                }
                for k in 0..length {
                    let mut sum = source[0] * matrix[k * length];
                    for i in 1..length {
                        sum += source[i] * matrix[k * length + i];
                    }
                    out[at(k)] = sum;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use pulp::Scalar;

    use super::*;

    #[test]
    fn powers_are_the_same_polynomial() {
        let simd = Scalar::new();
        for degree in [[3, 3], [1, 4], [5, 2]] {
            let shape = General::<false>(degree);
            let n = shape.count();
            let net: Vec<F<Scalar>> = (0..3 * n).map(|i| F::splat(simd, ((i * 37 + 11) % 17) as f64 - 8.0)).collect();
            let mut coefficients = net.clone();
            let matrices = degree.map(power_matrix);
            powers(shape, &net, [&matrices[0], &matrices[1]], &mut coefficients);
            let patch = BezierPatch {
                degree,
                points: (0..n)
                    .map(|i| glam::DVec4::from_array([0, 1, 2, 2].map(|k: usize| net[k * n + i].lanes()[0])))
                    .collect(),
                rational: false,
                low: glam::DVec2::ZERO,
                high: glam::DVec2::ONE,
            };
            for (s, t) in [(-1.0, 1.0), (0.3, -0.6), (0.0, 0.0), (0.9, 0.1)] {
                let expected = patch.eval(glam::DVec2::new(0.5 + 0.5 * s, 0.5 + 0.5 * t));
                for k in 0..3 {
                    let mut sum = 0.0;
                    for j in 0..=degree[1] {
                        for i in 0..=degree[0] {
                            let c = coefficients[k * n + j * (degree[0] + 1) + i].lanes()[0];
                            sum += c * f64::powi(s, i as i32) * f64::powi(t, j as i32);
                        }
                    }
                    assert!((sum - expected[k]).abs() < 1e-12, "{degree:?}");
                }
            }
        }
    }
}
