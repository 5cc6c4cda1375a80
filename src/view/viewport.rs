//! One look at a scene: a camera, the size of the picture and a depth range, with the maps between world and
//! pixels.
//!
//! Pixels count from the upper left corner, x to the right, y down; the centre of the first pixel is
//! (0.5, 0.5). Depth is the distance from the eye's plane along the line of sight, in model units. Clip depth is
//! reversed (1 at the near plane, 0 at the far one), which spreads the digits of a float depth buffer evenly.
//!
//! All of it is `f64`; only [`View::matrix`] rounds to `f32`, relative to an origin near the model, so that a
//! model far from zero draws as well as one at zero.

use glam::dcamera::rh::proj::directx;
use glam::{DMat4, DVec2, DVec3, Mat4};

use super::camera::{Camera, Projection};
use crate::kernel::geom::Aabb;

/// The size of the picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Pixels across.
    pub width: f64,
    /// Pixels down.
    pub height: f64,
}

impl Viewport {
    /// A picture of this many pixels; at least one each way, whatever a window being folded up says.
    pub fn new(width: f64, height: f64) -> Self {
        Self { width: width.max(1.0), height: height.max(1.0) }
    }

    /// Width over height.
    pub fn aspect(&self) -> f64 {
        self.width / self.height
    }

    /// The middle of the picture.
    pub fn center(&self) -> DVec2 {
        0.5 * DVec2::new(self.width, self.height)
    }
}

/// A half line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// The unit vector along which it runs.
    pub direction: DVec3,
}

impl Ray {
    /// The point at this distance from the start.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}

/// Where a point of the world is in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// The pixel.
    pub pixel: DVec2,
    /// The distance from the eye's plane along the line of sight.
    pub depth: f64,
}

/// A camera, a picture and a depth range. Make one a frame with [`View::new`].
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// The picture.
    pub viewport: Viewport,
    /// The depth of the near plane.
    pub near: f64,
    /// The depth of the far plane.
    pub far: f64,
    eye: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Half the picture's height at depth 1 (perspective) or at any depth (orthographic).
    half_height: f64,
}

impl View {
    /// A view whose depth range holds `scene` (an empty box is as good as any).
    pub fn new(camera: &Camera, viewport: Viewport, scene: &Aabb) -> Self {
        let forward = camera.forward();
        let eye = camera.eye();
        let (center, radius) =
            if scene.is_empty() { (camera.target, camera.distance) } else { (scene.center(), 0.5 * scene.diagonal()) };
        let radius = 1.05 * radius.max(1e-9 * camera.distance);
        let middle = (center - eye).dot(forward);
        let (near, far) = match camera.projection {
            Projection::Orthographic => (middle - radius, middle + radius),
            Projection::Perspective => {
                // A floor that goes with the distance to what is looked at lets the eye come as close as it likes,
                // and the rounded maximum keeps the near plane from jumping when the eye enters the model.
                let far = (middle + radius).max(2.0 * camera.distance);
                let floor = 1e-3 * camera.distance.min(far);
                let entry = middle - radius;
                (0.5 * (entry + floor + (entry - floor).hypot(floor)) / (1.0 + 1e-3), far)
            }
        };
        let tangent = (0.5 * camera.fov).tan();
        let half_height = match camera.projection {
            Projection::Perspective => tangent,
            Projection::Orthographic => tangent * camera.distance,
        };
        let (right, up) = (camera.right(), camera.up());
        Self { camera: *camera, viewport, near, far, eye, right, up, forward, half_height }
    }

    /// Where the eye is.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The unit vector along the line of sight.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// The pixel as offsets to the right and up from the line of sight, in units of half the height.
    fn offset(&self, pixel: DVec2) -> DVec2 {
        let from_center = (pixel - self.viewport.center()) * (2.0 / self.viewport.height);
        DVec2::new(from_center.x, -from_center.y)
    }

