//! STEP surfaces as splines: the surfaces of ISO 10303-42. Analytic ones become exact rational splines; unbounded ones
//! are bounded by the points that they must reach.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

use super::access::{self, Access, Problem, count, list, optional_reference, real, reference};
use super::curves::{Bounds, MAX_DEPTH, Spline, curve, implied_knots, knots, placement, spline};
use super::part21::{Instance, Record, Value};
use crate::kernel::geom::sweep::{extruded, parameter_at_angle, revolved};
use crate::kernel::geom::trim::SurfaceKind;
use crate::kernel::geom::{Surface, analytic};

/// What a surface is, for the face on it.
pub fn kind(instance: &Instance<'_>) -> SurfaceKind {
    match instance.records.first().map(|r| r.name) {
        Some("PLANE") => SurfaceKind::Plane,
        Some("CYLINDRICAL_SURFACE") => SurfaceKind::Cylinder,
        Some("CONICAL_SURFACE") => SurfaceKind::Cone,
        Some("SPHERICAL_SURFACE") => SurfaceKind::Sphere,
        Some("TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE") => SurfaceKind::Torus,
        Some("SURFACE_OF_LINEAR_EXTRUSION") => SurfaceKind::Extrusion,
        Some("SURFACE_OF_REVOLUTION") => SurfaceKind::Revolution,
        Some("OFFSET_SURFACE") => SurfaceKind::Offset,
        _ => SurfaceKind::Spline,
    }
}

/// A surface. `reach` are points that an unbounded surface must contain (the borders of its face).
pub fn surface(file: Access<'_, '_>, number: u64, reach: &[DVec3], depth: usize) -> Result<Surface, Problem> {
    let instance = file.instance(number)?;
    if depth > MAX_DEPTH {
        return Err(format!("#{number}: surfaces refer to one another more than {MAX_DEPTH} deep"));
    }
    file.unfold(instance)?;
    let text = |e: &dyn std::fmt::Display| format!("#{number} {}: {e}", instance.type_name());
    if let Some(s) = spline(instance, "SURFACE") {
        return spline_surface(file, &s).map_err(|e| text(&e));
    }
    let record = instance.records.first().ok_or_else(|| format!("#{number} is empty"))?;
    let frame = || placement(file, reference(record, 1)?);
    match record.name {
        "PLANE" => analytic::plane(&frame()?, reach).map_err(|e| text(&e)),
        "CYLINDRICAL_SURFACE" => analytic::cylinder(&frame()?, real(record, 2)?, reach).map_err(|e| text(&e)),
        "CONICAL_SURFACE" => {
            let angle = real(record, 3)? * file.angle();
            analytic::cone(&frame()?, real(record, 2)?, angle, reach).map_err(|e| text(&e))
        }
        "SPHERICAL_SURFACE" => analytic::sphere(&frame()?, real(record, 2)?).map_err(|e| text(&e)),
        "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
            let outer = record.name == "TOROIDAL_SURFACE" || access::is_true(record, 4);
            analytic::torus(&frame()?, real(record, 2)?, real(record, 3)?, outer).map_err(|e| text(&e))
        }
        "SURFACE_OF_LINEAR_EXTRUSION" => {
            let vector = file.record(reference(record, 2)?, &["VECTOR"])?;
            let direction = file.direction(reference(vector, 1)?)?;
            let swept = reference(record, 1)?;
            // An unbounded curve reaches what the face reaches, seen along the direction.
            let through = anchor(file, swept).unwrap_or(DVec3::ZERO);
            let seen: Vec<DVec3> = reach.iter().map(|&p| flattened(file, swept, through, direction, p)).collect();
            let swept =
                curve(file, swept, if reach.is_empty() { Bounds::Own } else { Bounds::Reach(&seen) }, depth + 1)?;
            let own = swept.bounds();
            let along = |p: DVec3| p.dot(direction) - own.center().dot(direction);
            let local: Vec<DVec3> = reach.iter().map(|&p| DVec3::X * along(p)).collect();
            let half = swept.points().iter().map(|&p| along(p).abs()).fold(0.0, f64::max);
            let [low, high] = if reach.is_empty() { [0.0, real(vector, 2)?] } else { analytic::range(&local, 0) };
            let (low, high) = if reach.is_empty() { (low, high) } else { (low - half, high + half) };
            let start = swept.transformed(&DAffine3::from_translation(direction * low));
            extruded(&start, direction * (high - low)).map_err(|e| text(&e))
        }
        "SURFACE_OF_REVOLUTION" => {
            let axis = file.record(reference(record, 2)?, &["AXIS1_PLACEMENT"])?;
            let origin = file.point(reference(axis, 1)?)?;
            let direction = optional_reference(axis, 2).map_or(Ok(DVec3::Z), |n| file.direction(n))?;
            let swept = reference(record, 1)?;
            // An unbounded meridian reaches what the face reaches, turned into its plane.
            let seen = turned(file, swept, origin, direction, reach);
            let bounds = if seen.is_empty() { Bounds::Own } else { Bounds::Reach(&seen) };
            let meridian = curve(file, swept, bounds, depth + 1)?;
            revolved(&meridian, origin, direction, 0.0, TAU).map_err(|e| text(&e))
        }
        "OFFSET_SURFACE" => {
            let distance = real(record, 2)?;
            let basis = surface(file, reference(record, 1)?, reach, depth + 1)?;
            Ok(analytic::offset(&basis, distance).map_err(|e| text(&e))?.0)
        }
        "RECTANGULAR_TRIMMED_SURFACE" => rectangle(file, record, depth).map_err(|e| text(&e)),
        "CURVE_BOUNDED_SURFACE" | "ORIENTED_SURFACE" | "SURFACE_REPLICA" if record.name != "SURFACE_REPLICA" => {
            surface(file, reference(record, 1)?, reach, depth + 1)
        }
        _ => Err(format!("#{number} {}: a kind of surface that is not read", instance.type_name())),
    }
}

