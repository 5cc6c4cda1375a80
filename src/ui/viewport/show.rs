//! The view in the window: layout, what the mouse does, the picture, and what is drawn over it.

use std::sync::Arc;

use egui::{Align2, FontId, Sense, Ui, vec2};

use super::super::actions::{self, Action};
use super::super::editor::Editor;
use super::super::{paint, theme};
use super::{Pointer, gizmo, hit_entity};
use crate::model::document::Entity;
use crate::view::display::CurveRef;
use crate::view::pick::{PickHit, Target};

impl Editor {
    /// Draws the view into all the room that is left.
    pub fn show_viewport(&mut self, ui: &mut Ui) {
        let (rect, response) =
            ui.allocate_exact_size(ui.available_size().max(vec2(64.0, 64.0)), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "3D view"));
        self.viewport.rect = rect;
        let now = ui.input(|i| i.time);
        let revision = self.history.revision();
        if self.viewport.advance(self.history.document(), revision, &mut self.jobs, now) {
            ui.ctx().request_repaint();
        }
        let (filter, points, stamp) = self.tool_filter();
        let blocked = self.dialog.is_some() || self.palette.is_some();
        let pointer = match blocked {
            true => Pointer::default(),
            false => self.viewport.pointer(ui, &response, self.settings.navigation, filter, &points, stamp),
        };
        self.link_from_view(&pointer);
        if !self.viewport.drag_section(&pointer) {
            self.tool_pointer(&pointer);
        }
        let dark = ui.visuals().dark_mode;
        let t = theme::tokens(dark);
        let overlay = self.tool_overlay(dark);
        let scale = ui.ctx().pixels_per_point();
        let frame = self.viewport.frame_data(scale, dark, &self.selection, &overlay);
        if self.viewport.has_gpu {
            ui.painter().add(paint::callback(rect, Arc::clone(&frame)));
        } else {
            ui.painter().rect_filled(rect, 0.0, t.field);
            let text = "No graphics adapter was found; the 3D view cannot be drawn";
            ui.painter().text(rect.center(), Align2::CENTER_CENTER, text, FontId::proportional(15.0), t.text[1]);
        }
        let mut over = ui.new_child(egui::UiBuilder::new().max_rect(rect).id_salt("over the view"));
        let ui = &mut over;
        ui.set_clip_rect(rect.intersect(ui.clip_rect()));
        self.empty_hint(ui);
        self.viewport.section_handle(ui, pointer.pixel);
        self.viewport.anchor_mark(ui);
        self.tool_labels(ui, &pointer);
        self.defect_marks(ui);
        self.linked_mark(ui);
        self.name_tag(ui, &pointer);
        self.viewport.triad(ui);
        self.context_menu(&response);
    }

    /// What stands in the middle while there is nothing to see.
    fn empty_hint(&mut self, ui: &mut Ui) {
        if !self.document().entities().is_empty() || self.files.is_opening() {
            return;
        }
        let t = theme::of(ui);
        let center = ui.max_rect().center();
        let title = "Open a model to begin";
        ui.painter().text(
            center - vec2(0.0, 14.0),
            Align2::CENTER_CENTER,
            title,
            FontId::proportional(20.0),
            t.text[0],
        );
        let help = "Ctrl+O opens a file · drop one here · File has examples";
        ui.painter().text(
            center + vec2(0.0, 14.0),
            Align2::CENTER_CENTER,
            help,
            FontId::proportional(theme::TEXT),
            t.text[1],
        );
    }

    /// The name of what is under the cursor.
    fn name_tag(&self, ui: &Ui, pointer: &Pointer) {
        let (Some(hit), Some(pixel)) = (&pointer.hover, pointer.pixel) else { return };
        if pointer.drag.is_some() || self.viewport.on_section_handle(pixel) {
            return;
        }
        let Some(text) = self.hit_name(hit) else { return };
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.viewport.rect);
        let at = self.viewport.to_window(pixel) + vec2(16.0, 14.0);
        gizmo::tag(&painter, t, self.viewport.rect, at, &text, t.accent);
    }

    /// What something under the cursor is called.
    pub fn hit_name(&self, hit: &PickHit) -> Option<String> {
        let name = |id| self.document().get(id).map(|e| e.name.clone());
        match &hit.target {
            Target::Surface { entity, .. } => name(*entity),
            Target::Curve { curve: CurveRef::Free(id), .. } => name(*id),
            Target::Curve { curve, .. } => {
                let entity = self.document().get(curve.entity())?;
                Some(format!("{} · {}", entity.name, curve_name(entity, curve)))
            }
            Target::Point(_) => None,
        }
    }

    fn context_menu(&mut self, response: &egui::Response) {
        let hovered = self.viewport.hover_hit().as_ref().and_then(hit_entity);
        response.context_menu(|ui| {
            if self.selection.is_empty()
                && let Some(id) = hovered
            {
                self.selection.set([id]);
            }
            let list = [
                Action::FrameSelection,
                Action::FrameAll,
                Action::Hide,
                Action::Isolate,
                Action::ShowAll,
                Action::Deselect,
            ];
            for action in list {
                let info = actions::info(action);
                let shortcut = info.keys(ui.ctx());
                let button = egui::Button::new(info.name).shortcut_text(shortcut);
                if ui.add_enabled(self.enabled(action).is_ok(), button).clicked() {
                    ui.close();
                    let ctx = ui.ctx().clone();
                    self.perform(&ctx, action);
                }
            }
        });
    }
}

/// What a curve of an entity is called.
pub fn curve_name(entity: &Entity, curve: &CurveRef) -> String {
    use crate::kernel::geom::{Direction, Side};
    match curve {
        CurveRef::Free(_) => "curve".to_owned(),
        CurveRef::Chain(_, k) | CurveRef::GridLine(_, k) => {
            let chain = entity.facets().and_then(|f| f.curves().get(*k as usize));
            chain.map_or_else(|| format!("curve {k}"), |c| c.name.clone())
        }
        CurveRef::Edge(_, 0, edge) => format!("edge {edge}"),
        CurveRef::Edge(_, ring, edge) => format!("hole {ring} edge {edge}"),
        CurveRef::Border(_, Side::UMin) => "border u min".to_owned(),
        CurveRef::Border(_, Side::UMax) => "border u max".to_owned(),
        CurveRef::Border(_, Side::VMin) => "border v min".to_owned(),
        CurveRef::Border(_, Side::VMax) => "border v max".to_owned(),
        CurveRef::Iso(_, Direction::U, c) => format!("iso u {}", super::super::status::short(*c)),
        CurveRef::Iso(_, Direction::V, c) => format!("iso v {}", super::super::status::short(*c)),
    }
}
