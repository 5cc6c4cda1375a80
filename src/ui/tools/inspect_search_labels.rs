//! What the Inspect tool writes and outlines over the picture while the search for self-intersections is looked at.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};
use glam::DVec3;

use super::super::editor::Editor;
use super::super::theme::{self, Tokens};
use super::super::viewport::{Pointer, tag};
use super::Tool;
use super::inspect_search::{SIZES, SearchDressed, node_line};
use crate::view::inspect::{SETTLED, SETTLED_AT, STATES};

/// The entries of the legend: number, name, what it means, colour.
pub fn states() -> impl Iterator<Item = (usize, &'static str, &'static str, Color32)> {
    let settled = (SETTLED_AT, "Proved at a coarser level", "Its subtree was dropped further up", SETTLED);
    let all = STATES.iter().enumerate().map(|(k, s)| (k, s.1, s.2, s.3)).chain([settled]);
    all.map(|(k, name, help, rgb)| {
        (k, name, help, Color32::from_rgb((rgb >> 16 & 255) as u8, (rgb >> 8 & 255) as u8, (rgb & 255) as u8))
    })
}

impl Editor {
    /// Draws what lies over the picture.
    pub fn search_labels(&mut self, ui: &Ui, pointer: &Pointer) {
        let rect = self.viewport.rect;
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(rect);
        let Tool::Inspect(session) = &self.tool else { return };
        let Some(dressed) = session.search_drawn() else { return };
        let project =
            |line: Vec<DVec3>| -> Vec<Pos2> { line.into_iter().filter_map(|p| self.viewport.project(p)).collect() };
        let closed = |line: Vec<DVec3>, width: f32, color: Color32| {
            let line = project(line);
            painter.line(line.clone(), Stroke::new(width + 2.0, t.label.gamma_multiply(0.7)));
            painter.line(line, Stroke::new(width, color));
        };
        for focus in [session.search.pinned, session.search.hovered].into_iter().flatten() {
            let Some(searched) = session.searched(focus.subject) else { continue };
            for child in searched.children(focus.node).iter().filter_map(|&k| searched.node(k)) {
                painter.line(project(searched.outline(child.uv_box)), Stroke::new(1.2, t.text[2]));
            }
            if let Some(node) = searched.node(focus.node) {
                closed(searched.outline(node.uv_box), 2.5, t.accent);
            }
            for window in session.windows_at(focus) {
                closed(searched.outline(window), 2.0, t.bad);
            }
            if let Some(partner) = session.partner_of(focus) {
                closed(searched.outline(partner), 2.5, t.warn);
            }
        }
        legend(&painter, t, rect, dressed);
        let hovered = session.search.hovered.and_then(|f| Some((f, session.searched(f.subject)?)));
        if let (Some((focus, searched)), Some(pixel)) = (hovered, pointer.pixel) {
            let at = self.viewport.to_window(pixel) + vec2(16.0, 40.0);
            if let Some(line) = node_line(searched, focus.node) {
                tag(&painter, t, rect, at, &line, t.accent);
            }
            let failed = SIZES.iter().zip(session.search.options.windows).filter(|(_, on)| *on);
            let names: Vec<String> = failed
                .filter_map(|(&size, _)| {
                    let w = searched.window_over(size, focus.uv)?;
                    Some(format!("{size} x {size} window at cell {}, {}", w.first[0], w.first[1]))
                })
                .collect();
            if !names.is_empty() {
                let line = format!("Not proved injective: {}", names.join(" and "));
                tag(&painter, t, rect, at + vec2(0.0, 26.0), &line, t.bad);
            }
        }
    }
}

/// The colours that occur, and the lines.
fn legend(painter: &Painter, t: &Tokens, view: Rect, dressed: &SearchDressed) {
    let small = FontId::proportional(theme::SMALL);
    let states: Vec<_> = states().filter(|(k, ..)| dressed.states[*k]).collect();
    let shown = (0..SIZES.len()).filter(|&k| dressed.options.windows[k] && dressed.failed[k] > 0);
    let windows: Vec<u32> = shown.map(|k| SIZES[k]).collect();
    let rows = states.len() + windows.len();
    let size = vec2(210.0, 30.0 + 19.0 * rows as f32);
    let panel = Rect::from_min_size(pos2(view.right() - 12.0 - size.x, view.top() + 12.0), size);
    painter.rect(panel, 6.0, t.label.gamma_multiply(0.92), Stroke::new(1.0, t.border), StrokeKind::Inside);
    let title = format!("Ternary tree, level {}", dressed.options.level);
    painter.text(panel.min + vec2(10.0, 6.0), Align2::LEFT_TOP, title, small.clone(), t.text[2]);
    let mut y = panel.top() + 35.0;
    let row = |y: f32, text: String| {
        painter.text(pos2(panel.left() + 34.0, y), Align2::LEFT_CENTER, text, small.clone(), t.text[0]);
    };
    for (_, name, _, color) in states {
        let square = Rect::from_center_size(pos2(panel.left() + 18.0, y), vec2(14.0, 12.0));
        painter.rect_filled(square, 2.0, color);
        row(y, name.to_owned());
        y += 19.0;
    }
    for size in windows {
        let [a, b] = [10.0, 27.0].map(|x| pos2(panel.left() + x, y));
        let pen = Stroke::new(2.0, t.bad);
        if size == SIZES[0] {
            painter.extend(egui::Shape::dashed_line(&[a, b], pen, 4.0, 3.0));
        } else {
            painter.line_segment([a, b], pen);
        }
        row(y, format!("Failed {size} x {size} windows"));
        y += 19.0;
    }
}
