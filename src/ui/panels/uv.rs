//! The uv view: the domains of one or two surfaces side by side, with whatever the active tool marks in them. It draws
//! [`UvPicture`]s and tells the tool what is hovered and clicked; the wheel magnifies, the middle or the right button
//! moves, a button in the corner fits again.

use std::collections::HashMap;
use std::sync::Arc;

use egui::epaint::{Mesh, Vertex};
use egui::{
    Align2, Color32, FontId, Painter, PointerButton, Pos2, Rect, Sense, Shape, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, pos2, vec2,
};
use glam::DVec2;

use super::super::actions::Action;
use super::super::editor::Editor;
use super::super::icons::{self, Icon};
use super::super::linked::From;
use super::super::status::short;
use super::super::theme::{self, Tokens};
use super::super::viewport::tag;
use crate::model::document::EntityId;
use crate::view::navigation::Modifiers;
use crate::view::uv::{RADIUS, UvCells, UvDash, UvGlyph, UvHit, UvInk, UvMark, UvPicture, UvShape, hatching};
use crate::view::uv_map::{UvMap, UvNavigation};

/// The narrowest domain.
const NARROWEST: f32 = 170.0;
/// Points of scrolling that double or halve the magnification.
const DOUBLING: f64 = 160.0;
/// Knot lines closer than this many pixels are left out.
const CLOSE: f64 = 3.0;

/// What the mouse does in a domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvPointer {
    /// Of which surface.
    pub entity: EntityId,
    /// Where, clamped to the domain.
    pub uv: DVec2,
    /// The mark under the cursor.
    pub hit: Option<UvHit>,
    /// Clicked, with these keys held.
    pub click: Option<Modifiers>,
}

/// What the uv view keeps from frame to frame.
#[derive(Default)]
pub struct UvView {
    /// What is under the cursor.
    pub pointer: Option<UvPointer>,
    navigation: HashMap<EntityId, UvNavigation>,
    textures: HashMap<EntityId, (u64, TextureHandle)>,
}

/// Draws the view and hands what the mouse did to the tool.
pub fn show(ui: &mut Ui, editor: &mut Editor) {
    let pictures = pictures(editor);
    let shown = (((ui.available_width() / NARROWEST) as usize).max(1)).min(pictures.len());
    let mut view = std::mem::take(&mut editor.uv);
    view.navigation.retain(|id, _| editor.document().get(*id).is_some());
    view.textures.retain(|id, _| pictures.iter().any(|p| p.entity == *id && p.cells.is_some()));
    view.pointer = None;
    let area = ui.available_rect_before_wrap();
    let gap = 1.0;
    for (at, picture) in pictures.iter().take(shown).enumerate() {
        let width = (area.width() - gap * (shown - 1) as f32) / shown as f32;
        let left = area.left() + at as f32 * (width + gap);
        let rect = Rect::from_min_size(pos2(left, area.top()), vec2(width, area.height()));
        view.pane(ui, editor, picture, rect);
        if at > 0 {
            ui.painter().vline(rect.left() - 0.5 * gap, rect.y_range(), Stroke::new(gap, theme::of(ui).border));
        }
    }
    ui.advance_cursor_after_rect(area);
    let t = theme::of(ui);
    if pictures.is_empty() {
        ui.painter().rect_filled(area, 0.0, t.field);
        let text = "Select a surface to see its parameter domain here";
        ui.painter().text(area.center(), Align2::CENTER_CENTER, text, FontId::proportional(theme::TEXT), t.text[1]);
    }
    if shown < pictures.len() {
        let text = format!("{} more do not fit: make the window wider", pictures.len() - shown);
        let at = area.right_bottom() - vec2(8.0, 6.0);
        ui.painter().text(at, Align2::RIGHT_BOTTOM, text, FontId::proportional(theme::SMALL), t.warn);
    }
    let close = Rect::from_min_size(area.right_top() + vec2(-26.0, 4.0), vec2(22.0, 22.0));
    let mut corner = ui.new_child(egui::UiBuilder::new().max_rect(close).id_salt("close uv"));
    if icons::button(&mut corner, Icon::Close, "Close the uv view", 20.0, false).on_hover_text("Close (U)").clicked() {
        let ctx = ui.ctx().clone();
        editor.perform(&ctx, Action::UvView);
    }
    let pointer = view.pointer;
    editor.uv = view;
    editor.link_from_domain(pointer.map(|p| (p.entity, p.uv)));
    if let Some(pointer) = pointer {
        editor.viewport.hover_from_list(pointer.entity);
    }
    editor.tool_uv_pointer(pointer.as_ref());
}

