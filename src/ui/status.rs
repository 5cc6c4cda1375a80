//! The status line: left, what tool is on and what to do now; right, where the cursor is, unit, tolerance, jobs,
//! and whether the work is saved.

use std::time::Duration;

use egui::{Align, Layout, RichText, Sense, Ui, vec2};

use super::editor::{Editor, Page};
use super::icons::{self, Icon};
use super::theme;
use crate::work::{JobRecord, State};

/// How long a message stays.
const NOTE: Duration = Duration::from_secs(6);
/// How long a job runs before it shows.
const PATIENCE: Duration = Duration::from_millis(150);

/// Draws the status line.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    ui.horizontal_centered(|ui| {
        ui.spacing_mut().item_spacing.x = 10.0;
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            right(ui, editor);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| left(ui, editor));
        });
    });
}

fn left(ui: &mut Ui, editor: &mut Editor) {
    let t = theme::of(ui);
    if let Some(note) = &editor.note {
        let age = note.since.elapsed();
        let stay = if note.warning { NOTE * 2 } else { NOTE };
        if age < stay {
            ui.ctx().request_repaint_after(stay - age);
            if note.warning {
                icons::label(ui, Icon::Warning, t.warn, 15.0);
            }
            let color = if note.warning { t.warn } else { t.text[2] };
            ui.add(egui::Label::new(RichText::new(&note.text).color(color)).truncate());
            return;
        }
        editor.note = None;
    }
    let (tool, prompt, keys) = editor.prompt();
    ui.label(RichText::new(tool).color(t.accent).strong());
    ui.label(RichText::new(&prompt).color(t.text[2]));
    ui.add(egui::Label::new(RichText::new(keys).color(t.text[1])).truncate());
}

fn right(ui: &mut Ui, editor: &mut Editor) {
    let t = theme::of(ui);
    let saved = if editor.files.is_saving() {
        ("Saving…", t.text[1])
    } else if editor.document().entities().is_empty() {
        ("", t.text[1])
    } else if !editor.history.is_dirty() {
        ("Saved", t.text[1])
    } else if editor.is_autosaved() {
        ("Unsaved, autosaved", t.warn)
    } else {
        ("Unsaved", t.warn)
    };
    if !saved.0.is_empty() {
        ui.label(RichText::new(saved.0).color(saved.1));
        divider(ui);
    }
    let unit = match editor.document().unit.symbol() {
        "" => "no unit",
        symbol => symbol,
    };
    ui.label(RichText::new(unit).color(t.text[1])).on_hover_text("Unit of all lengths");
    divider(ui);
    if !editor.document().entities().is_empty() {
        let tolerance = editor.document().tolerances();
        let text = format!("tol {}", short(tolerance.follow));
        ui.label(RichText::new(text).color(t.text[1])).on_hover_text("How closely curves are followed, in model units");
        divider(ui);
    }
    for job in editor.jobs.active().iter().rev() {
        if job.elapsed() >= PATIENCE {
            chip(ui, editor, job);
        }
    }
    if let Some((at, uv)) = editor.viewport.cursor_at {
        let mut text = format!("{}  {}  {}", coordinate(at.x), coordinate(at.y), coordinate(at.z));
        if let Some(uv) = uv {
            text += &format!("   u {:.4}  v {:.4}", uv.x, uv.y);
        }
        ui.label(RichText::new(text).monospace().color(t.text[0]));
    }
}

fn divider(ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(vec2(1.0, 14.0), Sense::hover());
    ui.painter().rect_filled(rect, 0.0, theme::of(ui).border);
}

/// A running job: name, phase, progress, time and a way to stop it.
fn chip(ui: &mut Ui, editor: &mut Editor, job: &JobRecord) {
    let t = theme::of(ui);
    let stopping = job.job.is_cancelled();
    let cancel = ui
        .add_enabled_ui(!stopping, |ui| icons::button(ui, Icon::Close, &format!("Cancel {}", job.name), 20.0, false))
        .inner
        .on_hover_text("Cancel (Esc)");
    if cancel.clicked() {
        editor.jobs.cancel(job.id);
    }
    let done = job.job.done();
    let phase = if stopping { "Stopping".to_owned() } else { job.job.current_phase() };
    let phase = if phase.is_empty() { String::new() } else { format!(" · {phase}") };
    let percent = if done > 0.0 { format!(" · {:.0} %", 100.0 * done) } else { String::new() };
    let text = format!("{}{phase}{percent} · {:.1} s", job.name, job.elapsed().as_secs_f64());
    let galley = ui.painter().layout_no_wrap(text.clone(), egui::FontId::proportional(theme::SMALL), t.text[2]);
    let (rect, response) = ui.allocate_exact_size(vec2(galley.size().x + 16.0, 19.0), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &text));
    ui.painter().rect_filled(rect, 4.0, t.button[0]);
    let bar = egui::Rect::from_min_size(rect.min, vec2(rect.width() * done as f32, rect.height()));
    ui.painter().rect_filled(bar, 4.0, t.accent_fill);
    ui.painter().galley(rect.min + vec2(8.0, 0.5 * (rect.height() - galley.size().y)), galley, t.text[2]);
    if response.on_hover_text("Show jobs").clicked() {
        editor.show_page(Page::Jobs);
    }
    divider(ui);
}

/// The state of a job for people.
pub fn state_text(state: &State) -> &str {
    match state {
        State::Queued => "Waiting",
        State::Running => "Running",
        State::Done => "Done",
        State::Cancelled => "Cancelled",
        State::Panicked(_) => "Failed",
    }
}

/// A coordinate with a steady width.
fn coordinate(value: f64) -> String {
    if value.abs() >= 1e6 || (value != 0.0 && value.abs() < 1e-3) {
        format!("{value:>11.3e}")
    } else {
        format!("{value:>11.4}")
    }
}

/// A length in few characters: three digits, a power of ten only where needed.
pub fn short(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "-".to_owned()
    } else if size == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.2e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
        format!("{value:.digits$}")
    }
}

/// A length with its unit.
pub fn length(value: f64, unit: crate::model::document::Unit) -> String {
    match unit.symbol() {
        "" => short(value),
        symbol => format!("{} {symbol}", short(value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_short_and_keep_three_digits() {
        let shown: Vec<String> = [0.0, 1.0, 12.3456, 0.012345, 1234.5, 1e-7, 1.5e7, -2.0, f64::NAN].map(short).into();
        assert_eq!(shown, ["0", "1.00", "12.3", "0.0123", "1234", "1.00e-7", "1.50e7", "-2.00", "-"]);
    }
}
