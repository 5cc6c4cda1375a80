//! Where a followed curve leaves its pair of pieces, and where it goes on.
//!
//! A step may end beyond a border, or reach over it and come back between its ends: the interpolant tells. The curve is then
//! corrected onto the border and goes on in the piece beyond, of the same surface or of a neighbour; into a pole it is led.
//! It fails (`None`) where a border is met at too shallow an angle to be found; the tracer comes closer then.

use super::contact::SLACK;
use super::correct::{Condition, PointPair};
use super::node::{TraceNode, hermite};
use super::piece::Patch;
use super::side::{Place, closest_from};
use super::trace::{Mode, Tracer};

/// A curve that changes a parameter less than this while another one changes by 1 runs along its border.
pub(super) const SHALLOW: f64 = 1e-5;

/// From within this distance of a pole, in the unit frame, a curve that runs into it is led there.
const NEAR_POLE: f64 = 1e-6;

impl Tracer<'_> {
    /// Which parameter stands on its border and is about to leave.
    pub(super) fn leaves(&self, node: &TraceNode) -> Option<usize> {
        let x = node.at.to_array();
        let reach = self.reach(node);
        (0..4).find(|&k| {
            let outward = if x[k] >= 1.0 - 1e-12 {
                node.rates[k]
            } else if x[k] <= 1e-12 {
                -node.rates[k]
            } else {
                return false;
            };
            outward * reach > SHALLOW
        })
    }

    /// The pole (a border of a piece that is one point) into which the curve runs, where no step can be corrected.
    pub(super) fn pole(&self, from: &TraceNode) -> Option<TraceNode> {
        let own = [(from.pa, from.at.uv), (from.pb, from.at.st)];
        (0..2).find_map(|side| {
            let (piece, uv) = own[side];
            let (other, guess) = own[1 - side];
            let borders = self.sides[side].borders_of(piece).iter();
            let mut poles = borders.filter(|e| e.is_pole(self.options.joining));
            poles.find_map(|edge| {
                let tip = edge.bounds.center();
                let way = tip - from.p;
                if way.length() > NEAR_POLE || way.dot(from.tangent) < 0.5 * way.length() - 1e-9 {
                    return None;
                }
                let (there, distance) = closest_from(&self.sides[1 - side].pieces[other], tip, guess);
                if distance > self.options.joining {
                    return None;
                }
                let mut here = uv;
                here[edge.fixed] = edge.value;
                let (uv, st) = if side == 0 { (here, there) } else { (there, here) };
                let at = PointPair { uv, st };
                let beside = self.sides[1 - side].pieces[other].point(there);
                let p = 0.5 * (tip + beside);
                let (x, y) = (from.at.to_array(), at.to_array());
                let length = p.distance(from.p).max(1e-300);
                let rates = std::array::from_fn(|k| (y[k] - x[k]) / length);
                let off = 0.5 * tip.distance(beside) + edge.bounds.diagonal();
                Some(TraceNode { at, p, rates, off, ..*from })
            })
        })
    }

    /// The points of a step as far as it stays in the pair of pieces, the last on the border where it leaves it, and then
    /// a point of it beyond. `None` where it ends beyond a border that it cannot be seen to meet.
    pub(super) fn inside(&self, mode: Mode, step: [&TraceNode; 3]) -> Option<(Vec<TraceNode>, Option<TraceNode>)> {
        let [from, middle, to] = step;
        self.halves(mode, step).or_else(|| match self.exit(mode, from, to) {
            Ok(None) => Some((vec![*middle, *to], None)),
            Ok(Some(last)) => Some((vec![last], Some(*to))),
            Err(()) => None,
        })
    }

    /// The same, looking at both halves of the step.
    fn halves(&self, mode: Mode, step: [&TraceNode; 3]) -> Option<(Vec<TraceNode>, Option<TraceNode>)> {
        let mut ends = Vec::with_capacity(2);
        for pair in step.windows(2) {
            let (from, mut to, mut left) = (pair[0], *pair[1], None);
            // Before the border where it was seen to leave it may have left and come back.
            for _ in 0..4 {
                let Some(beyond) = self.outside(mode, from, &to) else { break };
                let ends_outside = beyond.at == to.at;
                match self.exit(mode, from, &beyond) {
                    Ok(Some(last)) => (to, left) = (last, Some(beyond)),
                    Err(()) if ends_outside => return None,
                    // It only grazes the border, and ends on this side.
                    Ok(None) | Err(()) => break,
                }
            }
            ends.push(to);
            if left.is_some() {
                return Some((ends, left));
            }
        }
        Some((ends, None))
    }

    /// A point of the arc between two points of a pair of pieces that lies outside of it: the second, or one where the
    /// interpolant turns back to the pair.
    fn outside(&self, mode: Mode, from: &TraceNode, to: &TraceNode) -> Option<TraceNode> {
        let out = |x: f64| !(-SLACK..=1.0 + SLACK).contains(&x);
        let (x, y) = (from.at.to_array(), to.at.to_array());
        if y.iter().any(|&v| out(v)) {
            return Some(*to);
        }
        let h = from.p.distance(to.p);
        (0..4).find_map(|k| {
            // The most that a cubic is off its chord.
            let bulge = 4.0 / 27.0 * h * (from.rates[k].abs() + to.rates[k].abs());
            let slope = (y[k] - x[k]).abs();
            if x[k].max(y[k]) + bulge + slope <= 1.0 && x[k].min(y[k]) - bulge - slope >= 0.0 {
                return None;
            }
            // Where the interpolant a f^3 + b f^2 + c f + x is level.
            let (c, d) = (h * from.rates[k], h * to.rates[k]);
            let (a, b) = (c + d - 2.0 * (y[k] - x[k]), 3.0 * (y[k] - x[k]) - 2.0 * c - d);
            let root = (b * b - 3.0 * a * c).sqrt();
            let q = -(b + b.signum() * root);
            [q / (3.0 * a), c / q].into_iter().filter(|f| (0.0..1.0).contains(f)).find_map(|f| {
                let at = hermite(from, to, f);
                if !out(at.to_array()[k]) {
                    return None;
                }
                let pair = [from.pa, from.pb];
                let pieces = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
                let point = 0.5 * (pieces.0.jet1(at.uv).p + pieces.1.jet1(at.st).p);
                let direction = (to.p - from.p).normalize_or_zero();
                let node = self.locate(mode, pair, at, Condition::Plane { point, direction }, direction)?;
                out(node.at.to_array()[k]).then_some(node)
            })
        })
    }

    /// Where the step leaves the pair of pieces, if it does. From a border inwards it may come back to that border.
    fn exit(&self, mode: Mode, from: &TraceNode, to: &TraceNode) -> Result<Option<TraceNode>, ()> {
        self.exit_by(mode, from, to, true).or_else(|()| self.exit_by(mode, from, to, false))
    }

    /// With `back`, not through the place on a border from which it heads inwards.
    fn exit_by(&self, mode: Mode, from: &TraceNode, to: &TraceNode, back: bool) -> Result<Option<TraceNode>, ()> {
        let (x0, x1) = (from.at.to_array(), to.at.to_array());
        let fraction = |k: usize, bound: f64| {
            let inwards = back && (x0[k] - bound).abs() <= SLACK && (bound - 0.5) * from.rates[k] < 0.0;
            match inwards {
                true => 1.0,
                false if x1[k] == x0[k] => 0.0,
                false => ((bound - x0[k]) / (x1[k] - x0[k])).clamp(0.0, 1.0),
            }
        };
        let mut first: Option<(f64, usize, f64)> = None;
        for k in 0..4 {
            let bound = if x1[k] > 1.0 + SLACK {
                1.0
            } else if x1[k] < -SLACK {
                0.0
            } else {
                continue;
            };
            let f = fraction(k, bound);
            if first.is_none_or(|(g, ..)| f < g) {
                first = Some((f, k, bound));
            }
        }
        let Some(mut candidate) = first else { return Ok(None) };
        for _ in 0..4 {
            let (f, k, bound) = candidate;
            let node = self.on_border(mode, from, to, f, k, bound).ok_or(())?;
            let x = node.at.to_array();
            let worst = (0..4)
                .filter(|&j| j != k)
                .map(|j| (j, (x[j] - 1.0).max(-x[j])))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .ok_or(())?;
            if worst.1 <= SLACK {
                let ahead = (node.p - from.p).dot(from.tangent);
                let length = node.p.distance(from.p);
                if ahead < -1e-12 || length > 1.2 * to.p.distance(from.p) + 1e-12 {
                    return Err(());
                }
                return Ok(Some(node));
            }
            let j = worst.0;
            let bound = if x[j] > 1.0 { 1.0 } else { 0.0 };
            candidate = (fraction(j, bound), j, bound);
        }
        Err(())
    }

    /// Which parameter leaves by drifting slowly along its border.
    pub(super) fn drifts(&self, from: &TraceNode, to: &TraceNode) -> Option<usize> {
        let (x, y) = (from.at.to_array(), to.at.to_array());
        let reach = self.reach(from);
        (0..4).find(|&k| {
            let out = y[k] > 1.0 + SLACK || y[k] < -SLACK;
            let near = x[k] < 10.0 * SLACK || x[k] > 1.0 - 10.0 * SLACK;
            out && near && from.rates[k].abs() * reach < 10.0 * SHALLOW
        })
    }

    fn on_border(
        &self,
        mode: Mode,
        from: &TraceNode,
        to: &TraceNode,
        f: f64,
        k: usize,
        bound: f64,
    ) -> Option<TraceNode> {
        let pair = [from.pa, from.pb];
        if mode == Mode::Transversal {
            // The fraction at which the Hermite interpolant meets the border.
            let mut f = f;
            for _ in 0..4 {
                let e = 1e-4;
                let value = hermite(from, to, f).to_array()[k];
                let slope = (hermite(from, to, f + e).to_array()[k] - value) / e;
                if slope.abs() < 1e-9 {
                    break;
                }
                f = (f + (bound - value) / slope).clamp(0.0, 1.0);
            }
            return self.locate(mode, pair, hermite(from, to, f), Condition::Fixed(k, bound), from.tangent);
        }
        let (mut low, mut high) = (0.0, 1.0);
        let rising = to.at.to_array()[k] > from.at.to_array()[k];
        let mut best = None;
        for _ in 0..40 {
            let f = 0.5 * (low + high);
            let node = self.locate(mode, pair, hermite(from, to, f), Condition::Fixed(k, bound), from.tangent)?;
            if (node.at.to_array()[k] < bound) == rising {
                low = f
            } else {
                high = f
            }
            best = Some(node);
            if (node.at.to_array()[k] - bound).abs() < 1e-13 {
                break;
            }
        }
        best
    }

    /// The same point on the piece beyond the border of parameter `k`.
    pub(super) fn cross(&self, mode: Mode, node: &TraceNode, k: usize) -> Option<TraceNode> {
        let side = k / 2;
        let (piece, uv) = if side == 0 { (node.pa, node.at.uv) } else { (node.pb, node.at.st) };
        let places = self.sides[side].across(Place { piece, uv }, k % 2, node.p, self.options.joining);
        let mut best: Option<(f64, TraceNode)> = None;
        for (place, border) in places {
            let (pair, start) = if side == 0 {
                ([place.piece, node.pb], PointPair { uv: place.uv, st: node.at.st })
            } else {
                ([node.pa, place.piece], PointPair { uv: node.at.uv, st: place.uv })
            };
            let free = if side == 0 { [0, 1] } else { [2, 3] };
            let x = start.to_array();
            let fixed = free[border];
            let plane = Condition::Plane { point: node.p, direction: node.tangent };
            // On the new border exactly where that is well conditioned, else across the curve.
            let on_border = self.locate(mode, pair, start, Condition::Fixed(fixed, x[fixed]), node.tangent);
            let close = |n: &TraceNode| n.p.distance(node.p) < 4.0 * self.options.joining + 1e-9;
            let found = on_border
                .filter(|n| mode == Mode::Transversal && close(n))
                .or_else(|| self.locate(mode, pair, start, plane, node.tangent).filter(close));
            let Some(mut next) = found else { continue };
            if next.at.to_array().iter().any(|&v| !(-1e-5..=1.0 + 1e-5).contains(&v)) {
                continue;
            }
            // It must go inwards; beyond a sharp edge that tells its sense better than the old tangent does.
            let x = next.at.to_array();
            let sign = if x[fixed] > 0.5 { -1.0 } else { 1.0 };
            let inward = |n: &TraceNode| sign * n.rates[fixed] * self.reach(n);
            if inward(&next) < -1e-3 {
                next = next.reversed();
            }
            // A curve that would run straight back has met the end of the next piece, not its beginning.
            if next.tangent.dot(node.tangent) < -0.95 {
                continue;
            }
            let out = free
                .into_iter()
                .map(|j| {
                    if x[j] < 1e-6 {
                        -next.rates[j]
                    } else if x[j] > 1.0 - 1e-6 {
                        next.rates[j]
                    } else {
                        0.0
                    }
                })
                .fold(0.0, f64::max)
                * self.reach(&next);
            if best.as_ref().is_none_or(|(o, _)| out < *o) {
                best = Some((out, next));
            }
        }
        best.map(|(_, node)| node)
    }
}
