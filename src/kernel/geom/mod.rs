//! Curves and surfaces: B-splines of any degree, polynomial and rational.
//!
//! [`Curve`] and [`Surface`] are validated when they are made; every function after that is total.
//! Knot refinement, splitting, Bezier extraction and degree elevation are one mechanism, the blossom
//! ([`blossom`]).

mod aabb;
pub mod analytic;
pub mod arc_length;
mod bezier;
pub mod blossom;
pub mod chain;
pub mod chart;
pub mod closest;
pub mod closest_curve;
mod curve;
mod differential;
pub mod fitted;
mod knots;
pub mod pcurve;
#[cfg(test)]
mod precise;
pub mod ring;
mod surface;
pub mod sweep;
pub mod trim;

pub use aabb::Aabb;
pub use bezier::BezierPatch;
pub use curve::{Curve, CurveError};
pub use differential::{Curvature, FundamentalForms, unit_normal};
pub use knots::{Basis, KnotError, Knots, MAX_DEGREE, MAX_DERIVATIVE};
pub use surface::{Direction, Side, Surface, SurfaceError, SurfaceJet};
