//! Parameter curves of edges on surfaces: rebuilt from the curve in space by projection, or lifted into space.
//!
//! Both are piecewise cubic Hermite interpolants with the parameter of the curve they are made from, halved until the
//! middle of every piece is within a tolerance, so that a point of an edge and its surface parameters belong to one
//! number. A derivative of the parameters solves Su u' + Sv v' = C' by least squares; where that is singular (at a
//! pole) the chord takes its place. Pieces end at the knots of the curve. A projected curve starts in its middle and
//! runs outwards, because its ends may lie at poles, where a parameter is arbitrary: there it is continued.
//!
//! Cost: two closest points a piece. At most 2^12 pieces for each piece of the curve (a knot of the
//! surface needs many near it and none elsewhere); what is reached is returned.

use glam::{DAffine3, DVec2, DVec3};

use super::chart::Chart;
use super::fitted::{MAX_DEPTH, fitted};
use super::{Curve, CurveError, Knots};

/// A parameter curve and how far the curve in space is from the surface.
#[derive(Clone, Debug)]
pub struct Projected {
    /// The parameter curve (z = 0) with the domain of the curve in space.
    pub pcurve: Curve,
    /// The largest distance of the curve from the surface, at the places that were looked at.
    pub off: f64,
}

/// The parameters at `t`.
pub fn uv_at(pcurve: &Curve, t: f64) -> DVec2 {
    pcurve.eval(t).truncate()
}

/// A parameter curve moved in the parameter plane.
#[must_use]
pub fn shifted(pcurve: &Curve, by: DVec2) -> Curve {
    if by == DVec2::ZERO { pcurve.clone() } else { pcurve.transformed(&DAffine3::from_translation(by.extend(0.0))) }
}

/// The straight parameter curve over a domain.
pub fn straight(from: DVec2, to: DVec2, domain: [f64; 2]) -> Result<Curve, CurveError> {
    Curve::new(Knots::bezier(1, domain[0], domain[1])?, vec![from.extend(0.0), to.extend(0.0)], None)
}

/// Parameters where pieces begin: the knots, with more between where the curve bends.
fn starts(curve: &Curve) -> Vec<f64> {
    let breaks = curve.knots().breaks();
    let per_span = match (curve.knots().degree(), breaks.len()) {
        (1, 2) => 2,
        (1, _) => 1,
        (_, 2) => 4,
        (_, 3..=5) => 2,
        _ => 1,
    };
    let mut out = vec![breaks[0]];
    for pair in breaks.windows(2) {
        out.extend((1..per_span).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / per_span as f64));
        out.push(pair[1]);
    }
    out
}

/// A place of the interpolant.
#[derive(Clone, Copy)]
struct Node {
    t: f64,
    uv: DVec2,
}

/// Puts a curve that lies on a surface into its parameter plane. `guide` says about where a parameter of the curve
/// lies, where the file knows (it decides between the two sides of a seam).
pub fn project(
    chart: &Chart<'_>,
    curve: &Curve,
    guide: Option<&dyn Fn(f64) -> DVec2>,
    tol: f64,
) -> Result<Projected, CurveError> {
    let ts = starts(curve);
    let points: Vec<DVec3> = ts.iter().map(|&t| curve.eval(t)).collect();
    let middle = ts.len() / 2;
    let mut off = 0.0f64;
    let first = match guide {
        Some(guide) => chart.follow(points[middle], guide(ts[middle])),
        None => chart.locate(points[middle]),
    };
    off = off.max(first.distance);
    let mut uvs = vec![first.uv; ts.len()];
    let mut march = |order: &mut dyn Iterator<Item = usize>, off: &mut f64| {
        let mut before: Option<usize> = None;
        let mut last = middle;
        for k in order {
            let ahead = match before {
                Some(b) if ts[last] != ts[b] => {
                    uvs[last] + (uvs[last] - uvs[b]) * ((ts[k] - ts[last]) / (ts[last] - ts[b]))
                }
                _ => uvs[last],
            };
            let foot = chart.follow(points[k], ahead);
            *off = off.max(foot.distance);
            uvs[k] = at_pole(chart, points[k], foot.uv, ahead, tol);
            (before, last) = (Some(last), k);
        }
    };
    march(&mut (middle + 1..ts.len()), &mut off);
    march(&mut (0..middle).rev(), &mut off);
    let mut pieces: Vec<[DVec2; 4]> = Vec::new();
    let mut breaks = vec![ts[0]];
    for k in 1..ts.len() {
        let ends = [Node { t: ts[k - 1], uv: uvs[k - 1] }, Node { t: ts[k], uv: uvs[k] }];
        off = off.max(halve(chart, curve, ends, tol, MAX_DEPTH, &mut breaks, &mut pieces));
    }
    Ok(Projected { pcurve: joined(&breaks, &pieces)?, off })
}

