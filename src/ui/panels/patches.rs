//! The table of healed patches: what was measured, and whether it is within the checking tolerance.

use egui::{Grid, RichText, Ui, vec2};

use super::super::actions::Action;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::status::{length, short};
use super::super::theme;
use crate::model::document::EntityId;

/// Draws the table, failing patches first.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let document = editor.document().clone();
    let t = theme::of(ui);
    let unit = document.unit;
    if document.patches().next().is_none() {
        super::empty(ui, "No patches yet. Start one with P: pick four sides around what is broken.");
        return;
    }
    let diagonal = document.bounds().diagonal();
    let checking = editor.checking_tolerance();
    ui.horizontal(|ui| {
        ui.label(RichText::new("Checking tolerance").color(t.text[1]));
        let mut value = checking;
        let speed = 0.01 * value.max(1e-12 * diagonal);
        let drag =
            egui::DragValue::new(&mut value).range(0.0..=diagonal).speed(speed).custom_formatter(|v, _| short(v));
        if ui
            .add(drag)
            .accessible_name("Checking tolerance")
            .on_hover_text("A patch passes when its largest error is within this")
            .changed()
        {
            editor.set_checking_tolerance(value);
        }
        ui.label(RichText::new(unit.symbol()).color(t.text[1]));
    });
    ui.add_space(6.0);
    struct Row {
        id: EntityId,
        name: String,
        error: f64,
        rms: f64,
        artificial: f64,
        pass: bool,
    }
    let mut rows: Vec<Row> = document
        .patches()
        .map(|(id, patch)| {
            let r = &patch.report;
            let samples = (r.projected + r.artificial).max(1);
            Row {
                id,
                name: document.get(id).map(|e| e.name.clone()).unwrap_or_default(),
                error: r.max_error,
                rms: r.rms,
                artificial: 100.0 * r.artificial as f64 / samples as f64,
                pass: r.max_error <= checking,
            }
        })
        .collect();
    rows.sort_by(|a, b| a.pass.cmp(&b.pass).then(b.error.total_cmp(&a.error)));
    let mut clicked = None;
    Grid::new("patches").num_columns(5).striped(true).spacing(vec2(10.0, 5.0)).show(ui, |ui| {
        for head in ["", "Patch", "E max", "RMS", "Artificial"] {
            ui.label(RichText::new(head).color(t.text[1]).small());
        }
        ui.end_row();
        for row in &rows {
            let (icon, color) = if row.pass { (Icon::Tick, t.good) } else { (Icon::Cross, t.bad) };
            icons::label(ui, icon, color, 14.0).on_hover_text(if row.pass {
                "Within the checking tolerance"
            } else {
                "Outside the checking tolerance"
            });
            let selected = editor.selection.contains(row.id);
            if ui.selectable_label(selected, &row.name).clicked() {
                clicked = Some(row.id);
            }
            ui.label(length(row.error, unit));
            ui.label(length(row.rms, unit));
            ui.label(format!("{:.0} %", row.artificial));
            ui.end_row();
        }
    });
    if let Some(id) = clicked {
        editor.selection.set([id]);
    }
    ui.add_space(8.0);
    let failing = rows.iter().filter(|r| !r.pass).count();
    let (text, color) = match failing {
        0 => (format!("All {} patches pass", rows.len()), t.good),
        n => (format!("{n} of {} patches fail", rows.len()), t.bad),
    };
    ui.label(RichText::new(text).color(color));
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let ctx = ui.ctx().clone();
        for action in [Action::FrameSelection, Action::Isolate, Action::Delete] {
            let info = super::super::actions::info(action);
            let enabled = editor.enabled(action);
            if ui
                .add_enabled(enabled.is_ok(), egui::Button::new(info.name))
                .on_disabled_hover_text("Select a patch first")
                .clicked()
            {
                editor.perform(&ctx, action);
            }
        }
    });
}
