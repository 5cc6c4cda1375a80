//! One side of a mesh intersection: a triangulation, with or without the parametric surface behind it.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::topology::Triangles;
use crate::kernel::geom::Surface;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::tessellate::{TessellateOptions, tessellate};
use crate::kernel::mesh::tri_tree::TriTree;

/// A triangulated body with its tree. Separate lists of vertices and of their parameters (HJR99
/// "Triangulation"); the parameters follow the vertices, which are kept once per knot line.
#[derive(Clone, Debug)]
pub struct Sheet {
    points: Arc<Vec<DVec3>>,
    triangles: Arc<Vec<[u32; 3]>>,
    uv: Vec<DVec2>,
    tree: TriTree,
    surface: Option<Arc<Surface>>,
    /// Whether the tessellation's cap made it coarser than asked for.
    pub capped: bool,
}

impl Sheet {
    /// Triangulates a surface to a chord tolerance, or takes a mesh as it is.
    pub fn new(body: &Body, chord_tol: f64) -> Self {
        // Of a face the whole surface, too: curves are cut down to it at the end.
        let (points, triangles, uv, surface, capped) = match (body, body.surface()) {
            (_, Some(surface)) => {
                let mesh = tessellate(surface, &TessellateOptions::new(chord_tol));
                (mesh.points, mesh.triangles, mesh.uv, Some(Arc::clone(surface)), mesh.capped)
            }
            (Body::Facets(facets), None) => {
                let (points, triangles) = facets.mesh().shared();
                (points, triangles, Vec::new(), None, false)
            }
            // Not reached: what has no surface is a mesh.
            (_, None) => Default::default(),
        };
        let tree = TriTree::new(points.to_vec(), &triangles);
        Self { points, triangles, uv, tree, surface, capped }
    }

    /// The surface behind the triangles.
    pub fn surface(&self) -> Option<&Arc<Surface>> {
        self.surface.as_ref()
    }

    /// The triangles.
    pub fn triangles(&self) -> Triangles<'_> {
        Triangles { points: &self.points, triangles: &self.triangles }
    }

    /// The tree over them.
    pub fn tree(&self) -> &TriTree {
        &self.tree
    }

    /// A corner of a triangle and its unit normal, zero for a triangle without area.
    pub fn plane(&self, triangle: u32) -> (DVec3, DVec3) {
        let [a, b, c] = self.triangles[triangle as usize].map(|k| self.points[k as usize]);
        (a, (b - a).cross(c - a).normalize_or_zero())
    }

    /// The parameters of the corners of a triangle of a surface.
    pub fn corner_uv(&self, triangle: u32) -> [DVec2; 3] {
        self.triangles[triangle as usize].map(|k| self.uv_of(k))
    }

    /// The end points of an edge.
    pub fn edge(&self, edge: [u32; 2]) -> [DVec3; 2] {
        edge.map(|k| self.points[k as usize])
    }

    /// Parameters of a point of a triangle by its barycentric coordinates (HJR99 (9)); for a mesh without
    /// parameters the number of the triangle, so that a result still says where it lies.
    pub fn uv_in(&self, triangle: u32, p: DVec3) -> DVec2 {
        if self.uv.is_empty() {
            return DVec2::new(f64::from(triangle), 0.0);
        }
        let corners = self.triangles[triangle as usize];
        let [a, b, c] = corners.map(|k| self.points[k as usize]);
        let normal = (b - a).cross(c - a);
        let area = normal.length_squared();
        let wb = normal.dot((p - a).cross(c - a)) / area;
        let wc = normal.dot((b - a).cross(p - a)) / area;
        let [ua, ub, uc] = corners.map(|k| self.uv[k as usize]);
        let uv = ua + (ub - ua) * wb + (uc - ua) * wc;
        if uv.is_finite() { uv } else { (ua + ub + uc) / 3.0 }
    }

    /// Parameters of a vertex.
    pub fn uv_of(&self, vertex: u32) -> DVec2 {
        self.uv.get(vertex as usize).copied().unwrap_or_default()
    }

    /// Parameters on an edge, at the fraction at which a point divides it.
    pub fn uv_on(&self, edge: [u32; 2], p: DVec3) -> DVec2 {
        if self.uv.is_empty() {
            return DVec2::ZERO;
        }
        let [a, b] = edge.map(|k| self.points[k as usize]);
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        let [ua, ub] = edge.map(|k| self.uv[k as usize]);
        ua + (ub - ua) * if t.is_finite() { t } else { 0.5 }
    }
}
