//! B-spline curves in space, polynomial and rational.

use glam::{DAffine3, DVec3, DVec4};

use super::Aabb;
use super::blossom;
use super::knots::{KnotError, Knots, MAX_DEGREE};

/// Why numbers are no curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The knot vector is not one.
    #[error("knots: {0}")]
    Knots(#[from] KnotError),
    /// The number of control points does not go with the knots.
    #[error("{got} control points, the knots need {expected}")]
    Count {
        /// What the knots need.
        expected: usize,
        /// What was given.
        got: usize,
    },
    /// The number of weights is not the number of control points.
    #[error("{got} weights for {expected} control points")]
    WeightCount {
        /// The number of control points.
        expected: usize,
        /// The number of weights.
        got: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("control point {index} is {point}, which is not finite")]
    NotFinite {
        /// Which control point.
        index: usize,
        /// Its coordinates.
        point: DVec3,
    },
    /// A weight is zero, negative or not finite.
    #[error("weight {index} is {value}, weights must be positive and finite")]
    Weight {
        /// Which weight.
        index: usize,
        /// Its value.
        value: f64,
    },
}

/// A B-spline curve. Control points are Cartesian; `weights` is `None` for polynomial curves.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "RawCurve")]
pub struct Curve {
    knots: Knots,
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCurve {
    knots: Knots,
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

impl TryFrom<RawCurve> for Curve {
    type Error = CurveError;

    fn try_from(raw: RawCurve) -> Result<Self, CurveError> {
        Self::new(raw.knots, raw.points, raw.weights)
    }
}

/// Weights that are all equal say nothing and are dropped; the others are checked.
pub(super) fn checked_weights(weights: Option<Vec<f64>>) -> Result<Option<Vec<f64>>, (usize, f64)> {
    let Some(weights) = weights else { return Ok(None) };
    if let Some(index) = weights.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
        return Err((index, weights[index]));
    }
    Ok(weights.iter().any(|&w| w != weights[0]).then_some(weights))
}

pub(super) fn homogeneous(points: &[DVec3], weights: Option<&[f64]>) -> Vec<DVec4> {
    match weights {
        None => points.iter().map(|p| p.extend(1.0)).collect(),
        Some(weights) => points.iter().zip(weights).map(|(p, &w)| (*p * w).extend(w)).collect(),
    }
}

pub(super) fn cartesian(points: &[DVec4], rational: bool) -> (Vec<DVec3>, Option<Vec<f64>>) {
    if rational {
        (points.iter().map(|p| p.truncate() / p.w).collect(), Some(points.iter().map(|p| p.w).collect()))
    } else {
        (points.iter().map(|p| p.truncate()).collect(), None)
    }
}

impl Curve {
    /// Checks and keeps a curve. Weights that are all equal are dropped.
    pub fn new(knots: Knots, points: Vec<DVec3>, weights: Option<Vec<f64>>) -> Result<Self, CurveError> {
        let expected = knots.control_count();
        if points.len() != expected {
            return Err(CurveError::Count { expected, got: points.len() });
        }
        if let Some(index) = points.iter().position(|p| !p.is_finite()) {
            return Err(CurveError::NotFinite { index, point: points[index] });
        }
        if let Some(w) = weights.as_ref().filter(|w| w.len() != expected) {
            return Err(CurveError::WeightCount { expected, got: w.len() });
        }
        let weights = checked_weights(weights).map_err(|(index, value)| CurveError::Weight { index, value })?;
        Ok(Self { knots, points, weights })
    }

    /// The straight segment from `a` (at 0) to `b` (at 1).
    pub fn segment(a: DVec3, b: DVec3) -> Result<Self, CurveError> {
        Self::new(Knots::bezier(1, 0.0, 1.0)?, vec![a, b], None)
    }

    /// The polyline through the points, parametrized by chord length scaled to 0..=1. Repeated points are
    /// dropped; fewer than two distinct points are an error.
    pub fn polyline(points: &[DVec3]) -> Result<Self, CurveError> {
        let mut distinct = points.to_vec();
        distinct.dedup();
        let mut breaks = vec![0.0];
        for pair in distinct.windows(2) {
            breaks.push(breaks[breaks.len() - 1] + pair[0].distance(pair[1]));
        }
        let total = breaks[breaks.len() - 1];
        breaks.iter_mut().for_each(|b| *b /= total);
        Self::new(Knots::clamped(1, &breaks, 1)?, distinct, None)
    }

