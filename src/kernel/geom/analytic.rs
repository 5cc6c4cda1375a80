//! Planes, cylinders, cones, spheres, tori and conics as exact (rational) splines, bounded by what they must reach.
//!
//! Frames map x, y, z of the surface's own coordinates to space; z is the axis. u is the angle around it (exact at
//! every quarter, see [`super::sweep`]), v runs along the axis or the meridian, and the normal Su x Sv points
//! outwards, as ISO 10303-42 and IGES 5.3 have it. A plane has the coordinates of its frame as parameters. A piece of a
//! conic is a rational quadratic through its ends, with the tangents' intersection as middle control point (Piegl and
//! Tiller, *The NURBS Book*, 7.3). Surfaces without bounds are cut a little beyond what they must reach.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DAffine3, DVec2, DVec3};

use super::arc_length::ArcLength;
use super::fitted::{Fitted, paced};
use super::sweep::{SweepError, arc, revolved};
use super::{Curve, CurveError, Knots, Surface};

/// How far beyond what it must reach an unbounded surface extends, as a fraction of that.
const MARGIN: f64 = 0.01;

/// The range of a coordinate with a margin; -1..1 for no points, and never empty.
pub fn range(points: &[DVec3], axis: usize) -> [f64; 2] {
    let (low, high) =
        points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
    let width = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    match high - low {
        w if w > 1e-12 * width => [low - MARGIN * w, high + MARGIN * w],
        _ if points.is_empty() || width == 0.0 => [-1.0, 1.0],
        _ => [low - MARGIN * width, high + MARGIN * width],
    }
}

fn local(frame: &DAffine3, reach: &[DVec3]) -> Vec<DVec3> {
    let inverse = frame.inverse();
    reach.iter().map(|&p| inverse.transform_point3(p)).collect()
}

/// The plane z = 0 of a frame, around the points that it must reach.
pub fn plane(frame: &DAffine3, reach: &[DVec3]) -> Result<Surface, SweepError> {
    let local = local(frame, reach);
    let (x, y) = (range(&local, 0), range(&local, 1));
    let at = |x: f64, y: f64| frame.transform_point3(DVec3::new(x, y, 0.0));
    let knots = |r: [f64; 2]| Knots::bezier(1, r[0], r[1]).map_err(CurveError::Knots);
    let points = vec![at(x[0], y[0]), at(x[1], y[0]), at(x[0], y[1]), at(x[1], y[1])];
    Ok(Surface::new(knots(x)?, knots(y)?, points, None)?)
}

/// A cylinder around z.
pub fn cylinder(frame: &DAffine3, radius: f64, reach: &[DVec3]) -> Result<Surface, SweepError> {
    cone(frame, radius, 0.0, reach)
}

/// A cone around z: `radius` at z = 0, growing along z with the half angle. It ends at its apex.
pub fn cone(frame: &DAffine3, radius: f64, half_angle: f64, reach: &[DVec3]) -> Result<Surface, SweepError> {
    let slope = half_angle.tan();
    let [low, high] = range(&local(frame, reach), 2);
    let apex = -radius / slope;
    let (low, high) = match slope {
        s if s > 0.0 => (low.max(apex), high),
        s if s < 0.0 => (low, high.min(apex)),
        _ => (low, high),
    };
    let at = |z: f64| frame.transform_point3(DVec3::new((radius + z * slope).max(0.0), 0.0, z));
    let knots = Knots::bezier(1, low, high).map_err(CurveError::Knots)?;
    let meridian = Curve::new(knots, vec![at(low), at(high)], None)?;
    revolved(&meridian, frame.translation, frame.matrix3.z_axis, 0.0, TAU)
}

/// A sphere around the origin of a frame.
pub fn sphere(frame: &DAffine3, radius: f64) -> Result<Surface, SweepError> {
    let axes = frame.matrix3 * radius;
    let meridian = arc(frame.translation, axes.x_axis, axes.z_axis, -FRAC_PI_2, FRAC_PI_2)?;
    revolved(&meridian, frame.translation, axes.z_axis, 0.0, TAU)
}

/// A torus around z. Where the tube is thicker than the ring, `outer` says which of the two sheets is meant.
pub fn torus(frame: &DAffine3, major: f64, minor: f64, outer: bool) -> Result<Surface, SweepError> {
    let center = frame.transform_point3(DVec3::X * major);
    let axes = frame.matrix3 * minor;
    let [from, to] = match major < minor {
        false => [0.0, TAU],
        true => {
            // The circle meets the axis at these angles.
            let meets = (-major / minor).acos();
            if outer { [-meets, meets] } else { [meets, TAU - meets] }
        }
    };
    let circle = arc(center, axes.x_axis, axes.z_axis, from, to)?;
    revolved(&circle, frame.translation, frame.matrix3.z_axis, 0.0, TAU)
}

