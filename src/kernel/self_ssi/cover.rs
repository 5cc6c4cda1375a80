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

use super::cusp::{CuspEdge, CuspWindow, cusp_window};
use super::degenerate;
use super::hull::{Hull, Rect, range};
use super::march::{Pace, turns};
use super::miter::{MiterKind, MiterPoint};
use super::pair_test::{Verdict, examine};
use super::record::{FailedWindow, NodeRole, NodeState, Record, TernaryNode, unsettled};
use super::register::Register;
use super::sheet::Sheet;
use super::ternary::{self, Span};
use super::window::{cross_cap, injective};
use crate::kernel::job::Job;

/// The smallest box.
const SMALLEST: f64 = 1e-7;
/// With more unresolved boxes than this the search gives up.
const MANY_OPEN: usize = 1000;
/// Coincidence is looked for in boxes between these sizes: in smaller ones being close proves nothing.
const COINCIDENCE_CELL: f64 = 1.0 / 24.0;
const FINEST_COINCIDENCE: f64 = 1.0 / 1024.0;

/// A node of the ternary tree with its domain clipped, or a box below the grid.
#[derive(Clone, Copy, Debug)]
struct Part {
    rect: Rect,
    /// Node and clip, in cells.
    grid: Option<[[Span; 2]; 2]>,
}

#[derive(Clone, Copy, Debug)]
enum Item {
    /// With the number of splits above it and its role.
    Alone(Part, u32, NodeRole),
    Pair(Part, Part),
}

/// Two cells that coincide over an area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coincidence {
    pub a: Rect,
    pub b: Rect,
}

impl Coincidence {
    pub fn swapped(self) -> Self {
        Self { a: self.b, b: self.a }
    }
}

/// What the search found, beside the traces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cover {
    pub open: Vec<([Rect; 2], &'static str)>,
    pub coincident: Vec<Coincidence>,
    /// Windows folded onto themselves along the cusp edge with this number.
    pub folds: Vec<(usize, Rect)>,
    /// Windows that were tested and not proved injective.
    pub failed_windows: usize,
    pub windows: usize,
    pub pairs: usize,
    pub leaf_pairs: usize,
    pub hulls: usize,
    pub capped: bool,
}

type Key = [u64; 4];

fn key(rect: &Rect) -> Key {
    [rect.low.x, rect.low.y, rect.high.x, rect.high.y].map(f64::to_bits)
}

