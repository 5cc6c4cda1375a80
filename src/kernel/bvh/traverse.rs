//! The traversal of two hierarchies: all pairs of nodes whose volumes overlap.
//!
//! Thesis 5.1: where two volumes overlap, the larger is descended, and at a leaf the other. A hook sees every
//! overlapping pair and may keep it as it is or drop it; [`early_exit`] keeps pairs whose normal cones are apart. The
//! order of the result is that of a depth-first walk, for any number of threads.
//!
//! Larger means by the bounding sphere: the swept volume of a flat node is nothing, however long it is.

use rayon::prelude::*;

use super::rectangle::{Patch, separated};
use super::tree::{NodeId, SurfaceTree};
use crate::kernel::job::Job;

/// How two hierarchies are traversed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraverseOptions {
    /// Volumes closer than this overlap, in model units. Default 0.
    pub margin: f64,
    /// Nodes at this quadtree level count as leaves. Default none: down to the leaves.
    pub level: Option<u32>,
    /// Whether to use all threads. Default true; the result is the same.
    pub parallel: bool,
}

impl Default for TraverseOptions {
    fn default() -> Self {
        Self { margin: 0.0, level: None, parallel: true }
    }
}

/// What to do with an overlapping pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Go on with its children; a pair of leaves is reported.
    Descend,
    /// Report it as it is.
    Keep,
    /// Forget it.
    Drop,
}

/// A node of each hierarchy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pair {
    /// In the first.
    pub a: NodeId,
    /// In the second.
    pub b: NodeId,
}

/// What a traversal found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlap {
    /// Overlapping pairs of leaves, and pairs that the hook kept.
    pub pairs: Vec<Pair>,
    /// How many of the pairs are pairs of leaves.
    pub leaf_pairs: usize,
    /// Pairs of nodes whose volumes were compared.
    pub tests: u64,
    /// False when it was cancelled: the pairs are some of all.
    pub complete: bool,
}

/// Keeps pairs whose normal cones are apart: no loop and no singular point of the intersection lies in them.
#[inline]
pub fn early_exit(a: &SurfaceTree, b: &SurfaceTree, pair: Pair) -> Verdict {
    match (a.node(pair.a).cone(), b.node(pair.b).cone()) {
        (Some(x), Some(y)) if x.apart(&y) => Verdict::Keep,
        _ => Verdict::Descend,
    }
}

/// How often cancellation is looked at.
const CHECK: u64 = 1024;
/// Pairs to be ready before they are shared out to threads.
const SHARES: usize = 256;

/// All overlapping pairs of leaves of two hierarchies, but for what the hook decides.
pub fn traverse<H>(a: &SurfaceTree, b: &SurfaceTree, options: &TraverseOptions, hook: H, job: &Job) -> Overlap
where
    H: Fn(Pair) -> Verdict + Sync,
{
    let walk = Walk { a, b, options, hook, job };
    let root = Pair { a: a.root(), b: b.root() };
    // Breadth first until there is enough to share, then depth first, joined in order.
    let mut head = Overlap { complete: true, ..Overlap::default() };
    let mut ready = vec![Item::Open(root)];
    while ready.len() < SHARES && ready.iter().any(|item| matches!(item, Item::Open(_))) {
        let mut next = Vec::with_capacity(2 * ready.len());
        for item in ready {
            match item {
                Item::Open(pair) => walk.visit(pair, &mut head.tests, &mut next),
                done => next.push(done),
            }
        }
        ready = next;
    }
    let total = ready.len().max(1) as f64;
    let finished = std::sync::atomic::AtomicUsize::new(0);
    let part = |item| match item {
        Item::Open(pair) => {
            let part = walk.run(pair);
            let finished = 1 + finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(finished as f64 / total);
            part
        }
        Item::Done(pair, leaf) => {
            Overlap { pairs: vec![pair], leaf_pairs: usize::from(leaf), tests: 0, complete: true }
        }
    };
    let parts: Vec<Overlap> = if options.parallel {
        ready.into_par_iter().map(part).collect()
    } else {
        ready.into_iter().map(part).collect()
    };
    for part in parts {
        head.pairs.extend(part.pairs);
        head.leaf_pairs += part.leaf_pairs;
        head.tests += part.tests;
        head.complete &= part.complete;
    }
    head
}

enum Item {
    Open(Pair),
    /// Reported; whether it is a pair of leaves.
    Done(Pair, bool),
}

struct Walk<'a, H> {
    a: &'a SurfaceTree,
    b: &'a SurfaceTree,
    options: &'a TraverseOptions,
    hook: H,
    job: &'a Job,
}

impl<H: Fn(Pair) -> Verdict> Walk<'_, H> {
    fn run(&self, pair: Pair) -> Overlap {
        let mut stack = vec![pair];
        let mut found = Overlap { complete: true, ..Overlap::default() };
        let mut next = Vec::with_capacity(2);
        while let Some(pair) = stack.pop() {
            self.visit(pair, &mut found.tests, &mut next);
            for item in next.drain(..).rev() {
                match item {
                    Item::Open(pair) => stack.push(pair),
                    Item::Done(pair, leaf) => {
                        found.pairs.push(pair);
                        found.leaf_pairs += usize::from(leaf);
                    }
                }
            }
            if found.tests.is_multiple_of(CHECK) && self.job.is_cancelled() {
                found.complete = false;
                break;
            }
        }
        found
    }

    fn children(&self, tree: &SurfaceTree, id: NodeId) -> Option<[NodeId; 2]> {
        let stop = self.options.level.is_some_and(|level| !id.is_top() && id.depth() >= 2 * level);
        if stop { None } else { tree.children(id) }
    }

    /// Compares a pair; what is left of it goes to `next`.
    #[inline]
    fn visit(&self, pair: Pair, tests: &mut u64, next: &mut Vec<Item>) {
        *tests += 1;
        let (x, y) = (self.a.node(pair.a), self.b.node(pair.b));
        let shift = (self.b.origin(pair.b) - self.a.origin(pair.a)) + (y.center() - x.center());
        let margin = self.options.margin;
        let (rx, ry) = (x.sphere_radius(), y.sphere_radius());
        let reach = rx + ry + margin;
        if shift.length_squared() > reach * reach {
            return;
        }
        // The stored directions are unit to 1e-7 only.
        let reach = (x.radius() + y.radius() + margin) * (1.0 + 4e-7);
        let (p, q) = (Patch { axes: x.axes(), half: x.half() }, Patch { axes: y.axes(), half: y.half() });
        if separated(&p, &q, shift, reach) {
            return;
        }
        match (self.hook)(pair) {
            Verdict::Drop => return,
            Verdict::Keep => {
                next.push(Item::Done(pair, false));
                return;
            }
            Verdict::Descend => {}
        }
        let (below_a, below_b) = (self.children(self.a, pair.a), self.children(self.b, pair.b));
        match (below_a, below_b) {
            (Some([c, d]), below) if rx >= ry || below.is_none() => {
                next.extend([Pair { a: c, ..pair }, Pair { a: d, ..pair }].map(Item::Open));
            }
            (_, Some([c, d])) => {
                next.extend([Pair { b: c, ..pair }, Pair { b: d, ..pair }].map(Item::Open));
            }
            _ => next.push(Item::Done(pair, true)),
        }
    }
}
