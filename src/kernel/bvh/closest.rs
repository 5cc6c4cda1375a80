//! The closest point of a whole surface, by its hierarchy.
//!
//! The nearest node first: no point of a node is nearer than its rectangle less its radius, so once that exceeds the
//! best foot nothing better is left. At a leaf Newton runs on the surface from the middle of the leaf
//! ([`crate::kernel::geom::closest`]). Newton could miss the best point of a leaf that bends much within itself; what
//! is certain is in the result: no point is nearer than the least bound of a leaf that was polished. Only nodes
//! on the way are built. Cost: about 100 nodes and a few Newton searches a point; more where much of the surface is equally
//! far.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::tree::{NodeId, SurfaceTree};
use crate::kernel::geom::Surface;
use crate::kernel::geom::closest::{Foot, closest_from};

/// The closest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalFoot {
    /// The point.
    pub foot: Foot,
    /// No point of the surface is nearer than this.
    pub lower: f64,
    /// The leaf that Newton started from.
    pub leaf: NodeId,
}

struct Item {
    lower: f64,
    node: NodeId,
}

impl PartialEq for Item {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Item {}

impl PartialOrd for Item {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Item {
    /// The nearest is the greatest; of equals, the deepest, so that a foot is soon there.
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |item: &Self| (item.node.depth(), std::cmp::Reverse((item.node.patch, item.node.index)));
        other.lower.total_cmp(&self.lower).then_with(|| key(self).cmp(&key(other)))
    }
}

impl SurfaceTree {
    /// A distance that no point of a node falls below.
    pub fn distance_below(&self, id: NodeId, p: DVec3) -> f64 {
        let node = self.node(id);
        let local = p - self.origin(id);
        // The difference itself rounds.
        let rounding = f64::EPSILON * (p.abs().max_element() + local.abs().max_element());
        (node.rectangle().distance_to(local) - node.radius() - 4.0 * rounding).max(0.0)
    }

    /// The closest point to `p` of the surface that the tree was made of; `None` when it is not within `limit`.
    pub fn closest(&self, surface: &Surface, p: DVec3, limit: f64) -> Option<GlobalFoot> {
        let mut heap = BinaryHeap::new();
        let push = |heap: &mut BinaryHeap<Item>, node: NodeId, reach: f64| {
            let lower = self.distance_below(node, p);
            if lower <= reach {
                heap.push(Item { lower, node });
            }
        };
        push(&mut heap, self.root(), limit);
        let mut best: Option<GlobalFoot> = None;
        let mut least = f64::INFINITY;
        while let Some(Item { lower, node }) = heap.pop() {
            let reach = best.map_or(limit, |b| b.foot.distance);
            if lower > reach || (lower == reach && best.is_some()) {
                break;
            }
            if let Some(children) = self.children(node) {
                children.into_iter().for_each(|child| push(&mut heap, child, reach));
                continue;
            }
            least = least.min(lower);
            let [low, high] = self.rectangle(node);
            let foot = closest_from(surface, [false; 2], p, 0.5 * (low + high));
            if foot.distance <= limit && best.is_none_or(|b| foot.distance < b.foot.distance) {
                best = Some(GlobalFoot { foot, lower: 0.0, leaf: node });
            }
        }
        best.map(|b| GlobalFoot { lower: least.min(b.foot.distance), ..b })
    }
}
