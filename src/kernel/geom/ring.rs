//! From the edges of a file to the loops of a face: parameter curves, seams, poles, closed surfaces.
//!
//! Each edge is put into the parameter plane on its own ([`super::pcurve`]) and then moved by whole periods so that it
//! begins where the one before ends. Where they meet at a pole, a piece of the border that is the pole joins them; of
//! the places it could lead to, the one is taken that keeps the face on the left. Loops that go around a
//! closed surface (a cylinder bounded by two circles, without a seam in the file) are joined in pairs by a cut, or to
//! the pole that they surround. A surface that its loops leave over the seam is cut open elsewhere.
//!
//! Fails, with the reason, where an edge is far from the surface or loops fit together in no such way; the
//! caller then has the whole surface. Cost: that of the parameter curves.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::chart::{Chart, reseamed};
use super::pcurve::{lift, project, shifted, straight, uv_at};
use super::trim::{EdgeRole, Face, FaceEdge, FaceError, Ring, SurfaceKind, doubled_area, ring_polygon};
use super::{Curve, CurveError, Direction, Side, Surface, SurfaceError};

/// One use of an edge as the file has it, in the order of its loop.
#[derive(Clone, Debug)]
pub struct EdgeInput {
    /// Names the edge: the same number for the same edge.
    pub id: u64,
    /// The edge in space, where the file has it.
    pub curve: Option<Arc<Curve>>,
    /// Its parameter curve, where the file has it: it starts the search when there is a curve, and is the edge when
    /// there is none.
    pub guide: Option<Curve>,
    /// Whether the loop runs against the curve (and its guide).
    pub reversed: bool,
}

/// Turns the edges of a loop, which are in order, so that each begins where the one before ends. Edges that are closed in
/// themselves keep their direction. Where edges have no curve in space, their ends in the parameter plane decide.
pub fn head_to_tail(edges: &mut [EdgeInput]) {
    let in_space = edges.iter().all(|e| e.curve.is_some());
    let ends = |e: &EdgeInput| match (&e.curve, &e.guide) {
        (Some(curve), _) if in_space => curve.ends(),
        (_, Some(guide)) => guide.ends(),
        _ => [DVec3::ZERO; 2],
    };
    let all: Vec<[DVec3; 2]> = edges.iter().map(ends).collect();
    let Some((head, rest)) = all.split_first() else { return };
    let given: Vec<bool> = edges.iter().map(|e| e.reversed).collect();
    let size = super::Aabb::of(all.iter().flatten().copied()).diagonal();
    let closed = |[a, b]: &[DVec3; 2]| a.distance(*b) <= 1e-6 * size;
    // The direction of the first edge is the one that leaves the smaller gaps on the way around.
    let walk = |first: bool| -> (f64, Vec<bool>) {
        let mut reversed = vec![first];
        let mut total = 0.0;
        let mut tip = head[usize::from(!first)];
        for ([a, b], own) in rest.iter().zip(&given[1..]) {
            let turn = if closed(&[*a, *b]) { *own } else { tip.distance(*b) < tip.distance(*a) };
            total += tip.distance(if turn { *b } else { *a });
            reversed.push(turn);
            tip = if turn { *a } else { *b };
        }
        (total + tip.distance(head[usize::from(first)]), reversed)
    };
    let (forward, backward) = (walk(false), walk(true));
    let forward = if closed(head) { walk(given[0]) } else { forward };
    let reversed = if closed(head) {
        forward.1
    } else if backward.0 < forward.0 * (1.0 - 1e-9) {
        backward.1
    } else {
        forward.1
    };
    edges.iter_mut().zip(reversed).for_each(|(e, reversed)| e.reversed = reversed);
}

/// How to make a face.
#[derive(Clone, Copy, Debug)]
pub struct RingOptions {
    /// How closely parameter curves follow, as a fraction of the surface's size. Default 1e-7.
    pub follow: f64,
    /// How far an edge may be off the surface, as a fraction of its size. Default 1e-2.
    pub off: f64,
    /// Whether outer loops are known to run counter-clockwise and inner ones clockwise, seen along the surface
    /// normal. Default false.
    pub oriented: bool,
}

