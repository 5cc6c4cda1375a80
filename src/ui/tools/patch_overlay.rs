//! What the patch tool draws into the view: sides with arrows and numerals, the live preview, sample dots, the
//! deviation map.

use std::sync::Arc;

use egui::{Align2, Color32, FontId, Stroke, Ui, vec2};
use glam::DVec3;

use super::super::editor::Editor;
use super::super::theme;
use super::super::viewport::{Overlay, Pointer, linear, tag};
use super::Tool;
use super::patch::PatchSession;
use crate::kernel::heal::grid::Grid;
use crate::kernel::heal::project::Status;
use crate::kernel::mesh::tessellate::SurfaceMesh;
use crate::render::{Color, ColorScale, Dash, Field, GlyphData, GlyphShape, Hidden, LineStyle, Sketch, with_alpha};
use crate::view::colormap;
use crate::view::feature_edges::{EdgeKind, EdgePiece, LinePattern};
use crate::view::patch_tool::{Mode, Stage};
use crate::view::pick::{PickHit, Target};
use crate::view::scene::{Item, Scene};

/// The number under which the tool's own things are kept on the graphics card.
const OWN: u64 = u64::MAX;

fn add_grid(d: &mut Sketch, grid: &Grid<DVec3>, color: Color) {
    let row = (grid.m() + 1) as u32;
    let triangles = cells(grid.m(), grid.n()).flat_map(|(i, j)| {
        let a = j * row + i;
        [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
    });
    d.mesh(grid.values(), Vec::new(), triangles.collect(), color, None);
}

fn cells(m: usize, n: usize) -> impl Iterator<Item = (u32, u32)> {
    (0..n as u32).flat_map(move |j| (0..m as u32).map(move |i| (i, j)))
}

/// The polyline of a curve that was hit.
fn hit_curve(scene: &Scene, hit: &PickHit) -> Option<Vec<DVec3>> {
    let Target::Curve { curve, .. } = hit.target else { return None };
    let display = scene.curve_item(&curve)?.display.as_ref()?;
    display.curves.iter().find(|c| c.curve == curve).map(|c| c.points.clone())
}

/// The part of a drawn curve that an edge is.
fn stretch(scene: &Scene, piece: &EdgePiece) -> Vec<DVec3> {
    let Some(item) = scene.curve_item(&piece.curve).filter(|item| item.visible()) else { return Vec::new() };
    let at = |t: f64| item.geometry.curve_jet(&piece.curve, t).map(|jet| jet[0]);
    let [from, to] = piece.range;
    let drawn = item.display.as_ref().and_then(|d| d.curves.iter().find(|c| c.curve == piece.curve));
    let inner: Vec<DVec3> = match drawn {
        Some(c) => c.t.iter().zip(&c.points).filter(|(t, _)| from < **t && **t < to).map(|(_, p)| *p).collect(),
        // A crease is not always among the iso-lines that are drawn.
        None => (1..24).filter_map(|k| at(from + (to - from) * f64::from(k) / 24.0)).collect(),
    };
    at(from).into_iter().chain(inner).chain(at(to)).collect()
}

/// The point half-way along a polyline, and the direction there.
fn middle(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let total: f64 = points.windows(2).map(|p| p[0].distance(p[1])).sum();
    let mut left = 0.5 * total;
    for pair in points.windows(2) {
        let step = pair[0].distance(pair[1]);
        if left <= step && step > 0.0 {
            return Some((pair[0].lerp(pair[1], left / step), pair[1] - pair[0]));
        }
        left -= step;
    }
    points.first().map(|p| (*p, DVec3::X))
}

impl PatchSession {
    /// What to draw now.
    pub fn overlay(&self, scene: &Scene, dark: bool) -> Overlay {
        let t = theme::tokens(dark);
        let bounds = scene.items().first().map(|i| i.bounds.center());
        let revision = self.revision << 1 | u64::from(dark);
        let mut d = Sketch::new(OWN, revision, bounds.unwrap_or_default());
        let picking = matches!(self.tool.stage(), Stage::Side(_));
        if picking {
            self.candidates(&mut d, scene);
        }
        self.preview_surface(&mut d, t);
        self.result_surface(&mut d, t, revision);
        for (_, points) in self.tool.reusable() {
            d.line(points, 2.0, linear(t.accent), Dash::LONG, Hidden::Dashed);
        }
        let mut arrows = GlyphData::new(d.origin);
        for side in 0..4 {
            let Some(points) = self.tool.line(side) else { continue };
            let color = linear(t.sides[side]);
            let active = self.tool.stage() == Stage::Side(side);
            if let Some((at, direction)) =
                points.get(points.len() / 5).zip(points.get(points.len() / 5 + 1)).map(|(a, b)| (*a, *b - *a))
            {
                arrows.push_arrow(at, direction, 15.0, color);
            }
            let at = points.len() - 1 - points.len() / 5;
            if at > 0 {
                arrows.push_arrow(points[at], points[at] - points[at - 1], 15.0, color);
            }
            for piece in &self.tool.sides()[side].pieces {
                for end in piece.ends() {
                    arrows.push(end, GlyphShape::Round, if active { 8.0 } else { 6.0 }, color);
                }
            }
            let width = if active { 4.5 } else { 3.5 };
            d.line(points, width, color, Dash::Solid, Hidden::Dashed);
        }
        for corner in self.tool.corners() {
            let color = linear(if corner.is_settled() { t.good } else { t.warn });
            arrows.push(corner.point(), GlyphShape::Ring, 13.0, color);
            if !corner.is_settled() {
                d.line(corner.ends, 2.5, color, Dash::SHORT, Hidden::OnTop);
            }
        }
        d.glyphs(arrows, Hidden::OnTop);
        if picking {
            self.cursor(&mut d, scene, t);
        }
        let ghost = self.tool.stage() == Stage::Result;
        Overlay { revision, mute: true, iso_lines: picking, ghost, ..Overlay::of(d) }
    }

    /// The edges of the model by what they are, in colour and stroke.
    fn candidates(&self, d: &mut Sketch, scene: &Scene) {
        let Some(edges) = self.edges() else { return };
        for kind in EdgeKind::ALL {
            // What the user has hidden meanwhile goes with its edges.
            let shown = |p: &&EdgePiece| scene.curve_item(&p.curve).is_some_and(Item::visible);
            let pieces = edges.pieces.iter().filter(|p| p.kind == kind).filter(shown);
            let lines = pieces.map(|piece| stretch(scene, piece)).filter(|points| points.len() > 1);
            let ([r, g, b], pattern) = kind.style();
            let [r, g, b] = colormap::linear([r, g, b]);
            let (width, dash) = match pattern {
                LinePattern::Solid => (2.5, Dash::Solid),
                LinePattern::Thin => (1.2, Dash::Solid),
                LinePattern::Double => (4.0, Dash::Double),
                LinePattern::ShortDash => (3.0, Dash::SHORT),
            };
            d.polylines(lines, LineStyle { width, color: [r, g, b, 1.0], dash, hidden: Hidden::Dashed });
        }
    }

    fn cursor(&self, d: &mut Sketch, scene: &Scene, t: &theme::Tokens) {
        let current = match self.tool.stage() {
            Stage::Side(side) => linear(t.sides[side]),
            _ => linear(t.accent),
        };
        if let Some([first, second]) = self.tool.iso_choice(scene) {
            d.line(first.points, 4.0, current, Dash::Solid, Hidden::Dashed);
            d.line(second.points, 2.5, current, Dash::LONG, Hidden::Dashed);
        } else if let Some(points) = self.hover.as_ref().and_then(|hit| hit_curve(scene, hit)) {
            d.line(points, 3.0, with_alpha(current, 0.85), Dash::Solid, Hidden::Dashed);
        }
        if let Mode::Line(points) | Mode::Polyline(points) | Mode::Draw(points) = self.tool.mode() {
            let mut all = points.clone();
            all.extend(self.snap.as_ref().map(|s| s.point).or(self.hover.map(|h| h.point)));
            if all.len() > 1 {
                d.line(all.clone(), 3.0, current, Dash::SHORT, Hidden::OnTop);
            }
            let mut dots = GlyphData::new(d.origin);
            for p in all {
                dots.push(p, GlyphShape::Round, 8.0, current);
            }
            d.glyphs(dots, Hidden::OnTop);
        }
        if let Some(snap) = &self.snap {
            let mut mark = GlyphData::new(d.origin);
            mark.push(snap.point, GlyphShape::Square, 12.0, linear(t.accent));
            d.glyphs(mark, Hidden::OnTop);
        }
    }

    fn preview_surface(&self, d: &mut Sketch, t: &theme::Tokens) {
        let Some(preview) = self.tool.preview() else { return };
        let row = (crate::view::patch_tool::preview::CELLS + 1) as u32;
        let folded: Vec<[u32; 3]> = preview
            .folds
            .iter()
            .flat_map(|&[i, j]| {
                let a = j as u32 * row + i as u32;
                [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
            })
            .collect();
        let good = preview.triangles().into_iter().filter(|t| !folded.contains(t)).collect();
        d.mesh(&preview.points, Vec::new(), good, with_alpha(linear(t.accent), 0.38), None);
        d.mesh(&preview.points, Vec::new(), folded, with_alpha(linear(t.bad), 0.6), None);
        if !self.tool.is_loop() {
            return;
        }
        let Some(Some(sketch)) = self.sketch.value() else { return };
        if self.show_slab {
            for side in [1.0, -1.0] {
                let ghost = Grid::from_fn(sketch.grid.m(), sketch.grid.n(), |i, j| {
                    sketch.grid[(i, j)] + sketch.normals[(i, j)] * (side * sketch.slab)
                });
                add_grid(d, &ghost, with_alpha(linear(t.warn), 0.2));
            }
        }
        let Some(samples) = &sketch.samples else { return };
        let mut dots = GlyphData::new(d.origin);
        // While a newer sketch is on its way the old one is shown greyed.
        let fade = |color| if self.sketch.is_stale() { with_alpha(color, 0.35) } else { color };
        for j in 0..=samples.n() {
            for i in 0..=samples.m() {
                match &samples[(i, j)] {
                    Some(s) if s.status == Status::Several => {
                        dots.push(s.point, GlyphShape::Ring, 7.0, fade(linear(t.accent)));
                    }
                    Some(s) => {
                        dots.push(s.point, GlyphShape::Round, 5.0, fade(linear(t.good)));
                    }
                    None => {
                        dots.push(sketch.grid[(i, j)], GlyphShape::Cross, 7.5, fade(linear(t.bad)));
                    }
                }
            }
        }
        d.glyphs(dots, Hidden::OnTop);
    }

    fn result_surface(&self, d: &mut Sketch, t: &theme::Tokens, revision: u64) {
        let Some(shown) = self.shown.as_ref().filter(|_| self.tool.stage() == Stage::Result) else { return };
        let SurfaceMesh { points, normals, triangles, .. } = &shown.mesh;
        let field = self.tool.shows_deviation().then(|| Field {
            revision,
            values: Arc::new(shown.deviation.values.clone()),
            scale: Arc::new(self.scale()),
        });
        let normals = normals.iter().map(|n| n.as_vec3().to_array()).collect();
        d.mesh(points, normals, triangles.to_vec(), linear(t.good), field);
        let mut marks = GlyphData::new(d.origin);
        for (point, status) in &shown.samples {
            if *status == Status::Artificial {
                marks.push(*point, GlyphShape::Cross, 6.0, linear(t.text[1]));
            }
        }
        for check in &shown.worst {
            marks.push(check.point, GlyphShape::Diamond, 13.0, linear(t.warn));
        }
        d.glyphs(marks, Hidden::OnTop);
    }

    /// The colours of the deviation map.
    pub fn scale(&self) -> ColorScale {
        ColorScale::deviation(self.range.high as f32, self.tool.options().tol as f32)
    }
}

impl Editor {
    /// Numerals, corner gaps and labels over the picture.
    pub fn patch_labels(&mut self, ui: &mut Ui, pointer: &Pointer) {
        let Tool::Patch(session) = &self.tool else { return };
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.viewport.rect);
        let at = |p: DVec3| self.viewport.project(p);
        for side in 0..4 {
            let Some((p, _)) = session.tool.line(side).and_then(|points| middle(&points)) else { continue };
            let Some(p) = at(p) else { continue };
            painter.circle(p, 10.0, t.sides[side], Stroke::new(1.5, t.label));
            painter.text(
                p,
                Align2::CENTER_CENTER,
                side + 1,
                FontId::proportional(13.0),
                Color32::from_rgb(0x0d, 0x10, 0x14),
            );
        }
        for corner in session.tool.corners().iter().filter(|c| !c.is_settled()) {
            if let Some(p) = at(corner.point()) {
                let text = format!("Gap {}", session.tool.length(corner.gap));
                tag(&painter, t, self.viewport.rect, p + vec2(12.0, -26.0), &text, t.warn);
            }
        }
        if let Some(shown) = session.shown.as_ref().filter(|_| session.tool.stage() == Stage::Result) {
            for (k, check) in shown.worst.iter().enumerate() {
                if let Some(p) = at(check.point) {
                    painter.text(
                        p + vec2(9.0, -8.0),
                        Align2::LEFT_BOTTOM,
                        k + 1,
                        FontId::proportional(13.0),
                        t.text[2],
                    );
                }
            }
        }
        if let (Some(snap), Some(pixel)) = (&session.snap, pointer.pixel) {
            let p = self.viewport.to_window(pixel) + vec2(16.0, -30.0);
            tag(&painter, t, self.viewport.rect, p, snap.kind.label(), t.accent);
        }
        self.legend(ui);
    }
}
