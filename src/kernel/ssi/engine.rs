//! The intersection of two sets of surfaces, from pieces to curves with a certificate.
//!
//! 1. Descend through pairs of nodes ([`super::traverse`]); keep pairs with one arc, and fit gap functions where the
//!    surfaces run nearly parallel ([`super::contact`]).
//! 2. Polish contacts, find their arms ([`super::junction`]) and trace these first, then tangential curves, then
//!    every seed that lies on no curve yet ([`super::trace`]).
//! 3. What was neither proved empty nor traced is listed as unresolved. That list is the certificate: when it is
//!    empty, every surviving pair of nodes was visited by a curve or belongs to a junction or a coincident region.
//!
//! Thesis 5.3 finds contacts by the binormals of osculating tori. Here the fitted gap finds and excludes them, because
//! a torus agrees to second order only and can exclude nothing; the tori ([`super::tangency`]) give further starting
//! points where Newton's method does not settle from the gap's own critical point.

use std::collections::HashMap;
use std::time::Instant;

use glam::{DVec2, DVec3};

use super::binormal;
use super::boxes;
use super::contact::{Cell, Findings, SLACK, Seed};
use super::correct::{Condition, PointPair};
use super::junction::{Contacted, arms_of, is_point};
use super::output;
use super::piece::Patch;
use super::poles;
use super::region::{self, CoincidentRegion};
use super::repeated;
use super::result::{Counts, CurveEnd, Intersection, Times, Unresolved};
use super::side::{Frame, Side, closest, closest_from};
use super::tangency::from_tori;
use super::trace::{Disc, End, Mode, TraceNode, TraceOptions, Tracer, on_border};
use super::traverse::{ArcPair, OpenPair, TOO_SMALL, Traversal, traverse};
use super::tree::{Node, Tree};
use super::undecided::{self, Undecided};
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;
use crate::kernel::tol::Tolerances;

/// The settings of an intersection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SsiOptions {
    /// How closely curves follow, in model units. Default: 1e-6 of the diagonal of both sides together.
    pub tol: Option<f64>,
    /// The distance that counts as contact, in model units. Default: 1e-11 of the diagonal, never below rounding.
    pub gap_tol: Option<f64>,
    /// How far apart the borders of neighbouring patches of one side may be. Default: 1e-6 of the diagonal.
    pub joining: Option<f64>,
}

/// Why nothing was computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SsiError {
    /// A tolerance is zero, negative or not a number.
    #[error("{name} is {value}, but must be a positive length")]
    Tolerance {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A tolerance is larger than the model.
    #[error("{name} is {value}, larger than the model's diagonal of {diagonal}; choose a smaller one")]
    TooLarge {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The diagonal.
        diagonal: f64,
    },
    /// A side has no surface.
    #[error("side {side} has no surface")]
    Empty {
        /// `a` or `b`.
        side: char,
    },
}

/// How a chain of points ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainEnd {
    /// How.
    pub end: CurveEnd,
    /// In which contact.
    pub contact: Option<usize>,
}

/// A traced curve.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Its points.
    pub nodes: Vec<TraceNode>,
    /// What kind of curve it is.
    pub mode: Mode,
    /// How it starts and ends.
    pub ends: [ChainEnd; 2],
}

/// The tolerances of an intersection, in model units.
pub(super) struct Lengths {
    pub tol: f64,
    pub gap: f64,
    pub joining: f64,
}

impl SsiOptions {
    /// What is asked for, or the defaults of a model of this size.
    pub(super) fn checked(&self, bounds: &Aabb) -> Result<Lengths, SsiError> {
        let defaults = Tolerances::of(bounds);
        let diagonal = bounds.diagonal();
        let checked = |name, value: Option<f64>, default: f64| match value {
            None => Ok(default),
            Some(value) if !(value > 0.0 && value.is_finite()) => Err(SsiError::Tolerance { name, value }),
            Some(value) if value > diagonal && diagonal > 0.0 => Err(SsiError::TooLarge { name, value, diagonal }),
            Some(value) => Ok(value),
        };
        Ok(Lengths {
            tol: checked("tol", self.tol, defaults.follow)?,
            gap: checked("gap_tol", self.gap_tol, defaults.gap)?,
            joining: checked("joining", self.joining, 1e-6 * diagonal.max(f64::MIN_POSITIVE))?,
        })
    }
}

