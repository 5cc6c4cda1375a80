//! From traced points to a polyline: as many points as chords within the tolerance need, and a bound of those chords.
//!
//! The tracer's steps are as long as cubic interpolation allows, several chords each. Between its points the interpolant
//! is so close to the curve that one Newton step from it is exact to rounding; bounds of second derivatives prove that
//! for every point (else it is corrected as any other). The jets of that step, with bounds of third derivatives, then
//! bound the chords on both sides ([`chord_bound`]): one evaluation of each surface for a point.

use glam::DVec2;

use super::correct::{Condition, PointPair, newton_step};
use super::derivative_bounds::DerivativeBounds;
use super::engine::Engine;
use super::node::{TraceNode, along, hermite, lengths};
use super::output::settled;
use super::piece::{Jet1, Jet2, Patch, Piece};
use super::trace::{Mode, Tracer};

/// Chords shorter than this are not made shorter, in the unit frame.
const SHORTEST: f64 = 1e-9;
/// The part of the tolerance that a chord is made for, so that few turn out too long.
const AIM: f64 = 0.93;
/// One Newton step is enough where it leaves no more than this of the distance to either surface, in the unit frame.
const EXACT: f64 = 1e-14;

/// The bounds of the derivatives of pieces, computed when they are first asked for.
pub struct Bounds {
    of: [Vec<Option<DerivativeBounds>>; 2],
}

impl Bounds {
    /// None yet, for the pieces of both sides.
    pub fn new(engine: &Engine) -> Self {
        Self { of: [0, 1].map(|side: usize| vec![None; engine.sides[side].pieces.len()]) }
    }

    /// Those of a piece of a side.
    pub fn get(&mut self, side: usize, index: usize, piece: &Piece) -> DerivativeBounds {
        *self.of[side][index].get_or_insert_with(|| DerivativeBounds::of(piece))
    }
}

/// An upper bound of the distance from the chord between two points to a piece, where both lie within `off` of their
/// places on it, the parameters `x` and `y` in [0, 1]^2. `jet` is the piece's at `place`, best in the middle.
///
/// Filip's bound for D(t) = chord(t) - S(x(t)) with x(t) = x + (y - x) t + q t (1 - t): |D| is at most that of the ends
/// plus max |D''| / 8. q takes the tangential part of D'' away, which would measure the parametrization and not the
/// distance; D'' is evaluated at `place`, and third derivatives bound how it varies. Where x(t) would leave the piece, q
/// has no part across that border: the bounds hold on the piece only, and beyond a knot line another one goes on with
/// derivatives of its own.
pub fn chord_bound((place, jet): (DVec2, &Jet2), bounds: &DerivativeBounds, [x, y]: [DVec2; 2], off: f64) -> f64 {
    let delta = y - x;
    let [uu, uv, vv] = jet.second;
    let bend = uu * (delta.x * delta.x) + uv * (2.0 * delta.x * delta.y) + vv * (delta.y * delta.y);
    let (e, f, g) = (jet.u.length_squared(), jet.u.dot(jet.v), jet.v.length_squared());
    let det = e * g - f * f;
    let q = if det > 1e-12 * e * g {
        let (bu, bv) = (bend.dot(jet.u), bend.dot(jet.v));
        0.5 * DVec2::new((g * bu - f * bv) / det, (e * bv - f * bu) / det)
    } else {
        DVec2::ZERO
    };
    let mut q = if q.length() <= delta.length() { q } else { DVec2::ZERO };
    let room = x.min(y).min(DVec2::ONE - x.max(y));
    if 0.25 * q.x.abs() > room.x {
        q.x = 0.0;
    }
    if 0.25 * q.y.abs() > room.y {
        q.y = 0.0;
    }
    let there = (bend - (jet.u * q.x + jet.v * q.y) * 2.0).length();
    let (dq, w) = (q.abs(), delta.abs() + q.abs());
    let away = (place - x).abs().max((place - y).abs()) + 0.25 * dq;
    let varies = bounds.third(away, w) + 2.0 * bounds.second(dq, w) + 2.0 * bounds.second(away, dq);
    off + (there + varies) / 8.0
}

