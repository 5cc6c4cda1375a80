//! The search for points of three bodies on the curves of a result.
//!
//! Chords of curves that have exactly one body in common and come near are candidates. A box around a chord holds the
//! curve beside it: how far it is off follows from how it turns at both ends. Where the chords meet at an angle the point
//! is refined on the three bodies ([`super::three`]); where they run alongside each other, the height of one curve over the
//! third body is looked at in [`SAMPLES`] places, its roots and its least value are found, and refined likewise. A curve
//! whose height is zero all along lies on the third body: three sheets through one curve have no isolated point. In the end
//! the curves' own points have to agree with the refined one.
//!
//! Cost: the tree's pairs of chords, and some evaluations for each that comes near; close to linear in the number of points
//! unless many curves run along one another. The result does not depend on the number of threads. How it fails: two
//! crossings of two curves within the 1/8 of one chord in which the height has no sign change and no least value among the
//! samples are missed.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::result::{CurveKind, CurvePoint, IntersectionCurve};
use super::three::{Bodies, Met, Near, On, height, meet};
use super::triple::{Size, stretch_end};
use crate::kernel::job::Job;
use crate::kernel::mesh::tri_tree::TriTree;

/// Parts into which a chord is cut to look at heights.
const SAMPLES: i32 = 8;

/// Chords that meet at less than this (sine), or at less than their curves turn, may do so more than once.
const ALONGSIDE: f64 = 0.1;

/// A curve of a result between its changes of patches, seen from one of its chords.
#[derive(Clone, Copy)]
struct Chord<'a> {
    curve: &'a IntersectionCurve,
    number: usize,
    at: usize,
    /// How far the curve may be off the chord.
    off: f64,
    /// How much it turns at the ends of the chord (sine).
    turn: f64,
}

impl Chord<'_> {
    fn ends(&self) -> [&CurvePoint; 2] {
        [&self.curve.points[self.at], &self.curve.points[self.at + 1]]
    }

    fn along(&self) -> DVec3 {
        let [p, q] = self.ends();
        q.xyz - p.xyz
    }

    fn between(&self, s: f64) -> CurvePoint {
        let [p, q] = self.ends();
        CurvePoint { xyz: p.xyz.lerp(q.xyz, s), uv: p.uv.lerp(q.uv, s), st: p.st.lerp(q.st, s), ..*p }
    }

    /// The parameters on one of its two bodies.
    fn on(&self, body: usize, s: f64) -> DVec2 {
        let at = self.between(s);
        if at.a == body { at.uv } else { at.st }
    }

    /// The place on it that is nearest to a point, and how far that is.
    fn nearest(&self, x: DVec3) -> (f64, f64) {
        let ([p, q], d) = (self.ends(), self.along());
        let s = ((x - p.xyz).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        let s = if s.is_finite() { s } else { 0.0 };
        (s, p.xyz.lerp(q.xyz, s).distance(x))
    }
}

/// A point of three with the two curves on which it was seen: their numbers and the places on them.
pub(super) struct Found {
    pub bodies: [usize; 3],
    pub met: Met,
    /// How far along the curves it may be elsewhere: where a curve touches a body, its height counts as none so far.
    pub blur: f64,
    pub passes: [(usize, f64); 2],
}

/// All chords of all curves that bound no region, each with how far its curve may be off.
fn chords<'a>(curves: &'a [IntersectionCurve], bodies: &impl Bodies, size: Size) -> Vec<Chord<'a>> {
    let mut out = Vec::new();
    for (number, curve) in curves.iter().enumerate() {
        if curve.kind == CurveKind::CoincidentBoundary {
            continue;
        }
        let points = &curve.points;
        let last = points.len().saturating_sub(1);
        let direction =
            |k: usize| points.get(k).zip(points.get(k + 1)).map(|(p, q)| (q.xyz - p.xyz).normalize_or_zero());
        let joins = |k: usize| points[k].a == points[k + 1].a && points[k].b == points[k + 1].b;
        // The tangent, where no second chord tells how the curve turns.
        let tangent = |p: &CurvePoint| {
            let normal = |n, uv| bodies.touch(n, uv, p.xyz).map(|t| t.normal);
            normal(p.a, p.uv).zip(normal(p.b, p.st)).map(|(n, m)| n.cross(m).normalize_or_zero())
        };
        for at in (0..last).filter(|&k| joins(k)) {
            let (p, q) = (&points[at], &points[at + 1]);
            let length = p.xyz.distance(q.xyz);
            if length == 0.0 {
                continue; // the seam of a closed surface
            }
            let own = direction(at).unwrap_or_default();
            let turns = |other: Option<DVec3>| other.map_or(0.0, |d| own.cross(d).length().min(1.0));
            let lone = (at == 0 || !joins(at - 1)) && (at + 1 == last || !joins(at + 1));
            let turn = if lone {
                turns(tangent(p)).max(turns(tangent(q)))
            } else {
                let before = if at > 0 { direction(at - 1) } else { None };
                turns(before).max(turns(direction(at + 1)))
            };
            // Between points this near the curve cannot be further off than they are apart.
            let off = (0.3 * length * turn + curve.error_bound).min(length) + size.same;
            out.push(Chord { curve, number, at, off, turn });
        }
    }
    out
}

