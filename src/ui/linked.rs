//! One point of a surface, shown in the 3D view and in the uv view at once: hovering in either moves it in both.

use egui::{Stroke, Ui, vec2};
use glam::DVec2;

use super::editor::Editor;
use super::theme;
use super::viewport::{Pointer, hit_entity, tag};
use crate::model::document::EntityId;

/// Where the linked cursor was moved last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum From {
    /// In the 3D view.
    Space,
    /// In the uv view.
    Domain,
}

/// The linked cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linked {
    /// The surface or patch.
    pub entity: EntityId,
    /// Its parameters.
    pub uv: DVec2,
    /// Where the mouse is.
    pub from: From,
}

impl Editor {
    /// Follows the mouse in the 3D view. Where it is over neither view the cursor is nowhere.
    pub fn link_from_view(&mut self, pointer: &Pointer) {
        let hit = pointer.hover.as_ref().filter(|_| pointer.pixel.is_some());
        let found = hit.and_then(|hit| {
            let (entity, uv) = (hit_entity(hit)?, self.viewport.hit_uv(hit)?);
            Some(Linked { entity, uv, from: From::Space })
        });
        if found.is_some() || self.linked.is_some_and(|l| l.from == From::Space) {
            self.linked = found;
        }
    }

    /// Follows the mouse in the uv view.
    pub fn link_from_domain(&mut self, at: Option<(EntityId, DVec2)>) {
        match at {
            Some((entity, uv)) => self.linked = Some(Linked { entity, uv, from: From::Domain }),
            None if self.linked.is_some_and(|l| l.from == From::Domain) => self.linked = None,
            None => {}
        }
    }

    /// Marks the point in the 3D view that is under the cursor in the uv view; an open ring where a surface hides it.
    pub fn linked_mark(&self, ui: &Ui) {
        let Some(linked) = self.linked.filter(|l| l.from == From::Domain) else { return };
        let Some(surface) = self.document().get(linked.entity).and_then(|e| e.surface().cloned()) else { return };
        let point = surface.eval(surface.clamped(linked.uv));
        let Some(at) = self.viewport.project(point) else { return };
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.viewport.rect);
        let hidden = self.viewport.hides(point);
        painter.circle_stroke(at, 7.0, Stroke::new(3.5, t.label));
        painter.circle_stroke(at, 7.0, Stroke::new(1.5, t.accent));
        if !hidden {
            painter.circle(at, 2.5, t.accent, Stroke::new(1.0, t.label));
        }
        let text = format!("u {:.4}  v {:.4}{}", linked.uv.x, linked.uv.y, if hidden { " · behind" } else { "" });
        tag(&painter, t, self.viewport.rect, at + vec2(12.0, 10.0), &text, t.accent);
    }
}
