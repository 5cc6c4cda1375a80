//! What a heal says about itself.

use serde::{Deserialize, Serialize};

/// What becomes of a picked boundary curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BoundaryMode {
    /// It stays as picked.
    #[default]
    Keep,
    /// It is projected like the interior.
    Project,
}

/// What was measured of a healed patch (lengths in model units).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PatchReport {
    /// The largest distance to the originals at the check points, and to kept boundary curves; gaps left out.
    pub max_error: f64,
    /// The root mean square of those distances.
    pub rms: f64,
    /// The numbers of spans M, N.
    pub resolution: [usize; 2],
    /// How many resolutions were tried.
    pub iterations: usize,
    /// Samples with a projection on the originals.
    pub projected: usize,
    /// Of these, samples that had several and took the nearest.
    pub several: usize,
    /// Samples in gaps, filled by Hardy's method.
    pub artificial: usize,
    /// Boundary samples that stay on a picked curve away from the originals.
    #[serde(default)]
    pub kept: usize,
    /// Check points that were measured.
    #[serde(default)]
    pub checked: usize,
    /// Check points left out because they lie over a gap or beside a boundary away from the originals.
    #[serde(default)]
    pub skipped: usize,
    /// Resolution and error of each iteration.
    pub history: Vec<HealStep>,
    /// Whether the wanted error was reached.
    pub reached: bool,
    /// Whether the heal was cancelled: the patch is that of the last resolution that was finished.
    #[serde(default)]
    pub incomplete: bool,
}

/// One iteration of the refinement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HealStep {
    /// The numbers of spans M, N.
    pub resolution: [usize; 2],
    /// The largest error at them.
    pub max_error: f64,
}
