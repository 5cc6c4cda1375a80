//! One picked piece of a side: a stretch of a curve of the model, or points that the user set.

use glam::DVec3;

use crate::kernel::geom::arc_length::ArcLength;
use crate::kernel::geom::{Curve, Direction, Side};
use crate::kernel::mesh::facets::FacetCurveKind;
use crate::model::spec::{IsoAt, Piece};
use crate::view::display::CurveRef;
use crate::view::scene::{Item, ItemKind, Scene};

/// How many points stand for a piece of a curve, for every knot span and at least.
const PER_SPAN: usize = 8;
const AT_LEAST: usize = 48;
/// Into how many steps a segment drawn across surfaces is cut.
const DRAWN_STEPS: usize = 16;

/// Where a piece comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A stretch of a curve of the model.
    Curve {
        /// Which curve.
        curve: CurveRef,
        /// The stretch, `range[0] < range[1]`.
        range: [f64; 2],
        /// Where it was clicked: trimming keeps the part with this parameter.
        clicked: f64,
        /// The point there.
        at: DVec3,
    },
    /// A straight segment.
    Line([DVec3; 2]),
    /// A polyline.
    Polyline(Vec<DVec3>),
    /// A polyline put onto the nearest surfaces.
    Drawn(Vec<DVec3>),
}

/// A picked piece with the polyline that stands for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// Where it comes from.
    pub source: Source,
    /// Points along it in increasing parameter; at least two.
    pub points: Vec<DVec3>,
}

/// Why something cannot be a piece; the text goes into the status line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PieceError {
    /// The entity is not in the scene.
    #[error("that curve is no longer in the document")]
    Gone,
    /// A healed patch has no number to name it by.
    #[error("a healed patch cannot be a source; pick one of its sides to share it")]
    OnPatch,
    /// A piece without length.
    #[error("both ends are the same point; pick another one")]
    Point,
    /// A specification names something that is not there.
    #[error("{what} {number} is not in this document")]
    Missing {
        /// "surface", "curve", "mesh" or "chain".
        what: &'static str,
        /// Its number.
        number: usize,
    },
    /// A specification names an edge that an untrimmed surface has not.
    #[error("edge {edge} of loop {ring} is not there; an untrimmed surface has edges 0 to 3 of loop 0")]
    Edge {
        /// The loop.
        ring: usize,
        /// The edge.
        edge: usize,
    },
}

impl Picked {
    /// The stretch `range` of a curve (all of it without one), clicked at `clicked`.
    pub fn of_curve(scene: &Scene, curve: CurveRef, range: Option<[f64; 2]>, clicked: f64) -> Result<Self, PieceError> {
        let item = scene.curve_item(&curve).ok_or(PieceError::Gone)?;
        if item.kind == ItemKind::Patch {
            return Err(PieceError::OnPatch);
        }
        let domain = item.geometry.curve_domain(&curve).ok_or(PieceError::Gone)?;
        let range = range.unwrap_or(domain);
        let range = [range[0].max(domain[0]), range[1].min(domain[1])];
        if !(range[0] < range[1]) {
            return Err(PieceError::Point);
        }
        let points = sampled(item, &curve, range);
        if points.iter().all(|p| *p == points[0]) {
            return Err(PieceError::Point);
        }
        let clicked = clicked.clamp(range[0], range[1]);
        let at = item.geometry.curve_jet(&curve, clicked).map_or(points[0], |jet| jet[0]);
        Ok(Self { source: Source::Curve { curve, range, clicked, at }, points })
    }

    /// The straight segment between two points.
    pub fn line(a: DVec3, b: DVec3) -> Result<Self, PieceError> {
        if a == b {
            return Err(PieceError::Point);
        }
        Ok(Self { source: Source::Line([a, b]), points: vec![a, b] })
    }

    /// The polyline through points.
    pub fn polyline(points: &[DVec3]) -> Result<Self, PieceError> {
        let points = distinct(points)?;
        Ok(Self { source: Source::Polyline(points.clone()), points })
    }