    /// The pixel and depth of a point; `None` when a perspective eye has it behind itself.
    pub fn project(&self, p: DVec3) -> Option<Projected> {
        let d = p - self.eye;
        let depth = d.dot(self.forward);
        let half_height = match self.camera.projection {
            Projection::Orthographic => self.half_height,
            Projection::Perspective if depth > 0.0 => self.half_height * depth,
            Projection::Perspective => return None,
        };
        let scale = 0.5 * self.viewport.height / half_height;
        let pixel = self.viewport.center() + scale * DVec2::new(d.dot(self.right), -d.dot(self.up));
        pixel.is_finite().then_some(Projected { pixel, depth })
    }

    /// The point under a pixel at a depth.
    pub fn unproject(&self, pixel: DVec2, depth: f64) -> DVec3 {
        let offset = self.offset(pixel) * self.half_height_at(depth);
        self.eye + self.forward * depth + self.right * offset.x + self.up * offset.y
    }

    /// Half the picture's height at a depth, in model units.
    pub fn half_height_at(&self, depth: f64) -> f64 {
        match self.camera.projection {
            Projection::Orthographic => self.half_height,
            Projection::Perspective => self.half_height * depth,
        }
    }

    /// The size of a pixel at a depth, in model units.
    pub fn pixel_size_at(&self, depth: f64) -> f64 {
        2.0 * self.half_height_at(depth) / self.viewport.height
    }

    /// The line of sight through a pixel, starting on the near plane.
    pub fn ray(&self, pixel: DVec2) -> Ray {
        let offset = self.offset(pixel) * self.half_height;
        let origin = self.unproject(pixel, self.near);
        let direction = match self.camera.projection {
            Projection::Orthographic => self.forward,
            Projection::Perspective => (self.forward + self.right * offset.x + self.up * offset.y).normalize(),
        };
        Ray { origin, direction }
    }

    /// The depth of a point.
    pub fn depth(&self, p: DVec3) -> f64 {
        (p - self.eye).dot(self.forward)
    }

    /// The smallest pixel in a box, that is how large one is where the box comes nearest to the eye; what decides
    /// the level of detail. Infinite for a box that is wholly outside the picture.
    pub fn pixel_size_in(&self, bounds: &Aabb) -> f64 {
        if bounds.is_empty() || !self.may_see(bounds) {
            return f64::INFINITY;
        }
        let half = 0.5 * bounds.size();
        let middle = self.depth(bounds.center());
        let reach = half.dot(self.forward.abs());
        self.pixel_size_at((middle - reach).max(self.near))
    }

    /// Whether a box may be in the picture: false only where one of its sides has the whole box outside.
    pub fn may_see(&self, bounds: &Aabb) -> bool {
        let (center, half) = (bounds.center() - self.eye, 0.5 * bounds.size());
        let across = self.half_height * self.viewport.aspect();
        [(self.right, across), (-self.right, across), (self.up, self.half_height), (-self.up, self.half_height)]
            .into_iter()
            .all(|(side, limit)| match self.camera.projection {
                // The plane's inner side is where forward * limit - side is positive.
                Projection::Perspective => {
                    let inward = self.forward * limit - side;
                    center.dot(inward) + half.dot(inward.abs()) >= 0.0
                }
                Projection::Orthographic => center.dot(side) - half.dot(side.abs()) <= limit,
            })
            && (self.camera.projection == Projection::Orthographic
                || center.dot(self.forward) + half.dot(self.forward.abs()) >= 0.0)
    }

    /// World to clip coordinates for points given relative to `origin`, in `f64`.
    pub fn matrix_f64(&self, origin: DVec3) -> DMat4 {
        // Near and far change places: that is reversed depth.
        let projection = match self.camera.projection {
            Projection::Perspective => {
                directx::perspective(self.camera.fov, self.viewport.aspect(), self.far, self.near)
            }
            Projection::Orthographic => {
                let (h, w) = (self.half_height, self.half_height * self.viewport.aspect());
                directx::orthographic(-w, w, -h, h, self.far, self.near)
            }
        };
        let d = origin - self.eye;
        let view = DMat4::from_cols(
            DVec3::new(self.right.x, self.up.x, -self.forward.x).extend(0.0),
            DVec3::new(self.right.y, self.up.y, -self.forward.y).extend(0.0),
            DVec3::new(self.right.z, self.up.z, -self.forward.z).extend(0.0),
            DVec3::new(d.dot(self.right), d.dot(self.up), -d.dot(self.forward)).extend(1.0),
        );
        projection * view
    }

