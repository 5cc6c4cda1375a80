//! What an intersection computes: curves, junctions, miter points, regions, and what could not be resolved.
//!
//! The types serialize to the JSON that `intersect`, `self-intersect` and `offset` print, and are shared by them.
//! Lengths are in model units, parameters in the knot domain of each surface. For a self-intersection `b` and `st`
//! name the second parameter point of the same surface.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A point on two surfaces at once.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// The point in space (midway between the two surface points).
    pub xyz: DVec3,
    /// The number of the first surface.
    pub a: usize,
    /// Its parameters.
    pub uv: DVec2,
    /// The number of the second surface.
    pub b: usize,
    /// Its parameters.
    pub st: DVec2,
}

impl CurvePoint {
    /// The same point with the two surfaces exchanged.
    #[must_use]
    pub fn swapped(self) -> Self {
        Self { xyz: self.xyz, a: self.b, uv: self.st, b: self.a, st: self.uv }
    }
}

/// What a curve is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveKind {
    /// The surfaces cross along it.
    Transversal,
    /// The surfaces touch along it.
    Tangential,
    /// It bounds a region in which the surfaces coincide.
    CoincidentBoundary,
    /// A surface meets itself along it.
    #[serde(rename = "self")]
    SelfIntersection,
    /// A sharp edge of an offset surface.
    CuspEdge,
    /// A self-intersection of an offset surface.
    Offset,
    /// The contour along which an offset surface is singular.
    OffsetContour,
}

/// How a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveEnd {
    /// On the border of one of the surfaces.
    Boundary,
    /// In a junction of several curves.
    Junction,
    /// In a miter point.
    Miter,
    /// Nowhere: the curve is closed.
    Loop,
    /// Where the computation had to give up.
    Unresolved,
}

/// One curve from end to end, as points that lie on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntersectionCurve {
    /// What it is.
    pub kind: CurveKind,
    /// Whether it is closed; then the last point repeats the first.
    pub closed: bool,
    /// How it starts and ends.
    pub ends: [CurveEnd; 2],
    /// The junction or miter point in which it starts and ends.
    pub end_ids: [Option<usize>; 2],
    /// An upper bound, over the whole curve, of the distance of its chords and arcs to both surfaces.
    pub error_bound: f64,
    /// The coincident region that it bounds.
    pub region: Option<usize>,
    /// Points on it, in order. Where it crosses from one patch to the next, a point occurs once for each.
    pub points: Vec<CurvePoint>,
}

/// What a junction is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JunctionKind {
    /// Two branches cross.
    X,
    /// The surfaces touch in this point only.
    Isolated,
    /// Two branches pass each other at a distance that follows from `gap`.
    NearMiss,
    /// Another number of branches meet.
    HigherOrder,
    /// Branches of three bodies cross; the surfaces do not touch here.
    ThreeSurfaces,
}

/// A point in which the surfaces touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Junction {
    /// The point in space.
    pub xyz: DVec3,
    /// The number of the first surface.
    pub a: usize,
    /// Its parameters.
    pub uv: DVec2,
    /// The number of the second surface.
    pub b: usize,
    /// Its parameters.
    pub st: DVec2,
    /// The signed distance of the surfaces there, along the normal of the first.
    pub gap: f64,
    /// What meets there.
    pub kind: JunctionKind,
}

/// A miter point: the end of a self-intersection curve, where both parameter points fall together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Miter {
    /// The point in space.
    pub xyz: DVec3,
    /// The number of the surface.
    pub a: usize,
    /// Its parameters.
    pub uv: DVec2,
    /// The corners, in parameters, of a quadrangle around it whose image lies within `radius`.
    pub quad: [DVec2; 4],
    /// The radius of a ball around the image of `quad`.
    pub radius: f64,
    /// Whether no branch starts here.
    pub isolated: bool,
}

/// A region in which the surfaces coincide.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Closed loops, outer first, counter-clockwise in the parameters of `a`; the last point repeats the first.
    pub boundary: Vec<Vec<CurvePoint>>,
    /// An upper bound of the distance of the surfaces within the region.
    pub max_distance: f64,
}