    /// The polyline through points, put onto the nearest visible surface.
    pub fn drawn(scene: &Scene, points: &[DVec3]) -> Result<Self, PieceError> {
        let points = distinct(points)?;
        let mut on = vec![points[0]];
        for pair in points.windows(2) {
            let reach = pair[0].distance(pair[1]);
            for k in 1..DRAWN_STEPS {
                let p = pair[0].lerp(pair[1], k as f64 / DRAWN_STEPS as f64);
                let trees = scene.items().iter().filter(|i| i.visible()).filter_map(|i| i.display.as_ref());
                let nearest =
                    trees.filter_map(|d| d.tree.nearest(p, reach)).min_by(|a, b| a.distance.total_cmp(&b.distance));
                on.push(nearest.map_or(p, |n| n.point));
            }
            on.push(pair[1]);
        }
        Ok(Self { source: Source::Drawn(points), points: on })
    }

    /// The piece that a specification means.
    pub fn from_piece(scene: &Scene, piece: &Piece) -> Result<Self, PieceError> {
        let point = |p: &(f64, f64, f64)| DVec3::new(p.0, p.1, p.2);
        let by_fractions = |curve: CurveRef, item: &Item, from: f64, to: f64| {
            let exact = item.geometry.curve(&curve).ok_or(PieceError::Gone)?;
            let arc = ArcLength::new(&exact);
            let [start, end] = exact.domain();
            let at = |f: f64| match f {
                f if f <= 0.0 => start,
                f if f >= 1.0 => end,
                f => arc.parameter_at(&exact, f * arc.length()),
            };
            let (a, b) = (at(from.min(to)), at(from.max(to)));
            Self::of_curve(scene, curve, Some([a, b]), 0.5 * (a + b))
        };
        match piece {
            Piece::Iso { surface, at, from, to } => {
                let item = scene.surface(*surface).ok_or(PieceError::Missing { what: "surface", number: *surface })?;
                let curve = match *at {
                    IsoAt::U(c) => CurveRef::Iso(item.id(), Direction::U, c),
                    IsoAt::V(c) => CurveRef::Iso(item.id(), Direction::V, c),
                };
                Self::of_curve(scene, curve, Some([from.min(*to), from.max(*to)]), 0.5 * (from + to))
            }
            Piece::Edge { face, ring, edge, from, to } => {
                let item = scene.surface(*face).ok_or(PieceError::Missing { what: "surface", number: *face })?;
                let missing = PieceError::Edge { ring: *ring, edge: *edge };
                let curve = match item.entity.face() {
                    Some(face) => {
                        face.edge(*ring, *edge).ok_or(missing)?;
                        CurveRef::Edge(item.id(), *ring as u32, *edge as u32)
                    }
                    None => {
                        let side = Side::ALL.get(*edge).filter(|_| *ring == 0).ok_or(missing)?;
                        CurveRef::Border(item.id(), *side)
                    }
                };
                by_fractions(curve, item, *from, *to)
            }
            Piece::Curve { id, from, to } => {
                let found = scene.items().iter().find(|i| i.kind == ItemKind::Curve && i.number == Some(*id));
                let item = found.ok_or(PieceError::Missing { what: "curve", number: *id })?;
                by_fractions(CurveRef::Free(item.id()), item, *from, *to)
            }
            Piece::Chain { mesh, chain, from, to } => {
                let found = scene.items().iter().find(|i| i.kind == ItemKind::Mesh && i.number == Some(*mesh));
                let item = found.ok_or(PieceError::Missing { what: "mesh", number: *mesh })?;
                let kind = item.entity.facets().and_then(|f| f.curves().get(*chain)).map(|c| c.kind);
                let kind = kind.ok_or(PieceError::Missing { what: "chain", number: *chain })?;
                let name = if kind == FacetCurveKind::GridLine { CurveRef::GridLine } else { CurveRef::Chain };
                by_fractions(name(item.id(), *chain as u32), item, *from, *to)
            }
            Piece::Line(a, b) => Self::line(point(a), point(b)),
            Piece::Polyline(points) => Self::polyline(&points.iter().map(point).collect::<Vec<_>>()),
            Piece::Drawn(points) => Self::drawn(scene, &points.iter().map(point).collect::<Vec<_>>()),
        }
    }

