//! What is drawn over the picture: the axis triad, the handle of the section plane, name tags.

use egui::{Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};
use glam::{DVec2, DVec3};

use super::Viewport;
use crate::ui::theme::{self, Tokens};
use crate::view::camera::{Axis, Projection};

/// The triad's place from the lower left corner, and its arm.
const TRIAD: (f32, f32) = (52.0, 34.0);
/// How near the cursor must be to the handle of the section plane.
const GRAB: f64 = 14.0;

/// A label in the view: text on a solid ground, kept inside `within`.
pub fn tag(painter: &Painter, t: &Tokens, within: Rect, at: Pos2, text: &str, color: Color32) -> Rect {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(theme::SMALL), t.text[2]);
    let size = galley.size() + vec2(14.0, 6.0);
    let within = within.shrink(4.0);
    let x = at.x.min(within.right() - size.x).max(within.left());
    let y = at.y.min(within.bottom() - size.y).max(within.top());
    let rect = Rect::from_min_size(pos2(x, y), size);
    painter.rect(rect, 4.0, t.label.gamma_multiply(0.94), Stroke::new(1.0, t.border), StrokeKind::Inside);
    let bar = Rect::from_min_size(rect.min, vec2(3.0, size.y));
    painter.rect_filled(bar, CornerRadius { nw: 4, sw: 4, ne: 0, se: 0 }, color);
    painter.galley(rect.min + vec2(8.0, 3.0), galley, t.text[2]);
    rect
}

impl Viewport {
    /// The triad in the corner; a click on an axis looks along it.
    pub fn triad(&mut self, ui: &mut Ui) {
        let t = theme::of(ui);
        let center = self.rect.left_bottom() + vec2(TRIAD.0, -TRIAD.0);
        let colors = [
            Color32::from_rgb(0xe0, 0x52, 0x4c),
            Color32::from_rgb(0x5a, 0xb5, 0x55),
            Color32::from_rgb(0x4f, 0x8f, 0xe6),
        ];
        let (right, up, forward) = (self.camera.right(), self.camera.up(), self.camera.forward());
        let mut ends: Vec<(f64, usize, bool, Pos2)> = Vec::new();
        for axis in 0..3 {
            for positive in [true, false] {
                let mut d = DVec3::ZERO;
                d[axis] = if positive { 1.0 } else { -1.0 };
                let at = center + vec2(d.dot(right) as f32, -d.dot(up) as f32) * TRIAD.1;
                ends.push((d.dot(forward), axis, positive, at));
            }
        }
        // The farthest first.
        ends.sort_by(|a, b| b.0.total_cmp(&a.0));
        let painter = ui.painter().with_clip_rect(self.rect);
        let mut chosen = None;
        for (depth, axis, positive, at) in ends {
            let name = ["x", "y", "z"][axis];
            let view = match (axis, positive) {
                (0, true) => (Axis::Right, "Right view"),
                (0, false) => (Axis::Left, "Left view"),
                (1, true) => (Axis::Back, "Back view"),
                (1, false) => (Axis::Front, "Front view"),
                (2, true) => (Axis::Top, "Top view"),
                _ => (Axis::Bottom, "Bottom view"),
            };
            let radius = if positive { 8.5 } else { 6.0 };
            let area = Rect::from_center_size(at, vec2(2.0 * radius, 2.0 * radius));
            let response = ui.interact(area, ui.scope_id().with(("axis", axis, positive)), Sense::click());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{} (axis)", view.1)));
            let dim = if depth > 0.3 { 0.6 } else { 1.0 };
            let color = colors[axis].gamma_multiply(if response.hovered() { 1.0 } else { dim });
            if positive {
                painter.line_segment([center, at], Stroke::new(2.0, color));
                painter.circle_filled(at, radius, color);
                painter.text(
                    at,
                    Align2::CENTER_CENTER,
                    name,
                    FontId::proportional(12.0),
                    Color32::from_rgb(0x10, 0x12, 0x15),
                );
            } else {
                painter.circle(at, radius - 1.0, t.label.gamma_multiply(0.6), Stroke::new(1.5, color));
            }
            if response.on_hover_text(view.1).clicked() {
                chosen = Some(view.0);
            }
        }
        if let Some(axis) = chosen {
            self.look(axis);
        }
        let projection = match self.camera.projection {
            Projection::Perspective => "Perspective",
            Projection::Orthographic => "Parallel",
        };
        let at = self.rect.left_bottom() + vec2(2.0 * TRIAD.0 + 4.0, -12.0);
        painter.text(at, Align2::LEFT_BOTTOM, projection, FontId::proportional(theme::SMALL), t.text[1]);
    }

