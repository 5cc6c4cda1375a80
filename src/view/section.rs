//! The section plane: what lies on the side to which its normal points is cut away; the mathematics of its
//! handle and of the line along which it cuts triangles.

use glam::{DVec2, DVec3};

use super::viewport::{Ray, View};
use crate::kernel::geom::Aabb;
use crate::kernel::mesh::tessellate::SurfaceMesh;

/// A plane that cuts away the half space to which its normal points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    point: DVec3,
    normal: DVec3,
}

impl SectionPlane {
    /// The plane through a point with a normal of any length; `None` when the normal is zero or a number is not
    /// finite.
    pub fn new(point: DVec3, normal: DVec3) -> Option<Self> {
        let normal = normal.try_normalize()?;
        point.is_finite().then_some(Self { point, normal })
    }

    /// The plane through the middle of a box, cutting away what is nearer to the eye, along the axis that is nearest
    /// to the line of sight.
    pub fn facing(view: &View, bounds: &Aabb) -> Self {
        let d = view.forward();
        let axis = d.abs().max_position();
        let mut normal = DVec3::ZERO;
        normal[axis] = if d[axis] > 0.0 { -1.0 } else { 1.0 };
        let point = if bounds.is_empty() { view.camera.target } else { bounds.center() };
        Self { point, normal }
    }

    /// Where its handle is.
    pub fn point(&self) -> DVec3 {
        self.point
    }

    /// The unit normal; what it points to is cut away.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// The signed distance of a point; positive is cut away.
    pub fn height(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }

    /// The plane as (normal, d) with `normal . (p - origin) + d > 0` cut away, for the graphics card.
    pub fn equation(&self, origin: DVec3) -> [f64; 4] {
        self.normal.extend((origin - self.point).dot(self.normal)).to_array()
    }

    /// The same plane cutting away the other side.
    #[must_use]
    pub fn flipped(&self) -> Self {
        Self { normal: -self.normal, ..*self }
    }

    /// The plane moved along its normal.
    #[must_use]
    pub fn moved(&self, distance: f64) -> Self {
        Self { point: self.point + self.normal * distance, ..*self }
    }

    /// The part `[from, to]` of a ray that is kept, `None` when none of it is.
    pub fn kept(&self, ray: &Ray) -> Option<[f64; 2]> {
        let (start, slope) = (self.height(ray.origin), self.normal.dot(ray.direction));
        if slope == 0.0 {
            return (start <= 0.0).then_some([0.0, f64::INFINITY]);
        }
        let crossing = -start / slope;
        if slope > 0.0 {
            (crossing >= 0.0).then_some([0.0, crossing])
        } else {
            Some([crossing.max(0.0), f64::INFINITY])
        }
    }

    /// How far along its normal the plane goes when its handle is dragged from one pixel to another: the handle stays
    /// under the cursor as well as the direction of the normal in the picture allows. Seen along the normal
    /// (under about 3 degrees) there is no such direction, and up in the picture moves against the line of sight.
    pub fn dragged(&self, view: &View, from: DVec2, to: DVec2) -> Self {
        let depth = view.depth(self.point).max(view.near);
        let size = view.pixel_size_at(depth);
        let Some(start) = view.project(self.point) else { return *self };
        let step = 10.0 * size;
        let across = view.project(self.point + self.normal * step).map_or(DVec2::ZERO, |p| p.pixel - start.pixel);
        let delta = to - from;
        if across.length() < 0.5 {
            let along = self.normal.dot(view.forward());
            return self.moved(delta.y * size * if along > 0.0 { -1.0 } else { 1.0 });
        }
        // Two closest points: of the line of the normal to the lines of sight before and after.
        match (self.along(&view.ray(from)), self.along(&view.ray(to))) {
            (Some(a), Some(b)) => self.moved(b - a),
            _ => *self,
        }
    }

    /// The place on the line of the normal that is nearest to a ray's line.
    fn along(&self, ray: &Ray) -> Option<f64> {
        let c = self.normal.dot(ray.direction);
        let d = self.point - ray.origin;
        let det = 1.0 - c * c;
        (det > 1e-6).then(|| (c * ray.direction.dot(d) - self.normal.dot(d)) / det)
    }

