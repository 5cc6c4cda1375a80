//! Checks a hierarchy against its surface by sampling: what a test calls, and what tells why.

use glam::{DVec2, DVec3};

use super::tree::{NodeId, SurfaceTree};
use crate::kernel::geom::Surface;

/// A promise that a hierarchy breaks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Broken {
    /// A point of the surface lies outside a volume of a node over it.
    #[error("point {uv} is {excess} outside the {volume} of node {node:?}")]
    Outside {
        /// The node.
        node: NodeId,
        /// Parameters of the point.
        uv: DVec2,
        /// Which volume.
        volume: &'static str,
        /// By how much.
        excess: f64,
    },
    /// A normal lies outside the cone of a node over it.
    #[error("the normal at {uv} is {angle} rad off the axis of node {node:?}, whose half angle is {half_angle}")]
    Normal {
        /// The node.
        node: NodeId,
        /// Parameters of the point.
        uv: DVec2,
        /// Angle to the axis.
        angle: f64,
        /// The half angle.
        half_angle: f64,
    },
    /// A point or normal is farther from a leaf's torus than the leaf says.
    #[error("{what} at {uv} misses the torus of {node:?} by {got}, the bound is {bound}")]
    Torus {
        /// The leaf.
        node: NodeId,
        /// Parameters of the point.
        uv: DVec2,
        /// Position, normal, extent.
        what: &'static str,
        /// What was measured.
        got: f64,
        /// What the leaf says.
        bound: f64,
    },
}

/// Checks every volume, cone and torus over the given parameters, down to the leaves. The surface's own rounding
/// (16 units in the last place of its coordinates) is allowed for.
pub fn validate(
    surface: &Surface,
    tree: &SurfaceTree,
    parameters: impl IntoIterator<Item = DVec2>,
) -> Result<(), Broken> {
    let rounding = crate::kernel::tol::ROUNDING * surface.bounds().max_abs();
    for uv in parameters {
        let jet = surface.jet(uv, 1);
        // Where a derivative is down to rounding the normal means nothing.
        let length = jet.u().length().min(jet.v().length());
        let normal = jet.normal().filter(|_| length > 1e4 * rounding);
        let mut node = tree.node_over(tree.options().height, uv);
        if tree.torus(node).is_some() {
            torus(tree, node, uv, jet.p(), normal, rounding)?;
        }
        loop {
            volumes(tree, node, uv, jet.p(), normal, rounding)?;
            match tree.parent(node) {
                Some(parent) => node = parent,
                None => break,
            }
        }
        // From the top down to the patch.
        let patch = node.patch;
        let mut above = tree.root();
        while above.is_top() {
            volumes(tree, above, uv, jet.p(), normal, rounding)?;
            let Some(children) = tree.children(above) else { break };
            let holds = |id: NodeId| {
                let [low, high] = tree.rectangle(id);
                let [from, to] = tree.rectangle(NodeId::root_of(patch));
                low.cmple(from).all() && to.cmple(high).all()
            };
            above = if holds(children[0]) { children[0] } else { children[1] };
        }
    }
    Ok(())
}

fn volumes(
    tree: &SurfaceTree,
    id: NodeId,
    uv: DVec2,
    p: DVec3,
    normal: Option<DVec3>,
    rounding: f64,
) -> Result<(), Broken> {
    let node = tree.node(id);
    let local = p - tree.origin(id);
    let swept = node.rectangle().distance_to(local) - node.radius();
    let ball = local.distance(node.center()) - node.sphere_radius();
    for (volume, excess) in [("swept sphere", swept), ("bounding sphere", ball)] {
        if excess > rounding {
            return Err(Broken::Outside { node: id, uv, volume, excess });
        }
    }
    if let (Some(cone), Some(normal)) = (node.cone(), normal) {
        let angle = cone.axis.cross(normal).length().atan2(cone.axis.dot(normal));
        let half_angle = cone.half_angle();
        if angle > half_angle + 1e-9 {
            return Err(Broken::Normal { node: id, uv, angle, half_angle });
        }
    }
    Ok(())
}

fn torus(
    tree: &SurfaceTree,
    node: NodeId,
    uv: DVec2,
    p: DVec3,
    normal: Option<DVec3>,
    rounding: f64,
) -> Result<(), Broken> {
    let Some(torus) = tree.torus(node) else { return Ok(()) };
    let check = |what, got: f64, bound: f64, slack: f64| {
        // A bound that is not a number is broken too.
        if got <= bound + slack { Ok(()) } else { Err(Broken::Torus { node, uv, what, got, bound }) }
    };
    check("position", torus.distance(p).abs(), torus.deviation, rounding)?;
    let foot = torus.project(p);
    check("meridian extent", foot.x.abs(), torus.half[0], rounding)?;
    check("rotation extent", foot.y.abs(), torus.half[1], rounding)?;
    if let Some(normal) = normal {
        let at_foot = torus.normal_at(foot);
        let angle = at_foot.cross(normal).length().atan2(at_foot.dot(normal));
        check("normal", angle, torus.normal_deviation(), 1e-9)?;
        // Latitude and longitude of the normal on the Gauss sphere of the torus, whose poles are along the spine.
        let [meridian, rotation] = torus.half_angles_of_normals();
        let latitude = normal.dot(torus.e[0]).clamp(-1.0, 1.0).asin().abs();
        let longitude = normal.dot(torus.e[1]).atan2(normal.dot(torus.normal)).abs();
        check("meridian extent of normals", latitude, meridian, 1e-9)?;
        // Near a pole the longitude of a rounded normal means little.
        check("rotation extent of normals", longitude, rotation, 1e-9 / latitude.cos().max(1e-9))?;
    }
    Ok(())
}
