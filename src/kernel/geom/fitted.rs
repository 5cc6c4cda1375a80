//! Curves that follow a function within a tolerance: piecewise cubic Hermite interpolants, halved until the middle of every
//! piece is near enough. Offset curves, and curves that run at the pace of another.
//!
//! Pieces end at given parameters and where they were halved; there the curve is C0 where the function has a kink, else C1.
//! Cost: one evaluation of point and slope at both ends of a piece, one in its middle. At most 2^[`MAX_DEPTH`] pieces for
//! each given one; what was reached is returned, with how far off it is.

use glam::DVec3;

use super::arc_length::ArcLength;
use super::{Curve, CurveError, Knots};

/// How often one piece may be halved.
pub const MAX_DEPTH: usize = 12;
/// How closely offset curves and paced curves are followed, as a fraction of their size.
const TOLERANCE: f64 = 1e-7;
/// How often a piece of those is halved at most, so that memory stays in proportion to the basis.
const DEPTH: usize = 6;

/// A curve and how far it is from the function, at the middles of its pieces.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The curve.
    pub curve: Curve,
    /// The largest distance that was met.
    pub off: f64,
}

/// Why there is no such curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The numbers make no curve.
    #[error("{0}")]
    Curve(#[from] CurveError),
    /// The direction across has no length or runs along the curve.
    #[error("the direction {across:?} across the curve has no length or runs along it at parameter {at}")]
    Across {
        /// The direction.
        across: DVec3,
        /// Where.
        at: f64,
    },
    /// The offset of a corner is in two pieces.
    #[error(
        "the curve has a corner at parameter {at}, where its offset is apart by {gap}; offset its pieces one by one"
    )]
    Corner {
        /// Where.
        at: f64,
        /// How far.
        gap: f64,
    },
}

/// Follows a function from the first of `breaks` to the last. `point` is asked at places, `slope` at places just inside
/// a piece, so that kinks at breaks count on their own sides.
pub fn fitted(
    breaks: &[f64],
    point: &dyn Fn(f64) -> DVec3,
    slope: &dyn Fn(f64) -> DVec3,
    tol: f64,
    depth: usize,
) -> Result<Fitted, CurveError> {
    let mut knots = vec![breaks[0]];
    let mut points = vec![point(breaks[0])];
    let mut worst = 0.0f64;
    let mut stack: Vec<([f64; 2], usize)> = breaks.windows(2).rev().map(|w| ([w[0], w[1]], depth)).collect();
    while let Some(([a, b], depth)) = stack.pop() {
        let (h, t) = (b - a, 0.5 * (a + b));
        let inside = 1e-9 * h;
        let (pa, pb) = (point(a), point(b));
        let piece = [pa, pa + slope(a + inside) * (h / 3.0), pb - slope(b - inside) * (h / 3.0), pb];
        let middle = (piece[0] + (piece[1] + piece[2]) * 3.0 + piece[3]) * 0.125;
        let error = middle.distance(point(t));
        if error > tol && depth > 0 && t > a && t < b {
            stack.push(([t, b], depth - 1));
            stack.push(([a, t], depth - 1));
        } else {
            worst = worst.max(error);
            knots.push(b);
            points.extend(&piece[1..]);
        }
    }
    Ok(Fitted { curve: Curve::new(Knots::clamped(3, &knots, 3)?, points, None)?, off: worst })
}

/// The knots of a curve, and places between them where they are few.
fn pieces(curve: &Curve) -> Vec<f64> {
    let breaks = curve.knots().breaks();
    let parts = if breaks.len() < 5 { 4 } else { 1 };
    let mut out = vec![breaks[0]];
    for pair in breaks.windows(2) {
        out.extend((1..parts).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / parts as f64));
        out.push(pair[1]);
    }
    out
}