impl Default for RingOptions {
    fn default() -> Self {
        Self { follow: 1e-7, off: 1e-2, oriented: false }
    }
}

/// Why loops make no face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RingError {
    /// An edge is no curve.
    #[error("loop {ring}, edge {edge}: {source}")]
    Curve {
        /// Which loop.
        ring: usize,
        /// Which edge of it.
        edge: usize,
        /// What is wrong.
        source: CurveError,
    },
    /// An edge has neither a curve nor a parameter curve.
    #[error("loop {ring}, edge {edge} has no curve")]
    Missing {
        /// Which loop.
        ring: usize,
        /// Which edge of it.
        edge: usize,
    },
    /// An edge is not on the surface.
    #[error("loop {ring}, edge {edge} is {off:.3e} off its surface, of which at most {limit:.3e} can be right")]
    Off {
        /// Which loop.
        ring: usize,
        /// Which edge of it.
        edge: usize,
        /// How far.
        off: f64,
        /// What is allowed.
        limit: f64,
    },
    /// Loops around a closed surface that do not go together.
    #[error("{count} loops go around the closed surface; they bound no area that can be told")]
    Around {
        /// How many.
        count: usize,
    },
    /// The loops are wider than the closed surface is long.
    #[error("the loops overlap themselves around the closed surface")]
    Overlap,
    /// The surface could not be cut open.
    #[error("{0}")]
    Surface(#[from] SurfaceError),
    /// The result is no face.
    #[error("{0}")]
    Face(#[from] FaceError),
}

/// A face with what was measured while it was made.
#[derive(Clone, Debug)]
pub struct MadeFace {
    /// The face.
    pub face: Face,
    /// The largest distance of an edge from the surface.
    pub off: f64,
    /// The largest distance in space between the end of an edge and the beginning of the next one.
    pub gap: f64,
}

/// A loop in the parameter plane, not yet closed.
struct Open {
    edges: Vec<FaceEdge>,
    /// How often it goes around, by direction.
    turns: [i32; 2],
}

impl Open {
    fn start(&self) -> DVec2 {
        self.edges.first().map_or(DVec2::ZERO, |e| e.ends()[0])
    }

    fn end(&self) -> DVec2 {
        self.edges.last().map_or(DVec2::ZERO, |e| e.ends()[1])
    }

    fn shift(&mut self, by: DVec2) {
        if by != DVec2::ZERO {
            self.edges.iter_mut().for_each(|e| e.pcurve = shifted(&e.pcurve, by));
        }
    }

    fn turned(self) -> Self {
        let edges = self.edges.into_iter().rev().map(|e| FaceEdge { reversed: !e.reversed, ..e }).collect();
        Self { edges, turns: self.turns.map(|t| -t) }
    }

    fn points(&self, chart: &Chart<'_>) -> Vec<DVec2> {
        ring_polygon(chart.surface(), &Ring { edges: self.edges.clone() }, 1e-3 * chart.size())
    }
}

/// Numbers for edges that no file has: far from any that one uses.
const OWN_EDGES: u64 = 1 << 62;

struct Maker<'a> {
    chart: Chart<'a>,
    options: RingOptions,
    off: f64,
    gap: f64,
    own: u64,
}