    /// World to clip coordinates for points given relative to `origin`, for the graphics card.
    pub fn matrix(&self, origin: DVec3) -> Mat4 {
        self.matrix_f64(origin).as_mat4()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::camera::Axis;

    fn views() -> Vec<View> {
        let scene = Aabb { min: DVec3::new(-1.0, 2.0, 0.0), max: DVec3::new(3.0, 5.0, 2.0) };
        let mut out = Vec::new();
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for axis in [Axis::Front, Axis::Top, Axis::Oblique] {
                let viewport = Viewport::new(900.0, 600.0);
                let mut camera = Camera { projection, ..Camera::default() };
                camera.look_along(axis);
                camera.frame(&scene, viewport);
                out.push(View::new(&camera, viewport, &scene));
            }
        }
        out
    }

    #[test]
    fn pixels_and_points_are_inverse() {
        for view in views() {
            for pixel in [DVec2::new(0.0, 0.0), DVec2::new(450.0, 300.0), DVec2::new(811.5, 17.25)] {
                let depth = 0.5 * (view.near + view.far);
                let back = view.project(view.unproject(pixel, depth)).unwrap();
                assert!(back.pixel.distance(pixel) < 1e-9 && (back.depth - depth).abs() < 1e-9);
                let on_ray = view.project(view.ray(pixel).at(1.7)).unwrap();
                assert!(on_ray.pixel.distance(pixel) < 1e-9);
            }
        }
    }

    #[test]
    fn the_matrix_agrees_with_the_pixels_and_reverses_depth() {
        let origin = DVec3::new(100.0, -20.0, 3.0);
        for view in views() {
            let matrix = view.matrix_f64(origin);
            for (depth, expected) in [(view.near, 1.0), (view.far, 0.0)] {
                let pixel = DVec2::new(200.0, 100.0);
                let clip = matrix.project_point3(view.unproject(pixel, depth) - origin);
                assert!((clip.z - expected).abs() < 1e-9, "{clip}");
                let x = (clip.x + 1.0) * 0.5 * view.viewport.width;
                let y = (1.0 - clip.y) * 0.5 * view.viewport.height;
                assert!(DVec2::new(x, y).distance(pixel) < 1e-8);
            }
        }
    }

    #[test]
    fn nothing_of_the_scene_is_clipped_and_the_near_plane_moves_without_jumps() {
        let scene = Aabb { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
        let viewport = Viewport::new(640.0, 480.0);
        let mut camera = Camera::default();
        camera.frame(&scene, viewport);
        let mut last: Option<f64> = None;
        for _ in 0..400 {
            let view = View::new(&camera, viewport, &scene);
            assert!(0.0 < view.near && view.near < view.far);
            // What is looked at stays in the picture however close the eye comes.
            assert!(view.near < 0.9 * camera.distance && camera.distance < view.far);
            for i in 0..8 {
                let corner = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 2.0 - 1.0;
                let depth = view.depth(corner);
                assert!(depth <= view.far);
                assert!(depth > view.near || depth < 2e-3 * camera.distance, "{depth} {}", view.near);
            }
            if let Some(last) = last {
                // It never moves by more than the eye does.
                assert!((view.near - last).abs() < 0.04 * camera.distance, "{} after {last}", view.near);
            }
            last = Some(view.near);
            camera.distance *= 0.97;
        }
    }

    #[test]
    fn only_boxes_outside_the_picture_are_left_out() {
        for view in views() {
            let mut seen = [0, 0];
            for i in 0..400 {
                let spread = |k: u32| f64::from(i * 7919 % (97 + k)) / f64::from(96 + k) * 24.0 - 12.0;
                let center = DVec3::new(spread(0), spread(4), spread(10));
                let bounds = Aabb { min: center - 0.2, max: center + 0.2 };
                let inside = view
                    .project(center)
                    .is_some_and(|at| (0.0..=900.0).contains(&at.pixel.x) && (0.0..=600.0).contains(&at.pixel.y));
                assert!(!inside || view.may_see(&bounds));
                seen[usize::from(view.may_see(&bounds))] += 1;
            }
            assert!(seen[0] > 50 && seen[1] > 5, "{seen:?}");
        }
    }
}
