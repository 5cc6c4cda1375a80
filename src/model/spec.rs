//! How a heal is asked for, as data: the RON that `patchwright heal --patches` reads and that the picking tool
//! writes, so that a session can be replayed; and what a heal reports.

use serde::{Deserialize, Serialize};

pub use crate::kernel::heal::report::{BoundaryMode, HealStep, PatchReport};

/// A whole heal: several patches with common settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HealSpec {
    /// What two picked curve ends may be apart and still be joined, in model units. Default: 1e-3 of the diagonal.
    #[serde(default)]
    pub joining_tol: Option<f64>,
    /// The largest error wanted, in model units. Default: 1e-4 of the diagonal.
    #[serde(default)]
    pub tol: Option<f64>,
    /// The largest number of spans along one side.
    #[serde(default = "default_max_resolution")]
    pub max_resolution: usize,
    /// The surfaces to project on, by number; all when left out.
    #[serde(default)]
    pub onto: Option<Vec<usize>>,
    /// Half the thickness of the box of influence (d of HJR99 (7)); from the corners when left out.
    #[serde(default)]
    pub slab: Option<f64>,
    /// How many known projections an artificial one is made from (K of HJR99 (12)).
    #[serde(default = "default_neighbours")]
    pub neighbours: usize,
    /// The patches.
    pub patches: Vec<PatchSpec>,
}

fn default_max_resolution() -> usize {
    128
}

fn default_neighbours() -> usize {
    8
}

/// One patch: four sides, in any order and direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchSpec {
    /// What it is called.
    pub name: String,
    /// What becomes of each side's curve.
    #[serde(default)]
    pub boundary: [BoundaryMode; 4],
    /// The pieces of each side, in any order and direction.
    pub sides: [Vec<Piece>; 4],
    /// What was decided by hand about how the sides meet; nothing when left out.
    #[serde(default, skip_serializing_if = "Joining::is_default")]
    pub joining: Joining,
}

/// What was decided by hand about how four sides meet.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joining {
    /// How the sides follow each other; the loop with the smallest gaps when left out.
    pub arrangement: Option<Arrangement>,
    /// What two ends may be apart and still be joined in this patch; the heal's when left out.
    pub tol: Option<f64>,
    /// Ends that are moved before the sides are joined.
    pub moves: Vec<EndMove>,
}

impl Joining {
    /// Whether nothing was decided by hand.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// How four sides follow each other: side `order[k]` (from 0) at place k, run backwards where `reversed[k]`. Backwards
/// is against the direction in which its pieces are chained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Arrangement {
    /// The side at each place of the loop.
    pub order: [usize; 4],
    /// Whether it runs backwards there.
    pub reversed: [bool; 4],
}

/// The end of a side that is nearest to a point is moved onto it; the displacement fades along its last piece.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndMove {
    /// Which side, from 0.
    pub side: usize,
    /// Where its end goes.
    pub to: (f64, f64, f64),
}

/// One piece of a side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Piece {
    /// An iso-curve of a surface between two surface parameters: at `U(c)` it runs along v, at `V(c)` along u.
    Iso {
        /// The number of the surface.
        surface: usize,
        /// The parameter that stays fixed.
        at: IsoAt,
        /// Where it starts.
        from: f64,
        /// Where it ends.
        to: f64,
    },
    /// An edge of a face, between two fractions of its arc length.
    Edge {
        /// The number of the face.
        face: usize,
        /// The loop: 0 is the outer one.
        #[serde(rename = "loop")]
        ring: usize,
        /// The edge of the loop. An untrimmed surface has v = min, u = max, v = max, u = min.
        edge: usize,
        /// Where it starts, 0..=1.
        from: f64,
        /// Where it ends, 0..=1.
        to: f64,
    },
    /// A straight segment.
    Line((f64, f64, f64), (f64, f64, f64)),
    /// A polyline.
    Polyline(Vec<(f64, f64, f64)>),
    /// A free curve of the file, between two fractions of its arc length.
    Curve {
        /// Its number among the file's curves.
        id: usize,
        /// Where it starts, 0..=1.
        from: f64,
        /// Where it ends, 0..=1.
        to: f64,
    },
    /// A curve drawn across several surfaces: the polyline of the points, put onto the nearest surface.
    Drawn(Vec<(f64, f64, f64)>),
}

/// The fixed parameter of an iso-curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum IsoAt {
    /// u is fixed; the curve runs along v.
    U(f64),
    /// v is fixed; the curve runs along u.
    V(f64),
}
