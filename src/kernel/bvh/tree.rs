//! The hierarchy of a surface: one tree per Bezier patch, and a top tree over the patches.
//!
//! Thesis 4.1 for the trees of patches. The top tree halves the grid of patches along its longer side; its volumes
//! enclose the volumes of the patches below, its cones the cones of its children.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::build::{Instructions, matrices};
use super::node::Node;
use super::patch_tree::{Memory, PatchTree};
use super::top::{self, TopNode};
use super::torus::OsculatingTorus;
use crate::kernel::geom::{BezierPatch, Knots, Surface};
use crate::kernel::job::Job;

/// How a hierarchy is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BvhOptions {
    /// Quadtree levels: every Bezier patch has 2^height x 2^height leaves. Default 6, at most [`MAX_HEIGHT`].
    pub height: u32,
    /// A node at an even depth whose swept sphere is no thicker than this radius has no children, whatever the
    /// height says. In model units; default none.
    pub flatness: Option<f64>,
    /// The largest number of bytes that a full build may take. Default 4 GiB.
    pub memory_limit: usize,
    /// Which instructions the build uses; the result is the same. Default the best.
    pub instructions: Instructions,
}

impl Default for BvhOptions {
    fn default() -> Self {
        Self { height: 6, flatness: None, memory_limit: 4 << 30, instructions: Instructions::Best }
    }
}

/// The largest height: 4^15 leaves a patch still have 32-bit indices.
pub const MAX_HEIGHT: u32 = 15;

/// Coordinates relative to a patch must fit `f32` with room for squares in `f64`: the largest extent of a patch.
pub const MAX_EXTENT: f64 = 1e30;

/// The smallest extent of a patch that is not a point.
pub const MIN_EXTENT: f64 = 1e-30;

/// Why there is no hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BvhError {
    /// The height is beyond what indices can hold.
    #[error("height {got} is too large, the limit is {limit}")]
    Height {
        /// What was asked for.
        got: u32,
        /// The limit.
        limit: u32,
    },
    /// The full tree would not fit the memory limit.
    #[error(
        "height {height} on {patches} patches takes {needed} bytes, the limit is {limit}; build lazily or lower the height"
    )]
    Memory {
        /// What was asked for.
        height: u32,
        /// Bezier patches of the surface.
        patches: usize,
        /// Bytes of the full trees.
        needed: u128,
        /// The limit from the options.
        limit: usize,
    },
    /// A Bezier patch is a point or a line, or too small or large for its coordinates.
    #[error(
        "Bezier patch {patch} over u {u:?}, v {v:?} has extent {extent} and area {area}; extents must be within {MIN_EXTENT} and {MAX_EXTENT}, areas above 0"
    )]
    Extent {
        /// Its number.
        patch: usize,
        /// Its parameters in u.
        u: [f64; 2],
        /// Its parameters in v.
        v: [f64; 2],
        /// The largest side of the box around it.
        extent: f64,
        /// The sum of the areas between its control points.
        area: f64,
    },
    /// An option makes no sense.
    #[error("flatness is {got}, it must be positive")]
    Flatness {
        /// What was given.
        got: f64,
    },
}

/// Whether the options make sense and the patches can be bounded.
pub(crate) fn check(pieces: &[BezierPatch], options: &BvhOptions) -> Result<(), BvhError> {
    if options.height > MAX_HEIGHT {
        return Err(BvhError::Height { got: options.height, limit: MAX_HEIGHT });
    }
    if let Some(got) = options.flatness.filter(|f| f.is_nan() || *f <= 0.0) {
        return Err(BvhError::Flatness { got });
    }
    for (patch, piece) in pieces.iter().enumerate() {
        let extent = piece.bounds().size().max_element();
        let area = top::net_area(piece);
        // The comparison is also false where the extent overflowed.
        let fits = (MIN_EXTENT..=MAX_EXTENT).contains(&extent) && area > 1e-14 * extent * extent;
        if !fits {
            let (u, v) = ([piece.low.x, piece.high.x], [piece.low.y, piece.high.y]);
            return Err(BvhError::Extent { patch, u, v, extent, area });
        }
    }
    Ok(())
}

/// A node of a hierarchy. Patches have heap indices from 1 on; the top tree's nodes are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId {
    /// Number of the Bezier patch, or [`NodeId::TOP`].
    pub patch: u32,
    /// Heap index in the patch's tree, or place in the top tree.
    pub index: u32,
}

