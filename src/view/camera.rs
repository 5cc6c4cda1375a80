//! The camera: an eye that turns about things, moves across them and comes closer, all in `f64`.
//!
//! The facts that make it feel right under the hand, and that the tests hold:
//! orbiting keeps the pivot's pixel, panning keeps the grabbed point under the cursor, zooming keeps the point
//! under the cursor where it is. Turntable orbit keeps the vertical upright and stops at the poles; trackball
//! orbit turns freely about the picture's own axes.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::viewport::{View, Viewport};
use crate::kernel::geom::Aabb;

/// How depth becomes size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Projection {
    /// Far things are smaller.
    #[default]
    Perspective,
    /// Parallel lines stay parallel. The picture's scale is that of the perspective one at the target.
    Orthographic,
}

/// How a drag turns the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Orbit {
    /// Sideways about the vertical, up and down about the picture's horizontal, stopping at the poles.
    #[default]
    Turntable,
    /// About the picture's own axes, without stops.
    Trackball,
}

/// A direction to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// From -y, x to the right.
    Front,
    /// From +y.
    Back,
    /// From +x, y to the right.
    Right,
    /// From -x.
    Left,
    /// From +z, x to the right and y up.
    Top,
    /// From -z.
    Bottom,
    /// From the front, the right and above.
    Oblique,
}

/// The camera. z is the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point looked at.
    pub target: DVec3,
    /// The distance from the eye to the target.
    pub distance: f64,
    /// Turns (right, up, back) of the picture into the world.
    pub rotation: DQuat,
    /// The angle of view from the lower to the upper edge, in radians.
    pub fov: f64,
    /// How depth becomes size.
    pub projection: Projection,
    /// How a drag turns it.
    pub orbit: Orbit,
}

impl Default for Camera {
    fn default() -> Self {
        let mut camera = Self {
            target: DVec3::ZERO,
            distance: 10.0,
            rotation: DQuat::IDENTITY,
            fov: 35.0_f64.to_radians(),
            projection: Projection::default(),
            orbit: Orbit::default(),
        };
        camera.look_along(Axis::Oblique);
        camera
    }
}

/// What the eye may not come nearer to or go farther from its target than, in model units.
const DISTANCE: [f64; 2] = [1e-12, 1e15];

