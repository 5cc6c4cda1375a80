//! From traced chains to the result in model units: points dense enough for the tolerance, and an error bound.
//!
//! The bound is one of the chords between points, as true as rounding: see [`super::chords`].

use glam::DVec2;

use super::chords::{Bounds, chord_bound_from_middle, divide};
use super::correct::{Condition, PointPair, correct};
use super::engine::{Chain, Engine};
use super::node::TraceNode;
use super::region::RegionPoint;
use super::result::{CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind, Region};
use super::trace::{Mode, Tracer};

/// What rounding may leave of a parameter beyond a border.
const BY_ROUNDING: f64 = 1e-13;
/// How far along it a point may be moved onto a border that it is just beyond, in the unit frame.
const NEAR_BORDER: f64 = 1e-5;

/// Everything in model units.
pub fn assemble(engine: &Engine, tol: f64) -> Intersection {
    let tracer = Tracer { sides: [&engine.sides[0], &engine.sides[1]], options: engine.trace, discs: &[] };
    let mut bounds = Bounds::new(engine);
    let long = engine.chains.iter().filter(|c| c.nodes.len() > 1);
    let mut curves: Vec<IntersectionCurve> =
        long.map(|chain| curve(engine, &tracer, &mut bounds, chain, tol)).collect();
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
                off: 0.0,
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
        for (points, line) in boundary.iter().zip(&region.loops) {
            curves.push(IntersectionCurve {
                kind: CurveKind::CoincidentBoundary,
                closed: true,
                ends: [CurveEnd::Loop; 2],
                end_ids: [None; 2],
                error_bound: boundary_bound(engine, &mut bounds, line) / engine.frame.scale + rounding(points),
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

/// A traced point on the pieces' closed domains: corrections may leave them by rounding near a border.
pub fn settled(engine: &Engine, node: &TraceNode) -> TraceNode {
    let at = PointPair { uv: node.at.uv.clamp(DVec2::ZERO, DVec2::ONE), st: node.at.st.clamp(DVec2::ZERO, DVec2::ONE) };
    if at == node.at {
        return *node;
    }
    let (a, b) = (&engine.sides[0].pieces[node.pa], &engine.sides[1].pieces[node.pb]);
    let (from, to) = (node.at.to_array(), at.to_array());
    let moved = |k: usize| (to[k] - from[k]).abs();
    let farthest = (0..4).fold(0, |best, k| if moved(k) > moved(best) { k } else { best });
    if node.sense != 0.0 && moved(farthest) > BY_ROUNDING {
        // The tracer lets a curve lie beyond a border by a little: on the border instead, where it crosses that.
        let on_border = Condition::Fixed(farthest, to[farthest]);
        let inside = |x: PointPair| x.to_array().iter().all(|v| (-BY_ROUNDING..=1.0 + BY_ROUNDING).contains(v));
        let found = correct(a, b, at, on_border, engine.trace.floor);
        if let Some(c) = found.filter(|c| inside(c.at) && c.point().distance(node.p) < NEAR_BORDER) {
            let mut x = c.at.to_array().map(|v| v.clamp(0.0, 1.0));
            x[farthest] = to[farthest];
            return TraceNode { at: PointPair::from_array(x), p: c.point(), off: 0.5 * c.residual, ..*node };
        }
    }
    let (a, b) = (a.point(at.uv), b.point(at.st));
    TraceNode { at, p: 0.5 * (a + b), off: 0.5 * a.distance(b), ..*node }
}

/// A traced point in model units and surface parameters.
pub fn point_of(engine: &Engine, node: &TraceNode) -> CurvePoint {
    let (a, b) = (&engine.sides[0].pieces[node.pa], &engine.sides[1].pieces[node.pb]);
    let node = settled(engine, node);
    CurvePoint {
        xyz: engine.frame.to_model(node.p),
        a: a.surface,
        uv: a.to_surface(node.at.uv),
        b: b.surface,
        st: b.to_surface(node.at.st),
    }
}

fn curve(engine: &Engine, tracer: &Tracer<'_>, bounds: &mut Bounds, chain: &Chain, tol: f64) -> IntersectionCurve {
    let wanted = 0.98 * tol * engine.frame.scale;
    let mut bound: f64 = 0.0;
    let mut points: Vec<CurvePoint> = Vec::with_capacity(chain.nodes.len() * 2);
    let mut push = |node: &TraceNode| {
        let point = point_of(engine, node);
        let repeated = points.last().is_some_and(|last: &CurvePoint| {
            last.a == point.a && last.b == point.b && last.uv == point.uv && last.st == point.st
        });
        if !repeated {
            points.push(point);
        }
    };
    let mut nodes: Vec<TraceNode> = chain.nodes.iter().map(|n| settled(engine, n)).collect();
    if chain.mode == Mode::Tangential {
        nodes = thinned(engine, bounds, &nodes, wanted);
    }
    let mut length = f64::INFINITY;
    let mut last: Option<&TraceNode> = None;
    // In a pole a curve may go on elsewhere on the same piece.
    for run in nodes.chunk_by(|x, y| x.same_pair(y) && x.p != y.p) {
        push(&run[0]);
        if let Some(before) = last {
            bound = bound.max(before.p.distance(run[0].p) + before.off + run[0].off);
        }
        if run.len() > 1 {
            let how = (engine, tracer, chain.mode);
            bound = bound.max(divide(how, bounds, run, wanted, &mut length, &mut push));
        }
        last = run.last();
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
        error_bound: bound / engine.frame.scale + rounding(&points),
        region: None,
        points,
    }
}

/// The points of a curve of contact that chords within `wanted` need. Such curves are followed in steps that the gap
/// beside them asks for, many times shorter than chords need to be.
fn thinned(engine: &Engine, bounds: &mut Bounds, nodes: &[TraceNode], wanted: f64) -> Vec<TraceNode> {
    let mut fits = |x: &TraceNode, y: &TraceNode| {
        let off = x.off.max(y.off);
        let (a, b) = (&engine.sides[0].pieces[x.pa], &engine.sides[1].pieces[x.pb]);
        chord_bound_from_middle(a, &bounds.get(0, x.pa, a), [x.at.uv, y.at.uv], off) <= wanted
            && chord_bound_from_middle(b, &bounds.get(1, x.pb, b), [x.at.st, y.at.st], off) <= wanted
    };
    let mut out: Vec<TraceNode> = nodes.first().copied().into_iter().collect();
    let mut at = 0;
    while at + 1 < nodes.len() {
        // Twice as far as long as the chord fits, then back to the last that did.
        let from = &nodes[at];
        let straight = |k: usize| nodes[k].same_pair(from) && nodes[k].tangent.dot(from.tangent) > 0.9;
        let last = (at + 1..nodes.len()).take_while(|&k| straight(k)).last().unwrap_or(at + 1);
        let (mut good, mut step) = (at + 1, 2);
        while good < last {
            let next = (at + step).min(last);
            if next <= good || !fits(from, &nodes[next]) {
                break;
            }
            good = next;
            step *= 2;
        }
        let (mut low, mut high) = (good, (at + step).min(last + 1));
        while low + 1 < high {
            let middle = (low + high) / 2;
            if fits(from, &nodes[middle]) { low = middle } else { high = middle }
        }
        at = low;
        out.push(nodes[at]);
    }
    out
}

/// What rounding does to points in model units.
fn rounding(points: &[CurvePoint]) -> f64 {
    16.0 * f64::EPSILON * points.iter().fold(0.0, |m: f64, p| m.max(p.xyz.abs().max_element()))
}

/// An upper bound of the distance of a region's boundary to both sides, in the unit frame.
fn boundary_bound(engine: &Engine, bounds: &mut Bounds, line: &[RegionPoint]) -> f64 {
    let mut step = |w: &[RegionPoint]| {
        let (x, y) = (&w[0], &w[1]);
        let places = [[x.a, y.a], [x.b, y.b]];
        if places.iter().any(|[x, y]| x.piece != y.piece) {
            return x.p.distance(y.p);
        }
        let mut on = |side: usize| {
            let [from, to] = places[side];
            let piece = &engine.sides[side].pieces[from.piece];
            let own = bounds.get(side, from.piece, piece);
            let off = piece.point(from.uv).distance(x.p).max(piece.point(to.uv).distance(y.p));
            chord_bound_from_middle(piece, &own, [from.uv, to.uv], off)
        };
        [on(0), on(1)].into_iter().fold(0.0, f64::max)
    };
    line.windows(2).map(&mut step).fold(0.0, f64::max)
}
