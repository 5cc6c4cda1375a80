//! Selecting: clicks in the view choose entities.

use egui::{RichText, Ui};

use super::super::actions::{self, Action};
use super::super::editor::Editor;
use super::super::viewport::{Pointer, hit_entity};
use super::super::{panels, theme};

impl Editor {
    /// What a click means while nothing else is on: it selects; Shift or Ctrl adds or takes away; the empty background
    /// selects nothing.
    pub fn select_click(&mut self, pointer: &Pointer) {
        let Some((hit, held)) = &pointer.click else { return };
        match hit.as_ref().and_then(hit_entity) {
            Some(id) if held.shift || held.ctrl => self.selection.toggle(id),
            Some(id) => self.selection.set([id]),
            None if held.shift || held.ctrl => {}
            None => self.selection.clear(),
        }
    }

    /// The Tool page while nothing else is on: what can be done next.
    pub fn select_panel(&mut self, ui: &mut Ui) {
        let t = theme::of(ui);
        panels::heading(ui, "Select");
        let text = match self.selection.ids().len() {
            _ if self.document().entities().is_empty() => "Nothing is open yet.",
            0 => "Click an entity to select it. Shift adds, a second click at the same place reaches what lies behind.",
            1 => "One entity is selected. Its properties are on the left.",
            _ => "Several entities are selected.",
        };
        ui.add(egui::Label::new(RichText::new(text).color(t.text[1])).wrap());
        ui.add_space(10.0);
        panels::heading(ui, "Next");
        let next = match (self.document().entities().is_empty(), self.selection.is_empty()) {
            (true, _) => &[Action::Open, Action::OpenExample][..],
            (_, true) => {
                &[Action::PatchTool, Action::IntersectTool, Action::MeasureTool, Action::Section, Action::FrameAll]
            }
            (_, false) => &[
                Action::PatchTool,
                Action::IntersectTool,
                Action::SelfIntersectTool,
                Action::FrameSelection,
                Action::Isolate,
                Action::Hide,
                Action::Deselect,
            ],
        };
        for &action in next {
            let info = actions::info(action);
            let shortcut = info.keys(ui.ctx());
            let button =
                egui::Button::new(info.name).shortcut_text(shortcut).min_size(egui::vec2(ui.available_width(), 28.0));
            let enabled = self.enabled(action);
            let response = ui.add_enabled(enabled.is_ok(), button).on_hover_text(info.help);
            if response.clicked() {
                let ctx = ui.ctx().clone();
                self.perform(&ctx, action);
            }
        }
    }
}
