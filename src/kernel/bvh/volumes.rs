//! Trees of other bounding volumes, to compare with: axis-aligned boxes and convex hulls (thesis, Tables 8.1-8.3).
//!
//! Same splits and same heap order as the trees of rectangle-swept spheres, built in full, without normal cones. A box
//! is six `f32` rounded outward. A hull is kept as its control points in `f32`, not as the triangle mesh of the thesis:
//! the overlap test (Gilbert, Johnson, Keerthi 1988) needs only support points, and the rounding is added to the
//! reach. Groups of patches have boxes in both.

use glam::DVec3;
use rayon::prelude::*;

use super::build::direction;
use super::hull::apart;
use super::net::{General, Shape, plain_net, split};
use super::patch_tree::Memory;
use super::traverse::{Overlap, Pair};
use super::tree::{BvhError, BvhOptions, NodeId, check};
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;
use crate::kernel::num::round::{down, up};

/// The kinds of bounding volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VolumeKind {
    /// Rectangle-swept spheres: [`super::SurfaceTree`].
    #[default]
    Rss,
    /// Axis-aligned boxes.
    Aabb,
    /// Convex hulls of control points.
    Hull,
}

/// A full tree of boxes or hulls.
#[derive(Debug)]
pub struct VolumeTree {
    patches: Vec<PatchVolumes>,
    top: Vec<(Aabb, [NodeId; 2])>,
    height: u32,
}

#[derive(Debug)]
struct PatchVolumes {
    origin: DVec3,
    /// Boxes as min and max, or control points; `step` numbers a node, in heap order with place 0 empty.
    numbers: Vec<f32>,
    step: usize,
    kind: VolumeKind,
    /// What rounding the points of a hull may move.
    slack: f64,
}

impl VolumeTree {
    /// Builds boxes ([`VolumeKind::Aabb`]) or hulls (any other kind) for all nodes.
    pub fn build(surface: &Surface, options: &BvhOptions, kind: VolumeKind, job: &Job) -> Result<Self, BvhError> {
        let pieces = surface.bezier_patches();
        check(&pieces, options)?;
        let points: usize = pieces.iter().map(|p| p.points.len()).max().unwrap_or(0);
        let node = if kind == VolumeKind::Aabb { 6 } else { 3 * points } * size_of::<f32>();
        let needed = pieces.len() as u128 * (2_u128 << (2 * options.height)) * node as u128;
        if needed > options.memory_limit as u128 {
            let (height, limit) = (options.height, options.memory_limit);
            return Err(BvhError::Memory { height, patches: pieces.len(), needed, limit });
        }
        job.phase("Building the hierarchy");
        let build = |piece| PatchVolumes::new(piece, options.height, kind);
        let patches: Vec<PatchVolumes> = pieces.par_iter().map(build).collect();
        let mut top = Vec::new();
        let [nu, nv] = surface.knots().each_ref().map(|k| k.breaks().len() - 1);
        if patches.len() > 1 && patches.len() == nu * nv {
            group(&patches, nu, [[0, nu], [0, nv]], &mut top);
        }
        Ok(Self { patches, top, height: options.height })
    }

    /// What the tree takes, counted as [`super::SurfaceTree::memory`] does: heap and the record itself.
    pub fn memory(&self) -> Memory {
        let numbers: usize = self.patches.iter().map(|p| p.numbers.capacity() * size_of::<f32>()).sum();
        Memory {
            nodes: self.top.len() + self.patches.len() * ((2 << (2 * self.height)) - 1),
            node_bytes: numbers + self.top.capacity() * size_of::<(Aabb, [NodeId; 2])>(),
            other_bytes: size_of::<Self>() + self.patches.capacity() * size_of::<PatchVolumes>(),
            ..Memory::default()
        }
    }

    /// All bytes of [`Self::memory`].
    pub fn bytes(&self) -> usize {
        self.memory().total()
    }

