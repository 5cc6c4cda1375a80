//! Triangle meshes: tessellation of surfaces, and a tree over triangles for rays, segments and closest points.

pub mod tessellate;
pub mod tri_pairs;
pub mod tri_tree;
