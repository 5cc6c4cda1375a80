//! Rational B-spline curves (126) and surfaces (128).

use glam::DVec3;

use super::params::{ParamError, Params};
use crate::io::tidy::RawNet;
use crate::kernel::geom::{Curve, Surface};

/// How far inside the knots a stated parameter range must end to be a real restriction, as a fraction of the
/// domain. Writers round the range.
const RANGE: f64 = 1e-9;

fn reals(params: &mut Params<'_>, count: usize, what: &'static str) -> Result<Vec<f64>, ParamError> {
    (0..count).map(|_| params.real(what)).collect()
}

fn points(params: &mut Params<'_>, count: usize) -> Result<Vec<DVec3>, ParamError> {
    const WHAT: &str = "a coordinate of a control point";
    (0..count).map(|_| Ok(DVec3::new(params.real(WHAT)?, params.real(WHAT)?, params.real(WHAT)?))).collect()
}

/// Upper index, degree and knot count of one direction.
fn sizes(params: &Params<'_>, upper: i64, degree: i64) -> Result<[usize; 3], String> {
    let (Ok(k), Ok(m)) = (usize::try_from(upper), usize::try_from(degree)) else {
        return Err(format!("the upper index is {upper} and the degree {degree}; neither can be negative"));
    };
    if k < m {
        return Err(format!("{} control points are too few for degree {m}", k.saturating_add(1)));
    }
    params.room(params.index, "control points and knots", k, 1).map_err(|e| e.to_string())?;
    Ok([k + 1, m, k + m + 2])
}

/// The curves of a record: one, or several where it jumps.
pub(super) fn curve(params: &mut Params<'_>, notes: &mut Vec<String>) -> Result<Vec<Curve>, String> {
    let text = |e: ParamError| e.to_string();
    let upper = params.integer("the upper index").map_err(text)?;
    let degree = params.integer("the degree").map_err(text)?;
    for _ in 0..4 {
        params.next(); // planar, closed, polynomial, periodic: all of them follow from the numbers
    }
    let [count, degree, knot_count] = sizes(params, upper, degree)?;
    let total = count.saturating_mul(4).saturating_add(knot_count);
    params.room(params.index, "values of knots, weights and points", total, 1).map_err(text)?;
    let knots = reals(params, knot_count, "a knot").map_err(text)?;
    let weights = reals(params, count, "a weight").map_err(text)?;
    let points = points(params, count).map_err(text)?;
    let (low, high) = (knots[degree], knots[count]);
    let start = params.real_or(low, "the start parameter").map_err(text)?;
    let end = params.real_or(high, "the end parameter").map_err(text)?;
    for _ in 0..3 {
        params.next(); // the unit normal of a planar curve
    }
    let curves = RawNet::curve(degree, knots, points, Some(weights)).into_curves(notes)?;
    if !is_restriction([start, end], [low, high]) {
        return Ok(curves);
    }
    notes.push(format!("restricted to its parameter range {start}..{end}"));
    curves
        .iter()
        .filter_map(|curve| overlap(curve.domain(), [start, end]).map(|[a, b]| curve.restricted(a, b)))
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}

/// The surfaces of a record: one, or several where it jumps.
pub(super) fn surface(params: &mut Params<'_>, notes: &mut Vec<String>) -> Result<Vec<Surface>, String> {
    let text = |e: ParamError| e.to_string();
    let mut integer = |what| params.integer(what).map_err(text);
    let upper = [integer("the upper index along u")?, integer("the upper index along v")?];
    let degree = [integer("the degree along u")?, integer("the degree along v")?];
    for _ in 0..5 {
        params.next(); // closed, polynomial, periodic: all of them follow from the numbers
    }
    let [nu, p, knots_u] = sizes(params, upper[0], degree[0])?;
    let [nv, q, knots_v] = sizes(params, upper[1], degree[1])?;
    let count = nu.saturating_mul(nv);
    let total = count.saturating_mul(4).saturating_add(knots_u).saturating_add(knots_v);
    params.room(params.index, "values of knots, weights and points", total, 1).map_err(text)?;
    let u = reals(params, knots_u, "a knot along u").map_err(text)?;
    let v = reals(params, knots_v, "a knot along v").map_err(text)?;
    let weights = reals(params, count, "a weight").map_err(text)?;
    let points = points(params, count).map_err(text)?;
    let domain = [[u[p], u[nu]], [v[q], v[nv]]];
    let mut range = domain;
    for range in &mut range {
        for value in range {
            *value = params.real_or(*value, "the parameter range").map_err(text)?;
        }
    }
    let net = RawNet { degree: [p, q], knots: [u, v], count: [nu, nv], points, weights: Some(weights) };
    let surfaces = net.into_surfaces(notes)?;
    if !(0..2).any(|d| is_restriction(range[d], domain[d])) {
        return Ok(surfaces);
    }
    let [u, v] = range;
    notes.push(format!("restricted to its parameter range {}..{} x {}..{}", u[0], u[1], v[0], v[1]));
    surfaces
        .iter()
        .filter_map(|surface| {
            let domain = surface.domain();
            Some(surface.restricted(overlap(domain[0], range[0])?, overlap(domain[1], range[1])?))
        })
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}

/// Whether the range that a record states cuts something off. A range outside of the knots, or without length, is
/// nonsense and taken as the whole.
fn is_restriction(range: [f64; 2], domain: [f64; 2]) -> bool {
    let slack = RANGE * (domain[1] - domain[0]);
    let inside = range[0] >= domain[0] - slack && range[1] <= domain[1] + slack && range[1] - range[0] > slack;
    inside && (range[0] > domain[0] + slack || range[1] < domain[1] - slack)
}

/// The common part of two intervals, if it has length.
fn overlap(a: [f64; 2], b: [f64; 2]) -> Option<[f64; 2]> {
    let (low, high) = (a[0].max(b[0]), a[1].min(b[1]));
    (low < high).then_some([low, high])
}