    /// All pairs of nodes of a quadtree level (or of leaves) whose volumes are within `margin`.
    pub fn overlap(&self, other: &Self, level: Option<u32>, margin: f64, job: &Job) -> Overlap {
        let mut found = Overlap { complete: true, ..Overlap::default() };
        let mut stack = vec![Pair { a: self.root(), b: other.root() }];
        while let Some(pair) = stack.pop() {
            found.tests += 1;
            if found.tests.is_multiple_of(1024) && job.is_cancelled() {
                found.complete = false;
                break;
            }
            let (x, y) = (self.volume(pair.a), other.volume(pair.b));
            if x.apart(&y, margin) {
                continue;
            }
            let (below_a, below_b) = (self.children(pair.a, level), other.children(pair.b, level));
            match (below_a, below_b) {
                (Some([c, d]), below) if x.size() >= y.size() || below.is_none() => {
                    stack.extend([Pair { a: d, ..pair }, Pair { a: c, ..pair }]);
                }
                (_, Some([c, d])) => stack.extend([Pair { b: d, ..pair }, Pair { b: c, ..pair }]),
                _ => found.pairs.push(pair),
            }
        }
        found.leaf_pairs = found.pairs.len();
        found
    }

    fn root(&self) -> NodeId {
        if self.top.is_empty() { NodeId::root_of(0) } else { NodeId { patch: NodeId::TOP, index: 0 } }
    }

    fn children(&self, id: NodeId, level: Option<u32>) -> Option<[NodeId; 2]> {
        if id.is_top() {
            return Some(self.top[id.index as usize].1);
        }
        let last = 2 * level.unwrap_or(self.height).min(self.height);
        let child = |k: u32| NodeId { index: 2 * id.index + k, ..id };
        (id.depth() < last).then(|| [child(0), child(1)])
    }

    fn volume(&self, id: NodeId) -> Volume<'_> {
        if id.is_top() {
            return Volume::Box(self.top[id.index as usize].0);
        }
        let patch = &self.patches[id.patch as usize];
        let at = id.index as usize * patch.step;
        let numbers = &patch.numbers[at..at + patch.step];
        match patch.kind {
            VolumeKind::Aabb => Volume::Box(patch.aabb(numbers)),
            _ => Volume::Hull { origin: patch.origin, numbers, slack: patch.slack },
        }
    }

    /// A box around a node, in model coordinates; for a hull that of its points.
    pub fn aabb(&self, id: NodeId) -> Aabb {
        self.volume(id).aabb()
    }
}

enum Volume<'a> {
    Box(Aabb),
    Hull { origin: DVec3, numbers: &'a [f32], slack: f64 },
}

impl Volume<'_> {
    fn aabb(&self) -> Aabb {
        match self {
            Self::Box(b) => *b,
            Self::Hull { origin, numbers, slack } => {
                let point = |p: &[f32]| DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])) + *origin;
                Aabb::of(numbers.chunks_exact(3).map(point)).grown(*slack)
            }
        }
    }

    fn size(&self) -> f64 {
        self.aabb().diagonal()
    }

    fn apart(&self, other: &Self, margin: f64) -> bool {
        match (self, other) {
            (
                Self::Hull { origin, numbers, slack },
                Self::Hull { origin: origin_b, numbers: numbers_b, slack: slack_b },
            ) => apart(numbers, numbers_b, *origin_b - *origin, margin + slack + slack_b),
            _ => !self.aabb().grown(margin).overlaps(&other.aabb()),
        }
    }
}

impl PatchVolumes {
    fn new(piece: &crate::kernel::geom::BezierPatch, height: u32, kind: VolumeKind) -> Self {
        let bounds = piece.bounds();
        let origin = bounds.center();
        let net = plain_net(piece, origin);
        let step = if kind == VolumeKind::Aabb { 6 } else { 3 * piece.points.len() };
        let mut patch = Self {
            origin,
            numbers: vec![0.0; (2 << (2 * height)) * step],
            step,
            kind,
            // Half a unit in the last place of an f32, and the rounding of the splits.
            slack: 1.1e-7 * 0.5 * bounds.size().length(),
        };
        if piece.rational {
            patch.fill(General::<true>(piece.degree), &net, 1, 2 * height);
        } else {
            patch.fill(General::<false>(piece.degree), &net, 1, 2 * height);
        }
        patch
    }

