//! A surface searched for self-intersections, with the record of the search: the nodes of the ternary tree, the windows
//! that failed their test, the converted leaves (thesis 4.2 and 6.1).

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::intersect::Engine;
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::self_ssi::record::{FailedWindow, NodeRole, NodeState, Record, TernaryNode};
use crate::kernel::self_ssi::{Evidence, SelfIntersectError, SelfIntersectOptions, self_intersect};
use crate::model::document::EntityId;
use crate::view::intersection::{Found, Subject};

/// The states of nodes in the order in which they are listed, each with its name, what it means, and its colour.
pub const STATES: [(NodeState, &str, &str, u32); 4] = [
    (NodeState::Injective, "Injective", "Proved free of self-intersection: its subtree is never looked at", 0x4c9f70),
    (
        NodeState::MiterPoint,
        "Miter point",
        "Proved to hold one miter point and its branch, nothing else: its subtree is never looked at",
        0x9a6fd0,
    ),
    (
        NodeState::CuspEdge,
        "Cusp edge",
        "Proved to hold one cusp edge and nothing else: its subtree is never looked at",
        0x3f8fd2,
    ),
    (NodeState::Split, "Split", "Nothing is proved: it is split into S1, Sm and S2", 0xe0a030),
];

/// The colour of what was proved at a coarser level, sRGB.
pub const SETTLED: u32 = 0x8d9b94;

/// The colour of a state, sRGB.
pub fn state_color(state: NodeState) -> u32 {
    STATES.iter().find(|s| s.0 == state).map_or(SETTLED, |s| s.3)
}

/// The name of a state.
pub fn state_name(state: NodeState) -> &'static str {
    STATES.iter().find(|s| s.0 == state).map_or("", |s| s.1)
}

/// Which child of its parent a node is, in the words of the thesis.
pub fn role_name(role: NodeRole) -> &'static str {
    match role {
        NodeRole::Root => "the whole surface",
        NodeRole::First => "S1",
        NodeRole::Middle => "Sm, over the border of S1 and S2",
        NodeRole::Last => "S2",
    }
}

/// The numbers of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelCount {
    /// Splits above its nodes.
    pub level: u32,
    /// Nodes that were visited.
    pub nodes: usize,
    /// How many of them are in which state, in the order of [`STATES`].
    pub states: [usize; 4],
    /// Whether its nodes are smaller than the cells of the grid.
    pub below_grid: bool,
}

/// A searched surface.
#[derive(Debug)]
pub struct Searched {
    /// What was found, with the surface as its only subject.
    pub found: Found,
    /// What the search did.
    pub record: Record,
    /// The same in numbers.
    pub evidence: Evidence,
    /// The numbers of all levels.
    pub levels: Vec<LevelCount>,
    /// How long search and record took.
    pub took: Duration,
    /// The places of the nodes of each level in the record.
    nodes: Vec<Vec<usize>>,
    /// The children of every node.
    children: Vec<Vec<usize>>,
}

impl Searched {
    /// Searches a surface and keeps the record.
    pub fn search(entity: EntityId, name: &str, surface: &Arc<Surface>, job: &Job) -> Result<Self, SelfIntersectError> {
        let begun = Instant::now();
        let options = SelfIntersectOptions { record: true, ..SelfIntersectOptions::default() };
        let answer = self_intersect(surface, 0, &options, job)?;
        let took = begun.elapsed();
        let record = answer.record.unwrap_or_default();
        let mut nodes = vec![Vec::new(); record.levels() as usize];
        let mut children = vec![Vec::new(); record.nodes.len()];
        for (at, node) in record.nodes.iter().enumerate() {
            nodes[node.level as usize].push(at);
            if let Some(of) = node.parent.and_then(|p| children.get_mut(p)) {
                of.push(at);
            }
        }
        let levels = (0..).zip(&nodes).map(|(level, all)| count(level, all, &record.nodes)).collect();
        let subject = Subject { id: entity, name: name.to_owned(), body: Body::Surface(Arc::clone(surface)) };
        let found = Found {
            subjects: vec![subject],
            result: answer.result,
            with_itself: true,
            engine: Engine::Bvh,
            hatches: Vec::new(),
            cancelled: job.is_cancelled(),
            warnings: job.warnings(),
        };
        Ok(Self { found, record, evidence: answer.evidence, levels, took, nodes, children })
    }

