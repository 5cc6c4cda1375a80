//! The kinds of edges, how each is drawn, and the list of all of them.

use super::super::colormap::Rgb;
use super::super::display::CurveRef;
use crate::model::document::EntityId;

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
