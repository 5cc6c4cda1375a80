//! A bounding-volume tree over triangles: first hit of a ray, all hits of a segment, closest point.
//!
//! Binary, built by binned surface-area heuristic over all three axes (Wald, *On fast construction of SAH-based
//! bounding volume hierarchies*, 2007), depth first in one flat array of 32-byte nodes: the left child follows
//! its parent, the right one is found by its distance. Boxes are `f32` relative to a local origin, grown by more
//! than the rounding of everything that is compared with them; what is decided is decided in `f64` on the
//! triangles. Rays are tested against triangles as Woop, Benthin and Wald do (*Watertight ray/triangle
//! intersection*, 2013): a ray through a shared edge or vertex hits at least one of the triangles there.
//!
//! Cost: build O(n log n), on several threads with the same result for any number of them; queries O(log n) in
//! practice, about 1 us a ray on a million triangles. Triangles must have finite vertices; degenerate ones are
//! never hit by rays but do count for closest points.

use glam::{DVec3, Vec3};

use crate::kernel::geom::Aabb;

const LEAF: usize = 4;
const BINS: usize = 16;
/// Up to this many triangles are split along the longest axis of their centres.
const FEW: usize = 64;
/// Below this depth nodes are halved by count, so that no input makes the tree deeper than the stack.
const SAH_DEPTH: usize = 40;
const STACK: usize = 96;
/// Subtrees above this many triangles are built in parallel.
const PARALLEL: usize = 8192;

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

/// Where a line meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The caller's number of the triangle.
    pub triangle: u32,
    /// The place on the line: `origin + t * direction`.
    pub t: f64,
    /// Barycentric coordinates of the point in the triangle.
    pub barycentric: DVec3,
}

