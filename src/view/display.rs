//! One entity as triangles and lines: what is drawn of it and what can be picked.
//!
//! A surface is one tensor grid over all its patches, so no crack can open between them, and its border and
//! iso-lines are grid lines, so they lie in the triangles and cover them exactly. A free curve is a polyline that
//! keeps the same chord tolerance, by the second derivative between samples. A trimmed face is a constrained Delaunay
//! triangulation whose edges are the same points for both neighbours; its iso-lines are those inside its loops.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::facet_shading::shaded;
pub use super::geometry::{CurveRef, Geometry};
use super::segment_tree::{Segment, SegmentTree};
use crate::kernel::geom::trim::{EdgeRole, Face};
use crate::kernel::geom::{Aabb, Direction, Knots, Side, Surface};
use crate::kernel::mesh::face_mesh::tessellate_face;
use crate::kernel::mesh::facets::{FacetCurveKind, Facets};
use crate::kernel::mesh::tessellate::{
    SurfaceMesh, TessellateOptions, add_lines, curve_parameters, grid_lines, tessellate_on,
};
use crate::kernel::mesh::tri_tree::TriTree;
use crate::model::document::EntityId;

/// The most segments of one free curve.
const MAX_SEGMENTS: usize = 8192;
/// The most parts along one direction of a surface.
const MAX_PARTS: usize = 512;
/// Meshes of more triangles are first shown without what picking needs.
const QUICK: usize = 300_000;
/// The most inner grid lines of a block.
const MAX_GRID_LINES: usize = 768;
/// The most iso-lines along one direction.
const MAX_ISO: usize = 15;

/// A curve as a polyline.
#[derive(Clone, Debug)]
pub struct DisplayCurve {
    /// Which curve.
    pub curve: CurveRef,
    /// Points on it.
    pub points: Vec<DVec3>,
    /// Their parameters on it.
    pub t: Vec<f64>,
}

/// How much of a display is there; each has what the ones before it have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Extent {
    /// The triangles of a large mesh: it is seen.
    Triangles,
    /// The lines as well: it is seen as it is.
    Lines,
    /// The trees as well: it can be picked.
    All,
}

/// One entity as triangles and lines, at one level of detail.
#[derive(Clone, Debug)]
pub struct Display {
    /// How far triangles and lines are from the truth, in model units.
    pub chord_tol: f64,
    /// The triangles; none for a curve.
    pub mesh: Arc<SurfaceMesh>,
    /// The tree over them; empty unless all is there.
    pub tree: TriTree,
    /// Borders first, then iso-lines; or the one free curve.
    pub curves: Vec<DisplayCurve>,
    /// The tree over the segments of `curves`; empty unless all is there.
    pub segments: SegmentTree,
    /// A box around triangles and lines.
    pub bounds: Aabb,
    /// Whether a cap made it coarser than `chord_tol`.
    pub capped: bool,
    /// How much of it is there.
    pub extent: Extent,
}

impl Display {
    /// All of it. Costs about a microsecond a vertex; meant for a worker when the model is large.
    pub fn new(id: EntityId, geometry: &Geometry, chord_tol: f64) -> Self {
        Self::up_to(Extent::All, id, geometry, chord_tol, None)
    }

    /// The first display: of a large mesh its triangles, of everything else what is wanted in the end.
    pub fn first(extent: Extent, id: EntityId, geometry: &Geometry, chord_tol: f64) -> Self {
        match geometry {
            Geometry::Facets(facets) if facets.mesh().triangles().len() > QUICK => Self {
                chord_tol,
                mesh: Arc::new(shaded(facets.mesh())),
                tree: TriTree::default(),
                curves: Vec::new(),
                segments: SegmentTree::new(Vec::new()),
                bounds: facets.bounds(),
                capped: false,
                extent: Extent::Triangles,
            },
            _ => Self::up_to(extent, id, geometry, chord_tol, None),
        }
    }

