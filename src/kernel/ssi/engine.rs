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

use super::contact::{Cell, SLACK, Seed};
use super::correct::{Condition, PointPair};
use super::junction::Contacted;
use super::node::{TraceNode, on_border};
use super::options::{Lengths, SsiError, SsiOptions};
use super::output;
use super::piece::Patch;
use super::poles;
use super::region::{self, CoincidentRegion};
use super::repeated;
use super::result::{Counts, CurveEnd, Intersection, Times, Unresolved};
use super::side::{Frame, Side, closest, closest_from};
use super::trace::{Disc, End, Mode, TraceOptions, Tracer};
use super::traverse::{ArcPair, Traversal, traverse};
use super::tree::Tree;
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;

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
        self.find_pole_contacts();
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
        if self.in_contact(node.p) {
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
}
