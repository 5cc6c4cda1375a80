//! Trimmed faces: a surface and the loops in its parameter plane that bound the part which counts.
//!
//! An edge of a face is a curve in space, which neighbouring faces share, with the parameter curve that belongs to it on
//! this face; both have the same parameter, so that a point of the edge and its surface parameters are one number.
//! Inside is what an odd number of crossings separates from outside, so the direction of loops does not matter to it;
//! [`super::ring`] makes faces with the outer loop first and counter-clockwise, holes clockwise.
//!
//! [`Face::contains`] works on polygons within 1e-5 of the surface's size of the parameter curves, sorted into bands: some
//! tens of nanoseconds to a microsecond. Places as near as that to a loop are decided by the polygon.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::pcurve::uv_at;
use super::{Aabb, Curve, Surface};

/// What an edge of a face is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum EdgeRole {
    /// An edge of the model.
    #[default]
    Model,
    /// Where a closed surface was cut open to give the face one outer loop; no edge of the model.
    Cut,
    /// A single point in space: the border of the surface at a pole.
    Pole,
}

/// One use of an edge by a face.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceEdge {
    /// Names the edge among those of the model: faces that share an edge have the same number here.
    pub id: u64,
    /// The edge in space.
    pub curve: Arc<Curve>,
    /// Its parameters on the surface of this face (z = 0), with the same parameter as `curve`.
    pub pcurve: Curve,
    /// Whether the loop runs against the curve.
    pub reversed: bool,
    /// What it is.
    pub role: EdgeRole,
}

impl FaceEdge {
    /// The parameters of the curve where the loop enters and leaves.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.curve.domain();
        if self.reversed { [b, a] } else { [a, b] }
    }

    /// The surface parameters where the loop enters and leaves.
    pub fn ends(&self) -> [DVec2; 2] {
        self.range().map(|t| uv_at(&self.pcurve, t))
    }

    /// The surface parameters at a parameter of the curve.
    pub fn uv(&self, t: f64) -> DVec2 {
        uv_at(&self.pcurve, t)
    }
}

/// A closed loop of edges, each beginning where the one before ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ring {
    /// The edges in order.
    pub edges: Vec<FaceEdge>,
}

/// What a surface was before it became a spline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SurfaceKind {
    /// A spline, or not known.
    #[default]
    Spline,
    /// A plane.
    Plane,
    /// A circular cylinder.
    Cylinder,
    /// A circular cone.
    Cone,
    /// A sphere.
    Sphere,
    /// A torus.
    Torus,
    /// A curve that was moved along a line.
    Extrusion,
    /// A curve that was turned around an axis.
    Revolution,
    /// The lines between two curves.
    Ruled,
    /// At a distance from another surface.
    Offset,
}

impl SurfaceKind {
    /// The word for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spline => "spline",
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::Sphere => "sphere",
            Self::Torus => "torus",
            Self::Extrusion => "extrusion",
            Self::Revolution => "revolution",
            Self::Ruled => "ruled",
            Self::Offset => "offset",
        }
    }
}

/// Why loops are no face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaceError {
    /// There is no loop, or one without edges.
    #[error("loop {ring} has no edges; a face needs at least one closed loop")]
    Empty {
        /// Which loop.
        ring: usize,
    },
    /// A parameter curve does not go with its curve.
    #[error("loop {ring}, edge {edge}: the parameter curve runs over {got:?}, its curve over {expected:?}")]
    Domain {
        /// Which loop.
        ring: usize,
        /// Which edge.
        edge: usize,
        /// The domain of the curve.
        expected: [f64; 2],
        /// The domain of the parameter curve.
        got: [f64; 2],
    },
    /// The loops surround nothing.
    #[error("its loops surround no area in the parameter plane")]
    NoArea,
}

/// A trimmed face.
#[derive(Clone, Debug)]
pub struct Face {
    surface: Arc<Surface>,
    rings: Vec<Ring>,
    /// What the surface was before it became a spline.
    pub kind: SurfaceKind,
    polygon: Polygon,
}

impl PartialEq for Face {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.surface == other.surface && self.rings == other.rings
    }
}

impl Face {
    /// Checks and keeps a face. The loops must be closed; gaps between consecutive edges are bridged straight.
    pub fn new(surface: Arc<Surface>, rings: Vec<Ring>, kind: SurfaceKind) -> Result<Self, FaceError> {
        if rings.is_empty() {
            return Err(FaceError::Empty { ring: 0 });
        }
        for (ring, r) in rings.iter().enumerate() {
            if r.edges.is_empty() {
                return Err(FaceError::Empty { ring });
            }
            for (edge, e) in r.edges.iter().enumerate() {
                let (expected, got) = (e.curve.domain(), e.pcurve.domain());
                if expected != got {
                    return Err(FaceError::Domain { ring, edge, expected, got });
                }
            }
        }
        let polygon = Polygon::of(&surface, &rings);
        if polygon.segments.is_empty() || !(polygon.area.abs() > 0.0) {
            return Err(FaceError::NoArea);
        }
        Ok(Self { surface, rings, kind, polygon })
    }