/// Intersects two sets of numbered surfaces.
pub fn intersect(
    a: &[(usize, &Surface)],
    b: &[(usize, &Surface)],
    options: &SsiOptions,
    job: &Job,
) -> Result<Intersection, SsiError> {
    for (side, list) in [('a', a), ('b', b)] {
        if list.is_empty() {
            return Err(SsiError::Empty { side });
        }
    }
    let bounds = a.iter().chain(b).fold(Aabb::EMPTY, |all, (_, s)| all.union(&s.bounds()));
    let diagonal = bounds.diagonal();
    let Lengths { tol, gap: gap_tol, joining } = options.checked(&bounds)?;
    let clock = Instant::now();
    let frame = Frame::of(&bounds);
    let sides = [Side::new(a, &frame), Side::new(b, &frame)];
    let trees = [Tree::new(&sides[0]), Tree::new(&sides[1])];
    let build = clock.elapsed();
    let mut engine = Engine {
        sides,
        trees,
        frame,
        gap: gap_tol * frame.scale,
        trace: TraceOptions {
            tol: 0.25 * tol * frame.scale,
            floor: 4e-16 * frame.scale * (bounds.max_abs() + diagonal),
            joining: joining * frame.scale,
            contact: gap_tol * frame.scale,
            most_points: 200_000,
        },
        contacts: Vec::new(),
        chains: Vec::new(),
        register: HashMap::new(),
        border_segments: Vec::new(),
        regions: Vec::new(),
        unresolved: Vec::new(),
    };
    job.phase("Finding where the surfaces meet");
    let [ref left, ref right] = engine.sides;
    let traversal = traverse([left, right], &mut engine.trees, engine.gap, engine.trace.joining, job);
    let traversed = clock.elapsed();
    job.phase("Following curves");
    engine.run(&traversal, job);
    let mut result = output::assemble(&engine, tol);
    result.counts = Counts {
        leaf_pairs: traversal.arcs.len() + traversal.fits,
        nodes_built: engine.trees.iter().map(|t| t.nodes.len()).sum(),
    };
    let total = clock.elapsed();
    let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
    result.time_ms = Times { build: ms(build), traverse: ms(traversed - build), curves: ms(total - traversed) };
    job.progress(1.0);
    Ok(result)
}

/// A point on the border of a cell belongs to it, to within this.
const CELL_BORDER: f64 = 1e-6;

/// How near a seed on a border must be to a curve on it to be one with it, in the unit frame.
const SAME_ON_BORDER: f64 = 5e-7;

/// What is nearer than this is one point, in the unit frame: ten times what pairs of nodes are divided down to.
const SAME_POINT: f64 = 1e-8;

/// A curve from border to border that is shorter than this is a point.
const SHORTEST: f64 = 1e-9;

/// Everything that is known while curves are traced.
pub struct Engine {
    /// The pieces of both sides.
    pub sides: [Side; 2],
    /// Their nodes.
    pub trees: [Tree; 2],
    /// The frame of all coordinates.
    pub frame: Frame,
    /// The distance that counts as contact.
    pub gap: f64,
    /// The settings of traces.
    pub trace: TraceOptions,
    /// Contacts with their arms.
    pub contacts: Vec<Contacted>,
    /// Curves.
    pub chains: Vec<Chain>,
    register: HashMap<(usize, usize), Vec<(usize, usize)>>,
    border_segments: Vec<(usize, usize)>,
    /// Where the surfaces coincide.
    pub regions: Vec<CoincidentRegion>,
    /// What could not be decided.
    pub unresolved: Vec<Unresolved>,
}

