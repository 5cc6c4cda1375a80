//! The editor's window, made with egui. Everything a user can do is in [`actions`]; what each action does is in
//! [`editor`]; the rest draws. Nothing here computes: that happens in workers and in the layers below.

mod actions;
mod app;
mod autosave;
mod bars;
mod dialogs;
mod editor;
mod export;
mod files;
mod hints;
mod icons;
mod linked;
mod numpad;
pub mod paint;
mod palette;
mod panels;
mod settings;
mod startup;
mod status;
mod theme;
mod tools;
mod viewport;

pub use actions::Action;
pub use app::{App, Options, run};
pub use editor::Page;
pub use numpad::Numpad;
pub use tools::Tool;
