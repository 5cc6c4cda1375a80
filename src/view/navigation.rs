//! What a mouse does to the camera: which button with which modifiers orbits, pans or zooms, in the manner of the
//! program the user comes from, and a drag as a small state between press and release.
//!
//! The left button without Alt is never navigation: it is only ever pick.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::camera::{Axis, Camera};
use super::viewport::{View, Viewport};
use crate::kernel::geom::Aabb;

/// A mouse button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The left one.
    Left,
    /// The middle one, or the wheel pressed.
    Middle,
    /// The right one.
    Right,
}

/// The keys held while something else is pressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modifiers {
    /// Shift.
    pub shift: bool,
    /// Control (Command on a Mac).
    pub ctrl: bool,
    /// Alt (Option on a Mac).
    pub alt: bool,
}

impl Modifiers {
    /// None held.
    pub const NONE: Self = Self { shift: false, ctrl: false, alt: false };
    /// Shift only.
    pub const SHIFT: Self = Self { shift: true, ..Self::NONE };
    /// Control only.
    pub const CTRL: Self = Self { ctrl: true, ..Self::NONE };
    /// Alt only.
    pub const ALT: Self = Self { alt: true, ..Self::NONE };
}

/// What a drag does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragAction {
    /// Turns about the point under the cursor at the press.
    Orbit,
    /// Moves across; the grabbed point stays under the cursor.
    Pan,
    /// Up comes closer to the point under the cursor at the press, down goes away.
    Zoom,
}

/// Whose habits the mouse follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Preset {
    /// Middle button orbits, with Shift pans, with Ctrl zooms; the right button does the same for mice without one.
    #[default]
    Patchwright,
    /// Middle button orbits, with Shift pans, with Ctrl zooms.
    Blender,
    /// Right button orbits, with Shift pans, with Ctrl zooms.
    Rhino,
    /// Alt with the left, middle, right button orbits, pans, zooms.
    Maya,
}

impl Preset {
    /// All presets, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::Patchwright, Self::Blender, Self::Rhino, Self::Maya];

    /// The name in the menu.
    pub fn name(self) -> &'static str {
        match self {
            Self::Patchwright => "Patchwright",
            Self::Blender => "Blender",
            Self::Rhino => "Rhino",
            Self::Maya => "Maya",
        }
    }

    /// One line on what the buttons do.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Patchwright => "Middle or right drag orbit · Shift pan · Ctrl zoom · wheel zoom to cursor",
            Self::Blender => "Middle drag orbit · Shift pan · Ctrl zoom · wheel zoom to cursor",
            Self::Rhino => "Right drag orbit · Shift pan · Ctrl zoom · wheel zoom to cursor",
            Self::Maya => "Alt + left drag orbit · Alt + middle pan · Alt + right zoom · wheel zoom to cursor",
        }
    }

    /// What a drag with this button does; `None` when it is not navigation.
    pub fn drag(self, button: Button, held: Modifiers) -> Option<DragAction> {
        let by_modifier = match (held.shift, held.ctrl, held.alt) {
            (false, false, _) => DragAction::Orbit,
            (true, false, _) => DragAction::Pan,
            (false, true, _) => DragAction::Zoom,
            (true, true, _) => DragAction::Pan,
        };
        match (self, button) {
            (Self::Maya, Button::Left) => held.alt.then_some(DragAction::Orbit),
            (Self::Maya, Button::Middle) => held.alt.then_some(DragAction::Pan),
            (Self::Maya, Button::Right) => held.alt.then_some(DragAction::Zoom),
            (_, Button::Left) => None,
            (Self::Patchwright, _) => Some(by_modifier),
            (Self::Blender, Button::Middle) | (Self::Rhino, Button::Right) => Some(by_modifier),
            (Self::Blender, Button::Right) | (Self::Rhino, Button::Middle) => None,
        }
    }
}

/// A drag in progress.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    action: DragAction,
    anchor: DVec3,
    depth: f64,
    last: DVec2,
}

impl Drag {
    /// Starts one at a pixel. `under` is the point of the model under the cursor; without one the anchor is on the
    /// line of sight at the depth of the scene's middle.
    pub fn start(view: &View, action: DragAction, pixel: DVec2, under: Option<DVec3>, scene: &Aabb) -> Self {
        let anchor = anchor(view, pixel, under, scene);
        Self { action, anchor, depth: view.depth(anchor), last: pixel }
    }

    /// What it does.
    pub fn action(&self) -> DragAction {
        self.action
    }

    /// The point it turns about, holds or comes closer to; worth a small mark while it lasts.
    pub fn anchor(&self) -> DVec3 {
        self.anchor
    }

    /// The cursor has moved to a pixel.
    pub fn moved(&mut self, camera: &mut Camera, viewport: Viewport, pixel: DVec2) {
        let delta = pixel - self.last;
        match self.action {
            DragAction::Orbit => camera.orbit(self.anchor, delta, viewport),
            DragAction::Pan => camera.pan(viewport, self.depth, self.last, pixel),
            DragAction::Zoom => {
                // The picture's height is a factor of about 50.
                camera.zoom(self.anchor, (4.0 * delta.y / viewport.height).exp());
            }
        }
        self.last = pixel;
    }
}

