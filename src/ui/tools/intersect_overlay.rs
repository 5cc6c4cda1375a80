//! What the intersection tools draw into the view: the picked sets, the result by kind, the gap field, tori and normals
//! at the cursor, and the legend over it.

use std::sync::Arc;

use egui::{Align2, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke as Pen, StrokeKind, Ui, pos2, vec2};
use glam::DVec3;

use super::super::editor::Editor;
use super::super::status::length;
use super::super::theme::{self, Tokens};
use super::super::viewport::{Overlay, linear, tag};
use super::Tool;
use super::intersect::{Drawn, FieldKind, IntersectSession};
use crate::kernel::ssi::result::Miter;
use crate::render::{ColorScale, Dash, Field, GlyphData, GlyphShape, Hidden, LineStyle, Sketch, srgb, with_alpha};
use crate::view::display::CurveRef;
use crate::view::intersection::gap::LogScale;
use crate::view::intersection::list::gap;
use crate::view::intersection::marks::{Drawing, legend};
use crate::view::intersection::style::{Stroke, Style};
use crate::view::intersection::{Item, place};
use crate::view::scene::Scene;

/// The number under which the tool's own things are kept on the graphics card.
const OWN: u64 = u64::MAX - 100;
/// How strongly a result is drawn that is about to be replaced.
const STALE: f32 = 0.3;

impl IntersectSession {
    /// What to draw now. The drawing is kept until something in it changes; the cursor is drawn anew whenever it moves.
    pub fn overlay(&mut self, scene: &Scene, dark: bool) -> Overlay {
        let t = theme::tokens(dark);
        let seen = scene.items().iter().fold(0u64, |h, item| h.rotate_left(7).wrapping_add(item.revision));
        let of = (self.revision, dark, seen);
        if self.drawn.as_ref().is_none_or(|d| d.of != of) {
            let origin = scene.items().first().map(|i| i.bounds.center()).unwrap_or_default();
            let revision = (self.revision << 1 | u64::from(dark)) ^ seen.rotate_left(24);
            let mut d = Sketch::new(OWN, revision, origin);
            let strength = if self.is_stale() { STALE } else { 1.0 };
            let shaded = self.fields(&mut d, scene, revision);
            match &self.found {
                None => self.sets(&mut d, scene, t),
                Some(found) => {
                    d.intersection(&Drawing::new(found, self.focus, dark), strength, dark);
                    if let Some(Ok(both)) = self.other.value() {
                        let color = with_alpha(linear(t.warn), strength);
                        let style = LineStyle { width: 2.0, color, dash: Dash::SHORT, hidden: Hidden::OnTop };
                        let curves = both.other.result.curves.iter();
                        d.polylines(curves.map(|c| c.points.iter().map(|p| p.xyz)), style);
                    }
                    self.biarc_joints(&mut d, t);
                    self.demo.draw(&mut d, t);
                }
            }
            self.drawn = Some(Drawn { of, sketch: d, shaded });
        }
        let mut out = Overlay { mute: self.found.is_some(), ..Overlay::default() };
        if let Some(drawn) = &self.drawn {
            out.ghost = drawn.shaded;
            if let (true, Some(found), Some((_, meshes))) = (drawn.shaded, &self.found, self.shaded.value()) {
                out.without = meshes.iter().filter_map(|m| found.id(m.number)).collect();
            }
            out.add(drawn.sketch.clone());
            let mut cursor = Sketch::new(OWN - 1, self.cursor_revision << 1 | u64::from(dark), drawn.sketch.origin);
            self.cursor_marks(&mut cursor, t);
            out.add(cursor);
        }
        // Each is used once only, so the two never make one number twice by chance in a session.
        out.revision =
            (self.revision ^ self.cursor_revision.rotate_left(32)) ^ seen.rotate_left(16) ^ u64::from(dark) << 63;
        out
    }

    /// The borders of the surfaces of both sets.
    fn sets(&self, d: &mut Sketch, scene: &Scene, t: &Tokens) {
        for (side, ids) in self.picks.sides.iter().enumerate() {
            let color = linear(t.sides[side]);
            for item in ids.iter().filter_map(|id| scene.item(*id)) {
                let Some(display) = &item.display else { continue };
                let borders = display.curves.iter().filter(|c| matches!(c.curve, CurveRef::Border(..)));
                let dash = if side == 0 { Dash::Solid } else { Dash::LONG };
                let style = LineStyle { width: 2.5, color, dash, hidden: Hidden::Dashed };
                d.polylines(borders.map(|c| c.points.iter().copied()), style);
            }
        }
    }