    /// A display up to this extent; `mesh` are the triangles of one that was made before (of a mesh or block, whose
    /// triangles are always the same).
    pub fn up_to(
        extent: Extent,
        id: EntityId,
        geometry: &Geometry,
        chord_tol: f64,
        mesh: Option<Arc<SurfaceMesh>>,
    ) -> Self {
        let (mesh, curves, capped) = match geometry {
            Geometry::Surface(surface) => {
                let (mesh, curves) = surface_display(id, surface, chord_tol);
                let capped = mesh.capped;
                (Arc::new(mesh), curves, capped)
            }
            Geometry::Face { face, whole } => {
                let (mesh, curves) = face_display(id, face, *whole, chord_tol);
                let capped = mesh.capped;
                (Arc::new(mesh), curves, capped)
            }
            Geometry::Curve(curve) => {
                let (t, capped) = curve_parameters(curve, chord_tol, MAX_SEGMENTS);
                let points = t.iter().map(|&t| curve.eval(t)).collect();
                (Arc::default(), vec![DisplayCurve { curve: CurveRef::Free(id), points, t }], capped)
            }
            Geometry::Facets(facets) => {
                let mesh = mesh.unwrap_or_else(|| Arc::new(shaded(facets.mesh())));
                (mesh, facet_curves(id, facets), false)
            }
        };
        let bounds = Aabb::of(curves.iter().flat_map(|c| &c.points).chain(mesh.points.iter()).copied());
        let mut made = Self {
            chord_tol,
            mesh,
            tree: TriTree::default(),
            curves,
            segments: SegmentTree::new(Vec::new()),
            bounds,
            capped,
            extent,
        };
        if extent == Extent::All {
            made.plant_trees();
        }
        made
    }