    /// Draws the handle of the section plane.
    pub fn section_handle(&self, ui: &Ui, pixel: Option<DVec2>) {
        let Some(plane) = self.section else { return };
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.rect);
        let view = self.view();
        let Some(at) = view.project(plane.point()) else { return };
        let size = view.pixel_size_at(at.depth.max(view.near));
        let here = self.to_window(at.pixel);
        let hot = self.section_drag.is_some() || pixel.is_some_and(|p| p.distance(at.pixel) < GRAB);
        let color = if hot { t.accent } else { t.warn };
        // The plane's outline, as wide as the model.
        let u = plane.normal().any_orthonormal_vector();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let u = axes.into_iter().find(|a| a.dot(plane.normal()).abs() < 0.5).unwrap_or(u);
        let u = (u - plane.normal() * u.dot(plane.normal())).normalize_or(u);
        let v = plane.normal().cross(u);
        let half = 0.55 * self.bounds().size();
        let (a, b) = (u.abs().dot(half), v.abs().dot(half));
        let corners = [(-a, -b), (a, -b), (a, b), (-a, b), (-a, -b)];
        let outline: Vec<Pos2> = corners
            .iter()
            .filter_map(|&(x, y)| view.project(plane.point() + u * x + v * y))
            .map(|p| self.to_window(p.pixel))
            .collect();
        if outline.len() == corners.len() {
            painter.line(outline, Stroke::new(1.0, color.gamma_multiply(0.55)));
        }
        if let Some(tip) = view.project(plane.point() + plane.normal() * (46.0 * size)) {
            painter.arrow(here, self.to_window(tip.pixel) - here, Stroke::new(2.0, color));
        }
        painter.circle(here, 7.0, t.label, Stroke::new(2.0, color));
        painter.circle_filled(here, 3.0, color);
        if hot {
            let text = "Section plane · drag to move · Alt+S off";
            tag(&painter, t, self.rect, here + vec2(14.0, 10.0), text, color);
        }
    }

    /// Whether a place of the window belongs to the axes in the corner.
    pub fn on_triad(&self, at: Pos2) -> bool {
        let center = self.rect.left_bottom() + vec2(TRIAD.0, -TRIAD.0);
        at.distance(center) < TRIAD.1 + 10.0
    }

    /// Whether the handle of the section plane is under a pixel.
    pub fn on_section_handle(&self, pixel: DVec2) -> bool {
        let at = self.section.and_then(|plane| self.view().project(plane.point()));
        at.is_some_and(|at| at.pixel.distance(pixel) < GRAB)
    }

    /// Drags the section plane; true while it is dragged.
    pub fn drag_section(&mut self, pointer: &super::Pointer) -> bool {
        let Some(plane) = self.section else { return false };
        if let Some((start, now)) = pointer.drag {
            if pointer.drag_started && self.on_section_handle(start) {
                self.section_drag = Some(start);
            }
            if let Some(last) = self.section_drag {
                self.section = Some(plane.dragged(&self.view(), last, now));
                self.section_drag = Some(now);
            }
        }
        let dragged = self.section_drag.is_some();
        if pointer.drag_ended || pointer.drag.is_none() {
            self.section_drag = None;
        }
        dragged
    }

    /// A cross where the camera turns about or holds.
    pub fn anchor_mark(&self, ui: &Ui) {
        if let Some(at) = self.drag_anchor().and_then(|p| self.project(p)) {
            let t = theme::of(ui);
            let painter = ui.painter().with_clip_rect(self.rect);
            painter.circle_stroke(at, 5.0, Stroke::new(1.5, t.accent));
            painter.circle_filled(at, 1.5, t.accent);
        }
    }
}
