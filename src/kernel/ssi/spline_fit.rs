//! Intersection curves as cubic B-splines in space and in both parameter domains (HJR99 section 4, step 9).
//!
//! All curves of a fit share one parameter, the arc length by chords, so that the same parameter names the same point
//! in space and on each surface. Every span is the cubic Hermite interpolant of exact points and derivatives: C1, double
//! inner knots; triple ones where the curve turns a corner or the parametrization of a surface has a kink. Spans are
//! as long as the tolerance allows ([`super::refined`]).
//!
//! The bound is that of thesis 5.2.2 for the curve in space against each surface: with C(t) the curve and (u, v)(t)
//! its preimage, |C(t) - S(u(t), v(t))| by sampling and Filip's term ([`super::derivative_bounds::filip`]).
//! Cost: about 500 samples for a length of one diagonal at the default tolerance. Where the tolerance is not reached
//! (the given points are not good enough), the bound says so.

use glam::{DVec2, DVec3};

use super::derivative_bounds::filip;
use super::refined::{Element, refined};
use super::result::IntersectionCurve;
use super::strand::{Ground, Knot, Strand};
use crate::kernel::geom::{Curve, Knots, Surface};

/// The preimages of a stretch of the curve on one surface of each side.
#[derive(Clone, Debug)]
pub struct SplineRun {
    /// The number of the first surface.
    pub a: usize,
    /// The number of the second surface.
    pub b: usize,
    /// The curve in space over this run.
    pub space: Curve,
    /// The curve in the parameters of the first surface, z = 0.
    pub in_a: Curve,
    /// The curve in the parameters of the second surface, z = 0.
    pub in_b: Curve,
}

/// A fitted curve.
#[derive(Clone, Debug)]
pub struct SplineFit {
    /// The whole curve in space, in model units.
    pub space: Curve,
    /// Its preimages, patch after patch, with the parameters of `space`.
    pub runs: Vec<SplineRun>,
    /// An upper bound, over the whole curve, of the distance of `space` to both surfaces, and of each preimage's
    /// points in space to `space`; in model units.
    pub bound: f64,
    /// Whether the bound is within the tolerance asked for.
    pub within: bool,
}

/// Why a curve has no fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Too few points.
    #[error("the curve has {points} points where a fit needs two that differ")]
    Short {
        /// How many there are.
        points: usize,
    },
    /// A surface that its points name is not among those given.
    #[error("the curve names surface {number}, which is not among those given; give all surfaces that it runs on")]
    MissingSurface {
        /// Its number.
        number: usize,
    },
    /// The tolerance is zero, negative or not a number.
    #[error("the tolerance is {value}, but must be a positive length")]
    Tolerance {
        /// What was given.
        value: f64,
    },
}

/// A cubic span between two knots.
struct Span<'a> {
    ground: &'a Ground,
    strand: &'a Strand,
    wanted: f64,
    x: Knot,
    y: Knot,
}

impl Element for Span<'_> {
    fn off(&self, k: &Knot) -> f64 {
        let on = |side: usize| self.ground.point(self.strand.pieces[side], self.domain(side, k.t)).distance(k.p);
        on(0).max(on(1)).max(self.space(k.t).distance(k.p))
    }

    fn bound(&self, hasty: bool) -> f64 {
        self.to_side(0, hasty).max(self.to_side(1, hasty))
    }
}

impl Span<'_> {
    fn space(&self, t: f64) -> DVec3 {
        let [w, x, y, z] = self.weights(t);
        self.x.p * w + self.y.p * x + self.x.tangent * y + self.y.tangent * z
    }

    fn domain(&self, side: usize, t: f64) -> DVec2 {
        let [w, x, y, z] = self.weights(t);
        self.x.at[side] * w + self.y.at[side] * x + self.x.rates[side] * y + self.y.rates[side] * z
    }

    fn weights(&self, t: f64) -> [f64; 4] {
        let h = self.y.t - self.x.t;
        let f = (t - self.x.t) / h;
        let g = 1.0 - f;
        [g * g * (1.0 + 2.0 * f), f * f * (3.0 - 2.0 * f), g * g * f * h, -f * f * g * h]
    }

    /// An upper bound of the distance between the curve in space and its preimage on one side.
    fn to_side(&self, side: usize, hasty: bool) -> f64 {
        let (ground, piece, wanted) = (self.ground, self.strand.pieces[side], self.wanted);
        let h = self.y.t - self.x.t;
        // Bezier points and with them bounds of the derivatives.
        let (a, b) = (self.x.p, self.y.p);
        let net = [a, a + self.x.tangent * (h / 3.0), b - self.y.tangent * (h / 3.0), b];
        let second = |i: usize| (net[i] - 2.0 * net[i + 1] + net[i + 2]).length() * 6.0 / (h * h);
        let (a, b) = (self.x.at[side], self.y.at[side]);
        let flat = [a, a + self.x.rates[side] * (h / 3.0), b - self.y.rates[side] * (h / 3.0), b];
        let speed = (0..3).fold(DVec2::ZERO, |m, i| m.max((flat[i + 1] - flat[i]).abs())) * (3.0 / h);
        let bend = (0..2).fold(DVec2::ZERO, |m, i| m.max((flat[i] - 2.0 * flat[i + 1] + flat[i + 2]).abs()));
        let bend = bend * (6.0 / (h * h));
        let s = ground.bounds(piece);
        let most = second(0).max(second(1)) + s.second(speed, speed) + s.first(bend);
        filip(self.x.t, self.y.t, most, wanted, hasty, |t| self.space(t) - ground.point(piece, self.domain(side, t)))
    }
}

