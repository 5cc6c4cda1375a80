//! The filter bar in the corner of the view: which kinds of things a click may pick. The active tool sets what is possible;
//! a user narrows it further.

use egui::{Area, Frame, Id, Order, Ui, vec2};

use super::super::editor::Editor;
use super::super::theme;
use super::Tool;
use crate::view::pick::Filter;

/// The kinds as the bar names them.
const KINDS: [(&str, &str); 4] = [
    ("Points", "Corners, ends, middles and knots of curves, to snap to (S)"),
    ("Curves", "Free curves, borders of surfaces, iso-lines where they are drawn"),
    ("Surfaces", "Surfaces of the model"),
    ("Patches", "Healed patches"),
];

/// Whether a filter allows a kind.
fn allows(filter: &Filter, kind: usize) -> bool {
    match kind {
        0 => filter.points,
        1 => filter.free_curves || filter.borders || filter.iso_lines,
        2 => filter.surfaces,
        _ => filter.patches,
    }
}

fn set(filter: &mut Filter, kind: usize, on: bool) {
    match kind {
        0 => filter.points = on,
        1 => (filter.free_curves, filter.borders, filter.iso_lines) = (on, on, on),
        2 => filter.surfaces = on,
        _ => filter.patches = on,
    }
}

impl Editor {
    /// Draws the bar.
    pub fn filter_bar(&mut self, ui: &Ui) {
        let (possible, snapping) = match &self.tool {
            Tool::Select => (Filter { points: false, ..Filter::ALL }, false),
            Tool::Inspect(_) => (Filter::SURFACES, false),
            Tool::Patch(session) => {
                let wants = session.tool.wants_point();
                (Filter { points: wants, ..session.tool.filter() }, wants && session.snaps.iter().any(|on| *on))
            }
            // A result is clicked itself, not the model under it.
            Tool::Intersect(session) if session.found.is_some() => (Filter::NONE, false),
            Tool::Intersect(_) => (Filter::SURFACES, false),
            Tool::Measure(_) => (super::measure::FILTER, false),
        };
        if possible == Filter::NONE || self.document().entities().is_empty() {
            return;
        }
        let mut toggled = None;
        let at = self.viewport.rect.left_top() + vec2(10.0, 10.0);
        Area::new(Id::unique("filter bar")).order(Order::Middle).fixed_pos(at).show(ui.ctx(), |ui| {
            let t = theme::of(ui);
            Frame::new().fill(t.label.gamma_multiply(0.9)).corner_radius(6.0).inner_margin(4.0).show(ui, |ui| {
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = 2.0;
                    ui.label(egui::RichText::new("Pick").color(t.text[1]).small());
                    for (kind, (name, help)) in KINDS.into_iter().enumerate() {
                        let can = allows(&possible, kind);
                        let on = can && if kind == 0 { snapping } else { allows(&self.pickable, kind) };
                        let chip = egui::Button::selectable(on, egui::RichText::new(name).small());
                        let chip = ui.add_enabled(can, chip).on_hover_text(help);
                        let chip = chip.on_disabled_hover_text(format!("{help}: not picked now"));
                        if chip.clicked() {
                            toggled = Some((kind, !on));
                        }
                    }
                });
            });
        });
        match (toggled, &mut self.tool) {
            (Some((0, on)), Tool::Patch(session)) => session.snaps = [on; 5],
            (Some((kind, on)), _) => set(&mut self.pickable, kind, on),
            (None, _) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_can_be_switched_off_and_on_alone() {
        let every = Filter { iso_lines: true, ..Filter::ALL };
        for kind in 0..KINDS.len() {
            let mut filter = every;
            set(&mut filter, kind, false);
            assert!((0..KINDS.len()).all(|k| allows(&filter, k) == (k != kind)));
            set(&mut filter, kind, true);
            assert_eq!(filter, every);
        }
    }
}
