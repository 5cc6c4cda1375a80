//! The tools: what a click in the view means, what the status line says, what the Tool page shows.

use egui::Ui;
use glam::DVec3;

use super::editor::Editor;
use super::hints::CurveHint;
use super::viewport::{Overlay, Pointer};
use crate::view::pick::Filter;

mod select;

/// The active tool.
pub enum Tool {
    /// Clicks select entities.
    Select,
}

impl Editor {
    /// The status line's left part: the tool, what to do now, and the keys.
    pub fn prompt(&self) -> (&'static str, String, String) {
        match &self.tool {
            Tool::Select => {
                let prompt = match self.selection.ids().len() {
                    _ if self.files.is_opening() => "Reading the file".to_owned(),
                    _ if self.document().entities().is_empty() => "Open a file, or drop one on the window".to_owned(),
                    0 => "Click an entity".to_owned(),
                    1 => self
                        .document()
                        .get(self.selection.ids()[0])
                        .map_or(String::new(), |e| format!("{} selected", e.name)),
                    n => format!("{n} entities selected"),
                };
                ("Select", prompt, "Shift add · F frame · H hide · Ctrl+K find command".to_owned())
            }
        }
    }

    /// Keys of the active tool.
    pub fn tool_keys(&mut self, ctx: &egui::Context) {
        let _ = ctx;
    }

    /// Esc: the tool first, then jobs, then the selection.
    pub fn escape(&mut self) {
        let active = self.jobs.active();
        match active.iter().rfind(|job| job.lane == crate::work::Lane::Heavy) {
            Some(job) => {
                self.jobs.cancel(job.id);
                self.say(format!("Stopping {}", job.name));
            }
            None => self.selection.clear(),
        }
    }

    /// Leaves the active tool.
    pub fn leave_tool(&mut self) {
        self.tool = Tool::Select;
    }

    /// Takes over what the tool's workers have made.
    pub fn poll_tool(&mut self, ctx: &egui::Context) {
        let _ = ctx;
    }

    /// The Tool page.
    pub fn tool_panel(&mut self, ui: &mut Ui) {
        match &self.tool {
            Tool::Select => self.select_panel(ui),
        }
    }

    /// What the active tool lets one pick, the points that it offers, and a number that changes with them.
    pub fn tool_filter(&self) -> (Filter, Vec<DVec3>, u64) {
        match &self.tool {
            Tool::Select => (Filter::ALL, Vec::new(), 0),
        }
    }

    /// What the active tool adds to the picture.
    pub fn tool_overlay(&mut self, dark: bool) -> Overlay {
        let _ = dark;
        Overlay::default()
    }

    /// What the mouse did, for the active tool.
    pub fn tool_pointer(&mut self, ui: &mut Ui, pointer: &Pointer) {
        let _ = ui;
        match &self.tool {
            Tool::Select => self.select_click(pointer),
        }
    }

    /// Draws the active tool's labels over the picture.
    pub fn tool_labels(&mut self, ui: &mut Ui, pointer: &Pointer) {
        let _ = (ui, pointer);
    }

    /// The curves that the active tool lets one pick, for scripts.
    pub fn curve_hints(&self, scale: f32) -> Vec<CurveHint> {
        let _ = scale;
        Vec::new()
    }
}
