//! The list of entities, with what is shown and what is selected.

use egui::{Key, ScrollArea, TextEdit, Ui, vec2};

use super::super::actions::Action;
use super::super::editor::Editor;
use super::super::icons::Icon;
use super::super::theme;
use crate::model::command::Command;
use crate::model::document::{Entity, EntityId, Shape};

/// Draws the list.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let t = theme::of(ui);
    ui.horizontal(|ui| {
        let count = editor.document().entities().len();
        super::heading(ui, "Model");
        ui.label(egui::RichText::new(format!("{count}")).color(t.text[1]));
    });
    let edit = TextEdit::singleline(&mut editor.filter)
        .hint_text("Search")
        .margin(egui::Margin::symmetric(7, 3))
        .desired_width(f32::INFINITY);
    let field = ui.add(edit).accessible_name("Search entities");
    if field.has_focus() && ui.input(|i| i.key_pressed(Key::Escape)) {
        editor.filter.clear();
    }
    ui.add_space(2.0);
    let document = editor.document().clone();
    let filter = editor.filter.to_lowercase();
    let shown: Vec<&std::sync::Arc<Entity>> =
        document.entities().iter().filter(|e| filter.is_empty() || e.name.to_lowercase().contains(&filter)).collect();
    if document.entities().is_empty() {
        super::empty(ui, "Nothing is open. Open a file with Ctrl+O or drop one on the window.");
        return;
    }
    if shown.is_empty() {
        super::empty(ui, "No entity has this in its name");
        return;
    }
    let mut command = None;
    ui.spacing_mut().item_spacing.y = 0.0;
    ScrollArea::vertical().auto_shrink(false).show_rows(ui, theme::ROW, shown.len(), |ui, range| {
        for entity in &shown[range] {
            if let Some(c) = row(ui, editor, entity, &shown) {
                command = Some(c);
            }
        }
    });
    if let Some(command) = command {
        editor.command(&command);
    }
}

fn row(ui: &mut Ui, editor: &mut Editor, entity: &Entity, shown: &[&std::sync::Arc<Entity>]) -> Option<Command> {
    let t = theme::of(ui);
    let id = entity.id;
    let selected = editor.selection.contains(id);
    let hovered_in_view = editor.viewport.hovered_entity() == Some(id);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), theme::ROW), egui::Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::ListItem, true, selected, &entity.name));
    let fill = if selected {
        t.accent_fill
    } else if response.hovered() || hovered_in_view {
        t.button[0]
    } else {
        egui::Color32::TRANSPARENT
    };
    ui.painter().rect_filled(rect, 3.0, fill);
    let color = if entity.visible { t.text[0] } else { t.text[1] };
    let icon = match entity.shape {
        Shape::Surface(_) | Shape::Face(_) => Icon::Surface,
        Shape::Curve(_) => Icon::Curve,
        Shape::Patch(_) => Icon::Patch,
        Shape::Mesh(_) => Icon::Mesh,
        Shape::Block(_) => Icon::Block,
    };
    let square = |x: f32| egui::Rect::from_min_size(egui::pos2(x, rect.top() + 4.0), vec2(14.0, 14.0));
    let icon_color = if matches!(entity.shape, Shape::Patch(_)) { t.accent } else { t.text[1] };
    icon.paint(ui.painter(), square(rect.left() + 4.0), icon_color);
    let text_width = rect.width() - 24.0 - 28.0;
    let mut job =
        egui::text::LayoutJob::simple_singleline(entity.name.clone(), egui::FontId::proportional(theme::TEXT), color);
    job.wrap = egui::text::TextWrapping::truncate_at_width(text_width);
    let galley = ui.painter().layout_job(job);
    let y = rect.center().y - 0.5 * galley.size().y;
    ui.painter().galley(egui::pos2(rect.left() + 24.0, y), galley, color);

    let mut command = None;
    let eye = egui::Rect::from_min_size(egui::pos2(rect.right() - 24.0, rect.top()), vec2(22.0, theme::ROW));
    let name = if entity.visible { format!("Hide {}", entity.name) } else { format!("Show {}", entity.name) };
    let eye_response = ui.interact(eye, response.id.with("eye"), egui::Sense::click());
    eye_response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
    let eye_color = if eye_response.hovered() { t.text[2] } else { t.text[1] };
    let eye_icon = if entity.visible { Icon::Eye } else { Icon::EyeOff };
    if !entity.visible || response.hovered() || eye_response.hovered() || selected {
        eye_icon.paint(ui.painter(), egui::Rect::from_center_size(eye.center(), vec2(14.0, 14.0)), eye_color);
    }
    if eye_response.on_hover_text(&name).clicked() {
        command = Some(Command::SetVisible { ids: vec![id], visible: !entity.visible });
    } else if response.clicked() {
        choose(ui, editor, id, shown);
    }
    if response.double_clicked() {
        let ctx = ui.ctx().clone();
        editor.selection.set([id]);
        editor.perform(&ctx, Action::FrameSelection);
    }
    if response.hovered() {
        editor.viewport.hover_from_list(id);
    }
    response.context_menu(|ui| {
        if !editor.selection.contains(id) {
            editor.selection.set([id]);
        }
        for action in
            [Action::FrameSelection, Action::Hide, Action::Isolate, Action::ShowAll, Action::Rename, Action::Delete]
        {
            let info = super::super::actions::info(action);
            if ui.add_enabled(editor.enabled(action).is_ok(), egui::Button::new(info.name)).clicked() {
                ui.close();
                let ctx = ui.ctx().clone();
                editor.perform(&ctx, action);
            }
        }
    });
    command
}

/// A click selects, Ctrl adds or takes away, Shift selects the rows from the last one to this one.
fn choose(ui: &Ui, editor: &mut Editor, id: EntityId, shown: &[&std::sync::Arc<Entity>]) {
    let held = ui.input(|i| i.modifiers);
    // A tool that waits for surfaces takes them from here as from the view.
    if editor.intersect_pick(id, held.shift || held.command) {
        return;
    }
    let place = |id: EntityId| shown.iter().position(|e| e.id == id);
    let last = editor.selection.ids().last().copied();
    match (held.shift, last.and_then(place), place(id)) {
        (true, Some(a), Some(b)) => {
            let rows = if a <= b { a..=b } else { b..=a };
            let mut ids: Vec<EntityId> = shown[rows].iter().map(|e| e.id).collect();
            // The row where the range began stays last, so that the next range begins there too.
            ids.retain(|&other| Some(other) != last);
            ids.extend(last);
            editor.selection.set(ids);
        }
        _ if held.command || held.shift => editor.selection.toggle(id),
        _ => editor.selection.set([id]),
    }
}
