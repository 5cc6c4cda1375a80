//! The list of changes; a click goes to the state after that change.

use egui::{Ui, vec2};

use super::super::editor::Editor;
use super::super::theme;

/// Draws the list.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let (labels, applied) = editor.history.steps();
    let labels: Vec<String> = std::iter::once("Opened".to_owned()).chain(labels.iter().cloned()).collect();
    let mut target = None;
    ui.spacing_mut().item_spacing.y = 1.0;
    for (step, label) in labels.iter().enumerate() {
        let t = theme::of(ui);
        let text = egui::RichText::new(label).color(if step <= applied { t.text[0] } else { t.text[1] });
        let button =
            egui::Button::selectable(step == applied, text).min_size(vec2(ui.available_width(), theme::ROW)).truncate();
        if ui.add(button).clicked() && step != applied {
            target = Some(step);
        }
    }
    if labels.len() == 1 {
        super::empty(ui, "No changes yet. Everything you do can be undone from here.");
    }
    if let Some(step) = target {
        editor.history.go_to(step);
        editor.selection.prune(editor.history.document());
        editor.say(format!("Went to: {}", labels[step]));
    }
}
