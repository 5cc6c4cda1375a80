//! Curves put end to end, and the piece of a curve between two of its points.
//!
//! Degrees are raised to the largest and weights scaled to agree at the joints; inner joints are C0. Exact, but for ends
//! that miss each other: there the end of the curve before counts.

use glam::DVec3;

use super::{Curve, CurveError, Knots};

/// The curve that runs through all curves of a chain one after the other. An empty chain is an error.
pub fn concatenated(chain: &[Curve]) -> Result<Curve, CurveError> {
    if let [single] = chain {
        return Ok(single.clone());
    }
    let degree = chain.iter().map(|c| c.knots().degree()).max().unwrap_or(1);
    let rational = chain.iter().any(|c| c.weights().is_some());
    let (mut knots, mut points, mut weights) = (Vec::new(), Vec::<DVec3>::new(), Vec::<f64>::new());
    for curve in chain {
        let [start, end] = curve.domain();
        let mut curve = curve.restricted(start, end)?;
        while curve.knots().degree() < degree {
            curve = curve.elevated()?;
        }
        let own = curve.weights().map_or_else(|| vec![1.0; curve.points().len()], <[f64]>::to_vec);
        let values = curve.knots().values();
        match (knots.last().copied(), weights.last().copied()) {
            (Some(last), Some(weight)) => {
                let (shift, factor): (f64, f64) = (last - start, weight / own[0]);
                knots.pop();
                knots.extend(values[degree + 1..].iter().map(|v| v + shift));
                points.extend_from_slice(&curve.points()[1..]);
                weights.extend(own[1..].iter().map(|w| w * factor));
            }
            _ => {
                knots.extend_from_slice(values);
                points.extend_from_slice(curve.points());
                weights.extend(own);
            }
        }
    }
    Curve::new(Knots::new(degree, knots)?, points, rational.then_some(weights))
}

/// The parameter of the point of a curve nearest to `p`.
pub fn nearest_parameter(curve: &Curve, p: DVec3) -> f64 {
    let samples = curve.sampled(4 * curve.knots().degree().clamp(1, 4));
    let mut best = (f64::INFINITY, curve.domain()[0]);
    for &(t, q) in &samples {
        let d = q.distance_squared(p);
        if d < best.0 {
            best = (d, t);
        }
    }
    let [low, high] = curve.domain();
    let mut t = best.1;
    for _ in 0..32 {
        let [c, c1, c2, _] = curve.derivatives(t, 2);
        let (slope, bend) = ((c - p).dot(c1), c1.length_squared() + (c - p).dot(c2));
        let step = slope / if bend > 0.0 { bend } else { c1.length_squared() };
        let next = (t - step).clamp(low, high);
        if !next.is_finite() || next == t {
            break;
        }
        if curve.eval(next).distance_squared(p) > best.0 * (1.0 + 1e-12) {
            break;
        }
        t = next;
        best = (best.0.min(curve.eval(t).distance_squared(p)), t);
    }
    t
}

/// The piece of a curve from the point nearest to `a` on to that nearest to `b`, over the seam of a closed curve where it
/// must. The whole curve where its ends are these points within `tol`, and where both are one point of a closed curve.
pub fn between(curve: &Curve, a: DVec3, b: DVec3, tol: f64) -> Result<Curve, CurveError> {
    let [start, end] = curve.ends();
    let closed = start.distance(end) <= tol;
    if start.distance(a) <= tol && end.distance(b) <= tol {
        return Ok(curve.clone());
    }
    let (from, to) = (nearest_parameter(curve, a), nearest_parameter(curve, b));
    let [low, high] = curve.domain();
    let slack = 1e-9 * (high - low);
    // The same end of a closed curve has two parameters.
    let from = if closed && start.distance(a) <= tol { low } else { from };
    let to = if closed && end.distance(b) <= tol { high } else { to };
    if from + slack < to {
        return curve.restricted(from, to);
    }
    if !closed {
        return curve.restricted(to.min(from), from.max(to));
    }
    let mut pieces = Vec::new();
    if from + slack < high {
        pieces.push(curve.restricted(from, high)?);
    }
    if low + slack < to {
        pieces.push(curve.restricted(low, to)?);
    }
    if pieces.is_empty() { Ok(curve.clone()) } else { concatenated(&pieces) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::sweep::arc;
    use super::*;

    #[test]
    fn pieces_of_a_circle_are_found_over_its_seam() {
        let circle = arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, TAU).unwrap();
        let at = |a: f64| DVec3::new(a.cos(), a.sin(), 0.0);
        for (from, to) in [(0.5, 2.0), (5.0, 7.0), (0.0, 3.0), (3.0, TAU)] {
            let piece = between(&circle, at(from), at(to), 1e-9).unwrap();
            let [a, b] = piece.ends();
            assert!(a.distance(at(from)) < 1e-9 && b.distance(at(to)) < 1e-9, "{from} {to}");
            let [s, e] = piece.domain();
            for k in 0..=40 {
                assert!((piece.eval(s + (e - s) * f64::from(k) / 40.0).length() - 1.0).abs() < 1e-12);
            }
            let length: f64 = piece.sampled(64).windows(2).map(|w| w[0].1.distance(w[1].1)).sum();
            assert!((length - (to - from)).abs() < 1e-3);
        }
        let whole = between(&circle, at(0.0), at(0.0), 1e-9).unwrap();
        assert_eq!(whole, circle);
    }
}
