//! Intersection of triangulations (HJR99 section 4, ALGORITHMS section 5).

pub mod perturbed;