    /// The colours of the field that is shown.
    pub fn color_scale(&self) -> Option<(FieldKind, LogScale, ColorScale)> {
        let (kind, meshes) = self.shaded.value()?;
        let largest = meshes.iter().map(crate::view::intersection::gap::FieldMesh::largest).fold(0.0, f64::max);
        let log = LogScale::fitting(if *kind == FieldKind::Gap { largest } else { 1.0 }, self.decades);
        let n = log.decades as f32;
        let scale = match kind {
            FieldKind::Gap => {
                // One colour for each power of ten, from the neutral middle outwards.
                let wide = ColorScale::deviation(1.0, 0.0);
                let place = |k: usize| (k as f32 + 0.5) / n;
                let below = (0..log.decades).rev().map(|k| wide.color(-place(k)));
                let steps = below.chain((0..log.decades).map(|k| wide.color(place(k)))).collect();
                ColorScale { low: -n, high: n, band: 1e-6, steps, ..wide }
            }
            _ => {
                let wide = ColorScale::sequential(0.0, 1.0);
                // Steps of a third of a power of ten, as far as the scale has room for them.
                let count = (3 * log.decades).min(crate::render::MAX_STEPS);
                let steps = (0..count).map(|k| wide.color((k as f32 + 0.5) / count as f32)).collect();
                ColorScale { low: 0.0, high: n, steps, ..wide }
            }
        };
        Some((*kind, log, scale))
    }

    /// The shaded field; true when there is one.
    fn fields(&self, d: &mut Sketch, scene: &Scene, revision: u64) -> bool {
        let (Some((kind, log, scale)), Some((_, meshes))) = (self.color_scale(), self.shaded.value()) else {
            return false;
        };
        let scale = Arc::new(scale);
        let size = scene.bounds().diagonal();
        for field in meshes {
            let factor = if kind == FieldKind::Gap { 10.0_f64.powf(self.exaggeration) } else { 1.0 };
            let (points, _) = field.exaggerated(factor, size);
            let values = field.values.iter().map(|v| log.place(*v) as f32).collect();
            let colors = Field { revision, values: Arc::new(values), scale: Arc::clone(&scale) };
            // Moved vertices have other normals: the triangles' own stand in.
            let normals = if factor > 1.0 {
                Vec::new()
            } else {
                field.mesh.normals.iter().map(|n| n.as_vec3().to_array()).collect()
            };
            d.mesh(&points, normals, field.mesh.triangles.to_vec(), srgb(0xffffff), Some(colors));
        }
        !meshes.is_empty()
    }

    /// Where the biarcs of the chosen curve join.
    fn biarc_joints(&self, d: &mut Sketch, t: &Tokens) {
        let Some(Ok(fit)) = self.biarcs.value() else { return };
        if self.chosen_curve() != Some(fit.curve) {
            return;
        }
        let mut glyphs = GlyphData::new(d.origin);
        for joint in &fit.joints {
            glyphs.push(*joint, GlyphShape::Round, 6.0, linear(t.text[2]));
        }
        d.glyphs(glyphs, Hidden::OnTop);
    }