/// The points of three bodies on the curves of a result, as often as they are met. `None` when cancelled.
pub(super) fn search(curves: &[IntersectionCurve], bodies: &impl Bodies, size: Size, job: &Job) -> Option<Vec<Found>> {
    let chords = chords(curves, bodies, size);
    // The tree holds the box of each chord as a triangle between two of its corners.
    let boxes = chords.iter().flat_map(|c| {
        let [p, q] = c.ends().map(|p| p.xyz);
        [p.min(q) - c.off, p.max(q) + c.off]
    });
    let corners: Vec<[u32; 3]> = (0..chords.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect();
    let tree = TriTree::new(boxes.collect(), &corners);
    let mut pairs = tree.overlapping_pairs(&tree, job);
    pairs.retain(|&[k, m]| {
        let (p, q) = (&chords[k as usize], &chords[m as usize]);
        k < m && third_body(p.ends()[0], q.ends()[0]).is_some()
    });
    // A chord with all those of its curves' neighbours that have the same third body.
    let mut meetings: Vec<(u32, usize, u32)> = Vec::new();
    for [k, m] in pairs {
        let third = third_body(chords[k as usize].ends()[0], chords[m as usize].ends()[0]);
        meetings.extend(third.map(|third| (k, third, m)));
    }
    meetings.sort_unstable();
    let seeker = Seeker { bodies, size };
    let found: Vec<Vec<Found>> = meetings
        .par_chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
        .map(|group| {
            if job.is_cancelled() {
                return Vec::new();
            }
            let others: Vec<Chord<'_>> = group.iter().map(|&(_, _, m)| chords[m as usize]).collect();
            seeker.points(chords[group[0].0 as usize], group[0].1, &others)
        })
        .collect();
    (!job.is_cancelled()).then(|| found.into_iter().flatten().collect())
}

/// Of two points on three bodies in all: the body of the second that is not of the first.
fn third_body(p: &CurvePoint, q: &CurvePoint) -> Option<usize> {
    match [q.a, q.b].map(|n| n != p.a && n != p.b) {
        [true, false] => Some(q.a),
        [false, true] => Some(q.b),
        _ => None,
    }
}

/// The nearest places of two segments, their distance, and the sine of their angle.
fn nearest(p: [DVec3; 2], q: [DVec3; 2]) -> (f64, f64, f64, f64) {
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, b, c, d, e) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let det = (a * c - b * b).max(0.0);
    let s = if det > 1e-12 * a * c { ((b * e - c * d) / det).clamp(0.0, 1.0) } else { 0.5 };
    let t = ((b * s + e) / c).clamp(0.0, 1.0);
    let s = ((b * t - d) / a).clamp(0.0, 1.0);
    let t = ((b * s + e) / c).clamp(0.0, 1.0);
    (s, t, (p[0] + u * s).distance(q[0] + v * t), (det / (a * c)).sqrt())
}

struct Seeker<'a, B> {
    bodies: &'a B,
    size: Size,
}

