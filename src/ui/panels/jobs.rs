//! The list of computations: what runs, how far it is, and what came of those that ended.

use egui::{Align, Layout, ProgressBar, RichText, Ui};

use super::super::dialogs::Problem;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::status;
use super::super::theme;
use crate::work::State;

/// Draws the list, newest first.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let records = editor.jobs.records();
    if records.is_empty() {
        super::empty(ui, "Nothing has been computed yet");
    }
    for record in records.iter().rev() {
        let t = theme::of(ui);
        egui::Frame::new().fill(t.field).corner_radius(5.0).inner_margin(8.0).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal(|ui| {
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    if record.is_active() {
                        let name = format!("Cancel {}", record.name);
                        let stopping = record.job.is_cancelled();
                        if ui
                            .add_enabled_ui(!stopping, |ui| icons::button(ui, Icon::Close, &name, 20.0, false))
                            .inner
                            .clicked()
                        {
                            editor.jobs.cancel(record.id);
                        }
                    }
                    ui.label(
                        RichText::new(format!("{:.2} s", record.elapsed().as_secs_f64())).color(t.text[1]).small(),
                    );
                    ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                        ui.add(egui::Label::new(RichText::new(&record.name).color(t.text[2])).truncate());
                    });
                });
            });
            if record.is_active() {
                let done = record.job.done() as f32;
                let phase = record.job.current_phase();
                ui.add(ProgressBar::new(done).desired_height(6.0));
                let state = if record.job.is_cancelled() { "Stopping" } else { status::state_text(&record.state) };
                ui.small(if phase.is_empty() { state.to_owned() } else { format!("{state} · {phase}") });
            } else {
                let color = match record.state {
                    State::Panicked(_) => t.bad,
                    State::Cancelled => t.warn,
                    _ => t.text[1],
                };
                ui.label(RichText::new(status::state_text(&record.state)).color(color).small());
                for warning in record.job.warnings() {
                    ui.add(egui::Label::new(RichText::new(warning).color(t.warn).small()).wrap());
                }
                if !record.input.is_empty() {
                    let beginning: Vec<&str> = record.input.lines().take(16).collect();
                    let copy = ui.small_button("Copy input").on_hover_text(beginning.join("\n"));
                    if copy.clicked() {
                        ui.ctx().copy_text(record.input.clone());
                    }
                }
                if let State::Panicked(message) = &record.state
                    && ui.small_button("Show details").clicked()
                {
                    editor.problem(Problem {
                        what: format!("{} ran into a bug", record.name),
                        why: "The computation stopped; the model is unchanged.".to_owned(),
                        remedy: None,
                        details: format!("panic: {message}\ninput:\n{}", record.input),
                    });
                }
            }
        });
        ui.add_space(2.0);
    }
}
