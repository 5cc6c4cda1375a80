//! STEP geometry as splines: the curves and surfaces of ISO 10303-42. Analytic ones become exact rational
//! splines; unbounded ones are bounded by the points that they must reach.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DAffine3, DMat3, DVec3};

use super::access::{self, Access, Problem, count, list, optional_reference, real, reals, reference, references};
use super::part21::{Instance, Value};
use crate::kernel::geom::sweep::{arc, extruded, revolved};
use crate::kernel::geom::{Curve, Knots, Surface};

/// How deep curves and surfaces may refer to one another.
const MAX_DEPTH: usize = 16;
/// How far beyond what it must reach an unbounded surface extends, as a fraction of that.
const MARGIN: f64 = 0.01;

/// AXIS2_PLACEMENT_3D as a map from its frame to space.
pub fn placement(file: Access<'_, '_>, number: u64) -> Result<DAffine3, Problem> {
    let record = file.record(number, &["AXIS2_PLACEMENT_3D"])?;
    let origin = file.point(reference(record, 1)?)?;
    let z = optional_reference(record, 2).map_or(Ok(DVec3::Z), |n| file.direction(n))?;
    let near_x = optional_reference(record, 3).map_or(Ok(z.any_orthonormal_vector()), |n| file.direction(n))?;
    let x = (near_x - z * near_x.dot(z)).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin))
}

fn knots(record: &super::part21::Record<'_>, degree: usize, at: usize, values_at: usize) -> Result<Knots, Problem> {
    let values = reals(record, values_at)?;
    let counts = list(record, at)?;
    if counts.len() != values.len() {
        return Err(format!("{} multiplicities for {} knots", counts.len(), values.len()));
    }
    let mut all = Vec::new();
    for (count, value) in counts.iter().zip(values) {
        match count {
            Value::Integer(m) if (1..=64).contains(m) => all.extend(std::iter::repeat_n(value, *m as usize)),
            other => return Err(format!("multiplicity {other:?} of knot {value} is not 1..=64")),
        }
    }
    Knots::new(degree, all).map_err(|e| e.to_string())
}

/// The knots of the kinds that spell none: Bezier, uniform, quasi-uniform, piecewise Bezier.
fn implied_knots(kind: &str, degree: usize, points: usize) -> Result<Knots, Problem> {
    if degree == 0 || points <= degree || points > 1 << 24 {
        return Err(format!("{points} control points for degree {degree}"));
    }
    let spans = if kind.contains("UNIFORM") { points - degree } else { (points - 1) / degree };
    let breaks: Vec<f64> = (0..=spans).map(|k| k as f64).collect();
    let knots = if kind.starts_with("UNIFORM") {
        Knots::new(degree, (0..=points + degree).map(|k| k as f64 - degree as f64).collect())
    } else if kind.starts_with("QUASI") {
        Knots::clamped(degree, &breaks, 1)
    } else {
        Knots::clamped(degree, &breaks, degree)
    };
    knots.map_err(|e| e.to_string())
}

/// The records of a spline: a simple instance has its values behind a name, a complex one spreads them.
struct Spline<'f, 'a> {
    base: &'f super::part21::Record<'a>,
    /// Where the degree is in `base`.
    start: usize,
    knots: Option<(&'f super::part21::Record<'a>, usize)>,
    weights: Option<&'f super::part21::Record<'a>>,
    kind: &'f str,
}

fn spline<'f, 'a>(instance: &'f Instance<'a>, what: &str) -> Option<Spline<'f, 'a>> {
    let with_knots = format!("B_SPLINE_{what}_WITH_KNOTS");
    let base_name = format!("B_SPLINE_{what}");
    let rational = format!("RATIONAL_B_SPLINE_{what}");
    let after = if what == "CURVE" { 5 } else { 7 };
    let complex = instance.record(&base_name);
    let kinds = [
        format!("BEZIER_{what}"),
        format!("UNIFORM_{what}"),
        format!("QUASI_UNIFORM_{what}"),
        format!("PIECEWISE_BEZIER_{what}"),
    ];
    let implied = kinds.iter().find_map(|k| instance.record(k));
    if let Some(record) = instance.record(&with_knots) {
        let (base, start) = complex.map_or((record, 1), |base| (base, 0));
        let at = if complex.is_some() { 0 } else { 1 + after };
        let weights = instance.record(&rational);
        return Some(Spline { base, start, knots: Some((record, at)), weights, kind: record.name });
    }
    let (base, start) = match (complex, implied) {
        (Some(base), _) => (base, 0),
        (None, Some(record)) => (record, 1),
        (None, None) => return None,
    };
    let kind = implied.map_or("PIECEWISE_BEZIER", |r| r.name);
    Some(Spline { base, start, knots: None, weights: instance.record(&rational), kind })
}

