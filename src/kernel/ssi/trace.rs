//! Following a curve from piece to piece.
//!
//! A step is predicted along the tangent, corrected on the exact surfaces, and accepted when the cubic Hermite
//! interpolant between its ends, compared with a corrected point in the middle, is within the wanted error. That
//! measures what matters: turning angles alone lose branches that run close together. The sense of the curve is the
//! sense of N_A x N_B, which cannot flip on a transversal curve, so that jumping onto a neighbouring branch of
//! opposite sense is impossible and onto others is caught by the error. At the border of a piece the curve is
//! corrected onto the border and goes on in the piece beyond, of the same surface or of a neighbour; the interpolant tells
//! where it reaches over a border between two points.
//!
//! Cost: about three corrections a step, two kept as points. It fails honestly: [`End::Unresolved`] names the place.

use glam::{DVec2, DVec3};

use super::binormal;
use super::contact::SLACK;
use super::correct::{Condition, PointPair, correct};
use super::piece::{Jet1, Patch};
use super::side::{Place, Side, closest_from};

/// A traced point.
#[derive(Clone, Copy, Debug)]
pub struct TraceNode {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// The parameters.
    pub at: PointPair,
    /// The point midway between the surfaces.
    pub p: DVec3,
    /// The unit tangent in the sense of the travel.
    pub tangent: DVec3,
    /// How fast the four parameters change with arc length.
    pub rates: [f64; 4],
    /// The sine of the angle between the surfaces, at least [`LEAST_SINE`].
    pub sine: f64,
    /// The sign of the tangent against N_A x N_B; 0 on tangential curves.
    pub sense: f64,
    /// How far `p` is from the points of both surfaces at the parameters.
    pub off: f64,
}

/// The smallest sine of an angle that is told from 0.
pub const LEAST_SINE: f64 = 1e-11;

/// Why a trace ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// At the border of a side.
    Boundary,
    /// At its own start.
    Loop,
    /// In the disc of a junction.
    Junction(usize),
    /// For the named reason.
    Unresolved(&'static str),
}

/// What kind of curve is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The surfaces cross.
    Transversal,
    /// The surfaces touch along the curve.
    Tangential,
}

/// A curve that changes a parameter less than this while another one changes by 1 runs along its border.
const SHALLOW: f64 = 1e-5;

/// From within this distance of a pole, in the unit frame, a curve that runs into it is led there.
const NEAR_POLE: f64 = 1e-6;

/// What is beyond a border by no more than this is on it, but for rounding.
const ROUNDED: f64 = 1e-12;

/// Points on borders this near to each other are one, and a curve that was never farther from its start has not come back,
/// in the unit frame.
const SAME_PLACE: f64 = 1e-8;

/// Whether a point lies on the border of its piece on either side.
pub fn on_border(node: &TraceNode) -> bool {
    node.at.to_array().iter().any(|x| !(2.0 * SLACK..=1.0 - 2.0 * SLACK).contains(x))
}

/// A disc around a junction in which its own arms take over.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// The middle.
    pub center: DVec3,
    /// The radius.
    pub radius: f64,
}

/// The settings of a trace, in the unit frame.
#[derive(Clone, Copy, Debug)]
pub struct TraceOptions {
    /// The largest error of the Hermite interpolant between points.
    pub tol: f64,
    /// The distance of surface points below which rounding reigns.
    pub floor: f64,
    /// How far apart the borders of neighbouring pieces may be.
    pub joining: f64,
    /// The distance that counts as contact.
    pub contact: f64,
    /// The largest number of points of one curve.
    pub most_points: usize,
}

/// What a tracer needs.
pub struct Tracer<'a> {
    /// Both sides.
    pub sides: [&'a Side; 2],
    /// The settings.
    pub options: TraceOptions,
    /// The discs at which it stops.
    pub discs: &'a [Disc],
}

impl TraceNode {
    /// The same point travelled the other way.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self { tangent: -self.tangent, rates: self.rates.map(|r| -r), sense: -self.sense, ..self }
    }

    /// The same curve point seen with the sides exchanged.
    pub fn same_pair(&self, other: &Self) -> bool {
        self.pa == other.pa && self.pb == other.pb
    }
}