    /// The segments along which it cuts the triangles of a mesh: the cap line.
    pub fn cap_line(&self, mesh: &SurfaceMesh) -> Vec<[DVec3; 2]> {
        let heights: Vec<f64> = mesh.points.iter().map(|&p| self.height(p)).collect();
        let mut out = Vec::new();
        for t in mesh.triangles.iter() {
            let h = t.map(|k| heights[k as usize]);
            let p = t.map(|k| mesh.points[k as usize]);
            let mut ends = [DVec3::ZERO; 2];
            let mut n = 0;
            for k in 0..3 {
                let (a, b) = (k, (k + 1) % 3);
                // Half-open, so that a corner on the plane belongs to exactly one side.
                if (h[a] < 0.0) != (h[b] < 0.0) && n < 2 {
                    ends[n] = p[a].lerp(p[b], h[a] / (h[a] - h[b]));
                    n += 1;
                }
            }
            if n == 2 && ends[0] != ends[1] {
                out.push(ends);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Surface;
    use crate::kernel::mesh::tessellate::{TessellateOptions, tessellate};
    use crate::view::camera::{Axis, Camera, Projection};
    use crate::view::viewport::Viewport;

    fn view(projection: Projection, axis: Axis) -> View {
        let mut camera = Camera { projection, ..Camera::default() };
        camera.look_along(axis);
        View::new(&camera, Viewport::new(800.0, 600.0), &Aabb { min: DVec3::splat(-2.0), max: DVec3::splat(2.0) })
    }

    #[test]
    fn the_handle_follows_the_cursor_along_the_normal() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let view = view(projection, Axis::Oblique);
            let plane = SectionPlane::new(DVec3::new(0.3, 0.1, -0.2), DVec3::new(0.0, 2.0, 0.5)).unwrap();
            let from = view.project(plane.point()).unwrap().pixel;
            // To a pixel where the handle can be exactly: a point of the line of its normal.
            let goal = plane.moved(0.8);
            let to = view.project(goal.point()).unwrap().pixel;
            let dragged = plane.dragged(&view, from, to);
            assert!(dragged.point().distance(goal.point()) < 1e-9);
        }
    }

    #[test]
    fn seen_along_its_normal_it_still_moves() {
        let view = view(Projection::Orthographic, Axis::Top);
        let plane = SectionPlane::facing(&view, &Aabb::EMPTY);
        assert_eq!(plane.normal(), DVec3::Z);
        let moved = plane.dragged(&view, DVec2::new(10.0, 100.0), DVec2::new(10.0, 50.0));
        assert!(moved.height(plane.point()) != 0.0);
    }

    #[test]
    fn a_ray_is_kept_where_its_points_are() {
        let plane = SectionPlane::new(DVec3::new(0.0, 0.0, 1.0), DVec3::Z).unwrap();
        for (origin, direction) in
            [(DVec3::ZERO, DVec3::Z), (DVec3::Z * 3.0, -DVec3::Z), (DVec3::Z * 3.0, DVec3::Z), (DVec3::ZERO, DVec3::X)]
        {
            let ray = Ray { origin, direction };
            let kept = plane.kept(&ray);
            for i in 0..50 {
                let t = f64::from(i) * 0.11;
                let inside = kept.is_some_and(|[a, b]| a <= t && t <= b);
                assert_eq!(inside, plane.height(ray.at(t)) <= 0.0, "{t}");
            }
        }
    }

    #[test]
    fn the_cap_line_of_a_square_is_one_straight_line() {
        let square = Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]).unwrap();
        let mesh = tessellate(&square, &TessellateOptions::new(0.1));
        let plane = SectionPlane::new(DVec3::new(0.25, 0.0, 0.0), DVec3::X).unwrap();
        let lines = plane.cap_line(&mesh);
        let length: f64 = lines.iter().map(|l| l[0].distance(l[1])).sum();
        assert!((length - 1.0).abs() < 1e-12);
        assert!(lines.iter().flatten().all(|p| (p.x - 0.25).abs() < 1e-12));
    }

    #[test]
    fn no_plane_without_a_normal() {
        assert!(SectionPlane::new(DVec3::ZERO, DVec3::ZERO).is_none());
        assert!(SectionPlane::new(DVec3::NAN, DVec3::X).is_none());
    }
}
