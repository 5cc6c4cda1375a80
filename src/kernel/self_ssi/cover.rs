//! The search with its certificate: every pair of cells is proved free of self-intersection, or is a window proved
//! injective, or a window around one miter point, or holds at most one solution for each value of one parameter and
//! that solution lies on a traced branch. What remains is listed.
//!
//! Descent: Algorithms 1 and 2 of the thesis (6.2) over the ternary split, lazily: a window proved injective drops
//! its subtree, a pair is dropped as soon as one test decides it ([`super::pair_test`]), whatever its level. Below the
//! grid, cells are halved.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::{DVec2, DVec3};

use super::coincidence::{COINCIDENCE_CELL, Coincidence, FINEST_COINCIDENCE, coincide};
use super::cusp::CuspEdge;
use super::hull::{Hull, Rect, range};
use super::march::Pace;
use super::miter::MiterPoint;
use super::pair_test::{Verdict, examine};
use super::record::{FailedWindow, NodeRole, NodeState, Record, TernaryNode, unsettled};
use super::register::Register;
use super::sheet::Sheet;
use super::ternary::{self, Span};
use super::touch::{Touch, Touches};
use super::windows::{Key, Windows, key};
use crate::kernel::job::Job;

/// The smallest box.
const SMALLEST: f64 = 1e-7;
/// With more unresolved boxes than this the search gives up.
const MANY_OPEN: usize = 1000;

/// A node of the ternary tree with its domain clipped, or a box below the grid.
#[derive(Clone, Copy, Debug)]
struct Part {
    rect: Rect,
    /// Node and clip, in cells.
    grid: Option<[[Span; 2]; 2]>,
}

/// Where a node stands in the tree, for the record.
#[derive(Clone, Copy, Debug)]
struct Visit {
    /// The number of splits above it.
    level: u32,
    role: NodeRole,
    /// Its parent's place in the record.
    parent: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Item {
    Alone(Part, Visit),
    Pair(Part, Part),
}

/// What the search found, beside the traces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cover {
    pub open: Vec<([Rect; 2], &'static str)>,
    pub coincident: Vec<Coincidence>,
    pub pairs: usize,
    pub leaf_pairs: usize,
    pub hulls: usize,
    pub capped: bool,
}

/// The state of one search.
pub(crate) struct Search<'a> {
    sheet: &'a Sheet,
    pace: Pace,
    cap: usize,
    job: &'a Job,
    /// Mean |Su| and |Sv| of the surface.
    speed: [f64; 2],
    /// Grid lines.
    pub lines: [Vec<f64>; 2],
    hulls: HashMap<Key, Rc<Hull>>,
    pub windows: Windows<'a>,
    /// Where sheets touch; `None`: such places stay open.
    pub touches: Option<Touches<'a>>,
    leaves: HashSet<(Key, Key)>,
    pub register: Register<'a>,
    /// What is visited, when it is asked for.
    pub record: Option<Record>,
    pub found: Cover,
}

impl<'a> Search<'a> {
    pub fn new(
        sheet: &'a Sheet,
        miters: &'a [MiterPoint],
        cusps: &'a [CuspEdge],
        grid: u32,
        pace: Pace,
        cap: usize,
        job: &'a Job,
    ) -> Self {
        // A multiple of 8 cells a piece, at least `grid` in all.
        let lines = [0, 1].map(|d| {
            let pieces = sheet.breaks[d].len() as u32 - 1;
            let cells = (grid.div_ceil(8 * pieces) * 8).max(8);
            let mut lines = vec![0.0];
            for b in sheet.breaks[d].windows(2) {
                lines.extend((1..cells).map(|k| b[0] + (b[1] - b[0]) * f64::from(k) / f64::from(cells)));
                lines.push(b[1]);
            }
            lines
        });
        let speed = [0, 1].map(|d| {
            let at = |k: i32| DVec2::new(f64::from(k % 8) + 0.5, f64::from(k / 8) + 0.5) / 8.0;
            (0..64).map(|k| sheet.jet(at(k), 1).d[d].length()).sum::<f64>() / 64.0
        });
        Self {
            speed,
            sheet,
            pace,
            cap,
            job,
            lines,
            hulls: HashMap::new(),
            windows: Windows::new(sheet, miters, cusps),
            touches: None,
            leaves: HashSet::new(),
            register: Register::new(sheet),
            record: None,
            found: Cover::default(),
        }
    }

