//! Surface-surface intersection that never loses a branch in silence.

mod correct;
mod piece;
pub mod result;

pub use correct::{Condition, Corrected, PointPair, correct};
pub use piece::{Jet1, Jet2, Patch, Piece};