/// What the tool supplies, or the plain domains of what is selected.
fn pictures(editor: &Editor) -> Vec<Arc<UvPicture>> {
    let from_tool = editor.tool_uv();
    if !from_tool.is_empty() {
        return from_tool;
    }
    let ids = editor.selection.ids().iter();
    let entities = ids.filter_map(|&id| editor.document().get(id));
    let plain = entities.filter_map(|e| Some(Arc::new(UvPicture::plain(e.id, e.name.clone(), e.surface()?))));
    plain.take(2).collect()
}

fn vector(p: Pos2, pane: Rect) -> DVec2 {
    DVec2::new(f64::from(p.x - pane.left()), f64::from(p.y - pane.top()))
}

fn color_of(ink: UvInk, t: &Tokens) -> Color32 {
    match ink {
        UvInk::Text => t.text[2],
        UvInk::Quiet => t.text[1],
        UvInk::Accent => t.accent,
        UvInk::Good => t.good,
        UvInk::Warn => t.warn,
        UvInk::Bad => t.bad,
        UvInk::Side(n) => t.sides[n % t.sides.len()],
        UvInk::Own(rgb) => {
            let [r, g, b] = rgb.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
            Color32::from_rgb(r, g, b)
        }
    }
}

/// Draws into one domain.
struct Pen<'a> {
    painter: Painter,
    pane: Rect,
    map: UvMap,
    t: &'a Tokens,
}

impl UvView {
    /// Shows a box of parameters of a surface, low and high corner.
    pub fn go_to(&mut self, entity: EntityId, domain: [[f64; 2]; 2], corners: [DVec2; 2]) {
        self.navigation.insert(entity, UvNavigation::around(domain, corners));
    }

