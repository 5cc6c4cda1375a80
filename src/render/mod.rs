//! The picture: wgpu and nothing else. This room knows no window and no toolkit; it draws plain data.
//!
//! - [`FrameData`] is one frame as plain data: a camera, display flags, and lists of meshes, lines and glyphs.
//! - [`Stage`] makes such a frame of a `view::scene::Scene`.
//! - [`Renderer`] is immutable and long-lived: shaders and pipelines.
//! - [`Viewport`] is one picture on screen: off-screen targets and GPU buffers that follow the data's revisions.
//! - [`Offscreen`] renders a [`FrameData`] to an [`image::RgbaImage`] without a window.
//!
//! Meshes and lines are kept on the GPU under their [`Key`]; buffers are rebuilt only when the revision changes.
//! Depth is reversed (1 at the near plane, 0 far away), colours are linear until the final blit, geometry is `f32`
//! relative to an `f64` origin, so that models far from the origin do not jitter.

mod cache;
mod color;
mod cull;
mod encode;
mod frame;
mod gpu;
mod inspect;
mod mesh_data;
mod offscreen;
mod renderer;
mod sketch;
mod stage;
mod target;
mod theme;
mod viewport;
mod volume;

pub use color::{Color, ColorScale, MAX_STEPS, PALETTE, mix, srgb, to_srgb8, with_alpha};
pub use encode::FrameStats;
pub use frame::{
    Background, CameraData, Dash, Display, Emphasis, Field, FrameData, Glyph, GlyphData, GlyphItem, GlyphShape, Hidden,
    Key, LineData, LineItem, LineRole, LineStyle, MeshItem, Section, VolumeData, VolumeForm, VolumeItem,
};
pub use gpu::{Gpu, GpuError};
pub use inspect::{BODIES, THIN};
pub use mesh_data::MeshData;
pub use offscreen::{Offscreen, OffscreenError};
pub use renderer::{Renderer, shader_sources};
pub use sketch::Sketch;
pub use stage::{Coloring, Look, Prepared, Stage};
pub use theme::Theme;
pub use viewport::Viewport;