/// Makes a face of a surface and loops of edges.
pub fn face(
    surface: &Arc<Surface>,
    kind: SurfaceKind,
    rings: &[Vec<EdgeInput>],
    options: &RingOptions,
) -> Result<MadeFace, RingError> {
    let chart = Chart::new(surface);
    let first_id = rings.iter().flatten().map(|e| e.id).min().unwrap_or(0);
    let own = OWN_EDGES + (first_id << 8);
    let mut maker = Maker { chart, options: *options, off: 0.0, gap: 0.0, own };
    let mut open = Vec::new();
    for (k, ring) in rings.iter().enumerate() {
        if ring.is_empty() {
            return Err(FaceError::Empty { ring: k }.into());
        }
        open.push(maker.open(k, ring)?);
    }
    let (around, mut closed): (Vec<Open>, Vec<Open>) = open.into_iter().partition(|r| r.turns != [0, 0]);
    closed.extend(maker.joined_around(around)?);
    let (surface, closed) = maker.moved_into_domain(surface, closed)?;
    let (off, gap) = (maker.off, maker.gap);
    let tol = 1e-5 * maker.chart.size();
    let mut rings: Vec<(f64, Ring)> = closed
        .into_iter()
        .map(|open| {
            let ring = Ring { edges: open.edges };
            (doubled_area(&ring_polygon(&surface, &ring, tol)), ring)
        })
        .collect();
    rings.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let rings = rings.into_iter().enumerate().map(|(k, (area, ring))| {
        // The outer loop counter-clockwise, holes clockwise.
        if (area >= 0.0) == (k == 0) {
            ring
        } else {
            Ring { edges: Open { edges: ring.edges, turns: [0; 2] }.turned().edges }
        }
    });
    let face = Face::new(surface, rings.collect(), kind)?;
    Ok(MadeFace { face, off, gap })
}