/// A curve. Lines and parabolas need the points between which they run; closed conics use them where given.
pub fn curve(file: Access<'_, '_>, number: u64, ends: Option<[DVec3; 2]>, depth: usize) -> Result<Curve, Problem> {
    let instance = file.instance(number)?;
    if depth > MAX_DEPTH {
        return Err(format!("#{number}: curves refer to one another more than {MAX_DEPTH} deep"));
    }
    let text = |e: &dyn std::fmt::Display| format!("#{number} {}: {e}", instance.type_name());
    if let Some(s) = spline(instance, "CURVE") {
        let degree = count(s.base, s.start)?;
        let points: Result<Vec<DVec3>, Problem> =
            references(s.base, s.start + 1)?.into_iter().map(|n| file.point(n)).collect();
        let points = points?;
        let knots = match s.knots {
            Some((record, at)) => knots(record, degree, at, at + 1),
            None => implied_knots(s.kind, degree, points.len()),
        };
        let weights = s.weights.map(|w| reals(w, 0)).transpose()?;
        return Curve::new(knots.map_err(|e| text(&e))?, points, weights).map_err(|e| text(&e));
    }
    let record = instance.records.first().ok_or_else(|| format!("#{number} is empty"))?;
    match record.name {
        "LINE" => {
            let [a, b] = match ends {
                Some(ends) => ends,
                None => {
                    let start = file.point(reference(record, 1)?)?;
                    let vector = file.record(reference(record, 2)?, &["VECTOR"])?;
                    [start, start + file.direction(reference(vector, 1)?)? * real(vector, 2)?]
                }
            };
            Curve::segment(a, b).map_err(|e| text(&e))
        }
        "CIRCLE" | "ELLIPSE" => {
            let frame = placement(file, reference(record, 1)?)?;
            let x = real(record, 2)?;
            let y = if record.name == "CIRCLE" { x } else { real(record, 3)? };
            let (from, to) = ends.map_or((0.0, TAU), |ends| {
                let angle = |p: DVec3| {
                    let q = frame.inverse().transform_point3(p);
                    (q.y / y).atan2(q.x / x)
                };
                let [from, mut to] = ends.map(angle);
                // Ends that coincide mean the full turn.
                if ends[0].distance(ends[1]) <= 1e-9 * x.abs().max(y.abs()) || to <= from {
                    to += TAU;
                }
                (from, to.min(from + TAU))
            });
            arc(frame.translation, frame.matrix3.x_axis * x, frame.matrix3.y_axis * y, from, to).map_err(|e| text(&e))
        }
        "POLYLINE" => {
            let points: Result<Vec<DVec3>, Problem> =
                references(record, 1)?.into_iter().map(|n| file.point(n)).collect();
            Curve::polyline(&points?).map_err(|e| text(&e))
        }
        "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" | "BOUNDED_SURFACE_CURVE" => {
            curve(file, reference(record, 1)?, ends, depth + 1)
        }
        "TRIMMED_CURVE" => {
            let point = |at: usize| {
                list(record, at).ok()?.iter().filter_map(access::reference_of).find_map(|n| file.point(n).ok())
            };
            let basis = reference(record, 1)?;
            match (point(2), point(3)) {
                (Some(a), Some(b)) if access::is_true(record, 4) => curve(file, basis, Some([a, b]), depth + 1),
                (Some(a), Some(b)) => Ok(curve(file, basis, Some([b, a]), depth + 1)?.reversed()),
                _ => {
                    let parameter = |at: usize| list(record, at).ok()?.iter().find_map(access::real_of);
                    let whole = curve(file, basis, None, depth + 1)?;
                    match (parameter(2), parameter(3)) {
                        (Some(a), Some(b)) => whole.restricted(a.min(b), a.max(b)).map_err(|e| text(&e)),
                        _ => Err(text(&"neither points nor parameters to trim at")),
                    }
                }
            }
        }
        _ => Err(format!("#{number} {}: a kind of curve that is not read", instance.type_name())),
    }
}

