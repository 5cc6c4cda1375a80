//! Following a curve from piece to piece.
//!
//! A step is predicted along the tangent, corrected on the exact surfaces, and accepted when the cubic Hermite
//! interpolant between its ends, compared with a corrected point in the middle, is within the wanted error. That
//! measures what matters: turning angles alone lose branches that run close together. The sense of the curve is the
//! sense of N_A x N_B, which cannot flip on a transversal curve, so that jumping onto a neighbouring branch of
//! opposite sense is impossible and onto others is caught by the error. What happens at the border of a piece:
//! [`super::leave`].
//!
//! Cost: about three corrections a step, two kept as points. It fails honestly: [`End::Unresolved`] names the place.

use glam::DVec3;

use super::binormal;
use super::correct::{Condition, PointPair, correct};
use super::leave::SHALLOW;
use super::node::{LEAST_SINE, TraceNode, hermite, on_border, rates};
use super::piece::Patch;
use super::side::Side;

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

/// What is beyond a border by no more than this is on it, but for rounding.
const ROUNDED: f64 = 1e-12;

/// Points on borders this near to each other are one, and a curve that was never farther from its start has not come back,
/// in the unit frame.
const SAME_PLACE: f64 = 1e-8;

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
                    .any(|e| beyond(e.value, uv[e.fixed]) && e.is_pole(self.options.joining))
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
            if travelled > 20.0 * SAME_PLACE && farthest <= SAME_PLACE {
                return (out, End::Unresolved("a loop is too small to be followed"));
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
    pub(super) fn reach(&self, node: &TraceNode) -> f64 {
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