/// The weights of both points, and of their derivatives by arc length.
fn hermite_weights(a: &TraceNode, b: &TraceNode, f: f64) -> [f64; 4] {
    let (h, g) = (a.p.distance(b.p), 1.0 - f);
    [g * g * (1.0 + 2.0 * f), f * f * (3.0 - 2.0 * f), g * g * f * h, -f * f * g * h]
}

/// The point at a fraction between two points of the same pair of pieces.
pub fn along(a: &TraceNode, b: &TraceNode, f: f64) -> DVec3 {
    let [wa, wb, ta, tb] = hermite_weights(a, b, f);
    a.p * wa + b.p * wb + a.tangent * ta + b.tangent * tb
}

/// The parameters at a fraction between two points of the same pair of pieces.
pub fn hermite(a: &TraceNode, b: &TraceNode, f: f64) -> PointPair {
    let (x, y) = (a.at.to_array(), b.at.to_array());
    let weights = hermite_weights(a, b, f);
    let mut out = [0.0; 4];
    for (k, out) in out.iter_mut().enumerate() {
        *out = weights[0] * x[k] + weights[1] * y[k] + weights[2] * a.rates[k] + weights[3] * b.rates[k];
    }
    PointPair::from_array(out)
}

fn rates_of(u: DVec3, v: DVec3, t: DVec3) -> Option<DVec2> {
    let (e, f, g) = (u.length_squared(), u.dot(v), v.length_squared());
    let det = e * g - f * f;
    if !(det > 1e-20 * e * g) {
        return None;
    }
    let (a, b) = (u.dot(t), v.dot(t));
    Some(DVec2::new((g * a - f * b) / det, (e * b - f * a) / det))
}

/// How fast the four parameters change along a unit tangent.
pub fn rates(a: &Jet1, b: &Jet1, tangent: DVec3) -> Option<[f64; 4]> {
    let (ra, rb) = (rates_of(a.u, a.v, tangent)?, rates_of(b.u, b.v, tangent)?);
    Some([ra.x, ra.y, rb.x, rb.y])
}