    /// The whole surface under the face.
    pub fn surface(&self) -> &Arc<Surface> {
        &self.surface
    }

    /// The loops, the outer one first.
    pub fn rings(&self) -> &[Ring] {
        &self.rings
    }

    /// An edge by loop and place in it.
    pub fn edge(&self, ring: usize, edge: usize) -> Option<&FaceEdge> {
        self.rings.get(ring)?.edges.get(edge)
    }

    /// The smallest rectangle of parameters around the loops.
    pub fn extent(&self) -> [DVec2; 2] {
        [self.polygon.low, self.polygon.high]
    }

    /// Whether a place of the surface belongs to the face. Borders belong to it or not, as rounding has it.
    pub fn contains(&self, uv: DVec2) -> bool {
        self.polygon.contains(uv)
    }

    /// Whether a place belongs to the face or is within `margin` of one of its loops, as measured along the surface.
    pub fn reaches(&self, uv: DVec2, margin: f64) -> bool {
        if self.contains(uv) {
            return true;
        }
        let jet = self.surface.jet(self.surface.clamped(uv), 1);
        let speed = DVec2::new(jet.u().length(), jet.v().length());
        self.polygon.nearest(uv, speed) <= margin
    }

    /// The stretches of the iso-line at `c` (of u for `k` 0, of v for 1) inside the face, in the other parameter.
    pub fn stretches(&self, k: usize, c: f64) -> Vec<[f64; 2]> {
        let mut at: Vec<f64> = self
            .polygon
            .segments
            .iter()
            .filter(|[a, b]| (a[k] > c) != (b[k] > c))
            .map(|[a, b]| a[1 - k] + (c - a[k]) / (b[k] - a[k]) * (b[1 - k] - a[1 - k]))
            .collect();
        at.sort_by(f64::total_cmp);
        let [start, end] = self.surface.domain()[1 - k];
        at.chunks_exact(2).map(|p| [p[0].clamp(start, end), p[1].clamp(start, end)]).filter(|p| p[0] < p[1]).collect()
    }

    /// A box around the face: its edges and the piece of the surface between them.
    pub fn bounds(&self) -> Aabb {
        let [low, high] = self.extent();
        let (a, b) = (self.surface.clamped(low), self.surface.clamped(high));
        let piece = if a.x < b.x && a.y < b.y { self.surface.restricted([a.x, b.x], [a.y, b.y]).ok() } else { None };
        piece.map_or_else(|| self.surface.bounds(), |s| s.bounds())
    }

    /// The face moved by an affine map. Curves that were shared are not shared afterwards: use [`moved`] for several.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        let mut shared = std::collections::HashMap::new();
        self.transformed_sharing(map, &mut shared)
    }

    fn transformed_sharing(
        &self,
        map: &DAffine3,
        shared: &mut std::collections::HashMap<*const Curve, Arc<Curve>>,
    ) -> Self {
        let mut rings = self.rings.clone();
        for edge in rings.iter_mut().flat_map(|r| &mut r.edges) {
            let key = Arc::as_ptr(&edge.curve);
            edge.curve = Arc::clone(shared.entry(key).or_insert_with(|| Arc::new(edge.curve.transformed(map))));
        }
        let surface = Arc::new(self.surface.transformed(map));
        Self { surface, rings, kind: self.kind, polygon: self.polygon.clone() }
    }
}

/// Faces moved together: edges that they share stay shared.
#[must_use]
pub fn moved(faces: &[Arc<Face>], map: &DAffine3) -> Vec<Face> {
    let mut shared = std::collections::HashMap::new();
    faces.iter().map(|f| f.transformed_sharing(map, &mut shared)).collect()
}

/// A surface, all of it or a face on it: what tools work on.
#[derive(Clone, Debug)]
pub enum Sheet {
    /// A whole surface.
    Whole(Arc<Surface>),
    /// The trimmed part of one.
    Trimmed(Arc<Face>),
}

impl Sheet {
    /// The surface.
    pub fn surface(&self) -> &Arc<Surface> {
        match self {
            Self::Whole(surface) => surface,
            Self::Trimmed(face) => face.surface(),
        }
    }

    /// The face, where it is trimmed.
    pub fn face(&self) -> Option<&Arc<Face>> {
        match self {
            Self::Whole(_) => None,
            Self::Trimmed(face) => Some(face),
        }
    }

    /// Whether a place of the surface belongs to it, within `margin` along the surface.
    pub fn reaches(&self, uv: DVec2, margin: f64) -> bool {
        self.face().is_none_or(|face| face.reaches(uv, margin))
    }

    /// A box around it.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Whole(surface) => surface.bounds(),
            Self::Trimmed(face) => face.bounds(),
        }
    }
}

impl From<Arc<Surface>> for Sheet {
    fn from(surface: Arc<Surface>) -> Self {
        Self::Whole(surface)
    }
}

