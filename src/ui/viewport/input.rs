//! What the mouse does in the view: navigation first, then what the active tool may pick.

use egui::{PointerButton, Response, Ui};
use glam::{DVec2, DVec3};

use super::Viewport;
use crate::view::camera::Camera;
use crate::view::navigation::{Button, Drag, Modifiers, Preset, wheel};
use crate::view::pick::{Filter, PickHit, PickOptions, Target, is_hidden, pick, pick_all, under_cursor};
use crate::view::snap::{Snap, SnapOptions, snap};

/// Points of scrolling that count as one notch of the wheel.
const NOTCH: f32 = 40.0;
/// Seconds after which a press that does not move opens the list of what is under the cursor.
const HOLD: f64 = 0.4;
/// Farther than this between press and release, and it was no click.
const CLICK: f32 = 5.0;

/// What the left button did.
#[derive(Clone, Debug, Default)]
pub struct Pointer {
    /// What is under the cursor.
    pub hover: Option<PickHit>,
    /// What was clicked: the hit (none for the empty background) and whether Shift or Ctrl was held.
    pub click: Option<(Option<PickHit>, Modifiers)>,
    /// Everything under the cursor, for the list that Alt+click opens.
    pub list: Option<Vec<PickHit>>,
    /// The cursor's pixel while it is over the view.
    pub pixel: Option<DVec2>,
    /// Pressed here, and not yet released.
    pub pressed: bool,
    /// A drag of the left button: where it began and where it is.
    pub drag: Option<(DVec2, DVec2)>,
    /// The drag has just begun.
    pub drag_started: bool,
    /// The drag has just ended.
    pub drag_ended: bool,
    /// The keys held.
    pub held: Modifiers,
}

impl Pointer {
    /// A click on something, chosen otherwise than with the mouse.
    pub fn clicked(hit: PickHit) -> Self {
        Self { click: Some((Some(hit), Modifiers::NONE)), ..Self::default() }
    }
}

/// What decides what is under the cursor.
#[derive(Clone, Debug, PartialEq)]
pub struct HoverStamp {
    pixel: DVec2,
    camera: Camera,
    scene: u64,
    filter: Filter,
    points: usize,
    tool: u64,
}

fn held(m: egui::Modifiers) -> Modifiers {
    Modifiers { shift: m.shift, ctrl: m.command || m.ctrl, alt: m.alt }
}

