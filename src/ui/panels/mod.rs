//! The panels left and right of the view.

use egui::{Frame, Margin, Panel, RichText, ScrollArea, Ui, vec2};

use super::editor::{Editor, Page};
use super::theme;

pub mod defects;
mod history;
mod jobs;
mod outliner;
mod patches;
mod properties;
mod report;
pub mod uv;

/// The left panel: outliner above, properties below.
pub fn left(ui: &mut Ui, editor: &mut Editor) {
    let frame = Frame::new().inner_margin(Margin::symmetric(10, 8));
    Panel::bottom("properties").frame(frame).resizable(true).default_size(250.0).size_range(120.0..=500.0).show(
        ui,
        |ui| {
            heading(ui, "Properties");
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| properties::show(ui, editor));
        },
    );
    frame.show(ui, |ui| outliner::show(ui, editor));
}

/// The right panel: one page of several.
pub fn right(ui: &mut Ui, editor: &mut Editor) {
    tabs(ui, editor);
    Frame::new().inner_margin(Margin::symmetric(12, 10)).show(ui, |ui| {
        ScrollArea::vertical().id_salt(editor.page as usize).auto_shrink(false).show(ui, |ui| match editor.page {
            Page::Tool => editor.tool_panel(ui),
            Page::Patches => patches::show(ui, editor),
            Page::Defects => defects::show(ui, editor),
            Page::History => history::show(ui, editor),
            Page::Jobs => jobs::show(ui, editor),
            Page::Report => report::show(ui, editor),
        });
    });
}

fn tabs(ui: &mut Ui, editor: &mut Editor) {
    let t = theme::of(ui);
    Frame::new().inner_margin(Margin { left: 8, right: 8, top: 4, bottom: 0 }).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            for (page, title) in Page::ALL {
                let on = editor.page == page;
                let color = if on { t.text[2] } else { t.text[1] };
                let galley =
                    ui.painter().layout_no_wrap(title.to_owned(), egui::FontId::proportional(theme::TEXT), color);
                let (rect, response) = ui.allocate_exact_size(vec2(galley.size().x + 18.0, 28.0), egui::Sense::click());
                response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Tab, true, on, title));
                let color = if response.hovered() { t.text[2] } else { color };
                let at = rect.center() - 0.5 * galley.size();
                ui.painter().galley_with_override_text_color(at, galley, color);
                if on {
                    let line = egui::Rect::from_min_max(
                        egui::pos2(rect.left() + 6.0, rect.bottom() - 2.0),
                        rect.right_bottom() - vec2(6.0, 0.0),
                    );
                    ui.painter().rect_filled(line, 1.0, t.accent);
                }
                if response.clicked() {
                    editor.page = page;
                }
            }
        });
    });
    let y = ui.cursor().top();
    ui.painter().hline(ui.max_rect().x_range(), y, egui::Stroke::new(1.0, t.border));
    ui.add_space(1.0);
}

/// A title of a part of a panel.
pub fn heading(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).color(theme::of(ui).text[2]).strong());
    ui.add_space(2.0);
}

/// A quiet line that says why there is nothing to see.
pub fn empty(ui: &mut Ui, text: &str) {
    ui.add_space(4.0);
    ui.add(egui::Label::new(RichText::new(text).color(theme::of(ui).text[1])).wrap());
}

/// A row of a table of properties; the name is quiet, the value can be selected and copied.
pub fn property(ui: &mut Ui, name: &str, value: impl Into<String>) {
    let t = theme::of(ui);
    ui.label(RichText::new(name).color(t.text[1]));
    ui.add(egui::Label::new(RichText::new(value.into()).color(t.text[0])).wrap().selectable(true));
    ui.end_row();
}
