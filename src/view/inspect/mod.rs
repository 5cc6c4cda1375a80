//! Looking into the hierarchy of a surface: its levels as volumes, its leaf tori, what is under the cursor, and the
//! overlapping pairs with another hierarchy. Plain data, made by workers; the window and the command line draw it.
//!
//! - [`Hierarchy`] is a built tree with the numbers of its levels.
//! - [`Shown`] is one level dressed for drawing: a volume and a value for each node.
//! - [`tori`] are the used patches of the leaf tori as triangles.
//! - [`NodeCard`] is everything that is said of one node.

mod card;
mod cells;
mod hierarchy;
mod shown;
mod tori;

pub use card::{NodeCard, TorusCard, children};
pub use cells::cells;
pub use hierarchy::{Hierarchy, Overlaps};
pub use shown::{Coloring, MOST, Scale, Shown, VolumeForm};
pub use tori::{TorusMesh, leaf_tori, whole_torus};
