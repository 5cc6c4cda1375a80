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

mod rims;

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::colormap::Rgb;
use super::display::{CurveRef, Geometry};
use crate::kernel::geom::trim::{EdgeRole, Sheet};
use crate::kernel::geom::{Aabb, Direction, Side};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::surface_set::{OnSurface, Scratch, SurfaceSet};
use crate::model::document::{Document, EntityId, Shape};

/// What an edge is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// No other surface is near.
    Free,
    /// One other surface is near, but not exactly there.
    Gap,
    /// One other surface meets it exactly.
    Shared,
    /// The same, and the normal turns.
    Feature,
    /// More than one other surface is near.
    NonManifold,
    /// A free curve of the model.
    Curve,
}

/// How a line is drawn, so that colour is not the only sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinePattern {
    /// One full line.
    Solid,
    /// A thin line.
    Thin,
    /// Two lines side by side.
    Double,
    /// Short dashes.
    ShortDash,
}

impl EdgeKind {
    /// All kinds, in the order of the legend.
    pub const ALL: [Self; 6] = [Self::Free, Self::Gap, Self::NonManifold, Self::Feature, Self::Shared, Self::Curve];

    /// The words in the legend.
    pub fn label(self) -> &'static str {
        match self {
            Self::Free => "Free edge",
            Self::Gap => "Shared within tolerance, open gap",
            Self::Shared => "Shared edge",
            Self::Feature => "Feature edge",
            Self::NonManifold => "Non-manifold edge",
            Self::Curve => "Free curve",
        }
    }

    /// The colour (sRGB) and pattern, with the meanings that users of meshing programs know: red free, green shared,
    /// yellow non-manifold; orange dashes are gaps.
    pub fn style(self) -> (Rgb, LinePattern) {
        match self {
            Self::Free => ([0.90, 0.16, 0.16], LinePattern::Solid),
            Self::Gap => ([0.95, 0.55, 0.10], LinePattern::ShortDash),
            Self::Shared => ([0.20, 0.65, 0.30], LinePattern::Thin),
            Self::Feature => ([0.10, 0.60, 0.62], LinePattern::Solid),
            Self::NonManifold => ([0.90, 0.80, 0.10], LinePattern::Double),
            Self::Curve => ([0.55, 0.35, 0.85], LinePattern::Solid),
        }
    }

    /// Whether it offers itself as a side of a patch.
    pub fn is_candidate(self) -> bool {
        !matches!(self, Self::Shared)
    }
}

/// A stretch of a curve of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgePiece {
    /// Which curve.
    pub curve: CurveRef,
    /// The stretch in the curve's parameter.
    pub range: [f64; 2],
    /// What it is.
    pub kind: EdgeKind,
    /// The surfaces that are near, in the order of the document.
    pub neighbours: Vec<EntityId>,
    /// How far the neighbours are away at most, at the samples.
    pub max_gap: f64,
    /// By how much the normal turns at most, in degrees, at the samples.
    pub max_angle: f64,
}

/// How to look for edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeOptions {
    /// How near a surface must be to count as a neighbour, in model units.
    pub joining_tol: f64,
    /// A gap up to this is none, in model units. Default: a thousandth of the joining tolerance.
    pub closed_tol: f64,
    /// The normal must turn by more than this for a feature edge, in degrees. Default 20.
    pub feature_angle: f64,
    /// Samples for every knot span. Default 8, at least 24 and at most 512 a border.
    pub per_span: usize,
}

impl EdgeOptions {
    /// The defaults for a joining tolerance.
    pub fn new(joining_tol: f64) -> Self {
        Self { joining_tol, closed_tol: 1e-3 * joining_tol, feature_angle: 20.0, per_span: 8 }
    }
}

/// All edges of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edges {
    /// The stretches, surface by surface in the order of the document, then the free curves.
    pub pieces: Vec<EdgePiece>,
    /// False when the job was cancelled before all were looked at.
    pub complete: bool,
}

impl Edges {
    /// How many stretches there are of a kind.
    pub fn count(&self, kind: EdgeKind) -> usize {
        self.pieces.iter().filter(|p| p.kind == kind).count()
    }

