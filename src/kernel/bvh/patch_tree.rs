//! The tree of one Bezier patch: a full binary tree in heap order, split in u and v by turns.
//!
//! Node 1 is the patch, node i has the children 2i and 2i + 1; a node at binary depth 2g covers one of the 2^g x 2^g
//! squares of quadtree level g. Nodes are found by arithmetic, no pointer is stored. There are two stores: the full
//! one, flat arrays by level, and the lazy one, blocks of one quadtree level (2 + 4 nodes) in fixed places. Both give
//! the same bytes, and either may be asked for any node at any time.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::build::{Instructions, Matrices, Recipe, Slots as Target, direction};
use super::net::plain_net;
use super::node::Node;
use super::slots::Slots;
use super::torus::{LeafTorus, OsculatingTorus};
use crate::kernel::geom::{BezierPatch, Direction};

/// See the module's text.
#[derive(Debug)]
pub struct PatchTree {
    low: DVec2,
    high: DVec2,
    origin: DVec3,
    height: u32,
    recipe: Recipe,
    net: Vec<f64>,
    root: Node,
    full: OnceLock<Full>,
    blocks: Vec<Slots<[Node; 6]>>,
    tori: Vec<Slots<[LeafTorus; 4]>>,
}

#[derive(Debug)]
struct Full {
    /// In heap order; place 0 is empty.
    nodes: Box<[Node]>,
    tori: Box<[LeafTorus]>,
}

/// What a tree takes, in bytes on the heap and counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Nodes that exist.
    pub nodes: usize,
    /// Their bytes, with the tables that find them.
    pub node_bytes: usize,
    /// Leaf tori that exist.
    pub tori: usize,
    /// Their bytes, with the tables that find them.
    pub torus_bytes: usize,
    /// Everything else: control nets, conversion matrices, the patch records themselves.
    pub other_bytes: usize,
}

impl Memory {
    /// All bytes.
    pub fn total(&self) -> usize {
        self.node_bytes + self.torus_bytes + self.other_bytes
    }
}

impl std::ops::AddAssign for Memory {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.node_bytes += other.node_bytes;
        self.tori += other.tori;
        self.torus_bytes += other.torus_bytes;
        self.other_bytes += other.other_bytes;
    }
}

impl PatchTree {
    /// The tree of a patch with 2^height x 2^height leaves; only its root is built. `height` is at most 15.
    pub(crate) fn new(patch: &BezierPatch, height: u32, matrices: Matrices) -> Self {
        let bounds = patch.bounds();
        let origin = bounds.center();
        let net = plain_net(patch, origin);
        let recipe = Recipe::new(patch.degree, patch.rational, 0.5 * bounds.size().max_element(), matrices);
        let mut root = [Node::default()];
        let target = Target { levels: vec![&mut root], tori: &mut [] };
        recipe.build(&net, 0, target, Instructions::Best);
        Self {
            low: patch.low,
            high: patch.high,
            origin,
            height,
            recipe,
            net,
            root: root[0],
            full: OnceLock::new(),
            blocks: (0..height).map(|level| Slots::new(1 << (2 * level))).collect(),
            tori: (0..height).map(|level| Slots::new(1 << (2 * level))).collect(),
        }
    }

    /// The point that the nodes' coordinates are relative to.
    #[inline]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The height: there are 2^height x 2^height leaves.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The heap index of the first leaf; the leaves are the indices from there to its double.
    #[inline]
    pub fn first_leaf(&self) -> u32 {
        1 << (2 * self.height)
    }

    /// A node by its heap index in `1..2 * first_leaf()`, built now if it was not before.
    #[inline]
    pub fn node(&self, index: u32) -> &Node {
        debug_assert!(index >= 1 && index < 2 * self.first_leaf());
        if let Some(full) = self.full.get() {
            return &full.nodes[index as usize];
        }
        if index == 1 {
            return &self.root;
        }
        let depth = index.ilog2();
        let level = (depth - 1) / 2;
        let above = index >> (depth - 2 * level);
        let block =
            self.blocks[level as usize].get_or((above - (1 << (2 * level))) as usize, || self.build_block(above));
        &block[if depth - 2 * level == 1 { (index & 1) as usize } else { 2 + (index & 3) as usize }]
    }

    /// The two children and four grandchildren of a node at an even depth.
    fn build_block(&self, above: u32) -> [Node; 6] {
        let mut block = [Node::default(); 6];
        let (children, grandchildren) = block.split_at_mut(2);
        let target = Target { levels: vec![&mut [], children, grandchildren], tori: &mut [] };
        self.recipe.build(&self.subnet(above), above.ilog2() as usize, target, Instructions::Best);
        block
    }

