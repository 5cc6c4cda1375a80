//! Builds a subtree: all nodes down to a depth, depth first, over as many subtrees at once as the processor has lanes.
//!
//! Going depth first keeps the nets of one path in the cache; running over lanes of sibling subtrees is what makes
//! SIMD pay. The first levels, above the lanes, are built one by one. Every node's numbers come from the same
//! sequence of operations in any build, so the bytes do not depend on lanes, threads or the order of queries.

use pulp::{Arch, Scalar, Simd, WithSimd};

use super::fit::fit;
use super::net::{Bicubic, General, Shape, power_matrix, split};
use super::node::Node;
use super::osculate::osculate;
use super::torus::{LEAF_NUMBERS, LeafTorus};
use crate::kernel::geom::Direction;
use crate::kernel::num::lanes::F;

/// What all subtrees of one patch share.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    /// Degrees.
    pub degree: [usize; 2],
    /// Whether the nets have weights.
    pub rational: bool,
    /// Bound of the rounding error of a coordinate of a subnet.
    slack: f64,
    /// The same for coefficients in powers.
    noise: f64,
    matrices: [Vec<f64>; 2],
}

/// Where a subtree's nodes go: one slice per level, the first of length 1, and one torus per node of the last
/// level (or none).
pub(crate) struct Slots<'a> {
    pub levels: Vec<&'a mut [Node]>,
    pub tori: &'a mut [LeafTorus],
}

/// The direction in which nodes of a binary depth are split.
#[inline(always)]
pub(crate) fn direction(depth: usize) -> Direction {
    if depth.is_multiple_of(2) { Direction::U } else { Direction::V }
}

/// Which instructions a build uses. The bytes are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instructions {
    /// The widest that the processor has.
    #[default]
    Best,
    /// Plain code.
    Plain,
}

impl Recipe {
    /// For a net of the given kind with coordinates of at most `scale`.
    pub fn new(degree: [usize; 2], rational: bool, scale: f64) -> Self {
        let matrices = degree.map(power_matrix);
        let growth: f64 = matrices.iter().map(|m| m.iter().map(|x| x.abs()).sum::<f64>()).product();
        let slack = 8.0 * f64::EPSILON * (degree[0] + degree[1] + 2) as f64 * scale;
        Self { degree, rational, slack, noise: slack.max(4.0 * f64::EPSILON * growth * scale), matrices }
    }

    /// Bytes on the heap.
    pub fn heap_bytes(&self) -> usize {
        self.matrices.iter().map(|m| m.capacity() * size_of::<f64>()).sum()
    }

    /// The subnet at a heap index (1 is the whole net), by splitting down the path.
    pub fn subnet(&self, net: &[f64], index: u32) -> Vec<f64> {
        match (self.rational, self.degree) {
            (false, [3, 3]) => subnet(Bicubic, net, index),
            (false, degree) => subnet(General::<false>(degree), net, index),
            (true, degree) => subnet(General::<true>(degree), net, index),
        }
    }

    /// Builds a subtree whose root, at binary depth `depth`, has the given net.
    pub fn build(&self, net: &[f64], depth: usize, slots: Slots, instructions: Instructions) {
        match (self.rational, self.degree) {
            (false, [3, 3]) => self.run(Bicubic, net, depth, slots, instructions),
            (false, degree) => self.run(General::<false>(degree), net, depth, slots, instructions),
            (true, degree) => self.run(General::<true>(degree), net, depth, slots, instructions),
        }
    }

    fn run<H: Shape>(&self, shape: H, net: &[f64], depth: usize, slots: Slots, instructions: Instructions) {
        let subtree = Subtree { recipe: self, shape, net, depth, slots };
        match instructions {
            Instructions::Best => Arch::new().dispatch(subtree),
            Instructions::Plain => subtree.with_simd(Scalar::new()),
        }
    }
}

fn subnet<H: Shape>(shape: H, net: &[f64], index: u32) -> Vec<f64> {
    let mut net = net.to_vec();
    let (mut low, mut high) = (net.clone(), net.clone());
    let depth = index.ilog2() as usize;
    for level in 0..depth {
        split(shape, direction(level), &net, &mut low, &mut high);
        let upper = index >> (depth - 1 - level) & 1 == 1;
        std::mem::swap(&mut net, if upper { &mut high } else { &mut low });
    }
    net
}

