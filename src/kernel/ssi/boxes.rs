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

/// Balls that nearly touch, by groups in which each is reached from each; the groups and their members in ascending order
/// of the first, the members in the order in which they are reached.
pub fn clusters(balls: &[(DVec3, f64)]) -> Vec<Vec<usize>> {
    let boxes: Vec<Aabb> = balls.iter().map(|&(p, r)| Aabb { min: p - 1.2 * r, max: p + 1.2 * r }).collect();
    let tree = Boxes::new(&boxes);
    let mut reached = vec![false; balls.len()];
    let mut out = Vec::new();
    for start in 0..balls.len() {
        if reached[start] {
            continue;
        }
        reached[start] = true;
        let (mut members, mut next) = (vec![start], 0);
        while let Some(&at) = members.get(next) {
            let (p, r) = balls[at];
            let near = |&k: &usize| !reached[k] && p.distance(balls[k].0) < 1.2 * (r + balls[k].1) + 1e-9;
            let mut more: Vec<usize> = tree.around(p, 1.2 * r + 2e-9).filter(near).collect();
            more.sort_unstable();
            more.iter().for_each(|&k| reached[k] = true);
            members.extend(more);
            next += 1;
        }
        out.push(members);
    }
    out
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

    #[test]
    fn chains_of_balls_are_clusters() {
        // Three rows of balls, each row 1 apart from the next and its balls 0.2 apart from one another.
        let balls: Vec<(DVec3, f64)> =
            (0..60).map(|k| (DVec3::new(0.2 * f64::from(k / 3), f64::from(k % 3), 0.0), 0.1)).collect();
        let found = clusters(&balls);
        assert_eq!(found.len(), 3);
        for (row, members) in found.iter().enumerate() {
            assert_eq!(*members, (0..20).map(|k| 3 * k + row).collect::<Vec<_>>());
        }
        let far: Vec<(DVec3, f64)> = balls.iter().map(|&(p, r)| (p, 0.5 * r)).collect();
        assert_eq!(clusters(&far).len(), 60);
    }
}
