//! The constrained Delaunay triangulation inside an outline.
//!
//! What is inside is counted from the outer face inwards over the pieces of the outline, which is exact where a point test
//! would have to trust rounding. A piece that crosses others is cut there and counted as lost.

use std::collections::HashMap;

use glam::DVec2;
use spade::handles::{DirectedEdgeHandle, FaceHandle, InnerTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::Corner;
use crate::kernel::geom::Surface;

#[derive(Clone, Copy)]
struct Vertex {
    at: Point2<f64>,
    index: u32,
}

/// A triangle of the triangulation.
type Triangle<'a> = FaceHandle<'a, InnerTag, Vertex, (), CdtEdge<()>, ()>;
/// A side of one.
type Edge<'a> = DirectedEdgeHandle<'a, Vertex, (), CdtEdge<()>, ()>;

impl HasPosition for Vertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The triangles inside the outline. Where pieces of the outline cross, vertices are added.
pub(super) fn triangulated(
    places: &[DVec2],
    segments: &[[u32; 2]],
    vertices: &mut Vec<Corner>,
    lost: &mut usize,
    lines: &[Vec<f64>; 2],
    surface: &Surface,
) -> Vec<[u32; 3]> {
    // Numbers below the smallest that spade takes are none.
    let point =
        |p: DVec2| Point2::new(if p.x.abs() < 1e-30 { 0.0 } else { p.x }, if p.y.abs() < 1e-30 { 0.0 } else { p.y });
    let all: Vec<Vertex> = places.iter().enumerate().map(|(k, &p)| Vertex { at: point(p), index: k as u32 }).collect();
    // What coincides in the parameter plane is one vertex there: segments name the first of them.
    let mut seen = HashMap::new();
    let mut unique: Vec<Vertex> = Vec::with_capacity(all.len());
    let place_of: Vec<usize> = all
        .iter()
        .map(|v| {
            *seen.entry((v.at.x.to_bits(), v.at.y.to_bits())).or_insert_with(|| {
                unique.push(*v);
                unique.len() - 1
            })
        })
        .collect();
    let Ok(mut cdt) = ConstrainedDelaunayTriangulation::<Vertex>::bulk_load_cdt(unique, Vec::new()) else {
        *lost = segments.len();
        return Vec::new();
    };
    let handles: Vec<_> = cdt.fixed_vertices().collect();
    let mut uses: HashMap<(usize, usize), usize> = HashMap::with_capacity(segments.len());
    for s in segments {
        let [a, b] = s.map(|k| place_of[k as usize]);
        if a == b {
            continue;
        }
        *uses.entry((a.min(b), a.max(b))).or_insert(0_usize) += 1;
        if cdt.can_add_constraint(handles[a], handles[b]) {
            cdt.add_constraint(handles[a], handles[b]);
        } else {
            *lost += 1;
            cdt.add_constraint_and_split(handles[a], handles[b], |at| Vertex { at, index: u32::MAX });
        }
    }
    // Vertices where pieces of the outline cross.
    let mut own: HashMap<usize, u32> = HashMap::new();
    if *lost > 0 {
        for vertex in cdt.vertices().filter(|v| v.data().index == u32::MAX) {
            let at = vertex.position();
            let uv = |x: f64, line: &[f64]| {
                let cell = (x.max(0.0) as usize).min(line.len() - 2);
                line[cell] + (line[cell + 1] - line[cell]) * (x - cell as f64)
            };
            let uv = DVec2::new(uv(at.x, &lines[0]), uv(at.y, &lines[1]));
            own.insert(vertex.fix().index(), vertices.len() as u32);
            vertices.push(Corner { uv, point: surface.eval(surface.clamped(uv)) });
        }
    }
    // From the outer face inwards: every piece of the outline that is crossed changes sides, one that two pieces
    // share (a slit) twice. Counting is exact where a point test would have to trust rounding.
    let mut sides: HashMap<usize, bool> = HashMap::with_capacity(cdt.num_inner_faces());
    let mut queue: Vec<(Triangle<'_>, bool)> = Vec::new();
    let crossing = |edge: Edge<'_>| {
        let [a, b] = edge.vertices().map(|v| v.fix().index());
        edge.is_constraint_edge() && uses.get(&(a.min(b), a.max(b))).copied().unwrap_or(1) % 2 == 1
    };
    for edge in cdt.convex_hull() {
        if let Some(face) = edge.rev().face().as_inner().or_else(|| edge.face().as_inner()) {
            queue.push((face, crossing(edge)));
        }
    }
    let mut out = Vec::new();
    while let Some((face, inside)) = queue.pop() {
        if sides.insert(face.fix().index(), inside).is_some() {
            continue;
        }
        if inside {
            let index = |k: usize| {
                let v = face.vertices()[k];
                if v.data().index == u32::MAX { own.get(&v.fix().index()).copied() } else { Some(v.data().index) }
            };
            if let (Some(a), Some(b), Some(c)) = (index(0), index(1), index(2)) {
                out.push([a, b, c]);
            }
        }
        for edge in face.adjacent_edges() {
            if let Some(next) = edge.rev().face().as_inner()
                && !sides.contains_key(&next.fix().index())
            {
                queue.push((next, inside != crossing(edge)));
            }
        }
    }
    out
}
