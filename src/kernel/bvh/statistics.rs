//! What a level of a hierarchy looks like in numbers.

use super::tree::SurfaceTree;

/// A quadtree level.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Its number; 0 is the Bezier patches.
    pub level: u32,
    /// Nodes, counting cut off ones above for what is below them.
    pub nodes: usize,
    /// Bytes of these nodes, and of their tori at the last level.
    pub bytes: usize,
    /// The largest radius of a swept sphere: how far the surface strays from the rectangles.
    pub largest_radius: f64,
    /// The largest half angle of a normal cone in radians; `None` where a node has no cone.
    pub largest_cone: Option<f64>,
    /// The largest deviation of a torus; at the last level only.
    pub largest_deviation: Option<f64>,
}

impl SurfaceTree {
    /// Counts and largest errors of one quadtree level. Builds the nodes that nobody asked for before.
    pub fn summary(&self, level: u32) -> Summary {
        let nodes = self.level(level);
        let last = level >= self.options().height && level > 0;
        let mut summary = Summary {
            level,
            nodes: nodes.len(),
            bytes: nodes.len() * size_of::<super::Node>(),
            largest_radius: 0.0,
            largest_cone: Some(0.0),
            largest_deviation: last.then_some(0.0),
        };
        for id in nodes {
            let node = self.node(id);
            summary.largest_radius = summary.largest_radius.max(node.radius());
            let cone = node.cone().map(|c| c.half_angle());
            summary.largest_cone = summary.largest_cone.zip(cone).map(|(a, b)| a.max(b));
            if last && let Some(torus) = self.patches()[id.patch as usize].torus(id.index) {
                summary.bytes += size_of_val(torus);
                summary.largest_deviation = summary.largest_deviation.map(|d| d.max(torus.deviation()));
            }
        }
        summary
    }

    /// All levels.
    pub fn summaries(&self) -> Vec<Summary> {
        (0..=self.options().height).map(|level| self.summary(level)).collect()
    }
}
