//! Curves that were followed twice: where two borders of a patch run into one another in a pole, a seed next to it lies on
//! neither as far as can be told, and the curve along the border is followed from it once more.
//!
//! A chain is dropped when its nodes at [`PLACES`] along it lie on chains that are kept, by the test that seeds pass
//! ([`super::trace::Tracer::passes`]); those that end well and are longest are kept. So are two curves side by side, however
//! near: their points differ. A chain whose points are all one is no curve; it is dropped, too, and with it what was left open
//! where it lies on borders of both sides: they touch there, as patches of a model do in a pole. Cost: one test for each
//! chain that is no repeat, against the steps of other chains on the same pieces.

use std::collections::{HashMap, HashSet};

use super::engine::{Chain, Engine};
use super::node::{TraceNode, lengths};
use super::open::SAME_POINT;
use super::result::CurveEnd;
use super::trace::Tracer;

/// Where along a chain it is compared, in fractions of its length.
const PLACES: [f64; 9] = [0.5, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9];
/// A chain from border to border that is shorter than this, in the unit frame, is a point.
const SHORTEST: f64 = 1e-9;
/// How near a border counts as on it, in local parameters.
const ON_BORDER: f64 = 1e-6;

/// How near a kept chain the end of a dropped one may be, in the unit frame.
const BESIDE: f64 = 1e-6;
/// Why following a curve ends where another one goes on.
const GIVEN_UP: [&str; 2] = ["the border of a patch is met at too shallow an angle", "the curve cannot be followed"];

fn length(chain: &Chain) -> f64 {
    chain.nodes.windows(2).map(|w| w[0].p.distance(w[1].p)).sum()
}

fn is_point(chain: &Chain) -> bool {
    let loose = chain.ends.iter().all(|e| matches!(e.end, CurveEnd::Boundary | CurveEnd::Loop));
    let Some(first) = chain.nodes.first() else { return true };
    loose && chain.nodes.iter().all(|n| n.p.distance(first.p) < SHORTEST)
}

/// Whether a chain that could not be followed is a point in which borders of both sides touch, as at a pole: no crossing is
/// there.
fn is_touch(engine: &Engine, chain: &Chain) -> bool {
    let on_border = |side: usize, n: &TraceNode| {
        let (piece, at) = if side == 0 { (n.pa, n.at.uv) } else { (n.pb, n.at.st) };
        engine.sides[side].borders_of(piece).iter().any(|e| (at[e.fixed] - e.value).abs() < ON_BORDER)
    };
    let Some(first) = chain.nodes.first() else { return true };
    let open = chain.ends.iter().all(|e| matches!(e.end, CurveEnd::Boundary | CurveEnd::Unresolved));
    let small = chain.nodes.iter().all(|n| n.p.distance(first.p) < SAME_POINT);
    open && small && chain.nodes.iter().all(|n| on_border(0, n) && on_border(1, n))
}

/// The nodes at the places.
fn samples(chain: &Chain) -> Vec<&TraceNode> {
    let (whole, so_far) = (length(chain), lengths(&chain.nodes));
    PLACES.iter().filter_map(|f| chain.nodes.get(so_far.partition_point(|&s| s < f * whole))).collect()
}

/// Drops what is there twice, with what was left open where a dropped chain ends on a kept one.
pub fn drop_repeats(engine: &mut Engine) {
    if engine.chains.len() < 2 && !engine.chains.iter().any(|c| is_point(c) || is_touch(engine, c)) {
        return;
    }
    let mut order: Vec<(usize, f64, usize)> = Vec::with_capacity(engine.chains.len());
    for (k, chain) in engine.chains.iter().enumerate() {
        let open = chain.ends.iter().filter(|e| e.end == CurveEnd::Unresolved).count();
        order.push((open, -length(chain), k));
    }
    order.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)).then(x.2.cmp(&y.2)));
    let tracer = Tracer { sides: [&engine.sides[0], &engine.sides[1]], options: engine.trace, discs: &[] };
    let mut steps: HashMap<(usize, usize), Vec<(usize, usize)>> = HashMap::new();
    let mut dropped: HashSet<usize> = HashSet::new();
    let mut explained: Vec<TraceNode> = Vec::new();
    for (_, _, k) in order {
        let chain = &engine.chains[k];
        let on_kept = |node: &TraceNode| {
            let own = steps.get(&(node.pa, node.pb));
            own.is_some_and(|own| {
                own.iter().any(|&(other, at)| {
                    let nodes = &engine.chains[other].nodes;
                    engine.chains[other].mode == chain.mode && tracer.passes(&nodes[at], &nodes[at + 1], node, 0.0)
                })
            })
        };
        // Next to a pole points differ by more than they should, where the borders are one in space.
        let beside_kept = |node: &TraceNode| {
            let own = steps.get(&(node.pa, node.pb)).into_iter().flatten();
            own.map(|&(other, at)| &engine.chains[other].nodes[at..at + 2]).any(|w| {
                let (from, along) = (w[0].p, w[1].p - w[0].p);
                let f = ((node.p - from).dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
                (from + along * f).distance(node.p) < BESIDE + engine.trace.tol
            })
        };
        let arm = chain.ends.iter().any(|e| e.end == CurveEnd::Junction);
        if is_touch(engine, chain) {
            explained.extend(chain.nodes.first().into_iter().chain(chain.nodes.last()));
            dropped.insert(k);
            continue;
        }
        if is_point(chain) || (!arm && samples(chain).into_iter().all(&on_kept)) {
            let ends = [chain.nodes.first(), chain.nodes.last()];
            let open = ends.into_iter().zip(&chain.ends).filter(|(_, e)| e.end == CurveEnd::Unresolved);
            explained.extend(open.filter_map(|(n, _)| n).filter(|n| on_kept(n) || beside_kept(n)));
            dropped.insert(k);
            continue;
        }
        for (at, w) in chain.nodes.windows(2).enumerate().filter(|(_, w)| w[0].same_pair(&w[1])) {
            steps.entry((w[0].pa, w[0].pb)).or_default().push((k, at));
        }
    }
    if dropped.is_empty() {
        return;
    }
    let mut number = 0;
    engine.chains.retain(|_| {
        number += 1;
        !dropped.contains(&(number - 1))
    });
    for node in explained {
        let (a, b) = (&engine.sides[0].pieces[node.pa], &engine.sides[1].pieces[node.pb]);
        // Corrected points may be outside by rounding, the boxes of open places are not.
        let inside = |at: glam::DVec2| at.clamp(glam::DVec2::ZERO, glam::DVec2::ONE);
        let (uv, st) = (a.to_surface(inside(node.at.uv)), b.to_surface(inside(node.at.st)));
        let holds = |range: [[f64; 2]; 2], p: glam::DVec2| (0..2).all(|k| range[k][0] <= p[k] && p[k] <= range[k][1]);
        // Unless a kept chain ends there as well.
        let ends_here = |c: &Chain| {
            let ends = [c.nodes.first(), c.nodes.last()].into_iter().zip(&c.ends);
            ends.filter_map(|(n, e)| n.filter(|_| e.end == CurveEnd::Unresolved)).any(|n| n.p.distance(node.p) < 1e-2)
        };
        if engine.chains.iter().any(ends_here) {
            continue;
        }
        engine.unresolved.retain(|u| {
            let here = u.a == a.surface && u.b == b.surface && holds(u.uv_box, uv) && holds(u.st_box, st);
            !(here && GIVEN_UP.contains(&u.reason.as_str()))
        });
    }
}