impl<B: Bodies> Seeker<'_, B> {
    /// The points on a chord's curve and a third body, on which the curves of the other chords lie.
    fn points(&self, p: Chord<'_>, third: usize, others: &[Chord<'_>]) -> Vec<Found> {
        let mut met: Vec<(Met, f64)> = Vec::new();
        let mut alongside: Vec<Chord<'_>> = Vec::new();
        for q in others {
            let (s, t, distance, sine) = nearest(p.ends().map(|p| p.xyz), q.ends().map(|p| p.xyz));
            if !(distance <= p.off + q.off) {
                continue;
            }
            if sine <= ALONGSIDE.max(p.turn + q.turn) {
                alongside.push(*q);
                continue;
            }
            let on_p = p.between(s);
            let on = [On::Body(on_p.a, on_p.uv), On::Body(on_p.b, on_p.st), On::Body(third, q.on(third, t))];
            let reach = p.along().length() + q.along().length() + p.off + q.off;
            met.extend(meet(self.bodies, on, on_p.xyz, self.near(reach)).map(|met| (met, 0.0)));
        }
        if !alongside.is_empty() {
            met.extend(self.alongside(p, third, &alongside));
        }
        let [on_p, _] = p.ends();
        // What lies beside other chords is found from those.
        met.retain(|(met, _)| p.nearest(met.xyz).1 <= 2.0 * p.off);
        let found = met.into_iter().filter_map(|(met, blur)| {
            let mut nearby: Vec<(f64, &Chord<'_>)> = others.iter().map(|q| (q.nearest(met.xyz).1, q)).collect();
            nearby.sort_by(|x, y| x.0.total_cmp(&y.0));
            let own = self.place(p, met.xyz)?;
            let other = nearby.iter().take(3).find_map(|(_, q)| self.place(**q, met.xyz))?;
            let bodies = [on_p.a, on_p.b, third];
            let mut order = [0, 1, 2];
            order.sort_by_key(|&k| bodies[k]);
            let uv = order.map(|k| self.bodies.place(bodies[k], met.uv[k], met.xyz));
            Some(Found { bodies: order.map(|k| bodies[k]), met: Met { uv, ..met }, blur, passes: [own, other] })
        });
        found.collect()
    }

    fn near(&self, reach: f64) -> Near {
        Near { rounding: self.size.rounding, reach }
    }

    /// The curve's own point in the plane across a chord through a point.
    fn on_curve(&self, chord: Chord<'_>, through: DVec3) -> Option<Met> {
        let along = chord.along();
        let [p, _] = chord.ends();
        let at = chord.between((through - p.xyz).dot(along) / along.length_squared());
        let plane = On::Plane(through, along.normalize_or_zero());
        let on = [On::Body(at.a, at.uv), On::Body(at.b, at.st), plane];
        meet(self.bodies, on, at.xyz, self.near(along.length() + 2.0 * chord.off))
    }

    /// Where a curve passes through a point near one of its chords.
    fn place(&self, chord: Chord<'_>, x: DVec3) -> Option<(usize, f64)> {
        let (curve, last) = (chord.curve, chord.curve.points.len() - 2);
        let distance = |at: usize| Chord { at, ..chord }.nearest(x);
        let joins = |k: usize| {
            let (p, q) = (&curve.points[k], &curve.points[k + 1]);
            p.a == q.a && p.b == q.b
        };
        // The nearest chord of the stretch from here.
        let (mut at, mut best) = (chord.at, distance(chord.at));
        loop {
            let before = if at > 0 { Some(at - 1) } else { curve.closed.then_some(last) };
            let after = if at < last { Some(at + 1) } else { curve.closed.then_some(0) };
            let sides = [before, after].into_iter().flatten().filter(|&k| joins(k)).map(|k| (k, distance(k)));
            let Some((next, nearer)) = sides.min_by(|x, y| x.1.1.total_cmp(&y.1.1)) else { break };
            if nearer.1 >= best.1 {
                break;
            }
            (at, best) = (next, nearer);
        }
        // A curve of contact has no point in the plane that could be refined.
        let own = Chord { at, ..chord };
        let crosses = curve.kind != CurveKind::Tangential;
        let off = match self.on_curve(own, x).filter(|_| crosses) {
            // Beyond its end the bodies may go on in another curve.
            _ if best.1 > 2.0 * chord.off => f64::INFINITY,
            Some(met) => met.xyz.distance(x),
            None => 0.0,
        };
        if off > self.size.same {
            return None;
        }
        let near = |k: usize| curve.points[k].xyz.distance(x) <= self.size.same;
        // Of several points that are one, the end of a stretch stands for all.
        let settled = |k: usize| {
            let (mut low, mut high) = (k, k);
            while low > 0 && joins(low - 1) && near(low - 1) {
                low -= 1;
            }
            while high <= last && joins(high) && near(high + 1) {
                high += 1;
            }
            let end = [high, low].into_iter().find(|&k| stretch_end(curve, k as f64).is_some());
            end.unwrap_or(k) as f64
        };
        let place = match () {
            () if near(at) => settled(at),
            () if near(at + 1) => settled(at + 1),
            () => at as f64 + best.0,
        };
        // The last point of a ring is its first.
        let ring = curve.closed && place as usize == last + 1 && joins(last);
        Some((chord.number, if ring { 0.0 } else { place }))
    }

    /// The points of a chord's curve on a body along which it runs, beside the curves of other chords, and how far along it
    /// each is unsure.
    fn alongside(&self, chord: Chord<'_>, third: usize, others: &[Chord<'_>]) -> Vec<(Met, f64)> {
        let at = |s: f64| -> Option<(f64, Met)> {
            let lerp = chord.between(s);
            let own = if chord.curve.kind == CurveKind::Tangential { None } else { self.on_curve(chord, lerp.xyz) };
            let met = own.unwrap_or(Met { xyz: lerp.xyz, uv: [lerp.uv, lerp.st, DVec2::ZERO], gap: 0.0 });
            let near = others.iter().map(|q| (q.nearest(met.xyz), q)).min_by(|x, y| x.0.1.total_cmp(&y.0.1));
            let start = near.map(|((t, _), q)| q.on(third, t))?;
            let (h, w) = height(self.bodies, third, start, met.xyz, self.size.rounding)?;
            Some((h, Met { uv: [met.uv[0], met.uv[1], w], ..met }))
        };
        let zero = |h: f64| h.abs() <= self.size.gap;
        let all = [0.0, 0.5, 1.0].map(&at);
        if all.iter().all(|h| h.as_ref().is_some_and(|(h, _)| zero(*h))) {
            return Vec::new(); // it lies on the body
        }
        let step = 1.0 / f64::from(SAMPLES);
        // One beyond each end: the least value may lie just there.
        let samples: Vec<Option<(f64, f64)>> =
            (-1..=SAMPLES + 1).map(|k| f64::from(k) * step).map(|s| at(s).map(|(h, _)| (s, h))).collect();
        let mut roots: Vec<(f64, f64)> = Vec::new();
        for pair in samples.windows(2) {
            if let [Some((s, h)), Some((t, i))] = pair[..]
                && !zero(h)
                && !zero(i)
                && (h < 0.0) != (i < 0.0)
            {
                roots.extend(crossing(&at, [s, t], h).map(|s| (s, 0.0)));
            }
        }
        for three in samples.windows(3) {
            let Some((s, h)) = three[1] else { continue };
            let beside = [three[0], three[2]].map(|o| o.map(|(_, h)| h));
            // Where the parabola through the three is no more than the gap away.
            let blur = || {
                let bend = beside.iter().flatten().fold(0.0, |m: f64, i| m.max((i - h).abs()));
                step * (self.size.gap / bend).sqrt().min(1.0)
            };
            if zero(h) {
                if beside.iter().flatten().all(|&i| !zero(i)) {
                    roots.push((s, blur()));
                }
                continue;
            }
            let [Some(before), Some(after)] = beside else { continue };
            if (before < 0.0) == (h < 0.0) && (after < 0.0) == (h < 0.0) && h.abs() <= before.abs().min(after.abs()) {
                let (low, least) = least(&at, [s - step, s + step], h.signum());
                if zero(least) {
                    roots.push((low, blur()));
                } else if (least < 0.0) != (h < 0.0) {
                    roots.extend(crossing(&at, [s - step, low], before).map(|s| (s, 0.0)));
                    roots.extend(crossing(&at, [low, s + step], least).map(|s| (s, 0.0)));
                }
            }
        }
        let length = chord.along().length();
        let refined = |(s, blur): (f64, f64)| {
            let (h, met) = at(s)?;
            let [p, _] = chord.ends();
            let on = [On::Body(p.a, met.uv[0]), On::Body(p.b, met.uv[1]), On::Body(third, met.uv[2])];
            let better = meet(self.bodies, on, met.xyz, self.near(1e-3 * length));
            Some((better.unwrap_or(Met { gap: h.abs().max(met.gap), ..met }), blur * length))
        };
        roots.into_iter().filter_map(refined).collect()
    }
}

