//! The tools: what a click in the view means, what the status line says, what the Tool page shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use egui::{Order, Ui, vec2};
use glam::{DVec2, DVec3};

use super::editor::Editor;
use super::hints::{CurveHint, SurfaceHint};
use super::panels::uv::UvPointer;
use super::viewport::{Overlay, Pointer, curve_name};
use super::{status, theme};
use crate::view::display::Geometry;
use crate::view::intersection::Task;
use crate::view::patch_tool::{Event, Stage};
use crate::view::pick::{Filter, PickHit, Target};
use crate::view::uv::UvPicture;
use crate::work::Ticket;

mod filter_bar;
mod inspect;
mod inspect_labels;
mod inspect_overlay;
mod inspect_panel;
mod inspect_search;
mod inspect_search_labels;
mod inspect_search_panel;
mod inspect_subject;
mod intersect;
mod intersect_overlay;
mod intersect_panel;
mod intersect_plane;
mod intersect_uv;
mod legend;
mod measure;
mod patch;
mod patch_overlay;
mod patch_panel;
mod select;

use inspect::InspectSession;
pub use inspect::Look;
use intersect::IntersectSession;
use measure::MeasureSession;
use patch::PatchSession;

/// The active tool.
pub enum Tool {
    /// Clicks select entities.
    Select,
    /// Four sides are picked and healed.
    Patch(Box<PatchSession>),
    /// Hierarchies are looked into.
    Inspect(Box<InspectSession>),
    /// Surfaces are intersected with each other or with themselves.
    Intersect(Box<IntersectSession>),
    /// Two places are measured.
    Measure(Box<MeasureSession>),
}

/// A number that no other call returns: what one session has put on the graphics card must not pass for what the next
/// one draws.
fn fresh() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// The list of everything under the cursor, opened by Alt+click.
pub struct PickList {
    at: egui::Pos2,
    hits: Vec<PickHit>,
}

impl Editor {
    /// The status line's left part: the tool, what to do now, and the keys.
    pub fn prompt(&self) -> (String, String, String) {
        match &self.tool {
            Tool::Select => {
                let ids = self.selection.ids();
                let prompt = match ids.len() {
                    _ if self.files.is_opening() => "Reading the file".to_owned(),
                    _ if self.document().entities().is_empty() => "Open a file, or drop one on the window".to_owned(),
                    0 => "Click an entity".to_owned(),
                    1 => self.document().get(ids[0]).map_or(String::new(), |e| format!("{} selected", e.name)),
                    n => format!("{n} entities selected"),
                };
                let keys = "P new patch · Shift add · F frame · H hide · Ctrl+K find command";
                ("Select".to_owned(), prompt, keys.to_owned())
            }
            Tool::Patch(session) => {
                let text = session.tool.prompt();
                let mut parts = text.splitn(3, " · ").map(str::to_owned);
                let mut next = || parts.next().unwrap_or_default();
                (next(), next(), next())
            }
            Tool::Inspect(_) => self.inspect_prompt(),
            Tool::Intersect(session) => Self::intersect_prompt(session),
            Tool::Measure(session) => Self::measure_prompt(session),
        }
    }

    /// Keys of the active tool.
    pub fn tool_keys(&mut self, ctx: &egui::Context) {
        if self.pick_list.is_some()
            && ctx.input_mut(|i| super::app::take_key(i, egui::Modifiers::NONE, egui::Key::Escape))
        {
            self.pick_list = None;
        }
        match self.tool {
            Tool::Select => {}
            Tool::Patch(_) => self.patch_keys(ctx),
            Tool::Inspect(_) => self.inspect_keys(ctx),
            Tool::Intersect(_) => self.intersect_keys(ctx),
            Tool::Measure(_) => self.measure_keys(ctx),
        }
    }

    /// Esc, when the active tool had no use for it: stops a job, then selects nothing.
    pub fn escape(&mut self) {
        let active = self.jobs.active();
        match active.iter().rfind(|job| job.lane == crate::work::Lane::Heavy) {
            Some(job) => {
                self.jobs.cancel(job.id);
                self.say(format!("Stopping {}", job.name));
            }
            None => self.selection.clear(),
        }
    }

    /// Leaves the active tool.
    pub fn leave_tool(&mut self) {
        match &self.tool {
            Tool::Select | Tool::Inspect(_) | Tool::Measure(_) => {}
            Tool::Patch(session) => session.healing.iter().for_each(Ticket::cancel),
            Tool::Intersect(session) => session.running.iter().for_each(Ticket::cancel),
        }
        self.tool = Tool::Select;
        self.pick_list = None;
    }

    /// What the intersection tool intersects, while it is on.
    pub fn intersect_task(&self) -> Option<Task> {
        match &self.tool {
            Tool::Intersect(session) => Some(session.picks.task),
            _ => None,
        }
    }

    /// Takes over what the tools' workers have made. True when a heal has ended.
    pub fn poll_tool(&mut self) -> bool {
        self.poll_inspect();
        self.poll_intersect();
        self.poll_patch()
    }

