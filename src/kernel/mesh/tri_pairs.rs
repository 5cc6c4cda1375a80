//! All pairs of triangles of two trees whose boxes overlap (HJR99 section 4, "Intersect the trees").
//!
//! The paper takes every leaf of a base tree through the target tree; here both are descended together, the
//! larger box first, which visits each pair of inner nodes once. Cost: in proportion to the overlapping pairs of
//! nodes. The order of the pairs depends on the trees alone.

use glam::DVec3;

use super::tri_tree::{Node, TriTree};
use crate::kernel::job::Job;

/// How many node pairs pass between two looks at the job.
const BETWEEN_LOOKS: usize = 4096;

impl TriTree {
    /// The three corners of the k-th triangle in leaf order.
    pub(super) fn corners(&self, k: usize) -> [DVec3; 3] {
        self.triangles[k].map(|p| self.points[p as usize])
    }

    /// The callers' numbers of all pairs (own, other) of triangles whose boxes overlap, in a fixed order. What
    /// has been found so far when the job is cancelled.
    pub fn overlapping_pairs(&self, other: &Self, job: &Job) -> Vec<[u32; 2]> {
        self.pairs_within(other, 0.0, job)
    }

    /// The same for boxes that are at most `margin` apart along every axis.
    pub fn pairs_within(&self, other: &Self, margin: f64, job: &Job) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        if self.is_empty() || other.is_empty() {
            return pairs;
        }
        let offset = other.origin - self.origin;
        let mut stack = vec![[0_u32; 2]];
        let mut visited = 0_usize;
        while let Some([a, b]) = stack.pop() {
            visited += 1;
            if visited.is_multiple_of(BETWEEN_LOOKS) && job.is_cancelled() {
                break;
            }
            let (na, nb) = (&self.nodes[a as usize], &other.nodes[b as usize]);
            if !overlap(na, nb, offset, margin) {
                continue;
            }
            match (na.count > 0, nb.count > 0) {
                (true, true) => {
                    for i in range(na) {
                        let (low, high) = extent(self.corners(i));
                        let (low, high) = (low - margin, high + margin);
                        for j in range(nb) {
                            let (other_low, other_high) = extent(other.corners(j));
                            if low.cmple(other_high).all() && other_low.cmple(high).all() {
                                pairs.push([self.ids[i], other.ids[j]]);
                            }
                        }
                    }
                }
                (false, b_is_leaf) if b_is_leaf || size(na) >= size(nb) => {
                    stack.extend([[a + na.link, b], [a + 1, b]]);
                }
                _ => stack.extend([[a, b + nb.link], [a, b + 1]]),
            }
        }
        pairs
    }
}

fn range(leaf: &Node) -> std::ops::Range<usize> {
    leaf.link as usize..(leaf.link + leaf.count) as usize
}

fn extent([a, b, c]: [DVec3; 3]) -> (DVec3, DVec3) {
    (a.min(b).min(c), a.max(b).max(c))
}

fn size(node: &Node) -> f32 {
    (0..3).map(|k| node.max[k] - node.min[k]).sum()
}

/// Boxes are grown by more than the rounding of this comparison when they are made.
fn overlap(a: &Node, b: &Node, offset: DVec3, margin: f64) -> bool {
    (0..3).all(|k| {
        f64::from(a.min[k]) <= f64::from(b.max[k]) + offset[k] + margin
            && f64::from(b.min[k]) + offset[k] <= f64::from(a.max[k]) + margin
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u32, height: impl Fn(f64, f64) -> f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                points.push(DVec3::new(x, y, height(x, y)));
                if i < n && j < n {
                    let at = j * (n + 1) + i;
                    triangles.extend([[at, at + 1, at + n + 2], [at, at + n + 2, at + n + 1]]);
                }
            }
        }
        (points, triangles)
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let (p, t) = grid(14, |x, y| (5.0 * x).sin() * (4.0 * y).cos() * 0.3);
        let (q, s) = grid(11, |x, y| 0.2 * x - 0.1 * y);
        let boxes =
            |p: &[DVec3], t: &[[u32; 3]]| t.iter().map(|t| extent(t.map(|k| p[k as usize]))).collect::<Vec<_>>();
        let (left, right) = (boxes(&p, &t), boxes(&q, &s));
        let mut slow = Vec::new();
        for (i, (low, high)) in left.iter().enumerate() {
            for (j, (other_low, other_high)) in right.iter().enumerate() {
                if low.cmple(*other_high).all() && other_low.cmple(*high).all() {
                    slow.push([i as u32, j as u32]);
                }
            }
        }
        let mut fast = TriTree::new(p, &t).overlapping_pairs(&TriTree::new(q, &s), &Job::new());
        fast.sort_unstable();
        assert!(!slow.is_empty());
        assert_eq!(fast, slow);
    }

    #[test]
    fn a_cancelled_search_ends() {
        let (p, t) = grid(60, |_, _| 0.0);
        let job = Job::new();
        job.cancel();
        let tree = TriTree::new(p, &t);
        assert!(tree.overlapping_pairs(&tree, &job).len() < 7200 * 2);
    }
}
