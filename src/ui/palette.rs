//! The command palette: type a few letters, get the command.

use egui::{Align2, Key, Modifiers, ScrollArea, TextEdit, vec2};

use super::actions::{self, Action};
use super::theme;

/// An open palette.
#[derive(Clone, Debug, Default)]
pub struct Palette {
    query: String,
    chosen: usize,
}

/// What came of showing it.
pub enum Answer {
    /// It stays open.
    Open,
    /// It closes and nothing happens.
    Dismissed,
    /// It closes and this happens.
    Chosen(Action),
}

impl Palette {
    /// Draws the palette. `enabled` says why an action cannot be done now.
    pub fn show(&mut self, ctx: &egui::Context, enabled: impl Fn(Action) -> Result<(), &'static str>) -> Answer {
        let mut answer = Answer::Open;
        let (up, down, enter, escape) = ctx.input_mut(|i| {
            (
                i.consume_key(Modifiers::NONE, Key::ArrowUp),
                i.consume_key(Modifiers::NONE, Key::ArrowDown),
                i.consume_key(Modifiers::NONE, Key::Enter),
                i.consume_key(Modifiers::NONE, Key::Escape),
            )
        });
        if escape {
            return Answer::Dismissed;
        }
        let found = actions::matching(&self.query);
        let last = found.len().saturating_sub(1);
        self.chosen = (self.chosen + usize::from(down)).min(last);
        self.chosen = self.chosen.saturating_sub(usize::from(up));
        let modal = egui::Modal::new(egui::Id::unique("command palette"))
            .area(
                egui::Modal::default_area(egui::Id::unique("command palette"))
                    .anchor(Align2::CENTER_TOP, vec2(0.0, 90.0)),
            )
            .frame(egui::Frame::popup(&ctx.global_style()).inner_margin(10.0))
            .show(ctx, |ui| {
                let t = theme::of(ui);
                ui.set_width(520.0);
                let edit = TextEdit::singleline(&mut self.query)
                    .hint_text("Type a command")
                    .desired_width(f32::INFINITY)
                    .margin(egui::Margin::symmetric(8, 6));
                let field = ui.add(edit).accessible_name("Command");
                if !field.has_focus() {
                    field.request_focus();
                }
                if field.changed() {
                    self.chosen = 0;
                }
                ui.add_space(4.0);
                ScrollArea::vertical().max_height(360.0).min_scrolled_height(120.0).show(ui, |ui| {
                    if found.is_empty() {
                        ui.add_space(6.0);
                        ui.weak("No command fits these letters");
                    }
                    for (at, info) in found.iter().enumerate() {
                        let why_not = enabled(info.action).err();
                        let shortcut = info.keys(ui.ctx());
                        let text =
                            egui::RichText::new(info.name).color(if why_not.is_some() { t.text[1] } else { t.text[0] });
                        let button = egui::Button::selectable(at == self.chosen, text)
                            .shortcut_text(shortcut)
                            .min_size(vec2(ui.available_width(), theme::ROW + 4.0));
                        let row = ui.add(button).on_hover_text(
                            why_not.map_or(info.help.to_owned(), |w| format!("{}. Not now: {w}", info.help)),
                        );
                        if at == self.chosen && (up || down) {
                            row.scroll_to_me(None);
                        }
                        if (row.clicked() || (enter && at == self.chosen)) && why_not.is_none() {
                            answer = Answer::Chosen(info.action);
                        }
                    }
                });
                ui.separator();
                let help = found.get(self.chosen).map_or("", |info| match enabled(info.action) {
                    Ok(()) => info.help,
                    Err(why) => why,
                });
                ui.horizontal(|ui| {
                    ui.set_min_height(18.0);
                    ui.small(help);
                });
            });
        if modal.should_close() && matches!(answer, Answer::Open) {
            answer = Answer::Dismissed;
        }
        answer
    }
}
