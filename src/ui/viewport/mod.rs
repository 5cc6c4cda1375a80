//! The 3D view: camera, what is under the cursor, and the picture. The picture is rendered off screen by
//! [`crate::render`] and copied into the window; it is drawn again only when something in it has changed.

use std::sync::Arc;
use std::time::Duration;

use egui::Rect;
use glam::{DVec2, DVec3};

use crate::kernel::geom::Aabb;
use crate::model::document::{Document, EntityId};
use crate::render::{self, FrameData, Prepared, Stage};
use crate::view::camera::{Axis, Camera, Projection};
use crate::view::navigation::Drag;
use crate::view::pick::{Cycle, PickHit};
use crate::view::scene::{Made, Request, Scene};
use crate::view::section::SectionPlane;
use crate::view::viewport::{View, Viewport as Picture};
use crate::work::{Jobs, Lane, Outcome, Ticket};

mod frame;
mod gizmo;
mod input;
mod show;

pub use frame::{Overlay, linear};
pub use gizmo::tag;
pub use input::{Pointer, hit_entity};
pub use show::curve_name;

use input::HoverStamp;

/// How long the camera takes to an axis view or a frame.
const MOVE: f64 = 0.22;
/// At most this many displays are made in one job, so that the first ones show early.
const BATCH: usize = 48;

/// The 3D view.
pub struct Viewport {
    /// Where the eye is.
    pub camera: Camera,
    /// What surfaces look like.
    pub display: render::Display,
    /// The plane that cuts the view open.
    pub section: Option<SectionPlane>,
    /// The point under the cursor, and its surface parameters.
    pub cursor_at: Option<(DVec3, Option<DVec2>)>,
    /// Everything that can be drawn and picked.
    pub scene: Scene,
    /// Where in the window it is.
    pub rect: Rect,
    has_gpu: bool,
    stage: Stage,
    making: Option<Ticket<Vec<(Made, Prepared)>>>,
    /// What was taken over last has not been drawn yet.
    fresh: bool,
    scene_stamp: u64,
    bounds: (u64, Aabb),
    seen_revision: Option<u64>,
    drag: Option<Drag>,
    section_drag: Option<DVec2>,
    motion: Option<(Camera, Camera, Option<f64>)>,
    frame_next: Option<(Aabb, bool)>,
    hovered: Option<EntityId>,
    from_list: Option<EntityId>,
    cycle: Cycle,
    hover: Option<(HoverStamp, Option<PickHit>)>,
    pressed: Option<egui::Pos2>,
    hold_from: Option<f64>,
    dragging: bool,
    frame: Option<(frame::Stamp, Arc<FrameData>)>,
    frame_times: [f32; 32],
    frames: usize,
}

impl Viewport {
    /// An empty view; without graphics it draws nothing but still works.
    pub fn new(gpu: Option<&egui_wgpu::RenderState>) -> Self {
        if let Some(state) = gpu {
            super::paint::install(state);
        }
        Self {
            camera: Camera::default(),
            display: render::Display::default(),
            section: None,
            cursor_at: None,
            scene: Scene::default(),
            rect: Rect::ZERO,
            has_gpu: gpu.is_some(),
            stage: Stage::default(),
            making: None,
            fresh: false,
            scene_stamp: 0,
            bounds: (0, Aabb::EMPTY),
            seen_revision: None,
            drag: None,
            section_drag: None,
            motion: None,
            frame_next: None,
            hovered: None,
            from_list: None,
            cycle: Cycle::default(),
            hover: None,
            pressed: None,
            hold_from: None,
            dragging: false,
            frame: None,
            frame_times: [0.0; 32],
            frames: 0,
        }
    }

    /// Whether there is a graphics adapter to draw with.
    pub fn can_draw(&self) -> bool {
        self.has_gpu
    }

    /// The size of the picture in points.
    pub fn picture(&self) -> Picture {
        Picture::new(f64::from(self.rect.width()), f64::from(self.rect.height()))
    }

    /// The view as it is drawn now.
    pub fn view(&self) -> View {
        View::new(&self.camera, self.picture(), &self.bounds.1)
    }

    /// A box around what is visible.
    pub fn bounds(&self) -> Aabb {
        self.bounds.1
    }

    /// Another document: frame it, forget the section and what was hovered.
    pub fn new_document(&mut self, document: &Document) {
        self.section = None;
        self.hovered = None;
        self.from_list = None;
        self.cursor_at = None;
        self.seen_revision = None;
        self.camera.look_along(Axis::Oblique);
        self.frame_next = Some((super::editor::visible_bounds(document), false));
    }

    /// Shows a box, by a move that the eye can follow.
    pub fn frame(&mut self, bounds: &Aabb) {
        self.frame_next = Some((*bounds, true));
    }

    /// Looks along an axis, by a move that the eye can follow.
    pub fn look(&mut self, axis: Axis) {
        let mut to = self.goal();
        to.look_along(axis);
        self.move_to(to);
    }

    /// Where the camera is or is moving to.
    fn goal(&self) -> Camera {
        self.motion.map_or(self.camera, |(_, to, _)| to)
    }

    fn move_to(&mut self, to: Camera) {
        self.motion = Some((self.camera, to, None));
    }

    /// Whether the picture still moves or is still being refined.
    pub fn is_moving(&self) -> bool {
        self.motion.is_some() || self.frame_next.is_some() || self.making.is_some() || self.fresh
    }