/// The same with the jet in the middle of the chord.
pub fn chord_bound_from_middle(piece: &Piece, bounds: &DerivativeBounds, ends: [DVec2; 2], off: f64) -> f64 {
    let middle = 0.5 * (ends[0] + ends[1]);
    chord_bound((middle, &piece.jet2(middle)), bounds, ends, off)
}

/// Where the jets of a chord's bound were taken, and the jets.
type Jets = (PointPair, [Jet2; 2]);

/// Traced points of one curve on one pair of pieces.
struct Run<'a> {
    engine: &'a Engine,
    tracer: &'a Tracer<'a>,
    mode: Mode,
    nodes: &'a [TraceNode],
    /// The length of the chords up to each of them.
    at: Vec<f64>,
    pieces: [&'a Piece; 2],
    bounds: [DerivativeBounds; 2],
}

/// Passes points of the curve through `nodes`, which lie on one pair of pieces, to `push`, without the first and with the
/// last. Returns a bound of the distance of the chords between them from both surfaces; it is at most `wanted` except
/// where points are off them by more. `length` is that of the next chord, as found on the run before. No chord is longer
/// than the tracer's steps there: where the surfaces run close together much longer ones would do, far from the curve.
pub fn divide(
    (engine, tracer, mode): (&Engine, &Tracer<'_>, Mode),
    bounds: &mut Bounds,
    nodes: &[TraceNode],
    wanted: f64,
    length: &mut f64,
    push: &mut impl FnMut(&TraceNode),
) -> f64 {
    let (Some(first), Some(end)) = (nodes.first(), nodes.last()) else { return 0.0 };
    let pieces = [&engine.sides[0].pieces[first.pa], &engine.sides[1].pieces[first.pb]];
    let bounds = [bounds.get(0, first.pa, pieces[0]), bounds.get(1, first.pb, pieces[1])];
    let at = lengths(nodes);
    let total = at.last().copied().unwrap_or(0.0);
    let run = Run { engine, tracer, mode, nodes, at, pieces, bounds };
    let mut coming = *length;
    let (mut last, mut done, mut stretch, mut worst) = (*first, 0.0, 0, 0.0);
    loop {
        while stretch + 2 < nodes.len() && run.at[stretch + 1] <= done {
            stretch += 1;
        }
        let step = run.at.get(stretch + 1).map_or(0.0, |end| end - run.at[stretch]);
        let reach = length.min(step);
        let rest = total - done;
        let to_end = rest <= 1.02 * reach || rest < SHORTEST;
        let next = if rest < 2.0 * reach { done + 0.5 * rest } else { done + reach };
        let (node, jets) = if to_end {
            let middle = PointPair { uv: 0.5 * (last.at.uv + end.at.uv), st: 0.5 * (last.at.st + end.at.st) };
            (*end, run.jets(middle))
        } else {
            run.point(next)
        };
        let here = run.bound(&jets, [&last, &node]);
        let made = if to_end { rest } else { next - done };
        // Ends that are off their surfaces are no better where the chord is shorter.
        let kept = here <= wanted || last.off.max(node.off) > wanted || made < SHORTEST;
        // A short step of the tracer says little about what comes after it.
        let most = if kept { (2.0 * made).max(*length) } else { 0.9 * made };
        let better = (made * (AIM * wanted / here).sqrt()).clamp(0.1 * made, most);
        if !kept {
            (*length, coming) = (better, better);
            continue;
        }
        // What was learned is for the chord after the next, so that the processor can begin that one meanwhile.
        (*length, coming) = (coming, better);
        push(&node);
        worst = f64::max(worst, here);
        if to_end {
            return worst;
        }
        (last, done) = (node, next);
    }
}

impl Run<'_> {
    fn jets(&self, at: PointPair) -> Jets {
        (at, [self.pieces[0].jet2(at.uv), self.pieces[1].jet2(at.st)])
    }

    /// A bound for the chord between two points.
    fn bound(&self, (place, jets): &Jets, [x, y]: [&TraceNode; 2]) -> f64 {
        let off = x.off.max(y.off);
        let on_a = chord_bound((place.uv, &jets[0]), &self.bounds[0], [x.at.uv, y.at.uv], off);
        let on_b = chord_bound((place.st, &jets[1]), &self.bounds[1], [x.at.st, y.at.st], off);
        // Around a pole much of a parameter is passed in next to no length.
        on_a.max(on_b).min(off + 0.5 * x.p.distance(y.p))
    }

    /// The curve's point at a length along the chords, with jets there or beside.
    fn point(&self, at: f64) -> (TraceNode, Jets) {
        let k = self.at.partition_point(|&end| end <= at).clamp(1, self.nodes.len() - 1);
        let [from, to] = [&self.nodes[k - 1], &self.nodes[k]];
        let f = (at - self.at[k - 1]) / (self.at[k] - self.at[k - 1]);
        if self.mode == Mode::Transversal
            && let Some(found) = self.point_in_one_step([from, to], f)
        {
            return found;
        }
        let node = settled(self.engine, &between(self.tracer, self.mode, from, to, f));
        (node, self.jets(node.at))
    }

    fn point_in_one_step(&self, [from, to]: [&TraceNode; 2], f: f64) -> Option<(TraceNode, Jets)> {
        let inside = |x: &PointPair| x.to_array().iter().all(|v| (0.0..=1.0).contains(v));
        let start = hermite(from, to, f);
        if !inside(&start) {
            return None;
        }
        let jets = self.jets(start);
        let [a, b] = jets.1.map(|j| Jet1 { p: j.p, u: j.u, v: j.v });
        let point = along(from, to, f);
        let plane = Condition::Plane { point, direction: (to.p - from.p).normalize_or_zero() };
        let step = newton_step(&a, &b, start, plane)?;
        let x = start.to_array();
        let at = PointPair::from_array(std::array::from_fn(|k| x[k] + step[k]));
        let [da, db] = [DVec2::new(step[0], step[1]), DVec2::new(step[2], step[3])];
        let p = 0.5 * (a.p + a.u * da.x + a.v * da.y + b.p + b.u * db.x + b.v * db.y);
        let off = 0.5 * self.bounds[0].second(da, da).max(self.bounds[1].second(db, db));
        let near = p.distance(point) < 0.1 * from.p.distance(to.p);
        (inside(&at) && off <= EXACT && near).then_some((TraceNode { at, p, off, ..*from }, jets))
    }
}