impl Engine {
    fn run(&mut self, traversal: &Traversal, job: &Job) {
        if self.trace_all(traversal, job).is_none() {
            self.cancelled(traversal);
        }
    }

    /// `None` when cancelled.
    fn trace_all(&mut self, traversal: &Traversal, job: &Job) -> Option<()> {
        let go_on = || (!job.is_cancelled()).then_some(());
        self.find_contacts(&traversal.findings, job);
        go_on()?;
        let (coincident, undecided) = self.flat_contacts(&traversal.findings);
        for contact in 0..self.contacts.len() {
            go_on()?;
            for arm in 0..self.contacts[contact].arms.len() {
                if !self.contacts[contact].arms[arm].used {
                    self.trace_arm(contact, arm);
                }
            }
        }
        for seed in &traversal.findings.ridges {
            self.trace_ridge(seed);
        }
        let total = (traversal.arcs.len() + traversal.findings.seeds.len()).max(1) as f64;
        for (k, seed) in traversal.findings.seeds.iter().enumerate() {
            go_on()?;
            self.trace_contact_seed(seed, &coincident);
            job.progress(0.5 + 0.5 * k as f64 / total);
        }
        for (k, arc) in traversal.arcs.iter().enumerate() {
            go_on()?;
            self.trace_arc(arc);
            job.progress(0.5 + 0.5 * (k + traversal.findings.seeds.len()) as f64 / total);
        }
        repeated::drop_repeats(self);
        poles::join(self);
        self.regions = region::regions(self, &coincident, job);
        go_on()?;
        self.open_pairs(&traversal.unresolved);
        if self.regions.is_empty() {
            self.settle_undecided(&coincident);
        }
        self.settle_undecided(&undecided);
        Some(())
    }

    /// Lists what the descent left, apart from points in which only borders meet (no crossing is there) and those
    /// that a curve runs into.
    fn open_pairs(&mut self, pairs: &[OpenPair]) {
        let mut open = Vec::new();
        for pair in pairs {
            let (a, b) = (&self.trees[0].nodes[pair.a], &self.trees[1].nodes[pair.b]);
            if pair.reason == TOO_SMALL && self.only_touches([a, b]) {
                continue;
            }
            open.push(Undecided {
                entry: self.unresolved_at([a.piece, b.piece], [a.low, a.high], [b.low, b.high], pair.reason),
                extent: a.bounds.union(&b.bounds).diagonal() / self.frame.scale,
            });
        }
        self.unresolved.extend(undecided::merged(open));
    }

    /// Whether a pair of nodes as small as a point lies on borders of both sides, or at an end of a curve, or in a pole that
    /// a curve passes as near as that.
    fn only_touches(&self, pair: [&Node; 2]) -> bool {
        let near = |p: DVec3| p.distance(pair[0].c) < SAME_POINT;
        let in_pole = |side: usize| {
            let mut borders = self.sides[side].borders_of(pair[side].piece).iter();
            borders.any(|e| e.bounds.diagonal() < SAME_POINT && near(e.bounds.center()))
        };
        let on_border = |side: usize| {
            let node = pair[side];
            let mut borders = self.sides[side].borders_of(node.piece).iter();
            borders.any(|e| if e.value > 0.5 { node.high[e.fixed] >= 1.0 } else { node.low[e.fixed] <= 0.0 })
        };
        let poles = [in_pole(0), in_pole(1)];
        let ends = |c: &Chain| [c.nodes.first(), c.nodes.last()].into_iter().flatten().any(|n| near(n.p));
        let passes = |c: &Chain| c.nodes.iter().any(|n| near(n.p));
        (0..2).all(|side| poles[side] || on_border(side))
            || self.chains.iter().any(ends)
            || (poles.contains(&true) && self.chains.iter().any(passes))
    }

    fn cancelled(&mut self, traversal: &Traversal) {
        self.open_pairs(&traversal.unresolved);
        let whole = [DVec2::ZERO, DVec2::ONE];
        let entry = self.unresolved_at([0, 0], whole, whole, "cancelled");
        self.unresolved.push(entry);
    }