    /// The piece as a specification writes it, run backwards when `reversed`.
    pub fn to_piece(&self, scene: &Scene, reversed: bool) -> Result<Piece, PieceError> {
        let triple = |p: &DVec3| (p.x, p.y, p.z);
        let list = |points: &[DVec3]| -> Vec<(f64, f64, f64)> {
            let mut out: Vec<_> = points.iter().map(triple).collect();
            if reversed {
                out.reverse();
            }
            out
        };
        let turned = |[a, b]: [f64; 2]| if reversed { [b, a] } else { [a, b] };
        match &self.source {
            Source::Line(ends) => {
                let list = list(ends);
                Ok(Piece::Line(list[0], list[1]))
            }
            Source::Polyline(points) => Ok(Piece::Polyline(list(points))),
            Source::Drawn(points) => Ok(Piece::Drawn(list(points))),
            Source::Curve { curve, range, .. } => {
                let item = scene.curve_item(curve).ok_or(PieceError::Gone)?;
                let number = item.number.ok_or(PieceError::OnPatch)?;
                match *curve {
                    CurveRef::Iso(_, fixed, c) => {
                        let [from, to] = turned(*range);
                        let at = if fixed == Direction::U { IsoAt::U(c) } else { IsoAt::V(c) };
                        Ok(Piece::Iso { surface: number, at, from, to })
                    }
                    // The edges of a face are those of its loops: a border of the surface under it is an iso-curve.
                    CurveRef::Border(_, side) if item.entity.face().is_some() => {
                        let surface = item.geometry.surface().ok_or(PieceError::Gone)?;
                        let [u, v] = surface.domain();
                        let at = match side {
                            Side::VMin => IsoAt::V(v[0]),
                            Side::UMax => IsoAt::U(u[1]),
                            Side::VMax => IsoAt::V(v[1]),
                            Side::UMin => IsoAt::U(u[0]),
                        };
                        let [from, to] = turned(*range);
                        Ok(Piece::Iso { surface: number, at, from, to })
                    }
                    CurveRef::Border(_, side) => {
                        let [from, to] = turned(fractions(item, curve, *range)?);
                        Ok(Piece::Edge { face: number, ring: 0, edge: side as usize, from, to })
                    }
                    CurveRef::Chain(_, chain) | CurveRef::GridLine(_, chain) => {
                        let [from, to] = turned(fractions(item, curve, *range)?);
                        Ok(Piece::Chain { mesh: number, chain: chain as usize, from, to })
                    }
                    CurveRef::Edge(_, ring, edge) => {
                        let [from, to] = turned(fractions(item, curve, *range)?);
                        Ok(Piece::Edge { face: number, ring: ring as usize, edge: edge as usize, from, to })
                    }
                    CurveRef::Free(_) => {
                        let [from, to] = turned(fractions(item, curve, *range)?);
                        Ok(Piece::Curve { id: number, from, to })
                    }
                }
            }
        }
    }

    /// The curve and stretch of a piece of a curve.
    pub fn stretch(&self) -> Option<(CurveRef, [f64; 2])> {
        match self.source {
            Source::Curve { curve, range, .. } => Some((curve, range)),
            _ => None,
        }
    }

    /// Where it was clicked; nothing for points that the user set.
    pub fn clicked(&self) -> Option<DVec3> {
        match self.source {
            Source::Curve { at, .. } => Some(at),
            _ => None,
        }
    }

    /// Its end points.
    pub fn ends(&self) -> [DVec3; 2] {
        [self.points[0], self.points[self.points.len() - 1]]
    }

