//! Which stretches of which curves offer themselves as sides of a patch, and what they mean.
//!
//! Every border of every surface and every edge of every face is sampled; at each place it is free (no other surface within the joining tolerance),
//! shared with one (exactly, or with a gap that is open but within the tolerance), or non-manifold (two or more). Where
//! the kind changes between two samples, the place is found by bisection, so a border that is half covered by a
//! neighbour gives a shared and a free stretch. A shared stretch whose normals turn by more than the feature angle is
//! a feature edge; so is a crease inside a surface (a knot of full multiplicity). The seam of a closed surface is
//! shared with itself. Poles are no edges. Normals are compared without their sign: neighbours in real files are
//! not oriented alike. The borders of meshes and blocks are looked at in the same way ([`rims`]), and meshes are
//! neighbours as surfaces are.
//!
//! Cost: a closest point a sample and neighbour, some microseconds each; meant for a worker. A kind that shows at
//! one sample only, between two that agree, is taken as chance (a surface that crosses there) and passed over.

mod borders;
mod creases;
mod kinds;
mod rims;

pub use kinds::{EdgeKind, EdgeOptions, EdgePiece, Edges, LinePattern};

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::display::CurveRef;
use crate::kernel::geom::Aabb;
use crate::kernel::geom::trim::Sheet;
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::surface_set::{OnSurface, Scratch, SurfaceSet};
use crate::model::document::{Document, EntityId, Shape};

/// Something that borders can be near to.
struct Part {
    id: EntityId,
    body: Body,
    bounds: Aabb,
    /// What finds closest points; `None` for a mesh that nothing is near to.
    set: Option<SurfaceSet>,
}

impl Part {
    fn new(id: EntityId, body: Body, bounds: Aabb, job: &Job) -> Self {
        // Closest points are exact whatever the triangles; these only have to find the right place.
        let chord = (2e-3 * bounds.diagonal()).max(f64::MIN_POSITIVE);
        let set = Some(SurfaceSet::new(vec![(0, body.clone())], chord, job));
        Self { id, body, bounds, set }
    }

    /// The nearest place within `limit`, with its normal.
    fn closest(&self, p: DVec3, limit: f64, scratch: &mut Scratch) -> Option<(OnSurface, Option<DVec3>)> {
        if self.bounds.distance_squared(p) > limit * limit {
            return None;
        }
        let foot = self.set.as_ref()?.closest(p, limit, scratch)?;
        let normal = match &self.body {
            Body::Surface(surface) => surface.jet(foot.uv, 1).normal(),
            Body::Face(face) => face.surface().jet(foot.uv, 1).normal(),
            // Of a mesh the first parameter is the number of the triangle.
            Body::Facets(facets) => facets.mesh().area_vector(foot.uv.x as usize).try_normalize(),
        };
        Some((foot, normal))
    }
}

/// What is near a place of a border.
#[derive(Clone, Debug, Default, PartialEq)]
struct Near {
    neighbours: Vec<EntityId>,
    gap: f64,
    angle: f64,
}

impl Near {
    /// Adds a neighbour at a distance; the normals of the border's own body and of the neighbour where there are any.
    fn meet(&mut self, id: EntityId, distance: f64, normals: [Option<DVec3>; 2]) {
        self.neighbours.push(id);
        self.gap = self.gap.max(distance);
        if let [Some(a), Some(b)] = normals {
            self.angle = self.angle.max(a.dot(b).abs().min(1.0).acos().to_degrees());
        }
    }

    /// Adds those of other bodies that are near `p`.
    fn meet_all(&mut self, p: DVec3, normal: Option<DVec3>, others: &[&Part], tol: f64, scratch: &mut Scratch) {
        for part in others {
            if let Some((foot, other)) = part.closest(p, tol, scratch) {
                self.meet(part.id, foot.distance, [normal, other]);
            }
        }
    }
}

