//! The search with its certificate: every pair of cells is proved free of self-intersection, or is a window proved
//! injective, or a window around one miter point, or holds at most one solution for each value of one parameter and
//! that solution lies on a traced branch. What remains is listed.
//!
//! Descent: Algorithms 1 and 2 of the thesis (6.2) over the ternary split, lazily: a window proved injective drops
//! its subtree, a pair is dropped as soon as one test decides it, whatever its level. Below the grid, cells are halved.
//! The pair test: with the parameter x4 along which the solution curve runs fastest, the other three columns of the
//! Jacobian, preconditioned at the middle, are bounded over a box 3.25 times as large (on the piece, continued). Where
//! I - E is an M-matrix there is at most one solution for each x4 in the large box; the slopes (I - E)^-1 |Y c4| bound
//! how far the solution curve moves, so that a curve that meets the small box runs through the large one over the
//! whole range of x4, and Newton at any x4 finds it. No certificate rests on what Newton fails to find.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use glam::{DMat3, DVec2, DVec3};

use super::hull::{Hull, Rect, range};
use super::march::{self, Pace, Trace};
use super::miter::{MiterKind, MiterPoint};
use super::sheet::Sheet;
use super::ternary::{self, Span};
use super::window::{contracts, cross_cap, injective};
use crate::kernel::job::Job;

/// How much larger than the box the box of the pair test is.
const GROWTH: f64 = 3.25;
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
    Alone(Part),
    Pair(Part, Part),
}

/// Two cells that coincide over an area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coincidence {
    pub a: Rect,
    pub b: Rect,
}

/// What the search found, beside the traces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cover {
    pub open: Vec<([Rect; 2], &'static str)>,
    pub coincident: Vec<Coincidence>,
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
    cusps: &'a [Vec<DVec2>],
    pace: Pace,
    cap: usize,
    job: &'a Job,
    /// Mean |Su| and |Sv| of the surface.
    speed: [f64; 2],
    /// Grid lines.
    lines: [Vec<f64>; 2],
    hulls: HashMap<Key, Rc<Hull>>,
    injective: HashMap<Key, bool>,
    capped_window: HashMap<Key, bool>,
    leaves: HashSet<(Key, Key)>,
    pub traces: Vec<Trace>,
    boxes: Vec<Vec<[[f64; 4]; 2]>>,
    pub found: Cover,
}

enum Verdict {
    Empty,
    Covered,
    Split,
}

