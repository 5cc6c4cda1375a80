//! The descent through pairs of nodes: what is empty, what holds one arc, what needs the gap function.

use std::collections::HashMap;

use glam::DVec3;

use super::contact::{self, Contact, Findings};
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

/// What the descent leaves.
#[derive(Debug, Default)]
pub struct Traversal {
    /// Pairs with one arc.
    pub arcs: Vec<ArcPair>,
    /// What the gap functions said.
    pub findings: Findings,
    /// Pairs in which nothing could be decided (nodes of A and B), with the reason.
    pub unresolved: Vec<(usize, usize, &'static str)>,
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
/// More pairs than this and the rest is unresolved.
const MOST_PAIRS: usize = 20_000_000;

/// More nodes than this (about a gigabyte) and the rest is unresolved.
const MOST_NODES: usize = 1_000_000;

/// Descends through all pairs of pieces whose boxes meet.
pub fn traverse(sides: [&Side; 2], trees: &mut [Tree; 2], gap: f64, job: &Job) -> Traversal {
    let mut out = Traversal::default();
    let mut fits: HashMap<(usize, usize), Vec<Contact>> = HashMap::new();
    let starts = root_pairs(trees, gap);
    let total = starts.len().max(1);
    for (k, start) in starts.into_iter().enumerate() {
        let pieces = [&trees[0].nodes[start.0], &trees[1].nodes[start.1]];
        if (0..2).all(|side| pieces[side].n == DVec3::ZERO && sides[side].pieces[pieces[side].piece].has_no_area()) {
            out.unresolved.push((start.0, start.1, "both patches are degenerate: points or curves, without area"));
            continue;
        }
        let mut stack = vec![start];
        while let Some((ia, ib)) = stack.pop() {
            out.judged += 1;
            if out.judged % 4096 == 0 && job.is_cancelled() {
                out.unresolved.push((ia, ib, "cancelled"));
                return out;
            }
            if out.judged > MOST_PAIRS {
                out.unresolved.push((ia, ib, "too many pairs of nodes"));
                break;
            }
            let (a, b) = (&trees[0].nodes[ia], &trees[1].nodes[ib]);
            match judge(a, b, gap) {
                Verdict::Empty => continue,
                Verdict::Arc { x0, tau, range } => {
                    out.arcs.push(ArcPair { a: ia, b: ib, x0, tau, range });
                    continue;
                }
                Verdict::Unknown => {}
            }
            let (size_a, size_b) = (a.size(), b.size());
            if size_a.max(size_b) < SMALLEST {
                out.unresolved.push((ia, ib, "degenerate or too small to decide"));
                continue;
            }
            if a.tilt < FLAT && b.tilt < FLAT {
                let angle = a.n.cross(b.n).length();
                if angle < a.tilt + b.tilt + 0.02 && size_b < 4.0 * size_a && size_a < 4.0 * size_b {
                    if covered(trees, &fits, ia, ib) {
                        continue;
                    }
                    let (piece_a, piece_b) = (&sides[0].pieces[a.piece], &sides[1].pieces[b.piece]);
                    out.fits += 1;
                    // What lies on a border within a surface belongs to the piece beyond as well, and is left to it.
                    let left_to_others = |c: &Contact| {
                        (0..2).any(|k| {
                            (c.feet[1][k] < BORDER && sides[1].neighbour(c.pb, k, 0.0).is_some())
                                || (c.feet[0][k] > 1.0 - BORDER && sides[1].neighbour(c.pb, k, 1.0).is_some())
                        })
                    };
                    if let Some(contact) = contact::fit(piece_a, a, piece_b, b)
                        && (left_to_others(&contact) || contact.analyse(gap, &mut out.findings))
                    {
                        let key = (ia, contact.pb);
                        fits.entry(key).or_default().push(contact);
                        continue;
                    }
                }
            }
            if trees.iter().map(|t| t.nodes.len()).sum::<usize>() > MOST_NODES {
                out.unresolved.push((ia, ib, "too many nodes were built"));
                break;
            }
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
        job.progress(0.5 * (k + 1) as f64 / total as f64);
    }
    out
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