/// At a pole one parameter is arbitrary: the one that continues the curve is taken.
fn at_pole(chart: &Chart<'_>, p: DVec3, uv: DVec2, ahead: DVec2, tol: f64) -> DVec2 {
    use super::Side;
    let [u, v] = chart.surface().domain();
    match chart.pole_near(p, tol.max(1e-9 * chart.size())) {
        Some(Side::VMin) => DVec2::new(ahead.x, v[0]),
        Some(Side::VMax) => DVec2::new(ahead.x, v[1]),
        Some(Side::UMin) => DVec2::new(u[0], ahead.y),
        Some(Side::UMax) => DVec2::new(u[1], ahead.y),
        None => uv,
    }
}

/// The derivative of the parameters along a curve.
fn slope(chart: &Chart<'_>, curve: &Curve, t: f64, uv: DVec2) -> Option<DVec2> {
    let jet = chart.surface().jet(chart.wrapped(uv), 1);
    let c = curve.derivatives(t, 1)[1];
    let (e, f, g) = (jet.u().length_squared(), jet.u().dot(jet.v()), jet.v().length_squared());
    let determinant = e * g - f * f;
    if !(determinant > 1e-10 * e * g) {
        return None;
    }
    let (a, b) = (c.dot(jet.u()), c.dot(jet.v()));
    Some(DVec2::new(a * g - b * f, b * e - a * f) / determinant).filter(|d| d.is_finite())
}

/// The control points of the piece between two places.
fn hermite(chart: &Chart<'_>, curve: &Curve, [a, b]: [Node; 2]) -> [DVec2; 4] {
    let h = b.t - a.t;
    // Just inside, so that a kink at the end of the piece counts on its own side.
    let inside = 1e-9 * h;
    let chord = (b.uv - a.uv) / h;
    let limited = |d: Option<DVec2>| d.filter(|d| d.length() <= 16.0 * chord.length()).unwrap_or(chord);
    let da = limited(slope(chart, curve, a.t + inside, a.uv));
    let db = limited(slope(chart, curve, b.t - inside, b.uv));
    [a.uv, a.uv + da * (h / 3.0), b.uv - db * (h / 3.0), b.uv]
}

fn middle_of<V>(c: &[V; 4]) -> V
where
    V: Copy + std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>,
{
    (c[0] + (c[1] + c[2]) * 3.0 + c[3]) * 0.125
}

fn bezier_at(c: &[DVec2; 4], s: f64) -> DVec2 {
    let r = 1.0 - s;
    c[0] * (r * r * r) + c[1] * (3.0 * r * r * s) + c[2] * (3.0 * r * s * s) + c[3] * (s * s * s)
}

fn halve(
    chart: &Chart<'_>,
    curve: &Curve,
    [a, b]: [Node; 2],
    tol: f64,
    depth: usize,
    breaks: &mut Vec<f64>,
    pieces: &mut Vec<[DVec2; 4]>,
) -> f64 {
    let piece = hermite(chart, curve, [a, b]);
    let t = 0.5 * (a.t + b.t);
    let (uv, p) = (middle_of(&piece), curve.eval(t));
    let foot = chart.follow(p, uv);
    let mut error = chart.eval(uv).distance(foot.point);
    if error <= tol {
        // A surface may bend otherwise on either side of a knot: the quarters tell, as far as the curve itself is near.
        for s in [0.25, 0.75] {
            let off = chart.eval(bezier_at(&piece, s)).distance(curve.eval(a.t + s * (b.t - a.t)));
            error = error.max(off - 1.5 * foot.distance);
        }
    }
    if error <= tol || depth == 0 || t <= a.t || t >= b.t {
        breaks.push(b.t);
        pieces.push(piece);
        return foot.distance;
    }
    let middle = Node { t, uv: at_pole(chart, p, foot.uv, uv, 0.0) };
    let front = halve(chart, curve, [a, middle], tol, depth - 1, breaks, pieces);
    front.max(halve(chart, curve, [middle, b], tol, depth - 1, breaks, pieces)).max(foot.distance)
}

