//! Indexed triangle meshes and how their triangles hang together: border loops, feature edges, non-manifold
//! edges.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::kernel::geom::Aabb;

/// A named run of triangles (an STL solid, an OBJ group).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Its name, possibly empty.
    pub name: String,
    /// Its triangles.
    pub triangles: Range<usize>,
}

/// A triangle mesh. Every index is below `points.len()` and every coordinate is finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    points: Arc<Vec<DVec3>>,
    triangles: Arc<Vec<[u32; 3]>>,
    /// Named runs of triangles, in order, not overlapping.
    pub groups: Vec<Group>,
}

/// Why numbers are no triangle mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {index}, there are {count}")]
    Index {
        /// Which triangle.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {index} is {point}, which is not finite")]
    NotFinite {
        /// Which vertex.
        index: usize,
        /// Its coordinates.
        point: DVec3,
    },
    /// There are more vertices than an index can name.
    #[error("{got} vertices, at most {limit} are possible")]
    TooMany {
        /// How many.
        got: usize,
        /// The limit.
        limit: usize,
    },
}

/// What is irregular about a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshDefects {
    /// Triangles with two equal vertices or no area.
    pub degenerate: usize,
    /// Triangles with the vertices of an earlier one.
    pub duplicate: usize,
    /// Edges of one triangle only.
    pub border_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
}

/// A chain of edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EdgeChain {
    /// Its vertices in order; the first one is repeated at the end of a closed chain.
    pub vertices: Vec<u32>,
    /// Whether it closes.
    pub closed: bool,
}

impl TriMesh {
    /// Checks and keeps a mesh of one unnamed group.
    pub fn new(points: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let count = points.len();
        if u32::try_from(count).is_err() {
            return Err(MeshError::TooMany { got: count, limit: u32::MAX as usize });
        }
        if let Some(index) = points.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { index, point: points[index] });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&k| k as usize >= count) {
                return Err(MeshError::Index { triangle, index, count });
            }
        }
        Ok(Self { points: Arc::new(points), triangles: Arc::new(triangles), groups: Vec::new() })
    }

    /// Names runs of triangles (name, first, one past the last); runs that are out of order or range are left out.
    pub fn set_groups(&mut self, groups: Vec<(String, usize, usize)>) {
        self.groups.clear();
        for (name, start, end) in groups {
            let behind = self.groups.last().map_or(0, |g| g.triangles.end);
            if behind <= start && start <= end && end <= self.triangles.len() {
                self.groups.push(Group { name, triangles: start..end });
            }
        }
    }

    /// A box around the vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.points.iter().copied())
    }

    /// The groups as meshes of their own, each with its vertices in the order in which its triangles use them; the
    /// mesh itself when it has no more than one.
    pub fn into_parts(self) -> Vec<(String, Self)> {
        if self.groups.len() < 2 {
            let name = self.groups.first().map(|g| g.name.clone()).unwrap_or_default();
            return vec![(name, self)];
        }
        let mut renamed = vec![u32::MAX; self.points.len()];
        let mut parts = Vec::with_capacity(self.groups.len());
        for group in &self.groups {
            let (mut points, mut used) = (Vec::new(), Vec::new());
            let mut triangles = Vec::with_capacity(group.triangles.len());
            for corners in &self.triangles[group.triangles.clone()] {
                triangles.push(corners.map(|k| {
                    let own = &mut renamed[k as usize];
                    if *own == u32::MAX {
                        *own = points.len() as u32;
                        points.push(self.points[k as usize]);
                        used.push(k);
                    }
                    *own
                }));
            }
            used.into_iter().for_each(|k| renamed[k as usize] = u32::MAX);
            let groups = vec![Group { name: group.name.clone(), triangles: 0..triangles.len() }];
            let (points, triangles) = (Arc::new(points), Arc::new(triangles));
            parts.push((group.name.clone(), Self { points, triangles, groups }));
        }
        parts
    }

    /// The vertices and the triangles, to be shared.
    pub fn shared(&self) -> (Arc<Vec<DVec3>>, Arc<Vec<[u32; 3]>>) {
        (Arc::clone(&self.points), Arc::clone(&self.triangles))
    }

    /// The vertices.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The triangles as indices of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|k| self.points[k as usize])
    }

    /// Twice the area of a triangle along its normal; zero for a degenerate one.
    pub fn area_vector(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// The sum of the areas of all triangles.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| 0.5 * self.area_vector(t).length()).sum()
    }

    /// The volume inside a closed mesh, negative where its triangles look inwards.
    pub fn volume(&self) -> f64 {
        let origin = self.points.first().copied().unwrap_or_default();
        let tetrahedron = |t: usize| {
            let [a, b, c] = self.corners(t).map(|p| p - origin);
            a.dot(b.cross(c))
        };
        (0..self.triangles.len()).map(tetrahedron).sum::<f64>() / 6.0
    }

    /// Turns every triangle over.
    pub fn reverse(&mut self) {
        Arc::make_mut(&mut self.triangles).iter_mut().for_each(|t| t.swap(1, 2));
    }

    /// All uses of edges by triangles, sorted by edge.
    fn edge_uses(&self) -> Vec<([u32; 2], u32)> {
        let mut uses: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * self.triangles.len());
        for (t, [a, b, c]) in self.triangles.iter().enumerate() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if p != q {
                    uses.push(([*p.min(q), *p.max(q)], t as u32));
                }
            }
        }
        uses.par_sort_unstable();
        uses
    }

    /// Counts what is irregular. O(n log n).
    pub fn defects(&self) -> MeshDefects {
        let mut defects = MeshDefects::default();
        let mut seen: Vec<[u32; 3]> = Vec::with_capacity(self.triangles.len());
        for (t, &corners) in self.triangles.iter().enumerate() {
            let [a, b, c] = corners;
            defects.degenerate += usize::from(a == b || b == c || c == a || self.area_vector(t) == DVec3::ZERO);
            let mut sorted = corners;
            sorted.sort_unstable();
            seen.push(sorted);
        }
        seen.sort_unstable();
        defects.duplicate = seen.windows(2).filter(|w| w[0] == w[1]).count();
        for uses in self.edge_uses().chunk_by(|a, b| a.0 == b.0) {
            match uses.len() {
                1 => defects.border_edges += 1,
                2 => {}
                _ => defects.non_manifold_edges += 1,
            }
        }
        defects
    }

    /// The chains of edges that belong to one triangle only: the borders and holes of the mesh.
    pub fn border_loops(&self) -> Vec<EdgeChain> {
        self.border_loops_and_feature_edges(std::f64::consts::PI).0
    }

    /// The chains of edges at which two triangles' normals differ by more than `angle` (radians), together with
    /// the edges of more than two triangles. Degenerate triangles do not count.
    pub fn feature_edges(&self, angle: f64) -> Vec<EdgeChain> {
        self.border_loops_and_feature_edges(angle).1
    }

    /// Both in one pass: O(n log n).
    pub fn border_loops_and_feature_edges(&self, angle: f64) -> (Vec<EdgeChain>, Vec<EdgeChain>) {
        let cosine = angle.cos();
        let normal = |t: u32| self.area_vector(t as usize).try_normalize();
        let (mut border, mut sharp) = (Vec::new(), Vec::new());
        for uses in self.edge_uses().chunk_by(|a, b| a.0 == b.0) {
            match uses {
                [(edge, _)] => border.push(*edge),
                [(edge, s), (_, t)] => {
                    if let (Some(a), Some(b)) = (normal(*s), normal(*t))
                        && a.dot(b) < cosine
                    {
                        sharp.push(*edge);
                    }
                }
                [(edge, _), ..] => sharp.push(*edge),
                [] => {}
            }
        }
        (chains(border), chains(sharp))
    }
}