/// The point of the triangles nearest to a given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The caller's number of the triangle.
    pub triangle: u32,
    /// The point.
    pub point: DVec3,
    /// Its barycentric coordinates in the triangle.
    pub barycentric: DVec3,
    /// Its distance.
    pub distance: f64,
}

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

    /// The first hit with `0 <= t <= t_max`.
    pub fn first_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(origin, direction, [0.0, t_max], |hit| {
            // Equal distances (a shared edge) go to the lower number, whatever the order of the visit.
            if best.is_none_or(|b| hit.t < b.t || (hit.t == b.t && hit.triangle < b.triangle)) {
                best = Some(hit);
            }
            best.map_or(t_max, |b| b.t)
        });
        best
    }

    /// Whether anything is hit with `0 <= t <= t_max`: cheaper than the first hit.
    pub fn is_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> bool {
        let mut hit = false;
        self.visit(origin, direction, [0.0, t_max], |_| {
            hit = true;
            f64::NEG_INFINITY
        });
        hit
    }

    /// All hits of the segment from `a` (t = 0) to `b` (t = 1), by increasing t, ties by triangle number. A
    /// segment through a shared edge reports every triangle at it.
    pub fn segment_hits(&self, a: DVec3, b: DVec3, hits: &mut Vec<Hit>) {
        hits.clear();
        self.visit(a, b - a, [0.0, 1.0], |hit| {
            hits.push(hit);
            1.0
        });
        hits.sort_unstable_by(|x, y| x.t.total_cmp(&y.t).then(x.triangle.cmp(&y.triangle)));
    }

    /// Calls `found` for every hit in the range of t that may still matter; what it returns is the new end of
    /// the range.
    fn visit(&self, origin: DVec3, direction: DVec3, range: [f64; 2], mut found: impl FnMut(Hit) -> f64) {
        let Some(bounds) = self.bounds else { return };
        // Start where the line enters the (grown) root, so that f32 sees only numbers of the model's size.
        let grown = bounds.grown(1e-5 * bounds.size().max_element() + f64::MIN_POSITIVE);
        let Some([enter, leave]) = clip(&grown, origin, direction, range) else { return };
        let start = origin + direction * enter;
        let ray = Sheared::new(start, direction);
        let o = (start - self.origin).as_vec3();
        let scale = direction.abs().max_element();
        let guard = |x: f64| {
            let x = x / scale;
            (if x.abs() < 1e-18 { 1e18_f64.copysign(x) } else { 1.0 / x }) as f32
        };
        let inverse = Vec3::new(guard(direction.x), guard(direction.y), guard(direction.z));
        // Culling runs in t scaled by the largest component, from the entry point; a little is added to the end.
        let to_cull = |t: f64| ((t - enter) * scale) as f32 * (1.0 + 1e-5) + f32::MIN_POSITIVE;
        let mut end = leave;
        let mut cull = to_cull(end);
        let mut stack = [(0_u32, 0.0_f32); STACK];
        let mut depth = 0;
        if self.nodes[0].enter(o, inverse, cull).is_none() {
            return;
        }
        let mut at = 0_u32;
        loop {
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.link as usize..(node.link + node.count) as usize {
                    let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                    if let Some((t, barycentric)) = ray.hit(a, b, c) {
                        let t = t + enter;
                        if t >= range[0] && t <= end {
                            end = found(Hit { triangle: self.ids[k], t, barycentric }).min(end);
                            cull = to_cull(end);
                        }
                    }
                }
            } else {
                let (left, right) = (at + 1, at + node.link);
                let hit = |k: u32| self.nodes[k as usize].enter(o, inverse, cull);
                match (hit(left), hit(right)) {
                    (Some(l), Some(r)) => {
                        let (first, second) = if l <= r { (left, (right, r)) } else { (right, (left, l)) };
                        stack[depth] = second;
                        depth += 1;
                        at = first;
                        continue;
                    }
                    (Some(_), None) => {
                        at = left;
                        continue;
                    }
                    (None, Some(_)) => {
                        at = right;
                        continue;
                    }
                    (None, None) => {}
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                let (next, near) = stack[depth];
                if near <= cull {
                    at = next;
                    break;
                }
            }
        }
    }

    /// The nearest point within `limit` of `p` (infinity for no limit).
    pub fn nearest(&self, p: DVec3, limit: f64) -> Option<Nearest> {
        if self.nodes.is_empty() {
            return None;
        }
        let local = p - self.origin;
        let mut best: Option<Nearest> = None;
        let mut reach = limit * limit;
        let mut stack = [(0_u32, 0.0_f64); STACK];
        let mut depth = 1;
        stack[0] = (0, self.nodes[0].distance_squared(local));
        while depth > 0 {
            depth -= 1;
            let (at, lower) = stack[depth];
            if lower > reach {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.link as usize..(node.link + node.count) as usize {
                    let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                    let barycentric = nearest_on_triangle(p, a, b, c);
                    let point = a * barycentric.x + b * barycentric.y + c * barycentric.z;
                    let squared = point.distance_squared(p);
                    let id = self.ids[k];
                    if squared < reach || (squared == reach && best.is_none_or(|b| id < b.triangle)) {
                        reach = squared;
                        best = Some(Nearest { triangle: id, point, barycentric, distance: squared.sqrt() });
                    }
                }
            } else {
                let (left, right) = (at + 1, at + node.link);
                let l = (left, self.nodes[left as usize].distance_squared(local));
                let r = (right, self.nodes[right as usize].distance_squared(local));
                let (near, far) = if l.1 <= r.1 { (l, r) } else { (r, l) };
                stack[depth] = far;
                stack[depth + 1] = near;
                depth += 2;
            }
        }
        best
    }
}

impl TriTree {
    /// The caller's numbers of triangles within `reach` of `p`, with their distances, nearest first, ties by number.
    pub fn within(&self, p: DVec3, reach: f64, found: &mut Vec<Nearest>) {
        found.clear();
        let local = p - self.origin;
        let mut stack = [0_u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let at = stack[depth];
            let Some(node) = self.nodes.get(at as usize) else { return };
            if node.distance_squared(local) > reach * reach {
                continue;
            }
            if node.count == 0 {
                (stack[depth], stack[depth + 1]) = (at + 1, at + node.link);
                depth += 2;
                continue;
            }
            for k in node.link as usize..(node.link + node.count) as usize {
                let [a, b, c] = self.triangles[k].map(|p| self.points[p as usize]);
                let barycentric = nearest_on_triangle(p, a, b, c);
                let point = a * barycentric.x + b * barycentric.y + c * barycentric.z;
                let distance = point.distance(p);
                if distance <= reach {
                    found.push(Nearest { triangle: self.ids[k], point, barycentric, distance });
                }
            }
        }
        found.sort_unstable_by(|x, y| x.distance.total_cmp(&y.distance).then(x.triangle.cmp(&y.triangle)));
    }

