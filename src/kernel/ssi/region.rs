//! Coincident regions: where the surfaces are one over an area, and the curves that bound it.
//!
//! The surfaces are piecewise analytic, so that a region in which they coincide ends only at borders of pieces: of A
//! on B, or of B on A. Every border of every piece that has coincident cells is sampled against the other side; the
//! intervals on which it lies there, and beyond which nothing coincides, are chained into loops. The distance bound
//! is that of the gap functions over all coincident cells.
//!
//! Most borders of many pieces lie within a region: one that lies on the other piece in [`PROBES`] places, and has
//! coincidence beyond its middle, is left out with these. Pieces are found by a tree over their boxes. Cost: in
//! proportion to the pairs of pieces that coincide, and to the square of the stretches that bound regions.

use glam::{DVec2, DVec3};

use super::boxes::Boxes;
use super::contact::Cell;
use super::engine::Engine;
use super::result::CurvePoint;
use super::side::{Place, closest, closest_from};
use crate::kernel::geom::Aabb;
use crate::kernel::job::Job;

/// A region in the unit frame.
#[derive(Clone, Debug, Default)]
pub struct CoincidentRegion {
    /// Closed loops; the last point repeats the first.
    pub loops: Vec<Vec<RegionPoint>>,
    /// An upper bound of the distance.
    pub distance: f64,
}

/// A point of a boundary.
#[derive(Clone, Copy, Debug)]
pub struct RegionPoint {
    /// Where on A.
    pub a: Place,
    /// Where on B.
    pub b: Place,
    /// The point.
    pub p: DVec3,
}

/// Samples of one border.
const SAMPLES: usize = 48;
/// Where a border between two pieces of a surface is looked at first; the middle comes first.
const PROBES: [f64; 5] = [0.5, 0.0, 0.25, 0.75, 1.0];
/// Samples over the width of the other piece.
const NARROW: f64 = 3.0;
/// The most samples of one border: across what is narrower than a 3000th of it, the region does not close and is left open.
const MOST_SAMPLES: f64 = 10_000.0;
/// Ends of intervals closer than this are one.
const JOINED: f64 = 1e-6;

struct Finder<'a> {
    engine: &'a Engine,
    near: f64,
    pieces: [Boxes; 2],
}

/// Finds all regions from cells in which the gap vanishes. Pieces without such cells take no part. Empty when
/// cancelled.
pub fn regions(engine: &Engine, cells: &[Cell], job: &Job) -> Vec<CoincidentRegion> {
    if cells.is_empty() {
        return Vec::new();
    }
    let near = 4.0 * engine.gap + 1e-13;
    let pieces = [0, 1].map(|side| Boxes::new(&engine.sides[side].bounds));
    let finder = Finder { engine, near, pieces };
    let mut pairs: Vec<(usize, usize)> = cells.iter().map(|c| (c.pa, c.pb)).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut intervals: Vec<Vec<RegionPoint>> = Vec::new();
    for &(pa, pb) in &pairs {
        for fixed in 0..2 {
            for value in [0.0, 1.0] {
                if job.is_cancelled() {
                    return Vec::new();
                }
                intervals.extend(finder.border([pa, pb], 0, fixed, value));
                intervals.extend(finder.border([pa, pb], 1, fixed, value));
            }
        }
    }
    // A border of A that runs along one of B, and a border shared by two pairs, were met twice.
    let mut kept: Vec<Vec<RegionPoint>> = Vec::new();
    let mut boxes: Vec<Aabb> = Vec::new();
    for interval in intervals {
        if job.is_cancelled() {
            return Vec::new();
        }
        let middle = interval[interval.len() / 2].p;
        let step = interval.windows(2).map(|w| w[0].p.distance(w[1].p)).fold(0.0, f64::max);
        let known = |other: &Vec<RegionPoint>| {
            other.windows(2).any(|w| {
                let d = w[1].p - w[0].p;
                let t = ((middle - w[0].p).dot(d) / d.length_squared().max(1e-300)).clamp(0.0, 1.0);
                (w[0].p + d * t).distance(middle) < 1e-6 + 0.02 * d.length().min(step)
            })
        };
        if !kept.iter().zip(&boxes).any(|(other, bounds)| bounds.contains(middle) && known(other)) {
            boxes.push(Aabb::of(interval.iter().map(|q| q.p)).grown(1e-6 + 0.02 * step));
            kept.push(interval);
        }
    }
    let loops = chain(kept);
    let distance = cells.iter().map(|c| c.gap).fold(0.0, f64::max);
    if loops.is_empty() {
        // Coincident all over closed surfaces: a region without boundary.
        let mut whole: Vec<usize> = cells.iter().map(|c| c.pa).collect();
        whole.sort_unstable();
        whole.dedup();
        let area: f64 = cells.iter().map(|c| (c.high - c.low).element_product()).sum();
        let closed = area > 0.9 * whole.len() as f64;
        return if closed { vec![CoincidentRegion { loops, distance }] } else { Vec::new() };
    }
    group(loops, distance, engine)
}

