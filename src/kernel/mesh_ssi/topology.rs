//! Points, their uses and segments: how the pieces of an intersection hang together (HJR99 section 4, Fig. 17).
//!
//! In the paper a Point is found again by its coordinates. Here it has a name, the edge of one mesh and the
//! triangle of the other whose meeting it is, so that two triangle pairs share a Point exactly when they share
//! that edge: rounding cannot tear a curve or glue two. Each segment uses two Points; a Point used other than
//! twice ends a curve (once: at the border of a mesh; more often: at a bifurcation).

use std::collections::HashMap;

use glam::DVec3;

use super::perturbed::{self, Sign};

/// Which of the two meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mesh {
    /// The first.
    A,
    /// The second.
    B,
}

/// The name of a point: where an edge of one mesh passes a triangle of the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PointKey {
    /// Whose edge.
    pub edge_of: Mesh,
    /// The vertices of the edge, the smaller index first.
    pub edge: [u32; 2],
    /// The triangle of the other mesh.
    pub triangle: u32,
}

/// A point of the intersection.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its name.
    pub key: PointKey,
    /// Where it is.
    pub position: DVec3,
    /// The segments that use it.
    pub uses: Vec<u32>,
}

/// A piece of the intersection inside one triangle of each mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Its two points.
    pub points: [u32; 2],
    /// The triangle of A and the triangle of B.
    pub triangles: [u32; 2],
}

/// All points and segments of an intersection.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// The points.
    pub points: Vec<Point>,
    /// The segments, in the order of the triangle pairs.
    pub segments: Vec<Segment>,
    /// Pairs of which one triangle has no area, so that no segment could be told. Their neighbours may end there.
    pub without_area: Vec<[u32; 2]>,
    names: HashMap<PointKey, u32>,
}

/// Vertices and triangles of one mesh.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// The vertices.
    pub points: &'a [DVec3],
    /// Indices of the vertices.
    pub triangles: &'a [[u32; 3]],
}

impl Triangles<'_> {
    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|k| self.points[k as usize])
    }
}

impl Topology {
    /// Intersects one triangle of A with one of B (HJR99 "Triangle intersection") and files the segment.
    pub fn add_pair(&mut self, a: Triangles<'_>, b: Triangles<'_>, pair: [u32; 2]) {
        let (ta, tb) = (a.corners(pair[0]), b.corners(pair[1]));
        let sides_a = ta.map(|p| perturbed::point_of_a(tb, p));
        if sides_a[0] == sides_a[1] && sides_a[1] == sides_a[2] && sides_a[0] != Sign::None {
            return;
        }
        let sides_b = tb.map(|p| perturbed::point_of_b(ta, p));
        if sides_b[0] == sides_b[1] && sides_b[1] == sides_b[2] && sides_b[0] != Sign::None {
            return;
        }
        if sides_a.contains(&Sign::None) || sides_b.contains(&Sign::None) {
            self.without_area.push(pair);
            return;
        }
        let mut found: [Option<u32>; 2] = [None; 2];
        let mut count = 0;
        for k in 0..3 {
            let next = (k + 1) % 3;
            if sides_a[k] != sides_a[next] && passes(|m| perturbed::edges([ta[k], ta[next]], [tb[m], tb[(m + 1) % 3]]))
            {
                let name = key(Mesh::A, a.triangles[pair[0] as usize], k, pair[1]);
                if count < 2 {
                    found[count] = Some(self.point(name, a, tb));
                }
                count += 1;
            }
            if sides_b[k] != sides_b[next] && passes(|m| perturbed::edges([ta[m], ta[(m + 1) % 3]], [tb[k], tb[next]]))
            {
                let name = key(Mesh::B, b.triangles[pair[1] as usize], k, pair[0]);
                if count < 2 {
                    found[count] = Some(self.point(name, b, ta));
                }
                count += 1;
            }
        }
        // In one consistent configuration two triangles meet in nothing or in one segment.
        if let ([Some(p), Some(q)], 2) = (found, count) {
            let segment = self.segments.len() as u32;
            self.segments.push(Segment { points: [p, q], triangles: pair });
            self.points[p as usize].uses.push(segment);
            self.points[q as usize].uses.push(segment);
        }
    }

    /// The number of the point with this name, made when it is new.
    fn point(&mut self, key: PointKey, edge_mesh: Triangles<'_>, triangle: [DVec3; 3]) -> u32 {
        *self.names.entry(key).or_insert_with(|| {
            let [p, q] = key.edge.map(|k| edge_mesh.points[k as usize]);
            self.points.push(Point { key, position: crossing(p, q, triangle), uses: Vec::new() });
            self.points.len() as u32 - 1
        })
    }

    /// The segment's other point.
    pub fn across(&self, segment: u32, point: u32) -> u32 {
        let [p, q] = self.segments[segment as usize].points;
        if p == point { q } else { p }
    }
}

/// Whether an edge passes all three edges of a triangle on the same side.
fn passes(side: impl Fn(usize) -> Sign) -> bool {
    let first = side(0);
    first != Sign::None && side(1) == first && side(2) == first
}

fn key(edge_of: Mesh, triangle: [u32; 3], k: usize, other: u32) -> PointKey {
    let (i, j) = (triangle[k], triangle[(k + 1) % 3]);
    PointKey { edge_of, edge: [i.min(j), i.max(j)], triangle: other }
}

/// Where the segment p q meets the plane of a triangle; clamped to the segment, its middle when it lies in the
/// plane.
fn crossing(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let (dp, dq) = (normal.dot(p - a), normal.dot(q - a));
    let t = dp / (dp - dq);
    p + (q - p) * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 }
}