struct Subtree<'a, H> {
    recipe: &'a Recipe,
    shape: H,
    net: &'a [f64],
    depth: usize,
    slots: Slots<'a>,
}

impl<H: Shape> WithSimd for Subtree<'_, H> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { recipe, shape, net, depth, mut slots } = self;
        let last = slots.levels.len() - 1;
        let above = (S::F64_LANES.ilog2() as usize).min(last);
        let nets = above_lanes(recipe, shape, net, depth, above, &mut slots.levels);
        lanes(simd, recipe, shape, &nets, depth, above, slots);
    }
}

/// Builds the levels above the lanes one node at a time; returns the nets of the first level of the lanes.
fn above_lanes<H: Shape>(
    recipe: &Recipe,
    shape: H,
    net: &[f64],
    depth: usize,
    above: usize,
    levels: &mut [&mut [Node]],
) -> Vec<Vec<f64>> {
    let simd = Scalar::new();
    let mut nets = vec![net.to_vec()];
    for (level, nodes) in levels.iter_mut().enumerate().take(above) {
        let mut next = Vec::with_capacity(2 * nets.len());
        for (net, node) in nets.iter().zip(nodes.iter_mut()) {
            let plain: Vec<F<Scalar>> = net.iter().map(|&x| F::splat(simd, x)).collect();
            let mut scratch = plain.clone();
            let fitted = fit(simd, shape, &plain, &mut scratch, F::splat(simd, recipe.slack));
            Node::store(&fitted, |_, fitted| *node = fitted);
            let (mut low, mut high) = (net.clone(), net.clone());
            split(shape, direction(depth + level), net, &mut low, &mut high);
            next.extend([low, high]);
        }
        nets = next;
    }
    nets
}

/// Builds the rest, each lane its own subtree.
#[inline(always)]
fn lanes<S: Simd, H: Shape>(
    simd: S,
    recipe: &Recipe,
    shape: H,
    nets: &[Vec<f64>],
    depth: usize,
    above: usize,
    slots: Slots,
) {
    let Slots { mut levels, tori } = slots;
    let size = shape.size();
    let last = levels.len() - 1;
    let used = nets.len();
    let zero = F::splat(simd, 0.0);
    let slack = F::splat(simd, recipe.slack);
    let noise = F::splat(simd, recipe.noise);
    let matrices = [&recipe.matrices[0][..], &recipe.matrices[1][..]];
    // Both children of every level of the path, then room for the fits.
    let mut nets_of_path = vec![zero; (2 * (last - above) + 2) * size];
    let mut scratch = vec![zero; 2 * size];
    let mut column = [0.0; 64];
    for (i, slot) in nets_of_path[..size].iter_mut().enumerate() {
        for lane in 0..S::F64_LANES {
            column[lane] = nets[lane.min(used - 1)][i];
        }
        *slot = F::load(simd, &column[..S::F64_LANES]);
    }
    let (mut level, mut path) = (above, 0_usize);
    loop {
        let down = level - above;
        let here = if down == 0 { 0 } else { (2 * down + (path & 1)) * size };
        let (nets_here, nets_below) = nets_of_path.split_at_mut((2 * down + 2) * size);
        let net = &nets_here[here..here + size];
        let fitted = fit(simd, shape, net, &mut scratch, slack);
        let row = &mut levels[level];
        Node::store(&fitted, |lane, node| {
            if lane < used {
                row[(lane << down) | path] = node;
            }
        });
        if level < last {
            let (low, high) = nets_below[..2 * size].split_at_mut(size);
            split(shape, direction(depth + level), net, low, high);
            level += 1;
            path <<= 1;
            continue;
        }
        if !tori.is_empty() {
            let numbers = osculate(simd, shape, net, matrices, fitted.center, &mut scratch, noise);
            let mut plain = [0.0; LEAF_NUMBERS];
            for lane in 0..used {
                for (plain, number) in plain.iter_mut().zip(&numbers) {
                    *plain = number.lanes()[lane];
                }
                tori[(lane << down) | path] = LeafTorus::from_numbers(&plain);
            }
        }
        // The next node: the nearest ancestor that was a low child gives way to its sibling.
        while path & 1 == 1 {
            path >>= 1;
            level -= 1;
        }
        if level == above {
            return;
        }
        path |= 1;
    }
}