    /// The direction at its start (0) or end (1), pointing out of the piece.
    pub fn outwards(&self, end: usize) -> DVec3 {
        let n = self.points.len();
        let (tip, next) =
            if end == 0 { (self.points[0], self.points[1]) } else { (self.points[n - 1], self.points[n - 2]) };
        (tip - next).normalize_or_zero()
    }

    /// The length of its polyline.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    /// How near its polyline comes to a point.
    pub fn distance(&self, p: DVec3) -> f64 {
        nearest_on(&self.points, p).1
    }

    /// The curve's parameter nearest to a point, anywhere on the whole curve.
    pub fn nearest_parameter(&self, scene: &Scene, p: DVec3) -> Option<f64> {
        let Source::Curve { curve, .. } = &self.source else { return None };
        let item = scene.curve_item(curve)?;
        nearest_parameter(item, curve, p)
    }

    /// The piece with one end (0 start, 1 end) moved along its curve to a parameter. Points of lines and polylines move
    /// freely by [`Picked::moved`].
    pub fn trimmed(&self, scene: &Scene, end: usize, t: f64) -> Result<Self, PieceError> {
        let Source::Curve { curve, range, clicked, .. } = self.source else { return Ok(self.clone()) };
        let range = if end == 0 { [t, range[1]] } else { [range[0], t] };
        Self::of_curve(scene, curve, Some(range), clicked)
    }

    /// A segment or polyline with one end moved to a point.
    pub fn moved(&self, scene: &Scene, end: usize, to: DVec3) -> Result<Self, PieceError> {
        let with = |points: &[DVec3]| {
            let mut points = points.to_vec();
            let at = if end == 0 { 0 } else { points.len() - 1 };
            points[at] = to;
            points
        };
        match &self.source {
            Source::Line(ends) => {
                let p = with(ends);
                Self::line(p[0], p[1])
            }
            Source::Polyline(points) => Self::polyline(&with(points)),
            Source::Drawn(points) => Self::drawn(scene, &with(points)),
            Source::Curve { .. } => match self.nearest_parameter(scene, to) {
                Some(t) => self.trimmed(scene, end, t),
                None => Err(PieceError::Gone),
            },
        }
    }

    /// The two parts before and after the place nearest to a point. An error where one of them would be a point.
    pub fn split(&self, scene: &Scene, at: DVec3) -> Result<[Self; 2], PieceError> {
        let parts = |points: &[DVec3]| {
            let (k, _, foot) = nearest_on_at(points, at);
            let mut first = points[..=k].to_vec();
            first.push(foot);
            let mut second = vec![foot];
            second.extend_from_slice(&points[k + 1..]);
            [first, second]
        };
        match &self.source {
            Source::Curve { curve, range, .. } => {
                let t = self.nearest_parameter(scene, at).ok_or(PieceError::Gone)?;
                let part = |a: f64, b: f64| Self::of_curve(scene, *curve, Some([a, b]), 0.5 * (a + b));
                Ok([part(range[0], t)?, part(t, range[1])?])
            }
            Source::Line(ends) => {
                let [a, b] = parts(ends);
                Ok([Self::line(a[0], a[1])?, Self::line(b[0], b[1])?])
            }
            Source::Polyline(points) => {
                let [a, b] = parts(points);
                Ok([Self::polyline(&a)?, Self::polyline(&b)?])
            }
            Source::Drawn(points) => {
                let [a, b] = parts(points);
                Ok([Self::drawn(scene, &a)?, Self::drawn(scene, &b)?])
            }
        }
    }
}

fn distinct(points: &[DVec3]) -> Result<Vec<DVec3>, PieceError> {
    let mut points = points.to_vec();
    points.dedup();
    if points.len() < 2 || points.iter().any(|p| !p.is_finite()) { Err(PieceError::Point) } else { Ok(points) }
}

