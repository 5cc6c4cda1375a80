//! The plane-through-a-miter-point demo (thesis Fig. 8.8): two sliders move a plane, the section follows in space and in
//! the domain.

use std::sync::Arc;

use egui::{RichText, Slider, Ui};

use super::super::editor::Editor;
use super::super::status::{length, short};
use super::super::{panels, theme};
use super::Tool;
use super::intersect::IntersectSession;
use crate::model::document::Unit;
use crate::render::{Dash, GlyphData, GlyphShape, Hidden, LineStyle, Sketch, with_alpha};
use crate::ui::viewport::linear;
use crate::view::intersection::Item;
use crate::view::intersection::plane::{Cut, Plane, cut, words};
use crate::view::uv::{UvGlyph, UvInk, UvMark, UvPicture};
use crate::work::Latest;

/// The plane and its section.
#[derive(Default)]
pub struct PlaneDemo {
    /// Where it is; none while it is off.
    pub plane: Option<Plane>,
    /// What it cuts.
    pub section: Latest<Result<Cut, String>>,
}

impl PlaneDemo {
    /// The section, when there is one.
    fn cut(&self) -> Option<&Cut> {
        self.plane?;
        self.section.value()?.as_ref().ok()
    }

    /// Draws the plane and the section.
    pub fn draw(&self, d: &mut Sketch, t: &theme::Tokens) {
        let Some(cut) = self.cut() else { return };
        let strength = if self.section.is_stale() { 0.35 } else { 1.0 };
        let color = linear(t.warn);
        d.mesh(&cut.corners, Vec::new(), vec![[0, 1, 2], [0, 2, 3]], with_alpha(color, 0.22), None);
        let [a, b, c, e] = cut.corners;
        d.line([a, b, c, e, a], 1.2, with_alpha(color, 0.8), Dash::Solid, Hidden::Dashed);
        let style =
            LineStyle { width: 4.0, color: with_alpha(color, strength), dash: Dash::Solid, hidden: Hidden::OnTop };
        d.polylines(cut.section.curves.iter().map(|c| c.xyz.iter().copied()), style);
        let mut glyphs = GlyphData::new(d.origin);
        for p in &cut.section.crossings {
            glyphs.push(p.xyz, GlyphShape::Diamond, 12.0, with_alpha(color, strength));
        }
        d.glyphs(glyphs, Hidden::OnTop);
    }

    /// Adds the section to the picture of its surface.
    pub fn mark(&self, session: &IntersectSession, all: &mut [UvPicture]) {
        let (Some(cut), Some(plane), Some(found)) = (self.cut(), self.plane, &session.found) else { return };
        let entity = found.result.miters.get(plane.miter).and_then(|m| found.id(m.a));
        let Some(picture) = all.iter_mut().find(|p| Some(p.entity) == entity) else { return };
        for curve in &cut.section.curves {
            picture.marks.push(UvMark::polyline(curve.uv.clone()).ink(UvInk::Warn).label("Section"));
        }
        for p in &cut.section.crossings {
            for at in [p.uv, p.st] {
                picture.marks.push(UvMark::point(at, UvGlyph::Diamond).ink(UvInk::Warn));
            }
        }
    }
}

impl Editor {
    /// The sliders, while a miter point is chosen.
    pub fn plane_panel(&mut self, ui: &mut Ui, unit: Unit) {
        let Tool::Intersect(session) = &mut self.tool else { return };
        let Some(Item::Miter(miter)) = session.chosen() else { return };
        let Some(found) = session.found.clone() else { return };
        let t = theme::of(ui);
        panels::heading(ui, "Plane through the miter point");
        let mut plane = session.demo.plane.filter(|p| p.miter == miter);
        let mut on = plane.is_some();
        let help = "Cuts the surface near the miter point; planes that contain its tangent give the three types of \
                    thesis Fig. 8.8";
        if ui.checkbox(&mut on, "Cut with a plane").on_hover_text(help).changed() {
            plane = on.then_some(Plane { miter, tilt: 0.0, offset: 0.5 });
        }
        if let Some(plane) = &mut plane {
            ui.spacing_mut().slider_width = 150.0;
            let tilt = Slider::new(&mut plane.tilt, -90.0..=90.0).suffix("°").text("tilt");
            ui.add(tilt).accessible_name("Tilt of the plane");
            let offset = Slider::new(&mut plane.offset, -1.0..=1.0).text("offset").custom_formatter(|v, _| short(v));
            ui.add(offset).accessible_name("Offset of the plane");
            ui.horizontal_wrapped(|ui| {
                if ui.button("Through the point").clicked() {
                    plane.offset = 0.0;
                }
                let tilts = match session.demo.section.value() {
                    Some(Ok(cut)) => cut.section.parabolic_tilts.clone(),
                    _ => Vec::new(),
                };
                for tilt in tilts {
                    let text = format!("Parabolic at {:.1}°", tilt.to_degrees());
                    if ui.button(text).on_hover_text("Where elliptic sections end and hyperbolic ones begin").clicked()
                    {
                        plane.tilt = tilt.to_degrees();
                    }
                }
            });
            match session.demo.section.value() {
                Some(Ok(cut)) => {
                    let text = format!("{}, {} from the point", words(cut), length(cut.offset, unit));
                    ui.add(egui::Label::new(RichText::new(text).color(t.text[2])).wrap());
                }
                Some(Err(why)) => {
                    ui.add(egui::Label::new(RichText::new(why).color(t.warn)).wrap());
                }
                None => {
                    ui.spinner();
                }
            }
        }
        ui.add_space(6.0);
        if plane != session.demo.plane {
            session.demo.plane = plane;
            match plane {
                Some(plane) => {
                    let found = Arc::clone(&found);
                    let name = "Cut the miter point with a plane";
                    session
                        .demo
                        .section
                        .request(&mut self.jobs, name, format!("{plane:?}"), move |job| cut(&found, plane, job));
                }
                None => session.demo.section.clear(),
            }
            session.changed();
        }
    }
}