impl<'a> Search<'a> {
    pub fn new(
        sheet: &'a Sheet,
        miters: &'a [MiterPoint],
        cusps: &'a [Vec<DVec2>],
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
            leaves: HashSet::new(),
            traces: Vec::new(),
            boxes: Vec::new(),
            found: Cover::default(),
        }
    }

    /// Adds a branch that was traced.
    pub fn register(&mut self, trace: Trace) {
        let boxes = trace
            .nodes
            .windows(2)
            .collect::<Vec<_>>()
            .chunks(16)
            .map(|chunk| {
                let mut b = [[f64::INFINITY; 4], [f64::NEG_INFINITY; 4]];
                for pair in chunk {
                    for [p, q] in *pair {
                        for (k, x) in [p.x, p.y, q.x, q.y].into_iter().enumerate() {
                            b[0][k] = b[0][k].min(x);
                            b[1][k] = b[1][k].max(x);
                        }
                    }
                }
                for k in 0..4 {
                    let slack = 0.1 * (b[1][k] - b[0][k]) + 1e-7;
                    b[0][k] -= slack;
                    b[1][k] += slack;
                }
                b
            })
            .collect();
        self.boxes.push(boxes);
        self.traces.push(trace);
    }

    /// Runs the search over the whole domain.
    pub fn run(&mut self) {
        let whole = [0, 1].map(|d| Span::new(0, self.lines[d].len() as u32 - 1));
        let root = self.part(whole, whole);
        let mut stack: Vec<Item> = root.map(Item::Alone).into_iter().collect();
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
                        Item::Alone(a) => [a.rect; 2],
                        Item::Pair(a, b) => [a.rect, b.rect],
                    };
                    self.found.open.push((pair, reason));
                }
                break;
            }
            match item {
                Item::Alone(a) => self.alone(a, &mut stack),
                Item::Pair(a, b) => self.pair(a, b, &mut stack),
            }
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
    fn alone(&mut self, part: Part, stack: &mut Vec<Item>) {
        if self.window(&part.rect) {
            return;
        }
        if part.rect.size().max_element() < SMALLEST || self.in_cusp_strip(&part.rect, &part.rect) {
            if !self.in_cusp_strip(&part.rect, &part.rect) {
                self.found.open.push(([part.rect; 2], "a window could not be proved free of self-intersection"));
            }
            return;
        }
        let ([first, middle, last], core) = self.children(&part);
        stack.extend([first, middle, last].into_iter().flatten().map(Item::Alone));
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
        proved || self.miter_window(rect)
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

    /// Whether both boxes are small and lie beside the same cusp edge, which is reported instead.
    fn in_cusp_strip(&self, a: &Rect, b: &Rect) -> bool {
        const STRIP: f64 = 1.0 / 128.0;
        if self.cusps.is_empty() || a.size().max_element().max(b.size().max_element()) > STRIP {
            return false;
        }
        let near = |r: &Rect| {
            let grown = Rect::new(r.low - STRIP, r.high + STRIP);
            self.cusps.iter().flatten().any(|&c| grown.contains(c))
        };
        near(a) && near(b) && a.center().distance(b.center()) < 6.0 * STRIP
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
            }
            match self.examine(&a.rect, pa, &b.rect, pb) {
                Verdict::Empty | Verdict::Covered => return,
                Verdict::Split => {}
            }
        }
        if self.in_cusp_strip(&a.rect, &b.rect) {
            return;
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

    /// The pair test. See the module's text.
    fn examine(&mut self, a: &Rect, pa: usize, b: &Rect, pb: usize) -> Verdict {
        let sheet = self.sheet;
        let (half_a, half_b) = (a.size() * 0.5, b.size() * 0.5);
        let half = [half_a.x, half_a.y, half_b.x, half_b.y];
        let center = [a.center().x, a.center().y, b.center().x, b.center().y];
        let (ja, jb) = (sheet.jet_on(pa, a.center(), 1), sheet.jet_on(pb, b.center(), 1));
        let columns = [ja.d[0] * half[0], ja.d[1] * half[1], -jb.d[0] * half[2], -jb.d[1] * half[3]];
        let Some(t) = march::tangent(&super::chart::Value { f: DVec3::ZERO, j: columns }) else {
            return Verdict::Split;
        };
        let k = (0..4).fold(0, |best, k| if t[k].abs() > t[best].abs() { k } else { best });
        let others: Vec<usize> = (0..4).filter(|&j| j != k).collect();
        let frame = DMat3::from_cols(columns[others[0]], columns[others[1]], columns[others[2]]);
        let inverse = frame.inverse();
        if !inverse.is_finite() {
            return Verdict::Split;
        }
        let step = inverse * (ja.s - jb.s);
        // A cheap look first: at the middle the curve is far out of reach of any box that could pass.
        let grow = (GROWTH - 1.0) * 0.5;
        let (ga, gb) = (sheet.hull_on(pa, &a.grown(grow)), sheet.hull_on(pb, &b.grown(grow)));
        let mut error = [[0.0; 3]; 3];
        let mut drift = [0.0; 3];
        for i in 0..3 {
            let y = inverse.row(i);
            let of = |c: usize| {
                let points = [&ga.du, &ga.dv, &gb.du, &gb.dv][c];
                let [low, high] = range(y, points);
                let s = half[c] * if c < 2 { 1.0 } else { -1.0 };
                if s >= 0.0 { [low * s, high * s] } else { [high * s, low * s] }
            };
            for (j, &c) in others.iter().enumerate() {
                let unit = if i == j { 1.0 } else { 0.0 };
                let [low, high] = of(c);
                error[i][j] = (high - unit).abs().max((low - unit).abs());
            }
            let [low, high] = of(k);
            drift[i] = low.abs().max(high.abs());
        }
        if (0..3).any(|i| step[i].abs() > 1.0 + error[i].iter().sum::<f64>() + drift[i]) {
            return Verdict::Empty;
        }
        if !contracts(&error) {
            return Verdict::Split;
        }
        let rest = DMat3::IDENTITY
            - DMat3::from_cols(
                DVec3::new(error[0][0], error[1][0], error[2][0]),
                DVec3::new(error[0][1], error[1][1], error[2][1]),
                DVec3::new(error[0][2], error[1][2], error[2][2]),
            );
        let slope = rest.inverse() * DVec3::from(drift);
        if !slope.is_finite() || slope.max_element() * 2.0 + 1.0 > GROWTH {
            return Verdict::Split;
        }
        let at = |x4: f64| -> Option<[f64; 4]> { solve_at(sheet, [pa, pb], center, half, k, x4, step, &others) };
        let Some(z) = at(0.0) else { return Verdict::Split };
        for (i, &c) in others.iter().enumerate() {
            let offset = (z[c] - center[c]).abs() / half[c];
            if offset > 1.0 + slope[i] {
                // Newton in a box with one solution at most: outside the reach of the small box, so none meets it.
                return if offset < GROWTH { Verdict::Empty } else { Verdict::Split };
            }
        }
        let mut reach = [1.0; 4];
        for (i, &c) in others.iter().enumerate() {
            reach[c] = slope[i];
        }
        let limits = [sheet.pieces[pa].low, sheet.pieces[pa].high, sheet.pieces[pb].low, sheet.pieces[pb].high];
        let mut open = vec![(-1.0, 1.0, 0)];
        let mut settled = true;
        while let Some((from, to, depth)) = open.pop() {
            let Some(z) = at(0.5 * (from + to)) else {
                settled = false;
                break;
            };
            let width: f64 = 0.5 * (to - from);
            let (mut least, mut outside, mut sure) = (f64::INFINITY, false, true);
            for c in 0..4 {
                let (low, high) =
                    if c < 2 { (limits[0][c], limits[1][c]) } else { (limits[2][c - 2], limits[3][c - 2]) };
                let margin = (z[c] - low).min(high - z[c]);
                least = least.min(margin);
                outside |= margin < -(reach[c] * width * half[c]) - 1e-9;
                sure &= margin >= reach[c] * width * half[c];
            }
            if outside {
                continue;
            }
            let inside = least >= -1e-9;
            if inside && !self.traced(z) {
                let (p, q) = (DVec2::new(z[0], z[1]), DVec2::new(z[2], z[3]));
                match march::through(sheet, p, q, &self.pace, self.job) {
                    Some(trace) => self.register(trace),
                    None => {
                        settled = false;
                        break;
                    }
                }
                if !self.traced(z) {
                    settled = false;
                    break;
                }
            }
            if !sure && depth < if inside { 3 } else { 8 } {
                let middle = 0.5 * (from + to);
                open.push((from, middle, depth + 1));
                open.push((middle, to, depth + 1));
            }
        }
        if settled { Verdict::Covered } else { Verdict::Split }
    }

    /// Whether a solution lies on a traced branch.
    fn traced(&self, z: [f64; 4]) -> bool {
        let (p, q) = (DVec2::new(z[0], z[1]), DVec2::new(z[2], z[3]));
        for (trace, boxes) in self.traces.iter().zip(&self.boxes) {
            for (at, b) in boxes.iter().enumerate() {
                for pair in [[p, q], [q, p]] {
                    // Traces run on across seams: bring the pair to the turn of this stretch.
                    let middle = DVec2::new(b[0][0] + b[1][0], b[0][1] + b[1][1]) * 0.5;
                    let other = DVec2::new(b[0][2] + b[1][2], b[0][3] + b[1][3]) * 0.5;
                    let pair = [
                        pair[0] + march::turns(self.sheet, middle, pair[0]),
                        pair[1] + march::turns(self.sheet, other, pair[1]),
                    ];
                    let y = [pair[0].x, pair[0].y, pair[1].x, pair[1].y];
                    if (0..4).any(|k| y[k] < b[0][k] || y[k] > b[1][k]) {
                        continue;
                    }
                    let last = (at * 16 + 16).min(trace.nodes.len() - 1);
                    if trace.nodes[at * 16..=last].windows(2).any(|s| self.on_segment(pair, s[0], s[1])) {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Whether a solution lies on the branch between two of its nodes.
    fn on_segment(&self, y: [DVec2; 2], a: [DVec2; 2], b: [DVec2; 2]) -> bool {
        let along = [b[0] - a[0], b[1] - a[1]];
        let to = [y[0] - a[0], y[1] - a[1]];
        let dot = |a: [DVec2; 2], b: [DVec2; 2]| a[0].dot(b[0]) + a[1].dot(b[1]);
        let squared = dot(along, along);
        if squared <= 0.0 {
            return dot(to, to) < 1e-16;
        }
        let at = dot(to, along) / squared;
        if !(-0.05..=1.05).contains(&at) {
            return false;
        }
        let off = [to[0] - along[0] * at, to[1] - along[1] * at];
        let distance = dot(off, off);
        if distance < 1e-18 {
            return true;
        }
        if distance > 0.05 * squared + 1e-16 {
            return false;
        }
        // The branch point with the same projection on the chord decides.
        let [p, q] = [a[0] + along[0] * at, a[1] + along[1] * at];
        let row = [along[0].x, along[0].y, along[1].x, along[1].y].map(|x| x / squared.sqrt());
        let chart = super::chart::Chart::Far([p.x, p.y, q.x, q.y]);
        match march::correct(self.sheet, chart, &row, 0.5 * squared.sqrt() + 1e-7) {
            Some((c, _)) => {
                let [p, q] = c.points();
                p.distance(y[0]) + q.distance(y[1]) < 1e-7
            }
            None => false,
        }
    }

    /// Whether two boxes coincide over an area: `None` when they do not, otherwise whether points of one have their
    /// partners in the other.
    fn coincide(&self, a: &Rect, pa: usize, b: &Rect, pb: usize) -> Option<bool> {
        let gap = 1e-11_f64.max(4.0 * self.sheet.rounding);
        let mut met = false;
        for k in 0..9 {
            let p = a.low + a.size() * DVec2::new(f64::from(k % 3) * 0.5, f64::from(k / 3) * 0.5);
            let s = self.sheet.jet_on(pa, p, 0).s;
            let (q, distance) = foot(self.sheet, pb, b.center(), s)?;
            if distance > gap
                || !b.grown(1.5).contains(q)
                || (pa == pb && p.distance(q) < 1e-3 * a.size().max_element())
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

/// The solution of S(p) = S(q) on two continued pieces with one of the four parameters fixed.
#[allow(clippy::too_many_arguments)]
fn solve_at(
    sheet: &Sheet,
    [pa, pb]: [usize; 2],
    center: [f64; 4],
    half: [f64; 4],
    k: usize,
    x4: f64,
    step: DVec3,
    others: &[usize],
) -> Option<[f64; 4]> {
    let mut z = center;
    z[k] += x4 * half[k];
    for (i, &c) in others.iter().enumerate() {
        z[c] -= step[i].clamp(-GROWTH, GROWTH) * half[c];
    }
    let mut last = f64::INFINITY;
    for _ in 0..20 {
        let (a, b) = (sheet.jet_on(pa, DVec2::new(z[0], z[1]), 1), sheet.jet_on(pb, DVec2::new(z[2], z[3]), 1));
        let columns = [a.d[0], a.d[1], -b.d[0], -b.d[1]];
        let frame = DMat3::from_cols(columns[others[0]], columns[others[1]], columns[others[2]]);
        let d = frame.inverse() * (b.s - a.s);
        if !d.is_finite() {
            return None;
        }
        for (i, &c) in others.iter().enumerate() {
            z[c] += d[i];
        }
        if (0..4).any(|c| (z[c] - center[c]).abs() > 4.0 * GROWTH * half[c]) {
            return None;
        }
        let size = d.length();
        if size < 1e-13 || (size < 1e-10 && size > 0.3 * last) {
            return Some(z);
        }
        last = size;
    }
    None
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