/// A piece of a conic between two points, given with their tangents and a point of it between them.
fn conic_piece(ends: [DVec2; 2], tangents: [DVec2; 2], between: DVec2) -> Option<(DVec2, f64)> {
    let across = tangents[0].perp_dot(tangents[1]);
    if across.abs() <= 1e-14 * tangents[0].length() * tangents[1].length() {
        return None;
    }
    let middle = ends[0] + tangents[0] * ((ends[1] - ends[0]).perp_dot(tangents[1]) / across);
    // `between` = (P0 + P2 + 2 w P1) / (2 + 2 w) for the shoulder; any point gives w by its barycentric coordinates.
    let (a, b, c) = (ends[0] - middle, ends[1] - middle, between - middle);
    let area = a.perp_dot(b);
    let (s, t) = (c.perp_dot(b) / area, a.perp_dot(c) / area);
    let w = (1.0 - s - t) / (2.0 * (s * t).sqrt());
    (w.is_finite() && w > 0.0).then_some((middle, w))
}

/// The piece of the parabola y^2 = 4 f x between two parameters: (f t^2, 2 f t).
pub fn parabola(frame: &DAffine3, focal: f64, from: f64, to: f64) -> Result<Curve, CurveError> {
    let at = |t: f64| frame.transform_point3(DVec3::new(focal * t * t, 2.0 * focal * t, 0.0));
    // The blossom of t^2 is the product of its arguments.
    let middle = frame.transform_point3(DVec3::new(focal * from * to, focal * (from + to), 0.0));
    Curve::new(Knots::bezier(2, from, to)?, vec![at(from), middle, at(to)], None)
}

/// The piece of the hyperbola (a cosh t, b sinh t) between two parameters.
pub fn hyperbola(frame: &DAffine3, a: f64, b: f64, from: f64, to: f64) -> Result<Curve, CurveError> {
    let at = |t: f64| DVec2::new(a * t.cosh(), b * t.sinh());
    let tangent = |t: f64| DVec2::new(a * t.sinh(), b * t.cosh());
    let (p, q) = (at(from), at(to));
    let place = |p: DVec2| frame.transform_point3(p.extend(0.0));
    match conic_piece([p, q], [tangent(from), tangent(to)], at(0.5 * (from + to))) {
        Some((middle, w)) => {
            Curve::new(Knots::bezier(2, from, to)?, vec![place(p), place(middle), place(q)], Some(vec![1.0, w, 1.0]))
        }
        None => Curve::segment(place(p), place(q)),
    }
}

