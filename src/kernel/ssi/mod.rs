//! Surface-surface intersection that never loses a branch in silence.
//!
//! From thesis chapter 5 (surface-surface intersection on a hybrid bounding volume hierarchy). [`intersect`] takes two
//! sets of surfaces and returns an [`Intersection`] with its own evidence. See [`engine`] for the plan.

// Negated comparisons are on purpose here: they also catch NaN.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod bernstein;
mod binormal;
mod contact;
mod correct;
pub mod engine;
mod junction;
mod output;
mod piece;
mod region;
pub mod result;
mod side;
mod trace;
mod traverse;
mod tree;

pub use correct::{Condition, Corrected, PointPair, correct};
pub use engine::{SsiError, SsiOptions, intersect};
pub use piece::{Jet1, Jet2, Patch, Piece};
pub use result::Intersection;
pub use side::{Frame, Place, Side};
pub use trace::{Disc, End, Mode, TraceNode, TraceOptions, Tracer, hermite};
