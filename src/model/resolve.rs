//! From a patch specification to kernel curves, and back from what was picked to pieces.
//!
//! [`resolve`] turns a whole [`HealSpec`] into kernel input; [`PieceResolver`] turns single pieces into curves, for
//! a live preview. The picking tool makes pieces with [`iso_piece`], [`edge_piece`] and [`curve_piece`], and cuts
//! them with [`PieceResolver::trimmed`].

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::document::{Document, EntityId, Shape};
use super::spec::{HealSpec, IsoAt, Piece};
use crate::kernel::geom::arc_length::ArcLength;
use crate::kernel::geom::{Aabb, Curve, CurveError, Direction, Knots, Side, Surface};
use crate::kernel::heal::boundary_loop::LoopChoice;
use crate::kernel::heal::fit::bezier_row;
use crate::kernel::heal::hardy::HardyOptions;
use crate::kernel::heal::{HealOptions, PatchInput};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};

/// Why a piece names no curve of the document.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PieceError {
    /// There are fewer surfaces.
    #[error("there is no surface {number}; the model has {count} (numbered from 0)")]
    NoSurface {
        /// The number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// There are fewer free curves.
    #[error("there is no curve {number}; the model has {count} (numbered from 0)")]
    NoCurve {
        /// The number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// There are fewer meshes and blocks.
    #[error("there is no mesh or block {number}; the model has {count} (numbered from 0)")]
    NoMesh {
        /// The number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// The mesh or block has fewer curves.
    #[error("mesh {mesh} has no chain {number}; it has {count} borders, feature edges or grid lines (numbered from 0)")]
    NoChain {
        /// The mesh or block.
        mesh: usize,
        /// The number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// The surface has no such loop or edge.
    #[error("surface {surface} has no loop {ring}, edge {edge}: {has}")]
    NoEdge {
        /// The surface.
        surface: usize,
        /// The loop asked for.
        ring: usize,
        /// The edge asked for.
        edge: usize,
        /// What it has.
        has: String,
    },
    /// A parameter or fraction is outside.
    #[error("{what} is {got}, it must be in {low}..={high}")]
    Range {
        /// Which number.
        what: &'static str,
        /// Its value.
        got: f64,
        /// The smallest that works.
        low: f64,
        /// The largest that works.
        high: f64,
    },
    /// Start and end are the same.
    #[error("it has zero length: it starts and ends at {at}")]
    ZeroLength {
        /// The parameter or fraction.
        at: f64,
    },
    /// Its numbers are no curve.
    #[error("it is no curve: {0}")]
    Curve(#[from] CurveError),
    /// A drawn curve needs surfaces.
    #[error("a drawn curve needs a surface to lie on; the model has none to project on")]
    NothingToDrawOn,
}

/// Why a specification does not fit a document.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResolveError {
    /// A piece names no curve.
    #[error("patch \"{patch}\", side {side}, piece {piece}: {source}")]
    Piece {
        /// The patch.
        patch: String,
        /// The side, from 1.
        side: usize,
        /// The piece, from 1.
        piece: usize,
        /// What is wrong.
        source: PieceError,
    },
    /// `onto` names a body that is not there.
    #[error("`onto` names surface {number}, the model has {count} surfaces, meshes and blocks (numbered from 0)")]
    Onto {
        /// The number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// There is nothing to project on.
    #[error("the model has no surface, mesh or block to heal on")]
    NoSurfaces,
}

/// Kernel input made from a specification.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// The patches.
    pub patches: Vec<PatchInput>,
    /// The bodies to project on, of faces the trimmed part, with their numbers.
    pub surfaces: Vec<(usize, Body)>,
    /// How to heal.
    pub options: HealOptions,
}

/// Turns a specification into kernel input.
pub fn resolve(spec: &HealSpec, document: &Document, job: &Job) -> Result<Resolved, ResolveError> {
    let all: Vec<Body> = document.bodies().map(|(_, body)| body).collect();
    if all.is_empty() {
        return Err(ResolveError::NoSurfaces);
    }
    let numbers = spec.onto.clone().unwrap_or_else(|| (0..all.len()).collect());
    let mut surfaces = Vec::new();
    for number in numbers {
        let body = all.get(number).ok_or(ResolveError::Onto { number, count: all.len() })?;
        if surfaces.iter().all(|(n, _)| *n != number) {
            surfaces.push((number, body.clone()));
        }
    }
    let options = options(spec, document);
    let mut resolver = PieceResolver::new(document, surfaces.clone(), options.clone());
    let mut patches = Vec::new();
    for patch in &spec.patches {
        let mut sides: [Vec<Curve>; 4] = Default::default();
        for (s, pieces) in patch.sides.iter().enumerate() {
            for (p, piece) in pieces.iter().enumerate() {
                let curve = resolver.curve(piece, job).map_err(|source| ResolveError::Piece {
                    patch: patch.name.clone(),
                    side: s + 1,
                    piece: p + 1,
                    source,
                })?;
                sides[s].push(curve);
            }
        }
        let by_hand = &patch.joining;
        patches.push(PatchInput {
            name: patch.name.clone(),
            sides,
            modes: patch.boundary,
            choice: by_hand.arrangement.map(|a| LoopChoice { order: a.order, reversed: a.reversed }),
            joining_tol: by_hand.tol,
            moves: by_hand.moves.iter().map(|m| (m.side, DVec3::from(m.to))).collect(),
        });
    }
    Ok(Resolved { patches, surfaces, options })
}

/// The kernel options of a specification; what it leaves out comes from the model's size.
pub fn options(spec: &HealSpec, document: &Document) -> HealOptions {
    // Patches do not count: healing the same model again, with or without them, is done alike.
    let originals = document.entities().iter().filter(|e| !matches!(e.shape, Shape::Patch(_)));
    let defaults = HealOptions::of(&originals.fold(Aabb::EMPTY, |all, e| all.union(&e.bounds())));
    HealOptions {
        joining_tol: spec.joining_tol.unwrap_or(defaults.joining_tol),
        tol: spec.tol.unwrap_or(defaults.tol),
        min_resolution: spec.min_resolution,
        max_resolution: spec.max_resolution,
        slab: spec.slab,
        hardy: HardyOptions { neighbours: spec.neighbours, r: spec.radius, gamma: spec.gamma },
        chord_tol: spec.chord_tol.unwrap_or(defaults.chord_tol),
        ..defaults
    }
}

/// The settings that a specification comes to for a document, with nothing left to defaults: written to a file, they
/// heal the same whatever else the file holds.
pub fn used(spec: &HealSpec, document: &Document) -> HealSpec {
    let options = options(spec, document);
    HealSpec {
        joining_tol: Some(options.joining_tol),
        tol: Some(options.tol),
        onto: spec.onto.clone().or_else(|| Some((0..document.bodies().count()).collect())),
        chord_tol: Some(options.chord_tol),
        ..spec.settings()
    }
}

/// Turns pieces into curves; keeps the tessellation that drawn curves need.
pub struct PieceResolver<'a> {
    document: &'a Document,
    onto: Vec<(usize, Body)>,
    options: HealOptions,
    set: Option<Arc<SurfaceSet>>,
}

impl<'a> PieceResolver<'a> {
    /// For a document, the bodies that drawn curves lie on, and the tolerances.
    pub fn new(document: &'a Document, onto: Vec<(usize, Body)>, options: HealOptions) -> Self {
        Self { document, onto, options, set: None }
    }

    /// Uses a tessellation that is at hand instead of making one.
    #[must_use]
    pub fn with_set(self, set: Arc<SurfaceSet>) -> Self {
        Self { set: Some(set), ..self }
    }

    /// The curve of a piece, from its start to its end.
    pub fn curve(&mut self, piece: &Piece, job: &Job) -> Result<Curve, PieceError> {
        match piece {
            Piece::Iso { surface, at, from, to } => self.iso(*surface, *at, *from, *to),
            Piece::Edge { face, ring, edge, from, to } => by_fractions(&self.edge(*face, *ring, *edge)?, *from, *to),
            Piece::Curve { id, from, to } => {
                let curves: Vec<&Arc<Curve>> = self.document.curves().map(|(_, c)| c).collect();
                let curve = curves.get(*id).ok_or(PieceError::NoCurve { number: *id, count: curves.len() })?;
                by_fractions(curve, *from, *to)
            }
            Piece::Chain { mesh, chain, from, to } => {
                let count = self.document.meshes().count();
                let found = self.document.meshes().nth(*mesh);
                let (_, facets) = found.ok_or(PieceError::NoMesh { number: *mesh, count })?;
                let count = facets.curves().len();
                let found = facets.curves().get(*chain);
                let found = found.ok_or(PieceError::NoChain { mesh: *mesh, number: *chain, count })?;
                by_fractions(&found.curve, *from, *to)
            }
            Piece::Line(a, b) => {
                let (a, b) = (DVec3::from(*a), DVec3::from(*b));
                if a == b {
                    return Err(PieceError::ZeroLength { at: 0.0 });
                }
                Ok(Curve::segment(a, b)?)
            }
            Piece::Polyline(points) => polyline(points),
            Piece::Drawn(points) => self.drawn(points, job),
        }
    }

    fn surface(&self, number: usize) -> Result<&'a Arc<Surface>, PieceError> {
        let count = self.document.surfaces().count();
        let found = self.document.surfaces().nth(number).map(|(_, s)| s);
        found.ok_or(PieceError::NoSurface { number, count })
    }

    /// An edge of a face, or a border of an untrimmed surface.
    fn edge(&self, number: usize, ring: usize, edge: usize) -> Result<Curve, PieceError> {
        let surface = self.surface(number)?;
        let no_edge = |has: String| PieceError::NoEdge { surface: number, ring, edge, has };
        match self.document.bodies().nth(number) {
            Some((_, Body::Face(face))) => {
                let found = face.edge(ring, edge).map(|e| e.curve.as_ref().clone());
                let counts: Vec<usize> = face.rings().iter().map(|r| r.edges.len()).collect();
                found.ok_or_else(|| no_edge(format!("its loops have {counts:?} edges, each numbered from 0")))
            }
            _ => {
                let side = Side::ALL.get(edge).filter(|_| ring == 0);
                let has = "untrimmed surfaces have loop 0 with edges 0 to 3";
                Ok(surface.border(*side.ok_or_else(|| no_edge(has.into()))?)?)
            }
        }
    }

    fn iso(&self, number: usize, at: IsoAt, from: f64, to: f64) -> Result<Curve, PieceError> {
        let surface = self.surface(number)?;
        let [u, v] = surface.domain();
        let (fixed, c, across, along) = match at {
            IsoAt::U(c) => (Direction::U, c, u, v),
            IsoAt::V(c) => (Direction::V, c, v, u),
        };
        let c = inside("the fixed parameter of an iso-curve", c, across)?;
        let from = inside("`from` of an iso-curve", from, along)?;
        let to = inside("`to` of an iso-curve", to, along)?;
        if from == to {
            return Err(PieceError::ZeroLength { at: from });
        }
        let curve = surface.iso_curve(fixed, c)?.restricted(from.min(to), from.max(to))?;
        Ok(if from > to { curve.reversed() } else { curve })
    }

    /// The polyline put onto the nearest surfaces: a C1 cubic between each two points, refined until its middles
    /// are within a tenth of the healing tolerance of the surfaces (at most 256 spans). Where it crosses from one
    /// surface to another over a gap it jumps smoothly.
    fn drawn(&mut self, points: &[(f64, f64, f64)], job: &Job) -> Result<Curve, PieceError> {
        let corners: Vec<DVec3> = distinct(points)?;
        let set = match &self.set {
            Some(set) => Arc::clone(set),
            None => {
                let set = Arc::new(SurfaceSet::new(self.onto.clone(), self.options.chord_tol, job));
                self.set = Some(Arc::clone(&set));
                set
            }
        };
        if set.is_empty() {
            return Err(PieceError::NothingToDrawOn);
        }
        let mut scratch = Scratch::default();
        let mut foot = |p: DVec3| set.closest(p, f64::INFINITY, &mut scratch).map_or(p, |f| f.point);
        let mut net: Vec<DVec3> = vec![foot(corners[0])];
        let mut breaks = vec![0.0];
        for pair in corners.windows(2) {
            let at = |f: f64| pair[0].lerp(pair[1], f);
            let mut spans = 4;
            let row = loop {
                let row: Vec<DVec3> = (0..=spans).map(|i| foot(at(i as f64 / spans as f64))).collect();
                let net = bezier_row(&row);
                let off = (0..spans).map(|i| {
                    let c = &net[3 * i..3 * i + 4];
                    let middle = (c[0] + (c[1] + c[2]) * 3.0 + c[3]) / 8.0;
                    foot(middle).distance(middle)
                });
                if off.fold(0.0, f64::max) <= 0.1 * self.options.tol || spans >= 256 || job.is_cancelled() {
                    break net;
                }
                spans *= 2;
            };
            let (start, length) = (breaks[breaks.len() - 1], pair[0].distance(pair[1]));
            breaks.extend((1..=spans).map(|i| start + length * i as f64 / spans as f64));
            net.extend(&row[1..]);
        }
        let knots = Knots::clamped(3, &breaks, 3).map_err(CurveError::from)?;
        Ok(Curve::new(knots, net, None)?)
    }

    /// The part of a piece between two fractions of its arc length, as a piece of the same kind; it runs
    /// backwards when `from > to`.
    pub fn trimmed(&mut self, piece: &Piece, from: f64, to: f64, job: &Job) -> Result<Piece, PieceError> {
        let (f, t) = (inside("`from` of a trim", from, [0.0, 1.0])?, inside("`to` of a trim", to, [0.0, 1.0])?);
        let scale = |a: f64, b: f64, f: f64| a + (b - a) * f;
        Ok(match piece {
            Piece::Edge { face, ring, edge, from: a, to: b } => {
                Piece::Edge { face: *face, ring: *ring, edge: *edge, from: scale(*a, *b, f), to: scale(*a, *b, t) }
            }
            Piece::Curve { id, from: a, to: b } => {
                Piece::Curve { id: *id, from: scale(*a, *b, f), to: scale(*a, *b, t) }
            }
            Piece::Chain { mesh, chain, from: a, to: b } => {
                Piece::Chain { mesh: *mesh, chain: *chain, from: scale(*a, *b, f), to: scale(*a, *b, t) }
            }
            Piece::Iso { surface, at, from: a, to: b } => {
                let curve = self.curve(piece, job)?;
                let arc = ArcLength::new(&curve);
                // The curve runs over the iso's own parameters, turned around when they decrease.
                let parameter = |f: f64| {
                    let t = arc.parameter_at(&curve, f * arc.length());
                    if a > b { a + b - t } else { t }
                };
                Piece::Iso { surface: *surface, at: *at, from: parameter(f), to: parameter(t) }
            }
            Piece::Line(a, b) => {
                let (a, b) = (DVec3::from(*a), DVec3::from(*b));
                Piece::Line(a.lerp(b, f).into(), a.lerp(b, t).into())
            }
            Piece::Polyline(points) => Piece::Polyline(cut(points, f, t)?),
            Piece::Drawn(points) => Piece::Drawn(cut(points, f, t)?),
        })
    }
}

fn inside(what: &'static str, got: f64, [low, high]: [f64; 2]) -> Result<f64, PieceError> {
    // Numbers that went through a text may be off by rounding.
    let slack = 1e-9 * (high - low);
    if got >= low - slack && got <= high + slack {
        Ok(got.clamp(low, high))
    } else {
        Err(PieceError::Range { what, got, low, high })
    }
}

fn by_fractions(curve: &Curve, from: f64, to: f64) -> Result<Curve, PieceError> {
    let from = inside("`from` (a fraction of the arc length)", from, [0.0, 1.0])?;
    let to = inside("`to` (a fraction of the arc length)", to, [0.0, 1.0])?;
    if from == to {
        return Err(PieceError::ZeroLength { at: from });
    }
    Ok(ArcLength::new(curve).piece(curve, from, to)?)
}

fn distinct(points: &[(f64, f64, f64)]) -> Result<Vec<DVec3>, PieceError> {
    let mut points: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
    if let Some(index) = points.iter().position(|p| !p.is_finite()) {
        return Err(CurveError::NotFinite { index, point: points[index] }.into());
    }
    points.dedup();
    if points.len() < 2 {
        return Err(PieceError::ZeroLength { at: 0.0 });
    }
    Ok(points)
}

fn polyline(points: &[(f64, f64, f64)]) -> Result<Curve, PieceError> {
    Ok(Curve::polyline(&distinct(points)?)?)
}

/// The points of a polyline between two fractions of its length.
fn cut(points: &[(f64, f64, f64)], from: f64, to: f64) -> Result<Vec<(f64, f64, f64)>, PieceError> {
    let curve = by_fractions(&polyline(points)?, from, to)?;
    Ok(curve.points().iter().map(|p| (p.x, p.y, p.z)).collect())
}

/// The number of an entity among the document's original surfaces.
pub fn surface_number(document: &Document, id: EntityId) -> Option<usize> {
    document.surfaces().position(|(other, _)| other == id)
}

/// The whole iso-curve of a surface through `uv`, fixed in one direction.
pub fn iso_piece(document: &Document, id: EntityId, fixed: Direction, uv: DVec2) -> Option<Piece> {
    let surface = surface_number(document, id)?;
    let [u, v] = document.surfaces().nth(surface)?.1.domain();
    let (at, [from, to]) = match fixed {
        Direction::U => (IsoAt::U(uv.x.clamp(u[0], u[1])), v),
        Direction::V => (IsoAt::V(uv.y.clamp(v[0], v[1])), u),
    };
    Some(Piece::Iso { surface, at, from, to })
}

/// A whole edge of an untrimmed surface.
pub fn edge_piece(document: &Document, id: EntityId, side: Side) -> Option<Piece> {
    let face = surface_number(document, id)?;
    Some(Piece::Edge { face, ring: 0, edge: side as usize, from: 0.0, to: 1.0 })
}

/// A whole free curve.
pub fn curve_piece(document: &Document, id: EntityId) -> Option<Piece> {
    let number = document.curves().position(|(other, _)| other == id)?;
    Some(Piece::Curve { id: number, from: 0.0, to: 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::document::{Shape, Unit};

    /// A quarter cylinder of radius 2 (u around, v up to 3) and a free circle arc.
    fn model() -> Document {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let ring = |z: f64| [DVec3::new(2.0, 0.0, z), DVec3::new(2.0, 2.0, z), DVec3::new(0.0, 2.0, z)];
        let surface = Surface::new(
            Knots::bezier(2, 0.0, 1.0).unwrap(),
            Knots::bezier(1, 0.0, 3.0).unwrap(),
            [ring(0.0), ring(3.0)].concat(),
            Some([1.0, w, 1.0].repeat(2)),
        )
        .unwrap();
        let arc = Curve::new(Knots::bezier(2, 0.0, 1.0).unwrap(), ring(5.0).to_vec(), Some(vec![1.0, w, 1.0])).unwrap();
        let mut document = Document::new(Unit::Millimetre);
        document.add("cylinder", Shape::Surface(Arc::new(surface)), None);
        document.add("arc", Shape::Curve(Arc::new(arc)), None);
        document
    }

    fn resolver(document: &Document) -> PieceResolver<'_> {
        let onto = document.bodies().map(|(_, body)| body).enumerate().collect();
        PieceResolver::new(document, onto, HealOptions::of(&document.bounds()))
    }

    fn angle(p: DVec3) -> f64 {
        p.y.atan2(p.x).to_degrees()
    }

    #[test]
    fn every_kind_of_piece_lies_where_it_should() {
        let document = model();
        let mut r = resolver(&document);
        let job = Job::new();
        let mut curve = |piece: Piece| r.curve(&piece, &job).unwrap();
        let iso = curve(Piece::Iso { surface: 0, at: IsoAt::U(0.5), from: 2.5, to: 0.5 });
        assert!((angle(iso.ends()[0]) - 45.0).abs() < 1e-12 && (iso.ends()[0].z - 2.5).abs() < 1e-12);
        assert!((iso.ends()[1].z - 0.5).abs() < 1e-12);
        let edge = curve(Piece::Edge { face: 0, ring: 0, edge: 2, from: 1.0 / 3.0, to: 1.0 });
        assert!((angle(edge.ends()[0]) - 30.0).abs() < 1e-9 && (edge.ends()[0].z - 3.0).abs() < 1e-12);
        let free = curve(Piece::Curve { id: 0, from: 1.0, to: 2.0 / 3.0 });
        assert!((angle(free.ends()[0]) - 90.0).abs() < 1e-9 && (angle(free.ends()[1]) - 60.0).abs() < 1e-9);
        let drawn = curve(Piece::Drawn(vec![(3.0, 0.0, 0.5), (1.2, 1.2, 1.5), (0.0, 1.0, 2.5)]));
        for (_, p) in drawn.sampled(4) {
            assert!((p.truncate().length() - 2.0).abs() < 1e-5, "{p}");
        }
        assert!(drawn.ends()[0].distance(DVec3::new(2.0, 0.0, 0.5)) < 1e-9);
    }

    #[test]
    fn trims_are_parts_of_the_same_curve() {
        let document = model();
        let (id, curve_id) = (document.entities()[0].id, document.entities()[1].id);
        let mut r = resolver(&document);
        let job = Job::new();
        let pieces = [
            iso_piece(&document, id, Direction::V, DVec2::new(0.3, 1.5)).unwrap(),
            Piece::Iso { surface: 0, at: IsoAt::V(1.0), from: 0.9, to: 0.1 },
            edge_piece(&document, id, Side::VMax).unwrap(),
            curve_piece(&document, curve_id).unwrap(),
            Piece::Line((0.0, 0.0, 0.0), (1.0, 2.0, 2.0)),
            Piece::Polyline(vec![(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0)]),
        ];
        for piece in pieces {
            let whole = r.curve(&piece, &job).unwrap();
            let arc = ArcLength::new(&whole);
            let part = r.trimmed(&piece, 0.75, 0.25, &job).unwrap();
            let part = r.curve(&part, &job).unwrap();
            for (k, f) in [(0, 0.75), (1, 0.25)] {
                assert!(part.ends()[k].distance(arc.point(&whole, f)) < 1e-9, "{piece:?}");
            }
            assert!((ArcLength::new(&part).length() - 0.5 * arc.length()).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_not_there_is_named() {
        let document = model();
        let mut r = resolver(&document);
        let job = Job::new();
        let mut error = |piece: Piece| r.curve(&piece, &job).unwrap_err();
        let iso = |surface, c, from, to| Piece::Iso { surface, at: IsoAt::U(c), from, to };
        assert_eq!(error(iso(3, 0.5, 0.0, 1.0)), PieceError::NoSurface { number: 3, count: 1 });
        assert!(matches!(error(iso(0, 1.5, 0.0, 1.0)), PieceError::Range { got: 1.5, high: 1.0, .. }));
        assert!(matches!(error(iso(0, 0.5, 0.0, 3.1)), PieceError::Range { got: 3.1, high: 3.0, .. }));
        assert!(matches!(error(iso(0, f64::NAN, 0.0, 1.0)), PieceError::Range { .. }));
        assert!(matches!(error(iso(0, 0.5, 1.0, 1.0)), PieceError::ZeroLength { .. }));
        let edge = |ring, edge| Piece::Edge { face: 0, ring, edge, from: 0.0, to: 1.0 };
        assert!(matches!(error(edge(0, 4)), PieceError::NoEdge { edge: 4, .. }));
        assert!(matches!(error(edge(1, 0)), PieceError::NoEdge { ring: 1, .. }));
        assert!(matches!(error(Piece::Curve { id: 1, from: 0.0, to: 1.0 }), PieceError::NoCurve { .. }));
        assert!(matches!(error(Piece::Polyline(vec![(1.0, 1.0, 1.0); 3])), PieceError::ZeroLength { .. }));
        assert!(matches!(error(Piece::Drawn(vec![(f64::NAN, 0.0, 0.0)])), PieceError::Curve(_)));
    }
}