/// The piece between two points of the conic `a x^2 + b x y + c y^2 + d x + e y + f = 0`; of an ellipse the one that runs
/// counter-clockwise, all of it where the points are one.
pub fn conic(coefficients: [f64; 6], start: DVec2, end: DVec2) -> Result<Curve, SweepError> {
    let [a, b, c, d, e, f] = coefficients;
    let discriminant = b * b - 4.0 * a * c;
    let size = (a * a + b * b + c * c).sqrt();
    if discriminant < -1e-12 * size * size {
        // Centre and main axes of the ellipse.
        let center = DVec2::new(2.0 * c * d - b * e, 2.0 * a * e - b * d) / discriminant;
        let value = a * center.x * center.x
            + b * center.x * center.y
            + c * center.y * center.y
            + d * center.x
            + e * center.y
            + f;
        let turn = if b == 0.0 { 0.0 } else { 0.5 * b.atan2(a - c) };
        let x = DVec2::from_angle(turn);
        let along = |v: DVec2| (-value / (a * v.x * v.x + b * v.x * v.y + c * v.y * v.y)).sqrt();
        let (rx, ry) = (along(x), along(x.perp()));
        let angle = |p: DVec2| ((p - center).dot(x.perp()) / ry).atan2((p - center).dot(x) / rx);
        let from = angle(start);
        let mut to = angle(end);
        if to <= from + 1e-9 {
            to += TAU;
        }
        if !(rx.is_finite() && ry.is_finite()) {
            return Err(SweepError::Direction { what: "radius of the ellipse" });
        }
        return arc(center.extend(0.0), (x * rx).extend(0.0), (x.perp() * ry).extend(0.0), from, to.min(from + TAU));
    }
    let tangent = |p: DVec2| DVec2::new(-(b * p.x + 2.0 * c * p.y + e), 2.0 * a * p.x + b * p.y + d);
    let middle = 0.5 * (start + end);
    let (t0, t1) = (tangent(start), tangent(end));
    let across = t0.perp_dot(t1);
    if across.abs() <= 1e-14 * t0.length() * t1.length() {
        return Ok(Curve::segment(start.extend(0.0), end.extend(0.0))?);
    }
    let apex = start + t0 * ((end - start).perp_dot(t1) / across);
    // Where the line from the middle of the chord to the apex meets the conic: q0 + q1 s + q2 s^2 = 0.
    let step = apex - middle;
    let q2 = a * step.x * step.x + b * step.x * step.y + c * step.y * step.y;
    let q1 = 2.0 * a * middle.x * step.x
        + b * (middle.x * step.y + middle.y * step.x)
        + 2.0 * c * middle.y * step.y
        + d * step.x
        + e * step.y;
    let q0 =
        a * middle.x * middle.x + b * middle.x * middle.y + c * middle.y * middle.y + d * middle.x + e * middle.y + f;
    let root = (q1 * q1 - 4.0 * q2 * q0).max(0.0).sqrt();
    let sum = -0.5 * (q1 + if q1 < 0.0 { -root } else { root });
    let s = [sum / q2, q0 / sum].into_iter().find(|s| (0.0..1.0).contains(s));
    let s = s.ok_or(SweepError::Direction { what: "piece of the conic between its ends" })?;
    let points = vec![start.extend(0.0), apex.extend(0.0), end.extend(0.0)];
    let knots = Knots::bezier(2, 0.0, 1.0).map_err(CurveError::Knots)?;
    Ok(Curve::new(knots, points, Some(vec![1.0, s / (1.0 - s), 1.0]))?)
}

/// The surface of the lines between two curves at equal fractions of their parameters: u along the curves, v from the
/// first to the second.
pub fn ruled(first: &Curve, second: &Curve) -> Result<Surface, SweepError> {
    let normal = |c: &Curve| -> Result<Curve, CurveError> {
        let [a, b] = c.domain();
        let c = c.restricted(a, b)?;
        Curve::new(c.knots().remapped(0.0, 1.0), c.points().to_vec(), c.weights().map(<[f64]>::to_vec))
    };
    let (mut first, mut second) = (normal(first)?, normal(second)?);
    while first.knots().degree() < second.knots().degree() {
        first = first.elevated()?;
    }
    while second.knots().degree() < first.knots().degree() {
        second = second.elevated()?;
    }
    // Knots that differ by rounding are the same.
    let missing = |of: &Curve, from: &Curve| -> Vec<(f64, usize)> {
        let own = of.knots().multiplicities();
        from.knots()
            .multiplicities()
            .into_iter()
            .filter_map(|(t, m)| {
                let has = own.iter().find(|(o, _)| (o - t).abs() < 1e-12);
                let (at, has) = has.map_or((t, 0), |&(o, h)| (o, h));
                (m > has && t > 0.0 && t < 1.0).then_some((at, m - has))
            })
            .collect()
    };
    for (t, times) in missing(&first, &second) {
        first = first.knot_inserted(t, times)?;
    }
    for (t, times) in missing(&second, &first) {
        second = second.knot_inserted(t, times)?;
    }
    let across = Knots::bezier(1, 0.0, 1.0).map_err(CurveError::Knots)?;
    let weights = (first.weights().is_some() || second.weights().is_some()).then(|| {
        let of = |c: &Curve| c.weights().map_or_else(|| vec![1.0; c.points().len()], <[f64]>::to_vec);
        [of(&first), of(&second)].concat()
    });
    let points = [first.points(), second.points()].concat();
    Ok(Surface::new(first.knots().clone(), across, points, weights)?)
}

