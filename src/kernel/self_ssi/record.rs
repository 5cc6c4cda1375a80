//! What the search did, as data to look at: the nodes of the ternary tree that it visited with what was proved about
//! each, the 2 x 2 and 3 x 3 windows of cells that failed their test, and the converted leaves.
//!
//! The thesis (6.1) tests all windows of the grid in advance. Here a node proved free of self-intersection settles every window
//! inside it, and the search meets the others when it needs them; the record completes the picture by testing what no node
//! settled, with the same test. Cost: about as much as the search again; it is kept only on request.

use super::leaf::ConvertedLeaf;
use super::ternary::Span;

/// Which child of its parent a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NodeRole {
    /// The whole surface.
    Root,
    /// S1.
    First,
    /// Sm, which overlaps both.
    Middle,
    /// S2.
    Last,
}

/// What was proved about a node against itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NodeState {
    /// Injective: the subtree was dropped.
    Injective,
    /// It holds one miter point and its branch only.
    MiterPoint,
    /// It holds one cusp edge only.
    CuspEdge,
    /// Nothing: its children were looked at.
    Split,
}

/// A node of the ternary tree that was visited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TernaryNode {
    /// The number of splits above it: 0 for the root; below the grid cells go on being halved.
    pub level: u32,
    /// `[[u0, u1], [v0, v1]]` in the surface's parameters.
    pub uv_box: [[f64; 2]; 2],
    /// Cells of the grid it covers, or `None` below the grid.
    pub cells: Option<[[u32; 2]; 2]>,
    /// Which child it is.
    pub role: NodeRole,
    /// What was proved.
    pub state: NodeState,
    /// The place among the nodes of the one that it was split from; `None` for the root.
    pub parent: Option<usize>,
}

/// A window of `size` x `size` cells that is not proved free of self-intersection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FailedWindow {
    /// 2 or 3.
    pub size: u32,
    /// Its first cell in both directions.
    pub first: [u32; 2],
    /// `[[u0, u1], [v0, v1]]` in the surface's parameters.
    pub uv_box: [[f64; 2]; 2],
}

/// Everything that was recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// The grid lines in the surface's parameters, u and v.
    pub lines: [Vec<f64>; 2],
    /// The nodes in the order in which they were visited.
    pub nodes: Vec<TernaryNode>,
    /// The windows that failed.
    pub windows: Vec<FailedWindow>,
    /// The leaves with miter quadrangles.
    pub leaves: Vec<ConvertedLeaf>,
    /// Pairs of leaves, as boxes, in which a curve was looked for.
    pub leaf_pairs: Vec<[[[f64; 2]; 2]; 2]>,
}

impl Record {
    /// The number of levels.
    pub fn levels(&self) -> u32 {
        self.nodes.iter().map(|n| n.level + 1).max().unwrap_or(0)
    }

    /// The nodes of one level.
    pub fn level(&self, level: u32) -> impl Iterator<Item = &TernaryNode> {
        self.nodes.iter().filter(move |n| n.level == level)
    }
}

/// The windows of a grid that lie inside no settled rectangle of cells.
pub(crate) fn unsettled(cells: [u32; 2], size: u32, settled: &[[Span; 2]]) -> Vec<[u32; 2]> {
    if cells[0] < size || cells[1] < size {
        return Vec::new();
    }
    let (width, height) = ((cells[0] - size + 1) as usize, (cells[1] - size + 1) as usize);
    // Windows inside a rectangle are themselves a rectangle of first cells: count them by differences.
    let mut count = vec![0_i32; (width + 1) * (height + 1)];
    for [u, v] in settled {
        if u.len() < size || v.len() < size {
            continue;
        }
        let (i0, i1) = (u.low as usize, (u.high - size + 1) as usize);
        let (j0, j1) = (v.low as usize, (v.high - size + 1) as usize);
        count[j0 * (width + 1) + i0] += 1;
        count[j0 * (width + 1) + i1] -= 1;
        count[j1 * (width + 1) + i0] -= 1;
        count[j1 * (width + 1) + i1] += 1;
    }
    let mut out = Vec::new();
    for j in 0..=height {
        for i in 0..=width {
            let at = j * (width + 1) + i;
            let left = if i > 0 { count[at - 1] } else { 0 };
            let below = if j > 0 { count[at - width - 1] } else { 0 };
            let both = if i > 0 && j > 0 { count[at - width - 2] } else { 0 };
            count[at] += left + below - both;
            if i < width && j < height && count[at] == 0 {
                out.push([i as u32, j as u32]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_across_the_border_of_settled_rectangles_are_unsettled() {
        let settled = [[Span::new(0, 4), Span::new(0, 6)], [Span::new(3, 8), Span::new(0, 6)]];
        // Width 8, height 6: 3 x 3 windows that start in column 2 cross both borders.
        let open = unsettled([8, 6], 3, &settled);
        assert_eq!(open, (0..4).map(|j| [2, j]).collect::<Vec<_>>());
        assert!(unsettled([8, 6], 2, &settled).is_empty(), "the overlap is one cell wide");
        assert_eq!(unsettled([4, 4], 2, &[]).len(), 9);
    }
}
