//! The frame as data: made anew only when something in it has changed.

use std::sync::Arc;

use super::Viewport;
use crate::model::document::EntityId;
use crate::model::selection::Selection;
use crate::render::{
    self, Color, Coloring, Display, Emphasis, FrameData, GlyphItem, LineItem, Look, MeshItem, Theme, VolumeItem, srgb,
};
use crate::view::camera::Camera;
use crate::view::section::SectionPlane;
use crate::view::viewport::View;

/// How much of the model shows while something lies on it.
const GHOST: f32 = 0.16;

/// What a tool adds to the picture.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Changes whenever anything below does.
    pub revision: u64,
    /// Steps the model back, so that the tool's things stand out.
    pub mute: bool,
    /// Shows the iso-lines, because they can be picked.
    pub iso_lines: bool,
    /// Draws the model as a faint ghost, so that it does not flicker through what lies on it.
    pub ghost: bool,
    /// Shows what is selected like the rest.
    pub calm: bool,
    /// Entities whose surfaces are not drawn, because something stands for them.
    pub without: Vec<EntityId>,
    /// Replaces the colours of entities.
    pub fields: Vec<(EntityId, render::Field)>,
    /// Meshes.
    pub meshes: Vec<MeshItem>,
    /// Lines.
    pub lines: Vec<LineItem>,
    /// Bounding volumes.
    pub volumes: Vec<VolumeItem>,
    /// Points.
    pub glyphs: Vec<GlyphItem>,
}

impl Overlay {
    /// What a sketch holds.
    pub fn of(sketch: render::Sketch) -> Self {
        let mut overlay = Self::default();
        overlay.add(sketch);
        overlay
    }

    /// Adds what a sketch holds.
    pub fn add(&mut self, sketch: render::Sketch) {
        self.meshes.extend(sketch.meshes);
        self.lines.extend(sketch.lines);
        self.glyphs.extend(sketch.glyphs);
    }
}

/// Everything that decides what a frame looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Stamp {
    size: [u32; 2],
    scale: f32,
    camera: Camera,
    dark: bool,
    display: Display,
    section: Option<SectionPlane>,
    scene: u64,
    selection: Selection,
    hovered: Option<EntityId>,
    overlay: u64,
}

/// A colour of the window's as the renderer takes it.
pub fn linear(c: egui::Color32) -> Color {
    srgb(u32::from(c.r()) << 16 | u32::from(c.g()) << 8 | u32::from(c.b()))
}

impl Viewport {
    /// The frame to show.
    pub fn frame_data(&mut self, scale: f32, dark: bool, selection: &Selection, overlay: &Overlay) -> Arc<FrameData> {
        let size = [self.rect.width(), self.rect.height()].map(|x| ((x * scale).round() as u32).max(1));
        let stamp = Stamp {
            size,
            scale,
            camera: self.camera,
            dark,
            display: self.display,
            section: self.section,
            scene: self.scene_stamp,
            selection: selection.clone(),
            hovered: self.hovered,
            overlay: overlay.revision,
        };
        if let Some((old, frame)) = &self.frame
            && *old == stamp
        {
            return Arc::clone(frame);
        }
        let mut frame = self.compose(scale, dark, selection, overlay);
        frame.size = size;
        let frame = Arc::new(frame);
        self.frame = Some((stamp, Arc::clone(&frame)));
        frame
    }

    fn compose(&mut self, scale: f32, dark: bool, selection: &Selection, overlay: &Overlay) -> FrameData {
        let view = View::new(&self.camera, self.picture(), &self.bounds());
        let theme = if dark { Theme::dark() } else { Theme::light() };
        let look = Look {
            display: Display { isolines: self.display.isolines || overlay.iso_lines, ..self.display },
            theme,
            coloring: Coloring::Plain,
            section: self.section,
            pixels_per_point: scale,
        };
        let hovered = self.hovered;
        let emphasis = |id: EntityId| {
            if overlay.calm {
                Emphasis::Normal
            } else if selection.contains(id) {
                Emphasis::Selected
            } else if hovered == Some(id) {
                Emphasis::Hovered
            } else if overlay.mute {
                Emphasis::Muted
            } else {
                Emphasis::Normal
            }
        };
        let mut frame = self.stage.frame(&self.scene, &view, &look, emphasis);
        // What can be picked stays clear while the rest steps back.
        for line in frame.lines.iter_mut().filter(|line| line.emphasis == Emphasis::Muted) {
            line.emphasis = Emphasis::Normal;
        }
        frame.meshes.retain(|item| !overlay.without.iter().any(|id| id.0 == item.key.entity));
        for item in &mut frame.meshes {
            if overlay.ghost {
                item.color[3] = GHOST;
            }
            item.field = overlay.fields.iter().find(|(of, _)| of.0 == item.key.entity).map(|(_, field)| field.clone());
        }
        frame.meshes.extend(overlay.meshes.iter().cloned());
        frame.lines.extend(overlay.lines.iter().cloned());
        frame.volumes.extend(overlay.volumes.iter().cloned());
        frame.glyphs.extend(overlay.glyphs.iter().cloned());
        frame
    }
}