    /// The surface that was searched.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        self.found.surface(0)
    }

    /// The entity that was searched.
    pub fn entity(&self) -> Option<EntityId> {
        self.found.id(0)
    }

    /// A node by its place in the record.
    pub fn node(&self, at: usize) -> Option<&TernaryNode> {
        self.record.nodes.get(at)
    }

    /// The places of the nodes of one level.
    pub fn level(&self, level: u32) -> &[usize] {
        self.nodes.get(level as usize).map_or(&[], Vec::as_slice)
    }

    /// The nodes that cover the domain at a level: its own, and the coarser ones whose subtree was dropped.
    pub fn covering(&self, level: u32) -> impl Iterator<Item = usize> {
        let seen = move |n: &TernaryNode| n.level == level || (n.level < level && n.state != NodeState::Split);
        (0..self.record.nodes.len()).filter(move |&k| seen(&self.record.nodes[k]))
    }

    /// The node at a level under a parameter pair. Of several, because Sm overlaps its neighbours, the one whose middle
    /// is nearest; where the level has none, the finest coarser one that was settled.
    pub fn over(&self, level: u32, uv: DVec2) -> Option<usize> {
        let all = self.covering(level).filter(|&k| contains(&self.record.nodes[k].uv_box, uv));
        all.max_by(|&a, &b| {
            let (a, b) = (&self.record.nodes[a], &self.record.nodes[b]);
            let away = |n: &TernaryNode| off_center(&n.uv_box, uv);
            a.level.cmp(&b.level).then(away(b).total_cmp(&away(a)))
        })
    }

    /// The nodes that a node was split into.
    pub fn children(&self, at: usize) -> &[usize] {
        self.children.get(at).map_or(&[], Vec::as_slice)
    }

    /// The failed windows of a size.
    pub fn windows(&self, size: u32) -> impl Iterator<Item = &FailedWindow> {
        self.record.windows.iter().filter(move |w| w.size == size)
    }

    /// The failed window of a size around a parameter pair, the one whose middle is nearest.
    pub fn window_over(&self, size: u32, uv: DVec2) -> Option<&FailedWindow> {
        let all = self.windows(size).filter(|w| contains(&w.uv_box, uv));
        all.min_by(|a, b| off_center(&a.uv_box, uv).total_cmp(&off_center(&b.uv_box, uv)))
    }

    /// The leaf that was paired with the one around a parameter pair; of several, with the one whose middle is nearest.
    pub fn partner(&self, uv: DVec2) -> Option<[[f64; 2]; 2]> {
        let pairs = self.record.leaf_pairs.iter().flat_map(|[a, b]| [(a, b), (b, a)]);
        let around = pairs.filter(|(own, _)| contains(own, uv));
        around.min_by(|x, y| off_center(x.0, uv).total_cmp(&off_center(y.0, uv))).map(|(_, other)| *other)
    }

    /// The image of the border of a parameter box, a closed polyline.
    pub fn outline(&self, uv_box: [[f64; 2]; 2]) -> Vec<DVec3> {
        self.found.box_outline(0, uv_box)
    }

    /// The box in space around the image of a parameter box.
    pub fn bounds(&self, uv_box: [[f64; 2]; 2]) -> Aabb {
        Aabb::of(self.outline(uv_box))
    }
}

/// The low and the high corner of a parameter box.
pub fn corners([u, v]: [[f64; 2]; 2]) -> [DVec2; 2] {
    [DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1])]
}

fn contains(uv_box: &[[f64; 2]; 2], uv: DVec2) -> bool {
    let [low, high] = corners(*uv_box);
    uv.cmpge(low).all() && uv.cmple(high).all()
}