    fn pane(&mut self, ui: &mut Ui, editor: &Editor, picture: &UvPicture, rect: Rect) {
        let response = ui.interact(rect, ui.scope_id().with(("uv", picture.entity.0)), Sense::click_and_drag());
        let name = format!("uv view of {}", picture.title);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, &name));
        let size = DVec2::new(f64::from(rect.width()), f64::from(rect.height()));
        let navigation = self.navigation.entry(picture.entity).or_default();
        let mut map = UvMap::new(picture.domain, size, *navigation);
        let (at, scroll, zoom, held) = ui.input(|i| {
            let m = i.modifiers;
            let held = Modifiers { shift: m.shift, ctrl: m.command || m.ctrl, alt: m.alt };
            (i.pointer.latest_pos(), f64::from(i.smooth_scroll_delta().y), f64::from(i.zoom_delta()), held)
        });
        let at = at.filter(|_| response.contains_pointer() && editor.dialog.is_none() && editor.palette.is_none());
        let pixel = at.map(|at| vector(at, rect));
        if let Some(pixel) = pixel
            && (scroll != 0.0 || zoom != 1.0)
        {
            *navigation = map.zoomed(pixel, (scroll / DOUBLING).exp2() * zoom);
        }
        if response.dragged_by(PointerButton::Middle) || response.dragged_by(PointerButton::Secondary) {
            let by = response.drag_delta();
            *navigation = map.panned(DVec2::new(f64::from(by.x), f64::from(by.y)));
        }
        map = UvMap::new(picture.domain, size, *navigation);
        let fitted = *navigation == UvNavigation::default();
        let hit = pixel.and_then(|pixel| picture.hit(&map, pixel, RADIUS));
        if let Some(pixel) = pixel {
            let [[u0, u1], [v0, v1]] = picture.domain;
            let uv = map.to_uv(pixel).clamp(DVec2::new(u0, v0), DVec2::new(u1, v1));
            let click = response.clicked().then_some(held);
            self.pointer = Some(UvPointer { entity: picture.entity, uv, hit, click });
        }

        let pen = Pen { painter: ui.painter().with_clip_rect(rect), pane: rect, map, t: theme::of(ui) };
        pen.ground(picture);
        if let Some(cells) = &picture.cells {
            self.cells(ui, &pen, picture.entity, cells);
        }
        pen.knots(picture);
        for mark in &picture.marks {
            pen.mark(mark, 0.0);
        }
        if let Some(mark) = hit.and_then(|hit| picture.marks.get(hit.mark)) {
            pen.mark(mark, 1.5);
        }
        match pixel.and(self.pointer) {
            Some(pointer) => pen.cursor(picture, pointer.uv, false),
            None => {
                let linked = editor.linked.filter(|l| l.entity == picture.entity && l.from == From::Space);
                if let Some(linked) = linked {
                    pen.cursor(picture, linked.uv, true);
                }
            }
        }
        pen.frame_of_numbers(picture);
        if let (Some(at), Some(mark)) = (at, hit.and_then(|hit| picture.marks.get(hit.mark)))
            && !mark.label.is_empty()
        {
            tag(&pen.painter, pen.t, rect, at + vec2(14.0, 12.0), &mark.label, color_of(mark.ink, pen.t));
        }
        if !fitted {
            let place = Rect::from_min_size(rect.left_bottom() + vec2(4.0, -26.0), vec2(22.0, 22.0));
            let mut corner = ui.new_child(egui::UiBuilder::new().max_rect(place).id_salt(("fit", picture.entity.0)));
            let fit = icons::button(&mut corner, Icon::FrameAll, &format!("Fit {name}"), 20.0, false);
            if fit.on_hover_text("Show the whole domain").clicked() {
                self.navigation.remove(&picture.entity);
            }
        }
    }

    /// The field of colours, as one texture that is stretched from break to break.
    fn cells(&mut self, ui: &Ui, pen: &Pen<'_>, entity: EntityId, cells: &UvCells) {
        let [width, height] = cells.size();
        let side = ui.input(|i| i.max_texture_side);
        if width == 0 || height == 0 || cells.colors.len() != width * height {
            return;
        }
        if width.max(height) > side {
            let text = format!("{width} x {height} colours are more than the {side} that this graphics card takes");
            let font = FontId::proportional(theme::SMALL);
            pen.painter.text(pen.pane.center(), Align2::CENTER_CENTER, text, font, pen.t.warn);
            return;
        }
        let texture = match self.textures.get(&entity) {
            Some((revision, texture)) if *revision == cells.revision => texture.id(),
            _ => {
                let bytes: Vec<u8> = cells.colors.iter().flatten().copied().collect();
                let image = egui::ColorImage::from_rgba_unmultiplied([width, height], &bytes);
                let texture = ui.ctx().load_texture(format!("uv cells {}", entity.0), image, TextureOptions::NEAREST);
                let id = texture.id();
                self.textures.insert(entity, (cells.revision, texture));
                id
            }
        };
        let mut mesh = Mesh::with_texture(texture);
        let [us, vs] = &cells.breaks;
        for (j, v) in vs.iter().enumerate() {
            for (i, u) in us.iter().enumerate() {
                let uv = pos2(i as f32 / (us.len() - 1) as f32, j as f32 / (vs.len() - 1) as f32);
                mesh.vertices.push(Vertex { pos: pen.at(DVec2::new(*u, *v)), uv, color: Color32::WHITE });
            }
        }
        let row = us.len() as u32;
        for j in 0..vs.len() as u32 - 1 {
            for i in 0..row - 1 {
                let a = j * row + i;
                mesh.add_triangle(a, a + 1, a + row + 1);
                mesh.add_triangle(a, a + row + 1, a + row);
            }
        }
        pen.painter.add(Shape::mesh(mesh));
    }
}