/// A point of a line or the centre of a conic.
fn anchor(file: Access<'_, '_>, number: u64) -> Option<DVec3> {
    let record = file.instance(number).ok()?.records.first()?;
    match record.name {
        "LINE" => file.point(reference(record, 1).ok()?).ok(),
        "CIRCLE" | "ELLIPSE" | "PARABOLA" | "HYPERBOLA" => {
            placement(file, reference(record, 1).ok()?).ok().map(|f| f.translation)
        }
        _ => None,
    }
}

/// A point moved along the direction of extrusion to where the curve is: of a line exactly, else to the plane through
/// the anchor across the direction.
fn flattened(file: Access<'_, '_>, swept: u64, through: DVec3, direction: DVec3, p: DVec3) -> DVec3 {
    let line = file.record(swept, &["LINE"]).ok().and_then(|record| {
        let vector = file.record(reference(record, 2).ok()?, &["VECTOR"]).ok()?;
        file.direction(reference(vector, 1).ok()?).ok()
    });
    let r = p - through;
    match line {
        Some(d) => {
            // r = s d + t direction, by least squares.
            let c = d.dot(direction);
            let s = (r.dot(d) - c * r.dot(direction)) / (1.0 - c * c);
            if s.is_finite() { through + d * s } else { p }
        }
        None => p - direction * r.dot(direction),
    }
}

/// Points of a surface of revolution turned to where its meridian, a line, passes them.
fn turned(file: Access<'_, '_>, swept: u64, origin: DVec3, axis: DVec3, reach: &[DVec3]) -> Vec<DVec3> {
    let line = file.record(swept, &["LINE"]).ok().and_then(|record| {
        let vector = file.record(reference(record, 2).ok()?, &["VECTOR"]).ok()?;
        Some((file.point(reference(record, 1).ok()?).ok()?, file.direction(reference(vector, 1).ok()?).ok()?))
    });
    let Some((start, d)) = line else { return Vec::new() };
    let (rise, z0) = (d.dot(axis), (start - origin).dot(axis));
    let mut out = Vec::new();
    for &p in reach {
        let z = (p - origin).dot(axis);
        if rise.abs() > 1e-9 {
            out.push(start + d * ((z - z0) / rise));
            continue;
        }
        // Across the axis: at the same distance from it, on the side where the line starts.
        let radius = (p - origin - axis * z).length();
        let foot = start - origin - axis * z0;
        let along = foot.dot(d);
        let rest = (radius * radius - (foot.length_squared() - along * along)).max(0.0).sqrt();
        out.push(start + d * (if along >= 0.0 { rest } else { -rest } - along));
    }
    out
}

