//! The hybrid bounding volume hierarchy: rectangle-swept spheres with osculating tori at the leaves.

pub(crate) mod build;
mod closest;
pub(crate) mod fit;
mod hull;
pub(crate) mod net;
mod node;
pub(crate) mod osculate;
mod patch_tree;
mod rectangle;
mod slots;
mod statistics;
mod top;
mod toroidal;
mod torus;
mod traverse;
mod tree;
mod validate;
mod volumes;

pub use build::Instructions;
pub use closest::GlobalFoot;
pub use node::{Node, NormalCone};
pub use patch_tree::{Memory, PatchTree};
pub use rectangle::Rectangle;
pub use statistics::Summary;
pub use toroidal::ToroidalCover;
pub use torus::{LeafTorus, OsculatingTorus, WholeTorus};
pub use traverse::{Overlap, Pair, TraverseOptions, Verdict, early_exit, traverse};
pub use tree::{BvhError, BvhOptions, MAX_EXTENT, MAX_HEIGHT, MIN_EXTENT, NodeId, SurfaceTree};
pub use validate::{Broken, validate};
pub use volumes::{VolumeKind, VolumeTree};

#[cfg(test)]
mod tests;