    /// The stretch of a curve that holds a parameter.
    pub fn at(&self, curve: &CurveRef, t: f64) -> Option<&EdgePiece> {
        self.pieces.iter().find(|p| p.curve == *curve && p.range[0] <= t && t <= p.range[1])
    }
}

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
                for curve in borders_of(&parts[k], &sheet) {
                    if !job.is_cancelled() {
                        border(&parts, k, &sheet, curve, options, &mut out);
                    }
                }
                creases(parts[k].id, &sheet, options, &mut out);
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

/// The borders of a whole surface; the edges of a face, a seam once.
fn borders_of(part: &Part, sheet: &Sheet) -> Vec<CurveRef> {
    let Some(face) = sheet.face() else { return Side::ALL.map(|side| CurveRef::Border(part.id, side)).into() };
    let mut out = Vec::new();
    for (r, ring) in face.rings().iter().enumerate() {
        for (e, edge) in ring.edges.iter().enumerate() {
            let again = ring.edges[..e].iter().any(|other| other.id == edge.id);
            if edge.role == EdgeRole::Model && !again {
                out.push(CurveRef::Edge(part.id, r as u32, e as u32));
            }
        }
    }
    out
}

fn border(parts: &[Part], k: usize, sheet: &Sheet, curve: CurveRef, options: &EdgeOptions, out: &mut Vec<EdgePiece>) {
    let own = &parts[k];
    let surface = sheet.surface();
    let geometry = match sheet {
        Sheet::Whole(surface) => Geometry::Surface(Arc::clone(surface)),
        Sheet::Trimmed(face) => Geometry::Face { face: Arc::clone(face), whole: false },
    };
    let Some([start, end]) = geometry.curve_domain(&curve) else { return };
    let mut breaks = vec![start];
    breaks.extend(geometry.curve_knots(&curve));
    breaks.push(end);
    let places = places(&breaks, options);
    let uv = |t: f64| geometry.curve_uv(&curve, t).unwrap_or(DVec2::ZERO);
    let points: Vec<DVec3> = places.iter().map(|&t| surface.eval(surface.clamped(uv(t)))).collect();
    let size = Aabb::of(points.iter().copied());
    // A border that is shorter than what is joined is a pole.
    if size.diagonal() <= options.joining_tol.min(1e-6 * own.bounds.diagonal()) {
        return;
    }
    let others = near_to(parts, own, &size, options);
    let mut scratch = Scratch::default();
    let look = |t: f64| near(own, sheet, &curve, &others, uv(t), options, &mut scratch);
    stretches(curve, [start, end], &places, look, options, out);
}

/// Where a border is looked at.
fn places(breaks: &[f64], options: &EdgeOptions) -> Vec<f64> {
    let spans = breaks.len() - 1;
    let per_span = options.per_span.max(24_usize.div_ceil(spans)).min(512_usize.div_ceil(spans)).max(1);
    let mut places = Vec::new();
    for pair in breaks.windows(2) {
        let step = (pair[1] - pair[0]) / per_span as f64;
        places.extend((0..per_span).map(|i| pair[0] + step * (i as f64 + 0.5)));
    }
    places
}

/// The other bodies that may be near a border in this box.
fn near_to<'p>(parts: &'p [Part], own: &Part, size: &Aabb, options: &EdgeOptions) -> Vec<&'p Part> {
    let reach = size.grown(options.joining_tol + 0.5 * size.diagonal());
    parts.iter().filter(|p| p.id != own.id && p.bounds.overlaps(&reach)).collect()
}

