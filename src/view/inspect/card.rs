//! Everything that is said of one node, and the nodes below it.

use glam::DVec2;

use crate::kernel::bvh::{NodeId, OsculatingTorus, SurfaceTree};

/// The torus of a node in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorusCard {
    /// The torus.
    pub torus: OsculatingTorus,
    /// The radii of spine circle and tube; `None` where one is infinite.
    pub radii: Option<[f64; 2]>,
    /// Whether it is a leaf's, which is what intersections use.
    pub leaf: bool,
}

/// A node in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeCard {
    /// Which node.
    pub id: NodeId,
    /// Its quadtree level.
    pub level: u32,
    /// The parameters over which it lies: low and high corner.
    pub rectangle: [DVec2; 2],
    /// Half the edges of its rectangle in space.
    pub half: [f64; 2],
    /// The radius that sweeps the rectangle.
    pub radius: f64,
    /// The radius of its bounding sphere.
    pub sphere: f64,
    /// Half the angle of its normal cone in degrees; `None` when wider than a half space.
    pub cone: Option<f64>,
    /// Its torus; none for a Bezier patch as a whole.
    pub torus: Option<TorusCard>,
}

impl NodeCard {
    /// What is known of a node.
    pub fn new(tree: &SurfaceTree, id: NodeId) -> Self {
        let node = tree.node(id);
        let torus = tree.torus(id).map(|torus| TorusCard {
            radii: torus.radii().map(|whole| [whole.major, whole.minor]),
            torus,
            leaf: tree.children(id).is_none(),
        });
        Self {
            id,
            level: id.depth() / 2,
            rectangle: tree.rectangle(id),
            half: node.half(),
            radius: node.radius(),
            sphere: node.sphere_radius(),
            cone: node.cone().map(|cone| cone.half_angle().to_degrees()),
            torus,
        }
    }
}

/// The nodes one quadtree level below a node: four, or none below a leaf.
pub fn children(tree: &SurfaceTree, id: NodeId) -> Vec<NodeId> {
    let below = tree.children(id).into_iter().flatten();
    below
        .flat_map(|child| match tree.children(child) {
            // One binary split is half a quadtree level.
            Some(grandchildren) if child.depth() % 2 == 1 => grandchildren.to_vec(),
            _ => vec![child],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::bvh::BvhOptions;
    use crate::view::display::tests::sphere;

    #[test]
    fn the_children_of_a_node_tile_its_rectangle_and_leaves_have_none() {
        let tree = SurfaceTree::new(&sphere(), &BvhOptions { height: 2, ..BvhOptions::default() }).unwrap();
        for id in tree.level(1) {
            let below = children(&tree, id);
            assert_eq!(below.len(), 4);
            let area = |id| {
                let [low, high] = tree.rectangle(id);
                (high - low).x * (high - low).y
            };
            let sum: f64 = below.iter().map(|c| area(*c)).sum();
            assert!((sum - area(id)).abs() < 1e-12);
            let card = NodeCard::new(&tree, id);
            assert_eq!((card.level, card.rectangle), (1, tree.rectangle(id)));
        }
        assert!(tree.level(2).into_iter().all(|id| children(&tree, id).is_empty()));
    }

    #[test]
    fn the_torus_of_a_leaf_of_a_unit_sphere_has_radii_that_add_up_to_one() {
        let tree = SurfaceTree::new(&sphere(), &BvhOptions { height: 3, ..BvhOptions::default() }).unwrap();
        let mut finite = 0;
        for id in tree.level(3) {
            let torus = NodeCard::new(&tree, id).torus.unwrap();
            assert!(torus.leaf);
            if let Some([major, minor]) = torus.radii {
                // Both curvatures are 1, so the spine circle shrinks to the centre.
                assert!(major < 0.05 && (minor - 1.0).abs() < 0.05, "{major} {minor}");
                finite += 1;
            }
        }
        assert!(finite > 0);
        let root = NodeCard::new(&tree, NodeId::root_of(0));
        assert!(root.torus.is_none() && root.level == 0);
    }
}