impl Camera {
    /// The unit vector to the right of the picture.
    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    /// The unit vector to the top of the picture.
    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }

    /// The unit vector along the line of sight.
    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    /// Where the eye is.
    pub fn eye(&self) -> DVec3 {
        self.target - self.forward() * self.distance
    }

    /// Turns the camera about `pivot` for a drag of `delta` pixels: half a turn for the height of the picture.
    /// The pivot stays at its pixel.
    pub fn orbit(&mut self, pivot: DVec3, delta: DVec2, viewport: Viewport) {
        let angle = delta * (std::f64::consts::PI / viewport.height);
        let turn = match self.orbit {
            Orbit::Trackball => {
                DQuat::from_axis_angle(self.up(), -angle.x) * DQuat::from_axis_angle(self.right(), -angle.y)
            }
            Orbit::Turntable => {
                // A camera that is upside down (after trackball) turns the other way under the same hand.
                let upright = if self.up().z < -1e-9 { -1.0 } else { 1.0 };
                let elevation = self.forward().z.clamp(-1.0, 1.0).asin();
                let quarter = std::f64::consts::FRAC_PI_2;
                let pitch = (elevation - angle.y * upright).clamp(-quarter, quarter) - elevation;
                DQuat::from_rotation_z(-angle.x * upright) * DQuat::from_axis_angle(self.right(), pitch * upright)
            }
        };
        self.turn(pivot, turn);
    }

    /// Rolls the picture by `angle` radians (counter-clockwise camera) about the line of sight through `pivot`.
    pub fn roll(&mut self, pivot: DVec3, angle: f64) {
        self.turn(pivot, DQuat::from_axis_angle(self.forward(), -angle));
    }

    fn turn(&mut self, pivot: DVec3, turn: DQuat) {
        // The target is carried in the camera's own frame, so that the pivot's place in the picture is kept to
        // rounding even after many small drags.
        let local = self.rotation.inverse() * (self.target - pivot);
        self.rotation = (turn * self.rotation).normalize();
        self.target = pivot + self.rotation * local;
    }

    /// Moves the camera across so that the point seen at pixel `from` at `depth` is seen at pixel `to`.
    pub fn pan(&mut self, viewport: Viewport, depth: f64, from: DVec2, to: DVec2) {
        let view = View::new(self, viewport, &Aabb::EMPTY);
        self.target += view.unproject(from, depth) - view.unproject(to, depth);
    }

    /// Comes closer by `factor` (below 1: closer) towards `anchor`, which stays at its pixel. Returns the factor
    /// that was used after the limits of the distance.
    pub fn zoom(&mut self, anchor: DVec3, factor: f64) -> f64 {
        if !(factor > 0.0 && factor.is_finite()) {
            return 1.0;
        }
        let distance = (self.distance * factor).clamp(DISTANCE[0], DISTANCE[1]);
        let factor = distance / self.distance;
        self.target = anchor + (self.target - anchor) * factor;
        self.distance = distance;
        factor
    }

    /// Looks from a direction at the same target.
    pub fn look_along(&mut self, axis: Axis) {
        let (back, up) = match axis {
            Axis::Front => (DVec3::NEG_Y, DVec3::Z),
            Axis::Back => (DVec3::Y, DVec3::Z),
            Axis::Right => (DVec3::X, DVec3::Z),
            Axis::Left => (DVec3::NEG_X, DVec3::Z),
            Axis::Top => (DVec3::Z, DVec3::Y),
            Axis::Bottom => (DVec3::NEG_Z, DVec3::NEG_Y),
            Axis::Oblique => {
                let back = DVec3::new(0.55, -0.75, 0.5).normalize();
                (back, back.cross(DVec3::Z.cross(back)).normalize())
            }
        };
        self.rotation = DQuat::from_mat3(&DMat3::from_cols(up.cross(back), up, back)).normalize();
    }

    /// Moves along the line of sight and across until the box just fills the picture. An empty box changes nothing; a
    /// box that is a point is shown from a distance of 1.
    pub fn frame(&mut self, bounds: &Aabb, viewport: Viewport) {
        if bounds.is_empty() || !bounds.diagonal().is_finite() {
            return;
        }
        let tangent = (0.5 * self.fov).tan();
        let (across, down) = (tangent * viewport.aspect(), tangent);
        let half = 0.5 * bounds.size();
        let mut distance: f64 = 0.0;
        for i in 0..8 {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            let towards = match self.projection {
                Projection::Perspective => -corner.dot(self.forward()),
                Projection::Orthographic => 0.0,
            };
            let wide = corner.dot(self.right()).abs() / across;
            let high = corner.dot(self.up()).abs() / down;
            distance = distance.max(towards + wide.max(high));
        }
        self.target = bounds.center();
        self.distance = if distance > 0.0 { 1.08 * distance } else { 1.0 }.clamp(DISTANCE[0], DISTANCE[1]);
    }

    /// The camera a part `t` (0..=1) of the way to `other`, for moves that the eye can follow. Projection and orbit are
    /// `other`'s.
    #[must_use]
    pub fn towards(&self, other: &Self, t: f64) -> Self {
        let t = t.clamp(0.0, 1.0);
        if t >= 1.0 {
            return *other;
        }
        Self {
            target: self.target.lerp(other.target, t),
            distance: self.distance * (other.distance / self.distance).powf(t),
            rotation: self.rotation.slerp(other.rotation, t),
            fov: self.fov + (other.fov - self.fov) * t,
            ..*other
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCREEN: Viewport = Viewport { width: 1200.0, height: 800.0 };

    fn cameras() -> Vec<Camera> {
        let mut out = Vec::new();
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for orbit in [Orbit::Turntable, Orbit::Trackball] {
                for axis in [Axis::Front, Axis::Top, Axis::Oblique] {
                    let mut camera =
                        Camera { projection, orbit, target: DVec3::new(3.0, -1.0, 2.0), ..Camera::default() };
                    camera.look_along(axis);
                    out.push(camera);
                }
            }
        }
        out
    }

    fn pixel(camera: &Camera, p: DVec3) -> DVec2 {
        View::new(camera, SCREEN, &Aabb::EMPTY).project(p).unwrap().pixel
    }

    #[test]
    fn orbit_keeps_the_pixel_and_depth_of_the_pivot() {
        let pivot = DVec3::new(2.0, 0.5, 3.0);
        for mut camera in cameras() {
            let before = View::new(&camera, SCREEN, &Aabb::EMPTY).project(pivot).unwrap();
            for i in 0..500 {
                camera.orbit(pivot, DVec2::new(f64::from(i % 13) - 4.0, f64::from(i % 7) - 4.0), SCREEN);
            }
            let after = View::new(&camera, SCREEN, &Aabb::EMPTY).project(pivot).unwrap();
            assert!(after.pixel.distance(before.pixel) < 1e-9 && (after.depth - before.depth).abs() < 1e-9);
        }
    }

    #[test]
    fn the_model_follows_the_hand() {
        // Dragging to the right moves what is in front of the pivot to the right; dragging down moves it down.
        for camera in cameras() {
            let front = camera.target - camera.forward();
            for drag in [DVec2::new(40.0, 0.0), DVec2::new(0.0, 40.0)] {
                let mut turned = camera;
                turned.orbit(camera.target, drag, SCREEN);
                let moved = pixel(&turned, front) - pixel(&camera, front);
                let pole = camera.orbit == Orbit::Turntable && camera.forward().z.abs() > 0.99;
                assert!(pole || moved.dot(drag) > 0.0, "{moved} for {drag}");
            }
        }
    }

    #[test]
    fn a_turntable_stays_upright_and_stops_at_the_pole() {
        let mut camera = Camera::default();
        camera.orbit(DVec3::ONE, DVec2::new(123.0, 5000.0), SCREEN);
        assert!((camera.forward().z + 1.0).abs() < 1e-12, "looking straight down");
        camera.orbit(DVec3::ONE, DVec2::new(-77.0, -300.0), SCREEN);
        assert!(camera.right().z.abs() < 1e-9 && camera.up().z > 0.0);
    }

    #[test]
    fn pan_keeps_the_grabbed_point_under_the_cursor() {
        for mut camera in cameras() {
            let grabbed = DVec3::new(2.4, 0.2, 1.1);
            let start = View::new(&camera, SCREEN, &Aabb::EMPTY).project(grabbed).unwrap();
            let mut cursor = start.pixel;
            for i in 0..200 {
                let next = cursor + DVec2::new(f64::from(i % 9) - 3.0, f64::from(i % 5) - 2.5);
                camera.pan(SCREEN, start.depth, cursor, next);
                cursor = next;
                assert!(pixel(&camera, grabbed).distance(cursor) < 1e-9);
            }
        }
    }

    #[test]
    fn zoom_keeps_the_anchor_under_the_cursor_and_never_passes_it() {
        for mut camera in cameras() {
            let anchor = DVec3::new(2.4, 0.2, 1.1);
            let before = pixel(&camera, anchor);
            for step in 0..100 {
                camera.zoom(anchor, if step < 60 { 0.85 } else { 1.3 });
                assert!(pixel(&camera, anchor).distance(before) < 1e-7);
            }
        }
        let mut camera = Camera::default();
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(camera.zoom(DVec3::ZERO, factor), 1.0);
        }
        for _ in 0..1000 {
            camera.zoom(DVec3::ONE, 0.5);
        }
        assert!(camera.distance > 0.0 && camera.eye().is_finite());
    }

    #[test]
    fn a_framed_box_is_wholly_in_the_picture_and_fills_it() {
        let bounds = Aabb { min: DVec3::new(1e4, 5.0, -2.0), max: DVec3::new(1e4 + 7.0, 6.0, 2.0) };
        for mut camera in cameras() {
            for screen in [SCREEN, Viewport::new(300.0, 900.0)] {
                camera.frame(&bounds, screen);
                let view = View::new(&camera, screen, &bounds);
                let mut reach: f64 = 0.0;
                for i in 0..8 {
                    let pick = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
                    let at = view.project(bounds.min + bounds.size() * pick).unwrap().pixel;
                    let relative = ((at - screen.center()) / screen.center()).abs();
                    reach = reach.max(relative.max_element());
                }
                assert!(reach < 1.0 && reach > 0.85, "{reach}");
            }
        }
    }

    #[test]
    fn both_projections_show_the_target_at_the_same_size() {
        let camera = Camera::default();
        let flat = Camera { projection: Projection::Orthographic, ..camera };
        let beside = camera.target + camera.right() * 0.7;
        assert!(pixel(&camera, beside).distance(pixel(&flat, beside)) < 1e-9);
    }

    #[test]
    fn axis_views_show_their_axes() {
        let mut camera = Camera::default();
        for (axis, right, up) in [
            (Axis::Front, DVec3::X, DVec3::Z),
            (Axis::Back, DVec3::NEG_X, DVec3::Z),
            (Axis::Right, DVec3::Y, DVec3::Z),
            (Axis::Left, DVec3::NEG_Y, DVec3::Z),
            (Axis::Top, DVec3::X, DVec3::Y),
            (Axis::Bottom, DVec3::X, DVec3::NEG_Y),
        ] {
            camera.look_along(axis);
            assert!(camera.right().distance(right) < 1e-12 && camera.up().distance(up) < 1e-12, "{axis:?}");
        }
    }

    #[test]
    fn a_move_starts_and_ends_where_it_should() {
        let a = Camera::default();
        let mut b = a;
        b.look_along(Axis::Top);
        b.distance = 0.1;
        assert_eq!(a.towards(&b, 1.0), b);
        let half = a.towards(&b, 0.5);
        assert!((half.distance - 1.0).abs() < 1e-12 && (half.rotation.length() - 1.0).abs() < 1e-12);
    }
}