/// The surface of the lines between two curves at equal fractions of their arc lengths, and how far off that the second
/// curve is. Where equal parameters are equal fractions already, it is exact; else the curve of lower degree is
/// replaced by one that keeps pace with the other.
pub fn ruled_by_length(first: &Curve, second: &Curve) -> Result<(Surface, f64), SweepError> {
    let lengths = [first, second].map(ArcLength::new);
    let fraction = |k: usize, curve: &Curve, s: f64| {
        let [a, b] = curve.domain();
        lengths[k].length_at(curve, a + (b - a) * s) / lengths[k].length()
    };
    let same = (1..64).all(|i| {
        let s = f64::from(i) / 64.0;
        (fraction(0, first, s) - fraction(1, second, s)).abs() <= 1e-9
    });
    if same || lengths.iter().any(|l| !(l.length() > 0.0)) {
        return Ok((ruled(first, second)?, 0.0));
    }
    if first.knots().degree() >= second.knots().degree() {
        let Fitted { curve, off } = paced(second, first)?;
        Ok((ruled(first, &curve)?, off))
    } else {
        let Fitted { curve, off } = paced(first, second)?;
        Ok((ruled(&curve, second)?, off))
    }
}

/// How closely an offset surface is followed, as a fraction of its size.
const OFFSET: f64 = 1e-7;
/// The most pieces of an offset surface for each knot span of its basis, so that memory stays in proportion to that.
const MAX_PIECES: usize = 16;
/// The most cells of an offset surface; eight for each of its basis where that has more spans. A ruled surface by arc
/// length has many spans of its own, whose pieces would multiply.
const MAX_CELLS: usize = 1024;

/// The surface at a distance along its normal as a C1 bicubic spline, halved until the middles of its cells are within 1e-7
/// of its size (at most 16 pieces a span and [`MAX_CELLS`] in all), and how far off they are. Where the surface has no normal the point itself is kept.
pub fn offset(surface: &Surface, distance: f64) -> Result<(Surface, f64), SweepError> {
    let domain = surface.domain();
    let at = |uv: DVec2| {
        let uv = surface.clamped(uv);
        let normal = super::unit_normal(surface, uv).or_else(|| {
            let middle = DVec2::new(0.5 * (domain[0][0] + domain[0][1]), 0.5 * (domain[1][0] + domain[1][1]));
            super::unit_normal(surface, uv.lerp(middle, 1e-5))
        });
        surface.eval(uv) + normal.unwrap_or(DVec3::ZERO) * distance
    };
    let mut lines = [0, 1].map(|k| {
        let breaks = surface.knots()[k].breaks();
        let per_span = if breaks.len() == 2 { 4 } else { 1 };
        let mut out = vec![breaks[0]];
        for pair in breaks.windows(2) {
            out.extend((1..=per_span).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / f64::from(per_span)));
        }
        out
    });
    let tol = OFFSET * surface.bounds().diagonal();
    loop {
        let made = hermite(&at, &lines)?;
        let mut worst = 0.0f64;
        let mut split = [vec![false; lines[0].len() - 1], vec![false; lines[1].len() - 1]];
        for i in 0..lines[0].len() - 1 {
            for j in 0..lines[1].len() - 1 {
                // The middle of a cell splits both ways only where neither of its sides was off.
                let mut sides_off = false;
                for (s, t) in [(0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
                    let uv = DVec2::new(
                        lines[0][i] + s * (lines[0][i + 1] - lines[0][i]),
                        lines[1][j] + t * (lines[1][j + 1] - lines[1][j]),
                    );
                    let off = made.eval(uv).distance(at(uv));
                    worst = worst.max(off);
                    if off > tol && !(sides_off && s == t) {
                        split[0][i] |= s > 0.0;
                        split[1][j] |= t > 0.0;
                        sides_off = true;
                    }
                }
            }
        }
        let spans = [0, 1].map(|k| surface.knots()[k].breaks().len() - 1);
        let after = [0, 1].map(|k| lines[k].len() - 1 + split[k].iter().filter(|s| **s).count());
        let room = (0..2).all(|k| 2 * (lines[k].len() - 1) <= MAX_PIECES * spans[k])
            && after[0] * after[1] <= MAX_CELLS.max(8 * spans[0] * spans[1]);
        if worst <= tol || !room {
            return Ok((made, worst));
        }
        for (line, split) in lines.iter_mut().zip(split) {
            let halves: Vec<f64> =
                line.windows(2).zip(split).filter(|(_, s)| *s).map(|(w, _)| 0.5 * (w[0] + w[1])).collect();
            line.extend(halves);
            line.sort_by(f64::total_cmp);
        }
    }
}

