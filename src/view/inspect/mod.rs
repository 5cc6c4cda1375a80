//! Looking into the hierarchy of a surface: its levels as volumes, its leaf tori, what is under the cursor, and the
//! overlapping pairs with another hierarchy. Plain data, made by workers; the window and the command line draw it.
//!
//! - [`Hierarchy`] is a built tree with the numbers of its levels.
//! - [`Shown`] is one level dressed for drawing: a volume and a value for each node.
//! - [`tori`] are the used patches of the leaf tori as triangles.
//! - [`NodeCard`] is everything that is said of one node.
//! - [`Searched`] is a surface searched for self-intersections with the record of the search, [`LevelMesh`] one level of
//!   its ternary tree.

mod card;
mod cells;
mod hierarchy;
mod search;
mod search_cells;
mod search_windows;
mod shown;
mod tori;

pub use card::{NodeCard, TorusCard, children};
pub use cells::cells;
pub use hierarchy::{Hierarchy, Overlaps};
pub use search::{LevelCount, SETTLED, STATES, Searched, corners, role_name, state_color, state_name};
pub use search_cells::{LevelMesh, SETTLED_AT};
pub use search_windows::WindowArea;
pub use shown::{Coloring, MOST, Scale, Shown, VolumeForm};
pub use tori::{TorusMesh, leaf_tori, whole_torus};
