//! Small numerics that the geometry stands on.