    /// Runs the search over the whole domain.
    pub fn run(&mut self) {
        let whole = [0, 1].map(|d| Span::new(0, self.lines[d].len() as u32 - 1));
        let root = self.part(whole, whole);
        let mut stack: Vec<Item> =
            root.map(|r| Item::Alone(r, Visit { level: 0, role: NodeRole::Root, parent: None })).into_iter().collect();
        let mut steps = 0;
        while let Some(item) = stack.pop() {
            steps += 1;
            let crowded = self.found.open.len() > MANY_OPEN;
            if steps > self.cap || crowded || self.job.is_cancelled() {
                self.found.capped = true;
                let reason = if self.job.is_cancelled() {
                    "cancelled"
                } else if crowded {
                    "too much is unresolved already"
                } else {
                    "the cap on cell pairs was reached"
                };
                for item in stack.drain(..).chain([item]).take(64) {
                    let pair = match item {
                        Item::Alone(a, ..) => [a.rect; 2],
                        Item::Pair(a, b) => [a.rect, b.rect],
                    };
                    self.found.open.push((pair, reason));
                }
                break;
            }
            match item {
                Item::Alone(a, visit) => self.alone(a, visit, &mut stack),
                Item::Pair(a, b) => self.pair(a, b, &mut stack),
            }
        }
        if self.record.is_some() {
            self.record_windows();
        }
        self.found.hulls = self.hulls.len();
        self.found.open = merged(std::mem::take(&mut self.found.open));
    }

    /// The part of a node inside a clip; `None` when empty.
    fn part(&self, node: [Span; 2], clip: [Span; 2]) -> Option<Part> {
        let clip = [node[0].intersect(clip[0]), node[1].intersect(clip[1])];
        if clip[0].len() == 0 || clip[1].len() == 0 {
            return None;
        }
        let at = |d: usize, k: u32| self.lines[d][k as usize];
        let low = DVec2::new(at(0, clip[0].low), at(1, clip[1].low));
        let high = DVec2::new(at(0, clip[0].high), at(1, clip[1].high));
        let single = clip[0].len() == 1 && clip[1].len() == 1;
        Some(Part { rect: Rect::new(low, high), grid: (!single).then_some([node, clip]) })
    }

    fn hull(&mut self, rect: &Rect) -> Rc<Hull> {
        let sheet = self.sheet;
        Rc::clone(self.hulls.entry(key(rect)).or_insert_with(|| Rc::new(sheet.hull(rect))))
    }

    /// The direction in which to split: the longer one in space, or the one with more cells.
    fn direction(&mut self, part: &Part) -> usize {
        if let Some([node, _]) = part.grid {
            if node[0].len() < 2 {
                return 1;
            }
            if node[1].len() < 2 {
                return 0;
            }
        }
        let [u, v] = self.stretch(&part.rect);
        usize::from(v > u * (1.0 + 1e-9))
    }

    /// How long a rectangle is in space along u and v. Never much less than what the surface's mean speed makes of
    /// it: near a singular point lengths in space shrink, and cells must not become needles there.
    fn stretch(&mut self, rect: &Rect) -> [f64; 2] {
        let hull = self.hull(rect);
        let mean = |x: &[DVec3]| x.iter().map(|d| d.length()).sum::<f64>() / x.len().max(1) as f64;
        let size = rect.size();
        [mean(&hull.du).max(0.5 * self.speed[0]) * size.x, mean(&hull.dv).max(0.5 * self.speed[1]) * size.y]
    }

    /// S1, Sm, S2 and Sc of a part; for boxes the two halves.
    fn children(&mut self, part: &Part) -> ([Option<Part>; 3], Option<Part>) {
        let d = self.direction(part);
        if let Some([node, clip]) = part.grid {
            let s = ternary::split(node[d]);
            let child = |span: Span, within: Span| {
                let (mut n, mut c) = (node, clip);
                n[d] = span;
                c[d] = clip[d].intersect(within);
                self.part(n, c)
            };
            return (
                [child(s.first, s.first), child(s.middle, s.middle), child(s.last, s.last)],
                child(s.middle, s.core),
            );
        }
        let (mut low, mut high) = (part.rect, part.rect);
        low.high[d] = part.rect.center()[d];
        high.low[d] = low.high[d];
        let half = |rect| Some(Part { rect, grid: None });
        ([half(low), None, half(high)], None)
    }