    /// Makes what picking needs.
    fn plant_trees(&mut self) {
        self.tree = TriTree::new(self.mesh.points.to_vec(), &self.mesh.triangles);
        let segments = self
            .curves
            .iter()
            .enumerate()
            .flat_map(|(k, c)| {
                c.points.windows(2).zip(c.t.windows(2)).map(move |(p, t)| Segment {
                    ends: [p[0], p[1]],
                    t: [t[0], t[1]],
                    curve: k as u32,
                })
            })
            .collect();
        self.segments = SegmentTree::new(segments);
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// The number of line segments.
    pub fn segment_count(&self) -> usize {
        self.curves.iter().map(|c| c.points.len().saturating_sub(1)).sum()
    }
}

/// The parameters at which iso-lines are drawn: the interior knots, thinned evenly when there are many, and the
/// quarters of the domain where there are fewer than three knots.
pub fn iso_parameters(knots: &Knots) -> Vec<f64> {
    let breaks = knots.breaks();
    let [start, end] = knots.domain();
    let mut inner = breaks[1..breaks.len() - 1].to_vec();
    if inner.len() > MAX_ISO {
        let step = inner.len().div_ceil(MAX_ISO);
        inner = inner.into_iter().skip(step / 2).step_by(step).collect();
    }
    if inner.len() < 3 {
        for quarter in [0.25, 0.5, 0.75] {
            let t = start + (end - start) * quarter;
            if inner.iter().all(|b| (b - t).abs() > 0.1 * (end - start)) {
                inner.push(t);
            }
        }
        inner.sort_by(f64::total_cmp);
    }
    inner
}

fn surface_display(id: EntityId, surface: &Surface, chord_tol: f64) -> (SurfaceMesh, Vec<DisplayCurve>) {
    let options = TessellateOptions { max_parts: MAX_PARTS, ..TessellateOptions::new(chord_tol) };
    let (mut lines, capped) = grid_lines(surface, &options);
    let iso = [0, 1].map(|k| iso_parameters(&surface.knots()[k]));
    for (line, iso) in lines.iter_mut().zip(&iso) {
        add_lines(line, iso);
    }
    let mesh = tessellate_on(surface, lines, capped);
    let (nu, nv) = (mesh.lines[0].len(), mesh.lines[1].len());
    let row = |curve: CurveRef, j: usize| DisplayCurve {
        curve,
        points: mesh.points[j * nu..(j + 1) * nu].to_vec(),
        t: mesh.lines[0].clone(),
    };
    let column = |curve: CurveRef, i: usize| DisplayCurve {
        curve,
        points: mesh.points.iter().skip(i).step_by(nu).copied().collect(),
        t: mesh.lines[1].clone(),
    };
    let mut curves = vec![
        row(CurveRef::Border(id, Side::VMin), 0),
        column(CurveRef::Border(id, Side::UMax), nu - 1),
        row(CurveRef::Border(id, Side::VMax), nv - 1),
        column(CurveRef::Border(id, Side::UMin), 0),
    ];
    for (k, iso) in iso.iter().enumerate() {
        for &c in iso {
            let Some(at) = mesh.lines[k].iter().position(|&x| x == c) else { continue };
            curves.push(if k == 0 {
                column(CurveRef::Iso(id, Direction::U, c), at)
            } else {
                row(CurveRef::Iso(id, Direction::V, c), at)
            });
        }
    }
    // A border that is a point (a pole) is no curve.
    curves.retain(|c| c.points.iter().any(|p| *p != c.points[0]));
    (mesh, curves)
}

/// The curves of a mesh or block as they are drawn: all borders and feature edges, and of the grid lines of a large
/// block every n-th.
fn facet_curves(id: EntityId, facets: &Facets) -> Vec<DisplayCurve> {
    let inner = facets.curves().iter().filter(|c| c.kind == FacetCurveKind::GridLine).count();
    let step = inner.div_ceil(MAX_GRID_LINES).max(1);
    let mut counted = 0;
    let mut out = Vec::new();
    for (k, chain) in facets.curves().iter().enumerate() {
        let curve = if chain.kind == FacetCurveKind::GridLine {
            counted += 1;
            if !(counted as usize).is_multiple_of(step) {
                continue;
            }
            CurveRef::GridLine(id, k as u32)
        } else {
            CurveRef::Chain(id, k as u32)
        };
        // Of degree 1 and clamped: its control points lie at its knots.
        out.push(DisplayCurve {
            curve,
            points: chain.curve.points().to_vec(),
            t: chain.curve.knots().breaks().to_vec(),
        });
    }
    out
}

fn face_display(id: EntityId, face: &Face, whole: bool, chord_tol: f64) -> (SurfaceMesh, Vec<DisplayCurve>) {
    let options = TessellateOptions { max_parts: MAX_PARTS, ..TessellateOptions::new(chord_tol) };
    let iso = [0, 1].map(|k| iso_parameters(&face.surface().knots()[k]));
    let made = tessellate_face(face, &options, &iso);
    let mut curves = Vec::new();
    for (r, (ring, lines)) in face.rings().iter().zip(made.edges).enumerate() {
        for (e, (edge, line)) in ring.edges.iter().zip(lines).enumerate() {
            // A cut is no edge of the model, and of a seam that the loop runs twice one line is enough.
            let again = ring.edges[..e].iter().any(|other| other.id == edge.id);
            if edge.role == EdgeRole::Model && !again {
                let curve = CurveRef::Edge(id, r as u32, e as u32);
                curves.push(DisplayCurve { curve, points: line.points, t: line.t });
            }
        }
    }
    if whole {
        let (mesh, borders) = surface_display(id, face.surface(), chord_tol);
        curves.extend(borders);
        return (mesh, curves);
    }
    for (k, (iso, fixed)) in iso.iter().zip([Direction::U, Direction::V]).enumerate() {
        for &c in iso {
            let curve = CurveRef::Iso(id, fixed, c);
            curves.extend(iso_line(face, k, c, &made.mesh.lines[1 - k]).into_iter().map(|t| {
                DisplayCurve {
                    curve,
                    points: t
                        .iter()
                        .map(|&t| face.surface().eval(if k == 0 { DVec2::new(c, t) } else { DVec2::new(t, c) }))
                        .collect(),
                    t,
                }
            }));
        }
    }
    curves.retain(|c| c.points.iter().any(|p| *p != c.points[0]));
    (made.mesh, curves)
}

/// The stretches of an iso-line inside a face, at the grid lines and at its loops.
fn iso_line(face: &Face, k: usize, c: f64, lines: &[f64]) -> Vec<Vec<f64>> {
    face.stretches(k, c)
        .into_iter()
        .map(|[from, to]| {
            let mut t = vec![from];
            t.extend(lines.iter().copied().filter(|&x| from < x && x < to));
            t.push(to);
            t
        })
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::*;
    use crate::kernel::geom::Curve;

    /// The unit sphere as one rational biquadratic surface: u around (closed seam), v from pole to pole.
    pub(crate) fn sphere() -> Surface {
        let w = FRAC_1_SQRT_2;
        let circle = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
        let arc = [(0.0, -1.0, 1.0), (1.0, -1.0, w), (1.0, 0.0, 1.0), (1.0, 1.0, w), (0.0, 1.0, 1.0)];
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for (r, z, wv) in arc {
            for (i, &(x, y)) in circle.iter().enumerate() {
                points.push(DVec3::new(r * f64::from(x), r * f64::from(y), z));
                weights.push(wv * if i % 2 == 1 { w } else { 1.0 });
            }
        }
        let ku = Knots::clamped(2, &[0.0, 1.0, 2.0, 3.0, 4.0], 2).unwrap();
        let kv = Knots::clamped(2, &[0.0, 1.0, 2.0], 2).unwrap();
        Surface::new(ku, kv, points, Some(weights)).unwrap()
    }

    /// A quarter circle of radius 1.
    fn arc() -> Curve {
        let points = vec![DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        Curve::new(Knots::bezier(2, 0.0, 1.0).unwrap(), points, Some(vec![1.0, FRAC_1_SQRT_2, 1.0])).unwrap()
    }

    #[test]
    fn lines_lie_in_the_triangles_and_on_the_surface() {
        let id = EntityId(3);
        let geometry = Geometry::Surface(Arc::new(sphere()));
        let display = Display::new(id, &geometry, 1e-2);
        // Two poles are points, so of the four borders the two sides of the seam are left.
        let borders: Vec<_> = display.curves.iter().filter(|c| matches!(c.curve, CurveRef::Border(..))).collect();
        assert_eq!(borders.len(), 2);
        assert_eq!(borders[0].points, borders[1].points, "the seam has no slit");
        for curve in &display.curves {
            for (p, &t) in curve.points.iter().zip(&curve.t) {
                assert!(display.mesh.points.contains(p));
                let [on, along, _] = geometry.curve_jet(&curve.curve, t).unwrap();
                assert!(on.distance(*p) < 1e-12);
                assert!(along.dot(on).abs() < 1e-9, "tangents of a sphere are square to the radius");
            }
        }
        let segments: usize = display.curves.iter().map(|c| c.points.len() - 1).sum();
        assert_eq!(display.segments.len(), segments);
    }

    #[test]
    fn a_free_curve_keeps_its_chord_tolerance() {
        for tol in [1e-2, 1e-4, 1e-6] {
            let geometry = Geometry::Curve(Arc::new(arc()));
            let display = Display::new(EntityId(0), &geometry, tol);
            let curve = &display.curves[0];
            for pair in curve.points.windows(2) {
                let sag = 1.0 - (0.5 * (pair[0] + pair[1])).length();
                assert!(sag <= tol, "{sag} at {tol}");
            }
            let fewest = std::f64::consts::FRAC_PI_2 / (2.0 * (2.0 * tol).sqrt());
            assert!((curve.points.len() as f64) < 3.0 * fewest + 3.0, "no waste: {}", curve.points.len());
            assert!(!display.capped);
        }
        assert!(Display::new(EntityId(0), &Geometry::Curve(Arc::new(arc())), 1e-12).capped);
    }

    #[test]
    fn iso_lines_are_neither_none_nor_a_thicket() {
        let bezier = Knots::bezier(3, 0.0, 1.0).unwrap();
        assert_eq!(iso_parameters(&bezier), [0.25, 0.5, 0.75]);
        let many: Vec<f64> = (0..=200).map(f64::from).collect();
        let found = iso_parameters(&Knots::clamped(3, &many, 1).unwrap());
        assert!(found.len() >= 8 && found.len() <= MAX_ISO && found.iter().all(|t| many.contains(t)));
        let one = Knots::clamped(3, &[0.0, 0.5, 1.0], 1).unwrap();
        assert_eq!(iso_parameters(&one), [0.25, 0.5, 0.75]);
    }
}