/// The pieces as one curve; a single segment where they are one.
fn joined(breaks: &[f64], pieces: &[[DVec2; 4]]) -> Result<Curve, CurveError> {
    let (t0, t1) = (breaks[0], breaks[breaks.len() - 1]);
    let (a, b) = (pieces[0][0], pieces[pieces.len() - 1][3]);
    let slack = 1e-12 * (a.abs().max_element() + b.abs().max_element()) + 1e-9 * a.distance(b);
    let is_straight = pieces.iter().zip(breaks.windows(2)).all(|(piece, pair)| {
        piece.iter().enumerate().all(|(k, p)| {
            let t = pair[0] + (pair[1] - pair[0]) * k as f64 / 3.0;
            p.distance(a.lerp(b, (t - t0) / (t1 - t0))) <= slack
        })
    });
    if is_straight {
        return straight(a, b, [t0, t1]);
    }
    let mut points = vec![a.extend(0.0)];
    points.extend(pieces.iter().flat_map(|p| p[1..].iter().map(|p| p.extend(0.0))));
    Curve::new(Knots::clamped(3, breaks, 3)?, points, None)
}

/// The curve in space of a parameter curve, with its parameter.
pub fn lift(chart: &Chart<'_>, pcurve: &Curve, tol: f64) -> Result<Curve, CurveError> {
    let ts = starts(pcurve);
    let slope = |t: f64| {
        let [uv, d, ..] = pcurve.derivatives(t, 1);
        let jet = chart.surface().jet(chart.wrapped(uv.truncate()), 1);
        jet.u() * d.x + jet.v() * d.y
    };
    let point = |t: f64| chart.eval(uv_at(pcurve, t));
    Ok(fitted(&ts, &point, &slope, tol, MAX_DEPTH)?.curve)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::super::{Surface, sweep};
    use super::*;

    fn sphere() -> Surface {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, -FRAC_PI_2, FRAC_PI_2).unwrap();
        sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap()
    }

    /// How far the parameter curve is from the curve in space, at equal parameters.
    fn apart(chart: &Chart<'_>, curve: &Curve, pcurve: &Curve) -> f64 {
        let [a, b] = curve.domain();
        let at = |k: i32| a + (b - a) * f64::from(k) / 400.0;
        (0..=400).map(|k| chart.eval(uv_at(pcurve, at(k))).distance(curve.eval(at(k)))).fold(0.0, f64::max)
    }

    #[test]
    fn a_tilted_circle_on_a_sphere_is_followed_over_the_seam() {
        let sphere = sphere();
        let chart = Chart::new(&sphere);
        let (x, y) = (DVec3::new(0.8, 0.0, 0.6), DVec3::Y);
        let circle = sweep::arc(DVec3::ZERO, x, y, 1.0, 1.0 + TAU).unwrap();
        let found = project(&chart, &circle, None, 1e-8).unwrap();
        assert!(found.off < 1e-12);
        assert!(apart(&chart, &circle, &found.pcurve) < 1e-7, "{}", apart(&chart, &circle, &found.pcurve));
        let [start, end] = found.pcurve.ends();
        assert!(((end - start).x - TAU).abs() < 1e-9 && (end - start).y.abs() < 1e-9);
        let lifted = lift(&chart, &found.pcurve, 1e-8).unwrap();
        assert!(apart(&chart, &lifted, &found.pcurve) < 1e-7);
    }

    #[test]
    fn a_meridian_to_a_pole_keeps_its_angle() {
        let sphere = sphere();
        let chart = Chart::new(&sphere);
        let direction = DVec3::new(0.6, 0.8, 0.0);
        let meridian = sweep::arc(DVec3::ZERO, direction, DVec3::Z, -FRAC_PI_2, FRAC_PI_2).unwrap();
        let found = project(&chart, &meridian, None, 1e-9).unwrap();
        let [start, end] = found.pcurve.ends();
        assert!((start.x - end.x).abs() < 1e-6, "{start} {end}");
        assert!((start.y + FRAC_PI_2).abs() < 1e-12 && (end.y - FRAC_PI_2).abs() < 1e-12, "{start} {end}");
    }

    #[test]
    fn an_iso_curve_is_one_straight_segment() {
        let plane =
            Surface::bilinear([DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 3.0, DVec3::new(4.0, 3.0, 0.0)]).unwrap();
        let chart = Chart::new(&plane);
        let line = Curve::segment(DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, 2.0, 0.0)).unwrap();
        let found = project(&chart, &line, None, 1e-9).unwrap();
        assert_eq!(found.pcurve.knots().degree(), 1);
        assert!(found.pcurve.points()[0].distance(DVec3::new(0.25, 1.0 / 3.0, 0.0)) < 1e-12);
    }
}
