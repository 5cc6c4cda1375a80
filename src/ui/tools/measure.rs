//! The Measure tool: two clicks, and what lies between them. The numbers come from [`crate::view::measure`].

use egui::{RichText, Ui, vec2};
use glam::DVec3;

use super::super::editor::{Editor, Page};
use super::super::status::{length, short};
use super::super::viewport::{Overlay, Pointer, linear, tag};
use super::super::{app, panels, theme};
use super::{Tool, fresh};
use crate::model::document::Unit;
use crate::render::{Dash, GlyphData, GlyphShape, Hidden, Sketch, with_alpha};
use crate::view::measure::{Measurement, Place, Span, measure};
use crate::view::pick::{Filter, PickHit, Target};
use crate::view::snap::{Snap, SnapOptions};

/// The number under which the tool's own things are kept on the graphics card.
const OWN: u64 = u64::MAX - 16;

/// The tool at work.
#[derive(Default)]
pub struct MeasureSession {
    places: Vec<(Place, String)>,
    found: Option<Measurement>,
    snap: Option<Snap>,
    hover: Option<DVec3>,
    /// Changes whenever something to draw does.
    pub revision: u64,
}

/// What the tool lets one pick.
pub const FILTER: Filter = Filter { points: false, iso_lines: true, ..Filter::ALL };

impl Editor {
    /// Starts measuring.
    pub fn start_measure(&mut self) {
        self.leave_tool();
        // What an earlier session has drawn must not pass for what this one draws.
        let revision = fresh() << 24;
        self.tool = Tool::Measure(Box::new(MeasureSession { revision, ..MeasureSession::default() }));
        self.show_page(Page::Tool);
    }

    /// The status line's text.
    pub fn measure_prompt(session: &MeasureSession) -> (String, String, String) {
        let prompt = match session.places.len() {
            0 => "Click the first point, curve or surface",
            1 => "Click the second point, curve or surface",
            _ => "Click again to measure anew",
        };
        ("Measure".to_owned(), prompt.to_owned(), "Ctrl suspends snapping · Backspace undo pick · Esc leave".to_owned())
    }

    /// Its keys.
    pub fn measure_keys(&mut self, ctx: &egui::Context) {
        let taken = |key| ctx.input_mut(|i| app::take_key(i, egui::Modifiers::NONE, key));
        let Tool::Measure(session) = &mut self.tool else { return };
        if taken(egui::Key::Backspace) {
            session.undo_pick();
        }
        if taken(egui::Key::Escape) {
            if session.places.is_empty() { self.leave_tool() } else { session.clear() }
        }
    }

    /// What the mouse did.
    pub fn measure_pointer(&mut self, pointer: &Pointer) {
        let joining = self.document().tolerances().joining;
        let filter = FILTER.and(self.pickable);
        let snap =
            pointer.pixel.and_then(|at| self.viewport.snap(at, filter, &SnapOptions::new(joining), pointer.held.ctrl));
        let hover = snap.as_ref().map(|s| s.point).or(pointer.hover.map(|h| h.point));
        let clicked = pointer.click.and_then(|(hit, _)| {
            let place = place(snap.as_ref(), hit.as_ref())?;
            let name = self.place_name(&place, snap.as_ref());
            Some((place, name))
        });
        let Tool::Measure(session) = &mut self.tool else { return };
        if session.snap != snap || session.hover != hover {
            (session.snap, session.hover) = (snap, hover);
            session.revision += 1;
        }
        let Some(picked) = clicked else { return };
        if session.places.len() > 1 {
            session.clear();
        }
        session.places.push(picked);
        session.revision += 1;
        if let [(first, _), (second, _)] = &session.places[..] {
            session.found = Some(measure(&self.viewport.scene, first, second));
        }
    }

    fn place_name(&self, place: &Place, snap: Option<&Snap>) -> String {
        let target = place.on.unwrap_or(Target::Point(0));
        let hit = PickHit { target, point: place.point, distance: 0.0, depth: 0.0, hidden: false };
        let name = self.hit_name(&hit).unwrap_or_else(|| "point".to_owned());
        snap.map_or(name.clone(), |s| format!("{} of {name}", s.kind.label()))
    }

    /// The Tool page.
    pub fn measure_panel(&mut self, ui: &mut Ui) {
        let unit = self.document().unit;
        let t = theme::of(ui);
        let Tool::Measure(session) = &mut self.tool else { return };
        panels::heading(ui, "Measure");
        if session.places.is_empty() {
            let text = "Click two places. Between two points: their distance. A second click on a surface: how far the first \
                        place is from it. Two curves: the gap between them.";
            ui.add(egui::Label::new(RichText::new(text).color(t.text[1])).wrap());
            return;
        }
        let table = |id: &str| egui::Grid::new(id).num_columns(2).spacing([10.0, 4.0]);
        table("measured places").show(ui, |ui| {
            for (title, (place, name)) in ["First", "Second"].into_iter().zip(&session.places) {
                panels::property(ui, title, name.clone());
                panels::property(ui, "", coordinates(place.point, unit));
            }
        });
        let Some(found) = session.found.clone() else { return };
        ui.add_space(8.0);
        table("measured").show(ui, |ui| {
            for (name, value) in rows(&found, unit) {
                panels::property(ui, &name, value);
            }
        });
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            if ui.button("Copy").on_hover_text("Put the numbers on the clipboard, in full precision").clicked() {
                ui.ctx().copy_text(full(&session.places, &found));
            }
            if ui.button("Measure anew").clicked() {
                session.clear();
            }
        });
    }

    /// The labels over the picture.
    pub fn measure_labels(&mut self, ui: &Ui, pointer: &Pointer) {
        let unit = self.document().unit;
        let t = theme::of(ui);
        let painter = ui.painter().with_clip_rect(self.viewport.rect);
        let Tool::Measure(session) = &self.tool else { return };
        if let (Some(snap), Some(pixel)) = (&session.snap, pointer.pixel) {
            let at = self.viewport.to_window(pixel) + vec2(16.0, -30.0);
            tag(&painter, t, self.viewport.rect, at, snap.kind.label(), t.accent);
        }
        let label = |span: &Span, text: String, color| {
            if let Some(at) = self.viewport.project(0.5 * (span.from + span.to)) {
                tag(&painter, t, self.viewport.rect, at + vec2(8.0, -10.0), &text, color);
            }
        };
        let Some(found) = &session.found else { return };
        label(&found.places, length(found.places.length(), unit), t.accent);
        if let Some(span) = &found.to_surface {
            label(span, format!("{} to the surface", length(span.length(), unit)), t.good);
        }
        if let Some([least, largest]) = &found.gap {
            label(least, format!("least {}", length(least.length(), unit)), t.good);
            label(largest, format!("largest {}", length(largest.length(), unit)), t.warn);
        }
    }
}

