//! A box swept by a sphere: the one form behind all bounding volumes that are shown. With no third extent it is a
//! rectangle-swept sphere (Thesis 4.1), with no extent at all a sphere, with no radius a box.

use glam::{DVec2, DVec3};

use super::camera::Projection;
use super::viewport::{Ray, View};
use crate::kernel::bvh::Node;
use crate::kernel::geom::Aabb;

/// See the module's text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedBox {
    /// Its middle.
    pub center: DVec3,
    /// Unit directions of its edges; the third is their cross product.
    pub axes: [DVec3; 2],
    /// Half the edge lengths along the three directions.
    pub half: DVec3,
    /// The radius of the sphere.
    pub radius: f64,
}

/// Steps of a ray towards a rounded box before it counts as missed.
const STEPS: usize = 96;

impl RoundedBox {
    /// The rectangle-swept sphere of a node whose coordinates are relative to `origin`.
    pub fn swept(node: &Node, origin: DVec3) -> Self {
        let rectangle = node.rectangle();
        let [a, b] = rectangle.half;
        Self {
            center: origin + rectangle.center,
            axes: rectangle.axes,
            half: DVec3::new(a, b, 0.0),
            radius: node.radius(),
        }
    }

    /// The bounding sphere of such a node.
    pub fn sphere(node: &Node, origin: DVec3) -> Self {
        let rectangle = node.rectangle();
        Self {
            center: origin + rectangle.center,
            axes: rectangle.axes,
            half: DVec3::ZERO,
            radius: node.sphere_radius(),
        }
    }

    /// A box along the axes.
    pub fn aligned(bounds: &Aabb) -> Self {
        let half = 0.5 * bounds.size();
        Self { center: bounds.center(), axes: [DVec3::X, DVec3::Y], half, radius: 0.0 }
    }

    /// The three directions.
    pub fn frame(&self) -> [DVec3; 3] {
        let [u, v] = self.axes;
        [u, v, u.cross(v)]
    }

