//! The descent through pairs of nodes: what is empty, what holds one arc, what needs the gap function.

use std::collections::HashMap;

use glam::DVec3;

use super::contact::Findings;
use super::gap_fit::{Contact, fit};
use super::seam::{self, Seam};
use super::side::Side;
use super::tree::{Tree, Verdict, judge};
use crate::kernel::job::Job;

/// A pair of nodes that share at most one arc.
#[derive(Clone, Copy, Debug)]
pub struct ArcPair {
    /// The node of A.
    pub a: usize,
    /// The node of B.
    pub b: usize,
    /// A point of the line near the arc, in the nodes' coordinates.
    pub x0: [f64; 4],
    /// The line's direction.
    pub tau: [f64; 4],
    /// Where the line is within the box.
    pub range: [f64; 2],
}

/// A pair of nodes in which nothing could be decided.
#[derive(Clone, Copy, Debug)]
pub struct OpenPair {
    /// The node of A.
    pub a: usize,
    /// The node of B.
    pub b: usize,
    /// Why.
    pub reason: &'static str,
}

/// The reason of pairs that were divided down to [`SMALLEST`].
pub const TOO_SMALL: &str = "degenerate or too small to decide";

/// What the descent leaves.
#[derive(Debug, Default)]
pub struct Traversal {
    /// Pairs with one arc.
    pub arcs: Vec<ArcPair>,
    /// What the gap functions said.
    pub findings: Findings,
    /// Pairs in which nothing could be decided.
    pub unresolved: Vec<OpenPair>,
    /// How many pairs were judged.
    pub judged: usize,
    /// How many gap functions were fitted.
    pub fits: usize,
}

/// Nodes that bend less than this (radians) may be described by a gap function.
const FLAT: f64 = 0.4;
/// Feet that enter a piece by less than this only touch its border.
const BORDER: f64 = 1e-9;
/// Pairs of nodes smaller than this are given up.
const SMALLEST: f64 = 1e-9;
/// A pair of pieces is divided in passes, down to nodes of this size first, then each time this much smaller.
const FIRST_PASS: f64 = 1.0 / 64.0;
/// How much smaller nodes may be in the next pass.
const NEXT_PASS: f64 = 0.25;
/// When more pairs of nodes than this are left to the next pass, they are given up: along a whole curve they do not
/// separate, and smaller ones would only be more.
const MOST_OPEN: usize = 4096;
/// Pairs with a piece that is a point or a curve are divided down to this part of the larger piece only.
const NO_AREA: f64 = 1.0 / 32.0;
/// More nodes than this (about a gigabyte) and the rest is unresolved.
const MOST_NODES: usize = 1_000_000;

/// Descends through all pairs of pieces whose boxes meet. `gap` is the distance that counts as contact, `joining` that
/// within which borders are one.
pub fn traverse(sides: [&Side; 2], trees: &mut [Tree; 2], gap: f64, joining: f64, job: &Job) -> Traversal {
    let starts = root_pairs(trees, gap);
    let total = starts.len().max(1);
    let mut descent = Descent { sides, trees, gap, joining, out: Traversal::default(), fits: HashMap::new() };
    for (k, start) in starts.into_iter().enumerate() {
        if !descent.pair(start, job) {
            break;
        }
        job.progress(0.5 * (k + 1) as f64 / total as f64);
    }
    descent.out
}

struct Descent<'a> {
    sides: [&'a Side; 2],
    trees: &'a mut [Tree; 2],
    gap: f64,
    joining: f64,
    out: Traversal,
    fits: HashMap<(usize, usize), Vec<Contact>>,
}