/// The bicubic Hermite interpolant of a function over grid lines, with derivatives by central differences.
fn hermite(at: &dyn Fn(DVec2) -> DVec3, lines: &[Vec<f64>; 2]) -> Result<Surface, SweepError> {
    let cubic = |line: &[f64], values: &[DVec3], slopes: &dyn Fn(usize, bool) -> DVec3| {
        let mut out = vec![values[0]];
        for k in 0..line.len() - 1 {
            let h = (line[k + 1] - line[k]) / 3.0;
            out.extend([values[k] + slopes(k, false) * h, values[k + 1] - slopes(k + 1, true) * h, values[k + 1]]);
        }
        out
    };
    // A difference inside the piece on whose side the slope counts, so that kinks at lines stay kinks.
    let slope = |k: usize, uv: DVec2, line: &[f64], index: usize, before: bool| {
        let h = if before { line[index] - line[index - 1] } else { line[index + 1] - line[index] };
        let step = if before { -1e-4 * h } else { 1e-4 * h };
        let mut d = DVec2::ZERO;
        d[k] = step;
        (at(uv) * -3.0 + at(uv + d) * 4.0 - at(uv + d * 2.0)) / (2.0 * step)
    };
    // Rows along u at every v line, with their derivatives by v on either side, then across.
    let row = |f: &dyn Fn(f64) -> DVec3, df: &dyn Fn(usize, bool) -> DVec3| {
        let values: Vec<DVec3> = lines[0].iter().map(|&u| f(u)).collect();
        cubic(&lines[0], &values, df)
    };
    let mut rows = Vec::new();
    let mut slopes: Vec<[Vec<DVec3>; 2]> = Vec::new();
    for (j, &v) in lines[1].iter().enumerate() {
        let at_u = |u: f64| at(DVec2::new(u, v));
        let du = |i: usize, before: bool| slope(0, DVec2::new(lines[0][i], v), &lines[0], i, before);
        rows.push(row(&at_u, &du));
        let side = |before: bool| {
            if (before && j == 0) || (!before && j + 1 == lines[1].len()) {
                return Vec::new();
            }
            let dv = |u: f64| slope(1, DVec2::new(u, v), &lines[1], j, before);
            let duv = |i: usize, back: bool| {
                let h = if back { lines[0][i - 1] - lines[0][i] } else { lines[0][i + 1] - lines[0][i] };
                let step = 1e-3 * h;
                let u = lines[0][i];
                (dv(u) * -3.0 + dv(u + step) * 4.0 - dv(u + 2.0 * step)) / (2.0 * step)
            };
            row(&dv, &duv)
        };
        slopes.push([side(true), side(false)]);
    }
    let width = rows[0].len();
    let mut points = rows[0].clone();
    for j in 0..lines[1].len() - 1 {
        let h = (lines[1][j + 1] - lines[1][j]) / 3.0;
        points.extend((0..width).map(|i| rows[j][i] + slopes[j][1][i] * h));
        points.extend((0..width).map(|i| rows[j + 1][i] - slopes[j + 1][0][i] * h));
        points.extend_from_slice(&rows[j + 1]);
    }
    let knots = |k: usize| Knots::clamped(3, &lines[k], 3).map_err(CurveError::Knots);
    Ok(Surface::new(knots(0)?, knots(1)?, points, None)?)
}

