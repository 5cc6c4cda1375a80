//! Blossoms (polar forms) of B-splines: one mechanism for knot refinement, restriction, Bezier extraction and
//! degree elevation.
//!
//! A polynomial piece of degree p has one symmetric, multi-affine form f(t1..tp) with f(t..t) its value; the
//! control point of knots `u[i+1..=i+p]` is `f(u[i+1], .., u[i+p])` (Ramshaw, *Blossoming*, 1987). New control
//! points are therefore blossoms at the new knots. Every step is an interpolation `a + (b - a) s`, so that
//! constant weights of 1 stay exactly 1. Cost: O(p^2) a point; stable where the arguments lie in the domain.

use std::ops::{Add, Mul, Sub};

use super::knots::{Knots, MAX_DEGREE};

/// What control points are made of: `f64`, `DVec2`, `DVec3`, homogeneous `DVec4`.
pub trait Vector: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> + Default {}
impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T> + Default> Vector for T {}

/// The blossom, at `args` (as many as the degree), of the polynomial piece on a non-empty `span`.
pub fn blossom<V: Vector>(knots: &Knots, points: &[V], span: usize, args: impl IntoIterator<Item = f64>) -> V {
    let (p, u) = (knots.degree(), knots.values());
    let mut d = [V::default(); MAX_DEGREE + 1];
    d[..=p].copy_from_slice(&points[span - p..=span]);
    for (r, t) in (1..=p).zip(args) {
        for j in (r..=p).rev() {
            let low = u[span + j - p];
            let s = (t - low) / (u[span + 1 + j - r] - low);
            d[j] = d[j - 1] + (d[j] - d[j - 1]) * s;
        }
    }
    d[p]
}

/// The control points of the same spline over finer (or restricted, but never coarser) `target` knots of the
/// same degree whose domain lies inside that of `knots`.
pub fn refine<V: Vector>(knots: &Knots, points: &[V], target: &Knots) -> Vec<V> {
    let p = target.degree();
    new_points(knots, target, |i, span| blossom(knots, points, span, target.values()[i + 1..=i + p].iter().copied()))
}

/// The control points of the same spline at degree + 1 over `target`, which is [`Knots::elevated`] of `knots`:
/// the mean of the blossoms that leave out one argument each.
pub fn elevate<V: Vector>(knots: &Knots, points: &[V], target: &Knots) -> Vec<V> {
    let q = target.degree();
    new_points(knots, target, |i, span| {
        let args = &target.values()[i + 1..=i + q];
        let without = |j: usize| args.iter().enumerate().filter(move |&(k, _)| k != j).map(|(_, &t)| t);
        let base = blossom(knots, points, span, without(0));
        let rest = (1..q).fold(V::default(), |sum, j| sum + (blossom(knots, points, span, without(j)) - base));
        base + rest * (1.0 / q as f64)
    })
}

/// Applies `f(i, span)` for every control point of `target`, where `span` is a non-empty span of `knots` within
/// the support of control point i.
fn new_points<V>(knots: &Knots, target: &Knots, f: impl Fn(usize, usize) -> V) -> Vec<V> {
    let (q, t) = (target.degree(), target.values());
    let [start, end] = target.domain();
    (0..target.control_count())
        .map(|i| {
            let (low, high) = (t[i].max(start), t[i + q + 1].min(end));
            let first = t[i..=i + q + 1].windows(2).find(|w| w[0] < w[1] && w[1] > low && w[0] < high);
            let middle = first.map_or(0.5 * (low + high), |w| 0.5 * (w[0].max(low) + w[1].min(high)));
            f(i, knots.span(middle))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(knots: &Knots, points: &[f64], t: f64) -> f64 {
        let b = knots.basis(t, 0);
        (0..=knots.degree()).map(|i| b.d[0][i] * points[b.first + i]).sum()
    }

    #[test]
    fn refinement_restriction_and_elevation_keep_the_function() {
        let knots = Knots::new(3, vec![-1.0, -0.5, 0.0, 0.0, 1.0, 1.0, 2.0, 4.0, 5.0, 5.0, 6.0]).unwrap();
        let points = [1.0, -2.0, 0.5, 3.0, 7.0, -1.0, 2.0];
        let [a, b] = knots.domain();
        let finer = knots.inserted(0.3, 2).unwrap().inserted(2.0, 1).unwrap();
        let inner = knots.restricted(0.25, 3.0).unwrap();
        let higher = knots.elevated().unwrap();
        let cases = [
            (&finer, refine(&knots, &points, &finer)),
            (&inner, refine(&knots, &points, &inner)),
            (&higher, elevate(&knots, &points, &higher)),
        ];
        for (target, new) in cases {
            for i in 0..=50 {
                let [c, d] = target.domain();
                let t = c + (d - c) * f64::from(i) / 50.0;
                assert!(a <= t && t <= b);
                assert!((value(&knots, &points, t) - value(target, &new, t)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn weights_of_one_stay_exactly_one() {
        let knots = Knots::clamped(4, &[0.0, 0.1, 0.7, 1.3], 2).unwrap();
        let ones = vec![1.0; knots.control_count()];
        let finer = knots.inserted(0.333, 3).unwrap();
        assert!(refine(&knots, &ones, &finer).iter().all(|&w| w == 1.0));
        let higher = knots.elevated().unwrap();
        assert!(elevate(&knots, &ones, &higher).iter().all(|&w| w == 1.0));
    }
}
