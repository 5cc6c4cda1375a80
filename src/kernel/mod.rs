//! Geometry and algorithms: plain functions over plain data, `f64`, no files, no window.

pub mod bvh;
pub mod geom;
pub mod heal;
pub mod intersect;
pub mod job;
pub mod mesh;
pub mod mesh_ssi;
pub mod num;
pub mod self_ssi;
pub mod ssi;
pub mod tol;