/// The wheel was turned by `notches` (up is positive) over a pixel: closer to what is under the cursor.
pub fn wheel(camera: &mut Camera, view: &View, pixel: DVec2, under: Option<DVec3>, notches: f64, scene: &Aabb) {
    camera.zoom(anchor(view, pixel, under, scene), 0.85_f64.powf(notches.clamp(-20.0, 20.0)));
}

fn anchor(view: &View, pixel: DVec2, under: Option<DVec3>, scene: &Aabb) -> DVec3 {
    under.filter(|p| p.is_finite()).unwrap_or_else(|| {
        let depth = if scene.is_empty() { view.camera.distance } else { view.depth(scene.center()) };
        view.unproject(pixel, if depth > view.near { depth } else { view.camera.distance })
    })
}

/// A key that moves the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewKey {
    /// A digit of the numeric pad (plain digits belong to the active tool).
    Pad(u8),
    /// Home: frame everything.
    Home,
    /// F: frame the selection.
    F,
}

/// What a key does to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewAction {
    /// Look along an axis.
    Look(Axis),
    /// Frame everything.
    FrameAll,
    /// Frame the selection, or everything when there is none.
    FrameSelection,
    /// Change between perspective and orthographic.
    ToggleProjection,
}

/// What a key does to the camera; `None` for a digit without a meaning.
pub fn view_key(key: ViewKey, held: Modifiers) -> Option<ViewAction> {
    let look = |axis, opposite| Some(ViewAction::Look(if held.ctrl { opposite } else { axis }));
    match key {
        ViewKey::Home => Some(ViewAction::FrameAll),
        ViewKey::F => Some(ViewAction::FrameSelection),
        ViewKey::Pad(1) => look(Axis::Front, Axis::Back),
        ViewKey::Pad(3) => look(Axis::Right, Axis::Left),
        ViewKey::Pad(7) => look(Axis::Top, Axis::Bottom),
        ViewKey::Pad(0) => Some(ViewAction::Look(Axis::Oblique)),
        ViewKey::Pad(5) => Some(ViewAction::ToggleProjection),
        ViewKey::Pad(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_left_button_is_only_ever_pick_unless_alt_is_held_in_maya() {
        for preset in Preset::ALL {
            for held in [Modifiers::NONE, Modifiers::SHIFT, Modifiers::CTRL] {
                assert_eq!(preset.drag(Button::Left, held), None);
            }
        }
        assert_eq!(Preset::Patchwright.drag(Button::Left, Modifiers::ALT), None);
        assert_eq!(Preset::Maya.drag(Button::Left, Modifiers::ALT), Some(DragAction::Orbit));
    }

    #[test]
    fn every_preset_can_orbit_pan_and_zoom() {
        for preset in Preset::ALL {
            for wanted in [DragAction::Orbit, DragAction::Pan, DragAction::Zoom] {
                let found = [Button::Left, Button::Middle, Button::Right].into_iter().any(|button| {
                    [Modifiers::NONE, Modifiers::SHIFT, Modifiers::CTRL, Modifiers::ALT]
                        .into_iter()
                        .any(|held| preset.drag(button, held) == Some(wanted))
                });
                assert!(found, "{preset:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn a_drag_keeps_its_anchor_where_it_promises() {
        let scene = Aabb { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
        let screen = Viewport::new(1000.0, 700.0);
        let mut camera = Camera::default();
        camera.frame(&scene, screen);
        let pressed = DVec2::new(612.0, 233.0);
        for action in [DragAction::Orbit, DragAction::Pan, DragAction::Zoom] {
            for under in [None, Some(DVec3::new(0.3, -0.9, 0.4))] {
                let mut camera = camera;
                let view = View::new(&camera, screen, &scene);
                let pixel = under.map_or(pressed, |p| view.project(p).unwrap().pixel);
                let mut drag = Drag::start(&view, action, pixel, under, &scene);
                let end = pixel + DVec2::new(35.0, -61.0);
                drag.moved(&mut camera, screen, 0.5 * (pixel + end));
                drag.moved(&mut camera, screen, end);
                let at = View::new(&camera, screen, &scene).project(drag.anchor()).unwrap().pixel;
                let expected = if action == DragAction::Pan { end } else { pixel };
                assert!(at.distance(expected) < 1e-9, "{action:?}: {at} for {expected}");
            }
        }
    }

    #[test]
    fn the_wheel_goes_in_and_out_by_the_same_amount() {
        let scene = Aabb { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
        let mut camera = Camera::default();
        let view = View::new(&camera, Viewport::new(800.0, 600.0), &scene);
        let (before, pixel) = (camera, DVec2::new(100.0, 500.0));
        let under = Some(view.unproject(pixel, 9.0));
        wheel(&mut camera, &view, pixel, under, 3.0, &scene);
        assert!(camera.distance < before.distance);
        wheel(&mut camera, &view, pixel, under, -3.0, &scene);
        assert!(camera.target.distance(before.target) < 1e-12 && (camera.distance - before.distance).abs() < 1e-12);
    }

    #[test]
    fn ctrl_looks_from_the_opposite_side() {
        assert_eq!(view_key(ViewKey::Pad(7), Modifiers::NONE), Some(ViewAction::Look(Axis::Top)));
        assert_eq!(view_key(ViewKey::Pad(7), Modifiers::CTRL), Some(ViewAction::Look(Axis::Bottom)));
        assert_eq!(view_key(ViewKey::Pad(9), Modifiers::NONE), None);
    }
}