/// A corrected point between two traced ones; the interpolated one where correction fails (near a junction).
fn between(tracer: &Tracer<'_>, mode: Mode, from: &TraceNode, to: &TraceNode, f: f64) -> TraceNode {
    let at = hermite(from, to, f);
    let pair = [from.pa, from.pb];
    let chord = (to.p - from.p).normalize_or_zero();
    let (a, b) = (&tracer.sides[0].pieces[pair[0]], &tracer.sides[1].pieces[pair[1]]);
    let length = from.p.distance(to.p);
    let p = along(from, to, f);
    let condition = Condition::Plane { point: p, direction: chord };
    let found = tracer.locate(mode, pair, at, condition, chord);
    let inside = |x: &PointPair| x.to_array().iter().all(|v| (-1e-6..=1.0 + 1e-6).contains(v));
    found.filter(|n| n.p.distance(p) < 0.1 * length && inside(&n.at)).unwrap_or_else(|| {
        let (on_a, on_b) = (a.point(at.uv), b.point(at.st));
        let p = 0.5 * (on_a + on_b);
        let rates = std::array::from_fn(|k| from.rates[k] * (1.0 - f) + to.rates[k] * f);
        TraceNode { at, p, tangent: chord, rates, off: 0.5 * on_a.distance(on_b), ..*from }
    })
}