    /// The cursor, and the tori and normals there.
    fn cursor_marks(&self, d: &mut Sketch, t: &Tokens) {
        let Some(found) = &self.found else { return };
        if let Some(p) = self.cursor.and_then(|c| c.point(found)) {
            let mut glyphs = GlyphData::new(d.origin);
            glyphs.push(p.xyz, GlyphShape::Round, 13.0, linear(t.label));
            glyphs.push(p.xyz, GlyphShape::Ring, 14.0, linear(t.accent));
            if let Some(direction) = self.cursor.and_then(|c| c.direction(found)) {
                glyphs.push_arrow(p.xyz, direction, 9.0, linear(t.accent));
            }
            d.glyphs(glyphs, Hidden::OnTop);
        }
        let (true, Some(Ok(contact))) = (self.tori, &self.contact) else { return };
        for (side, local) in [&contact.a, &contact.b].into_iter().enumerate() {
            let color = linear(t.sides[side]);
            let (points, triangles) = local.patch();
            d.mesh(&points, Vec::new(), triangles, with_alpha(color, 0.45), None);
            let reach = local.torus.half[0].max(local.torus.half[1]);
            let tip = local.p + local.curvature.normal * reach;
            d.line([local.p, tip], 2.5, color, Dash::Solid, Hidden::OnTop);
            let mut arrow = GlyphData::new(d.origin);
            arrow.push_arrow(tip, local.curvature.normal, 12.0, color);
            d.glyphs(arrow, Hidden::OnTop);
        }
        d.line([contact.a.p, contact.b.p], 4.0, linear(t.warn), Dash::SHORT, Hidden::OnTop);
        let Some(tangency) = &self.tangency else { return };
        let reach = 1.5 * contact.a.torus.half[0].max(contact.a.torus.half[1]);
        // Of the at most eight binormals only those through the drawn patches mean something here.
        for line in &tangency.binormals {
            let foot = line.on[0] + line.direction * (contact.a.p - line.on[0]).dot(line.direction);
            if foot.distance(contact.a.p) < reach {
                let [from, to] = [-1.0, 1.0].map(|s| foot + line.direction * (s * reach));
                d.line([from, to], 1.5, linear(t.text[2]), Dash::LONG, Hidden::OnTop);
            }
        }
        if let Some(point) = &tangency.point {
            let mut glyphs = GlyphData::new(d.origin);
            glyphs.push(point.xyz, GlyphShape::Diamond, 11.0, linear(t.warn));
            d.glyphs(glyphs, Hidden::OnTop);
        }
    }
}

/// A sample of a line style.
pub fn swatch(painter: &Painter, from: Pos2, to: Pos2, style: Style) {
    let color = color32(style.rgb);
    let pen = Pen::new(style.width.min(3.0), color);
    match style.stroke {
        Stroke::Solid => {
            painter.line_segment([from, to], pen);
        }
        Stroke::Double => {
            for off in [-1.7, 1.7] {
                painter.line_segment([from + vec2(0.0, off), to + vec2(0.0, off)], Pen::new(1.4, color));
            }
        }
        Stroke::Dashed(on, off) => painter.extend(Shape::dashed_line(&[from, to], pen, on, off)),
    }
}

fn color32(rgb: u32) -> egui::Color32 {
    egui::Color32::from_rgb((rgb >> 16 & 255) as u8, (rgb >> 8 & 255) as u8, (rgb & 255) as u8)
}