fn sampled(item: &Item, curve: &CurveRef, range: [f64; 2]) -> Vec<DVec3> {
    let knots = item.geometry.curve_knots(curve);
    let mut breaks = vec![range[0]];
    breaks.extend(knots.into_iter().filter(|t| range[0] < *t && *t < range[1]));
    breaks.push(range[1]);
    // The chains of a mesh are straight between their points.
    let least = if item.geometry.is_fixed() { 1 } else { PER_SPAN };
    let per_span = least.max(AT_LEAST.div_ceil(breaks.len() - 1));
    let at = |t: f64| item.geometry.curve_jet(curve, t).map_or(DVec3::NAN, |jet| jet[0]);
    let mut points = vec![at(range[0])];
    for pair in breaks.windows(2) {
        points.extend((1..=per_span).map(|k| at(pair[0] + (pair[1] - pair[0]) * k as f64 / per_span as f64)));
    }
    points
}

/// The curve's parameter nearest to a point, by samples and then golden section around the best one.
pub(super) fn nearest_parameter(item: &Item, curve: &CurveRef, p: DVec3) -> Option<f64> {
    let [start, end] = item.geometry.curve_domain(curve)?;
    let mut breaks = vec![start];
    breaks.extend(item.geometry.curve_knots(curve));
    breaks.push(end);
    let per_span = PER_SPAN.max(AT_LEAST.div_ceil(breaks.len() - 1));
    let mut t = Vec::new();
    for pair in breaks.windows(2) {
        t.extend((0..per_span).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / per_span as f64));
    }
    t.push(end);
    let far = |t: f64| item.geometry.curve_jet(curve, t).map_or(f64::INFINITY, |jet| jet[0].distance_squared(p));
    let best = (0..t.len()).min_by(|&a, &b| far(t[a]).total_cmp(&far(t[b])))?;
    let (low, high) = (t[best.saturating_sub(1)], t[(best + 1).min(t.len() - 1)]);
    let mut s = t[best];
    for _ in 0..20 {
        let [q, d, dd] = item.geometry.curve_jet(curve, s)?;
        let (slope, bend) = ((q - p).dot(d), d.length_squared() + (q - p).dot(dd));
        let bend = if bend > 0.0 { bend } else { d.length_squared() };
        if !(bend > 0.0) {
            break;
        }
        let next = (s - slope / bend).clamp(low, high);
        if next == s {
            break;
        }
        s = next;
    }
    Some(if far(s) <= far(t[best]) { s } else { t[best] })
}

fn fractions(item: &Item, curve: &CurveRef, range: [f64; 2]) -> Result<[f64; 2], PieceError> {
    let exact = item.geometry.curve(curve).ok_or(PieceError::Gone)?;
    let [start, end] = exact.domain();
    let total = ArcLength::new(&exact).length();
    let up_to = |t: f64| -> Result<f64, PieceError> {
        if t <= start {
            return Ok(0.0);
        }
        if t >= end {
            return Ok(1.0);
        }
        let part: Curve = exact.restricted(start, t).map_err(|_| PieceError::Gone)?;
        Ok(ArcLength::new(&part).length() / total)
    };
    Ok([up_to(range[0])?, up_to(range[1])?])
}

/// The distance of a polyline from a point, with the place.
pub(super) fn nearest_on(points: &[DVec3], p: DVec3) -> (DVec3, f64) {
    let (_, distance, foot) = nearest_on_at(points, p);
    (foot, distance)
}

