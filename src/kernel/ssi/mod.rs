//! Surface-surface intersection that never loses a branch in silence.
//!
//! From thesis chapter 5 (surface-surface intersection on a hybrid bounding volume hierarchy). [`intersect`] takes two
//! sets of surfaces and returns an [`Intersection`] with its own evidence. See [`engine`] for the plan.

// Negated comparisons are on purpose here: they also catch NaN.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod bernstein;
pub mod biarc;
pub(crate) mod binormal;
mod boxes;
mod chords;
pub mod clip;
mod contact;
mod correct;
mod critical;
mod derivative_bounds;
pub mod engine;
mod gap_fit;
mod junction;
mod leave;
mod node;
mod open;
mod options;
mod output;
pub mod pairs;
mod piece;
mod pole_contact;
mod poles;
mod refined;
mod region;
mod repeated;
pub mod result;
mod seam;
mod side;
pub mod spline_fit;
mod split;
mod strand;
pub mod tangency;
pub mod three;
pub mod torus_binormal;
mod touching;
mod trace;
mod traverse;
mod tree;
pub mod triple;
mod triple_search;
mod undecided;

pub use biarc::{Biarcs, fit_biarcs};
pub use correct::{Condition, Corrected, PointPair, correct};
pub use node::{TraceNode, hermite};
pub use options::{SsiError, SsiOptions};
pub use pairs::{intersect, intersect_all};
pub use piece::{Jet1, Jet2, Patch, Piece};
pub use result::Intersection;
pub use side::{Frame, Place, Side};
pub use spline_fit::{FitError, SplineFit, fit_splines};
pub use tangency::{Tangency, TangencyPoint, osculating_torus, tangency};
pub use trace::{Disc, End, Mode, TraceOptions, Tracer};
