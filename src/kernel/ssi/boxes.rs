//! Which of many boxes hold a point: a binary tree over boxes in one array, each node with the place to go on from when
//! its box is missed. Cost: build O(n log^2 n), a query O(log n) for boxes that overlap little.

use glam::DVec3;

use crate::kernel::geom::Aabb;

#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// The node after everything below this one.
    next: usize,
    /// Which box, at a leaf.
    item: Option<usize>,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct Boxes {
    nodes: Vec<Node>,
}

impl Boxes {
    /// Over boxes, which keep their places as numbers.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        if !order.is_empty() {
            tree.build(boxes, &mut order);
        }
        tree
    }

    fn build(&mut self, boxes: &[Aabb], order: &mut [usize]) {
        let bounds = order.iter().fold(Aabb::EMPTY, |all, &k| all.union(&boxes[k]));
        let at = self.nodes.len();
        let item = if let [one] = order { Some(*one) } else { None };
        self.nodes.push(Node { bounds, next: 0, item });
        if item.is_none() {
            let extent = bounds.max - bounds.min;
            let axis = (0..3).max_by(|&i, &j| extent[i].total_cmp(&extent[j])).unwrap_or(0);
            let center = |k: usize| boxes[k].center()[axis];
            order.sort_by(|&x, &y| center(x).total_cmp(&center(y)).then(x.cmp(&y)));
            let (left, right) = order.split_at_mut(order.len() / 2);
            self.build(boxes, left);
            self.build(boxes, right);
        }
        self.nodes[at].next = self.nodes.len();
    }

    /// The numbers of all boxes that a point is in, or at most `margin` outside along every axis.
    pub fn around(&self, p: DVec3, margin: f64) -> impl Iterator<Item = usize> + '_ {
        let mut at = 0;
        std::iter::from_fn(move || {
            while let Some(node) = self.nodes.get(at) {
                if !node.bounds.grown(margin).contains(p) {
                    at = node.next;
                    continue;
                }
                at += 1;
                if node.item.is_some() {
                    return node.item;
                }
            }
            None
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_finds_what_a_look_at_all_boxes_finds() {
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut point = |size: f64| DVec3::new(next(), next(), next()) * size;
        let boxes: Vec<Aabb> = (0..300)
            .map(|_| {
                let low = point(1.0);
                Aabb { min: low, max: low + point(0.2) }
            })
            .collect();
        let tree = Boxes::new(&boxes);
        for k in 0..500 {
            let (p, margin) = (point(1.2), if k % 2 == 0 { 0.0 } else { 0.05 });
            let mut found: Vec<usize> = tree.around(p, margin).collect();
            found.sort_unstable();
            let slow: Vec<usize> = (0..boxes.len()).filter(|&k| boxes[k].grown(margin).contains(p)).collect();
            assert_eq!(found, slow);
        }
        assert_eq!(Boxes::new(&[]).around(DVec3::ZERO, 1.0).count(), 0);
    }
}