    fn unresolved_at(&self, pair: [usize; 2], a: [DVec2; 2], b: [DVec2; 2], reason: &str) -> Unresolved {
        let (pa, pb) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let boxed = |piece: &super::piece::Piece, rect: [DVec2; 2]| {
            let (low, high) = (piece.to_surface(rect[0]), piece.to_surface(rect[1]));
            [[low.x, high.x], [low.y, high.y]]
        };
        Unresolved {
            a: pa.surface,
            uv_box: boxed(pa, a),
            b: pb.surface,
            st_box: boxed(pb, b),
            reason: reason.to_owned(),
        }
    }

    fn give_up(&mut self, pair: [usize; 2], at: PointPair, reason: &str) {
        let around = |x: DVec2| [(x - 1e-3).clamp(DVec2::ZERO, DVec2::ONE), (x + 1e-3).clamp(DVec2::ZERO, DVec2::ONE)];
        let entry = self.unresolved_at(pair, around(at.uv), around(at.st), reason);
        if !self.unresolved.contains(&entry) {
            self.unresolved.push(entry);
        }
    }

    /// Polishes critical points on the exact surfaces and finds the arms of those that are contacts.
    fn find_contacts(&mut self, findings: &Findings, job: &Job) {
        let mut found: Vec<(binormal::Binormal, [usize; 2], bool)> = Vec::new();
        for critical in &findings.criticals {
            if job.is_cancelled() {
                return;
            }
            let (a, b) = (&self.sides[0].pieces[critical.pa], &self.sides[1].pieces[critical.pb]);
            // From the gap's own critical point, else from the binormals of the osculating tori (thesis 5.3).
            let polished = binormal::polish(a, b, critical.at, 0.02, false);
            let Some(point) = polished.or_else(|| from_tori(a, b, critical.at)) else {
                self.give_up([critical.pa, critical.pb], critical.at, "a point of contact could not be polished");
                continue;
            };
            let slack = 1e-6;
            let x = point.at.to_array();
            if point.gap.abs() > self.gap || x.iter().any(|&v| !(-slack..=1.0 + slack).contains(&v)) {
                continue;
            }
            let same = |other: &binormal::Binormal| other.p.distance(point.p) < 1e-6;
            if !found.iter().any(|(other, ..)| same(other)) {
                found.push((point, [critical.pa, critical.pb], critical.extremum));
            }
        }
        let centers: Vec<DVec3> = found.iter().map(|(f, ..)| f.p).collect();
        for (k, (point, pair, extremum)) in found.into_iter().enumerate() {
            let others = centers.iter().enumerate().filter(|&(j, _)| j != k).map(|(_, c)| c.distance(point.p));
            let radius = others.fold(0.02, |r: f64, d| r.min(0.3 * d));
            let at = point.at;
            if extremum {
                self.contacts.push(Contacted { binormal: point, pair, radius: 1e-7, arms: Vec::new() });
                continue;
            }
            match arms_of([&self.sides[0], &self.sides[1]], point, pair, radius, self.trace.joining) {
                Some(contact) => self.contacts.push(contact),
                None => self.give_up(pair, at, "the arms of a junction could not be told apart"),
            }
        }
    }