pub(super) fn nearest_on_at(points: &[DVec3], p: DVec3) -> (usize, f64, DVec3) {
    let mut best = (0, f64::INFINITY, points[0]);
    for (k, pair) in points.windows(2).enumerate() {
        let d = pair[1] - pair[0];
        let s = ((p - pair[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        let foot = if s.is_finite() { pair[0] + d * s } else { pair[0] };
        let distance = foot.distance(p);
        if distance < best.1 {
            best = (k, distance, foot);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::testing::{TILE, tiles};
    use super::*;
    use crate::view::display::CurveRef;

    #[test]
    fn pieces_survive_being_written_and_read() {
        let (document, scene) = tiles();
        let ids: Vec<_> = document.entities().iter().map(|e| e.id).collect();
        let pieces = [
            Picked::of_curve(&scene, CurveRef::Border(ids[1], Side::VMax), Some([0.25, 0.75]), 0.5),
            Picked::of_curve(&scene, CurveRef::Iso(ids[0], Direction::U, 0.3), Some([0.1, 0.9]), 0.5),
            Picked::line(DVec3::ZERO, DVec3::ONE),
            Picked::polyline(&[DVec3::ZERO, DVec3::ONE, DVec3::X]),
            Picked::drawn(&scene, &[DVec3::new(0.1, 0.1, 0.0), DVec3::new(0.8, 0.5, 0.0)]),
        ];
        for piece in pieces.map(Result::unwrap) {
            for reversed in [false, true] {
                let written = piece.to_piece(&scene, reversed).unwrap();
                let read = Picked::from_piece(&scene, &written).unwrap();
                let [a, b] = piece.ends();
                let [c, d] = read.ends();
                let forward = a.distance(c) + b.distance(d);
                let backward = a.distance(d) + b.distance(c);
                assert!(forward.min(backward) < 1e-9, "{written:?}");
                assert!((read.length() - piece.length()).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn trimming_and_splitting_keep_to_the_curve() {
        let (document, scene) = tiles();
        let id = document.entities()[0].id;
        let whole = Picked::of_curve(&scene, CurveRef::Border(id, Side::VMin), None, 0.5).unwrap();
        assert!((whole.length() - TILE).abs() < 1e-12);
        let t = whole.nearest_parameter(&scene, DVec3::new(0.3 * TILE, -5.0, 2.0)).unwrap();
        assert!((t - 0.3).abs() < 1e-12);
        let trimmed = whole.trimmed(&scene, 1, t).unwrap();
        assert!((trimmed.length() - 0.3 * TILE).abs() < 1e-12);
        let [a, b] = whole.split(&scene, DVec3::new(0.6 * TILE, 1.0, 0.0)).unwrap();
        assert!((a.length() - 0.6 * TILE).abs() < 1e-12 && a.ends()[1].distance(b.ends()[0]) < 1e-12);
        assert_eq!(whole.split(&scene, DVec3::ZERO), Err(PieceError::Point));
        assert_eq!(whole.trimmed(&scene, 1, -3.0), Err(PieceError::Point));
        let line = Picked::line(DVec3::ZERO, DVec3::X * 2.0).unwrap();
        let [a, b] = line.split(&scene, DVec3::new(0.5, 1.0, 0.0)).unwrap();
        assert_eq!((a.length(), b.length()), (0.5, 1.5));
    }

    #[test]
    fn what_is_drawn_lies_on_the_surfaces() {
        let (_, scene) = tiles();
        // Straight from tile to tile, lifted off: every point in between comes down to the sheet z = 0.
        let ends = [DVec3::new(0.2, 0.2, 0.1), DVec3::new(1.7, 0.4, 0.1)];
        let drawn = Picked::drawn(&scene, &ends).unwrap();
        let inner = &drawn.points[1..drawn.points.len() - 1];
        assert!(inner.len() > 10 && inner.iter().all(|p| p.z.abs() < 1e-12));
    }

    #[test]
    fn missing_things_are_named() {
        let (_, scene) = tiles();
        let edge = Piece::Edge { face: 0, ring: 1, edge: 0, from: 0.0, to: 1.0 };
        assert_eq!(Picked::from_piece(&scene, &edge), Err(PieceError::Edge { ring: 1, edge: 0 }));
        let curve = Piece::Curve { id: 7, from: 0.0, to: 1.0 };
        assert_eq!(Picked::from_piece(&scene, &curve), Err(PieceError::Missing { what: "curve", number: 7 }));
    }
}
