//! STEP curves as splines: the curves of ISO 10303-42. Conics become exact rational splines; unbounded curves are bounded
//! by the points between which they run or that they must reach.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};

use super::access::{self, Access, Problem, count, list, optional_reference, real, reals, reference, references};
use super::part21::{Instance, Record, Value};
use crate::kernel::geom::sweep::arc;
use crate::kernel::geom::{Curve, Knots, analytic, chain, fitted};

/// How deep curves and surfaces may refer to one another.
pub const MAX_DEPTH: usize = 16;
/// How near two points are one, as a fraction of a curve's size.
const SAME: f64 = 1e-6;

/// Where a curve begins and ends.
#[derive(Clone, Copy, Debug)]
pub enum Bounds<'p> {
    /// Where it does by itself.
    Own,
    /// At these points, in its own direction.
    Ends([DVec3; 2]),
    /// So that it passes these points, where it has no ends of its own.
    Reach(&'p [DVec3]),
}

/// AXIS2_PLACEMENT_3D as a map from its frame to space.
pub fn placement(file: Access<'_, '_>, number: u64) -> Result<DAffine3, Problem> {
    let record = file.record(number, &["AXIS2_PLACEMENT_3D"])?;
    let origin = file.point(reference(record, 1)?)?;
    let z = optional_reference(record, 2).map_or(Ok(DVec3::Z), |n| file.direction(n))?;
    let near_x = optional_reference(record, 3).map_or(Ok(z.any_orthonormal_vector()), |n| file.direction(n))?;
    let x = (near_x - z * near_x.dot(z)).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin))
}