/// A surface. `reach` are points that an unbounded surface must contain (the borders of its face).
pub fn surface(file: Access<'_, '_>, number: u64, reach: &[DVec3], depth: usize) -> Result<Surface, Problem> {
    let instance = file.instance(number)?;
    if depth > MAX_DEPTH {
        return Err(format!("#{number}: surfaces refer to one another more than {MAX_DEPTH} deep"));
    }
    let text = |e: &dyn std::fmt::Display| format!("#{number} {}: {e}", instance.type_name());
    if let Some(s) = spline(instance, "SURFACE") {
        return spline_surface(file, &s).map_err(|e| text(&e));
    }
    let record = instance.records.first().ok_or_else(|| format!("#{number} is empty"))?;
    let frame = |at: usize| placement(file, reference(record, at)?);
    let in_frame = |frame: &DAffine3| -> Vec<DVec3> {
        let inverse = frame.inverse();
        reach.iter().map(|&p| inverse.transform_point3(p)).collect()
    };
    match record.name {
        "PLANE" => {
            let frame = frame(1)?;
            let local = in_frame(&frame);
            let ([x0, x1], [y0, y1]) = (range(&local, 0), range(&local, 1));
            let corners = [[x0, y0], [x1, y0], [x0, y1], [x1, y1]];
            let corners = corners.map(|[x, y]| frame.transform_point3(DVec3::new(x, y, 0.0)));
            Surface::bilinear(corners).map_err(|e| text(&e))
        }
        "CYLINDRICAL_SURFACE" | "CONICAL_SURFACE" => {
            let frame = frame(1)?;
            let radius = real(record, 2)?;
            let slope = if record.name == "CONICAL_SURFACE" { real(record, 3)?.tan() } else { 0.0 };
            let [low, high] = range(&in_frame(&frame), 2);
            // A cone ends at its apex.
            let apex = -radius / slope;
            let (low, high) = if slope > 0.0 {
                (low.max(apex), high)
            } else {
                (low, high.min(if slope < 0.0 { apex } else { high }))
            };
            let at = |z: f64| frame.transform_point3(DVec3::new((radius + z * slope).max(0.0), 0.0, z));
            let meridian = Curve::segment(at(low), at(high)).map_err(|e| text(&e))?;
            revolved(&meridian, frame.translation, frame.matrix3.z_axis, 0.0, TAU).map_err(|e| text(&e))
        }
        "SPHERICAL_SURFACE" => {
            let frame = frame(1)?;
            let axes = frame.matrix3 * real(record, 2)?;
            let meridian = arc(frame.translation, axes.x_axis, axes.z_axis, -FRAC_PI_2, FRAC_PI_2);
            revolved(&meridian.map_err(|e| text(&e))?, frame.translation, axes.z_axis, 0.0, TAU).map_err(|e| text(&e))
        }
        "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
            let frame = frame(1)?;
            let (major, minor) = (real(record, 2)?, real(record, 3)?);
            let center = frame.transform_point3(DVec3::X * major);
            let axes = frame.matrix3 * minor;
            let circle = arc(center, axes.x_axis, axes.z_axis, 0.0, TAU).map_err(|e| text(&e))?;
            revolved(&circle, frame.translation, frame.matrix3.z_axis, 0.0, TAU).map_err(|e| text(&e))
        }
        "SURFACE_OF_LINEAR_EXTRUSION" => {
            let vector = file.record(reference(record, 2)?, &["VECTOR"])?;
            let direction = file.direction(reference(vector, 1)?)?;
            let swept = curve(file, reference(record, 1)?, None, depth + 1)?;
            let along = |p: DVec3| p.dot(direction);
            let own = swept.bounds();
            let local: Vec<DVec3> = reach.iter().map(|&p| DVec3::X * (along(p) - along(own.center()))).collect();
            let half = 0.5 * own.diagonal();
            let [low, high] = if reach.is_empty() { [0.0, real(vector, 2)?] } else { range(&local, 0) };
            let (low, high) = if reach.is_empty() { (low, high) } else { (low - half, high + half) };
            let start = swept.transformed(&DAffine3::from_translation(direction * low));
            extruded(&start, direction * (high - low)).map_err(|e| text(&e))
        }
        "SURFACE_OF_REVOLUTION" => {
            let meridian = curve(file, reference(record, 1)?, None, depth + 1)?;
            let axis = file.record(reference(record, 2)?, &["AXIS1_PLACEMENT"])?;
            let origin = file.point(reference(axis, 1)?)?;
            let direction = optional_reference(axis, 2).map_or(Ok(DVec3::Z), |n| file.direction(n))?;
            revolved(&meridian, origin, direction, 0.0, TAU).map_err(|e| text(&e))
        }
        "RECTANGULAR_TRIMMED_SURFACE" | "CURVE_BOUNDED_SURFACE" => {
            surface(file, reference(record, 1)?, reach, depth + 1)
        }
        _ => Err(format!("#{number} {}: a kind of surface that is not read", instance.type_name())),
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

/// The range of a coordinate with a margin; -1..1 for no points, and never empty.
fn range(points: &[DVec3], axis: usize) -> [f64; 2] {
    let (low, high) =
        points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
    let width = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    match high - low {
        w if w > 1e-12 * width => [low - MARGIN * w, high + MARGIN * w],
        _ if points.is_empty() || width == 0.0 => [-1.0, 1.0],
        _ => [low - MARGIN * width, high + MARGIN * width],
    }
}