    /// The torus of a leaf, or of a node at any even depth but the root, built now if it was not before.
    /// `None` for other indices.
    pub fn torus(&self, index: u32) -> Option<&LeafTorus> {
        let depth = index.checked_ilog2()?;
        if depth == 0 || depth % 2 == 1 || depth > 2 * self.height {
            return None;
        }
        if let Some(full) = self.full.get().filter(|full| depth == 2 * self.height && !full.tori.is_empty()) {
            return full.tori.get((index - self.first_leaf()) as usize);
        }
        let level = depth / 2 - 1;
        let above = index >> 2;
        let make = || {
            let mut tori = [LeafTorus::default(); 4];
            let mut leaves = [Node::default(); 4];
            let target = Target { levels: vec![&mut [], &mut [], &mut leaves], tori: &mut tori };
            self.recipe.build(&self.subnet(above), above.ilog2() as usize, target, Instructions::Best);
            tori
        };
        let block = self.tori[level as usize].get_or((above - (1 << (2 * level))) as usize, make);
        Some(&block[(index & 3) as usize])
    }

    /// The same torus in model coordinates.
    pub fn osculating_torus(&self, index: u32) -> Option<OsculatingTorus> {
        Some(self.torus(index)?.decode(self.origin + self.node(index).center()))
    }

    /// Local coordinates in [0, 1]^2 of the rectangle of a node: low and high corner.
    pub fn local_rectangle(&self, index: u32) -> [DVec2; 2] {
        let depth = index.ilog2();
        let (mut at, mut count) = ([0_u32; 2], [1_u32; 2]);
        for level in 0..depth {
            let k = direction(level as usize) as usize;
            at[k] = 2 * at[k] + (index >> (depth - 1 - level) & 1);
            count[k] *= 2;
        }
        let corner = |step: u32| {
            DVec2::new(f64::from(at[0] + step) / f64::from(count[0]), f64::from(at[1] + step) / f64::from(count[1]))
        };
        [corner(0), corner(1)]
    }

    /// Parameters of the surface over which a node lies: low and high corner.
    pub fn rectangle(&self, index: u32) -> [DVec2; 2] {
        self.local_rectangle(index).map(|local| self.low + (self.high - self.low) * local)
    }

    /// The heap index of the node at a binary depth over local coordinates in [0, 1]^2.
    pub fn node_at(&self, depth: u32, local: DVec2) -> u32 {
        let mut index = 1;
        let mut rest = local.clamp(DVec2::ZERO, DVec2::ONE);
        for level in 0..depth.min(2 * self.height) {
            let k = match direction(level as usize) {
                Direction::U => &mut rest.x,
                Direction::V => &mut rest.y,
            };
            *k *= 2.0;
            let upper = *k >= 1.0;
            *k -= f64::from(u8::from(upper));
            index = 2 * index + u32::from(upper);
        }
        index
    }

    /// The control net of a node, relative to [`Self::origin`]: all x, all y, all z, and all w if it is rational
    /// (then x, y, z are times w), u running fastest.
    pub fn subnet(&self, index: u32) -> Vec<f64> {
        self.recipe.subnet(&self.net, index)
    }

    /// The degrees of the patch.
    pub fn degree(&self) -> [usize; 2] {
        self.recipe.degree
    }

    /// Whether the patch is rational.
    pub fn is_rational(&self) -> bool {
        self.recipe.rational
    }

    /// Builds the whole tree into flat arrays, with or without the tori. Nothing happens when that was done before.
    pub(crate) fn build_full(&self, tori: bool, instructions: Instructions) {
        self.full.get_or_init(|| {
            let depth = 2 * self.height as usize;
            let mut nodes = vec![Node::default(); 2 << depth];
            let mut leaves = vec![LeafTorus::default(); if tori { 1 << depth } else { 0 }];
            let mut levels = Vec::with_capacity(depth + 1);
            let (_, mut rest) = nodes.split_at_mut(1);
            for level in 0..=depth {
                let (row, below) = rest.split_at_mut(1 << level);
                levels.push(row);
                rest = below;
            }
            self.recipe.build(&self.net, 0, Target { levels, tori: &mut leaves }, instructions);
            Full { nodes: nodes.into_boxed_slice(), tori: leaves.into_boxed_slice() }
        });
    }

    /// What the tree takes now.
    pub fn memory(&self) -> Memory {
        let full = self.full.get();
        let (nodes, tori) = full.map_or((0, 0), |full| (full.nodes.len(), full.tori.len()));
        let blocks: usize = self.blocks.iter().map(Slots::filled).sum();
        let torus_blocks: usize = self.tori.iter().map(Slots::filled).sum();
        let tables = |bytes: usize| bytes + self.blocks.capacity() * size_of::<Slots<[Node; 6]>>();
        Memory {
            nodes: nodes.saturating_sub(1).max(1) + 6 * blocks,
            node_bytes: nodes * size_of::<Node>() + tables(self.blocks.iter().map(Slots::bytes).sum()),
            tori: tori + 4 * torus_blocks,
            torus_bytes: tori * size_of::<LeafTorus>() + tables(self.tori.iter().map(Slots::bytes).sum()),
            other_bytes: size_of::<Self>() + self.net.capacity() * size_of::<f64>(),
        }
    }
}