    /// The caller's numbers, increasing, of triangles whose boxes grown by `margin` meet the segment: all that
    /// come within `margin` of it, and some more.
    pub fn near_segment(&self, a: DVec3, b: DVec3, margin: f64, found: &mut Vec<u32>) {
        found.clear();
        let (a, d) = (a - self.origin, b - a);
        let meets = |min: DVec3, max: DVec3| clip(&Aabb { min, max }.grown(margin), a, d, [0.0, 1.0]).is_some();
        let mut stack = vec![0_u32];
        while let Some(at) = stack.pop() {
            let Some(node) = self.nodes.get(at as usize) else { return };
            if !meets(Vec3::from_array(node.min).as_dvec3(), Vec3::from_array(node.max).as_dvec3()) {
                continue;
            }
            if node.count == 0 {
                stack.extend([at + 1, at + node.link]);
                continue;
            }
            for k in node.link as usize..(node.link + node.count) as usize {
                let own = Aabb::of(self.triangles[k].map(|p| self.points[p as usize] - self.origin));
                if meets(own.min, own.max) {
                    found.push(self.ids[k]);
                }
            }
        }
        found.sort_unstable();
    }
}

impl Node {
    /// Where the ray enters the box, `None` when it misses it or enters behind `end`.
    fn enter(&self, o: Vec3, inverse: Vec3, end: f32) -> Option<f32> {
        let low = (Vec3::from_array(self.min) - o) * inverse;
        let high = (Vec3::from_array(self.max) - o) * inverse;
        let (a, b) = (low.min(high), low.max(high));
        let near = a.x.max(a.y).max(a.z).max(0.0);
        let far = b.x.min(b.y).min(b.z).min(end);
        (near <= far).then_some(near)
    }