/// A pair of boxes in which the computation could not decide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unresolved {
    /// The number of the first surface.
    pub a: usize,
    /// `[[u0, u1], [v0, v1]]`.
    pub uv_box: [[f64; 2]; 2],
    /// The number of the second surface.
    pub b: usize,
    /// `[[s0, s1], [t0, t1]]`.
    pub st_box: [[f64; 2]; 2],
    /// Why.
    pub reason: String,
}

/// How much work was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Pairs of leaves in which a curve was looked for.
    pub leaf_pairs: usize,
    /// Nodes of the bounding volume hierarchies that were built.
    pub nodes_built: usize,
}

/// Where the time went, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Building hierarchies (in lazy builds: preparing the pieces).
    pub build: f64,
    /// Finding the pairs.
    pub traverse: f64,
    /// Tracing and merging curves.
    pub curves: f64,
}

/// The whole answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Intersection {
    /// Whether everything was resolved and no cap was hit.
    pub complete: bool,
    /// How closely the curves follow.
    pub tol: f64,
    /// All curves.
    pub curves: Vec<IntersectionCurve>,
    /// All points of contact.
    pub junctions: Vec<Junction>,
    /// All miter points.
    pub miters: Vec<Miter>,
    /// All coincident regions.
    pub regions: Vec<Region>,
    /// What could not be decided; empty exactly when `complete`, unless a cap was hit.
    pub unresolved: Vec<Unresolved>,
    /// How much work was done.
    pub counts: Counts,
    /// How long it took.
    pub time_ms: Times,
}

impl Intersection {
    /// Adds another answer to this one; its numbers of junctions, miter points and regions move up.
    pub fn append(&mut self, other: Self) {
        let (junctions, miters, regions) = (self.junctions.len(), self.miters.len(), self.regions.len());
        self.complete &= other.complete;
        self.tol = self.tol.max(other.tol);
        self.curves.extend(other.curves.into_iter().map(|mut curve| {
            for (end, id) in curve.ends.iter().zip(&mut curve.end_ids) {
                let shift = if *end == CurveEnd::Miter { miters } else { junctions };
                *id = id.map(|k| k + shift);
            }
            curve.region = curve.region.map(|k| k + regions);
            curve
        }));
        self.junctions.extend(other.junctions);
        self.miters.extend(other.miters);
        self.regions.extend(other.regions);
        self.unresolved.extend(other.unresolved);
        self.counts.leaf_pairs += other.counts.leaf_pairs;
        self.counts.nodes_built += other.counts.nodes_built;
        self.time_ms.build += other.time_ms.build;
        self.time_ms.traverse += other.time_ms.traverse;
        self.time_ms.curves += other.time_ms.curves;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_the_documented_names() {
        let point = CurvePoint { xyz: DVec3::X, a: 0, uv: DVec2::ZERO, b: 4, st: DVec2::ONE };
        let curve = IntersectionCurve {
            kind: CurveKind::SelfIntersection,
            closed: false,
            ends: [CurveEnd::Boundary, CurveEnd::Junction],
            end_ids: [None, Some(0)],
            error_bound: 0.5,
            region: None,
            points: vec![point],
        };
        let junction = Junction {
            xyz: DVec3::X,
            a: 0,
            uv: DVec2::ZERO,
            b: 4,
            st: DVec2::ONE,
            gap: 0.0,
            kind: JunctionKind::NearMiss,
        };
        let result = Intersection { curves: vec![curve], junctions: vec![junction], ..Intersection::default() };
        let json = serde_json::to_value(&result).unwrap();
        assert_eq!(json["curves"][0]["kind"], "self");
        assert_eq!(json["curves"][0]["ends"], serde_json::json!(["boundary", "junction"]));
        assert_eq!(json["curves"][0]["end_ids"], serde_json::json!([null, 0]));
        assert_eq!(
            json["curves"][0]["points"][0],
            serde_json::json!({"xyz": [1.0, 0.0, 0.0], "a": 0, "uv": [0.0, 0.0], "b": 4, "st": [1.0, 1.0]})
        );
        assert_eq!(json["junctions"][0]["kind"], "near-miss");
        let back: Intersection = serde_json::from_value(json).unwrap();
        assert_eq!(back, result);
    }
}