    /// The knot vector.
    pub fn knots(&self) -> &Knots {
        &self.knots
    }

    /// The control points.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The weights of a rational curve.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Where the parameter starts and ends.
    pub fn domain(&self) -> [f64; 2] {
        self.knots.domain()
    }

    /// The control points as (w x, w y, w z, w).
    pub fn homogeneous(&self) -> Vec<DVec4> {
        homogeneous(&self.points, self.weights())
    }

    fn with_homogeneous(&self, knots: Knots, points: &[DVec4]) -> Self {
        let (points, weights) = cartesian(points, self.weights.is_some());
        Self { knots, points, weights }
    }

    /// The point at `t`.
    pub fn eval(&self, t: f64) -> DVec3 {
        self.derivatives(t, 0)[0]
    }

    /// The point and its derivatives up to `order <= 3` at `t`; entries above `order` are zero.
    pub fn derivatives(&self, t: f64, order: usize) -> [DVec3; 4] {
        match self.knots.degree() {
            0..=3 => self.small_derivatives::<4>(t, order),
            4..=7 => self.small_derivatives::<8>(t, order),
            _ => self.small_derivatives::<{ MAX_DEGREE + 1 }>(t, order),
        }
    }

    #[inline]
    fn small_derivatives<const N: usize>(&self, t: f64, order: usize) -> [DVec3; 4] {
        let basis = self.knots.small_basis::<N>(self.knots.span(t), t, order);
        let p = self.knots.degree();
        let mut out = [DVec3::ZERO; 4];
        let Some(weights) = &self.weights else {
            for (k, out) in out.iter_mut().enumerate().take(order + 1) {
                for i in 0..=p {
                    *out += self.points[basis.first + i] * basis.d[k][i];
                }
            }
            return out;
        };
        const BINOMIAL: [[f64; 4]; 4] =
            [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];
        let mut w = [0.0; 4];
        for k in 0..=order.min(3) {
            let mut a = DVec3::ZERO;
            for i in 0..=p {
                let weight = basis.d[k][i] * weights[basis.first + i];
                a += self.points[basis.first + i] * weight;
                w[k] += weight;
            }
            for i in 1..=k {
                a -= out[k - i] * (BINOMIAL[k][i] * w[i]);
            }
            out[k] = a / w[0];
        }
        out
    }

    /// The end points.
    pub fn ends(&self) -> [DVec3; 2] {
        self.domain().map(|t| self.eval(t))
    }

    /// A box around the control points, hence around the curve.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.points.iter().copied())
    }

    /// The same points run the other way over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            knots: self.knots.reversed(),
            points: self.points.iter().rev().copied().collect(),
            weights: self.weights.as_ref().map(|w| w.iter().rev().copied().collect()),
        }
    }

    /// The curve moved by an affine map.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { points: self.points.iter().map(|&p| map.transform_point3(p)).collect(), ..self.clone() }
    }

    /// The piece over `start..=end` with clamped knots; both must lie in the domain.
    pub fn restricted(&self, start: f64, end: f64) -> Result<Self, CurveError> {
        let target = self.knots.restricted(start, end)?;
        let points = blossom::refine(&self.knots, &self.homogeneous(), &target);
        Ok(self.with_homogeneous(target, &points))
    }

    /// The same curve with `t` inserted `times` more as a knot.
    pub fn knot_inserted(&self, t: f64, times: usize) -> Result<Self, CurveError> {
        let target = self.knots.inserted(t, times)?;
        let points = blossom::refine(&self.knots, &self.homogeneous(), &target);
        Ok(self.with_homogeneous(target, &points))
    }

    /// The same curve at one degree more (with clamped ends).
    pub fn elevated(&self) -> Result<Self, CurveError> {
        let target = self.knots.elevated()?;
        let points = blossom::elevate(&self.knots, &self.homogeneous(), &target);
        Ok(self.with_homogeneous(target, &points))
    }

    /// Points at the ends and at `per_span - 1` places inside each polynomial piece, with their parameters.
    pub fn sampled(&self, per_span: usize) -> Vec<(f64, DVec3)> {
        let breaks = self.knots.breaks();
        let per_span = per_span.max(1);
        let mut out = vec![(breaks[0], self.eval(breaks[0]))];
        for pair in breaks.windows(2) {
            for i in 1..=per_span {
                let t =
                    if i == per_span { pair[1] } else { pair[0] + (pair[1] - pair[0]) * i as f64 / per_span as f64 };
                out.push((t, self.eval(t)));
            }
        }
        out
    }
}
