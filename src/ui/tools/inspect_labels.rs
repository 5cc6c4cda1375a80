//! What the Inspect tool writes and outlines over the picture: the node in focus, its children and partners, the torus
//! in contact, a tag, and the legend.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, pos2, vec2};
use glam::DVec3;

use super::super::editor::Editor;
use super::super::status::{length, short};
use super::super::theme::{self, Tokens};
use super::super::viewport::{Pointer, tag};
use super::Tool;
use super::inspect::{Focus, InspectSession, Look};
use super::inspect_overlay::{Dressed, PARTNERS};
use crate::kernel::bvh::{NodeId, OsculatingTorus, SurfaceTree};
use crate::model::document::Unit;
use crate::view::colormap::Sequential;
use crate::view::inspect::{NodeCard, Scale, VolumeForm, children};
use crate::view::rounded_box::RoundedBox;
use crate::view::viewport::View;

/// Pieces of a quarter of a silhouette.
const ARCS: usize = 8;

/// Draws in the view.
struct Pen<'a> {
    painter: Painter,
    view: View,
    corner: Pos2,
    t: &'a Tokens,
}

impl Editor {
    /// Draws everything that lies over the picture.
    pub fn inspect_labels(&mut self, ui: &Ui, pointer: &Pointer) {
        let unit = self.document().unit;
        let rect = self.viewport.rect;
        let Tool::Inspect(session) = &mut self.tool else { return };
        if std::mem::take(&mut session.moved) {
            // The panels and the uv view were drawn before the mouse was looked at.
            ui.ctx().request_repaint();
        }
        if session.look == Look::Search {
            self.search_labels(ui, pointer);
            return;
        }
        let painter = ui.painter().with_clip_rect(rect);
        let pen = Pen { painter, view: self.viewport.view(), corner: rect.min, t: theme::of(ui) };
        for focus in [session.pinned, session.hovered].into_iter().flatten() {
            pen.focus(session, focus);
        }
        if let Some(dressed) = session.current() {
            legend(&pen, rect, dressed, unit);
        }
        let hovered = session.hovered.and_then(|f| Some((f, session.tree(f.subject)?)));
        if let (Some((focus, tree)), Some(pixel)) = (hovered, pointer.pixel) {
            let card = NodeCard::new(tree, focus.node);
            let at = self.viewport.to_window(pixel) + vec2(16.0, 40.0);
            tag(&pen.painter, pen.t, rect, at, &card_line(&card, unit), pen.t.accent);
            if let Some(line) = torus_line(&card, unit) {
                tag(&pen.painter, pen.t, rect, at + vec2(0.0, 26.0), &line, pen.t.warn);
            }
        }
    }
}

/// One line about a node.
fn card_line(card: &NodeCard, unit: Unit) -> String {
    let cone = card.cone.map_or("no normal cone".to_owned(), |c| format!("normal cone {}°", short(c)));
    format!("Level {} · radius {} · {cone}", card.level, length(card.radius, unit))
}

/// One line about its torus.
pub fn torus_line(card: &NodeCard, unit: Unit) -> Option<String> {
    let torus = card.torus?;
    let radii = match torus.radii {
        Some([major, minor]) => format!("R {} · r {}", length(major, unit), length(minor, unit)),
        None => format!("curvatures {} · {}", short(torus.torus.k[0]), short(torus.torus.k[1])),
    };
    Some(format!("Torus {radii} · deviation {}", length(torus.torus.deviation, unit)))
}

impl InspectSession {
    /// The tree of a subject.
    pub fn tree(&self, subject: usize) -> Option<&SurfaceTree> {
        self.subjects.get(subject)?.hierarchy.value().map(|h| &h.tree)
    }
}