/// Joins edges to chains that break where other than two of them meet.
fn chains(edges: Vec<[u32; 2]>) -> Vec<EdgeChain> {
    let mut ends: Vec<(u32, usize)> = edges.iter().enumerate().flat_map(|(k, e)| e.map(|v| (v, k))).collect();
    ends.sort_unstable();
    let at_vertex = |v: u32| {
        let start = ends.partition_point(|e| e.0 < v);
        let count = ends[start..].partition_point(|e| e.0 == v);
        &ends[start..start + count]
    };
    let mut used = vec![false; edges.len()];
    let mut out = Vec::new();
    let mut follow = |first: usize, start: u32, used: &mut Vec<bool>| {
        let mut vertices = vec![start];
        let (mut edge, mut at) = (first, start);
        loop {
            used[edge] = true;
            let [p, q] = edges[edge];
            at = if p == at { q } else { p };
            vertices.push(at);
            let here = at_vertex(at);
            match here.iter().find(|e| !used[e.1]) {
                Some(next) if here.len() == 2 && at != start => edge = next.1,
                _ => break,
            }
        }
        let closed = at == start;
        out.push(EdgeChain { vertices, closed });
    };
    for &(vertex, edge) in &ends {
        if !used[edge] && at_vertex(vertex).len() != 2 {
            follow(edge, vertex, &mut used);
        }
    }
    for (k, edge) in edges.iter().enumerate() {
        if !used[k] {
            follow(k, edge[0], &mut used);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unit cube without its top: 10 triangles.
    fn open_box() -> TriMesh {
        let corner = |k: usize| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
        let faces = [[0, 2, 3, 1], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        TriMesh::new((0..8).map(corner).collect(), triangles).unwrap()
    }

    #[test]
    fn an_open_box_has_one_square_border_and_sharp_edges() {
        let mesh = open_box();
        assert!((mesh.area() - 5.0).abs() < 1e-15);
        let border = mesh.border_loops();
        assert_eq!((border.len(), border[0].closed, border[0].vertices.len()), (1, true, 5));
        assert!(border[0].vertices.iter().all(|&v| mesh.points()[v as usize].z == 1.0));
        let features = mesh.feature_edges(0.5);
        // Four edges up and four around the floor; three meet at each floor corner, so every one stands alone.
        assert_eq!(features.len(), 8);
        assert!(mesh.feature_edges(1.7).is_empty());
    }

    #[test]
    fn defects_are_counted() {
        let mut triangles = open_box().triangles().to_vec();
        triangles.extend([[2, 3, 0], [1, 1, 4], [0, 1, 7]]);
        let mesh = TriMesh::new(open_box().points().to_vec(), triangles).unwrap();
        let defects = mesh.defects();
        assert_eq!((defects.degenerate, defects.duplicate), (1, 1));
        assert!(defects.non_manifold_edges >= 3);
    }

    #[test]
    fn bad_meshes_are_named() {
        let points = vec![DVec3::ZERO, DVec3::X];
        assert_eq!(TriMesh::new(points, vec![[0, 1, 2]]), Err(MeshError::Index { triangle: 0, index: 2, count: 2 }));
        assert!(matches!(
            TriMesh::new(vec![DVec3::new(0.0, f64::NAN, 0.0)], vec![]),
            Err(MeshError::NotFinite { index: 0, .. })
        ));
    }
}
