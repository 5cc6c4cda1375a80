//! The import report: what the file held and what became of it.

use egui::{Grid, RichText, Ui, vec2};

use super::super::editor::Editor;
use super::super::theme;
use crate::io::Severity;

/// Draws the report of the file read last.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let Some(report) = &editor.files.report else {
        super::empty(ui, "No file has been opened yet");
        return;
    };
    let t = theme::of(ui);
    if let Some(source) = &editor.files.source {
        ui.add(egui::Label::new(RichText::new(source.display().to_string()).color(t.text[1])).wrap().selectable(true));
        ui.add_space(4.0);
    }
    Grid::new("report totals").num_columns(2).spacing(vec2(14.0, 4.0)).show(ui, |ui| {
        super::property(ui, "Surfaces read", report.surfaces.to_string());
        super::property(ui, "Curves read", report.curves.to_string());
        if report.meshes > 0 {
            super::property(ui, "Meshes and blocks read", report.meshes.to_string());
        }
        super::property(ui, "Skipped", report.count(Severity::Skipped).to_string());
        super::property(ui, "Warnings", report.count(Severity::Warning).to_string());
    });
    ui.add_space(8.0);
    super::heading(ui, "In the file");
    Grid::new("report found").num_columns(2).spacing(vec2(14.0, 3.0)).striped(true).show(ui, |ui| {
        for (kind, count) in &report.found {
            super::property(ui, kind, count.to_string());
        }
    });
    ui.add_space(8.0);
    super::heading(ui, "Worth knowing");
    let groups = report.grouped();
    if groups.is_empty() {
        super::empty(ui, "Everything was read as it stands");
    }
    for (severity, entity, reason, count) in groups {
        let color = match severity {
            Severity::Skipped => t.bad,
            Severity::Warning => t.warn,
            Severity::Info => t.text[1],
        };
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(severity.name()).color(color).strong());
            ui.label(if count == 1 { entity.to_owned() } else { format!("{count} x {entity}") });
        });
        ui.add(egui::Label::new(RichText::new(reason).color(t.text[1])).wrap());
        ui.add_space(4.0);
    }
    if ui.button("Copy report").clicked() {
        let lines: Vec<String> = report.lines.iter().map(ToString::to_string).collect();
        ui.ctx().copy_text(lines.join("\n"));
    }
}
