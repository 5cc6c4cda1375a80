//! Building: binned surface-area heuristic over all three axes (Wald, *On fast construction of SAH-based bounding volume
//! hierarchies*, 2007), by count where that would make the tree deep.

use glam::{DVec3, Vec3};

use super::{Node, TriTree};
use crate::kernel::geom::Aabb;

const LEAF: usize = 4;
const BINS: usize = 16;
/// Up to this many triangles are split along the longest axis of their centres.
const FEW: usize = 64;
/// Below this depth nodes are halved by count, so that no input makes the tree deeper than the stack.
const SAH_DEPTH: usize = 40;
/// Subtrees above this many triangles are built in parallel.
const PARALLEL: usize = 8192;

#[derive(Clone, Copy)]
struct Item {
    min: Vec3,
    max: Vec3,
    id: u32,
}

impl Item {
    fn center(&self) -> Vec3 {
        self.min + self.max
    }
}

#[derive(Clone, Copy)]
struct Box32 {
    min: Vec3,
    max: Vec3,
}

impl Box32 {
    const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    fn add(&mut self, min: Vec3, max: Vec3) {
        self.min = self.min.min(min);
        self.max = self.max.max(max);
    }

    fn area(&self) -> f32 {
        let d = (self.max - self.min).max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

impl TriTree {
    /// Builds the tree. Every index must be below `points.len()`; triangles for which that is not so, or that
    /// have a vertex which is not finite, are left out.
    pub fn new(points: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let usable = |t: &[u32; 3]| t.iter().all(|&k| points.get(k as usize).is_some_and(|p| p.is_finite()));
        let corners = |t: &[u32; 3]| t.map(|k| points[k as usize]);
        let bounds = Aabb::of(triangles.iter().filter(|t| usable(t)).flat_map(corners));
        if bounds.is_empty() {
            return Self { points, ..Self::default() };
        }
        let origin = bounds.center();
        let pad = (2e-6 * bounds.size().max_element()) as f32 + f32::MIN_POSITIVE;
        let mut items: Vec<Item> = triangles
            .iter()
            .enumerate()
            .filter(|(_, t)| usable(t))
            .map(|(id, t)| {
                let [a, b, c] = corners(t).map(|p| (p - origin).as_vec3());
                Item { min: a.min(b).min(c) - pad, max: a.max(b).max(c) + pad, id: id as u32 }
            })
            .collect();
        let mut nodes = Vec::new();
        build(&mut items, 0, 0, &mut nodes);
        let ids: Vec<u32> = items.iter().map(|i| i.id).collect();
        let triangles = ids.iter().map(|&id| triangles[id as usize]).collect();
        Self { points, triangles, ids, nodes, bounds: Some(bounds), origin }
    }
}

/// Appends the nodes of a subtree whose first triangle has the number `first`.
fn build(items: &mut [Item], first: usize, depth: usize, nodes: &mut Vec<Node>) {
    let mut all = Box32::EMPTY;
    items.iter().for_each(|i| all.add(i.min, i.max));
    let node = |link: u32, count: u32| Node { min: all.min.to_array(), link, max: all.max.to_array(), count };
    let count = items.len();
    let middle = if count <= 1 {
        None
    } else {
        let best = if depth < SAH_DEPTH { split(items, &all) } else { None };
        best.or_else(|| (count > LEAF).then(|| halve(items)))
    };
    let Some(middle) = middle else {
        nodes.push(node(first as u32, count as u32));
        return;
    };
    let (left, right) = items.split_at_mut(middle);
    let at = nodes.len();
    nodes.push(node(0, 0));
    if left.len() + right.len() > PARALLEL {
        let mut behind = Vec::new();
        rayon::join(|| build(left, first, depth + 1, nodes), || build(right, first + middle, depth + 1, &mut behind));
        nodes[at].link = (nodes.len() - at) as u32;
        nodes.append(&mut behind);
    } else {
        build(left, first, depth + 1, nodes);
        nodes[at].link = (nodes.len() - at) as u32;
        build(right, first + middle, depth + 1, nodes);
    }
}

/// Reorders the items by the cheapest of the binned planes; `None` when a leaf is cheaper or no plane parts them.
/// Few items are binned along the longest axis only, into fewer bins: they are what most of the time goes to.
fn split(items: &mut [Item], all: &Box32) -> Option<usize> {
    let mut centers = Box32::EMPTY;
    items.iter().for_each(|i| centers.add(i.center(), i.center()));
    let extent = centers.max - centers.min;
    let few = items.len() <= FEW;
    let longest = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if few && axis != longest {
            continue;
        }
        let (low, extent) = (centers.min[axis], extent[axis]);
        let found = if few {
            cheapest::<{ BINS / 2 }>(items, axis, low, extent)
        } else {
            cheapest::<BINS>(items, axis, low, extent)
        };
        if let Some((cost, bin)) = found
            && best.is_none_or(|(c, ..)| cost < c)
        {
            best = Some((cost, axis, bin));
        }
    }
    let (cost, axis, bin) = best?;
    // One traversal step costs about as much as one triangle.
    if items.len() <= LEAF && all.area() * (items.len() as f32 - 1.0) <= cost {
        return None;
    }
    let bins = if few { BINS / 2 } else { BINS };
    let scale = bins as f32 / extent[axis];
    let mut middle = 0;
    for k in 0..items.len() {
        if bin_of(&items[k], axis, centers.min[axis], scale, bins) < bin {
            items.swap(k, middle);
            middle += 1;
        }
    }
    Some(middle)
}

/// The cheapest of the planes between the bins along an axis, with its cost; `None` when none parts the items.
fn cheapest<const N: usize>(items: &[Item], axis: usize, low: f32, extent: f32) -> Option<(f32, usize)> {
    let scale = N as f32 / extent;
    if !(extent > 0.0 && scale.is_finite()) {
        return None;
    }
    let mut bins = [(Box32::EMPTY, 0_usize); N];
    for i in items {
        let bin = &mut bins[bin_of(i, axis, low, scale, N)];
        bin.0.add(i.min, i.max);
        bin.1 += 1;
    }
    let mut behind = [(0.0_f32, 0_usize); N];
    let (mut grow, mut count) = (Box32::EMPTY, 0);
    for b in (1..N).rev() {
        grow.add(bins[b].0.min, bins[b].0.max);
        count += bins[b].1;
        behind[b] = (grow.area(), count);
    }
    let mut best: Option<(f32, usize)> = None;
    let (mut grow, mut count) = (Box32::EMPTY, 0);
    for b in 1..N {
        grow.add(bins[b - 1].0.min, bins[b - 1].0.max);
        count += bins[b - 1].1;
        if count == 0 || behind[b].1 == 0 {
            continue;
        }
        let cost = grow.area() * count as f32 + behind[b].0 * behind[b].1 as f32;
        if best.is_none_or(|(c, _)| cost < c) {
            best = Some((cost, b));
        }
    }
    best
}

fn bin_of(item: &Item, axis: usize, low: f32, scale: f32, bins: usize) -> usize {
    (((item.center()[axis] - low) * scale) as usize).min(bins - 1)
}

/// Halves by count along the longest axis of the centres.
fn halve(items: &mut [Item]) -> usize {
    let mut centers = Box32::EMPTY;
    items.iter().for_each(|i| centers.add(i.center(), i.center()));
    let extent = centers.max - centers.min;
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| a.center()[axis].total_cmp(&b.center()[axis]).then(a.id.cmp(&b.id)));
    middle
}
