//! The table of healed patches: what was measured, and whether it is within the checking tolerance.

use egui::{Grid, RichText, Ui, vec2};

use super::super::actions::Action;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::status::short;
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
        seam: Option<f64>,
        incomplete: bool,
        pass: bool,
    }
    let seams = editor.seam_gaps();
    let mut rows: Vec<Row> = document
        .patches()
        .map(|(id, patch)| {
            let r = &patch.report;
            let samples = (r.projected + r.artificial + r.kept).max(1);
            let seam = seams.iter().find(|(other, _)| *other == id).and_then(|(_, gap)| *gap);
            Row {
                id,
                name: document.get(id).map(|e| e.name.clone()).unwrap_or_default(),
                error: r.max_error,
                rms: r.rms,
                artificial: 100.0 * r.artificial as f64 / samples as f64,
                seam,
                incomplete: r.incomplete,
                pass: r.max_error <= checking && seam.is_none_or(|gap| gap <= checking) && !r.incomplete,
            }
        })
        .collect();
    rows.sort_by(|a, b| a.pass.cmp(&b.pass).then(b.error.total_cmp(&a.error)));
    let mut clicked = None;
    let mut adjust = false;
    Grid::new("patches").num_columns(6).striped(true).spacing(vec2(8.0, 5.0)).show(ui, |ui| {
        for (head, help) in [
            ("", "Whether the patch passes"),
            ("Patch", "Failing patches come first, the largest error first"),
            ("E max", "The largest distance to the originals; gaps left out"),
            ("RMS", "The root mean square of the distances"),
            ("Artif.", "Samples without an original, filled by interpolation"),
            ("Seam gap", "The largest distance to the patches next to it, along common boundaries"),
        ] {
            ui.label(RichText::new(head).color(t.text[1]).small()).on_hover_text(help);
        }
        ui.end_row();
        for row in &rows {
            let (icon, color) = if row.pass { (Icon::Tick, t.good) } else { (Icon::Cross, t.bad) };
            icons::label(ui, icon, color, 14.0).on_hover_text(match (row.pass, row.incomplete) {
                (true, _) => "Within the checking tolerance",
                (false, true) => "Incomplete: its heal was cancelled",
                (false, false) => "Outside the checking tolerance",
            });
            let selected = editor.selection.contains(row.id);
            let name = if row.incomplete { format!("{} (incomplete)", row.name) } else { row.name.clone() };
            let cell = ui.selectable_label(selected, name).on_hover_text("Double-click adjusts it");
            if cell.clicked() {
                clicked = Some(row.id);
            }
            if cell.double_clicked() {
                adjust = true;
            }
            let beyond = |ui: &mut Ui, value: f64, text: String| {
                ui.label(RichText::new(text).color(if value > checking { t.bad } else { t.text[0] }));
            };
            beyond(ui, row.error, short(row.error));
            beyond(ui, row.rms, short(row.rms));
            ui.label(format!("{:.0} %", row.artificial));
            match row.seam {
                Some(gap) => beyond(ui, gap, short(gap)),
                None => {
                    ui.weak("none").on_hover_text("No other patch runs along it");
                }
            }
            ui.end_row();
        }
    });
    if let Some(id) = clicked {
        editor.selection.set([id]);
    }
    ui.add_space(8.0);
    let failing = rows.iter().filter(|r| !r.pass).count();
    let (text, color) = match failing {
        0 if rows.len() == 1 => ("The patch passes".to_owned(), t.good),
        0 => (format!("All {} patches pass", rows.len()), t.good),
        1 if rows.len() == 1 => ("The patch fails".to_owned(), t.bad),
        n => (format!("{n} of {} patches fail", rows.len()), t.bad),
    };
    ui.label(RichText::new(text).color(color));
    if !unit.symbol().is_empty() {
        ui.weak(format!("Lengths in {}", unit.symbol()));
    }
    ui.add_space(4.0);
    ui.horizontal_wrapped(|ui| {
        let ctx = ui.ctx().clone();
        if adjust {
            editor.perform(&ctx, Action::AdjustPatch);
        }
        for action in [Action::AdjustPatch, Action::FrameSelection, Action::Isolate, Action::Delete] {
            let info = super::super::actions::info(action);
            let enabled = editor.enabled(action);
            if ui
                .add_enabled(enabled.is_ok(), egui::Button::new(info.name))
                .on_hover_text(info.help)
                .on_disabled_hover_text("Select a patch first")
                .clicked()
            {
                editor.perform(&ctx, action);
            }
        }
    });
}
