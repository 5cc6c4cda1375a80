//! Patchwright heals broken CAD surface models and shows where surfaces truly intersect.
//!
//! The crate is a house of layers; arrows point one way (`tests/layering.rs` holds them):
//!
//! ```text
//! kernel <- model <- io <- view <- {render, work} <- {cli, ui} <- main
//! ```
//!
//! [`kernel`] is geometry and algorithms in `f64`, with no files and no window. Everything above it turns
//! documents into kernel calls and results into pictures. The feature `editor` (on by default) brings the
//! window; without it the crate is the kernel, the file formats and the command line.

pub mod cli;
pub mod io;
pub mod kernel;
pub mod model;
#[cfg(feature = "editor")]
pub mod render;
#[cfg(feature = "editor")]
pub mod ui;
pub mod view;
pub mod work;