impl Finder<'_> {
    /// A point of one side on the other: its place there, if it lies on it.
    fn onto(&self, side: usize, piece: usize, p: DVec3) -> Option<Place> {
        let (uv, distance) = closest(&self.engine.sides[side].pieces[piece], p)?;
        (distance <= self.near).then_some(Place { piece, uv })
    }

    /// The same with a guess of the place, which is only trusted when it leads there.
    fn onto_from(&self, side: usize, piece: usize, p: DVec3, guess: Option<DVec2>) -> Option<Place> {
        if let Some(guess) = guess {
            let (uv, distance) = closest_from(&self.engine.sides[side].pieces[piece], p, guess);
            if distance <= self.near {
                return Some(Place { piece, uv });
            }
        }
        self.onto(side, piece, p)
    }

    /// Whether the point coincides with some piece of a side other than through `piece`'s own border.
    fn anywhere(&self, side: usize, p: DVec3) -> bool {
        self.pieces[side].around(p, self.near).any(|k| self.onto(side, k, p).is_some())
    }

    /// The stretches of one border of the piece of `side` that lie on the other piece and bound the region.
    fn border(&self, pair: [usize; 2], side: usize, fixed: usize, value: f64) -> Vec<Vec<RegionPoint>> {
        let piece = &self.engine.sides[side].pieces[pair[side]];
        let other = 1 - side;
        let uv_at = |t: f64| {
            let mut uv = DVec2::splat(value);
            uv[1 - fixed] = t;
            uv
        };
        let mut guess: Option<DVec2> = None;
        let mut place = |t: f64| -> Option<RegionPoint> {
            let own = Place { piece: pair[side], uv: uv_at(t) };
            let p = piece.point(own.uv);
            if !self.engine.sides[other].bounds[pair[other]].grown(self.near).contains(p) {
                return None;
            }
            let there = self.onto_from(other, pair[other], p, guess)?;
            guess = Some(there.uv);
            Some(if side == 0 { RegionPoint { a: own, b: there, p } } else { RegionPoint { a: there, b: own, p } })
        };
        if self.engine.sides[side].neighbour(pair[side], fixed, value).is_some() {
            let probes: Vec<Option<RegionPoint>> = PROBES.iter().map(|&t| place(t)).collect();
            if let [Some(middle), ..] = probes[..]
                && probes.iter().all(Option::is_some)
                && !self.bounds(side, fixed, &[middle])
            {
                return Vec::new();
            }
        }
        let mut out = Vec::new();
        let mut current: Vec<RegionPoint> = Vec::new();
        let mut last: Option<(f64, bool)> = None;
        // The place where the border enters or leaves the other piece.
        fn edge(
            place: &mut impl FnMut(f64) -> Option<RegionPoint>,
            mut inside: f64,
            mut outside: f64,
        ) -> Option<RegionPoint> {
            let mut best = None;
            for _ in 0..50 {
                let middle = 0.5 * (inside + outside);
                match place(middle) {
                    Some(point) => (inside, best) = (middle, Some(point)),
                    None => outside = middle,
                }
            }
            best
        }
        // As many samples as the tolerance of the polyline asks for, and some on a narrow piece that the border crosses.
        let coarse: Vec<DVec3> = (0..=SAMPLES).map(|k| piece.point(uv_at(k as f64 / SAMPLES as f64))).collect();
        let sag = coarse.windows(3).map(|w| 0.25 * (w[1] - 0.5 * (w[0] + w[2])).length()).fold(0.0, f64::max);
        let finer = ((1.5 * sag / self.engine.trace.tol).sqrt().ceil() as usize).clamp(1, 64);
        let length: f64 = coarse.windows(2).map(|w| w[0].distance(w[1])).sum();
        let on_other = |u: f64, v: f64| self.engine.sides[other].pieces[pair[other]].point(DVec2::new(u, v));
        let width =
            on_other(0.0, 0.5).distance(on_other(1.0, 0.5)).min(on_other(0.5, 0.0).distance(on_other(0.5, 1.0)));
        let narrow = (length / width * NARROW).ceil().min(MOST_SAMPLES) as usize;
        let samples = (SAMPLES * finer).max(narrow);
        for k in 0..=samples {
            let t = k as f64 / samples as f64;
            let here = place(t);
            match (last, here) {
                (Some((before, false)), Some(point)) => {
                    current.extend(edge(&mut place, t, before));
                    current.push(point);
                }
                (_, Some(point)) => current.push(point),
                (Some((before, true)), None) => {
                    current.extend(edge(&mut place, before, t));
                    out.push(std::mem::take(&mut current));
                }
                _ => {}
            }
            last = Some((t, here.is_some()));
        }
        out.push(current);
        let long = |interval: &Vec<RegionPoint>| {
            interval.len() > 2 && interval.windows(2).map(|w| w[0].p.distance(w[1].p)).sum::<f64>() > 1e-5
        };
        out.retain(|interval| long(interval) && self.bounds(side, fixed, interval));
        out
    }

    /// Whether nothing coincides beyond a stretch of a border: its side ends there, or its side's next piece, just
    /// inside, is off the other side.
    fn bounds(&self, side: usize, fixed: usize, interval: &[RegionPoint]) -> bool {
        let middle = &interval[interval.len() / 2];
        let own = if side == 0 { middle.a } else { middle.b };
        let sides = &self.engine.sides;
        let beyond = sides[side].across(own, fixed, middle.p, self.engine.trace.joining);
        !beyond.iter().any(|(place, border)| {
            let mut uv = place.uv;
            let inwards = if uv[*border] > 0.5 { -1e-3 } else { 1e-3 };
            uv[*border] += inwards;
            let p = sides[side].pieces[place.piece].point(uv);
            self.anywhere(1 - side, p)
        })
    }
}