impl Editor {
    /// Legend, colour bar and tags over the picture.
    pub fn intersect_labels(&mut self, ui: &mut Ui) {
        let Tool::Intersect(session) = &self.tool else { return };
        let Some(found) = session.found.clone() else { return };
        let t = theme::of(ui);
        let view = self.viewport.rect;
        let painter = ui.painter().with_clip_rect(view);
        let dark = ui.visuals().dark_mode;
        let entries = legend(&found);
        let of_kind =
            |kind: bool| place::distinct(&found.result.junctions).filter(|(_, j)| is_isolated(j) == kind).count();
        let [crossings, isolated] = [false, true].map(of_kind);
        let points: Vec<(&str, usize, GlyphShape)> = [
            ("Branches cross", crossings, GlyphShape::Diamond),
            ("Isolated contact", isolated, GlyphShape::Square),
            ("Miter point", found.result.miters.len(), GlyphShape::Triangle),
        ]
        .into_iter()
        .filter(|(_, n, _)| *n > 0)
        .collect();
        let rows = entries.len() + points.len();
        if rows > 0 {
            let size = vec2(206.0, 12.0 + 19.0 * rows as f32);
            let panel = Rect::from_min_size(view.left_top() + vec2(12.0, 12.0), size);
            painter.rect(panel, 6.0, t.label.gamma_multiply(0.92), Pen::new(1.0, t.border), StrokeKind::Inside);
            let font = FontId::proportional(theme::SMALL);
            let mut y = panel.top() + 15.0;
            let row = |y: f32, name: &str, count: usize| {
                painter.text(pos2(panel.left() + 52.0, y), Align2::LEFT_CENTER, name, font.clone(), t.text[0]);
                painter.text(pos2(panel.right() - 10.0, y), Align2::RIGHT_CENTER, count, font.clone(), t.text[2]);
            };
            for (class, count) in entries {
                swatch(&painter, pos2(panel.left() + 10.0, y), pos2(panel.left() + 44.0, y), class.style(dark));
                row(y, class.name(), count);
                let area = Rect::from_min_max(pos2(panel.left(), y - 9.0), pos2(panel.right(), y + 9.0));
                let response = ui.interact(area, ui.scope_id().with(("legend", class)), Sense::hover());
                response.on_hover_text(class.help());
                y += 19.0;
            }
            for (name, count, shape) in points {
                glyph(&painter, pos2(panel.left() + 27.0, y), shape, t);
                row(y, name, count);
                y += 19.0;
            }
        }
        let Tool::Intersect(session) = &self.tool else { return };
        if session.is_stale() {
            tag(&painter, t, view, view.center_top() + vec2(-60.0, 12.0), "Computing again", t.warn);
        }
        let unit = self.document().unit;
        let item_at = |item: Item| -> Option<Pos2> {
            let p: DVec3 = found.points(item).first().copied()?;
            self.viewport.project(p)
        };
        match session.focus.chosen.or(session.focus.hovered) {
            Some(item @ Item::Miter(k)) => {
                if let (Some(at), Some(m)) = (item_at(item), found.result.miters.get(k)) {
                    self.ball(&painter, t, m);
                    let text = format!("Miter point {} · ball of {}", k + 1, length(m.radius, unit));
                    tag(&painter, t, view, at + vec2(14.0, -26.0), &text, t.accent);
                }
            }
            Some(item @ Item::Junction(k)) => {
                if let (Some(at), Some(j)) = (item_at(item), found.result.junctions.get(k)) {
                    let name = crate::view::intersection::style::junction(j.kind).1;
                    let text = format!("{name} · {}", gap(j.gap, found.rounding(), &|v| length(v, unit)));
                    tag(&painter, t, view, at + vec2(14.0, -26.0), &text, t.accent);
                }
            }
            _ => {}
        }
        if session.uv_waits {
            // The uv view was drawn before its pictures were made.
            ui.ctx().request_repaint();
        }
        if let Some((kind, log, scale)) = session.color_scale() {
            bar(&painter, t, view, kind, &log, &scale, unit.symbol());
        }
    }
}

impl Editor {
    /// The ball of a miter point and the image of its quadrangle, where they are large enough to be seen.
    fn ball(&self, painter: &Painter, t: &Tokens, miter: &Miter) {
        /// Smaller than this the glyph hides them, in points.
        const LEAST: f32 = 12.0;
        let Some(center) = self.viewport.project(miter.xyz) else { return };
        let seen = DVec3::AXES.into_iter().filter_map(|d| self.viewport.project(miter.xyz + d * miter.radius));
        let radius = seen.map(|p| p.distance(center)).fold(0.0, f32::max);
        let surface = self.found_intersection().and_then(|f| f.surface(miter.a).cloned());
        let Some(surface) = surface.filter(|_| radius > LEAST) else { return };
        painter.circle_stroke(center, radius, Pen::new(1.5, t.accent));
        let corners = miter.quad.iter().chain(miter.quad.first());
        let corners: Vec<_> = corners.copied().collect();
        let along = corners.windows(2).flat_map(|e| (0..=8).map(move |i| e[0].lerp(e[1], f64::from(i) / 8.0)));
        let line = along.filter_map(|uv| self.viewport.project(surface.eval(surface.clamped(uv)))).collect();
        painter.line(line, Pen::new(2.0, t.accent));
    }
}

fn is_isolated(j: &crate::kernel::ssi::result::Junction) -> bool {
    j.kind == crate::kernel::ssi::result::JunctionKind::Isolated
}

fn glyph(painter: &Painter, at: Pos2, shape: GlyphShape, t: &Tokens) {
    let r = 5.5;
    let corners: Vec<Pos2> = match shape {
        GlyphShape::Diamond => [(0.0, -r), (r, 0.0), (0.0, r), (-r, 0.0)].map(|(x, y)| at + vec2(x, y)).to_vec(),
        GlyphShape::Square => [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| at + vec2(x, y) * 0.85).to_vec(),
        _ => [(0.0, -r), (r, 0.8 * r), (-r, 0.8 * r)].map(|(x, y)| at + vec2(x, y)).to_vec(),
    };
    painter.add(Shape::convex_polygon(corners, t.text[0], Pen::NONE));
}

