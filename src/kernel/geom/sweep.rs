//! Analytic curves and surfaces as exact rational splines: arcs of ellipses, extruded and revolved surfaces, and
//! through them planes, cylinders, cones, spheres and tori.
//!
//! An arc is a chain of rational quadratics of at most 90 degrees each over the angle at their ends (Piegl and
//! Tiller, *The NURBS Book*, 7.3); between the ends the parameter is close to the angle but not equal to it. A
//! surface of revolution is the tensor product of that arc with its meridian (8.5).

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::{Curve, CurveError, Knots, Surface, SurfaceError};

/// Why a swept shape could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// An angle range is empty, not finite, or more than a full turn.
    #[error("the angle range {from}..{to} is empty or more than a full turn")]
    Range {
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// A direction has no length.
    #[error("the {what} has no length or is not finite")]
    Direction {
        /// Which direction.
        what: &'static str,
    },
    /// The numbers make no curve.
    #[error("{0}")]
    Curve(#[from] CurveError),
    /// The numbers make no surface.
    #[error("{0}")]
    Surface(#[from] SurfaceError),
}

/// Angles of the ends of the quadratic pieces.
fn pieces(from: f64, to: f64) -> Result<Vec<f64>, SweepError> {
    if !(to > from && to - from <= TAU * (1.0 + 1e-12)) {
        return Err(SweepError::Range { from, to });
    }
    let count = ((to - from) / FRAC_PI_2 * (1.0 - 1e-12)).ceil().max(1.0);
    let at = |k: usize| if k as f64 == count { to } else { from + (to - from) * k as f64 / count };
    Ok((0..=count as usize).map(at).collect())
}

/// The unit circle from `from` to `to`: cosines, sines and weights of the control points, and the knots.
fn unit_arc(from: f64, to: f64) -> Result<(Vec<[f64; 3]>, Knots), SweepError> {
    let breaks = pieces(from, to)?;
    let half = 0.5 * (breaks[1] - breaks[0]);
    let weight = half.cos();
    let mut net = Vec::with_capacity(2 * breaks.len() - 1);
    for (k, &angle) in breaks.iter().enumerate() {
        if k > 0 {
            let middle = 0.5 * (breaks[k - 1] + angle);
            net.push([middle.cos() / weight, middle.sin() / weight, weight]);
        }
        net.push([angle.cos(), angle.sin(), 1.0]);
    }
    if to - from >= TAU * (1.0 - 1e-12) {
        let last = net.len() - 1;
        net[last] = net[0]; // a full turn closes bit for bit
    }
    Ok((net, Knots::clamped(2, &breaks, 2).map_err(CurveError::Knots)?))
}

/// The arc `center + x cos t + y sin t` for t from `from` to `to` (radians, at most a full turn): of a circle
/// when x and y are perpendicular and equally long, else of an ellipse with these conjugate radii.
pub fn arc(center: DVec3, x: DVec3, y: DVec3, from: f64, to: f64) -> Result<Curve, SweepError> {
    let (net, knots) = unit_arc(from, to)?;
    let points = net.iter().map(|[c, s, _]| center + x * *c + y * *s).collect();
    Ok(Curve::new(knots, points, Some(net.iter().map(|n| n[2]).collect()))?)
}

/// The parameter at which an arc from `from` to `to` (see [`arc`]) is at an angle between them.
pub fn parameter_at_angle(from: f64, to: f64, angle: f64) -> f64 {
    let Ok(breaks) = pieces(from, to) else { return angle };
    let k = breaks.partition_point(|&b| b <= angle).clamp(1, breaks.len() - 1);
    let (start, width) = (breaks[k - 1], breaks[k] - breaks[k - 1]);
    let turn = (angle - start).clamp(0.0, width);
    // The ratio of the end weights' Bernstein terms is that of the sines of the half angles to the ends.
    let (a, b) = ((0.5 * turn).sin(), (0.5 * (width - turn)).sin());
    start + width * (a / (a + b))
}

/// The surface `curve(u) + v direction`, v in 0..=1.
pub fn extruded(curve: &Curve, direction: DVec3) -> Result<Surface, SweepError> {
    if !(direction.is_finite() && direction.length() > 0.0) {
        return Err(SweepError::Direction { what: "direction of extrusion" });
    }
    let across = Knots::bezier(1, 0.0, 1.0).map_err(CurveError::Knots)?;
    let points = curve.points().iter().copied().chain(curve.points().iter().map(|&p| p + direction)).collect();
    let weights = curve.weights().map(|w| w.repeat(2));
    Ok(Surface::new(curve.knots().clone(), across, points, weights)?)
}

/// The surface that a meridian sweeps when it turns around an axis from `from` to `to`: u is the angle (exact at
/// every quarter), v the meridian's parameter. Points of the meridian on the axis become poles.
pub fn revolved(meridian: &Curve, origin: DVec3, axis: DVec3, from: f64, to: f64) -> Result<Surface, SweepError> {
    let axis = axis.try_normalize().ok_or(SweepError::Direction { what: "axis of revolution" })?;
    let (net, knots) = unit_arc(from, to)?;
    let mut points = Vec::with_capacity(net.len() * meridian.points().len());
    let mut weights = Vec::with_capacity(points.capacity());
    for (j, &p) in meridian.points().iter().enumerate() {
        let foot = origin + axis * (p - origin).dot(axis);
        let radius = p - foot;
        let across = axis.cross(radius);
        for [c, s, w] in &net {
            points.push(foot + radius * *c + across * *s);
            weights.push(w * meridian.weights().map_or(1.0, |m| m[j]));
        }
    }
    Ok(Surface::new(knots, meridian.knots().clone(), points, Some(weights))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use std::f64::consts::PI;

    #[test]
    fn arcs_are_round_and_run_over_their_angle() {
        for (from, to) in [(0.0, TAU), (-1.0, 2.5), (3.0, 3.1), (0.5, 0.5 + PI)] {
            let curve = arc(DVec3::Z, DVec3::X * 2.0, DVec3::Y * 2.0, from, to).unwrap();
            for i in 0..=40 {
                let t = from + (to - from) * f64::from(i) / 40.0;
                let p = curve.eval(t);
                assert!((p.distance(DVec3::Z) - 2.0).abs() < 1e-14);
            }
            for t in [from, 0.5 * (from + to), to] {
                let p = curve.eval(t);
                assert!(p.distance(DVec3::new(2.0 * t.cos(), 2.0 * t.sin(), 1.0)) < 1e-14);
            }
        }
        let circle = arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.3, 0.3 + TAU).unwrap();
        assert_eq!(circle.points()[0], circle.points()[8]);
    }

    #[test]
    fn parameters_of_angles_lead_to_them() {
        for (from, to) in [(0.0, TAU), (-1.0, 2.5), (-FRAC_PI_2, FRAC_PI_2)] {
            let curve = arc(DVec3::ZERO, DVec3::X, DVec3::Y, from, to).unwrap();
            for k in 0..=40 {
                let angle = from + (to - from) * f64::from(k) / 40.0;
                let p = curve.eval(parameter_at_angle(from, to, angle));
                assert!(p.distance(DVec3::new(angle.cos(), angle.sin(), 0.0)) < 1e-14);
            }
        }
    }

    #[test]
    fn a_turned_half_circle_is_a_sphere_and_an_off_axis_circle_a_torus() {
        let meridian = arc(DVec3::ZERO, DVec3::X, DVec3::Z, -FRAC_PI_2, FRAC_PI_2).unwrap();
        let sphere = revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap();
        let circle = arc(DVec3::X * 3.0, DVec3::X, DVec3::Z, 0.0, TAU).unwrap();
        let torus = revolved(&circle, DVec3::ZERO, DVec3::Z * 5.0, -1.0, 4.0).unwrap();
        for i in 0..=30 {
            for j in 0..=30 {
                let (a, b) = (f64::from(i) / 30.0, f64::from(j) / 30.0);
                let p = sphere.eval(DVec2::new(a * TAU, (b - 0.5) * PI));
                assert!((p.length() - 1.0).abs() < 1e-14);
                let q = torus.eval(DVec2::new(-1.0 + 5.0 * a, b * TAU));
                let ring = (q.truncate().length() - 3.0).hypot(q.z);
                assert!((ring - 1.0).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn an_extruded_ellipse_is_an_elliptic_cylinder() {
        let ellipse = arc(DVec3::ZERO, DVec3::X * 2.0, DVec3::Y, 0.0, TAU).unwrap();
        let cylinder = extruded(&ellipse, DVec3::new(0.5, 0.0, 4.0)).unwrap();
        let p = cylinder.eval(DVec2::new(1.1, 0.25));
        assert!((p.z - 1.0).abs() < 1e-15 && (((p.x - 0.125) / 2.0).hypot(p.y) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn bad_input_is_named() {
        assert!(matches!(arc(DVec3::ZERO, DVec3::X, DVec3::Y, 1.0, 1.0), Err(SweepError::Range { .. })));
        assert!(matches!(arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, 7.0), Err(SweepError::Range { .. })));
        assert!(matches!(arc(DVec3::ZERO, DVec3::X, DVec3::Y, f64::NAN, 7.0), Err(SweepError::Range { .. })));
        let line = Curve::segment(DVec3::X, DVec3::Y).unwrap();
        assert!(extruded(&line, DVec3::ZERO).is_err() && revolved(&line, DVec3::ZERO, DVec3::ZERO, 0.0, 1.0).is_err());
    }
}