/// Finds the edges of the original surfaces and free curves of a document.
pub fn feature_edges(document: &Document, options: &EdgeOptions, job: &Job) -> Edges {
    job.phase("Finding edges");
    let bodies: Vec<(EntityId, Body, Aabb)> =
        document.bodies().map(|(id, body)| (id, body.clone(), body.bounds())).collect();
    let reach = options.joining_tol;
    let part = |(k, (id, body, bounds)): (usize, &(EntityId, Body, Aabb))| {
        // The tree of a large mesh costs seconds, which are for nothing where nothing is near.
        let others = bodies.iter().enumerate().filter(|(m, _)| *m != k);
        let alone = !others.map(|(_, (.., other))| other).any(|other| other.grown(reach).overlaps(bounds));
        match body {
            Body::Facets(_) if alone => Part { id: *id, body: body.clone(), bounds: *bounds, set: None },
            _ => Part::new(*id, body.clone(), *bounds, job),
        }
    };
    let parts: Vec<Part> = bodies.par_iter().enumerate().map(part).collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let surfaces = parts.iter().position(|p| matches!(p.body, Body::Facets(_))).unwrap_or(parts.len());
    let found: Vec<Vec<EdgePiece>> = (0..surfaces)
        .into_par_iter()
        .map(|k| {
            let mut out = Vec::new();
            if let Some(sheet) = sheet_of(&parts[k].body) {
                for curve in borders::borders_of(&parts[k], &sheet) {
                    if !job.is_cancelled() {
                        borders::border(&parts, k, &sheet, curve, options, &mut out);
                    }
                }
                creases::creases(parts[k].id, &sheet, options, &mut out);
            }
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(done as f64 / parts.len() as f64);
            out
        })
        .collect();
    let mut pieces: Vec<EdgePiece> = found.into_iter().flatten().collect();
    // One after the other: each is worked on by all threads.
    for (k, part) in parts.iter().enumerate().skip(surfaces) {
        rims::rims(&parts, part, options, job, &mut pieces);
        job.progress((k + 1) as f64 / parts.len() as f64);
    }
    for entity in document.entities() {
        if let Shape::Curve(curve) = &entity.shape {
            let (curve, range) = (CurveRef::Free(entity.id), curve.domain());
            let kind = EdgeKind::Curve;
            pieces.push(EdgePiece { curve, range, kind, neighbours: Vec::new(), max_gap: 0.0, max_angle: 0.0 });
        }
    }
    Edges { pieces, complete: !job.is_cancelled() }
}

fn kind_of(near: &Near, options: &EdgeOptions) -> EdgeKind {
    match near.neighbours.len() {
        0 => EdgeKind::Free,
        1 if near.gap > options.closed_tol => EdgeKind::Gap,
        1 if near.angle > options.feature_angle => EdgeKind::Feature,
        1 => EdgeKind::Shared,
        _ => EdgeKind::NonManifold,
    }
}