    /// The Tool page.
    pub fn tool_panel(&mut self, ui: &mut Ui) {
        match &self.tool {
            Tool::Select => self.select_panel(ui),
            Tool::Patch(_) => self.patch_panel(ui),
            Tool::Inspect(_) => self.inspect_panel(ui),
            Tool::Intersect(_) => self.intersect_panel(ui),
            Tool::Measure(_) => self.measure_panel(ui),
        }
    }

    /// What the active tool lets one pick, the points that it offers, and a number that changes with them.
    pub fn tool_filter(&self) -> (Filter, Vec<DVec3>, u64) {
        match &self.tool {
            Tool::Select => (Filter::ALL.and(self.pickable), Vec::new(), 0),
            Tool::Patch(session) => (session.tool.filter().and(self.pickable), Vec::new(), session.revision),
            Tool::Inspect(_) => (Filter::SURFACES.and(self.pickable), Vec::new(), 1),
            Tool::Intersect(session) => {
                (Filter::SURFACES.and(self.pickable), Vec::new(), u64::from(session.found.is_some()))
            }
            Tool::Measure(_) => (measure::FILTER.and(self.pickable), Vec::new(), 2),
        }
    }

    /// What the active tool adds to the picture.
    pub fn tool_overlay(&mut self, dark: bool) -> Overlay {
        match &mut self.tool {
            Tool::Select => Overlay::default(),
            Tool::Patch(session) => {
                session.follow(self.history.revision());
                session.overlay(&self.viewport.scene, dark)
            }
            Tool::Inspect(session) => session.overlay(dark),
            Tool::Intersect(session) => {
                session.refresh_uv(dark);
                session.overlay(&self.viewport.scene, dark)
            }
            Tool::Measure(session) => session.overlay(dark),
        }
    }

    /// What the active tool shows in the uv view, one picture a surface, at most two at once; nothing: the plain
    /// domains of what is selected. It is asked every frame, so a tool keeps its pictures.
    pub fn tool_uv(&self) -> Vec<Arc<UvPicture>> {
        match &self.tool {
            Tool::Select | Tool::Patch(_) | Tool::Measure(_) => Vec::new(),
            Tool::Inspect(session) => session.pictures.clone(),
            Tool::Intersect(session) => session.uv_pictures(),
        }
    }

    /// What the mouse did in the uv view, for the active tool; nothing while it is elsewhere. Marks are known by the
    /// numbers that the tool gave them.
    pub fn tool_uv_pointer(&mut self, pointer: Option<&UvPointer>) {
        match &self.tool {
            // They mark nothing there.
            Tool::Select | Tool::Patch(_) | Tool::Measure(_) => {}
            Tool::Inspect(_) => self.inspect_uv_pointer(pointer),
            Tool::Intersect(_) => self.intersect_uv_pointer(pointer),
        }
    }

    /// What the mouse did, for the active tool.
    pub fn tool_pointer(&mut self, pointer: &Pointer) {
        if let (Some(hits), Some(pixel)) = (&pointer.list, pointer.pixel) {
            self.pick_list = Some(PickList { at: self.viewport.to_window(pixel), hits: hits.clone() });
            return;
        }
        if pointer.click.is_some() && self.pick_list.take().is_some() {
            return;
        }
        match &self.tool {
            Tool::Select => self.select_click(pointer),
            Tool::Patch(_) => self.patch_pointer(pointer),
            Tool::Inspect(_) => self.inspect_pointer(pointer),
            Tool::Intersect(_) => self.intersect_pointer(pointer),
            Tool::Measure(_) => self.measure_pointer(pointer),
        }
    }

    /// Draws the active tool's labels over the picture.
    pub fn tool_labels(&mut self, ui: &mut Ui, pointer: &Pointer) {
        match self.tool {
            Tool::Select => {}
            Tool::Patch(_) => self.patch_labels(ui, pointer),
            Tool::Inspect(_) => self.inspect_labels(ui, pointer),
            Tool::Intersect(_) => self.intersect_labels(ui),
            Tool::Measure(_) => self.measure_labels(ui, pointer),
        }
        self.filter_bar(ui);
        self.show_pick_list(ui);
    }