impl NodeId {
    /// Stands for the top tree in place of a patch.
    pub const TOP: u32 = u32::MAX;

    /// The root of a patch.
    pub const fn root_of(patch: u32) -> Self {
        Self { patch, index: 1 }
    }

    /// Whether it is a node of the top tree.
    #[inline]
    pub const fn is_top(self) -> bool {
        self.patch == Self::TOP
    }

    /// Binary depth below the patch's root; 0 in the top tree.
    #[inline]
    pub const fn depth(self) -> u32 {
        if self.is_top() || self.index == 0 { 0 } else { self.index.ilog2() }
    }
}

/// The hierarchy of a surface. Nodes that nobody built yet are built when they are asked for, by any thread.
#[derive(Debug)]
pub struct SurfaceTree {
    patches: Vec<PatchTree>,
    grid: [usize; 2],
    top: Vec<TopNode>,
    origin: DVec3,
    matrix_bytes: usize,
    options: BvhOptions,
}

impl SurfaceTree {
    /// Extracts the Bezier patches and builds the top tree; everything below is built on demand.
    pub fn new(surface: &Surface, options: &BvhOptions) -> Result<Self, BvhError> {
        let pieces = surface.bezier_patches();
        check(&pieces, options)?;
        let matrices = matrices(surface.knots().each_ref().map(Knots::degree));
        let new = |piece| PatchTree::new(piece, options.height, matrices.clone());
        let mut patches: Vec<PatchTree> = pieces.par_iter().map(new).collect();
        patches.shrink_to_fit();
        let grid = surface.knots().each_ref().map(|k| k.breaks().len() - 1);
        let origin = surface.bounds().center();
        let top = top::build(&patches, grid, origin);
        // Shared by all patches; two counters come with it.
        let matrix_bytes = 2 * size_of::<usize>()
            + size_of_val(&*matrices)
            + matrices.iter().map(|m| size_of_val(&m[..])).sum::<usize>();
        Ok(Self { patches, grid, top, origin, matrix_bytes, options: *options })
    }

    /// Builds every tree in full, with the tori if asked for, in parallel over the patches. Cancelling leaves the
    /// rest to be built on demand; the answer says whether all was built.
    pub fn build_all(&self, tori: bool, job: &Job) -> Result<bool, BvhError> {
        let needed = self.full_bytes(tori);
        if needed > self.options.memory_limit as u128 {
            return Err(BvhError::Memory {
                height: self.options.height,
                patches: self.patches.len(),
                needed,
                limit: self.options.memory_limit,
            });
        }
        job.phase("Building the hierarchy");
        let done = std::sync::atomic::AtomicUsize::new(0);
        self.patches.par_iter().for_each(|patch| {
            if !job.is_cancelled() {
                match self.options.flatness {
                    None => patch.build_full(tori, self.options.instructions),
                    Some(_) => self.build_down(patch, 1, tori),
                }
                let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                job.progress(done as f64 / self.patches.len() as f64);
            }
        });
        Ok(!job.is_cancelled())
    }

    /// Asks for every node that the flatness leaves.
    fn build_down(&self, patch: &PatchTree, index: u32, tori: bool) {
        if self.is_cut(patch, index) {
            if tori {
                patch.torus(index);
            }
            return;
        }
        self.build_down(patch, 2 * index, tori);
        self.build_down(patch, 2 * index + 1, tori);
    }

    /// Bytes of the full trees of all patches.
    pub fn full_bytes(&self, tori: bool) -> u128 {
        let leaves = self.patches.len() as u128 * (1_u128 << (2 * self.options.height));
        let torus = if tori { size_of::<super::LeafTorus>() } else { 0 };
        leaves * (2 * size_of::<Node>() + torus) as u128
    }

    /// How it was built.
    pub fn options(&self) -> &BvhOptions {
        &self.options
    }

    /// The trees of the Bezier patches, u running fastest.
    pub fn patches(&self) -> &[PatchTree] {
        &self.patches
    }

    /// The numbers of Bezier patches in u and v.
    pub fn grid(&self) -> [usize; 2] {
        self.grid
    }

    /// The root.
    pub fn root(&self) -> NodeId {
        if self.top.is_empty() { NodeId::root_of(0) } else { NodeId { patch: NodeId::TOP, index: 0 } }
    }