impl From<Arc<Face>> for Sheet {
    fn from(face: Arc<Face>) -> Self {
        Self::Trimmed(face)
    }
}

/// The loops as segments, sorted into bands of v.
#[derive(Clone, Debug, Default)]
struct Polygon {
    segments: Vec<[DVec2; 2]>,
    /// The segments that touch each band.
    bands: Vec<Vec<u32>>,
    low: DVec2,
    high: DVec2,
    /// The signed area, for the check that there is one.
    area: f64,
}

/// The polygon's distance from the parameter curves, as a fraction of the surface's size.
const POLYGON: f64 = 1e-5;
/// The most segments of one piece of a parameter curve.
const MAX_SEGMENTS: f64 = 256.0;

/// Points along an edge, in the direction of the loop, both ends included.
pub(super) fn edge_polygon(surface: &Surface, edge: &FaceEdge, tol: f64) -> Vec<DVec2> {
    let pcurve = &edge.pcurve;
    let mut out = vec![uv_at(pcurve, pcurve.domain()[0])];
    for pair in pcurve.knots().breaks().windows(2) {
        let h = pair[1] - pair[0];
        let mut parts = 1.0;
        if pcurve.knots().degree() > 1 {
            let jet = surface.jet(surface.clamped(uv_at(pcurve, 0.5 * (pair[0] + pair[1]))), 1);
            let bend = (0..=4).map(|i| {
                let d = pcurve.derivatives(pair[0] + h * f64::from(i) / 4.0, 2)[2];
                (jet.u() * d.x + jet.v() * d.y).length()
            });
            parts = (bend.fold(0.0, f64::max) * h * h / (8.0 * tol)).sqrt().ceil().clamp(2.0, MAX_SEGMENTS);
        }
        out.extend((1..parts as usize).map(|i| uv_at(pcurve, pair[0] + h * i as f64 / parts)));
        out.push(uv_at(pcurve, pair[1]));
    }
    if edge.reversed {
        out.reverse();
    }
    out
}

/// The polygon of a loop, without the repeated last point.
pub(super) fn ring_polygon(surface: &Surface, ring: &Ring, tol: f64) -> Vec<DVec2> {
    let mut out: Vec<DVec2> = Vec::new();
    for edge in &ring.edges {
        out.extend(edge_polygon(surface, edge, tol));
    }
    out.dedup();
    if out.len() > 1 && out.first() == out.last() {
        out.pop();
    }
    out
}

/// Twice the signed area of a polygon.
pub(super) fn doubled_area(polygon: &[DVec2]) -> f64 {
    let origin = polygon.first().copied().unwrap_or_default();
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| (*a - origin).perp_dot(*b - origin)).sum()
}

impl Polygon {
    fn of(surface: &Surface, rings: &[Ring]) -> Self {
        let tol = (POLYGON * surface.bounds().diagonal()).max(f64::MIN_POSITIVE);
        let mut out = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, ..Self::default() };
        for ring in rings {
            let points = ring_polygon(surface, ring, tol);
            out.area += doubled_area(&points);
            for (k, &a) in points.iter().enumerate() {
                out.segments.push([a, points[(k + 1) % points.len()]]);
                (out.low, out.high) = (out.low.min(a), out.high.max(a));
            }
        }
        let count = out.segments.len().clamp(1, 1024);
        out.bands = vec![Vec::new(); count];
        for k in 0..out.segments.len() {
            let [a, b] = out.segments[k];
            for band in out.band(a.y.min(b.y))..=out.band(a.y.max(b.y)) {
                out.bands[band].push(k as u32);
            }
        }
        out
    }

    fn band(&self, v: f64) -> usize {
        let share = (v - self.low.y) / (self.high.y - self.low.y);
        // NaN (no height) and what lies below go to the first band.
        ((share * self.bands.len() as f64) as usize).min(self.bands.len() - 1)
    }

    fn contains(&self, p: DVec2) -> bool {
        if !(p.cmpge(self.low).all() && p.cmple(self.high).all()) {
            return false;
        }
        let crossings = self.bands[self.band(p.y)].iter().filter(|&&k| {
            let [a, b] = self.segments[k as usize];
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        });
        crossings.count() % 2 == 1
    }

    /// The distance to the nearest segment in parameters scaled by `speed`.
    fn nearest(&self, p: DVec2, speed: DVec2) -> f64 {
        let distance = |[a, b]: [DVec2; 2]| {
            let (a, b) = ((a - p) * speed, (b - p) * speed);
            let d = b - a;
            let s = if d.length_squared() > 0.0 { (-a.dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
            (a + d * s).length()
        };
        self.segments.iter().map(|&s| distance(s)).fold(f64::INFINITY, f64::min)
    }
}

/// A point of an edge in space and in the parameters of its face.
pub fn edge_point(edge: &FaceEdge, t: f64) -> (DVec3, DVec2) {
    (edge.curve.eval(t), edge.uv(t))
}
