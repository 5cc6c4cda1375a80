//! What a viewport does, without a window: cameras, picking, snapping, the picking tool, colour maps. All of it
//! is plain data and is tested without a display.

pub mod camera;
pub mod colormap;
mod detail;
pub mod deviation;
pub mod display;
mod facet_shading;
pub mod feature_edges;
mod geometry;
pub mod histogram;
pub mod inspect;
pub mod intersection;
pub mod legend;
pub mod measure;
pub mod navigation;
pub mod patch_tool;
pub mod pick;
pub mod rounded_box;
pub mod scene;
pub mod section;
pub mod segment_tree;
pub mod snap;
pub mod uv;
pub mod uv_map;
pub mod viewport;
pub mod visibility;
pub mod worst;