/// Whether two points have the same parameters on both sides (not so across seams and shared edges).
fn same_place(x: &RegionPoint, y: &RegionPoint) -> bool {
    let same = |p: &Place, q: &Place| p.piece == q.piece && p.uv.distance(q.uv) < 1e-6;
    same(&x.a, &y.a) && same(&x.b, &y.b)
}

/// Chains stretches with common ends into closed loops; what does not close is dropped.
fn chain(mut pieces: Vec<Vec<RegionPoint>>) -> Vec<Vec<RegionPoint>> {
    let mut loops = Vec::new();
    while let Some(mut line) = pieces.pop() {
        while let (Some(first), Some(last)) = (line.first().copied(), line.last().copied()) {
            if line.len() > 3 && first.p.distance(last.p) < JOINED {
                if same_place(&first, &last) {
                    line.pop();
                }
                line.push(first);
                loops.push(line);
                break;
            }
            let next = pieces.iter().position(|l| {
                let ends = l.first().zip(l.last());
                ends.is_some_and(|(a, b)| a.p.distance(last.p) < JOINED || b.p.distance(last.p) < JOINED)
            });
            let Some(next) = next else { break };
            let mut more = pieces.remove(next);
            if more.last().is_some_and(|b| b.p.distance(last.p) < JOINED) {
                more.reverse();
            }
            let repeated = more.first().is_some_and(|next| same_place(next, &last));
            line.extend(more.into_iter().skip(usize::from(repeated)));
        }
    }
    loops
}

/// Twice the signed area of a loop in the parameters of A's surface, and whether it is meaningful (one surface).
fn area(engine: &Engine, line: &[RegionPoint]) -> f64 {
    let at = |q: &RegionPoint| engine.sides[0].pieces[q.a.piece].to_surface(q.a.uv);
    line.windows(2).map(|w| at(&w[0]).perp_dot(at(&w[1]))).sum()
}

/// Loops to regions: a loop inside another one is a hole of it.
fn group(mut loops: Vec<Vec<RegionPoint>>, distance: f64, engine: &Engine) -> Vec<CoincidentRegion> {
    loops.sort_by(|x, y| area(engine, y).abs().total_cmp(&area(engine, x).abs()));
    let mut out: Vec<CoincidentRegion> = Vec::new();
    for mut line in loops {
        let inside = |outer: &Vec<RegionPoint>| {
            let at = |q: &RegionPoint| engine.sides[0].pieces[q.a.piece].to_surface(q.a.uv);
            let p = at(&line[0]);
            let surface = |q: &RegionPoint| engine.sides[0].pieces[q.a.piece].surface;
            surface(&outer[0]) == surface(&line[0])
                && outer
                    .windows(2)
                    .filter(|w| {
                        let (x, y) = (at(&w[0]), at(&w[1]));
                        (x.y > p.y) != (y.y > p.y) && p.x < x.x + (p.y - x.y) / (y.y - x.y) * (y.x - x.x)
                    })
                    .count()
                    % 2
                    == 1
        };
        // Loops around a closed surface bound one region together, though neither contains the other.
        let around = |l: &Vec<RegionPoint>| {
            l.windows(2).any(|w| {
                let (x, y) = (&engine.sides[0].pieces[w[0].a.piece], &engine.sides[0].pieces[w[1].a.piece]);
                let far = (x.to_surface(w[0].a.uv) - y.to_surface(w[1].a.uv)).abs().max_element();
                x.surface == y.surface && w[0].p.distance(w[1].p) < JOINED && far > 1e-3
            })
        };
        let home = out.iter().position(|r| r.loops.first().is_some_and(inside));
        let home = home.or_else(|| {
            if around(&line) { out.iter().position(|r| r.loops.first().is_some_and(around)) } else { None }
        });
        let wanted = if home.is_some() { -1.0 } else { 1.0 };
        if area(engine, &line) * wanted < 0.0 {
            line.reverse();
        }
        match home {
            Some(home) => out[home].loops.push(line),
            None => out.push(CoincidentRegion { loops: vec![line], distance }),
        }
    }
    out
}

/// A boundary point in model units.
pub fn point_of(engine: &Engine, q: &RegionPoint) -> CurvePoint {
    let (a, b) = (&engine.sides[0].pieces[q.a.piece], &engine.sides[1].pieces[q.b.piece]);
    CurvePoint {
        xyz: engine.frame.to_model(q.p),
        a: a.surface,
        uv: a.to_surface(q.a.uv),
        b: b.surface,
        st: b.to_surface(q.b.uv),
    }
}
