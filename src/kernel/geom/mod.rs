//! Curves and surfaces: B-splines of any degree, polynomial and rational.
//!
//! [`Curve`] and [`Surface`] are validated when they are made; every function after that is total.
//! Knot refinement, splitting, Bezier extraction and degree elevation are one mechanism, the blossom
//! ([`blossom`]).

mod aabb;
pub mod arc_length;
mod bezier;
pub mod blossom;
pub mod closest;
pub mod closest_curve;
mod curve;
mod differential;
mod knots;
#[cfg(test)]
mod precise;
mod surface;
pub mod sweep;

pub use aabb::Aabb;
pub use bezier::BezierPatch;
pub use curve::{Curve, CurveError};
pub use differential::{Curvature, FundamentalForms, unit_normal};
pub use knots::{Basis, KnotError, Knots, MAX_DEGREE, MAX_DERIVATIVE};
pub use surface::{Direction, Side, Surface, SurfaceError, SurfaceJet};
