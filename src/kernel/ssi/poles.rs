//! Curves through poles. A curve that runs into a pole (a border of a piece that is one point) ends there, because no step
//! leads out of it on the same piece; what comes out of the pole in the same direction is its continuation, perhaps the
//! curve itself. Where directions do not match (the tip of a cone) or more than two ends do, nothing is joined.
//!
//! Cost: the square of the number of ends in poles. It cannot fail.

use glam::DVec3;

use super::engine::{Chain, ChainEnd, Engine};
use super::node::TraceNode;
use super::result::CurveEnd;
use super::trace::Mode;

/// The cosine between the directions of two ends from which on one continues the other.
const STRAIGHT_ON: f64 = 0.9;

/// An end this near to a pole is in it, in the unit frame.
const IN_POLE: f64 = 1e-8;

/// An end of a chain in a pole.
struct PoleEnd {
    chain: usize,
    /// Whether it is the last point.
    last: bool,
    p: DVec3,
    /// The direction into the pole.
    into: DVec3,
}

fn in_pole(engine: &Engine, node: &TraceNode) -> bool {
    [node.pa, node.pb].into_iter().zip(&engine.sides).any(|(piece, side)| {
        let mut borders = side.borders_of(piece).iter();
        borders.any(|e| e.is_pole(engine.trace.joining) && e.bounds.center().distance(node.p) <= IN_POLE)
    })
}

fn ends(engine: &Engine) -> Vec<PoleEnd> {
    let mut out = Vec::new();
    for (chain, of) in engine.chains.iter().enumerate() {
        for (last, node) in [(false, of.nodes.first()), (true, of.nodes.last())] {
            let Some(node) = node else { continue };
            let open = of.ends[usize::from(last)].end == CurveEnd::Boundary && of.mode == Mode::Transversal;
            if open && in_pole(engine, node) {
                let into = if last { node.tangent } else { -node.tangent };
                out.push(PoleEnd { chain, last, p: node.p, into });
            }
        }
    }
    out
}

/// Joins the chains that go on in one another through a pole.
pub fn join(engine: &mut Engine) {
    loop {
        let ends = ends(engine);
        let goes_on = |x: &PoleEnd, y: &PoleEnd| {
            x.p.distance(y.p) <= engine.trace.joining
                && x.into.dot(-y.into) > STRAIGHT_ON
                && (x.chain, x.last) != (y.chain, y.last)
        };
        let only = |k: usize| {
            let mut all = (0..ends.len()).filter(|&l| goes_on(&ends[k], &ends[l]));
            all.next().filter(|_| all.next().is_none())
        };
        let Some((k, l)) = (0..ends.len()).find_map(|k| Some((k, only(k).filter(|&l| only(l) == Some(k))?))) else {
            return;
        };
        let (x, y) = (&ends[k], &ends[l]);
        if x.chain == y.chain {
            engine.chains[x.chain].ends = [ChainEnd { end: CurveEnd::Loop, contact: None }; 2];
            continue;
        }
        let (first, second) = (x.chain.min(y.chain), x.chain.max(y.chain));
        let (at_first, at_second) = if x.chain == first { (x.last, y.last) } else { (y.last, x.last) };
        let other = engine.chains.remove(second);
        let other = if at_second { reversed(other) } else { other };
        let own = std::mem::take(&mut engine.chains[first].nodes);
        let own = Chain { nodes: own, ..engine.chains[first] };
        let mut own = if at_first { own } else { reversed(own) };
        own.nodes.extend(other.nodes);
        own.ends[1] = other.ends[1];
        engine.chains[first] = own;
    }
}

fn reversed(chain: Chain) -> Chain {
    let nodes = chain.nodes.into_iter().rev().map(TraceNode::reversed).collect();
    Chain { nodes, ends: [chain.ends[1], chain.ends[0]], ..chain }
}