    /// Algorithm 1.
    fn alone(&mut self, part: Part, visit: Visit, stack: &mut Vec<Item>) {
        let proved = self.windows.proved(&part.rect);
        let parent = self.record_node(&part, visit, proved);
        if proved {
            return;
        }
        if part.rect.size().max_element() < SMALLEST {
            let reason = self.windows.why_open(&part.rect);
            self.found
                .open
                .push(([part.rect; 2], reason.unwrap_or("a window could not be proved free of self-intersection")));
            return;
        }
        let ([first, middle, last], core) = self.children(&part);
        for (child, role) in [(first, NodeRole::First), (middle, NodeRole::Middle), (last, NodeRole::Last)] {
            stack.extend(child.map(|c| Item::Alone(c, Visit { level: visit.level + 1, role, parent })));
        }
        let mut pair = |a: Option<Part>, b: Option<Part>| {
            if let (Some(a), Some(b)) = (a, b) {
                stack.push(Item::Pair(a, b));
            }
        };
        pair(first, last);
        // S1 \ Sm and S2 \ Sm: clips that end where the middle node starts.
        let outside = |side: Option<Part>, middle: Option<Part>, before: bool| {
            let (Some(side), Some(middle)) = (side, middle) else { return side };
            let (Some([node, mut clip]), Some(d)) = (side.grid, differing(&side.rect, &middle.rect)) else {
                return Some(side);
            };
            let line = |x: f64| self.lines[d].partition_point(|&l| l < x - 1e-15) as u32;
            if before {
                clip[d].high = clip[d].high.min(line(middle.rect.low[d]));
            } else {
                clip[d].low = clip[d].low.max(line(middle.rect.high[d]));
            }
            self.part(node, clip)
        };
        pair(outside(first, middle, true), core);
        pair(outside(last, middle, false), core);
    }

    /// Notes a node that was visited; the answer is its place in the record.
    fn record_node(&mut self, part: &Part, visit: Visit, proved: bool) -> Option<usize> {
        self.record.as_ref()?;
        let lines = &self.lines;
        let cell = |d: usize, x: f64| lines[d].partition_point(|&l| l < x) as u32;
        let on_grid = |x: DVec2| (0..2).all(|d| lines[d].get(cell(d, x[d]) as usize) == Some(&x[d]));
        let cells = (on_grid(part.rect.low) && on_grid(part.rect.high))
            .then(|| [0, 1].map(|d| [cell(d, part.rect.low[d]), cell(d, part.rect.high[d])]));
        let state = if proved { self.windows.state(&part.rect) } else { NodeState::Split };
        let Visit { level, role, parent } = visit;
        let record = self.record.as_mut()?;
        record.nodes.push(TernaryNode { level, uv_box: self.sheet.in_surface(&part.rect), cells, role, state, parent });
        Some(record.nodes.len() - 1)
    }

    /// Tests the windows of 2 x 2 and 3 x 3 cells that no proved node contains.
    fn record_windows(&mut self) {
        let Some(record) = &self.record else { return };
        let settled: Vec<[Span; 2]> = record
            .nodes
            .iter()
            .filter(|n| n.state != NodeState::Split)
            .filter_map(|n| n.cells)
            .map(|c| c.map(|[low, high]| Span::new(low, high)))
            .collect();
        let cells = [0, 1].map(|d| self.lines[d].len() as u32 - 1);
        let mut failed = Vec::new();
        for size in [2, 3] {
            for first in unsettled(cells, size, &settled) {
                if self.job.is_cancelled() {
                    return;
                }
                let at = |d: usize, k: u32| self.lines[d][k as usize];
                let rect = Rect::new(
                    DVec2::new(at(0, first[0]), at(1, first[1])),
                    DVec2::new(at(0, first[0] + size), at(1, first[1] + size)),
                );
                if !self.windows.proved(&rect) {
                    failed.push(FailedWindow { size, first, uv_box: self.sheet.in_surface(&rect) });
                }
            }
        }
        let lines = [0, 1]
            .map(|d| self.lines[d].iter().map(|&t| self.sheet.to_surface(DVec2::splat(t))[d]).collect::<Vec<f64>>());
        if let Some(record) = &mut self.record {
            record.windows = failed;
            record.lines = lines;
        }
    }

