//! Tolerances, in one place. Every one is a length in model units, derived from the model's size, so that
//! nothing depends on a model being of size 1.
//!
//! Two are never confused: [`Tolerances::follow`] is how closely a curve follows the truth, [`Tolerances::gap`]
//! decides contact and coincidence. A gap of 1e-5 of the diagonal is a near miss, whatever `follow` says.

use super::geom::Aabb;

/// How closely curves follow, as a fraction of the bounding-box diagonal.
pub const FOLLOW: f64 = 1e-6;
/// What counts as contact, as a fraction of the bounding-box diagonal.
pub const GAP: f64 = 1e-11;
/// What two curve ends may be apart and still be joined, as a fraction of the bounding-box diagonal.
pub const JOINING: f64 = 1e-3;
/// Rounding of one evaluation, as a multiple of the largest absolute coordinate.
pub const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// The tolerances of one model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// How closely a curve follows the truth.
    pub follow: f64,
    /// What counts as contact; never below the rounding of an evaluation.
    pub gap: f64,
    /// What may be closed between two picked curve ends.
    pub joining: f64,
}

impl Tolerances {
    /// The defaults for a model with this bounding box. An empty or point-like box gives the tolerances of a
    /// model of size 1, so that none is ever zero.
    pub fn of(bounds: &Aabb) -> Self {
        let diagonal = if bounds.is_empty() { 0.0 } else { bounds.diagonal() };
        let diagonal = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
        let rounding = if bounds.is_empty() { 0.0 } else { ROUNDING * bounds.max_abs() };
        Self { follow: FOLLOW * diagonal, gap: (GAP * diagonal).max(rounding), joining: JOINING * diagonal }
    }
}