    fn fill<H: Shape>(&mut self, shape: H, net: &[f64], index: usize, depth: u32) {
        let n = shape.count();
        let point = |i: usize| {
            let p = DVec3::new(net[i], net[n + i], net[2 * n + i]);
            if H::RATIONAL { p / net[3 * n + i] } else { p }
        };
        let place = &mut self.numbers[index * self.step..(index + 1) * self.step];
        if self.kind == VolumeKind::Aabb {
            let b = Aabb::of((0..n).map(point)).grown(1e-8 * self.slack);
            place[..3].copy_from_slice(&b.min.to_array().map(down));
            place[3..].copy_from_slice(&b.max.to_array().map(up));
        } else {
            for (i, place) in place.chunks_exact_mut(3).enumerate() {
                place.copy_from_slice(&point(i).as_vec3().to_array());
            }
        }
        if depth > 0 {
            let (mut low, mut high) = (net.to_vec(), net.to_vec());
            split(shape, direction(index.ilog2() as usize), net, &mut low, &mut high);
            self.fill(shape, &low, 2 * index, depth - 1);
            self.fill(shape, &high, 2 * index + 1, depth - 1);
        }
    }

    fn aabb(&self, b: &[f32]) -> Aabb {
        let vector = |v: &[f32]| DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])) + self.origin;
        Aabb { min: vector(&b[..3]), max: vector(&b[3..]) }
    }
}

/// Halves a grid of patches along its longer side until one is left.
fn group(
    patches: &[PatchVolumes],
    width: usize,
    ranges: [[usize; 2]; 2],
    top: &mut Vec<(Aabb, [NodeId; 2])>,
) -> (Aabb, NodeId) {
    let [[i0, i1], [j0, j1]] = ranges;
    if i1 - i0 == 1 && j1 - j0 == 1 {
        let at = j0 * width + i0;
        let patch = &patches[at];
        let numbers = &patch.numbers[patch.step..2 * patch.step];
        let volume = match patch.kind {
            VolumeKind::Aabb => Volume::Box(patch.aabb(numbers)),
            _ => Volume::Hull { origin: patch.origin, numbers, slack: patch.slack },
        };
        return (volume.aabb(), NodeId::root_of(at as u32));
    }
    let at = top.len();
    top.push((Aabb::EMPTY, [NodeId::root_of(0); 2]));
    let halves = if i1 - i0 >= j1 - j0 {
        let middle = i0.midpoint(i1);
        [[[i0, middle], [j0, j1]], [[middle, i1], [j0, j1]]]
    } else {
        let middle = j0.midpoint(j1);
        [[[i0, i1], [j0, middle]], [[i0, i1], [middle, j1]]]
    };
    let [(x, c), (y, d)] = halves.map(|half| group(patches, width, half, top));
    top[at] = (x.union(&y), [c, d]);
    (top[at].0, NodeId { patch: NodeId::TOP, index: at as u32 })
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::super::tests::{Random, kinds, random_surface, samples};
    use super::*;

    /// The node of a patch's tree at a binary depth over local coordinates.
    fn over(depth: u32, mut local: DVec2) -> u32 {
        let mut index = 1;
        for level in 0..depth {
            let t = &mut local[direction(level as usize) as usize];
            *t *= 2.0;
            let upper = *t >= 1.0;
            *t -= f64::from(u8::from(upper));
            index = 2 * index + u32::from(upper);
        }
        index
    }

    #[test]
    fn boxes_and_hulls_hold_the_points_of_every_kind_of_surface() {
        let mut random = Random(51);
        for surface_kind in kinds() {
            let surface = random_surface(surface_kind, &mut random);
            let pieces = surface.bezier_patches();
            for kind in [VolumeKind::Aabb, VolumeKind::Hull] {
                let options = BvhOptions { height: 3, ..BvhOptions::default() };
                let tree = VolumeTree::build(&surface, &options, kind, &Job::new()).unwrap();
                for uv in samples(&surface, 20, &mut random) {
                    let inside = |p: &crate::kernel::geom::BezierPatch| p.low.cmple(uv).all() && uv.cmple(p.high).all();
                    let at = pieces.iter().position(inside).unwrap();
                    let local = (uv - pieces[at].low) / (pieces[at].high - pieces[at].low);
                    let p = surface.eval(uv);
                    // What evaluating the point rounds.
                    let rounding = crate::kernel::tol::ROUNDING * surface.bounds().max_abs();
                    for depth in 0..=6 {
                        let id = NodeId { patch: at as u32, index: over(depth, local) };
                        let out = match tree.volume(id) {
                            Volume::Box(b) => b.distance_squared(p) > rounding * rounding,
                            Volume::Hull { origin, numbers, slack } => {
                                apart(numbers, &[0.0; 3], p - origin, slack + rounding)
                            }
                        };
                        assert!(!out, "{surface_kind:?} {kind:?} depth {depth} at {uv}");
                    }
                }
            }
        }
    }
}
