//! From traced chains to the result in model units: points dense enough for the tolerance, and an error bound.

use glam::DVec2;

use super::correct::{Condition, PointPair};
use super::engine::{Chain, Engine};
use super::result::{CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind, Region};
use super::trace::{Mode, TraceNode, Tracer, hermite};

/// The largest number of points between two traced ones.
const MOST_BETWEEN: usize = 512;

/// Everything in model units.
pub fn assemble(engine: &Engine, tol: f64) -> Intersection {
    let tracer = Tracer { sides: [&engine.sides[0], &engine.sides[1]], options: engine.trace, discs: &[] };
    let mut curves: Vec<IntersectionCurve> =
        engine.chains.iter().filter(|c| c.nodes.len() > 1).map(|chain| curve(engine, &tracer, chain, tol)).collect();
    let junctions = engine
        .contacts
        .iter()
        .map(|contact| {
            let node = TraceNode {
                pa: contact.pair[0],
                pb: contact.pair[1],
                at: contact.binormal.at,
                p: contact.binormal.p,
                tangent: glam::DVec3::ZERO,
                rates: [0.0; 4],
                sine: 1.0,
                sense: 0.0,
            };
            let point = point_of(engine, &node);
            let kind = match contact.arms.len() {
                0 => JunctionKind::Isolated,
                4 => JunctionKind::X,
                _ => JunctionKind::HigherOrder,
            };
            let gap = contact.binormal.gap / engine.frame.scale;
            Junction { xyz: point.xyz, a: point.a, uv: point.uv, b: point.b, st: point.st, gap, kind }
        })
        .collect();
    let mut regions = Vec::new();
    for (k, region) in engine.regions.iter().enumerate() {
        let boundary: Vec<Vec<CurvePoint>> =
            region.loops.iter().map(|l| l.iter().map(|q| super::region::point_of(engine, q)).collect()).collect();
        let max_distance = region.distance / engine.frame.scale;
        for points in &boundary {
            curves.push(IntersectionCurve {
                kind: CurveKind::CoincidentBoundary,
                closed: true,
                ends: [CurveEnd::Loop; 2],
                end_ids: [None; 2],
                // The polylines were sampled to this sag.
                error_bound: max_distance + tol,
                region: Some(k),
                points: points.clone(),
            });
        }
        regions.push(Region { boundary, max_distance });
    }
    Intersection {
        complete: engine.unresolved.is_empty(),
        tol,
        curves,
        junctions,
        regions,
        unresolved: engine.unresolved.clone(),
        ..Intersection::default()
    }
}

/// A traced point in model units and surface parameters, on the pieces' closed domains.
pub fn point_of(engine: &Engine, node: &TraceNode) -> CurvePoint {
    let (a, b) = (&engine.sides[0].pieces[node.pa], &engine.sides[1].pieces[node.pb]);
    let uv = node.at.uv.clamp(DVec2::ZERO, DVec2::ONE);
    let st = node.at.st.clamp(DVec2::ZERO, DVec2::ONE);
    let p = if uv == node.at.uv && st == node.at.st { node.p } else { 0.5 * (a.point(uv) + b.point(st)) };
    CurvePoint { xyz: engine.frame.to_model(p), a: a.surface, uv: a.to_surface(uv), b: b.surface, st: b.to_surface(st) }
}

fn curve(engine: &Engine, tracer: &Tracer<'_>, chain: &Chain, tol: f64) -> IntersectionCurve {
    let wanted = 0.7 * tol * engine.frame.scale;
    let mut bound: f64 = 0.0;
    let mut points: Vec<CurvePoint> = Vec::with_capacity(chain.nodes.len() * 2);
    let push = |points: &mut Vec<CurvePoint>, node: &TraceNode| {
        let point = point_of(engine, node);
        let repeated = points.last().is_some_and(|last: &CurvePoint| {
            last.a == point.a && last.b == point.b && last.uv == point.uv && last.st == point.st
        });
        if !repeated {
            points.push(point);
        }
    };
    for (k, from) in chain.nodes.iter().enumerate() {
        push(&mut points, from);
        let (a, b) = (&engine.sides[0].pieces[from.pa], &engine.sides[1].pieces[from.pb]);
        bound = bound.max(a.point(from.at.uv).distance(b.point(from.at.st)));
        let Some(to) = chain.nodes.get(k + 1).filter(|to| to.same_pair(from)) else { continue };
        let off = |x: &TraceNode, y: &TraceNode| {
            let at = hermite(x, y, 0.5);
            let middle = 0.5 * (x.p + y.p);
            a.point(at.uv).distance(middle).max(b.point(at.st).distance(middle))
        };
        let sag = off(from, to);
        let parts = ((sag / wanted).sqrt().ceil() as usize).clamp(1, MOST_BETWEEN);
        let mut last = *from;
        for j in 1..=parts {
            let next = if j == parts { *to } else { between(tracer, chain.mode, from, to, j as f64 / parts as f64) };
            bound = bound.max(1.2 * off(&last, &next));
            if j < parts {
                push(&mut points, &next);
            }
            last = next;
        }
    }
    let [start, end] = chain.ends;
    let closed = start.end == CurveEnd::Loop;
    let kind = match chain.mode {
        Mode::Transversal => CurveKind::Transversal,
        Mode::Tangential => CurveKind::Tangential,
    };
    IntersectionCurve {
        kind,
        closed,
        ends: [start.end, end.end],
        end_ids: [start.contact, end.contact],
        error_bound: bound / engine.frame.scale
            + 16.0 * f64::EPSILON * points.iter().fold(0.0, |m: f64, p| m.max(p.xyz.abs().max_element())),
        region: None,
        points,
    }
}

/// A corrected point between two traced ones; the interpolated one where correction fails (near a junction).
fn between(tracer: &Tracer<'_>, mode: Mode, from: &TraceNode, to: &TraceNode, f: f64) -> TraceNode {
    let at = hermite(from, to, f);
    let pair = [from.pa, from.pb];
    let chord = (to.p - from.p).normalize_or_zero();
    let (a, b) = (&tracer.sides[0].pieces[pair[0]], &tracer.sides[1].pieces[pair[1]]);
    let p = 0.5 * (a.point(at.uv) + b.point(at.st));
    let condition = Condition::Plane { point: p, direction: chord };
    let length = from.p.distance(to.p);
    let found = tracer.locate(mode, pair, at, condition, chord);
    let inside = |x: &PointPair| x.to_array().iter().all(|v| (-1e-6..=1.0 + 1e-6).contains(v));
    found.filter(|n| n.p.distance(p) < 0.1 * length && inside(&n.at)).unwrap_or_else(|| {
        let rates = std::array::from_fn(|k| from.rates[k] * (1.0 - f) + to.rates[k] * f);
        TraceNode { at, p, tangent: chord, rates, ..*from }
    })
}