    fn show_pick_list(&mut self, ui: &Ui) {
        let Some(list) = &self.pick_list else { return };
        let mut chosen = None;
        let area =
            egui::Area::new(egui::Id::unique("pick list")).order(Order::Foreground).fixed_pos(list.at + vec2(4.0, 4.0));
        area.show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_min_width(220.0);
                if list.hits.is_empty() {
                    ui.weak("Nothing is here");
                }
                for hit in list.hits.iter().take(12) {
                    let name = self.hit_name(hit).unwrap_or_else(|| "Point".to_owned());
                    let far = match (hit.distance > 0.0, hit.hidden) {
                        (_, true) => "behind".to_owned(),
                        (true, _) => format!("{:.0} px", hit.distance),
                        _ => status::short(hit.depth),
                    };
                    let color = if hit.hidden { theme::of(ui).text[1] } else { theme::of(ui).text[0] };
                    let button = egui::Button::new(egui::RichText::new(name).color(color)).right_text(far);
                    if ui.add(button.min_size(vec2(ui.available_width(), theme::ROW))).clicked() {
                        chosen = Some(*hit);
                    }
                }
            });
        });
        let Some(hit) = chosen else { return };
        self.pick_list = None;
        match &self.tool {
            Tool::Select | Tool::Inspect(_) => {
                if let Some(id) = super::viewport::hit_entity(&hit) {
                    self.selection.set([id]);
                }
            }
            Tool::Patch(_) => {
                let held = crate::view::navigation::Modifiers::NONE;
                self.patch_event(Event::Click { hit: Some(hit), snap: None, held });
            }
            Tool::Intersect(_) => self.intersect_pointer(&Pointer::clicked(hit)),
            Tool::Measure(_) => self.measure_pointer(&Pointer::clicked(hit)),
        }
    }

    /// Places of the surfaces on a grid in their parameters in which a click would pick them, for scripts.
    pub fn surface_hints(&self, scale: f32) -> Vec<SurfaceHint> {
        const PLACES: u32 = 24;
        let Tool::Patch(session) = &self.tool else { return Vec::new() };
        if !matches!(session.tool.stage(), Stage::Side(_)) || self.viewport.is_moving() {
            return Vec::new();
        }
        let filter = session.tool.filter().and(self.pickable);
        let view = self.viewport.view();
        let mut out = Vec::new();
        for item in self.viewport.scene.items().iter().filter(|item| item.visible()) {
            let Geometry::Surface(surface) = &item.geometry else { continue };
            for k in 0..PLACES * PLACES {
                let f = [k % PLACES, k / PLACES].map(|i| (f64::from(i) + 0.5) / f64::from(PLACES));
                let domain = surface.domain();
                let uv = [0, 1].map(|d| domain[d][0] + f[d] * (domain[d][1] - domain[d][0]));
                let Some(at) = view.project(surface.eval(DVec2::from_array(uv))) else { continue };
                let window = self.viewport.to_window(at.pixel);
                if !self.viewport.rect.shrink(2.0).contains(window) {
                    continue;
                }
                let hit = self.viewport.pick_at(at.pixel, filter);
                if let Some(Target::Surface { entity, uv: hit }) = hit.map(|h| h.target)
                    && entity == item.id()
                    && hit.distance(DVec2::from_array(uv)) < 1e-2 * (domain[0][1] - domain[0][0])
                {
                    let (entity, name) = (entity.0, item.entity.name.clone());
                    out.push(SurfaceHint { entity, name, uv, at: [window.x * scale, window.y * scale] });
                }
            }
        }
        out
    }

    /// One point of every curve that the active tool lets one pick and that a click there would pick, for scripts.
    pub fn curve_hints(&self, scale: f32) -> Vec<CurveHint> {
        let Tool::Patch(session) = &self.tool else { return Vec::new() };
        if !matches!(session.tool.stage(), Stage::Side(_)) || self.viewport.is_moving() {
            return Vec::new();
        }
        let filter = session.tool.filter().and(self.pickable);
        let view = self.viewport.view();
        let mut out = Vec::new();
        for item in self.viewport.scene.items().iter().filter(|item| item.visible()) {
            let Some(display) = &item.display else { continue };
            for curve in &display.curves {
                let n = curve.points.len();
                let places = [n / 2, n / 3, 2 * n / 3, n / 4, 3 * n / 4, n / 8, 7 * n / 8];
                let between = |k: usize| curve.points[k].midpoint(*curve.points.get(k + 1).unwrap_or(&curve.points[k]));
                // Grid lines cross at their points: there a click may give either, between them it cannot.
                let places: Vec<DVec3> =
                    places.into_iter().filter(|&k| k < n).flat_map(|k| [curve.points[k], between(k)]).collect();
                // Scripts click on whole pixels, so a place whose neighbours give the same curve comes first.
                let around = [DVec2::ZERO, DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
                let place = |offsets: &[DVec2]| {
                    places.iter().find_map(|&p| {
                        let pixel = view.project(p)?.pixel;
                        let gives = |off: &DVec2| {
                            let hit = self.viewport.pick_at(pixel + 0.5 * *off, filter);
                            hit.is_some_and(|h| matches!(h.target, Target::Curve { curve: c, .. } if c == curve.curve))
                        };
                        offsets.iter().all(gives).then_some(pixel)
                    })
                };
                let found = place(&around).or_else(|| place(&around[..1]));
                let Some(at) = found.map(|pixel| self.viewport.to_window(pixel)) else { continue };
                let inside = self.viewport.rect.shrink(2.0).contains(at);
                if inside {
                    out.push(CurveHint {
                        entity: item.id().0,
                        name: item.entity.name.clone(),
                        curve: curve_name(&item.entity, &curve.curve),
                        at: [at.x * scale, at.y * scale],
                    });
                }
            }
        }
        out
    }
}