/// The state of one search.
pub(crate) struct Search<'a> {
    sheet: &'a Sheet,
    miters: &'a [MiterPoint],
    cusps: &'a [CuspEdge],
    pace: Pace,
    cap: usize,
    job: &'a Job,
    /// Mean |Su| and |Sv| of the surface.
    speed: [f64; 2],
    /// Grid lines.
    pub lines: [Vec<f64>; 2],
    hulls: HashMap<Key, Rc<Hull>>,
    injective: HashMap<Key, bool>,
    capped_window: HashMap<Key, bool>,
    cusp_window: HashMap<Key, Option<CuspWindow>>,
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
            miters,
            cusps,
            pace,
            cap,
            job,
            lines,
            hulls: HashMap::new(),
            injective: HashMap::new(),
            capped_window: HashMap::new(),
            cusp_window: HashMap::new(),
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
        let mut stack: Vec<Item> = root.map(|r| Item::Alone(r, 0, NodeRole::Root)).into_iter().collect();
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
                Item::Alone(a, level, role) => self.alone(a, level, role, &mut stack),
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
    fn alone(&mut self, part: Part, level: u32, role: NodeRole, stack: &mut Vec<Item>) {
        let proved = self.window(&part.rect);
        self.record_node(&part, level, role, proved);
        if proved {
            return;
        }
        if part.rect.size().max_element() < SMALLEST {
            self.found.open.push(([part.rect; 2], "a window could not be proved free of self-intersection"));
            return;
        }
        let ([first, middle, last], core) = self.children(&part);
        for (child, role) in [(first, NodeRole::First), (middle, NodeRole::Middle), (last, NodeRole::Last)] {
            stack.extend(child.map(|c| Item::Alone(c, level + 1, role)));
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

    /// Notes a node that was visited.
    fn record_node(&mut self, part: &Part, level: u32, role: NodeRole, proved: bool) {
        let injective = self.injective.get(&key(&part.rect)).copied().unwrap_or(false);
        if self.record.is_none() {
            return;
        }
        let lines = &self.lines;
        let cell = |d: usize, x: f64| lines[d].partition_point(|&l| l < x) as u32;
        let on_grid = |x: DVec2| (0..2).all(|d| lines[d].get(cell(d, x[d]) as usize) == Some(&x[d]));
        let cells = (on_grid(part.rect.low) && on_grid(part.rect.high))
            .then(|| [0, 1].map(|d| [cell(d, part.rect.low[d]), cell(d, part.rect.high[d])]));
        let at_cusp = self.cusp_window.get(&key(&part.rect)).is_some_and(Option::is_some);
        let state = match (proved, injective) {
            (_, true) => NodeState::Injective,
            (true, false) if at_cusp => NodeState::CuspEdge,
            (true, false) => NodeState::MiterPoint,
            (false, false) => NodeState::Split,
        };
        let Some(record) = &mut self.record else { return };
        record.nodes.push(TernaryNode { level, uv_box: self.sheet.in_surface(&part.rect), cells, role, state });
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
                if !self.window(&rect) {
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

    /// Whether a window is proved injective, or to hold one miter point's branch only.
    fn window(&mut self, rect: &Rect) -> bool {
        let k = key(rect);
        let proved = match self.injective.get(&k) {
            Some(&known) => known,
            None => {
                self.found.windows += 1;
                let proved = injective(&self.sheet.window_frames(rect));
                self.injective.insert(k, proved);
                if !proved {
                    self.found.failed_windows += 1;
                }
                proved
            }
        };
        proved || self.miter_window(rect) || self.window_at_cusp(rect)
    }

    /// Whether the window, grown to three times its size, holds exactly one miter point and only its branch.
    fn miter_window(&mut self, rect: &Rect) -> bool {
        if let Some(&known) = self.capped_window.get(&key(rect)) {
            return known;
        }
        let around = rect.grown(1.0);
        let mut inside = self
            .miters
            .iter()
            .flat_map(|m| self.images(m.at).map(move |at| (at, m)))
            .filter(|(at, _)| around.contains(*at));
        let only = inside.next();
        let proved = match (only, inside.next()) {
            (Some((_, m)), None) if m.kind == MiterKind::CrossCap => {
                cross_cap(&around, &self.sheet.jets(&around), m.null(), m.first, m.second)
            }
            (Some((at, m)), None) => {
                // A copy across a seam: the window moves to the point itself.
                degenerate::settled(self.sheet, &rect.shifted(m.at - at), m)
            }
            _ => false,
        };
        self.capped_window.insert(key(rect), proved);
        proved
    }

    /// A point of the domain and its copies across seams.
    fn images(&self, at: DVec2) -> impl Iterator<Item = DVec2> + use<> {
        let turns = |d: usize| if self.sheet.periodic[d] { -1..=1 } else { 0..=0 };
        let (us, vs) = (turns(0), turns(1));
        us.flat_map(move |i| vs.clone().map(move |j| at + DVec2::new(f64::from(i), f64::from(j))))
    }

    /// Whether the window holds a cusp edge and nothing else; folds are noted.
    fn window_at_cusp(&mut self, rect: &Rect) -> bool {
        if self.cusps.is_empty() {
            return false;
        }
        let known = self.cusp_window.get(&key(rect)).copied();
        let found = known.unwrap_or_else(|| {
            let found = cusp_window(self.sheet, self.cusps, rect);
            self.cusp_window.insert(key(rect), found);
            if let Some(CuspWindow::Folded(edge)) = found {
                self.found.folds.push((edge, *rect));
            }
            found
        });
        found.is_some()
    }

    /// Algorithm 2.
    fn pair(&mut self, a: Part, b: Part, stack: &mut Vec<Item>) {
        self.found.pairs += 1;
        let (ha, hb) = (self.hull(&a.rect), self.hull(&b.rect));
        let (mut touching, mut windowed) = (false, false);
        for shift in self.images(DVec2::ZERO).collect::<Vec<_>>() {
            let other = b.rect.shifted(shift);
            let gap = (other.low - a.rect.high).max(a.rect.low - other.high).max(DVec2::ZERO);
            let size = a.rect.size().max(other.size());
            if gap == DVec2::ZERO {
                touching = true;
            }
            if gap.cmple(size * 0.8).all() && self.window(&a.rect.union(&other)) {
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
        }
        if (FINEST_COINCIDENCE..COINCIDENCE_CELL).contains(&size)
            && let (Some(pa), Some(pb)) = (self.sheet.single_piece(&a.rect), self.sheet.single_piece(&b.rect))
            && let Some(met) = self.coincide(&a.rect, pa, &b.rect, pb)
        {
            if met {
                self.found.coincident.push(Coincidence { a: a.rect, b: b.rect });
            }
            return;
        }
        if size < SMALLEST {
            self.found.open.push(([a.rect, b.rect], "the surface may touch itself here"));
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

    /// Whether two boxes coincide over an area: `None` when they do not, otherwise whether points of one have their
    /// partners in the other. A piece that continues as its neighbour meets the same points, not others: seen in the
    /// middle, since on a seam both are one point anyway.
    fn coincide(&self, a: &Rect, pa: usize, b: &Rect, pb: usize) -> Option<bool> {
        let gap = 1e-11_f64.max(4.0 * self.sheet.rounding);
        let mut met = false;
        for k in 0..9 {
            let p = a.low + a.size() * DVec2::new(f64::from(k % 3) * 0.5, f64::from(k / 3) * 0.5);
            let s = self.sheet.jet_on(pa, p, 0).s;
            let (q, distance) = foot(self.sheet, pb, b.center(), s)?;
            if distance > gap
                || !b.grown(1.5).contains(q)
                || (k == 4 && (p - q - turns(self.sheet, p, q)).length() < 1e-3 * a.size().max_element())
            {
                return None;
            }
            met |= b.grown(1e-9).contains(q);
        }
        Some(met)
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

/// The closest point of a (continued) piece, by Gauss-Newton from a start.
pub(crate) fn foot(sheet: &Sheet, piece: usize, from: DVec2, s: DVec3) -> Option<(DVec2, f64)> {
    let mut q = from;
    for _ in 0..20 {
        let jet = sheet.jet_on(piece, q, 1);
        let r = s - jet.s;
        let (e, f, g) = (jet.d[0].length_squared(), jet.d[0].dot(jet.d[1]), jet.d[1].length_squared());
        let det = e * g - f * f;
        if det.is_nan() || det <= 1e-14 * e * g {
            return None;
        }
        let (x, y) = (jet.d[0].dot(r), jet.d[1].dot(r));
        let d = DVec2::new(g * x - f * y, e * y - f * x) / det;
        q += d;
        if !q.is_finite() || q.distance(from) > 1.0 {
            return None;
        }
        if d.length() < 1e-14 {
            break;
        }
    }
    Some((q, sheet.jet_on(piece, q, 0).s.distance(s)))
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