/// RECTANGULAR_TRIMMED_SURFACE: a basis between two values of either parameter, as the standard counts them.
fn rectangle(file: Access<'_, '_>, record: &Record<'_>, depth: usize) -> Result<Surface, Problem> {
    let number = reference(record, 1)?;
    let (u, v) = ([real(record, 2)?, real(record, 3)?], [real(record, 4)?, real(record, 5)?]);
    let basis = file.instance(number)?;
    let angle = file.angle();
    let ordered = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
    let angles = |r: [f64; 2]| {
        let [a, b] = r.map(|x| x * angle);
        let from = a.rem_euclid(TAU);
        let width = if b > a { (b - a).min(TAU) } else { (b - a).rem_euclid(TAU) };
        (from, if width <= 1e-12 { TAU } else { width })
    };
    let sweep = |surface: Surface, u: [f64; 2], v: Option<[f64; 2]>| -> Result<Surface, Problem> {
        let (from, width) = angles(u);
        let seamed = crate::kernel::geom::chart::reseamed(
            &surface,
            crate::kernel::geom::Direction::U,
            parameter_at_angle(0.0, TAU, from),
        );
        let surface = seamed.map_err(|e| e.to_string())?;
        let [[start, end], whole] = surface.domain();
        let to = parameter_at_angle(0.0, TAU, (from + width).rem_euclid(TAU));
        let to = if width >= TAU - 1e-12 { end } else { start + (to - start).rem_euclid(TAU) };
        let v = v.map_or(whole, ordered).map(|x| x.clamp(whole[0], whole[1]));
        surface.restricted([start, to.min(end)], v).map_err(|e| e.to_string())
    };
    let frame = || -> Result<DAffine3, Problem> {
        let record = basis.records.first().ok_or("its basis is empty")?;
        placement(file, reference(record, 1)?)
    };
    match kind(basis) {
        SurfaceKind::Plane => {
            let frame = frame()?;
            let corners =
                [DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1])].map(|p| frame.transform_point3(p.extend(0.0)));
            let whole = surface(file, number, &corners, depth + 1)?;
            whole.restricted(ordered(u), ordered(v)).map_err(|e| e.to_string())
        }
        SurfaceKind::Cylinder | SurfaceKind::Cone => {
            let frame = frame()?;
            let cone = kind(basis) == SurfaceKind::Cone;
            let record = basis.records.first().ok_or("its basis is empty")?;
            // A cone's v runs along z.
            let corners = v.map(|z| frame.transform_point3(DVec3::Z * z));
            if cone {
                real(record, 3)?;
            }
            sweep(surface(file, number, &corners, depth + 1)?, u, Some(v))
        }
        SurfaceKind::Sphere => {
            let v = v.map(|x| x * angle).map(|a| parameter_at_angle(-TAU / 4.0, TAU / 4.0, a));
            sweep(surface(file, number, &[], depth + 1)?, u, Some(v))
        }
        SurfaceKind::Torus => {
            let whole = sweep(surface(file, number, &[], depth + 1)?, u, None)?;
            let (from, width) = angles(v);
            let to = parameter_at_angle(0.0, TAU, (from + width).min(TAU));
            let own = whole.domain()[0];
            whole.restricted(own, [parameter_at_angle(0.0, TAU, from), to]).map_err(|e| e.to_string())
        }
        SurfaceKind::Revolution => sweep(surface(file, number, &[], depth + 1)?, u, Some(v)),
        _ => {
            let whole = surface(file, number, &[], depth + 1)?;
            let [wu, wv] = whole.domain();
            let inside = |[a, b]: [f64; 2], [low, high]: [f64; 2]| ordered([a, b]).map(|x| x.clamp(low, high));
            whole.restricted(inside(u, wu), inside(v, wv)).map_err(|e| e.to_string())
        }
    }
}

fn spline_surface(file: Access<'_, '_>, s: &Spline<'_, '_>) -> Result<Surface, Problem> {
    let (p, q) = (count(s.base, s.start)?, count(s.base, s.start + 1)?);
    // The file lists rows of constant u; here u runs fastest.
    let rows = list(s.base, s.start + 2)?;
    let nv = rows.first().map_or(0, |r| if let Value::List(row) = r { row.len() } else { 0 });
    let nu = rows.len();
    let mut points = vec![DVec3::ZERO; nu * nv];
    for (i, row) in rows.iter().enumerate() {
        let Value::List(row) = row else { return Err("a row of control points is no list".to_owned()) };
        if row.len() != nv {
            return Err(format!("row {i} has {} control points, the first has {nv}", row.len()));
        }
        for (j, value) in row.iter().enumerate() {
            let point =
                access::reference_of(value).ok_or_else(|| format!("control point ({i}, {j}) is no reference"))?;
            points[j * nu + i] = file.point(point)?;
        }
    }
    let (u, v) = match s.knots {
        Some((record, at)) => (knots(record, p, at, at + 2)?, knots(record, q, at + 1, at + 3)?),
        None => (implied_knots(s.kind, p, nu)?, implied_knots(s.kind, q, nv)?),
    };
    let mut weights = None;
    if let Some(record) = s.weights {
        let mut all = vec![1.0; nu * nv];
        for (i, row) in list(record, 0)?.iter().enumerate().take(nu) {
            let Value::List(row) = row else { return Err("a row of weights is no list".to_owned()) };
            for (j, value) in row.iter().enumerate().take(nv) {
                all[j * nu + i] = access::real_of(value).unwrap_or(f64::NAN);
            }
        }
        weights = Some(all);
    }
    Surface::new(u, v, points, weights).map_err(|e| e.to_string())
}
