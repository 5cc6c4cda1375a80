//! The settings of an intersection and why none is computed.

use crate::kernel::geom::Aabb;
use crate::kernel::tol::Tolerances;

/// The settings of an intersection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SsiOptions {
    /// How closely curves follow, in model units. Default: 1e-6 of the diagonal of both sides together.
    pub tol: Option<f64>,
    /// The distance that counts as contact, in model units. Default: 1e-11 of the diagonal, never below rounding.
    pub gap_tol: Option<f64>,
    /// How far apart the borders of neighbouring patches of one side may be. Default: 1e-6 of the diagonal.
    pub joining: Option<f64>,
}

/// Why nothing was computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SsiError {
    /// A tolerance is zero, negative or not a number.
    #[error("{name} is {value}, but must be a positive length")]
    Tolerance {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A tolerance is larger than the model.
    #[error("{name} is {value}, larger than the model's diagonal of {diagonal}; choose a smaller one")]
    TooLarge {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The diagonal.
        diagonal: f64,
    },
    /// A side has no surface.
    #[error("side {side} has no surface")]
    Empty {
        /// `a` or `b`.
        side: char,
    },
}

/// The tolerances of an intersection, in model units.
pub(super) struct Lengths {
    pub tol: f64,
    pub gap: f64,
    pub joining: f64,
}

impl SsiOptions {
    /// What is asked for, or the defaults of a model of this size.
    pub(super) fn checked(&self, bounds: &Aabb) -> Result<Lengths, SsiError> {
        let defaults = Tolerances::of(bounds);
        let diagonal = bounds.diagonal();
        let checked = |name, value: Option<f64>, default: f64| match value {
            None => Ok(default),
            Some(value) if !(value > 0.0 && value.is_finite()) => Err(SsiError::Tolerance { name, value }),
            Some(value) if value > diagonal && diagonal > 0.0 => Err(SsiError::TooLarge { name, value, diagonal }),
            Some(value) => Ok(value),
        };
        Ok(Lengths {
            tol: checked("tol", self.tol, defaults.follow)?,
            gap: checked("gap_tol", self.gap_tol, defaults.gap)?,
            joining: checked("joining", self.joining, 1e-6 * diagonal.max(f64::MIN_POSITIVE))?,
        })
    }
}