/// How far from the middle of a box, in its own half widths.
fn off_center(uv_box: &[[f64; 2]; 2], uv: DVec2) -> f64 {
    let [low, high] = corners(*uv_box);
    ((uv - 0.5 * (low + high)) / (0.5 * (high - low)).max(DVec2::splat(f64::MIN_POSITIVE))).abs().max_element()
}

fn count(level: u32, all: &[usize], nodes: &[TernaryNode]) -> LevelCount {
    let of = |state: NodeState| all.iter().filter(|&&k| nodes[k].state == state).count();
    let below_grid = all.iter().any(|&k| nodes[k].cells.is_none());
    LevelCount { level, nodes: all.len(), states: STATES.map(|s| of(s.0)), below_grid }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    /// (x, y^2, y^3 + (x^2 - 1/4) y): a loop of double points (x, +-sqrt(1/4 - x^2)) between two miter points (+-1/2, 0).
    pub(in crate::view::inspect) fn two_miters() -> Searched {
        // Control values of the powers of x in degree 2 and of y in degree 3 over [-1, 1].
        let (line, square) = ([-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]);
        let y = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0];
        let (y2, y3) = ([1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0], [-1.0, 1.0, -1.0, 1.0]);
        let at = |k: usize| {
            let (i, j) = (k % 3, k / 3);
            DVec3::new(line[i], y2[j], y3[j] + (square[i] - 0.25) * y[j])
        };
        let knots = [2, 3].map(|degree| Knots::bezier(degree, -1.0, 1.0).unwrap());
        let [u, v] = knots;
        let surface = Arc::new(Surface::new(u, v, (0..12).map(at).collect(), None).unwrap());
        Searched::search(EntityId(1), "two miter points", &surface, &Job::new()).unwrap()
    }

    fn area(uv_box: &[[f64; 2]; 2]) -> f64 {
        let [low, high] = corners(*uv_box);
        (high - low).element_product()
    }

    #[test]
    fn every_split_node_has_children_that_cover_it_and_settled_ones_have_none() {
        let searched = two_miters();
        let mut split = 0;
        for (at, node) in searched.record.nodes.iter().enumerate() {
            let below = searched.children(at);
            assert_eq!(below.is_empty(), node.state != NodeState::Split);
            if below.is_empty() {
                continue;
            }
            split += 1;
            // S1, Sc and S2 tile the node; Sm lies over Sc and into both sides.
            let sides: f64 = below
                .iter()
                .filter(|&&k| searched.record.nodes[k].role != NodeRole::Middle)
                .map(|&k| area(&searched.record.nodes[k].uv_box))
                .sum();
            let middle: f64 = below
                .iter()
                .filter(|&&k| searched.record.nodes[k].role == NodeRole::Middle)
                .map(|&k| area(&searched.record.nodes[k].uv_box))
                .sum();
            assert!(
                sides <= area(&node.uv_box) * (1.0 + 1e-12) && sides + middle >= area(&node.uv_box) * (1.0 - 1e-12)
            );
        }
        assert!(split > 0);
        let r = &searched.found.result;
        assert!(r.complete && (r.curves.len(), r.miters.len()) == (1, 2));
        assert_eq!(searched.record.leaves.len(), 2);
    }

    #[test]
    fn every_level_covers_the_domain() {
        let searched = two_miters();
        let [u, v] = searched.surface().unwrap().domain();
        let last = searched.levels.last().unwrap().level;
        for level in 0..=last {
            for k in 0..400 {
                let t = DVec2::new(f64::from(k % 20) + 0.37, f64::from(k / 20) + 0.61) / 20.0;
                let uv = DVec2::new(u[0] + (u[1] - u[0]) * t.x, v[0] + (v[1] - v[0]) * t.y);
                let node = searched.node(searched.over(level, uv).unwrap()).unwrap();
                assert!(contains(&node.uv_box, uv) && node.level <= level);
                assert!(node.level == level || node.state != NodeState::Split);
            }
        }
        let counted: usize = searched.levels.iter().map(|l| l.nodes).sum();
        assert_eq!(counted, searched.record.nodes.len());
    }
}
