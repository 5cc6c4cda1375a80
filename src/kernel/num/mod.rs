//! Small numerics that the geometry stands on.

pub mod lanes;
pub mod linear;
pub mod round;