    /// Contacts of higher order: clusters of cells in which the gap vanishes or nothing was decided, with an open gap
    /// all around. Returns the cells that are left.
    fn flat_contacts(&mut self, findings: &Findings) -> (Vec<Cell>, Vec<Cell>) {
        let cells: Vec<&Cell> = findings.coincident.iter().chain(&findings.undecided).collect();
        let place = |c: &Cell| {
            let piece = &self.sides[0].pieces[c.pa];
            let p = piece.point(c.middle.uv);
            (p, p.distance(piece.point(c.low)).max(p.distance(piece.point(c.high))))
        };
        let places: Vec<(DVec3, f64)> = cells.iter().map(|c| place(c)).collect();
        // Cells that touch belong together. Large cells are regions, never points.
        let mut done = vec![false; cells.len()];
        for members in boxes::clusters(&places) {
            let center = members.iter().map(|&m| places[m].0).sum::<DVec3>() / members.len() as f64;
            let extent = members.iter().map(|&m| places[m].0.distance(center) + places[m].1).fold(0.0, f64::max);
            if extent > 0.02 {
                continue;
            }
            let nearest =
                members.iter().min_by(|&&x, &&y| places[x].0.distance(center).total_cmp(&places[y].0.distance(center)));
            if nearest.is_some_and(|&m| self.flat_contact([cells[m].pa, cells[m].pb], cells[m].middle, extent)) {
                members.iter().for_each(|&m| done[m] = true);
            }
        }
        let split = findings.coincident.len();
        let left = |range: std::ops::Range<usize>| range.filter(|&k| !done[k]).map(|k| *cells[k]).collect();
        (left(0..split), left(split..cells.len()))
    }

    /// Takes a small closed spot for a point contact when the gap is open around it.
    fn flat_contact(&mut self, pair: [usize; 2], at: PointPair, extent: f64) -> bool {
        let (a, b) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let Some((point, _)) = binormal::look(a, b, at) else { return false };
        let sides = [&self.sides[0], &self.sides[1]];
        let mut radius = (2.0 * extent).max(1e-3);
        let joining = self.trace.joining;
        while !is_point(sides, &point, pair, 0.25 * radius, joining, self.gap) {
            radius *= 1.5;
            if radius > 0.2 {
                return false;
            }
        }
        match arms_of(sides, point, pair, radius, joining) {
            Some(contact) if contact.radius > 0.9 * radius => {
                self.contacts.push(contact);
                true
            }
            _ => false,
        }
    }