/// A power of ten in few characters.
fn power(value: f64) -> String {
    let exponent = value.log10().round() as i32;
    match exponent {
        -3..=4 => format!("{}", 10.0_f64.powi(exponent)),
        _ => format!("1e{exponent}"),
    }
}

/// The colour bar of a field in steps of a factor of ten.
fn bar(painter: &Painter, t: &Tokens, view: Rect, kind: FieldKind, log: &LogScale, scale: &ColorScale, unit: &str) {
    let height = (view.height() * 0.42).clamp(140.0, 320.0);
    let bar = Rect::from_min_size(pos2(view.right() - 104.0, view.center().y - 0.5 * height), vec2(18.0, height));
    let below = if kind == FieldKind::Gap { 40.0 } else { 14.0 };
    let panel = Rect::from_min_max(bar.min - vec2(12.0, 36.0), bar.max + vec2(94.0, below)).intersect(view.shrink(4.0));
    painter.rect(panel, 6.0, t.label.gamma_multiply(0.92), Pen::new(1.0, t.border), StrokeKind::Inside);
    let small = FontId::proportional(theme::SMALL);
    let title = match (kind, unit) {
        (FieldKind::Gap, "") => "Gap".to_owned(),
        (FieldKind::Gap, unit) => format!("Gap {unit}"),
        _ => "|Su x Sv|".to_owned(),
    };
    painter.text(panel.left_top() + vec2(10.0, 9.0), Align2::LEFT_TOP, title, small.clone(), t.text[2]);
    let y_of = |v: f32| bar.bottom() - (v - scale.low) / (scale.high - scale.low) * bar.height();
    let [r, g, b, _] = crate::render::to_srgb8(scale.neutral);
    for (k, color) in scale.steps.iter().enumerate() {
        let from = scale.low + (scale.high - scale.low) * k as f32 / scale.steps.len() as f32;
        let to = scale.low + (scale.high - scale.low) * (k + 1) as f32 / scale.steps.len() as f32;
        let [r, g, b, _] = crate::render::to_srgb8(*color);
        let area = Rect::from_min_max(pos2(bar.left(), y_of(to)), pos2(bar.right(), y_of(from)));
        painter.rect_filled(area, 0.0, egui::Color32::from_rgb(r, g, b));
    }
    let label = |v: f32, text: String| {
        painter.hline(bar.right()..=bar.right() + 4.0, y_of(v), Pen::new(1.0, t.text[1]));
        painter.text(pos2(bar.right() + 7.0, y_of(v)), Align2::LEFT_CENTER, text, small.clone(), t.text[0]);
    };
    let every = log.decades.div_ceil(6);
    for (k, value) in log.borders().into_iter().enumerate().filter(|(k, _)| (log.decades - k).is_multiple_of(every)) {
        if kind == FieldKind::Gap {
            if k > 0 {
                label(k as f32, format!("+{}", power(value)));
                label(-(k as f32), format!("-{}", power(value)));
            }
        } else {
            label(k as f32, power(value));
        }
    }
    if kind == FieldKind::Gap {
        let area = Rect::from_center_size(pos2(bar.center().x, y_of(0.0)), vec2(bar.width(), 3.0));
        painter.rect_filled(area, 0.0, egui::Color32::from_rgb(r, g, b));
        let text = format!("< {}", power(log.floor()));
        painter.text(pos2(bar.right() + 7.0, y_of(0.0)), Align2::LEFT_CENTER, text, small.clone(), t.text[1]);
    }
    if kind != FieldKind::Gap {
        return;
    }
    let gap = Rect::from_min_size(pos2(bar.left(), bar.bottom() + 14.0), vec2(18.0, 10.0));
    let [r, g, b, _] = crate::render::to_srgb8(scale.no_data);
    painter.rect_filled(gap, 0.0, egui::Color32::from_rgb(r, g, b));
    painter.text(gap.right_center() + vec2(7.0, 0.0), Align2::LEFT_CENTER, "nothing near", small, t.text[1]);
}