/// Where a click is: the snap goes before what is under the cursor.
fn place(snap: Option<&Snap>, hit: Option<&PickHit>) -> Option<Place> {
    match (snap, hit) {
        (Some(snap), _) => {
            let on = snap.on.first().map(|&(curve, t)| Target::Curve { curve, t });
            Some(Place { point: snap.point, on })
        }
        (None, Some(hit)) => Some(Place { point: hit.point, on: Some(hit.target) }),
        (None, None) => None,
    }
}

fn coordinates(p: DVec3, unit: Unit) -> String {
    let [x, y, z] = p.to_array().map(short);
    format!("{x}, {y}, {z} {}", unit.symbol()).trim_end().to_owned()
}

/// The result for people.
fn rows(found: &Measurement, unit: Unit) -> Vec<(String, String)> {
    let mut rows = vec![("Distance".to_owned(), length(found.places.length(), unit))];
    let apart = found.places.to - found.places.from;
    for (axis, value) in ["Δx", "Δy", "Δz"].into_iter().zip(apart.to_array()) {
        rows.push((axis.to_owned(), length(value, unit)));
    }
    if let Some(span) = &found.to_surface {
        rows.push(("First to surface".to_owned(), length(span.length(), unit)));
    }
    if let Some([least, largest]) = &found.gap {
        rows.push(("Least gap".to_owned(), length(least.length(), unit)));
        rows.push(("Largest gap".to_owned(), length(largest.length(), unit)));
    }
    if let Some(angle) = found.angle {
        rows.push(("Angle".to_owned(), format!("{}°", short(angle))));
    }
    rows
}

/// The result for other programs.
fn full(places: &[(Place, String)], found: &Measurement) -> String {
    let mut lines: Vec<String> = places
        .iter()
        .map(|(place, name)| {
            let [x, y, z] = place.point.to_array();
            format!("{name}\t{x:e}\t{y:e}\t{z:e}")
        })
        .collect();
    lines.push(format!("distance\t{:e}", found.places.length()));
    lines.extend(found.to_surface.map(|s| format!("first to surface\t{:e}", s.length())));
    if let Some([least, largest]) = found.gap {
        lines.push(format!("least gap\t{:e}\nlargest gap\t{:e}", least.length(), largest.length()));
    }
    lines.extend(found.angle.map(|a| format!("angle in degrees\t{a:e}")));
    lines.join("\n")
}

impl MeasureSession {
    fn clear(&mut self) {
        self.places.clear();
        self.found = None;
        self.revision += 1;
    }

    fn undo_pick(&mut self) {
        self.places.pop();
        self.found = None;
        self.revision += 1;
    }

    /// What was measured last.
    pub fn found(&self) -> Option<&Measurement> {
        self.found.as_ref()
    }

    /// What the tool adds to the picture.
    pub fn overlay(&self, dark: bool) -> Overlay {
        let t = theme::tokens(dark);
        let origin = self.places.first().map_or(DVec3::ZERO, |(place, _)| place.point);
        let mut sketch = Sketch::new(OWN, self.revision, origin);
        let (accent, good, warn) = (linear(t.accent), linear(t.good), linear(t.warn));
        if let (Some((first, _)), Some(to), None) = (self.places.first(), self.hover, &self.found) {
            sketch.line([first.point, to], 2.0, with_alpha(accent, 0.7), Dash::SHORT, Hidden::OnTop);
        }
        if let Some(found) = &self.found {
            let mut span = |s: &Span, color, dash| sketch.line([s.from, s.to], 2.5, color, dash, Hidden::OnTop);
            span(&found.places, accent, Dash::Solid);
            if let Some(foot) = &found.to_surface {
                span(foot, good, Dash::Solid);
            }
            if let Some([least, largest]) = &found.gap {
                span(least, good, Dash::Solid);
                span(largest, warn, Dash::Solid);
            }
        }
        let mut marks = GlyphData::new(sketch.origin);
        for (place, _) in &self.places {
            marks.push(place.point, GlyphShape::Round, 9.0, accent);
        }
        if let Some(snap) = &self.snap {
            marks.push(snap.point, GlyphShape::Square, 12.0, accent);
        }
        if !marks.glyphs.is_empty() {
            sketch.glyphs(marks, Hidden::OnTop);
        }
        let iso_lines = true;
        Overlay { revision: self.revision, calm: true, iso_lines, ..Overlay::of(sketch) }
    }
}