    /// Changes between perspective and parallel projection.
    pub fn toggle_projection(&mut self) {
        self.camera.projection = match self.camera.projection {
            Projection::Perspective => Projection::Orthographic,
            Projection::Orthographic => Projection::Perspective,
        };
        if let Some((_, to, _)) = &mut self.motion {
            to.projection = self.camera.projection;
        }
    }

    /// Cuts the view open through the middle of a box, or closes it again.
    pub fn toggle_section(&mut self, bounds: &Aabb) {
        self.section = match self.section {
            Some(_) => None,
            None => Some(SectionPlane::facing(&self.view(), bounds)),
        };
    }

    /// What entity is under the cursor, in the view or in the outliner.
    pub fn hovered_entity(&self) -> Option<EntityId> {
        self.hovered
    }

    /// What is under the cursor, as found last.
    pub fn hover_hit(&self) -> Option<PickHit> {
        self.hover.as_ref().and_then(|(_, hit)| *hit)
    }

    /// The outliner's row under the cursor.
    pub fn hover_from_list(&mut self, id: EntityId) {
        self.from_list = Some(id);
    }

    /// Notes how long a frame took on the CPU.
    pub fn note_frame_time(&mut self, time: Duration) {
        self.frame_times[self.frames % self.frame_times.len()] = time.as_secs_f32();
        self.frames += 1;
    }

    /// The mean CPU time of the last frames, in seconds.
    pub fn mean_frame_time(&self) -> f32 {
        let n = self.frames.clamp(1, self.frame_times.len());
        self.frame_times[..n].iter().sum::<f32>() / n as f32
    }

    /// Draws the whole surfaces under trimmed faces, or the faces again.
    pub fn toggle_whole_surfaces(&mut self) {
        self.scene.show_whole_surfaces(!self.scene.shows_whole_surfaces());
        self.seen_revision = None;
    }

    /// Follows the document, the camera's moves and the workers. Returns whether a repaint is wanted.
    pub fn advance(&mut self, document: &Document, revision: u64, jobs: &mut Jobs, now: f64) -> bool {
        if self.seen_revision != Some(revision) {
            self.seen_revision = Some(revision);
            if self.scene.sync(document) {
                self.scene_stamp += 1;
                self.bounds = (self.scene_stamp, self.scene.bounds());
            }
        }
        if let Some((bounds, animated)) = self.frame_next.take() {
            let mut to = self.goal();
            to.frame(&bounds, self.picture());
            if animated { self.move_to(to) } else { (self.camera, self.motion) = (to, None) }
        }
        if let Some((from, to, start)) = &mut self.motion {
            let start = *start.get_or_insert(now);
            let t = ((now - start) / MOVE).clamp(0.0, 1.0);
            self.camera = from.towards(to, t * t * (3.0 - 2.0 * t));
            if t >= 1.0 {
                self.motion = None;
            }
        }
        let again = self.refine(jobs);
        if self.bounds.0 != self.scene_stamp {
            // Looks at every vertex, so only when something has changed.
            self.bounds = (self.scene_stamp, self.scene.bounds());
        }
        again || self.motion.is_some()
    }

    /// Has displays made that the view is in want of, and takes over those that are ready. Returns whether it is to be
    /// called again at the next frame.
    fn refine(&mut self, jobs: &mut Jobs) -> bool {
        if let Some(outcome) = self.making.as_ref().and_then(Ticket::poll) {
            self.making = None;
            match outcome {
                Outcome::Finished { value, .. } => {
                    let before = self.scene_stamp;
                    for (made, prepared) in value {
                        if self.scene.accept(made) {
                            self.stage.accept(prepared);
                            self.scene_stamp += 1;
                        }
                    }
                    if self.scene_stamp != before {
                        // What is there is shown before more is asked for.
                        self.fresh = true;
                        return true;
                    }
                }
                Outcome::NeverRan => {}
                Outcome::Panicked { message, .. } => log::error!("a display could not be made: {message}"),
            }
        }
        self.fresh = false;
        // While the camera moves, what is there is good enough.
        if self.making.is_some() || self.motion.is_some() {
            return false;
        }
        let mut wanted = self.scene.wanted(&self.view());
        if wanted.is_empty() {
            return false;
        }
        wanted.truncate(BATCH);
        let name = match wanted.len() {
            1 => "Draw 1 entity".to_owned(),
            n => format!("Draw {n} entities"),
        };
        self.making = Some(jobs.spawn(Lane::Preview, name, "", move |_| {
            use rayon::prelude::*;
            let make = |request: Request| {
                let made = request.run();
                let prepared = Prepared::new(&made);
                (made, prepared)
            };
            wanted.into_par_iter().map(make).collect()
        }));
        false
    }

    /// A point of the window as a pixel of the picture.
    pub fn to_pixel(&self, at: egui::Pos2) -> DVec2 {
        DVec2::new(f64::from(at.x - self.rect.left()), f64::from(at.y - self.rect.top()))
    }

    /// A pixel of the picture as a point of the window.
    pub fn to_window(&self, pixel: DVec2) -> egui::Pos2 {
        self.rect.min + egui::vec2(pixel.x as f32, pixel.y as f32)
    }

    /// Where a point of the model is in the window, if it is in front of the eye.
    pub fn project(&self, p: DVec3) -> Option<egui::Pos2> {
        self.view().project(p).map(|at| self.to_window(at.pixel))
    }
}