    fn distance_squared(&self, p: DVec3) -> f64 {
        let (min, max) = (Vec3::from_array(self.min).as_dvec3(), Vec3::from_array(self.max).as_dvec3());
        (min - p).max(p - max).max(DVec3::ZERO).length_squared()
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

/// The part of the range where the line is inside the box.
fn clip(bounds: &Aabb, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<[f64; 2]> {
    if !(direction.is_finite() && origin.is_finite()) || direction == DVec3::ZERO {
        return None;
    }
    let [mut enter, mut leave] = range;
    for k in 0..3 {
        if direction[k] == 0.0 {
            if origin[k] < bounds.min[k] || origin[k] > bounds.max[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((bounds.min[k] - origin[k]) / direction[k], (bounds.max[k] - origin[k]) / direction[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some([enter, leave])
}

/// A ray in coordinates in which it runs along z.
struct Sheared {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Sheared {
    fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.abs();
        let z = if d.x >= d.y && d.x >= d.z {
            0
        } else if d.y >= d.z {
            1
        } else {
            2
        };
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let along = direction[z];
        Self { origin, axes, shear: DVec3::new(direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along) }
    }

    /// t and barycentric coordinates of the hit; none on triangles seen edge-on. The products are not fused, so
    /// that both triangles at an edge compute the same number for it.
    fn hit(&self, a: DVec3, b: DVec3, c: DVec3) -> Option<(f64, DVec3)> {
        let [x, y, z] = self.axes;
        let [a, b, c] = [a, b, c].map(|p| {
            let p = p - self.origin;
            DVec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z])
        });
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let barycentric = DVec3::new(u, v, w) / det;
        let t = barycentric.dot(DVec3::new(a.z, b.z, c.z));
        (t.is_finite() && barycentric.is_finite()).then_some((t, barycentric))
    }
}

/// Barycentric coordinates of the point of a triangle nearest to `p` (Ericson, *Real-time collision detection*,
/// 2005, 5.1.5). Degenerate triangles are segments or points.
pub fn nearest_on_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return DVec3::X;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return DVec3::Y;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return DVec3::new(1.0 - t, t, 0.0);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return DVec3::Z;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return DVec3::new(1.0 - t, 0.0, t);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return DVec3::new(0.0, 1.0 - t, t);
    }
    let sum = va + vb + vc;
    DVec3::new(va, vb, vc) / sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small deterministic stream of numbers in [-1, 1].
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn soup(n: usize, shift: DVec3, scale: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
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

    /// An independent test by solving for the intersection with the plane and the barycentric coordinates.
    fn slow_hit(o: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let m = glam::DMat3::from_cols(b - a, c - a, -d);
        let x = m.inverse() * (o - a);
        (x.x >= 0.0 && x.y >= 0.0 && x.x + x.y <= 1.0).then_some(x.z)
    }

    #[test]
    fn hits_agree_with_brute_force_near_and_far_from_the_origin() {
        for (shift, scale) in [(DVec3::ZERO, 1.0), (DVec3::new(1e4, -2e4, 3e4), 1.0), (DVec3::ZERO, 1e-3)] {
            let (points, triangles) = soup(500, shift, scale);
            let tree = TriTree::new(points.clone(), &triangles);
            let mut next = numbers(99);
            let (mut seen, mut hits) = (0, Vec::new());
            for _ in 0..300 {
                let a = DVec3::new(next(), next(), next()) * (2.0 * scale) + shift;
                let b = DVec3::new(next(), next(), next()) * (2.0 * scale) + shift;
                let mut slow: Vec<(f64, u32)> = (0..500)
                    .filter_map(|k| {
                        let t = slow_hit(a, b - a, triangles[k].map(|i| points[i as usize]))?;
                        (0.0..=1.0).contains(&t).then_some((t, k as u32))
                    })
                    .collect();
                slow.sort_by(|x, y| x.0.total_cmp(&y.0));
                tree.segment_hits(a, b, &mut hits);
                assert_eq!(
                    hits.iter().map(|h| h.triangle).collect::<Vec<_>>(),
                    slow.iter().map(|s| s.1).collect::<Vec<_>>()
                );
                let first = tree.first_hit(a, b - a, 1.0);
                assert_eq!(first.map(|h| h.triangle), slow.first().map(|s| s.1));
                if let Some(h) = first {
                    seen += 1;
                    let [p, q, r] = triangles[h.triangle as usize].map(|i| points[i as usize]);
                    let inside = p * h.barycentric.x + q * h.barycentric.y + r * h.barycentric.z;
                    assert!(inside.distance(a + (b - a) * h.t) < 1e-10 * (scale + shift.length()));
                }
            }
            assert!(seen > 50, "the test must meet something, {seen}");
        }
    }

    #[test]
    fn nearest_agrees_with_dense_sampling_from_above_and_brute_force() {
        let (points, triangles) = soup(200, DVec3::ZERO, 1.0);
        let tree = TriTree::new(points.clone(), &triangles);
        let mut next = numbers(5);
        for _ in 0..100 {
            let p = DVec3::new(next(), next(), next()) * 1.5;
            let found = tree.nearest(p, f64::INFINITY).unwrap();
            let mut sampled = f64::INFINITY;
            for t in &triangles {
                let [a, b, c] = t.map(|i| points[i as usize]);
                for i in 0..=20 {
                    for j in 0..=20 - i {
                        let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                        sampled = sampled.min((a + (b - a) * u + (c - a) * v).distance(p));
                    }
                }
            }
            assert!(found.distance <= sampled + 1e-12);
            assert!(sampled - found.distance < 0.02, "{} {sampled}", found.distance);
            assert!(tree.nearest(p, found.distance * 0.999).is_none());
        }
    }

    #[test]
    fn rays_at_shared_edges_and_vertices_never_slip_through() {
        // A fan of triangles around the origin, its rim beyond the rays.
        let n = 7;
        let rim = |k: u32| {
            let a = f64::from(k) / f64::from(n) * std::f64::consts::TAU;
            DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 0.1 * (3.0 * a).sin())
        };
        let mut points = vec![DVec3::ZERO];
        points.extend((0..n).map(rim));
        let triangles: Vec<[u32; 3]> = (0..n).map(|k| [0, 1 + k, 1 + (k + 1) % n]).collect();
        let tree = TriTree::new(points.clone(), &triangles);
        let mut next = numbers(3);
        for _ in 0..200 {
            let eye = DVec3::new(next(), next(), 5.0);
            for k in 0..n as usize {
                for s in [0.0, 0.1, 1.0 / 3.0, 0.7] {
                    let target = points[0].lerp(points[1 + k], s);
                    assert!(tree.first_hit(eye, target - eye, 2.0).is_some(), "edge {k} at {s} from {eye}");
                }
            }
        }
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

    #[test]
    fn a_camera_a_million_diagonals_away_still_picks() {
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let tree = TriTree::new(points, &[[0, 1, 2]]);
        let eye = DVec3::new(0.3, 0.3, 1e6);
        let hit = tree.first_hit(eye, DVec3::new(0.0, 0.0, -1.0), f64::INFINITY).unwrap();
        assert!((hit.t - 1e6).abs() < 1e-6);
        assert!(tree.first_hit(eye, DVec3::new(0.0, 1e-6, -1.0), f64::INFINITY).is_none());
    }
}
