//! The borders of meshes and blocks: free, or shared within tolerance with another body or with another border of the same
//! mesh.
//!
//! The triangles of a mesh say themselves which of its edges are shared exactly; what they do not say is that two
//! borders lie on one another within the tolerance, as where a mesh was written in pieces that were rounded apart, where
//! one side of a crack has more vertices than the other (T-junctions), or where it ends on a surface. A border is looked at
//! as that of a surface is. Of its own mesh, what is within [`AROUND`] tolerances along the border, or across one of its
//! ends, is no neighbour but the border itself. The normal at a border is the mean of those of the triangles at its
//! vertices, weighted by area.
//!
//! Feature edges of a mesh stay what they are; the border lines of a block that is a solid are feature edges where nothing
//! else is near, as two of its faces meet there. Cost: a closest point a sample and neighbour, and one look at every triangle.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::borders::{near_to, places, stretches};
use super::{EdgeKind, EdgeOptions, EdgePiece, Near, Part};
use crate::kernel::geom::Aabb;
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::facets::{FacetCurve, FacetCurveKind, Facets};
use crate::kernel::mesh::surface_set::Scratch;
use crate::kernel::mesh::tri_tree::{Nearest, TriTree};
use crate::view::display::CurveRef;

/// What is nearer than this many joining tolerances along a border is the border itself.
const AROUND: f64 = 3.0;

/// The polylines that bound a mesh, with a tree over their segments.
struct Rims {
    /// By the curve's place among those of the mesh; without points for what is no border.
    rims: Vec<Rim>,
    tree: TriTree,
    /// The curve and the place in it of every segment of the tree.
    of_segment: Vec<[u32; 2]>,
}

#[derive(Default)]
struct Rim {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// Length up to each point.
    arcs: Vec<f64>,
}

impl Rim {
    fn length(&self) -> f64 {
        self.arcs.last().copied().unwrap_or(0.0)
    }

    fn closed(&self) -> bool {
        self.points.len() > 3 && self.points.first() == self.points.last()
    }

    /// Point, normal and length at a fraction of the length.
    fn at(&self, part: f64) -> (DVec3, Option<DVec3>, f64) {
        let arc = part * self.length();
        let k = self.arcs.partition_point(|a| *a <= arc).clamp(1, self.points.len() - 1);
        let width = self.arcs[k] - self.arcs[k - 1];
        let f = if width > 0.0 { ((arc - self.arcs[k - 1]) / width).clamp(0.0, 1.0) } else { 0.0 };
        (self.points[k - 1].lerp(self.points[k], f), self.normal(k - 1, f), arc)
    }

    /// The normal at a fraction of a segment.
    fn normal(&self, segment: usize, f: f64) -> Option<DVec3> {
        self.normals[segment].lerp(self.normals[segment + 1], f).try_normalize()
    }
}

fn bits(p: DVec3) -> [u64; 3] {
    (p + DVec3::ZERO).to_array().map(f64::to_bits)
}

impl Rims {
    fn new(facets: &Facets) -> Self {
        let mut rims: Vec<Rim> = Vec::new();
        let mut normals: HashMap<[u64; 3], DVec3> = HashMap::new();
        for curve in facets.curves() {
            let mut rim = Rim::default();
            if is_border(curve) {
                rim.points = curve.curve.points().to_vec();
                rim.arcs.push(0.0);
                for pair in rim.points.windows(2) {
                    rim.arcs.push(rim.length() + pair[0].distance(pair[1]));
                }
                normals.extend(rim.points.iter().map(|&p| (bits(p), DVec3::ZERO)));
            }
            rims.push(rim);
        }
        let mesh = facets.mesh();
        // A border vertex has a triangle or a few; most vertices are no border, and are found out by one look.
        let on_rim: Vec<bool> = mesh.points().par_iter().map(|&p| normals.contains_key(&bits(p))).collect();
        for (t, corners) in mesh.triangles().iter().enumerate() {
            for &k in corners.iter().filter(|&&k| on_rim[k as usize]) {
                if let Some(normal) = normals.get_mut(&bits(mesh.points()[k as usize])) {
                    *normal += mesh.area_vector(t);
                }
            }
        }
        let (mut points, mut segments, mut of_segment) = (Vec::new(), Vec::new(), Vec::new());
        for (k, rim) in rims.iter_mut().enumerate() {
            let normal = |p: &DVec3| normals.get(&bits(*p)).map_or(DVec3::ZERO, |n| n.normalize_or_zero());
            rim.normals = rim.points.iter().map(normal).collect();
            // Segments are triangles with two equal corners.
            for (s, pair) in rim.points.windows(2).enumerate() {
                let first = points.len() as u32;
                points.extend(pair);
                segments.push([first, first + 1, first + 1]);
                of_segment.push([k as u32, s as u32]);
            }
        }
        Self { tree: TriTree::new(points, &segments), rims, of_segment }
    }