impl Pen<'_> {
    fn volume(&self, session: &InspectSession, tree: &SurfaceTree, id: NodeId) -> RoundedBox {
        match session.options.form {
            VolumeForm::Spheres => RoundedBox::sphere(tree.node(id), tree.origin(id)),
            VolumeForm::Boxes => {
                // The box that is drawn, where it is; a child has none of its own.
                let shown = session
                    .current()
                    .and_then(|d| d.shown.iter().find_map(|s| s.find(id).and_then(|at| s.volumes.get(at).copied())));
                shown.unwrap_or_else(|| RoundedBox::swept(tree.node(id), tree.origin(id)))
            }
            _ => RoundedBox::swept(tree.node(id), tree.origin(id)),
        }
    }

    fn outline(&self, volume: &RoundedBox, stroke: Stroke, fill: Color32) {
        let points = volume.silhouette(&self.view, ARCS);
        let points: Vec<Pos2> = points.iter().map(|p| self.corner + vec2(p.x as f32, p.y as f32)).collect();
        if fill == Color32::TRANSPARENT {
            self.painter.add(Shape::line(points, stroke));
        } else {
            self.painter.add(Shape::convex_polygon(points, fill, stroke));
        }
    }

    fn focus(&self, session: &InspectSession, focus: Focus) {
        let Some(tree) = session.tree(focus.subject) else { return };
        let t = self.t;
        let thin = Stroke::new(1.0, t.text[2].gamma_multiply(0.7));
        for child in children(tree, focus.node) {
            self.outline(&self.volume(session, tree, child), thin, Color32::TRANSPARENT);
        }
        let volume = self.volume(session, tree, focus.node);
        self.outline(&volume, Stroke::new(3.5, t.label.gamma_multiply(0.7)), Color32::TRANSPARENT);
        self.outline(&volume, Stroke::new(2.0, t.accent), t.accent.gamma_multiply(0.18));
        if let (Some(dressed), Some(other)) = (session.current(), session.tree(1 - focus.subject.min(1))) {
            let stroke = Stroke::new(1.5, t.warn);
            for &partner in dressed.partners(focus).iter().take(PARTNERS) {
                self.outline(&self.volume(session, other, partner), stroke, t.warn.gamma_multiply(0.1));
            }
        }
        if let Some(torus) = tree.torus(focus.node) {
            self.contact(&torus);
        }
    }

    fn at(&self, p: DVec3) -> Option<Pos2> {
        self.view.project(p).map(|at| self.corner + vec2(at.pixel.x as f32, at.pixel.y as f32))
    }

    /// The contact point with the directions of meridian and rotation, as long as the used patch.
    fn contact(&self, torus: &OsculatingTorus) {
        let t = self.t;
        for (e, half) in torus.e.iter().zip(torus.half) {
            let ends = [-1.0, 1.0].map(|s| self.at(torus.point + *e * (s * half)));
            if let [Some(a), Some(b)] = ends {
                self.painter.line_segment([a, b], Stroke::new(1.5, t.text[2]));
            }
        }
        if let Some(at) = self.at(torus.point) {
            self.painter.circle(at, 4.0, t.warn, Stroke::new(1.5, t.label));
        }
    }
}

/// The colours of the volumes and of the tori, with their values.
fn legend(pen: &Pen<'_>, view: Rect, dressed: &Dressed, unit: Unit) {
    let symbol = |title: &str| match unit.symbol() {
        "" => title.to_owned(),
        symbol => format!("{title} ({symbol})"),
    };
    let coloring = dressed.options.coloring;
    let title = match coloring {
        crate::view::inspect::Coloring::Error => symbol(coloring.title()),
        _ => coloring.title().to_owned(),
    };
    let mut at = pos2(view.right() - 12.0, view.top() + 12.0);
    let volumes = dressed.options.form != VolumeForm::None;
    if volumes {
        at.y = bar(pen, at, &title, &dressed.scale, None);
    }
    if let Some(scale) = &dressed.tori_scale {
        let [_, thin] = dressed.tori_count;
        let note = (thin > 0).then(|| format!("{thin} with r below the leaf's size"));
        bar(pen, at, &symbol("Torus deviation"), scale, note);
    }
}

/// One bar with its upper right corner at `at`; the answer is where the next one begins.
fn bar(pen: &Pen<'_>, at: Pos2, title: &str, scale: &Scale, note: Option<String>) -> f32 {
    let t = pen.t;
    let small = FontId::proportional(theme::SMALL);
    let height = if note.is_some() { 74.0 } else { 56.0 };
    let panel = Rect::from_min_size(pos2(at.x - 236.0, at.y), vec2(236.0, height));
    pen.painter.rect(panel, 6.0, t.label.gamma_multiply(0.92), Stroke::new(1.0, t.border), StrokeKind::Inside);
    pen.painter.text(panel.min + vec2(10.0, 5.0), Align2::LEFT_TOP, title, small.clone(), t.text[2]);
    let inner = Rect::from_min_size(panel.min + vec2(10.0, 23.0), vec2(216.0, 11.0));
    for k in 0..72 {
        let [r, g, b] = Sequential::Viridis.color((f64::from(k) + 0.5) / 72.0).map(|c| (c * 255.0).round() as u8);
        let x = inner.left() + 3.0 * k as f32;
        let step = Rect::from_min_size(pos2(x, inner.top()), vec2(3.2, inner.height()));
        pen.painter.rect_filled(step.intersect(inner), 0.0, Color32::from_rgb(r, g, b));
    }
    for (place, align) in [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)] {
        let x = inner.left() + place * inner.width();
        let value = short(scale.value(f64::from(place)));
        pen.painter.vline(x, inner.bottom()..=inner.bottom() + 3.0, Stroke::new(1.0, t.text[1]));
        pen.painter.text(pos2(x, inner.bottom() + 4.0), align, value, small.clone(), t.text[0]);
    }
    if let Some(note) = note {
        let y = inner.bottom() + 21.0;
        let square = Rect::from_min_size(pos2(inner.left(), y + 2.0), vec2(10.0, 10.0));
        let thin = crate::render::to_srgb8(crate::render::srgb(crate::render::THIN));
        pen.painter.rect_filled(square, 0.0, Color32::from_rgb(thin[0], thin[1], thin[2]));
        pen.painter.text(pos2(inner.left() + 15.0, y), Align2::LEFT_TOP, note, small, t.text[1]);
    }
    panel.bottom() + 8.0
}
