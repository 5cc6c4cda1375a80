//! The window: egui and nothing below it.

pub mod paint;