/// The knots that a strand's fit keeps, and its bound in the unit frame.
fn reduced(ground: &Ground, strand: &Strand, wanted: f64) -> (Vec<Knot>, f64) {
    let span = |x: &Knot, y: &Knot| Some(Span { ground, strand, wanted, x: *x, y: *y });
    let spans = refined(ground, strand, &strand.knots, wanted, span);
    let worst = spans.iter().map(|(.., bound)| *bound).fold(0.0, f64::max);
    (std::iter::once(strand.knots[0]).chain(spans.into_iter().map(|(_, end, _)| end)).collect(), worst)
}

/// Fits cubic B-splines to an intersection curve; `surfaces` must hold those that its points name, `tol` is in model
/// units.
pub fn fit_splines(curve: &IntersectionCurve, surfaces: &[(usize, &Surface)], tol: f64) -> Result<SplineFit, FitError> {
    let (ground, strands) = prepared(curve, surfaces, tol)?;
    let wanted = tol * ground.frame.scale;
    let mut bound: f64 = 0.0;
    let mut pieces: Vec<Vec<Knot>> = Vec::new();
    for strand in &strands {
        let (kept, worst) = reduced(&ground, strand, wanted);
        bound = bound.max(worst);
        pieces.push(kept);
    }
    let scale = ground.frame.scale;
    let space = |list: &[Vec<Knot>]| cubic(list, |k| (ground.frame.to_model(k.p), k.tangent / scale), 1.0 / scale);
    let flat = |list: &[Vec<Knot>], side: usize| {
        cubic(list, |k| (k.at[side].extend(0.0), k.rates[side].extend(0.0)), 1.0 / scale)
    };
    let short = || FitError::Short { points: curve.points.len() };
    let mut runs = Vec::new();
    let mut start = 0;
    for k in 1..=strands.len() {
        if k < strands.len() && strands[k].continues {
            continue;
        }
        let list = &pieces[start..k];
        let [a, b] = strands[start].surfaces;
        runs.push(SplineRun {
            a,
            b,
            space: space(list).ok_or_else(short)?,
            in_a: flat(list, 0).ok_or_else(short)?,
            in_b: flat(list, 1).ok_or_else(short)?,
        });
        start = k;
    }
    let bound = bound / scale;
    Ok(SplineFit { space: space(&pieces).ok_or_else(short)?, runs, bound, within: bound <= tol })
}

/// The ground and the strands of a curve.
pub(super) fn prepared(
    curve: &IntersectionCurve,
    surfaces: &[(usize, &Surface)],
    tol: f64,
) -> Result<(Ground, Vec<Strand>), FitError> {
    if !(tol > 0.0 && tol.is_finite()) {
        return Err(FitError::Tolerance { value: tol });
    }
    let mut used: Vec<usize> = curve.points.iter().flat_map(|p| [p.a, p.b]).collect();
    used.sort_unstable();
    used.dedup();
    let find = |&number: &usize| {
        let found = surfaces.iter().find(|(n, _)| *n == number).copied();
        found.ok_or(FitError::MissingSurface { number })
    };
    let used = used.iter().map(find).collect::<Result<Vec<_>, _>>()?;
    let ground = Ground::new(&used);
    let strands = ground.strands(curve).unwrap_or_default();
    if strands.is_empty() {
        return Err(FitError::Short { points: curve.points.len() });
    }
    Ok((ground, strands))
}

/// The B-spline through the knots of consecutive strands; `value` gives a point and its derivative by arc length in
/// the unit frame, `unit` is what one unit of that length is in the curve's parameter.
fn cubic(strands: &[Vec<Knot>], value: impl Fn(&Knot) -> (DVec3, DVec3), unit: f64) -> Option<Curve> {
    let mut values: Vec<f64> = Vec::new();
    let mut points: Vec<DVec3> = Vec::new();
    let mut out: Option<(DVec3, DVec3)> = None; // the point and derivative with which the last strand ended
    for strand in strands {
        for w in strand.windows(2) {
            let ((p, dp), (q, dq)) = (value(&w[0]), value(&w[1]));
            let h = w[1].t - w[0].t;
            let t = w[0].t * unit;
            match out {
                None => {
                    values.extend([t; 4]);
                    points.push(p);
                }
                Some((end, slope)) => {
                    // A corner, or a jump that is within the joining tolerance, needs the point itself.
                    let smooth = end.distance(p) <= 1e-12 * (1.0 + p.length())
                        && slope.distance(dp) <= 1e-7 * (slope.length() + dp.length());
                    values.extend([t; 2]);
                    if !smooth {
                        values.push(t);
                        points.push(p);
                    }
                }
            }
            points.push(p + dp * (h / 3.0));
            points.push(q - dq * (h / 3.0));
            out = Some((q, dq));
        }
    }
    let (end, _) = out?;
    let last = strands.last()?.last()?.t * unit;
    values.extend([last; 4]);
    points.push(end);
    let knots = Knots::new(3, values).ok()?;
    Curve::new(knots, points, None).ok()
}