/// The half angle in radians of a number of degrees; NaN stays NaN.
pub fn radians(degrees: f64) -> f64 {
    degrees * PI / 180.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> DAffine3 {
        DAffine3::IDENTITY
    }

    #[test]
    fn conics_lie_on_their_equations() {
        // An ellipse that is turned and moved, a parabola and a hyperbola.
        let on = |c: [f64; 6], p: DVec3| {
            c[0] * p.x * p.x + c[1] * p.x * p.y + c[2] * p.y * p.y + c[3] * p.x + c[4] * p.y + c[5]
        };
        let turned = [2.0, 1.0, 3.0, -1.0, 0.5, -4.0];
        let start = DVec2::new((1.0 + (1.0f64 + 32.0).sqrt()) / 4.0, 0.0);
        let end = DVec2::new(0.0, (-0.5 + (0.25f64 + 48.0).sqrt()) / 6.0);
        for (c, a, b) in [
            (turned, start, end),
            ([1.0, 0.0, 0.0, 0.0, -2.0, 0.0], DVec2::new(-1.0, 0.5), DVec2::new(3.0, 4.5)),
            ([1.0, 0.0, -4.0, 0.0, 0.0, -1.0], DVec2::new(2f64.sqrt(), 0.5), DVec2::new(5f64.sqrt(), -1.0)),
        ] {
            let curve = conic(c, a, b).unwrap();
            let [from, to] = curve.domain();
            for k in 0..=50 {
                let p = curve.eval(from + (to - from) * f64::from(k) / 50.0);
                assert!(on(c, p).abs() < 1e-12, "{c:?} {p}");
            }
            assert!(curve.ends()[0].distance(a.extend(0.0)) < 1e-12 && curve.ends()[1].distance(b.extend(0.0)) < 1e-12);
        }
        let p = parabola(&identity(), 0.5, -1.0, 2.0).unwrap();
        let h = hyperbola(&identity(), 2.0, 1.0, -1.0, 2.0).unwrap();
        for k in 0..=30 {
            let t = -1.0 + 0.1 * f64::from(k);
            let (p, h) = (p.eval(t), h.eval(t));
            assert!((p.y * p.y - 2.0 * p.x).abs() < 1e-13);
            assert!((h.x * h.x / 4.0 - h.y * h.y - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn surfaces_satisfy_their_equations_and_face_outwards() {
        let frame = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
        let reach = [frame.transform_point3(DVec3::new(0.3, 0.2, -1.0)), frame.transform_point3(DVec3::Z * 2.0)];
        let r = |p: DVec3| p.truncate().length();
        let lemon = |p: DVec3| (r(p) + 1.0).hypot(p.z) - 2.0;
        let apple = |p: DVec3| (r(p) - 1.0).hypot(p.z) - 2.0;
        type Equation<'a> = &'a dyn Fn(DVec3) -> f64;
        let all: [(Surface, Equation<'_>); 6] = [
            (cylinder(&frame, 2.0, &reach).unwrap(), &|p| r(p) - 2.0),
            (cone(&frame, 2.0, 0.3, &reach).unwrap(), &|p| r(p) - 2.0 - p.z * 0.3f64.tan()),
            (sphere(&frame, 2.0).unwrap(), &|p| p.length() - 2.0),
            (torus(&frame, 3.0, 1.0, true).unwrap(), &|p| (r(p) - 3.0).hypot(p.z) - 1.0),
            (torus(&frame, 1.0, 2.0, true).unwrap(), &apple),
            (torus(&frame, 1.0, 2.0, false).unwrap(), &lemon),
        ];
        for (k, (surface, equation)) in all.iter().enumerate() {
            let [u, v] = surface.domain();
            for i in 0..=20 {
                for j in 1..20 {
                    let uv = DVec2::new(
                        u[0] + (u[1] - u[0]) * f64::from(i) / 20.0,
                        v[0] + (v[1] - v[0]) * f64::from(j) / 20.0,
                    );
                    let jet = surface.jet(uv, 1);
                    let p = frame.inverse().transform_point3(jet.p());
                    assert!(equation(p).abs() < 1e-12, "{k} {p}");
                    let out = frame.inverse().transform_vector3(jet.normal().unwrap()) * 1e-3;
                    // The inner sheet of a fat torus faces its axis in the parametrization of the standard.
                    assert!(k == 5 || equation(p + out) > 0.0, "{k} {p}");
                }
            }
        }
    }

    #[test]
    fn an_offset_cylinder_is_a_cylinder_and_a_ruled_surface_contains_its_lines() {
        let cylinder = cylinder(&identity(), 2.0, &[DVec3::ZERO, DVec3::Z]).unwrap();
        let (outer, off) = offset(&cylinder, 0.5).unwrap();
        let [u, v] = outer.domain();
        for i in 0..=60 {
            let uv = DVec2::new(u[0] + (u[1] - u[0]) * f64::from(i) / 60.0, 0.3 * v[0] + 0.7 * v[1]);
            assert!((outer.eval(uv).truncate().length() - 2.5).abs() < 1e-5, "{off}");
        }
        let circle = arc(DVec3::ZERO, DVec3::X, DVec3::Y, 0.0, 2.0).unwrap();
        let line = Curve::polyline(&[DVec3::Z, DVec3::new(1.0, 0.0, 1.0), DVec3::new(2.0, 1.0, 1.0)]).unwrap();
        let surface = ruled(&circle, &line).unwrap();
        for k in 0..=20 {
            let s = f64::from(k) / 20.0;
            assert!(surface.eval(DVec2::new(s, 0.0)).distance(circle.eval(2.0 * s)) < 1e-13);
            assert!(surface.eval(DVec2::new(s, 1.0)).distance(line.eval(s)) < 1e-13);
            let (a, b) = (circle.eval(2.0 * s), line.eval(s));
            let p = surface.eval(DVec2::new(s, 0.4));
            assert!((p - a).cross(b - a).length() < 1e-12);
        }
    }
}
