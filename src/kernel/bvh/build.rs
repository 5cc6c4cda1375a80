//! Builds a subtree: all nodes down to a depth, depth first, over as many subtrees at once as the processor has lanes.
//!
//! Going depth first keeps the nets of one path in the cache; running over lanes of sibling subtrees is what makes
//! SIMD pay. The first levels, above the lanes, are built one by one. Every node's numbers come from the same
//! sequence of operations in any build, so the bytes do not depend on lanes, threads or the order of queries.

use std::sync::Arc;

use pulp::{Scalar, Simd, WithSimd};

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
    matrices: Matrices,
}

/// Where a subtree's nodes go: one slice per level (the root's may be empty: it is skipped), and one torus per node
/// of the last level, or none. There are at least two levels, or only the root.
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
    /// The widest that the processor has: four lanes with AVX2, two without.
    #[default]
    Best,
    /// Two lanes, which every x86-64 processor since 2009 has; plain code elsewhere.
    Narrow,
    /// Plain code, one number at a time.
    Plain,
}

impl Instructions {
    #[cfg(target_arch = "x86_64")]
    fn dispatch<Op: WithSimd>(self, op: Op) -> Op::Output {
        match self {
            Self::Best => {
                if let Some(simd) = pulp::x86::V3::try_new() {
                    return Simd::vectorize(simd, op);
                }
            }
            Self::Narrow => {}
            Self::Plain => return Scalar::new().vectorize(op),
        }
        match pulp::x86::V2::try_new() {
            Some(simd) => Simd::vectorize(simd, op),
            None => Scalar::new().vectorize(op),
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn dispatch<Op: WithSimd>(self, op: Op) -> Op::Output {
        match self {
            Self::Best => pulp::Arch::new().dispatch(op),
            Self::Narrow | Self::Plain => Scalar::new().vectorize(op),
        }
    }
}

/// The matrices that rewrite a net in powers, for the two degrees.
pub(crate) type Matrices = Arc<[Vec<f64>; 2]>;

/// The matrices for patches of the given degrees; made once for a surface.
pub(crate) fn matrices(degree: [usize; 2]) -> Matrices {
    Arc::new(degree.map(power_matrix))
}

impl Recipe {
    /// For a net of the given kind with coordinates of at most `scale`.
    pub fn new(degree: [usize; 2], rational: bool, scale: f64, matrices: Matrices) -> Self {
        let growth: f64 = matrices.iter().map(|m| m.iter().map(|x| x.abs()).sum::<f64>()).product();
        let slack = 8.0 * f64::EPSILON * (degree[0] + degree[1] + 2) as f64 * scale;
        Self { degree, rational, slack, noise: slack.max(4.0 * f64::EPSILON * growth * scale), matrices }
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
        instructions.dispatch(Subtree { recipe: self, shape, net, depth, slots });
    }
}

/// Room for numbers, on the stack as long as they are few: a lazy query builds thousands of small subtrees.
struct Room<T, const N: usize> {
    small: [T; N],
    large: Vec<T>,
}

impl<T: Copy, const N: usize> Room<T, N> {
    #[inline(always)]
    fn new(count: usize, fill: T) -> Self {
        Self { small: [fill; N], large: if count > N { vec![fill; count] } else { Vec::new() } }
    }

    #[inline(always)]
    fn slice(&mut self, count: usize) -> &mut [T] {
        if count > N { &mut self.large[..count] } else { &mut self.small[..count] }
    }
}

/// The numbers of a rational bicubic net.
const NET: usize = 64;

fn subnet<H: Shape>(shape: H, net: &[f64], index: u32) -> Vec<f64> {
    let size = shape.size();
    let mut room = Room::<f64, { 3 * NET }>::new(3 * size, 0.0);
    let room = room.slice(3 * size);
    room[..size].copy_from_slice(net);
    let depth = index.ilog2() as usize;
    // The net and its two halves take turns in three places.
    let mut here = 0;
    for level in 0..depth {
        let [low, high] = [(here + 1) % 3, (here + 2) % 3];
        split_within(shape, direction(level), room, [here, low, high]);
        here = if index >> (depth - 1 - level) & 1 == 1 { high } else { low };
    }
    room[here * size..(here + 1) * size].to_vec()
}

/// Splits the net in one place of a row of nets into two others.
fn split_within<H: Shape>(shape: H, direction: Direction, nets: &mut [f64], [from, low, high]: [usize; 3]) {
    let size = shape.size();
    let mut places = [None, None, None];
    for (k, net) in nets.chunks_exact_mut(size).enumerate() {
        match k {
            _ if k == from => places[0] = Some(net),
            _ if k == low => places[1] = Some(net),
            _ if k == high => places[2] = Some(net),
            _ => {}
        }
    }
    if let [Some(net), Some(low), Some(high)] = places {
        split(shape, direction, net, low, high);
    }
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
        let Self { recipe, shape, net, depth, slots } = self;
        lanes(simd, recipe, shape, net, depth, slots);
    }
}

/// The nets of the levels from the root down to the first that fills the lanes, in heap order from 0.
#[inline(always)]
fn first_levels<H: Shape>(shape: H, net: &[f64], depth: usize, count: usize, nets: &mut [f64]) {
    nets[..shape.size()].copy_from_slice(net);
    for level in 0..count {
        for at in (1 << level) - 1..(2 << level) - 1 {
            split_within(shape, direction(depth + level), nets, [at, 2 * at + 1, 2 * at + 2]);
        }
    }
}

#[inline(always)]
fn lanes<S: Simd, H: Shape>(simd: S, recipe: &Recipe, shape: H, net: &[f64], depth: usize, slots: Slots) {
    let Slots { mut levels, tori } = slots;
    let size = shape.size();
    let last = levels.len() - 1;
    let above = (S::F64_LANES.ilog2() as usize).min(last);
    // Both children of every level of the path, then room for the fits.
    let counts = [((2 << above) - 1) * size, (2 * (last - above) + 2) * size, 2 * size];
    let mut first_room = Room::<f64, { 7 * NET }>::new(counts[0], 0.0);
    let first_nets = first_room.slice(counts[0]);
    first_levels(shape, net, depth, above, first_nets);
    let zero = F::splat(simd, 0.0);
    let slack = F::splat(simd, recipe.slack);
    let noise = F::splat(simd, recipe.noise);
    let matrices = [&recipe.matrices[0][..], &recipe.matrices[1][..]];
    let mut path_room = Room::<F<S>, { 2 * NET }>::new(counts[1], zero);
    let nets_of_path = path_room.slice(counts[1]);
    let mut scratch_room = Room::<F<S>, { 2 * NET }>::new(counts[2], zero);
    let scratch = scratch_room.slice(counts[2]);
    // The levels above fill only some of the lanes; from `above` on each lane is a subtree of its own.
    let (mut level, mut path) = (0, 0_usize);
    loop {
        if level <= above && path == 0 {
            let count = 1 << level;
            let nets = &first_nets[(count - 1) * size..(2 * count - 1) * size];
            let mut column = [0.0; 64];
            for (i, slot) in nets_of_path[..size].iter_mut().enumerate() {
                for lane in 0..S::F64_LANES {
                    column[lane] = nets[lane.min(count - 1) * size + i];
                }
                *slot = F::load(simd, &column[..S::F64_LANES]);
            }
        }
        let used = 1 << level.min(above);
        let down = level.saturating_sub(above);
        let here = if down == 0 { 0 } else { (2 * down + (path & 1)) * size };
        let (nets_here, nets_below) = nets_of_path.split_at_mut((2 * down + 2) * size);
        let net = &nets_here[here..here + size];
        let row = &mut levels[level];
        if level < last && row.is_empty() {
            level += 1;
            continue;
        }
        let fitted = fit(simd, shape, net, scratch, slack);
        for lane in 0..used {
            row[(lane << down) | path] = Node::of_lane(&fitted, lane);
        }
        if level < above {
            level += 1;
            continue;
        }
        if level < last {
            let (low, high) = nets_below[..2 * size].split_at_mut(size);
            split(shape, direction(depth + level), net, low, high);
            level += 1;
            path <<= 1;
            continue;
        }
        if !tori.is_empty() {
            let numbers = osculate(simd, shape, net, matrices, fitted.center, scratch, noise);
            let mut plain = [0.0; LEAF_NUMBERS];
            for lane in 0..used {
                for k in 0..LEAF_NUMBERS {
                    plain[k] = numbers[k].lanes()[lane];
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
