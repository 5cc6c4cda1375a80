//! Arc length of curves, and points at a fraction of it.
//!
//! Every span between distinct knots is halved until 8-point Gauss-Legendre on the halves agrees with that on the
//! whole to 1e-13 of the length; pieces end at knots, so corners of C0 curves cost nothing. A place
//! is found by Newton inside its piece, kept between bounds. Cost: a few evaluations a piece once, then about 20 a
//! place. Twelve halvings are the cap; at a cusp the last digits are then those of the cap.

use glam::DVec3;

use super::{Curve, CurveError};

/// Nodes and weights on [-1, 1], positive half (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];
const MAX_DEPTH: usize = 12;

/// The arc length of a curve as a function of its parameter, tabulated.
#[derive(Clone, Debug)]
pub struct ArcLength {
    /// Increasing parameters with the length up to each.
    table: Vec<(f64, f64)>,
}

fn integrate(curve: &Curve, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    // The span is that of the middle: an end at a knot must not be evaluated on the piece behind it.
    let speed = |t: f64| curve.derivatives(t, 1)[1].length();
    half * GAUSS.iter().map(|&(x, w)| w * (speed(middle - half * x) + speed(middle + half * x))).sum::<f64>()
}

impl ArcLength {
    /// Tabulates a curve.
    pub fn new(curve: &Curve) -> Self {
        let breaks = curve.knots().breaks();
        let whole: Vec<f64> = breaks.windows(2).map(|w| integrate(curve, w[0], w[1])).collect();
        let scale: f64 = whole.iter().sum();
        let mut table = vec![(breaks[0], 0.0)];
        for (pair, &guess) in breaks.windows(2).zip(&whole) {
            add(curve, pair[0], pair[1], guess, 1e-13 * scale, MAX_DEPTH, &mut table);
        }
        Self { table }
    }

    /// The whole length.
    pub fn length(&self) -> f64 {
        self.table[self.table.len() - 1].1
    }

    /// The parameter at a length from the start, kept within 0 and the whole length.
    pub fn parameter_at(&self, curve: &Curve, length: f64) -> f64 {
        let last = self.table.len() - 1;
        let k = self.table.partition_point(|&(_, s)| s <= length).clamp(1, last);
        let ((mut low, start), (mut high, end)) = (self.table[k - 1], self.table[k]);
        let from = low;
        let target = length - start;
        if target <= 0.0 {
            return low;
        }
        if length >= end {
            return high;
        }
        let mut t = low + (high - low) * target / (end - start);
        for _ in 0..40 {
            let error = integrate(curve, from, t) - target;
            if error > 0.0 {
                high = t
            } else {
                low = t
            }
            let step = error / curve.derivatives(t, 1)[1].length();
            if error.abs() <= 1e-14 * length || step.abs() <= f64::EPSILON * t.abs().max(high - from) {
                break;
            }
            let next = t - step;
            t = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        t
    }

    /// The length from the start up to a parameter, kept within the domain.
    pub fn length_at(&self, curve: &Curve, t: f64) -> f64 {
        let last = self.table.len() - 1;
        let k = self.table.partition_point(|&(at, _)| at <= t).clamp(1, last);
        let ((low, start), (high, end)) = (self.table[k - 1], self.table[k]);
        if t >= high { end } else { start + integrate(curve, low, t.max(low)) }
    }

    /// The point at a fraction 0..=1 of the length; the ends are the curve's own end points.
    pub fn point(&self, curve: &Curve, fraction: f64) -> DVec3 {
        curve.eval(self.parameter_at(curve, fraction * self.length()))
    }

    /// The piece between two fractions of the length; it runs backwards when `from > to`.
    pub fn piece(&self, curve: &Curve, from: f64, to: f64) -> Result<Curve, CurveError> {
        let at = |f: f64| {
            let [a, b] = curve.domain();
            if f <= 0.0 {
                a
            } else if f >= 1.0 {
                b
            } else {
                self.parameter_at(curve, f * self.length())
            }
        };
        let piece = curve.restricted(at(from.min(to)), at(from.max(to)))?;
        Ok(if from > to { piece.reversed() } else { piece })
    }
}

fn add(curve: &Curve, a: f64, b: f64, guess: f64, tol: f64, depth: usize, table: &mut Vec<(f64, f64)>) {
    let m = 0.5 * (a + b);
    let (left, right) = (integrate(curve, a, m), integrate(curve, m, b));
    if depth == 0 || (left + right - guess).abs() <= tol {
        for (t, part) in [(m, left), (b, right)] {
            table.push((t, table[table.len() - 1].1 + part));
        }
    } else {
        add(curve, a, m, left, tol, depth - 1, table);
        add(curve, m, b, right, tol, depth - 1, table);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    #[test]
    fn a_rational_quarter_circle_has_its_length_and_places() {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let points = vec![DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let c = Curve::new(Knots::bezier(2, 0.0, 1.0).unwrap(), points, Some(vec![1.0, w, 1.0])).unwrap();
        let arc = ArcLength::new(&c);
        assert!((arc.length() - std::f64::consts::FRAC_PI_2).abs() < 1e-11);
        for i in 0..=30 {
            let f = f64::from(i) / 30.0;
            let t = arc.parameter_at(&c, f * arc.length());
            assert!((arc.length_at(&c, t) - f * arc.length()).abs() < 1e-13);
            let p = arc.point(&c, f);
            assert!((p.y.atan2(p.x) - f * std::f64::consts::FRAC_PI_2).abs() < 1e-11, "{f}");
        }
        let piece = arc.piece(&c, 0.75, 0.25).unwrap();
        let angle = |p: DVec3| p.y.atan2(p.x) / std::f64::consts::FRAC_PI_2;
        assert!((angle(piece.ends()[0]) - 0.75).abs() < 1e-11 && (angle(piece.ends()[1]) - 0.25).abs() < 1e-11);
    }

    #[test]
    fn polylines_are_exact_and_ends_are_kept_to_the_bit() {
        let points = [DVec3::ZERO, DVec3::X * 3.0, DVec3::new(3.0, 4.0, 0.0)];
        let c = Curve::polyline(&points).unwrap();
        let arc = ArcLength::new(&c);
        assert!((arc.length() - 7.0).abs() < 1e-14);
        assert!(arc.point(&c, 5.0 / 7.0).distance(DVec3::new(3.0, 2.0, 0.0)) < 1e-14);
        assert_eq!((arc.point(&c, 0.0), arc.point(&c, 1.0)), (points[0], points[2]));
    }

    #[test]
    fn a_curve_that_starts_at_rest_is_followed() {
        // S(t) = t^3 along x: speed 0 at the start, length 1.
        let c = Curve::new(
            Knots::bezier(3, 0.0, 1.0).unwrap(),
            vec![DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::X],
            None,
        )
        .unwrap();
        let arc = ArcLength::new(&c);
        for i in 0..=20 {
            let x = arc.point(&c, f64::from(i) / 20.0).x;
            assert!((x - f64::from(i) / 20.0).abs() < 1e-10, "{i} {x}");
        }
    }
}