    /// Algorithm 2.
    fn pair(&mut self, a: Part, b: Part, stack: &mut Vec<Item>) {
        self.found.pairs += 1;
        let (ha, hb) = (self.hull(&a.rect), self.hull(&b.rect));
        let (mut touching, mut windowed) = (false, false);
        for shift in self.sheet.images(DVec2::ZERO).collect::<Vec<_>>() {
            let other = b.rect.shifted(shift);
            let gap = (other.low - a.rect.high).max(a.rect.low - other.high).max(DVec2::ZERO);
            let size = a.rect.size().max(other.size());
            if gap == DVec2::ZERO {
                touching = true;
            }
            if gap.cmple(size * 0.8).all() && self.windows.proved(&a.rect.union(&other)) {
                windowed = true;
            }
        }
        if windowed || (!touching && apart(&ha, &hb)) || self.apart_at_pole(&a.rect, &b.rect) {
            return;
        }
        let size = a.rect.size().max_element().max(b.rect.size().max_element());
        if let (false, Some(pa), Some(pb)) =
            (touching, self.sheet.single_piece(&a.rect), self.sheet.single_piece(&b.rect))
        {
            if self.touches.as_ref().is_some_and(|t| t.known(&a.rect, &b.rect) != Touch::No) {
                return;
            }
            if a.grid.is_none() && b.grid.is_none() && self.leaves.insert((key(&a.rect), key(&b.rect))) {
                self.found.leaf_pairs += 1;
                if let Some(record) = &mut self.record {
                    record.leaf_pairs.push([self.sheet.in_surface(&a.rect), self.sheet.in_surface(&b.rect)]);
                }
            }
            match examine(self.sheet, &mut self.register, &self.pace, self.job, [(&a.rect, pa), (&b.rect, pb)]) {
                Verdict::Empty | Verdict::Covered => return,
                Verdict::Split => {}
            }
            let job = self.job;
            if self.touches.as_mut().is_some_and(|t| t.look([(&a.rect, pa), (&b.rect, pb)], job) != Touch::No) {
                return;
            }
        }
        if (FINEST_COINCIDENCE..COINCIDENCE_CELL).contains(&size)
            && let (Some(pa), Some(pb)) = (self.sheet.single_piece(&a.rect), self.sheet.single_piece(&b.rect))
            && let Some(met) = coincide(self.sheet, (&a.rect, pa), (&b.rect, pb))
        {
            if met {
                self.found.coincident.push(Coincidence { a: a.rect, b: b.rect });
            }
            return;
        }
        if size < SMALLEST {
            let reason = self.windows.why_open(&a.rect).or_else(|| self.windows.why_open(&b.rect));
            let reason = reason.unwrap_or("two sheets come so near here that whether they meet could not be decided");
            self.found.open.push(([a.rect, b.rect], reason));
            return;
        }
        let longest = |[u, v]: [f64; 2]| u.max(v);
        let (large, small) =
            if longest(self.stretch(&a.rect)) >= longest(self.stretch(&b.rect)) { (a, b) } else { (b, a) };
        let ([first, middle, last], core) = self.children(&large);
        let inner = if large.grid.is_some() { core } else { middle };
        stack.extend([first, inner, last].into_iter().flatten().map(|child| Item::Pair(child, small)));
    }

    /// Whether two cells at the same pole meet in it only: their cones seen from the pole lie on two sides of a plane.
    fn apart_at_pole(&self, a: &Rect, b: &Rect) -> bool {
        let Some(pole) = self.sheet.pole_at(a).filter(|p| self.sheet.pole_at(b) == Some(*p)) else { return false };
        let (ta, tb) = (self.sheet.polar(a, pole).t, self.sheet.polar(b, pole).t);
        let mean = |x: &[DVec3]| (x.iter().sum::<DVec3>()).normalize_or_zero();
        let y = mean(&ta) - mean(&tb);
        let (ra, rb) = (range(y, &ta), range(y, &tb));
        ra[0] > 1e-12 * ra[1] && rb[1] < 1e-12 * rb[0]
    }
}

/// Open pairs that touch in both domains as one, so that one trouble is one entry.
pub(crate) fn merged(open: Vec<([Rect; 2], &'static str)>) -> Vec<([Rect; 2], &'static str)> {
    let touch = |a: &Rect, b: &Rect| {
        let slack = (a.size().max(b.size())) * 0.5;
        (a.low - slack).cmple(b.high).all() && (b.low - slack).cmple(a.high).all()
    };
    let mut out: Vec<([Rect; 2], &'static str)> = Vec::new();
    for (pair, reason) in open {
        let found = out.iter_mut().find(|(o, r)| *r == reason && touch(&o[0], &pair[0]) && touch(&o[1], &pair[1]));
        match found {
            Some((o, _)) => *o = [o[0].union(&pair[0]), o[1].union(&pair[1])],
            None => out.push((pair, reason)),
        }
    }
    out
}

/// The direction in which two rectangles of the same parent differ.
fn differing(a: &Rect, b: &Rect) -> Option<usize> {
    (0..2).find(|&d| a.low[d] != b.low[d] || a.high[d] != b.high[d])
}

/// Whether a plane separates the hulls: across the axes, both normals, and the line between the middles.
fn apart(a: &Hull, b: &Hull) -> bool {
    let mean = |x: &[DVec3]| x.iter().sum::<DVec3>() / x.len().max(1) as f64;
    let normal = |h: &Hull| mean(&h.du).cross(mean(&h.dv));
    let (na, nb) = (normal(a), normal(b));
    let between = mean(&b.pos) - mean(&a.pos);
    [between, DVec3::X, DVec3::Y, DVec3::Z, na, nb, na.cross(nb)].into_iter().any(|y| {
        let y = y.normalize_or_zero();
        let (ra, rb) = (range(y, &a.pos), range(y, &b.pos));
        ra[1] + 1e-14 < rb[0] || rb[1] + 1e-14 < ra[0]
    })
}