impl Descent<'_> {
    fn give_up(&mut self, pairs: impl IntoIterator<Item = (usize, usize)>, reason: &'static str) {
        self.out.unresolved.extend(pairs.into_iter().map(|(a, b)| OpenPair { a, b, reason }));
    }

    /// Divides a pair of roots until nothing is left. False when the whole descent is to end.
    fn pair(&mut self, start: (usize, usize), job: &Job) -> bool {
        let nodes = [&self.trees[0].nodes[start.0], &self.trees[1].nodes[start.1]];
        let size = nodes[0].size().max(nodes[1].size());
        let no_area = |side: usize| {
            let node = nodes[side];
            node.n == DVec3::ZERO && self.sides[side].pieces[node.piece].has_no_area()
        };
        let (smallest, reason) = match [no_area(0), no_area(1)] {
            [false, false] => (SMALLEST, TOO_SMALL),
            [true, true] => (f64::INFINITY, "both patches are degenerate: points or curves, without area"),
            _ => (NO_AREA * size, "one of the patches is degenerate: a point or a curve, without area"),
        };
        let mut seams: Option<Vec<Seam>> = None;
        let mut limit = (FIRST_PASS * size).max(smallest);
        let (mut stack, mut next) = (vec![start], Vec::new());
        loop {
            while let Some((ia, ib)) = stack.pop() {
                self.out.judged += 1;
                if self.out.judged.is_multiple_of(4096) && job.is_cancelled() {
                    stack.append(&mut next);
                    stack.push((ia, ib));
                    self.give_up(stack, "cancelled");
                    return false;
                }
                let (a, b) = (&self.trees[0].nodes[ia], &self.trees[1].nodes[ib]);
                match judge(a, b, self.gap) {
                    Verdict::Empty => continue,
                    Verdict::Arc { x0, tau, range } => {
                        self.out.arcs.push(ArcPair { a: ia, b: ib, x0, tau, range });
                        continue;
                    }
                    Verdict::Unknown => {}
                }
                let (size_a, size_b) = (a.size(), b.size());
                if size_a.max(size_b) < limit {
                    next.push((ia, ib));
                    continue;
                }
                if self.settled(ia, ib, &mut seams) {
                    continue;
                }
                if self.trees.iter().map(|t| t.nodes.len()).sum::<usize>() > MOST_NODES {
                    stack.append(&mut next);
                    stack.push((ia, ib));
                    self.give_up(stack, "too many nodes were built");
                    return true;
                }
                let (sides, trees) = (self.sides, &mut *self.trees);
                let mut halves = |side: usize, index: usize| trees[side].children(index, &sides[side].pieces);
                if size_a > 1.5 * size_b {
                    stack.extend(halves(0, ia).map(|c| (c, ib)));
                } else if size_b > 1.5 * size_a {
                    stack.extend(halves(1, ib).map(|c| (ia, c)));
                } else {
                    let (ca, cb) = (halves(0, ia), halves(1, ib));
                    stack.extend(ca.iter().flat_map(|&x| cb.iter().map(move |&y| (x, y))));
                }
            }
            if next.is_empty() {
                return true;
            }
            if limit <= smallest {
                self.give_up(next, reason);
                return true;
            }
            if next.len() > MOST_OPEN {
                self.give_up(next, "the surfaces do not separate here, along a curve or more");
                return true;
            }
            limit = (NEXT_PASS * limit).max(smallest);
            // In the order in which they would have been met.
            next.reverse();
            std::mem::swap(&mut stack, &mut next);
        }
    }

    /// Whether a pair that runs nearly parallel is settled without dividing it: along a seam, or by its gap function.
    fn settled(&mut self, ia: usize, ib: usize, seams: &mut Option<Vec<Seam>>) -> bool {
        let (a, b) = (&self.trees[0].nodes[ia], &self.trees[1].nodes[ib]);
        let angle = a.n.cross(b.n).length();
        if !(angle < a.tilt + b.tilt + 0.02) {
            return false;
        }
        let pieces = [&self.sides[0].pieces[a.piece], &self.sides[1].pieces[b.piece]];
        let seams = seams.get_or_insert_with(|| seam::seams(self.sides, a.piece, b.piece, self.joining));
        if seams.iter().any(|s| s.is_all(pieces, a, b, self.joining)) {
            return true;
        }
        if !(a.tilt < FLAT && b.tilt < FLAT && b.size() < 4.0 * a.size() && a.size() < 4.0 * b.size()) {
            return false;
        }
        if covered(self.trees, &self.fits, ia, ib) {
            return true;
        }
        self.out.fits += 1;
        let Some(contact) = fit(pieces[0], a, pieces[1], b) else { return false };
        // What lies on a border within a surface belongs to the piece beyond as well, and is left to it.
        let left_to_others = (0..2).any(|k| {
            (contact.feet[1][k] < BORDER && self.sides[1].neighbour(contact.pb, k, 0.0).is_some())
                || (contact.feet[0][k] > 1.0 - BORDER && self.sides[1].neighbour(contact.pb, k, 1.0).is_some())
        });
        if !left_to_others && !contact.analyse(self.gap, &mut self.out.findings) {
            return false;
        }
        self.fits.entry((ia, contact.pb)).or_default().push(contact);
        true
    }
}

/// Whether a gap function fitted over this node of A (or one that contains it) reaches this node of B. Both are flat,
/// so the sheet that it follows is the only one there.
fn covered(trees: &[Tree; 2], fits: &HashMap<(usize, usize), Vec<Contact>>, ia: usize, ib: usize) -> bool {
    let b = &trees[1].nodes[ib];
    let mut at = Some(ia);
    while let Some(index) = at {
        if let Some(list) = fits.get(&(index, b.piece))
            && list.iter().any(|c| {
                c.feet[0].x <= b.high.x && c.feet[1].x >= b.low.x && c.feet[0].y <= b.high.y && c.feet[1].y >= b.low.y
            })
        {
            return true;
        }
        at = trees[0].nodes[index].parent;
    }
    false
}

/// Pairs of roots whose boxes meet, by a sweep along x, in a fixed order.
fn root_pairs(trees: &[Tree; 2], gap: f64) -> Vec<(usize, usize)> {
    let mut order = trees[1].roots.clone();
    let low = |i: usize| trees[1].nodes[i].bounds.min.x;
    order.sort_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    let widest = order.iter().map(|&i| trees[1].nodes[i].bounds.size().x).fold(0.0, f64::max);
    let mut pairs = Vec::new();
    for &ia in &trees[0].roots {
        let a = trees[0].nodes[ia].bounds.grown(gap);
        let first = order.partition_point(|&i| low(i) < a.min.x - widest - gap);
        for &ib in &order[first..] {
            if low(ib) > a.max.x {
                break;
            }
            if a.overlaps(&trees[1].nodes[ib].bounds) {
                pairs.push((ia, ib));
            }
        }
    }
    pairs
}