    /// The nearest place of another border, or of the same one further along, within the tolerance: its distance and normal.
    fn other_side(
        &self,
        curve: usize,
        (p, arc): (DVec3, f64),
        tol: f64,
        found: &mut Vec<Nearest>,
    ) -> Option<(f64, Option<DVec3>)> {
        let own = &self.rims[curve];
        let around = AROUND * tol;
        let length = own.length();
        let end = if own.closed() {
            None
        } else if arc <= around {
            own.points.first()
        } else if length - arc <= around {
            own.points.last()
        } else {
            None
        };
        self.tree.within(p, tol, found);
        found.iter().find_map(|near| {
            let [c, s] = self.of_segment[near.triangle as usize].map(|k| k as usize);
            let rim = &self.rims[c];
            let f = (near.barycentric.y + near.barycentric.z).clamp(0.0, 1.0);
            if c == curve {
                let along = (arc - (rim.arcs[s] + f * (rim.arcs[s + 1] - rim.arcs[s]))).abs();
                let along = if own.closed() { along.min(length - along) } else { along };
                if along <= around {
                    return None;
                }
            } else if end.is_some_and(|end| end.distance(near.point) <= 2.0 * around) {
                return None;
            }
            Some((near.distance, rim.normal(s, f)))
        })
    }
}

fn is_border(curve: &FacetCurve) -> bool {
    matches!(curve.kind, FacetCurveKind::Border | FacetCurveKind::GridBorder)
}

/// The borders and feature edges of a mesh, and the border lines of a block.
pub(super) fn rims(parts: &[Part], own: &Part, options: &EdgeOptions, job: &Job, out: &mut Vec<EdgePiece>) {
    let Body::Facets(facets) = &own.body else { return };
    let rims = Rims::new(facets);
    // The faces of a block meet in its border lines: only a mesh can lie on itself.
    let mesh = facets.grid().is_none();
    let solid = facets.grid().is_some_and(|grid| !grid.counts().contains(&1) && grid.blank().is_none());
    let pieces: Vec<Vec<EdgePiece>> = facets
        .curves()
        .par_iter()
        .enumerate()
        .map(|(k, chain)| {
            let (curve, range) = (CurveRef::Chain(own.id, k as u32), chain.curve.domain());
            let whole = |kind| {
                let neighbours = Vec::new();
                vec![EdgePiece { curve, range, kind, neighbours, max_gap: 0.0, max_angle: 0.0 }]
            };
            match chain.kind {
                FacetCurveKind::GridLine => return Vec::new(),
                FacetCurveKind::Feature => return whole(EdgeKind::Feature),
                FacetCurveKind::Border | FacetCurveKind::GridBorder => {}
            }
            if job.is_cancelled() {
                return Vec::new();
            }
            let others = near_to(parts, own, &Aabb::of(rims.rims[k].points.iter().copied()), options);
            let tol = options.joining_tol;
            let (mut scratch, mut found) = (Scratch::default(), Vec::new());
            let look = |t: f64| {
                let (p, normal, arc) = rims.rims[k].at((t - range[0]) / (range[1] - range[0]));
                let mut near = Near::default();
                if mesh && let Some((distance, other)) = rims.other_side(k, (p, arc), tol, &mut found) {
                    near.meet(own.id, distance, [normal, other]);
                }
                near.meet_all(p, normal, &others, tol, &mut scratch);
                near
            };
            let mut pieces = Vec::new();
            stretches(curve, range, &places(&chain.curve.knots().breaks(), options), look, options, &mut pieces);
            for piece in pieces.iter_mut().filter(|piece| solid && piece.kind == EdgeKind::Free) {
                piece.kind = EdgeKind::Feature;
            }
            pieces
        })
        .collect();
    out.extend(pieces.into_iter().flatten());
}