fn sheet_of(body: &Body) -> Option<Sheet> {
    match body {
        Body::Surface(surface) => Some(Sheet::Whole(Arc::clone(surface))),
        Body::Face(face) => Some(Sheet::Trimmed(Arc::clone(face))),
        Body::Facets(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::display::Geometry;
    use super::*;
    use crate::kernel::geom::{Curve, Direction, Knots, Side, Surface};
    use crate::model::document::Unit;
    use crate::view::display::tests::sphere;

    fn rectangle(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Shape {
        // z rises along y.
        let c = |i: usize, j: usize| DVec3::new(x[i], y[j], z[j]);
        Shape::Surface(Arc::new(Surface::bilinear([c(0, 0), c(1, 0), c(0, 1), c(1, 1)]).unwrap()))
    }

    fn edges(shapes: Vec<Shape>, tol: f64) -> (Vec<EntityId>, Edges) {
        let mut document = Document::new(Unit::Millimetre);
        let ids = shapes.into_iter().map(|s| document.add("s", s, None)).collect();
        (ids, feature_edges(&document, &EdgeOptions::new(tol), &Job::new()))
    }

    fn kinds(edges: &Edges, curve: CurveRef) -> Vec<(EdgeKind, [f64; 2])> {
        edges.pieces.iter().filter(|p| p.curve == curve).map(|p| (p.kind, p.range)).collect()
    }

    #[test]
    fn two_flat_neighbours_share_one_edge_and_have_six_free_ones() {
        let (ids, found) = edges(
            vec![rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]), rectangle([0.0, 1.0], [1.0, 2.0], [0.0, 0.0])],
            1e-3,
        );
        assert!(found.complete);
        assert_eq!((found.count(EdgeKind::Free), found.count(EdgeKind::Shared)), (6, 2), "{:?}", found.pieces);
        assert_eq!(kinds(&found, CurveRef::Border(ids[0], Side::VMax)), [(EdgeKind::Shared, [0.0, 1.0])]);
    }

    #[test]
    fn a_gap_and_a_crease_are_told_from_a_clean_joint() {
        for (second, kind, angle) in [
            (rectangle([0.0, 1.0], [1.0, 2.0], [5e-4, 5e-4]), EdgeKind::Gap, 0.0),
            (rectangle([0.0, 1.0], [1.0, 2.0], [0.0, 1.0]), EdgeKind::Feature, 45.0),
            (rectangle([0.0, 1.0], [1.0, 2.0], [2e-3, 2e-3]), EdgeKind::Free, 0.0),
        ] {
            let (ids, found) = edges(vec![rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]), second], 1e-3);
            let piece = found.at(&CurveRef::Border(ids[0], Side::VMax), 0.5).unwrap();
            assert_eq!(piece.kind, kind);
            assert!((piece.max_angle - angle).abs() < 1e-9, "{}", piece.max_angle);
            if kind == EdgeKind::Gap {
                assert!((piece.max_gap - 5e-4).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_border_that_is_half_covered_is_cut_where_the_neighbour_ends() {
        let (ids, found) = edges(
            vec![rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]), rectangle([0.3, 0.7], [1.0, 2.0], [0.0, 0.0])],
            1e-3,
        );
        let stretches = kinds(&found, CurveRef::Border(ids[0], Side::VMax));
        assert_eq!(
            stretches.iter().map(|s| s.0).collect::<Vec<_>>(),
            [EdgeKind::Free, EdgeKind::Shared, EdgeKind::Free]
        );
        // A neighbour reaches as far as the joining tolerance (a little less where it is exactly shared).
        assert!((stretches[1].1[0] - 0.3).abs() <= 1.1e-3 && (stretches[1].1[1] - 0.7).abs() <= 1.1e-3);
        assert_eq!((stretches[0].1[0], stretches[2].1[1]), (0.0, 1.0));
    }

    #[test]
    fn three_sheets_at_one_line_are_non_manifold_and_curves_are_listed() {
        let curve = Curve::segment(DVec3::ZERO, DVec3::Z).unwrap();
        let (ids, found) = edges(
            vec![
                rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]),
                rectangle([0.0, 1.0], [1.0, 2.0], [0.0, 0.0]),
                rectangle([0.0, 1.0], [1.0, 2.0], [0.0, 1.0]),
                Shape::Curve(Arc::new(curve)),
            ],
            1e-3,
        );
        let piece = found.at(&CurveRef::Border(ids[0], Side::VMax), 0.5).unwrap();
        assert_eq!((piece.kind, piece.neighbours.len()), (EdgeKind::NonManifold, 2));
        assert_eq!(found.at(&CurveRef::Free(ids[3]), 0.5).map(|p| p.kind), Some(EdgeKind::Curve));
    }

    #[test]
    fn a_sphere_has_a_seam_and_no_free_edge() {
        let (_, found) = edges(vec![Shape::Surface(Arc::new(sphere()))], 1e-3);
        assert_eq!(found.count(EdgeKind::Free), 0, "{:?}", found.pieces);
        assert_eq!(found.count(EdgeKind::Shared), 2);
    }

    #[test]
    fn a_crease_inside_a_surface_is_a_feature_edge() {
        let ku = Knots::clamped(1, &[0.0, 1.0, 2.0], 1).unwrap();
        let kv = Knots::bezier(1, 0.0, 1.0).unwrap();
        let points = [0.0, 1.0]
            .iter()
            .flat_map(|&y| [DVec3::new(0.0, y, 0.0), DVec3::new(1.0, y, 0.0), DVec3::new(1.0, y, 1.0)])
            .collect();
        let roof = Surface::new(ku, kv, points, None).unwrap();
        let (ids, found) = edges(vec![Shape::Surface(Arc::new(roof))], 1e-3);
        let piece = found.at(&CurveRef::Iso(ids[0], Direction::U, 1.0), 0.5).unwrap();
        assert!(piece.kind == EdgeKind::Feature && (piece.max_angle - 90.0).abs() < 1e-6);
    }

    /// A flat mesh of n x m squares over a rectangle at height z.
    fn plate(x: [f64; 2], y: [f64; 2], z: f64, [n, m]: [usize; 2]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |k: usize, n: usize, r: [f64; 2]| r[0] + (r[1] - r[0]) * k as f64 / n as f64;
        let points = (0..(n + 1) * (m + 1)).map(|k| DVec3::new(at(k % (n + 1), n, x), at(k / (n + 1), m, y), z));
        let index = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let cells = (0..n * m).map(|k| (k % n, k / n));
        let triangles = cells.flat_map(|(i, j)| {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        (points.collect(), triangles.collect())
    }

    fn mesh(parts: &[(Vec<DVec3>, Vec<[u32; 3]>)]) -> Shape {
        use crate::kernel::mesh::{facets::Facets, tri_mesh::TriMesh};
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for (own, corners) in parts {
            let base = points.len() as u32;
            points.extend(own);
            triangles.extend(corners.iter().map(|t| t.map(|k| k + base)));
        }
        Shape::Mesh(Arc::new(Facets::of_mesh(TriMesh::new(points, triangles).unwrap())))
    }

    /// The lengths of border of each kind in a model of curves of which every one is its own parameter range long.
    fn lengths(found: &Edges, document: &Document, kind: EdgeKind) -> f64 {
        let length = |p: &EdgePiece| {
            let geometry = match &document.get(p.curve.entity()).unwrap().shape {
                Shape::Mesh(f) => Geometry::Facets(Arc::clone(f)),
                Shape::Surface(s) => Geometry::Surface(Arc::clone(s)),
                _ => return 0.0,
            };
            let at = |t: f64| geometry.curve_jet(&p.curve, t).unwrap()[0];
            at(p.range[0]).distance(at(p.range[1]))
        };
        found.pieces.iter().filter(|p| p.kind == kind).map(length).sum()
    }

    #[test]
    fn borders_of_meshes_meet_meshes_and_surfaces_within_the_tolerance() {
        let left = plate([0.0, 1.0], [0.0, 1.0], 0.0, [4, 4]);
        for (z, kind) in [(0.0, EdgeKind::Shared), (5e-4, EdgeKind::Gap), (2e-3, EdgeKind::Free)] {
            let right = plate([1.0, 2.0], [0.0, 1.0], z, [3, 7]);
            let surface = rectangle([1.0, 2.0], [0.0, 1.0], [z, z]);
            let one = vec![mesh(&[left.clone(), right.clone()])];
            let two = vec![mesh(std::slice::from_ref(&left)), mesh(&[right])];
            for shapes in [one, two, vec![surface, mesh(std::slice::from_ref(&left))]] {
                let mut document = Document::new(Unit::Millimetre);
                shapes.into_iter().for_each(|s| _ = document.add("s", s, None));
                let found = feature_edges(&document, &EdgeOptions::new(1e-3), &Job::new());
                let free = lengths(&found, &document, EdgeKind::Free);
                let expected = if kind == EdgeKind::Free { 8.0 } else { 6.0 };
                assert!((free - expected).abs() < 0.01, "{z}: {free} {:?}", found.pieces);
                if kind != EdgeKind::Free {
                    assert!((lengths(&found, &document, kind) - 2.0).abs() < 0.01, "{z}: {:?}", found.pieces);
                }
            }
        }
    }

    #[test]
    fn meshes_that_meet_at_an_angle_make_a_feature_edge_and_a_third_one_is_non_manifold() {
        let flat = plate([0.0, 1.0], [0.0, 1.0], 0.0, [4, 4]);
        let turned = |up: f64| {
            let (points, triangles) = plate([0.0, 1.0], [0.0, 1.0], 0.0, [4, 3]);
            (points.into_iter().map(|p| DVec3::new(1.0, p.y, up * p.x)).collect::<Vec<_>>(), triangles)
        };
        let (ids, found) = edges(vec![mesh(std::slice::from_ref(&flat)), mesh(&[turned(1.0)])], 1e-3);
        let piece = found.pieces.iter().find(|p| p.kind == EdgeKind::Feature).unwrap();
        assert!((piece.max_angle - 90.0).abs() < 1e-6 && piece.neighbours == [ids[1]], "{piece:?}");
        let (_, found) = edges(vec![mesh(&[flat]), mesh(&[turned(1.0)]), mesh(&[turned(-1.0)])], 1e-3);
        assert_eq!(found.count(EdgeKind::NonManifold), 3, "{:?}", found.pieces);
    }

    /// The edges of a solid block were called free, although two of its faces meet in each.
    #[test]
    fn a_solid_block_has_feature_edges_and_a_sheet_of_points_free_ones() {
        use crate::kernel::mesh::{facets::Facets, grid::Grid};
        for (counts, kind, pieces) in [([3, 4, 5], EdgeKind::Feature, 24), ([3, 4, 1], EdgeKind::Free, 4)] {
            let [ni, nj, nk] = counts;
            let at = |k: usize| DVec3::new((k % ni) as f64, (k / ni % nj) as f64, (k / (ni * nj)) as f64);
            let grid = Grid::new(counts, (0..ni * nj * nk).map(at).collect(), None).unwrap();
            let (_, found) = edges(vec![Shape::Block(Arc::new(Facets::of_block(grid).unwrap()))], 1e-3);
            assert_eq!((found.count(kind), found.pieces.len()), (pieces, pieces), "{:?}", found.pieces);
        }
    }

    #[test]
    fn a_cancelled_search_says_so() {
        let mut document = Document::new(Unit::Millimetre);
        document.add("s", rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]), None);
        let job = Job::new();
        job.cancel();
        assert!(!feature_edges(&document, &EdgeOptions::new(1e-3), &job).complete);
    }
}