impl Viewport {
    /// How to pick with a filter.
    fn options<'a>(&self, filter: Filter, points: &'a [DVec3]) -> PickOptions<'a> {
        let occlusion = !self.display.wireframe && !self.display.xray;
        PickOptions { filter, occlusion, section: self.section, points }
    }

    /// What a click at a pixel would pick.
    pub fn pick_at(&self, pixel: DVec2, filter: Filter) -> Option<PickHit> {
        pick(&self.scene, &self.view(), pixel, &self.options(filter, &[]))
    }

    /// What a pixel snaps to.
    pub fn snap(&self, pixel: DVec2, filter: Filter, options: &SnapOptions, suspended: bool) -> Option<Snap> {
        snap(&self.scene, &self.view(), pixel, &self.options(filter, &[]), options, suspended)
    }

    /// Whether a surface is in front of a point of the model.
    pub fn hides(&self, point: DVec3) -> bool {
        is_hidden(&self.scene, &self.view(), point, &self.options(Filter::ALL, &[]))
    }

    /// Moves the camera and says what the left button did. `points` are those that the tool offers, `stamp` changes
    /// whenever they do.
    pub fn pointer(
        &mut self,
        ui: &Ui,
        response: &Response,
        preset: Preset,
        filter: Filter,
        points: &[DVec3],
        stamp: u64,
    ) -> Pointer {
        let mut out = Pointer::default();
        let (modifiers, scroll, zoom, at) =
            ui.input(|i| (held(i.modifiers), i.smooth_scroll_delta().y, i.zoom_delta(), i.pointer.latest_pos()));
        let over = response.contains_pointer() || response.is_pointer_button_down_on();
        let Some(at) = at.filter(|_| over || self.drag.is_some()) else {
            if self.drag.is_none() {
                self.hovered = self.from_list.take();
                self.cursor_at = None;
            }
            return out;
        };
        let pixel = self.to_pixel(at);
        out.pixel = Some(pixel);
        out.held = modifiers;
        self.navigate(ui, response, preset, modifiers, pixel);
        if response.contains_pointer() && self.drag.is_none() {
            // Ctrl and the wheel arrive as a zoom.
            let notches = f64::from(scroll / NOTCH) + f64::from(zoom.ln()) * 6.0;
            if notches != 0.0 {
                let view = self.view();
                let under = under_cursor(&self.scene, &view, pixel, self.section);
                let bounds = self.bounds();
                self.motion = None;
                wheel(&mut self.camera, &view, pixel, under, notches, &bounds);
            }
        }
        if self.drag.is_some() || self.motion.is_some() {
            self.from_list = None;
            return out;
        }
        let held_still = self.left_button(ui, response, &mut out, at);
        out.hover = self.hover_at(pixel, filter, points, stamp);
        self.cursor_at = out.hover.as_ref().map(|hit| (hit.point, self.hit_uv(hit)));
        self.hovered = out.hover.as_ref().and_then(hit_entity).or(self.from_list.take());
        if held_still {
            let options = self.options(filter, points);
            out.list = Some(pick_all(&self.scene, &self.view(), pixel, &options));
        } else if out.click.is_some() {
            let options = self.options(filter, points);
            let mut hits = pick_all(&self.scene, &self.view(), pixel, &options);
            if modifiers.alt {
                out.click = None;
                out.list = Some(hits);
            } else {
                // The first click takes what was highlighted, never something else that is as near, and nothing that
                // is hidden; clicking again goes on from there.
                match &out.hover {
                    Some(hover) => {
                        hits.retain(|hit| !hit.target.same_thing(&hover.target));
                        hits.insert(0, *hover);
                    }
                    None => hits.clear(),
                }
                out.click = Some((self.cycle.click(pixel, &hits).copied(), modifiers));
            }
        }
        out
    }

    /// The press, drag and release of the left button. True when it has just been held still for long enough.
    fn left_button(&mut self, ui: &Ui, response: &Response, out: &mut Pointer, at: egui::Pos2) -> bool {
        let (pressed, released, down, now) =
            ui.input(|i| (i.pointer.primary_pressed(), i.pointer.primary_released(), i.pointer.primary_down(), i.time));
        if pressed && response.contains_pointer() && !self.on_triad(at) {
            (self.pressed, self.hold_from) = (Some(at), Some(now));
        }
        let Some(start) = self.pressed else { return false };
        out.pressed = down;
        let moved = (at - start).length() > CLICK;
        if moved || self.dragging {
            out.drag = Some((self.to_pixel(start), self.to_pixel(at)));
            out.drag_started = !self.dragging;
            self.dragging = true;
        }
        if let Some(from) = self.hold_from.filter(|_| down && !self.dragging) {
            let left = HOLD - (now - from);
            if left <= 0.0 {
                // The release that follows is no click.
                (self.pressed, self.hold_from) = (None, None);
                return true;
            }
            ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(left));
        }
        if released {
            out.drag_ended = self.dragging;
            if !self.dragging {
                out.click = Some((None, Modifiers::NONE));
            }
            (self.pressed, self.dragging) = (None, false);
        } else if !down {
            (self.pressed, self.dragging) = (None, false);
        }
        false
    }

    fn navigate(&mut self, ui: &Ui, response: &Response, preset: Preset, modifiers: Modifiers, pixel: DVec2) {
        const BUTTONS: [(PointerButton, Button); 3] = [
            (PointerButton::Primary, Button::Left),
            (PointerButton::Middle, Button::Middle),
            (PointerButton::Secondary, Button::Right),
        ];
        if self.drag.is_none() && response.contains_pointer() {
            let pressed = BUTTONS.iter().find(|(b, _)| ui.input(|i| i.pointer.button_pressed(*b)));
            if let Some(action) = pressed.and_then(|(_, button)| preset.drag(*button, modifiers)) {
                let view = self.view();
                let under = under_cursor(&self.scene, &view, pixel, self.section);
                self.drag = Some(Drag::start(&view, action, pixel, under, &self.bounds()));
                self.motion = None;
                self.cycle.reset();
            }
        }
        let picture = self.picture();
        if let Some(drag) = &mut self.drag {
            drag.moved(&mut self.camera, picture, pixel);
            let any_down = BUTTONS.iter().any(|(b, _)| ui.input(|i| i.pointer.button_down(*b)));
            if !any_down {
                self.drag = None;
            }
        }
    }

    /// What is under a pixel, looked for only when something has changed.
    fn hover_at(&mut self, pixel: DVec2, filter: Filter, points: &[DVec3], tool: u64) -> Option<PickHit> {
        let stamp =
            HoverStamp { pixel, camera: self.camera, scene: self.scene_stamp, filter, points: points.len(), tool };
        if let Some((old, hit)) = &self.hover
            && *old == stamp
        {
            return *hit;
        }
        let hit = pick(&self.scene, &self.view(), pixel, &self.options(filter, points));
        self.hover = Some((stamp, hit));
        hit
    }

    /// The surface parameters of a hit.
    pub fn hit_uv(&self, hit: &PickHit) -> Option<DVec2> {
        match hit.target {
            // A mesh has no parameters.
            Target::Surface { entity, uv } => self.scene.item(entity)?.entity.surface().map(|_| uv),
            Target::Curve { curve, t } => self.scene.curve_item(&curve)?.geometry.curve_uv(&curve, t),
            Target::Point(_) => None,
        }
    }

    /// The point that the camera turns about or holds, while it does.
    pub fn drag_anchor(&self) -> Option<DVec3> {
        self.drag.as_ref().map(Drag::anchor)
    }
}

/// The entity that was hit.
pub fn hit_entity(hit: &PickHit) -> Option<crate::model::document::EntityId> {
    match hit.target {
        Target::Surface { entity, .. } => Some(entity),
        Target::Curve { curve, .. } => Some(curve.entity()),
        Target::Point(_) => None,
    }
}