impl Maker<'_> {
    fn next_id(&mut self) -> u64 {
        self.own += 1;
        self.own
    }

    /// One edge in the parameter plane.
    fn edge(&mut self, ring: usize, edge: usize, input: &EdgeInput) -> Result<FaceEdge, RingError> {
        let wrong = |source| RingError::Curve { ring, edge, source };
        let tol = (self.options.follow * self.chart.size()).max(f64::MIN_POSITIVE);
        let (curve, pcurve, off) = match (&input.curve, &input.guide) {
            (Some(curve), guide) => {
                let [a, b] = curve.domain();
                let guided = guide.as_ref().map(|guide| {
                    let [c, d] = guide.domain();
                    move |t: f64| uv_at(guide, c + (d - c) * ((t - a) / (b - a)))
                });
                let found = project(&self.chart, curve, guided.as_ref().map(|g| g as &dyn Fn(f64) -> DVec2), tol);
                let found = found.map_err(wrong)?;
                (Arc::clone(curve), found.pcurve, found.off)
            }
            (None, Some(guide)) => {
                let curve = lift(&self.chart, guide, tol).map_err(wrong)?;
                (Arc::new(curve), guide.clone(), 0.0)
            }
            (None, None) => return Err(RingError::Missing { ring, edge }),
        };
        let limit = self.options.off * self.chart.size();
        if off > limit {
            return Err(RingError::Off { ring, edge, off, limit });
        }
        self.off = self.off.max(off);
        Ok(FaceEdge { id: input.id, curve, pcurve, reversed: input.reversed, role: EdgeRole::Model })
    }

    /// The edges of a loop one behind the other in the parameter plane.
    fn open(&mut self, ring: usize, inputs: &[EdgeInput]) -> Result<Open, RingError> {
        let mut edges = Vec::with_capacity(inputs.len());
        for (k, input) in inputs.iter().enumerate() {
            edges.push(self.edge(ring, k, input)?);
        }
        // Begin behind a joint that is no pole, where there is one: a pole decides nothing about the first edge.
        let reach = 1e-6 * self.chart.size();
        let pole = |e: &FaceEdge| self.chart.pole_near(e.curve.eval(e.range()[0]), reach);
        if let Some(at) = edges.iter().position(|e| pole(e).is_none()) {
            edges.rotate_left(at);
        }
        let mut out: Vec<FaceEdge> = Vec::with_capacity(edges.len());
        let ids: Vec<(u64, bool)> = edges.iter().map(|e| (e.id, e.reversed)).collect();
        let first_start = edges.first().map_or(DVec2::ZERO, |e| e.ends()[0]);
        for (k, mut edge) in edges.into_iter().enumerate() {
            if let Some(previous) = out.last() {
                let end = previous.ends()[1];
                let point = previous.curve.eval(previous.range()[1]);
                self.gap = self.gap.max(point.distance(edge.curve.eval(edge.range()[0])));
                let start = edge.ends()[0];
                let twice = ids[k].0 == ids[k - 1].0 && ids[k].1 != ids[k - 1].1;
                let side = self.chart.pole_near(point, reach);
                let target = match side {
                    Some(side) => self.along_pole(side, end, start, twice),
                    None => self.chart.unwrapped(start, end),
                };
                edge.pcurve = shifted(&edge.pcurve, target - start);
                if side.is_some() && target != end {
                    out.push(self.pole_edge(point, end, target).map_err(|s| self.wrong(ring, k, s))?);
                }
            }
            out.push(edge);
        }
        let Some(last) = out.last() else { return Err(FaceError::Empty { ring }.into()) };
        let (end, point) = (last.ends()[1], last.curve.eval(last.range()[1]));
        let first = out.first().map_or(point, |e| e.curve.eval(e.range()[0]));
        self.gap = self.gap.max(point.distance(first));
        let mut target = self.chart.unwrapped(first_start, end);
        if let Some(side) = self.chart.pole_near(point, reach) {
            target = self.along_pole(side, end, first_start, false);
            if target != end {
                out.push(self.pole_edge(point, end, target).map_err(|s| self.wrong(ring, 0, s))?);
            }
        }
        let turns = [0, 1].map(|k| ((target[k] - first_start[k]) / self.chart.period(k)).round() as i32);
        let turns = [0, 1].map(|k| if self.chart.closed()[k] { turns[k] } else { 0 });
        Ok(Open { edges: out, turns })
    }

    fn wrong(&self, ring: usize, edge: usize, source: CurveError) -> RingError {
        RingError::Curve { ring, edge, source }
    }

    /// Where along a pole the next edge begins so that the face stays on the left: a counter-clockwise loop runs along
    /// v = max towards smaller u, along v = min towards larger u, and so on around.
    fn along_pole(&self, side: Side, end: DVec2, start: DVec2, twice: bool) -> DVec2 {
        let (along, sign) = match side {
            Side::VMin => (0, 1.0),
            Side::UMax => (1, 1.0),
            Side::VMax => (0, -1.0),
            Side::UMin => (1, -1.0),
        };
        let mut target = self.chart.unwrapped(start, end);
        if !self.chart.closed()[along] {
            return target;
        }
        let period = self.chart.period(along);
        let ahead = (target[along] - end[along]) * sign;
        if !self.options.oriented && !twice {
            return target;
        }
        if twice || ahead < -1e-6 * period {
            let ahead = if ahead <= 1e-6 * period { ahead + period } else { ahead };
            target[along] = end[along] + sign * ahead;
        }
        target
    }

    fn pole_edge(&mut self, point: DVec3, from: DVec2, to: DVec2) -> Result<FaceEdge, CurveError> {
        let curve = Arc::new(Curve::segment(point, point)?);
        let pcurve = straight(from, to, curve.domain())?;
        Ok(FaceEdge { id: self.next_id(), curve, pcurve, reversed: false, role: EdgeRole::Pole })
    }

    /// An edge that the file does not have, along a straight line of parameters.
    fn cut(&mut self, from: DVec2, to: DVec2, role: EdgeRole) -> Result<FaceEdge, CurveError> {
        let pcurve = straight(from, to, [0.0, 1.0])?;
        let tol = (self.options.follow * self.chart.size()).max(f64::MIN_POSITIVE);
        let curve = Arc::new(lift(&self.chart, &pcurve, tol)?);
        Ok(FaceEdge { id: self.next_id(), curve, pcurve, reversed: false, role })
    }

    /// Loops around a closed surface made into loops that close in the parameter plane.
    fn joined_around(&mut self, mut rings: Vec<Open>) -> Result<Vec<Open>, RingError> {
        let count = rings.len();
        if count == 0 {
            return Ok(Vec::new());
        }
        let lost = RingError::Around { count };
        let along = if rings[0].turns[0] != 0 { 0 } else { 1 };
        let fits = |r: &Open| r.turns[along].abs() == 1 && r.turns[1 - along] == 0;
        if !rings.iter().all(fits) {
            return Err(lost);
        }
        let across = 1 - along;
        let middle = |r: &Open| {
            let points = r.points(&self.chart);
            points.iter().map(|p| p[across]).sum::<f64>() / points.len().max(1) as f64
        };
        let mut placed: Vec<(f64, Open)> = rings.drain(..).map(|r| (middle(&r), r)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut rings: Vec<Open> = placed.into_iter().map(|p| p.1).collect();
        let wrong = |source| RingError::Curve { ring: 0, edge: 0, source };
        // Increasing u with v growing to the left is positive; increasing v has smaller u on its left.
        let left = if along == 0 { 1 } else { -1 };
        let mut out = Vec::new();
        // Which side of the lowest loop the face is on: with an odd number, a pole closes one of them.
        if rings.len() % 2 == 1 {
            let sides = if along == 0 { [Side::VMin, Side::VMax] } else { [Side::UMin, Side::UMax] };
            let has = sides.map(|s| self.chart.pole(s).is_some());
            let above = match (self.options.oriented, has) {
                (false, [true, false]) => false,
                (false, [false, true]) => true,
                _ => (if rings.len() == 1 { &rings[0] } else { &rings[rings.len() - 1] }).turns[along] * left > 0,
            };
            let ring = if above { rings.pop() } else { Some(rings.remove(0)) };
            let Some(ring) = ring else { return Err(lost) };
            out.push(self.closed_at_border(ring, along, sides[usize::from(above)]).map_err(wrong)?);
        }
        // Where the other direction closes too, the face may be what lies around the far side.
        if self.options.oriented
            && self.chart.closed()[across]
            && rings.first().is_some_and(|r| r.turns[along] * left < 0)
        {
            let mut ring = rings.remove(0);
            let mut by = DVec2::ZERO;
            by[across] = self.chart.period(across);
            ring.shift(by);
            rings.push(ring);
        }
        let mut rest = rings.into_iter();
        while let (Some(low), Some(high)) = (rest.next(), rest.next()) {
            let low = if low.turns[along] * left > 0 { low } else { low.turned() };
            let high = if high.turns[along] * left < 0 { high } else { high.turned() };
            out.push(self.bridged(low, high, along).map_err(wrong)?);
        }
        Ok(out)
    }

    /// A loop that goes around, led to the border of the surface and back.
    fn closed_at_border(&mut self, ring: Open, along: usize, side: Side) -> Result<Open, CurveError> {
        let across = 1 - along;
        let domain = self.chart.surface().domain()[across];
        let border = if matches!(side, Side::VMin | Side::UMin) { domain[0] } else { domain[1] };
        let (start, end) = (ring.start(), ring.end());
        let (mut corner, mut back) = (end, start);
        (corner[across], back[across]) = (border, border);
        let up = self.cut(end, corner, EdgeRole::Cut)?;
        let down = FaceEdge { pcurve: shifted(&up.pcurve, start - end), reversed: true, ..up.clone() };
        let top = match self.chart.pole(side) {
            Some(point) => self.pole_edge(point, corner, back)?,
            None => self.cut(corner, back, EdgeRole::Model)?,
        };
        let mut edges = ring.edges;
        edges.extend([up, top, down]);
        Ok(Open { edges, turns: [0, 0] })
    }

    /// Two loops that go around in opposite directions, joined by a cut between two of their corners.
    fn bridged(&mut self, mut low: Open, mut high: Open, along: usize) -> Result<Open, CurveError> {
        let period = self.chart.period(along);
        let fraction = |uv: DVec2| (uv[along] / period).rem_euclid(1.0);
        let mut best = (f64::INFINITY, 0, 0);
        for (i, a) in low.edges.iter().enumerate() {
            for (j, b) in high.edges.iter().enumerate() {
                let d = (fraction(a.ends()[0]) - fraction(b.ends()[0])).abs();
                let d = d.min(1.0 - d);
                if d < best.0 {
                    best = (d, i, j);
                }
            }
        }
        for (ring, at) in [(&mut low, best.1), (&mut high, best.2)] {
            // The edges before the new start come one turn later.
            let mut by = DVec2::ZERO;
            by[along] = ring.end()[along] - ring.start()[along];
            for edge in &mut ring.edges[..at] {
                edge.pcurve = shifted(&edge.pcurve, by);
            }
            ring.edges.rotate_left(at);
        }
        let end = low.end();
        let near = self.chart.unwrapped(high.start(), end);
        let by = near - high.start();
        high.shift(by);
        let up = self.cut(end, high.start(), EdgeRole::Cut)?;
        let down = FaceEdge { pcurve: shifted(&up.pcurve, low.start() - end), reversed: true, ..up.clone() };
        let mut edges = low.edges;
        edges.push(up);
        edges.extend(high.edges);
        edges.push(down);
        Ok(Open { edges, turns: [0, 0] })
    }

    /// Moves loops by whole periods into one window, and the seam of the surface to its beginning where the window is
    /// not that of the surface.
    fn moved_into_domain(
        &self,
        surface: &Arc<Surface>,
        mut rings: Vec<Open>,
    ) -> Result<(Arc<Surface>, Vec<Open>), RingError> {
        let mut surface = Arc::clone(surface);
        for k in (0..2).filter(|&k| self.chart.closed()[k]) {
            let period = self.chart.period(k);
            let [start, end] = surface.domain()[k];
            let range = |r: &Open| {
                let points = r.points(&self.chart);
                points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[k]), b.max(p[k])])
            };
            let mut ranges: Vec<[f64; 2]> = rings.iter().map(range).collect();
            let widest = (0..rings.len())
                .max_by(|&a, &b| (ranges[a][1] - ranges[a][0]).total_cmp(&(ranges[b][1] - ranges[b][0])));
            let Some(widest) = widest else { continue };
            let move_to = |ring: &mut Open, range: &mut [f64; 2], center: f64| {
                let turns = ((center - 0.5 * (range[0] + range[1])) / period).round();
                let mut by = DVec2::ZERO;
                by[k] = turns * period;
                ring.shift(by);
                *range = range.map(|x| x + by[k]);
            };
            let center = 0.5 * (start + end);
            move_to(&mut rings[widest], &mut ranges[widest], center);
            let window = 0.5 * (ranges[widest][0] + ranges[widest][1]);
            for j in (0..rings.len()).filter(|&j| j != widest) {
                move_to(&mut rings[j], &mut ranges[j], window);
            }
            let low = ranges.iter().map(|r| r[0]).fold(f64::INFINITY, f64::min);
            let high = ranges.iter().map(|r| r[1]).fold(f64::NEG_INFINITY, f64::max);
            let slack = 1e-6 * period;
            if high - low > period + 2.0 * slack {
                return Err(RingError::Overlap);
            }
            if low < start - slack || high > end + slack {
                let spare = (period - (high - low)).max(0.0);
                let direction = if k == 0 { Direction::U } else { Direction::V };
                // Window and surface begin at the same number, so that parameters stay what they are.
                let wanted = low - 0.5 * spare;
                let turned = reseamed(&surface, direction, wanted)?;
                let by = turned.domain()[k][0] - wanted;
                let turns = (by / period).round() * period;
                let mut shift = DVec2::ZERO;
                shift[k] = turns;
                rings.iter_mut().for_each(|r| r.shift(shift));
                surface = Arc::new(turned);
            }
        }
        Ok((surface, rings))
    }
}