/// The place between two at which a height changes its sign; `from`: the height at the first.
fn crossing<T>(at: &impl Fn(f64) -> Option<(f64, T)>, [mut low, mut high]: [f64; 2], from: f64) -> Option<f64> {
    for _ in 0..52 {
        let middle = 0.5 * (low + high);
        if (at(middle)?.0 < 0.0) == (from < 0.0) { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

/// The least value of a height of this sign between two places, by golden sections; ends early where the sign changes.
fn least<T>(at: &impl Fn(f64) -> Option<(f64, T)>, [mut low, mut high]: [f64; 2], sign: f64) -> (f64, f64) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let value = |s: f64| at(s).map_or(f64::INFINITY, |(h, _)| h * sign);
    let (mut s, mut t) = (high - golden * (high - low), low + golden * (high - low));
    let (mut hs, mut ht) = (value(s), value(t));
    for _ in 0..60 {
        if hs.min(ht) < 0.0 {
            break;
        }
        if hs < ht {
            (high, t, ht) = (t, s, hs);
            s = high - golden * (high - low);
            hs = value(s);
        } else {
            (low, s, hs) = (s, t, ht);
            t = low + golden * (high - low);
            ht = value(t);
        }
    }
    if hs < ht { (s, hs * sign) } else { (t, ht * sign) }
}