    /// The signed distance to a point, negative inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        let local = DVec3::from(self.frame().map(|e| e.dot(p - self.center)));
        let over = local.abs() - self.half;
        over.max(DVec3::ZERO).length() + over.max_element().min(0.0) - self.radius
    }

    /// How far along a ray it is met first; `None` when it is missed. The distance is exact, so a ray may go as far as
    /// it says (Hart, Sphere tracing, 1996).
    pub fn hit(&self, ray: &Ray) -> Option<f64> {
        let reach = self.half.length() + self.radius;
        let along = (self.center - ray.origin).dot(ray.direction);
        let off = (self.center - ray.at(along)).length();
        if off > reach {
            return None;
        }
        let chord = (reach * reach - off * off).sqrt();
        let (mut t, end) = ((along - chord).max(0.0), along + chord);
        for _ in 0..STEPS {
            let d = self.distance(ray.at(t));
            if d <= 1e-6 * reach {
                return Some(t);
            }
            t += d;
            if t > end {
                return None;
            }
        }
        None
    }

    /// The silhouette in the picture, closed, with `arcs` pieces a quarter: that of the box's projection, moved out by
    /// the radius. Exact for parallel projection, to first order in its size for perspective. Empty when it is not before the eye.
    pub fn silhouette(&self, view: &View, arcs: usize) -> Vec<DVec2> {
        let Some(middle) = view.project(self.center).filter(|m| m.depth > view.near) else { return Vec::new() };
        let pixels = 1.0 / view.pixel_size_at(middle.depth);
        let (right, up) = (view.camera.right(), view.camera.up());
        let off = middle.pixel - view.viewport.center();
        // Steps away from a perspective eye also lead towards the middle of the picture.
        let closer = match view.camera.projection {
            Projection::Perspective => view.camera.forward() / middle.depth,
            Projection::Orthographic => DVec3::ZERO,
        };
        let flat = |d: DVec3| DVec2::new(d.dot(right), -d.dot(up)) * pixels - off * d.dot(closer);
        let steps = self.frame();
        let sides = [0, 1, 2].map(|k| flat(steps[k] * self.half[k]));
        let around = 4 * arcs.max(1);
        let mut out: Vec<DVec2> = Vec::with_capacity(around + 1);
        // The point of the outline farthest in each direction: a corner, and the radius beyond it.
        for k in 0..=around {
            let direction = DVec2::from_angle(k as f64 / around as f64 * std::f64::consts::TAU);
            let corner: DVec2 = sides.iter().map(|s| *s * s.dot(direction).signum()).sum();
            out.push(middle.pixel + corner + direction * (self.radius * pixels));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::camera::Camera;
    use crate::view::viewport::Viewport;

    fn swept() -> RoundedBox {
        let axes = [DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0)];
        RoundedBox { center: DVec3::new(1.0, -2.0, 0.5), axes, half: DVec3::new(2.0, 1.0, 0.0), radius: 0.4 }
    }

    #[test]
    fn the_distance_of_a_swept_rectangle_is_that_of_the_rectangle_less_the_radius() {
        let b = swept();
        let rectangle = crate::kernel::bvh::Rectangle::new(b.center, b.axes, [b.half.x, b.half.y]);
        for k in 0..200 {
            let k = f64::from(k);
            let p = b.center + DVec3::new((k * 0.7).sin(), (k * 1.3).cos(), (k * 0.37).sin()) * 3.0;
            assert!((b.distance(p) - (rectangle.distance_to(p) - b.radius)).abs() < 1e-12);
        }
    }

    #[test]
    fn rays_meet_it_on_its_surface() {
        let b = swept();
        for k in 0..100 {
            let k = f64::from(k);
            let origin = b.center + DVec3::new(k.sin(), (1.7 * k).cos(), 1.5 + (0.3 * k).sin()).normalize() * 9.0;
            let toward = (b.center - origin).normalize();
            let t = b.hit(&Ray { origin, direction: toward }).unwrap();
            assert!(b.distance(origin + toward * t).abs() < 1e-5);
            // The first point: nothing of it is nearer.
            assert!((0..50).all(|i| b.distance(origin + toward * (t * f64::from(i) / 50.0)) > 0.0));
            let past = toward.any_orthonormal_vector();
            assert!(b.hit(&Ray { origin: origin + past * 8.0, direction: toward }).is_none());
        }
    }

    #[test]
    fn the_silhouette_touches_the_rays_that_graze_it() {
        let b = swept();
        let mut camera = Camera { projection: Projection::Orthographic, ..Camera::default() };
        let viewport = Viewport::new(500.0, 400.0);
        camera.target = b.center;
        let bounds = Aabb::of([b.center]).grown(3.0);
        let view = View::new(&camera, viewport, &bounds);
        for at in b.silhouette(&view, 12) {
            let out = (at - view.project(b.center).unwrap().pixel).normalize();
            assert!(b.hit(&view.ray(at - out * 0.5)).is_some(), "half a pixel inside");
            assert!(b.hit(&view.ray(at + out * 0.5)).is_none(), "half a pixel outside");
        }
    }

    #[test]
    fn under_perspective_the_silhouette_of_a_small_box_holds_its_corners() {
        let b = RoundedBox { half: DVec3::new(0.2, 0.1, 0.15), radius: 0.0, ..swept() };
        let viewport = Viewport::new(500.0, 400.0);
        let mut camera = Camera { distance: 12.0, ..Camera::default() };
        // Far from the middle of the picture.
        camera.target = b.center + camera.right() * 2.6 - camera.up() * 1.8;
        let view = View::new(&camera, viewport, &Aabb::of([b.center]).grown(3.0));
        let middle = view.project(b.center).unwrap().pixel;
        let outline = b.silhouette(&view, 90);
        let [u, v, w] = b.frame();
        let mut reach = 0.0_f64;
        for k in 0..8 {
            let s = |bit: i32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let corner = b.center + u * (s(0) * b.half.x) + v * (s(1) * b.half.y) + w * (s(2) * b.half.z);
            let pixel = view.project(corner).unwrap().pixel;
            let nearest = outline.iter().map(|p| p.distance(pixel)).fold(f64::INFINITY, f64::min);
            let inside = outline.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max) > (pixel - middle).length();
            assert!(nearest < 0.6 || inside, "{k}: {nearest}");
            reach = reach.max((pixel - middle).length());
        }
        let widest = outline.iter().map(|p| (*p - middle).length()).fold(0.0, f64::max);
        assert!((widest - reach).abs() < 0.03 * reach, "{widest} {reach}");
    }

    #[test]
    fn a_node_s_volumes_hold_its_patch() {
        use crate::kernel::bvh::{BvhOptions, SurfaceTree};
        let surface = crate::view::display::tests::sphere();
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 2, ..BvhOptions::default() }).unwrap();
        for id in tree.level(2) {
            let [low, high] = tree.rectangle(id);
            let p = surface.eval(0.5 * (low + high));
            for b in [RoundedBox::swept, RoundedBox::sphere].map(|f| f(tree.node(id), tree.origin(id))) {
                assert!(b.distance(p) <= 0.0);
            }
        }
    }
}