impl Tracer<'_> {
    /// The curve point near `start` under a condition, with the tangent on the side of `along`.
    pub fn locate(
        &self,
        mode: Mode,
        pair: [usize; 2],
        start: PointPair,
        condition: Condition,
        along: DVec3,
    ) -> Option<TraceNode> {
        let (a, b) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let (at, p, tangent, ja, jb, sine) = match mode {
            Mode::Transversal => {
                let hit = correct(a, b, start, condition, self.options.floor)?;
                if hit.residual > 1e-9 || self.beyond_a_pole(pair, hit.at) {
                    return None;
                }
                let [na, nb] = hit.normals();
                let t = na.cross(nb);
                let sine = t.length();
                if sine < LEAST_SINE {
                    return None;
                }
                let t = t / sine;
                // Rounding of the normals tilts the cross product out of the surfaces.
                let t = (t - na * t.dot(na)).normalize();
                (hit.at, hit.point(), t, hit.a, hit.b, sine)
            }
            Mode::Tangential => {
                let found = binormal::polish(a, b, start, 0.05, true)?;
                if found.gap.abs() > 4.0 * self.options.contact {
                    return None;
                }
                let (_, e, _) = found.principal();
                let t = found.in_space(e.perp());
                (found.at, found.p, t, a.jet1(found.at.uv), b.jet1(found.at.st), 1.0)
            }
        };
        let against = tangent.dot(along) < 0.0;
        let sense = if mode == Mode::Tangential {
            0.0
        } else if against {
            -1.0
        } else {
            1.0
        };
        let tangent = if against { -tangent } else { tangent };
        let rates = rates(&ja, &jb, tangent)?;
        let off = ja.p.distance(p).max(jb.p.distance(p));
        let node = TraceNode { pa: pair[0], pb: pair[1], at, p, tangent, rates, sine, sense, off };
        // A border along the curve does not fix a point of it.
        if let Condition::Fixed(k, _) = condition
            && mode == Mode::Transversal
            && rates[k].abs() * self.reach(&node) < SHALLOW
        {
            return None;
        }
        Some(node)
    }

    /// Whether parameters lie beyond a pole (a border of a piece that is one point). A piece that is continued there turns
    /// back over itself: every curve that passes a pole has an image there, as near as it passes.
    fn beyond_a_pole(&self, pair: [usize; 2], at: PointPair) -> bool {
        let uvs = [at.uv, at.st];
        (0..2).any(|side| {
            let uv = uvs[side];
            let beyond = |value: f64, x: f64| if value > 0.5 { x > 1.0 + ROUNDED } else { x < -ROUNDED };
            (beyond(1.0, uv.max_element()) || beyond(0.0, uv.min_element()))
                && self.sides[side]
                    .borders_of(pair[side])
                    .iter()
                    .any(|e| beyond(e.value, uv[e.fixed]) && e.bounds.diagonal() <= self.options.joining)
        })
    }

    /// Follows the curve from `start` in the sense of its tangent. The points include `start`; a closed curve ends
    /// with a copy of it.
    pub fn trace(&self, mode: Mode, start: TraceNode) -> (Vec<TraceNode>, End) {
        let mut out = vec![start];
        let mut start = start;
        let mut current = start;
        let mut h = 0.05 * self.reach(&current);
        let mut bend = [0.0; 4];
        let mut hops = 0;
        let (mut travelled, mut farthest) = (0.0, 0.0);
        loop {
            if out.len() > self.options.most_points {
                return (out, End::Unresolved("the curve has more points than allowed"));
            }
            if let Some(k) = self.leaves(&current) {
                hops += 1;
                if hops > 12 {
                    return (out, End::Unresolved("the curve runs to and fro across a border"));
                }
                bend = [0.0; 4];
                match self.cross(mode, &current, k) {
                    Some(next) => {
                        if travelled > 1e-7 && self.meets(&next, &start) {
                            out.push(next);
                            out.push(start);
                            return (out, End::Loop);
                        }
                        if travelled == 0.0 {
                            // Nothing was travelled in the first pair.
                            out.clear();
                            start = next;
                        }
                        current = next;
                        out.push(next);
                        continue;
                    }
                    None => return (out, End::Boundary),
                }
            }
            // A step, shortened until it is good.
            h = h.min(0.3 * self.reach(&current));
            let (middle, next) = loop {
                if h < 1e-12 {
                    return match self.pole(&current) {
                        Some(last) => {
                            out.push(last);
                            (out, End::Boundary)
                        }
                        None => (out, End::Unresolved("the curve cannot be followed")),
                    };
                }
                match self.step(mode, &current, h, &bend) {
                    Ok((middle, next, error)) => {
                        let factor = (0.5 * self.options.tol / error.max(1e-30)).powf(0.25) * 0.9;
                        let used = h;
                        h *= factor.clamp(0.3, 2.0);
                        if error <= self.options.tol {
                            break (middle, next);
                        }
                        h = h.min(0.7 * used);
                    }
                    Err(()) => h *= 0.4,
                }
            };
            let length = current.p.distance(next.p);
            bend = std::array::from_fn(|k| (next.rates[k] - current.rates[k]) / length);
            let (ends, beyond) = match self.inside(mode, [&current, &middle, &next]) {
                Some(ends) => ends,
                None => {
                    // Along a border: change over to the piece beyond where it is.
                    if let Some(k) = self.drifts(&current, &next)
                        && let Some(beyond) = self.cross(mode, &current, k)
                        && hops < 12
                    {
                        hops += 1;
                        bend = [0.0; 4];
                        current = beyond;
                        out.push(beyond);
                        continue;
                    }
                    // The border is met at a shallow angle: come closer first.
                    h = 0.3 * current.p.distance(next.p);
                    if h < 1e-9 {
                        return (out, End::Unresolved("the border of a patch is met at too shallow an angle"));
                    }
                    continue;
                }
            };
            // A curve that bends outwards on the border itself makes no way: it leaves here.
            if let Some(beyond) = beyond
                && ends[0].p.distance(current.p) < 1e-10
            {
                let x = beyond.at.to_array();
                let off = |k: &usize| (x[*k] - 1.0).max(-x[*k]);
                let k = (0..4).max_by(|i, j| off(i).total_cmp(&off(j))).unwrap_or(0);
                hops += 1;
                if hops > 12 {
                    return (out, End::Unresolved("the curve runs to and fro across a border"));
                }
                match self.cross(mode, &current, k) {
                    Some(beyond) => {
                        bend = [0.0; 4];
                        current = beyond;
                        out.push(beyond);
                        continue;
                    }
                    None => return (out, End::Boundary),
                }
            }
            for node in ends {
                if let Some(disc) = self.enters(&current, &node, travelled) {
                    return (out, End::Junction(disc));
                }
                if farthest > SAME_PLACE
                    && let Some(last) = self.returns(mode, &current, &node, &start)
                {
                    if !last.same_pair(&start) {
                        out.push(last);
                    }
                    out.push(start);
                    return (out, End::Loop);
                }
                travelled += current.p.distance(node.p);
                farthest = f64::max(farthest, node.p.distance(start.p));
                current = node;
                out.push(node);
            }
            if beyond.is_none() {
                hops = 0;
            } else if travelled > 1e-7 && self.meets(&current, &start) {
                out.push(start);
                return (out, End::Loop);
            }
        }
    }

    /// Where a step passes the start in its sense, on its own pair of pieces. A start on a border may be passed in the piece
    /// beyond: a curve that runs along the border changes over somewhere else.
    fn returns(&self, mode: Mode, from: &TraceNode, to: &TraceNode, start: &TraceNode) -> Option<TraceNode> {
        let chord = to.p - from.p;
        // What lies behind was passed by the step before, or is where it all began, a short step ago.
        if !(start.tangent.dot(chord) > 0.0 && (start.p - from.p).dot(chord) > 0.0) {
            return None;
        }
        if from.same_pair(start) {
            return self.passes(from, to, start, 0.0).then_some(*start);
        }
        if !on_border(start) || from.tangent.dot(start.tangent) < 0.99 || !self.passes(from, to, start, SAME_PLACE) {
            return None;
        }
        let f = from.p.distance(start.p) / from.p.distance(to.p);
        let plane = Condition::Plane { point: start.p, direction: start.tangent };
        let there = self.locate(mode, [from.pa, from.pb], hermite(from, to, f.min(1.0)), plane, start.tangent)?;
        (there.p.distance(start.p) < SAME_PLACE).then_some(there)
    }

    /// Whether two points on borders are one. Where borders of both sides meet, a curve may come back through other
    /// pieces than those in which it started; then it must have the same direction too.
    fn meets(&self, a: &TraceNode, b: &TraceNode) -> bool {
        let least = if a.same_pair(b) { 0.7 } else { 0.999 };
        a.p.distance(b.p) < SAME_PLACE && a.tangent.dot(b.tangent) > least
    }

    /// The arc length after which a parameter has changed by about 1.
    fn reach(&self, node: &TraceNode) -> f64 {
        1.0 / node.rates.iter().fold(1e-3, |m: f64, r| m.max(r.abs()))
    }

    /// A step of about length `h`, predicted from the rates and how they changed last.
    fn step(&self, mode: Mode, from: &TraceNode, h: f64, bend: &[f64; 4]) -> Result<(TraceNode, TraceNode, f64), ()> {
        let pair = [from.pa, from.pb];
        let x = from.at.to_array();
        let guess = PointPair::from_array(std::array::from_fn(|k| x[k] + h * (from.rates[k] + 0.5 * h * bend[k])));
        let plane = Condition::Plane { point: from.p + from.tangent * h, direction: from.tangent };
        let next = self.locate(mode, pair, guess, plane, from.tangent).ok_or(())?;
        let chord = next.p - from.p;
        let length = chord.length();
        if next.tangent.dot(from.tangent) < 0.6
            || chord.dot(from.tangent) < 0.8 * length
            || length > 2.0 * h
            || length < 0.3 * h
        {
            return Err(());
        }
        if from.sense != 0.0 && next.sense != from.sense {
            return Err(());
        }
        let guess = hermite(from, &next, 0.5);
        let plane = Condition::Plane { point: 0.5 * (from.p + next.p), direction: chord / length };
        let middle = self.locate(mode, pair, guess, plane, from.tangent).ok_or(())?;
        if from.sense != 0.0 && middle.sense != from.sense {
            return Err(());
        }
        let (a, b) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let off = |p: DVec3| {
            let d = p - middle.p;
            (d - middle.tangent * d.dot(middle.tangent)).length()
        };
        let error = off(a.point(guess.uv)).max(off(b.point(guess.st)));
        Ok((middle, next, error))
    }

    /// Which parameter stands on its border and is about to leave.
    fn leaves(&self, node: &TraceNode) -> Option<usize> {
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
    fn pole(&self, from: &TraceNode) -> Option<TraceNode> {
        let own = [(from.pa, from.at.uv), (from.pb, from.at.st)];
        (0..2).find_map(|side| {
            let (piece, uv) = own[side];
            let (other, guess) = own[1 - side];
            let borders = self.sides[side].borders_of(piece).iter();
            let mut poles = borders.filter(|e| e.bounds.diagonal() <= self.options.joining);
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
    fn inside(&self, mode: Mode, step: [&TraceNode; 3]) -> Option<(Vec<TraceNode>, Option<TraceNode>)> {
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
    fn drifts(&self, from: &TraceNode, to: &TraceNode) -> Option<usize> {
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
    fn cross(&self, mode: Mode, node: &TraceNode, k: usize) -> Option<TraceNode> {
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

    fn enters(&self, from: &TraceNode, to: &TraceNode, travelled: f64) -> Option<usize> {
        let chord = to.p - from.p;
        let length = chord.length_squared();
        self.discs.iter().position(|disc| {
            let f = if length > 0.0 { ((disc.center - from.p).dot(chord) / length).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (from.p + chord * f).distance(disc.center);
            let outward = travelled == 0.0 && f == 0.0;
            distance < 0.98 * disc.radius && !outward
        })
    }

    /// Whether the arc between two points passes `target`, in either sense. With a positive `least` only the points
    /// in space are compared, within that distance, else those on both surfaces too.
    pub fn passes(&self, from: &TraceNode, to: &TraceNode, target: &TraceNode, least: f64) -> bool {
        let chord = to.p - from.p;
        let length = chord.length();
        if from.p.distance(target.p) > 1.5 * length + 1e-8 {
            return false;
        }
        if from.p.distance(target.p) < 1e-9 || to.p.distance(target.p) < 1e-9 {
            return true;
        }
        let a = &self.sides[0].pieces[from.pa];
        let b = &self.sides[1].pieces[from.pb];
        let mut f = (target.p - from.p).dot(chord) / (length * length);
        for _ in 0..4 {
            let p = a.point(hermite(from, to, f.clamp(-0.1, 1.1)).uv);
            f += (target.p - p).dot(chord) / (length * length);
        }
        if !(-0.01..=1.01).contains(&f) || target.tangent.dot(chord).abs() < 0.3 * length {
            return false;
        }
        let at = hermite(from, to, f);
        // Near tangency a corrected point is only good to rounding over the sine of the angle.
        let noise = 2.0 * self.options.floor / target.sine;
        let within = |d: f64| a.point(at.uv).distance(target.p) < d && b.point(at.st).distance(target.p) < d;
        if least > 0.0 {
            return within(least + noise);
        }
        if target.sense == 0.0 || within(1e-9 + noise) {
            return within(1e-3 * length + 1e-9 + noise);
        }
        // The interpolant is only as good as the tolerance: what it leads to decides.
        let plane = Condition::Plane { point: target.p, direction: target.tangent };
        within(0.1 * length + 1e-9 + noise)
            && self
                .locate(Mode::Transversal, [from.pa, from.pb], at, plane, target.tangent)
                .is_some_and(|node| node.p.distance(target.p) < 1e-8 + 1e-5 * length + noise)
    }
}
