//! The top tree: volumes over groups of Bezier patches.

use glam::DVec3;

use super::node::{Node, NormalCone};
use super::patch_tree::PatchTree;
use super::tree::NodeId;
use crate::kernel::geom::BezierPatch;

/// A node of the top tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TopNode {
    pub node: Node,
    pub children: [NodeId; 2],
    /// The patches below: ranges in u and v.
    pub patches: [[usize; 2]; 2],
}

/// Twice the area between neighbouring control points, to tell a line from a surface.
pub(crate) fn net_area(patch: &BezierPatch) -> f64 {
    let points: Vec<DVec3> = patch.control_points().collect();
    let width = patch.degree[0] + 1;
    let mut area = 0.0;
    for j in 0..patch.degree[1] {
        for i in 0..patch.degree[0] {
            let [a, b, c, d] = [0, 1, width, width + 1].map(|k| points[j * width + i + k]);
            area += (d - a).cross(c - b).length();
        }
    }
    area
}

/// Builds the tree over a grid of patches; empty for a single patch. Node 0 is the root.
pub(crate) fn build(patches: &[PatchTree], grid: [usize; 2], origin: DVec3) -> Vec<TopNode> {
    let mut nodes = Vec::new();
    if patches.len() > 1 && patches.len() == grid[0] * grid[1] {
        let balls: Vec<_> = patches.iter().map(|patch| balls(patch, origin)).collect();
        group(patches, &balls, grid[0], origin, [[0, grid[0]], [0, grid[1]]], &mut nodes);
    }
    nodes
}

/// Four balls, whose hull holds a patch.
type Balls = [(DVec3, f64); 4];

fn group(
    patches: &[PatchTree],
    of_patches: &[Balls],
    width: usize,
    origin: DVec3,
    ranges: [[usize; 2]; 2],
    nodes: &mut Vec<TopNode>,
) -> NodeId {
    let [[i0, i1], [j0, j1]] = ranges;
    if i1 - i0 == 1 && j1 - j0 == 1 {
        return NodeId::root_of((j0 * width + i0) as u32);
    }
    let at = nodes.len();
    let placeholder = NodeId::root_of(0);
    nodes.push(TopNode { node: Node::default(), children: [placeholder; 2], patches: ranges });
    let halves = if i1 - i0 >= j1 - j0 {
        let middle = i0.midpoint(i1);
        [[[i0, middle], [j0, j1]], [[middle, i1], [j0, j1]]]
    } else {
        let middle = j0.midpoint(j1);
        [[[i0, i1], [j0, middle]], [[i0, i1], [middle, j1]]]
    };
    let children = halves.map(|half| group(patches, of_patches, width, origin, half, nodes));
    let cones = children.map(|id| match id.is_top() {
        true => nodes[id.index as usize].node.cone(),
        false => patches[id.patch as usize].node(1).cone(),
    });
    let mut balls = Vec::with_capacity(4 * (i1 - i0) * (j1 - j0));
    (j0..j1).for_each(|j| balls.extend_from_slice(of_patches[j * width + i0..j * width + i1].as_flattened()));
    // Axes from the corners of the group, as for a patch.
    let corner = |i: usize, j: usize| center(&patches[j * width + i], origin);
    let (c00, c10) = (corner(i0, j0), corner(i1 - 1, j0));
    let (c01, c11) = (corner(i0, j1 - 1), corner(i1 - 1, j1 - 1));
    let first = patches[j0 * width + i0].node(1).axes();
    let axis = |d: DVec3, other: DVec3| if d.length() > 0.0 { d } else { other };
    let a = axis(c10 + c11 - c00 - c01, first[0]);
    let b = axis(c01 + c11 - c00 - c10, first[1]);
    let cone = match cones {
        [Some(a), Some(b)] => joined(&a, &b),
        _ => None,
    };
    nodes[at].node = enclose(&balls, [a, b], cone);
    nodes[at].children = children;
    NodeId { patch: NodeId::TOP, index: at as u32 }
}

fn center(patch: &PatchTree, origin: DVec3) -> DVec3 {
    patch.node(1).center() + (patch.origin() - origin)
}

/// The swept sphere of a patch as the hull of four balls.
fn balls(patch: &PatchTree, origin: DVec3) -> Balls {
    let node = patch.node(1);
    node.rectangle().corners().map(|c| (c + (patch.origin() - origin), node.radius()))
}

/// The smallest cone around two that this knows of; `None` when it is wider than a half space.
fn joined(a: &NormalCone, b: &NormalCone) -> Option<NormalCone> {
    let axis = (a.axis + b.axis).try_normalize()?;
    let angle = |c: &NormalCone| c.half_angle() + c.axis.cross(axis).length().atan2(c.axis.dot(axis));
    let half_angle = angle(a).max(angle(b)) + 1e-12;
    (half_angle < 1.55).then(|| NormalCone { axis, sin: half_angle.sin() })
}

/// The node around balls: a rectangle along one of two directions, as in the fit of a net.
fn enclose(balls: &[(DVec3, f64)], [a, b]: [DVec3; 2], cone: Option<NormalCone>) -> Node {
    let normal = a.cross(b).normalize_or(a.any_orthonormal_vector());
    let mut best: Option<(f64, [DVec3; 3], [DVec3; 2])> = None;
    for direction in [a, b] {
        let e1 = (direction - normal * direction.dot(normal)).normalize_or(normal.any_orthonormal_vector());
        let frame = [e1, normal.cross(e1), normal];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (c, _) in balls {
            let local = DVec3::from(frame.map(|e| c.dot(e)));
            (low, high) = (low.min(local), high.max(local));
        }
        let size = high - low;
        let area = size.x * size.y;
        if best.is_none_or(|(least, ..)| area < least) {
            best = Some((area, frame, [low, high]));
        }
    }
    let Some((_, frame, [low, high])) = best else {
        return Node::default();
    };
    let half = (high - low) * 0.5;
    let middle = (high + low) * 0.5;
    let thin = half.min_element();
    // The two longer directions span the rectangle.
    let flat = (0..3).find(|&k| half[k] == thin).unwrap_or(2);
    let [i, j] = [[1, 2], [0, 2], [0, 1]][flat];
    let center = frame[0] * middle.x + frame[1] * middle.y + frame[2] * middle.z;
    let mut node = Node::rounded(center, [frame[i], frame[j]], [half[i] - thin, half[j] - thin], cone);
    let rectangle = node.rectangle();
    let (mut radius, mut sphere) = (0.0_f64, 0.0_f64);
    for (c, r) in balls {
        radius = radius.max(rectangle.distance_to(*c) + r);
        sphere = sphere.max(c.distance(node.center()) + r);
    }
    node.set_radii(radius, sphere);
    node
}
