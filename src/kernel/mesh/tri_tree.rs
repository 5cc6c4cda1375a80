//! A bounding-volume tree over triangles: first hit of a ray, all hits of a segment, closest points; pairs of two trees
//! are in [`super::tri_pairs`].
//!
//! Binary, depth first in one flat array of 32-byte nodes: the left child follows its parent, the right one is found by
//! its distance. Boxes are `f32` relative to a local origin, grown by more than the rounding of everything that is
//! compared with them; what is decided is decided in `f64` on the triangles.
//!
//! Cost: build O(n log n), on several threads with the same result for any number of them; queries O(log n) in
//! practice, about 1 us a ray on a million triangles. Triangles must have finite vertices; degenerate ones are
//! never hit by rays but do count for closest points.

mod build;
mod nearest;
mod rays;

use glam::DVec3;

use crate::kernel::geom::Aabb;

pub use nearest::{Nearest, nearest_on_triangle};
pub use rays::{Hit, first_hit};

/// Deeper than any tree that is built.
const STACK: usize = 96;

/// Triangles and the tree over them.
#[derive(Clone, Debug, Default)]
pub struct TriTree {
    pub(super) points: Vec<DVec3>,
    /// In leaf order.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The caller's number of each triangle.
    pub(super) ids: Vec<u32>,
    pub(super) nodes: Vec<Node>,
    bounds: Option<Aabb>,
    pub(super) origin: DVec3,
}

#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Node {
    pub(super) min: [f32; 3],
    /// Leaf: its first triangle. Inner: how far behind this node its right child is.
    pub(super) link: u32,
    pub(super) max: [f32; 3],
    /// Leaf: how many triangles. Inner: 0.
    pub(super) count: u32,
}

impl TriTree {
    /// A box around all triangles; `None` when there are none.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    /// How many triangles it holds.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small deterministic stream of numbers in [-1, 1].
    pub(super) fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    pub(super) fn soup(n: usize, shift: DVec3, scale: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut next = numbers(7);
        let mut p = |s: f64| DVec3::new(next(), next(), next()) * s;
        let points = (0..n)
            .flat_map(|_| {
                let c = p(1.0);
                [c, c + p(0.3), c + p(0.3)]
            })
            .map(|p| p * scale + shift)
            .collect();
        (points, (0..n as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect())
    }

    #[test]
    fn no_triangles_equal_triangles_and_bad_ones_are_survived() {
        let none = TriTree::new(Vec::new(), &[]);
        assert!(none.is_empty() && none.first_hit(DVec3::ZERO, DVec3::X, 1.0).is_none());
        assert!(none.nearest(DVec3::ZERO, f64::INFINITY).is_none());
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::NAN];
        let mut triangles = vec![[0, 1, 2]; 1000];
        triangles.extend([[0, 1, 3], [0, 1, 9], [0, 0, 0]]);
        let tree = TriTree::new(points, &triangles);
        assert_eq!(tree.len(), 1001);
        let mut hits = Vec::new();
        tree.segment_hits(DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.2, 0.2, -1.0), &mut hits);
        assert_eq!(hits.len(), 1000);
        assert!(hits.windows(2).all(|w| w[0].triangle < w[1].triangle));
        assert!(tree.first_hit(DVec3::NAN, DVec3::X, 1.0).is_none());
        assert!(tree.first_hit(DVec3::ONE, DVec3::ZERO, 1.0).is_none());
    }
}