/// The curve C + f (V x T) with the unit tangent T of a curve C, the unit vector V along `across`, and the distance f,
/// which `distance` gives with its derivative at a parameter of C. The parameters are those of C.
pub fn offset_curve(curve: &Curve, across: DVec3, distance: &dyn Fn(f64) -> [f64; 2]) -> Result<Fitted, FitError> {
    let wrong = |at: f64| FitError::Across { across, at };
    let v = across.try_normalize().ok_or_else(|| wrong(curve.domain()[0]))?;
    let breaks = pieces(curve);
    let side = |t: f64| curve.derivatives(t, 1)[1].try_normalize().map(|tangent| v.cross(tangent));
    for &t in &breaks {
        side(t).filter(|n| n.length() > 1e-9).ok_or_else(|| wrong(t))?;
    }
    let size = curve.bounds().diagonal();
    // On either side of a knot where the tangent turns, the offset goes elsewhere.
    for pair in breaks.windows(3) {
        let (t, h) = (pair[1], 1e-9 * (pair[1] - pair[0]).min(pair[2] - pair[1]));
        if let (Some(before), Some(after)) = (side(t - h), side(t + h)) {
            let gap = distance(t)[0].abs() * before.distance(after);
            if gap > 1e-6 * size {
                return Err(FitError::Corner { at: t, gap });
            }
        }
    }
    let point = |t: f64| curve.eval(t) + side(t).unwrap_or(DVec3::ZERO) * distance(t)[0];
    let slope = |t: f64| {
        let [_, d, dd, _] = curve.derivatives(t, 2);
        let [f, df] = distance(t);
        let Some(tangent) = d.try_normalize() else { return d };
        let turn = (dd - tangent * dd.dot(tangent)) / d.length();
        d + v.cross(tangent) * df + v.cross(turn) * f
    };
    Ok(fitted(&breaks, &point, &slope, TOLERANCE * size, DEPTH)?)
}

/// The curve `second` with the parameters of `first`: at each of them it is at the same fraction of its arc length as `first`
/// is of its own.
pub fn paced(second: &Curve, first: &Curve) -> Result<Fitted, CurveError> {
    let (own, other) = (ArcLength::new(first), ArcLength::new(second));
    let ratio = other.length() / own.length();
    let place = |t: f64| other.parameter_at(second, own.length_at(first, t) * ratio);
    let point = |t: f64| second.eval(place(t));
    let slope = |t: f64| {
        let tangent = second.derivatives(place(t), 1)[1].normalize_or_zero();
        tangent * (ratio * first.derivatives(t, 1)[1].length())
    };
    // Kinks of the second curve are ends of pieces too.
    let mut breaks = pieces(first);
    let [start, end] = first.domain();
    for t in second.knots().breaks() {
        let share = other.length_at(second, t) / other.length();
        breaks.push(own.parameter_at(first, share * own.length()).clamp(start, end));
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (end - start));
    if let Some(last) = breaks.last_mut() {
        *last = end;
    }
    fitted(&breaks, &point, &slope, TOLERANCE * second.bounds().diagonal(), DEPTH)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::super::sweep;
    use super::*;

    #[test]
    fn offsets_of_circles_are_circles_and_a_line_stays_straight() {
        let arc = sweep::arc(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0, 0.0, FRAC_PI_2).unwrap();
        // V x T of a counter-clockwise circle around V points inwards.
        let inner = offset_curve(&arc, DVec3::Z * 5.0, &|_| [0.5, 0.0]).unwrap();
        for (t, p) in inner.curve.sampled(3) {
            assert!((p.length() - 1.5).abs() < 5e-7, "{p}");
            assert!(p.distance(arc.eval(t) * 0.75) < 5e-7);
        }
        assert!(inner.off < 5e-7);
        let line = Curve::segment(DVec3::ZERO, DVec3::X * 4.0).unwrap();
        let tapered = offset_curve(&line, DVec3::Z, &|t| [1.0 + 2.0 * t, 2.0]).unwrap().curve;
        for (_, p) in tapered.sampled(5) {
            assert!((p.y - (1.0 + 0.5 * p.x)).abs() < 1e-12, "{p}");
        }
    }

    #[test]
    fn what_has_no_offset_says_why() {
        let corner = Curve::polyline(&[DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y]).unwrap();
        let error = offset_curve(&corner, DVec3::Z, &|_| [0.1, 0.0]).unwrap_err();
        assert!(matches!(error, FitError::Corner { gap, .. } if (gap - 0.1 * 2f64.sqrt()).abs() < 1e-9), "{error}");
        let line = Curve::segment(DVec3::ZERO, DVec3::X).unwrap();
        for across in [DVec3::ZERO, DVec3::X] {
            assert!(matches!(offset_curve(&line, across, &|_| [0.1, 0.0]), Err(FitError::Across { .. })));
        }
    }

    #[test]
    fn a_paced_curve_is_at_equal_fractions_of_the_length() {
        // A line of uneven speed against a quarter of a circle.
        let knots = Knots::bezier(2, 0.0, 1.0).unwrap();
        let uneven = Curve::new(knots, [0.0, 0.1, 1.0].map(|x| DVec3::X * x).to_vec(), None).unwrap();
        let arc = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, FRAC_PI_2).unwrap();
        let made = paced(&arc, &uneven).unwrap();
        for k in 0..=40 {
            let t = f64::from(k) / 40.0;
            let angle = FRAC_PI_2 * uneven.eval(t).x;
            assert!(made.curve.eval(t).distance(DVec3::new(angle.cos(), angle.sin(), 0.0)) < 1e-6, "{t}");
        }
    }
}