    /// A node, built now if it was not before.
    #[inline]
    pub fn node(&self, id: NodeId) -> &Node {
        if id.is_top() { &self.top[id.index as usize].node } else { self.patches[id.patch as usize].node(id.index) }
    }

    /// The point that a node's coordinates are relative to.
    #[inline]
    pub fn origin(&self, id: NodeId) -> DVec3 {
        if id.is_top() { self.origin } else { self.patches[id.patch as usize].origin() }
    }

    /// The children of a node; `None` for a leaf.
    #[inline]
    pub fn children(&self, id: NodeId) -> Option<[NodeId; 2]> {
        if id.is_top() {
            return Some(self.top[id.index as usize].children);
        }
        let patch = &self.patches[id.patch as usize];
        if self.is_cut(patch, id.index) {
            return None;
        }
        Some([0, 1].map(|k| NodeId { patch: id.patch, index: 2 * id.index + k }))
    }

    /// The parent within the patch; `None` for a patch's root and in the top tree.
    pub fn parent(&self, id: NodeId) -> Option<NodeId> {
        (!id.is_top() && id.index > 1).then_some(NodeId { patch: id.patch, index: id.index / 2 })
    }

    #[inline]
    fn is_cut(&self, patch: &PatchTree, index: u32) -> bool {
        index >= patch.first_leaf()
            || self
                .options
                .flatness
                .is_some_and(|flat| index.ilog2().is_multiple_of(2) && index > 1 && patch.node(index).radius() <= flat)
    }

    /// The surface parameters over which a node lies: low and high corner.
    pub fn rectangle(&self, id: NodeId) -> [DVec2; 2] {
        if id.is_top() {
            let [[i0, i1], [j0, j1]] = self.top[id.index as usize].patches;
            let at = |i: usize, j: usize| self.patches[j * self.grid[0] + i].rectangle(1);
            return [at(i0, j0)[0], at(i1 - 1, j1 - 1)[1]];
        }
        self.patches[id.patch as usize].rectangle(id.index)
    }

    /// The osculating torus of a leaf (or of any node at an even depth below a patch's root), in model coordinates.
    pub fn torus(&self, id: NodeId) -> Option<OsculatingTorus> {
        if id.is_top() { None } else { self.patches[id.patch as usize].osculating_torus(id.index) }
    }

    /// All nodes of a quadtree level (0 is the Bezier patches), patch by patch; cut off nodes above the level stand
    /// for what is below them. Levels beyond the height give the leaves.
    pub fn level(&self, level: u32) -> Vec<NodeId> {
        let mut nodes = Vec::new();
        for (at, patch) in (0_u32..).zip(&self.patches) {
            let depth = 2 * level.min(patch.height());
            let mut stack = vec![1_u32];
            while let Some(index) = stack.pop() {
                if index.ilog2() == depth || self.is_cut(patch, index) {
                    nodes.push(NodeId { patch: at, index });
                } else {
                    stack.extend([2 * index + 1, 2 * index]);
                }
            }
        }
        nodes
    }

    /// The node of a quadtree level over surface parameters.
    pub fn node_over(&self, level: u32, uv: DVec2) -> NodeId {
        let inside = |k: usize| {
            let edge = |i: usize| {
                let patch = if k == 0 { i } else { i * self.grid[0] };
                self.patches[patch].rectangle(1)[0][k]
            };
            (1..self.grid[k]).take_while(|&i| edge(i) <= uv[k]).count()
        };
        let at = inside(1) * self.grid[0] + inside(0);
        let patch = &self.patches[at];
        let [low, high] = patch.rectangle(1);
        let local = (uv - low) / (high - low);
        let depth = 2 * level.min(patch.height());
        let mut index = 1;
        for d in 0..=depth {
            index = patch.node_at(d, local);
            if self.is_cut(patch, index) {
                break;
            }
        }
        NodeId { patch: at as u32, index }
    }

    /// What the hierarchy takes now.
    pub fn memory(&self) -> Memory {
        let mut memory = Memory {
            nodes: self.top.len(),
            node_bytes: self.top.capacity() * size_of::<TopNode>(),
            other_bytes: size_of::<Self>() + self.matrix_bytes,
            ..Memory::default()
        };
        for patch in &self.patches {
            memory += patch.memory();
        }
        memory
    }
}