impl Pen<'_> {
    fn at(&self, uv: DVec2) -> Pos2 {
        let p = self.map.to_pixel(uv);
        // Far outside the pane a point is as good as at its rim; f32 has no room for more.
        let far = 1e5;
        self.pane.min + vec2(p.x.clamp(-far, far) as f32, p.y.clamp(-far, far) as f32)
    }

    fn corners(&self, picture: &UvPicture) -> Rect {
        let [[u0, u1], [v0, v1]] = picture.domain;
        Rect::from_two_pos(self.at(DVec2::new(u0, v0)), self.at(DVec2::new(u1, v1)))
    }

    fn ground(&self, picture: &UvPicture) {
        self.painter.rect_filled(self.pane, 0.0, self.t.field);
        self.painter.rect_filled(self.corners(picture), 0.0, self.t.raised);
    }

    fn knots(&self, picture: &UvPicture) {
        let domain = self.corners(picture);
        let stroke = Stroke::new(1.0, self.t.border);
        for (k, values) in picture.knots.iter().enumerate() {
            let mut last = f64::NEG_INFINITY;
            for &value in values {
                let p = self.at(if k == 0 { DVec2::new(value, 0.0) } else { DVec2::new(0.0, value) });
                let place = f64::from(if k == 0 { p.x } else { -p.y });
                if place - last < CLOSE {
                    continue;
                }
                last = place;
                if k == 0 {
                    self.painter.vline(p.x, domain.y_range(), stroke);
                } else {
                    self.painter.hline(domain.x_range(), p.y, stroke);
                }
            }
        }
        self.painter.rect_stroke(domain, 0.0, Stroke::new(1.5, self.t.text[1]), StrokeKind::Middle);
    }

    fn mark(&self, mark: &UvMark, wider: f32) {
        let [low, high] = mark.bounds();
        let [seen_low, seen_high] = self.map.seen();
        let slack = 2.0 * RADIUS / self.map.scale();
        if high.cmplt(seen_low - slack).any() || low.cmpgt(seen_high + slack).any() {
            return;
        }
        let color = color_of(mark.ink, self.t);
        let width = mark.width + wider;
        if let UvShape::Point(p, glyph) = &mark.shape {
            self.glyph(self.at(*p), *glyph, width + wider, color);
        }
        let inside = color.gamma_multiply(mark.fill);
        match &mark.shape {
            UvShape::Rectangle([a, b]) if mark.fill > 0.0 => {
                self.painter.rect_filled(Rect::from_two_pos(self.at(*a), self.at(*b)), 0.0, inside);
            }
            UvShape::Quad(corners) if mark.fill > 0.0 => {
                let mut mesh = Mesh::default();
                for p in corners {
                    mesh.colored_vertex(self.at(*p), inside);
                }
                mesh.add_triangle(0, 1, 2);
                mesh.add_triangle(0, 2, 3);
                self.painter.add(Shape::mesh(mesh));
            }
            UvShape::Region(_) if mark.fill > 0.0 => {
                let pixel = |uv: &DVec2| vector(self.at(*uv), self.pane);
                let loops: Vec<Vec<DVec2>> = mark.outline().iter().map(|run| run.iter().map(pixel).collect()).collect();
                for line in hatching(&loops, 5.0) {
                    let ends = line.map(|p| self.pane.min + vec2(p.x as f32, p.y as f32));
                    self.painter.line_segment(ends, Stroke::new(1.0, inside));
                }
            }
            _ => {}
        }
        if mark.width > 0.0 {
            let stroke = Stroke::new(width, color);
            for run in mark.outline() {
                let run: Vec<Pos2> = run.into_iter().map(|uv| self.at(uv)).collect();
                match mark.dash {
                    UvDash::Solid => {
                        self.painter.add(Shape::line(run, stroke));
                    }
                    UvDash::Long => self.painter.extend(Shape::dashed_line(&spaced(&run), stroke, 9.0, 5.0)),
                    UvDash::Short => self.painter.extend(Shape::dashed_line(&spaced(&run), stroke, 4.0, 3.5)),
                }
            }
        }
        if mark.named && !mark.label.is_empty() {
            let at = self.at(mark.anchor()) + vec2(8.0, -8.0);
            let font = FontId::proportional(theme::SMALL);
            let galley = self.painter.layout_no_wrap(mark.label.clone(), font, self.t.text[2]);
            let ground = Rect::from_min_size(at, galley.size()).expand2(vec2(3.0, 1.0));
            self.painter.rect_filled(ground, 3.0, self.t.label.gamma_multiply(0.8));
            self.painter.galley(at, galley, self.t.text[2]);
        }
    }

    fn glyph(&self, at: Pos2, glyph: UvGlyph, diameter: f32, color: Color32) {
        let r = 0.5 * diameter;
        let rim = Stroke::new(1.5, self.t.field);
        let polygon = |points: Vec<Pos2>| {
            self.painter.add(Shape::convex_polygon(points, color, rim));
        };
        match glyph {
            UvGlyph::Round => {
                self.painter.circle(at, r, color, rim);
            }
            UvGlyph::Ring => {
                self.painter.circle_stroke(at, r - 1.0, Stroke::new(2.0, color));
            }
            UvGlyph::Cross => {
                for d in [vec2(0.8 * r, 0.8 * r), vec2(0.8 * r, -0.8 * r)] {
                    self.painter.line_segment([at - d, at + d], Stroke::new(2.0, color));
                }
            }
            UvGlyph::Diamond => {
                let r = 1.2 * r;
                polygon([vec2(r, 0.0), vec2(0.0, r), vec2(-r, 0.0), vec2(0.0, -r)].map(|d| at + d).to_vec());
            }
            UvGlyph::Square => {
                let r = 0.85 * r;
                polygon([vec2(-r, -r), vec2(r, -r), vec2(r, r), vec2(-r, r)].map(|d| at + d).to_vec());
            }
            UvGlyph::Triangle => {
                polygon([vec2(0.0, -1.1 * r), vec2(r, 0.75 * r), vec2(-r, 0.75 * r)].map(|d| at + d).to_vec());
            }
        }
    }

    /// The linked cursor: a cross over the domain, with a dot where the mouse is elsewhere.
    fn cursor(&self, picture: &UvPicture, uv: DVec2, dot: bool) {
        let domain = self.corners(picture);
        let at = self.at(uv);
        let stroke = Stroke::new(1.0, self.t.accent.gamma_multiply(0.6));
        self.painter.vline(at.x, domain.y_range(), stroke);
        self.painter.hline(domain.x_range(), at.y, stroke);
        if dot {
            self.painter.circle(at, 4.0, self.t.accent, Stroke::new(1.5, self.t.field));
        }
    }

    /// The title, the ends of the domain, and where the cursor is.
    fn frame_of_numbers(&self, picture: &UvPicture) {
        let (t, small) = (self.t, FontId::proportional(theme::SMALL));
        let text = |at: Pos2, align: Align2, text: String, color: Color32| {
            self.painter.text(at, align, text, small.clone(), color);
        };
        let title = FontId::proportional(theme::TEXT);
        let mut job = egui::text::LayoutJob::simple_singleline(picture.title.clone(), title, t.text[2]);
        job.wrap = egui::text::TextWrapping::truncate_at_width((self.pane.width() - 40.0).max(20.0));
        let galley = self.painter.layout_job(job);
        self.painter.galley(self.pane.min + vec2(8.0, 4.0), galley, t.text[2]);
        let domain = self.corners(picture);
        let inner = domain.intersect(self.pane);
        let [[u0, u1], [v0, v1]] = picture.domain;
        let y = (domain.bottom() + 3.0).min(self.pane.bottom() - 16.0);
        text(pos2(domain.left(), y), Align2::LEFT_TOP, short(u0), t.text[1]);
        text(pos2(domain.right(), y), Align2::RIGHT_TOP, short(u1), t.text[1]);
        text(pos2(inner.center().x, y), Align2::CENTER_TOP, "u".to_owned(), t.text[1]);
        let x = (domain.left() - 5.0).max(self.pane.left() + 40.0);
        text(pos2(x, domain.bottom()), Align2::RIGHT_BOTTOM, short(v0), t.text[1]);
        text(pos2(x, domain.top()), Align2::RIGHT_TOP, short(v1), t.text[1]);
        text(pos2(x, inner.center().y), Align2::RIGHT_CENTER, "v".to_owned(), t.text[1]);
    }
}
/// A polyline without points less than two pixels apart: what is drawn of a dash between two such is rounded away.
fn spaced(run: &[Pos2]) -> Vec<Pos2> {
    let mut out: Vec<Pos2> = run.first().copied().into_iter().collect();
    for (k, &p) in run.iter().enumerate().skip(1) {
        let last = out[out.len() - 1];
        if p.distance(last) >= 2.0 {
            out.push(p);
        } else if k + 1 == run.len() && out.len() > 1 {
            out.pop();
            out.push(p);
        }
    }
    out
}