/// Cuts a curve where what is near it changes.
fn stretches(
    curve: CurveRef,
    [start, end]: [f64; 2],
    places: &[f64],
    mut look: impl FnMut(f64) -> Near,
    options: &EdgeOptions,
    out: &mut Vec<EdgePiece>,
) {
    let mut seen: Vec<Near> = places.iter().map(|&t| look(t)).collect();
    let same = |a: &Near, b: &Near| a.neighbours == b.neighbours && kind_of(a, options) == kind_of(b, options);
    for i in 1..seen.len().saturating_sub(1) {
        if !same(&seen[i], &seen[i - 1]) && same(&seen[i - 1], &seen[i + 1]) {
            seen[i] = seen[i - 1].clone();
        }
    }
    let mut from = start;
    let mut first = 0;
    for i in 0..seen.len() {
        let last = i + 1 == seen.len();
        if !last && same(&seen[i], &seen[i + 1]) {
            continue;
        }
        let to = if last {
            end
        } else {
            let (mut low, mut high) = (places[i], places[i + 1]);
            for _ in 0..30 {
                let middle = 0.5 * (low + high);
                if same(&look(middle), &seen[i]) { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        let stretch = &seen[first..=i];
        out.push(EdgePiece {
            curve,
            range: [from, to],
            kind: kind_of(&seen[i], options),
            neighbours: seen[i].neighbours.clone(),
            max_gap: stretch.iter().map(|n| n.gap).fold(0.0, f64::max),
            max_angle: stretch.iter().map(|n| n.angle).fold(0.0, f64::max),
        });
        (from, first) = (to, i + 1);
    }
}

/// The bodies near a place of a border. `uv` is the place on the surface itself.
fn near(
    own: &Part,
    sheet: &Sheet,
    curve: &CurveRef,
    others: &[&Part],
    uv: DVec2,
    options: &EdgeOptions,
    scratch: &mut Scratch,
) -> Near {
    let surface = sheet.surface();
    let jet = surface.jet(uv, 1);
    let (p, normal) = (jet.p(), jet.normal());
    let mut out = Near::default();
    // The seam of a closed surface: the same parameter on the opposite border.
    let [u, v] = surface.domain();
    let opposite = match curve {
        CurveRef::Border(_, Side::VMin) => Some(DVec2::new(uv.x, v[1])),
        CurveRef::Border(_, Side::VMax) => Some(DVec2::new(uv.x, v[0])),
        CurveRef::Border(_, Side::UMin) => Some(DVec2::new(u[1], uv.y)),
        CurveRef::Border(_, Side::UMax) => Some(DVec2::new(u[0], uv.y)),
        // A face runs its seam twice.
        CurveRef::Edge(_, ring, edge) => sheet.face().and_then(|face| {
            let ring = face.rings().get(*ring as usize)?;
            let id = ring.edges.get(*edge as usize)?.id;
            (ring.edges.iter().filter(|e| e.id == id).count() > 1).then_some(uv)
        }),
        _ => None,
    };
    if let Some(opposite) = opposite {
        let across = surface.jet(opposite, 1);
        if across.p().distance(p) <= options.joining_tol {
            out.meet(own.id, across.p().distance(p), [normal, across.normal()]);
        }
    }
    out.meet_all(p, normal, others, options.joining_tol, scratch);
    out
}

/// Knots of full multiplicity at which the normal turns by more than the feature angle.
fn creases(id: EntityId, sheet: &Sheet, options: &EdgeOptions, out: &mut Vec<EdgePiece>) {
    let surface = sheet.surface();
    // The seam that a face was moved to is such a knot without being a crease; normals tell.
    for (k, fixed) in [Direction::U, Direction::V].into_iter().enumerate() {
        let knots = &surface.knots()[k];
        let [start, end] = knots.domain();
        let along = surface.domain()[1 - k];
        for (t, multiplicity) in knots.multiplicities() {
            if multiplicity < knots.degree() || t <= start || t >= end {
                continue;
            }
            let step = 1e-7 * (end - start);
            let place = |t: f64, s: f64| {
                let s = along[0] + (along[1] - along[0]) * s;
                if k == 0 { DVec2::new(t, s) } else { DVec2::new(s, t) }
            };
            let normal = |t: f64, s: f64| surface.jet(place(t, s), 1).normal();
            let turns = (0..17).filter_map(|i| {
                let s = (f64::from(i) + 0.5) / 17.0;
                let (a, b) = (normal(t - step, s)?, normal(t + step, s)?);
                Some(a.dot(b).clamp(-1.0, 1.0).acos().to_degrees())
            });
            let turn = turns.fold(0.0, f64::max);
            if turn > options.feature_angle {
                let stretches = sheet.face().map_or_else(|| vec![along], |face| face.stretches(k, t));
                out.extend(stretches.into_iter().map(|range| EdgePiece {
                    curve: CurveRef::Iso(id, fixed, t),
                    range,
                    kind: EdgeKind::Feature,
                    neighbours: vec![id],
                    max_gap: 0.0,
                    max_angle: turn,
                }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::{Curve, Knots, Surface};
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

    #[test]
    fn a_cancelled_search_says_so() {
        let mut document = Document::new(Unit::Millimetre);
        document.add("s", rectangle([0.0, 1.0], [0.0, 1.0], [0.0, 0.0]), None);
        let job = Job::new();
        job.cancel();
        assert!(!feature_edges(&document, &EdgeOptions::new(1e-3), &job).complete);
    }
}
