//! Triangle meshes: tessellation of surfaces, a tree over triangles for rays, segments and closest points, and
//! global projection onto sets of surfaces, which starts from it.

pub mod area;
pub mod body;
pub mod edge_net;
pub mod face_mesh;
pub mod facets;
pub mod grid;
pub mod soup;
pub mod structured;
pub mod surface_set;
pub mod tessellate;
pub mod tri_mesh;
pub mod tri_pairs;
pub mod tri_tree;
pub mod weld;