    /// Runs a closure with a tracer over the present discs.
    fn with_tracer<T>(&self, f: impl FnOnce(&Tracer<'_>) -> T) -> T {
        let discs: Vec<Disc> = self
            .contacts
            .iter()
            .map(|c| Disc { center: c.binormal.p, radius: if c.arms.is_empty() { 0.0 } else { c.radius } })
            .collect();
        f(&Tracer { sides: [&self.sides[0], &self.sides[1]], options: self.trace, discs: &discs })
    }

    /// Traces from the outer end of an arm.
    fn trace_arm(&mut self, contact: usize, arm: usize) {
        self.contacts[contact].arms[arm].used = true;
        let mut nodes = self.contacts[contact].arms[arm].nodes.clone();
        let Some(outer) = nodes.pop() else { return };
        let (points, end) = self.with_tracer(|tracer| {
            let plane = Condition::Plane { point: outer.p, direction: outer.tangent };
            let start = tracer.locate(Mode::Transversal, [outer.pa, outer.pb], outer.at, plane, outer.tangent);
            tracer.trace(Mode::Transversal, start.unwrap_or(outer))
        });
        nodes.extend(points);
        let start = ChainEnd { end: CurveEnd::Junction, contact: Some(contact) };
        self.finish(Mode::Transversal, nodes, start, end);
    }

    /// Closes a chain whose start is known with what its trace says about its end.
    fn finish(&mut self, mode: Mode, mut nodes: Vec<TraceNode>, start: ChainEnd, end: End) {
        let end = self.attach(&mut nodes, end);
        let closed = end.end == CurveEnd::Loop;
        let ends = if closed { [end, end] } else { [start, end] };
        self.keep(Chain { nodes, mode, ends });
    }

    /// Turns the end of a trace into the end of a chain; at a junction the arm's points are added.
    fn attach(&mut self, nodes: &mut Vec<TraceNode>, end: End) -> ChainEnd {
        let plain = |end| ChainEnd { end, contact: None };
        let Some(&last) = nodes.last() else { return plain(CurveEnd::Unresolved) };
        match end {
            End::Boundary => plain(CurveEnd::Boundary),
            End::Loop => plain(CurveEnd::Loop),
            End::Unresolved(reason) => {
                self.give_up([last.pa, last.pb], last.at, reason);
                plain(CurveEnd::Unresolved)
            }
            End::Junction(contact) => {
                let target = &mut self.contacts[contact];
                let radius = target.radius;
                let nearest = target
                    .arms
                    .iter_mut()
                    .filter(|arm| !arm.used)
                    .filter_map(|arm| arm.nodes.last().map(|n| n.p).map(|p| (p, arm)))
                    .min_by(|(p, _), (q, _)| p.distance(last.p).total_cmp(&q.distance(last.p)));
                // The last point lies outside the disc, at most a step away, and the arm continues it.
                let continues = |p: DVec3| {
                    let chord = p - last.p;
                    chord.length() < 1e-6 + 0.2 * radius || chord.normalize().dot(last.tangent) > 0.8
                };
                match nearest {
                    Some((p, arm)) if continues(p) => {
                        arm.used = true;
                        let inward = arm.nodes.iter().rev().map(|n| n.reversed());
                        nodes.extend(inward.filter(|n| n.p.distance(last.p) > 1e-12));
                        ChainEnd { end: CurveEnd::Junction, contact: Some(contact) }
                    }
                    _ => {
                        self.give_up([last.pa, last.pb], last.at, "a curve meets a junction where no arm is left");
                        plain(CurveEnd::Unresolved)
                    }
                }
            }
        }
    }

    fn keep(&mut self, chain: Chain) {
        let index = self.chains.len();
        for (k, pair) in chain.nodes.windows(2).enumerate() {
            if pair[0].same_pair(&pair[1]) {
                self.register.entry((pair[0].pa, pair[0].pb)).or_default().push((index, k));
                if on_border(&pair[0]) || on_border(&pair[1]) {
                    self.border_segments.push((index, k));
                }
            }
        }
        self.chains.push(chain);
    }

    /// Whether a point lies on a curve that was traced, or in the disc of a junction.
    fn known(&self, node: &TraceNode, mode: Mode) -> bool {
        if self.contacts.iter().any(|c| c.binormal.p.distance(node.p) < c.radius) {
            return true;
        }
        self.with_tracer(|tracer| {
            let on = |&(chain, k): &(usize, usize), least: f64| {
                let chain = &self.chains[chain];
                let (from, to) = (&chain.nodes[k], &chain.nodes[k + 1]);
                chain.mode == mode && tracer.passes(from, to, node, least)
            };
            let register = self.register.get(&(node.pa, node.pb));
            register.is_some_and(|segments| segments.iter().any(|s| on(s, 0.0)))
                // On a border the curve may run through other pieces than this seed's.
                || (on_border(node) && self.border_segments.iter().any(|s| on(s, SAME_ON_BORDER)))
        })
    }

    /// Traces both ways from a point that lies on no curve yet.
    fn trace_both(&mut self, mode: Mode, node: TraceNode) {
        if self.known(&node, mode) {
            return;
        }
        let (forward, end) = self.with_tracer(|tracer| tracer.trace(mode, node));
        if end == End::Loop {
            let start = ChainEnd { end: CurveEnd::Loop, contact: None };
            self.finish(mode, forward, start, end);
            return;
        }
        let (mut backward, start) = self.with_tracer(|tracer| tracer.trace(mode, node.reversed()));
        if start == End::Loop {
            self.finish(mode, backward, ChainEnd { end: CurveEnd::Loop, contact: None }, start);
            return;
        }
        let start = self.attach(&mut backward, start);
        let mut nodes: Vec<TraceNode> = backward.into_iter().rev().map(TraceNode::reversed).collect();
        if nodes.last().zip(forward.first()).is_some_and(|(x, y)| x.same_pair(y) && x.p == y.p) {
            nodes.pop();
        }
        nodes.extend(forward);
        // A corner that touches the other side is no curve.
        let touches = start.end == CurveEnd::Boundary && end == End::Boundary;
        if touches && nodes.iter().all(|n| n.p.distance(node.p) < SHORTEST) {
            return;
        }
        self.finish(mode, nodes, start, end);
    }

    fn inside(node: &TraceNode) -> bool {
        node.at.to_array().iter().all(|v| (-SLACK..=1.0 + SLACK).contains(v))
    }

    /// The point of a curve at a seed.
    fn located(&self, seed: &Seed) -> Option<TraceNode> {
        let ja = self.sides[0].pieces[seed.pa].jet1(seed.at.uv);
        let jb = self.sides[1].pieces[seed.pb].jet1(seed.at.st);
        let along = ja.cross().normalize_or_zero().cross(jb.cross().normalize_or_zero()).normalize_or_zero();
        self.with_tracer(|tracer| {
            let plane = Condition::Plane { point: ja.p, direction: along };
            let across = (0..4).map(|k| Condition::Fixed(k, seed.at.to_array()[k]));
            std::iter::once(plane)
                .chain(across)
                .filter_map(|c| tracer.locate(Mode::Transversal, [seed.pa, seed.pb], seed.at, c, along))
                .find(|n| n.p.distance(ja.p) < 1e-3)
        })
    }

    /// `coincident` is where the surfaces are one: no curve starts from there.
    fn trace_contact_seed(&mut self, seed: &Seed, coincident: &[Cell]) {
        let (a, b) = (&self.sides[0].pieces[seed.pa], &self.sides[1].pieces[seed.pb]);
        let p = a.point(seed.at.uv);
        // Beside a pole the fit knows the gap and the place on A well, but not the foot's parameters on B.
        let found = self.located(seed).or_else(|| {
            let (st, _) = closest(b, p)?;
            self.located(&Seed { at: PointPair { uv: seed.at.uv, st }, ..*seed })
        });
        match found {
            Some(node) if Self::inside(&node) => self.trace_both(Mode::Transversal, node),
            Some(_) => {}
            None => {
                let near = |c: &Contacted| c.binormal.p.distance(p) < c.radius.max(1e-6);
                if !self.contacts.iter().any(near) && !self.lies_in(coincident, p) {
                    self.give_up([seed.pa, seed.pb], seed.at, "a point of a curve could not be corrected");
                }
            }
        }
    }

    /// Whether a point of A lies in a cell.
    fn lies_in(&self, cells: &[Cell], p: DVec3) -> bool {
        let near = 4.0 * self.gap + 1e-13;
        cells.iter().any(|c| {
            if !self.sides[0].bounds[c.pa].grown(near).contains(p) {
                return false;
            }
            let (uv, distance) = closest_from(&self.sides[0].pieces[c.pa], p, c.middle.uv);
            let within = uv.cmpge(c.low - CELL_BORDER).all() && uv.cmple(c.high + CELL_BORDER).all();
            distance <= near && within
        })
    }

    fn trace_ridge(&mut self, seed: &Seed) {
        let found = self.with_tracer(|tracer| {
            let none = Condition::Fixed(0, 0.0); // the floor of a valley needs no further condition
            tracer.locate(Mode::Tangential, [seed.pa, seed.pb], seed.at, none, DVec3::X)
        });
        match found {
            Some(node) if Self::inside(&node) => {
                if self.known(&node, Mode::Tangential) {
                    return;
                }
                let (chains, unresolved) = (self.chains.len(), self.unresolved.len());
                self.trace_both(Mode::Tangential, node);
                // A short stretch that fades out at both ends is a flat contact.
                let Some(chain) = self.chains.get(chains) else { return };
                let faded = chain.ends.iter().all(|e| e.end == CurveEnd::Unresolved);
                let far = chain.nodes.iter().map(|n| n.p.distance(node.p)).fold(0.0, f64::max);
                let middle = chain.nodes[chain.nodes.len() / 2];
                if faded && far < 0.02 && self.flat_contact([middle.pa, middle.pb], middle.at, far) {
                    self.chains.truncate(chains);
                    self.unresolved.truncate(unresolved);
                    self.register.values_mut().for_each(|list| list.retain(|&(chain, _)| chain < chains));
                    self.border_segments.retain(|&(chain, _)| chain < chains);
                }
            }
            Some(_) => {}
            None => {
                let p = self.sides[0].pieces[seed.pa].point(seed.at.uv);
                if !self.contacts.iter().any(|c| c.binormal.p.distance(p) < c.radius.max(1e-6)) {
                    self.give_up([seed.pa, seed.pb], seed.at, "a point of contact could not be polished");
                }
            }
        }
    }

    /// Makes sure that the arc of a pair of nodes belongs to a curve.
    fn trace_arc(&mut self, arc: &ArcPair) {
        let (a, b) = (&self.trees[0].nodes[arc.a], &self.trees[1].nodes[arc.b]);
        let pair = [a.piece, b.piece];
        let visited = self.register.get(&(pair[0], pair[1])).is_some_and(|segments| {
            segments.iter().any(|&(chain, k)| {
                let at = self.chains[chain].nodes[k].at;
                at.uv.cmpge(a.low).all()
                    && at.uv.cmple(a.high).all()
                    && at.st.cmpge(b.low).all()
                    && at.st.cmple(b.high).all()
            })
        });
        if visited {
            return;
        }
        let local = |w: f64| {
            let x: [f64; 4] = std::array::from_fn(|k| arc.x0[k] + arc.tau[k] * w);
            PointPair { uv: a.local(DVec2::new(x[0], x[1])), st: b.local(DVec2::new(x[2], x[3])) }
        };
        let direction = (a.au * arc.tau[0] + a.av * arc.tau[1]).normalize_or_zero();
        let middle = 0.5 * (arc.range[0] + arc.range[1]);
        let low = [a.low.x, a.low.y, b.low.x, b.low.y];
        let high = [a.high.x, a.high.y, b.high.x, b.high.y];
        let seeds: Vec<TraceNode> = self.with_tracer(|tracer| {
            let at = local(middle);
            let point = self.sides[0].pieces[pair[0]].point(at.uv);
            let plane = Condition::Plane { point, direction };
            let first = tracer.locate(Mode::Transversal, pair, at, plane, direction).filter(Self::inside);
            if let Some(node) = first {
                return vec![node];
            }
            // The arc may enter the domain near a border only: look for it on every border of the pieces.
            let mut out = Vec::new();
            for k in 0..4 {
                for bound in [0.0, 1.0] {
                    if (bound == 0.0 && low[k] > 0.0) || (bound == 1.0 && high[k] < 1.0) || arc.tau[k].abs() < 1e-9 {
                        continue;
                    }
                    let x = if bound == 0.0 { -1.0 } else { 1.0 };
                    let w = ((x - arc.x0[k]) / arc.tau[k]).clamp(arc.range[0], arc.range[1]);
                    let node = tracer.locate(Mode::Transversal, pair, local(w), Condition::Fixed(k, bound), direction);
                    out.extend(node.filter(Self::inside));
                }
            }
            out
        });
        for seed in seeds {
            self.trace_both(Mode::Transversal, seed);
        }
    }

    /// Cells that no gap function decided, unless a junction explains them.
    fn settle_undecided(&mut self, cells: &[Cell]) {
        let mut open = Vec::new();
        for cell in cells {
            let piece = &self.sides[0].pieces[cell.pa];
            let p = piece.point(cell.middle.uv);
            let explained = self.contacts.iter().any(|c| c.binormal.p.distance(p) < c.radius);
            if !explained {
                let size = piece.point(cell.low).distance(p) + piece.point(cell.high).distance(p);
                let around = [cell.middle.st - 1e-4, cell.middle.st + 1e-4];
                let reason = "the contact is of higher order than can be told";
                open.push(Undecided {
                    entry: self.unresolved_at([cell.pa, cell.pb], [cell.low, cell.high], around, reason),
                    extent: size / self.frame.scale,
                });
            }
        }
        self.unresolved.extend(undecided::merged(open));
    }
}
