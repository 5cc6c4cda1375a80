//! What a viewport does, without a window: cameras, picking, snapping, the picking tool, colour maps. All of it
//! is plain data and is tested without a display.

pub mod camera;
pub mod navigation;
pub mod viewport;