/// The knots of a record: multiplicities and values.
pub fn knots(record: &Record<'_>, degree: usize, at: usize, values_at: usize) -> Result<Knots, Problem> {
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
pub fn implied_knots(kind: &str, degree: usize, points: usize) -> Result<Knots, Problem> {
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
pub struct Spline<'f, 'a> {
    /// The record with degrees and control points.
    pub base: &'f Record<'a>,
    /// Where the degree is in `base`.
    pub start: usize,
    /// The record with knots, and where they begin in it.
    pub knots: Option<(&'f Record<'a>, usize)>,
    /// The record with weights.
    pub weights: Option<&'f Record<'a>>,
    /// The name of the kind that implies knots.
    pub kind: &'f str,
}

/// The records of a spline, of which `what` is CURVE or SURFACE.
pub fn spline<'f, 'a>(instance: &'f Instance<'a>, what: &str) -> Option<Spline<'f, 'a>> {
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

/// A curve between its bounds.
pub fn curve(file: Access<'_, '_>, number: u64, bounds: Bounds<'_>, depth: usize) -> Result<Curve, Problem> {
    let instance = file.instance(number)?;
    if depth > MAX_DEPTH {
        return Err(format!("#{number}: curves refer to one another more than {MAX_DEPTH} deep"));
    }
    file.unfold(instance)?;
    let text = |e: &dyn std::fmt::Display| format!("#{number} {}: {e}", instance.type_name());
    let cut = |whole: Curve| match bounds {
        Bounds::Ends([a, b]) => {
            let tol = SAME * whole.bounds().diagonal();
            chain::between(&whole, a, b, tol).map_err(|e| text(&e))
        }
        _ => Ok(whole),
    };
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
        return cut(Curve::new(knots.map_err(|e| text(&e))?, points, weights).map_err(|e| text(&e))?);
    }
    let record = instance.records.first().ok_or_else(|| format!("#{number} is empty"))?;
    match record.name {
        "LINE" => {
            let start = file.point(reference(record, 1)?)?;
            let vector = file.record(reference(record, 2)?, &["VECTOR"])?;
            let (direction, length) = (file.direction(reference(vector, 1)?)?, real(vector, 2)?);
            let [a, b] = match bounds {
                Bounds::Ends(ends) => ends,
                Bounds::Reach(points) if !points.is_empty() => {
                    let along: Vec<DVec3> = points.iter().map(|p| DVec3::X * (*p - start).dot(direction)).collect();
                    analytic::range(&along, 0).map(|t| start + direction * t)
                }
                _ => [start, start + direction * length],
            };
            Curve::segment(a, b).map_err(|e| text(&e))
        }
        "CIRCLE" | "ELLIPSE" => {
            let frame = placement(file, reference(record, 1)?)?;
            let x = real(record, 2)?;
            let y = if record.name == "CIRCLE" { x } else { real(record, 3)? };
            let (from, to) = match bounds {
                Bounds::Ends(ends) => {
                    let inverse = frame.inverse();
                    let [from, mut to] = ends.map(|p| {
                        let q = inverse.transform_point3(p);
                        (q.y / y).atan2(q.x / x)
                    });
                    // Ends that coincide mean the full turn.
                    if ends[0].distance(ends[1]) <= 1e-9 * x.abs().max(y.abs()) || to <= from {
                        to += TAU;
                    }
                    (from, to.min(from + TAU))
                }
                _ => (0.0, TAU),
            };
            arc(frame.translation, frame.matrix3.x_axis * x, frame.matrix3.y_axis * y, from, to).map_err(|e| text(&e))
        }
        "PARABOLA" | "HYPERBOLA" => {
            let frame = placement(file, reference(record, 1)?)?;
            let a = real(record, 2)?;
            let b = if record.name == "PARABOLA" { a } else { real(record, 3)? };
            let is_parabola = record.name == "PARABOLA";
            let inverse = frame.inverse();
            let parameter = |p: DVec3| {
                let y = inverse.transform_point3(p).y;
                if is_parabola { y / (2.0 * a) } else { (y / b).asinh() }
            };
            let (from, to) = match bounds {
                Bounds::Ends(ends) => (parameter(ends[0]), parameter(ends[1])),
                Bounds::Reach(points) if !points.is_empty() => {
                    let along: Vec<DVec3> = points.iter().map(|&p| DVec3::X * parameter(p)).collect();
                    let [from, to] = analytic::range(&along, 0);
                    (from, to)
                }
                _ => return Err(text(&"it has no ends")),
            };
            let piece = |from: f64, to: f64| match is_parabola {
                true => analytic::parabola(&frame, a, from, to).map_err(|e| text(&e)),
                false => analytic::hyperbola(&frame, a, b, from, to).map_err(|e| text(&e)),
            };
            if from <= to { piece(from, to) } else { Ok(piece(to, from)?.reversed()) }
        }
        "POLYLINE" => {
            let points: Result<Vec<DVec3>, Problem> =
                references(record, 1)?.into_iter().map(|n| file.point(n)).collect();
            cut(Curve::polyline(&points?).map_err(|e| text(&e))?)
        }
        "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" | "BOUNDED_SURFACE_CURVE" => {
            curve(file, reference(record, 1)?, bounds, depth + 1)
        }
        "COMPOSITE_CURVE" | "COMPOSITE_CURVE_ON_SURFACE" | "BOUNDARY_CURVE" | "OUTER_BOUNDARY_CURVE" => {
            let mut pieces = Vec::new();
            for (piece, same_sense) in segments(file, record)? {
                let piece = curve(file, piece, Bounds::Own, depth + 1)?;
                pieces.push(if same_sense { piece } else { piece.reversed() });
            }
            cut(chain::concatenated(&pieces).map_err(|e| text(&e))?)
        }
        "OFFSET_CURVE_3D" => {
            let (basis, distance) = (reference(record, 1)?, real(record, 2)?);
            let across = file.direction(reference(record, 4)?)?;
            // A line is bounded by the ends, moved back; a conic's ends are at the same angles; others are cut.
            let on_basis = match (bounds, file.record(basis, &["LINE"])) {
                (Bounds::Ends([a, b]), Ok(_)) => {
                    let aside = across.cross(b - a).normalize_or_zero() * distance;
                    Bounds::Ends([a - aside, b - aside])
                }
                (Bounds::Ends(_), _) if file.record(basis, &["CIRCLE"]).is_ok() => bounds,
                (Bounds::Ends(_), _) => Bounds::Own,
                _ => bounds,
            };
            let basis = curve(file, basis, on_basis, depth + 1)?;
            let made = fitted::offset_curve(&basis, across, &|_| [distance, 0.0]).map_err(|e| text(&e))?;
            cut(made.curve)
        }
        "TRIMMED_CURVE" => {
            let trimmed = trimmed(file, record, depth).map_err(|e| text(&e))?;
            cut(trimmed)
        }
        _ => Err(format!("#{number} {}: a kind of curve that is not read", instance.type_name())),
    }
}

/// The curves of a composite and whether it runs with them.
pub fn segments(file: Access<'_, '_>, composite: &Record<'_>) -> Result<Vec<(u64, bool)>, Problem> {
    let mut out = Vec::new();
    for segment in references(composite, 1)? {
        let segment = file.record(segment, &["COMPOSITE_CURVE_SEGMENT", "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT"])?;
        out.push((reference(segment, 2)?, access::is_true(segment, 1)));
    }
    Ok(out)
}

/// TRIMMED_CURVE: by points where it has them, else by parameters of its basis.
fn trimmed(file: Access<'_, '_>, record: &Record<'_>, depth: usize) -> Result<Curve, Problem> {
    let point =
        |at: usize| list(record, at).ok()?.iter().filter_map(access::reference_of).find_map(|n| file.point(n).ok());
    let basis = reference(record, 1)?;
    let forward = access::is_true(record, 4);
    let ends = match (point(2), point(3)) {
        (Some(a), Some(b)) => Some([a, b]),
        _ => {
            let parameter = |at: usize| list(record, at).ok()?.iter().find_map(access::real_of);
            let (Some(a), Some(b)) = (parameter(2), parameter(3)) else {
                return Err("neither points nor parameters to trim at".into());
            };
            match at_parameter(file, basis)? {
                Some(at) => Some([at(a), at(b)]),
                None => {
                    let whole = curve(file, basis, Bounds::Own, depth + 1)?;
                    let [low, high] = whole.domain();
                    let (a, b) = (a.clamp(low, high), b.clamp(low, high));
                    let piece = whole.restricted(a.min(b), a.max(b)).map_err(|e| e.to_string())?;
                    return Ok(if forward { piece } else { piece.reversed() });
                }
            }
        }
    };
    match (ends, forward) {
        (Some(ends), true) => curve(file, basis, Bounds::Ends(ends), depth + 1),
        (Some([a, b]), false) => Ok(curve(file, basis, Bounds::Ends([b, a]), depth + 1)?.reversed()),
        (None, _) => Err("neither points nor parameters to trim at".into()),
    }
}

/// A curve by its parameter.
type PointAt<'f> = Box<dyn Fn(f64) -> DVec3 + 'f>;

/// Points of lines and conics by the parameters that the standard gives them.
fn at_parameter<'f>(file: Access<'f, '_>, number: u64) -> Result<Option<PointAt<'f>>, Problem> {
    let instance = file.instance(number)?;
    let Some(record) = instance.records.first() else { return Ok(None) };
    let frame = || placement(file, reference(record, 1)?);
    let in_frame = |frame: DAffine3, of: Box<dyn Fn(f64) -> DVec3>| -> Box<dyn Fn(f64) -> DVec3> {
        Box::new(move |t| frame.transform_point3(of(t)))
    };
    Ok(Some(match record.name {
        "LINE" => {
            let start = file.point(reference(record, 1)?)?;
            let vector = file.record(reference(record, 2)?, &["VECTOR"])?;
            let step = file.direction(reference(vector, 1)?)? * real(vector, 2)?;
            Box::new(move |t| start + step * t)
        }
        "CIRCLE" | "ELLIPSE" => {
            let x = real(record, 2)?;
            let y = if record.name == "CIRCLE" { x } else { real(record, 3)? };
            let unit = file.angle();
            in_frame(frame()?, Box::new(move |t| DVec3::new(x * (t * unit).cos(), y * (t * unit).sin(), 0.0)))
        }
        "PARABOLA" => {
            let f = real(record, 2)?;
            in_frame(frame()?, Box::new(move |t| DVec3::new(f * t * t, 2.0 * f * t, 0.0)))
        }
        "HYPERBOLA" => {
            let (a, b) = (real(record, 2)?, real(record, 3)?);
            in_frame(frame()?, Box::new(move |t| DVec3::new(a * t.cosh(), b * t.sinh(), 0.0)))
        }
        _ => return Ok(None),
    }))
}
