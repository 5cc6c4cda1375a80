//! One level of the ternary tree laid over its surface: a mesh in the colours of what was proved.
//!
//! Nodes of one level overlap, because Sm lies over the border of S1 and S2. The mesh is a raster of the lines of all
//! nodes of the level, so that overlaps are drawn once: in the state that leaves most to do, since that part of the
//! domain is looked at further. Cost: the product of the lines in both directions; beyond [`MOST_CELLS`] there is no mesh.

use glam::{DVec2, DVec3};

use super::search::{STATES, Searched, corners};

/// The most cells of the mesh.
pub const MOST_CELLS: usize = 1 << 17;
/// The least number of columns and rows, so that the mesh follows the surface.
const LEAST: u32 = 48;
/// The colour number of what was settled at a coarser level.
pub const SETTLED_AT: usize = STATES.len();

/// A level as a mesh. Four vertices a cell, two triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LevelMesh {
    /// Which level.
    pub level: u32,
    /// Vertices.
    pub points: Vec<DVec3>,
    /// Unit normals; zero where there is none.
    pub normals: Vec<DVec3>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex the place of its state in [`STATES`], or [`SETTLED_AT`].
    pub states: Vec<usize>,
    /// Whether the level has more cells than are drawn.
    pub too_fine: bool,
}

impl LevelMesh {
    /// Lays a level over its surface.
    pub fn new(searched: &Searched, level: u32) -> Self {
        let mut out = Self { level, ..Self::default() };
        let Some(surface) = searched.surface() else { return out };
        let covering: Vec<usize> = searched.covering(level).collect();
        let nodes: Vec<_> = covering.iter().filter_map(|&k| searched.node(k)).collect();
        let domain = surface.domain();
        let breaks = surface.knots().each_ref().map(|k| k.breaks());
        let lines = [0, 1].map(|d| {
            let [low, high] = domain[d];
            let even = (0..=LEAST).map(|k| low + (high - low) * f64::from(k) / f64::from(LEAST));
            // Creases lie on knots.
            let own = nodes.iter().flat_map(|n| n.uv_box[d]).chain(breaks[d].iter().copied());
            let mut all: Vec<f64> = own.chain(even).filter(|t| (low..=high).contains(t)).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        });
        let [width, height] = lines.each_ref().map(|l| l.len().saturating_sub(1));
        if width * height > MOST_CELLS {
            out.too_fine = true;
            return out;
        }
        // The larger number wins: what is split leaves most to do.
        let mut shown: Vec<Option<usize>> = vec![None; width * height];
        for node in &nodes {
            let state = if node.level < level { None } else { STATES.iter().position(|s| s.0 == node.state) };
            let rank = state.map_or(0, |s| s + 1);
            let range = |d: usize| {
                let at = |t: f64| lines[d].partition_point(|l| *l < t);
                at(node.uv_box[d][0])..at(node.uv_box[d][1])
            };
            for j in range(1) {
                for i in range(0) {
                    let cell = &mut shown[j * width + i];
                    *cell = Some(cell.map_or(rank, |old| old.max(rank)));
                }
            }
        }
        for j in 0..height {
            for i in 0..width {
                let Some(rank) = shown[j * width + i] else { continue };
                let [low, high] = corners([[lines[0][i], lines[0][i + 1]], [lines[1][j], lines[1][j + 1]]]);
                let first = out.points.len() as u32;
                for uv in [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)] {
                    let jet = surface.jet(uv, 1);
                    out.points.push(jet.p());
                    out.normals.push(jet.normal().unwrap_or(DVec3::ZERO));
                    out.states.push(rank.checked_sub(1).unwrap_or(SETTLED_AT));
                }
                out.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
        out
    }

    /// Whether a state occurs in it, by its place in [`STATES`] or [`SETTLED_AT`].
    pub fn has(&self, state: usize) -> bool {
        self.states.contains(&state)
    }
}

#[cfg(test)]
mod tests {
    use super::super::search::tests::two_miters;
    use super::*;
    use crate::kernel::self_ssi::record::NodeState;

    #[test]
    fn the_mesh_of_every_level_covers_the_surface_once() {
        let searched = two_miters();
        let [u, v] = searched.surface().unwrap().domain();
        for level in 0..searched.levels.len() as u32 {
            let mesh = LevelMesh::new(&searched, level);
            assert!(!mesh.too_fine && mesh.points.len() == mesh.states.len());
            assert_eq!(mesh.triangles.len() * 2, mesh.points.len());
            // Every cell is there: as many as the product of columns and rows.
            let corner = |uv: DVec2| {
                let p = searched.surface().unwrap().eval(uv);
                mesh.points.iter().filter(|q| q.distance(p) < 1e-12).count()
            };
            assert!(corner(DVec2::new(u[0], v[0])) >= 1 && corner(DVec2::new(u[1], v[1])) >= 1);
        }
    }

    #[test]
    fn a_split_part_is_drawn_as_split_even_under_a_settled_one() {
        let searched = two_miters();
        let last = searched.levels.len() as u32 - 1;
        let split = STATES.iter().position(|s| s.0 == NodeState::Split).unwrap();
        for level in 0..=last {
            let mesh = LevelMesh::new(&searched, level);
            let expected = searched.levels[level as usize].states[split] > 0;
            assert_eq!(mesh.has(split), expected, "{level}");
            assert_eq!(
                mesh.has(SETTLED_AT),
                searched.covering(level).any(|k| { searched.node(k).is_some_and(|n| n.level < level) })
            );
        }
    }
}
