//! Bezier patches: the polynomial (or rational) pieces of a B-spline surface.

use glam::{DVec2, DVec3, DVec4};

use super::{Aabb, Direction};

/// One Bezier piece, with the rectangle of the surface's domain that it covers.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPatch {
    /// Degrees in u and v.
    pub degree: [usize; 2],
    /// Homogeneous control points (w x, w y, w z, w), u running fastest: `points[j * (degree[0] + 1) + i]`.
    pub points: Vec<DVec4>,
    /// Whether any weight differs from 1.
    pub rational: bool,
    /// The parameters of the surface where this piece starts.
    pub low: DVec2,
    /// The parameters of the surface where this piece ends.
    pub high: DVec2,
}

impl BezierPatch {
    /// The Cartesian control points.
    pub fn control_points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.points.iter().map(|p| if self.rational { p.truncate() / p.w } else { p.truncate() })
    }

    /// A box around the control points, hence around the patch.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.control_points())
    }

    /// The surface parameters of local coordinates in [0, 1]^2.
    pub fn to_surface(&self, local: DVec2) -> DVec2 {
        self.low + (self.high - self.low) * local
    }

    /// The point at local coordinates in [0, 1]^2, by de Casteljau.
    pub fn eval(&self, local: DVec2) -> DVec3 {
        let width = self.degree[0] + 1;
        let mut column: Vec<DVec4> = self.points.chunks(width).map(|row| casteljau(row.to_vec(), local.x)).collect();
        column.truncate(self.degree[1] + 1);
        let p = casteljau(column, local.y);
        if self.rational { p.truncate() / p.w } else { p.truncate() }
    }

    /// The two halves at local coordinate `t` along a direction.
    pub fn split(&self, direction: Direction, t: f64) -> [Self; 2] {
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        let (mut low, mut high) = (self.clone(), self.clone());
        let (count, length, stride, step) = match direction {
            Direction::U => (height, width, 1, width),
            Direction::V => (width, height, width, 1),
        };
        for line in 0..count {
            let at = |i: usize| line * step + i * stride;
            for level in 1..length {
                for i in 0..length - level {
                    let next = high.points[at(i)] + (high.points[at(i + 1)] - high.points[at(i)]) * t;
                    high.points[at(i)] = next;
                }
                low.points[at(level)] = high.points[at(0)];
            }
        }
        let middle = self.to_surface(DVec2::splat(t));
        match direction {
            Direction::U => (low.high.x, high.low.x) = (middle.x, middle.x),
            Direction::V => (low.high.y, high.low.y) = (middle.y, middle.y),
        }
        [low, high]
    }
}

fn casteljau(mut points: Vec<DVec4>, t: f64) -> DVec4 {
    for level in (1..points.len()).rev() {
        for i in 0..level {
            points[i] = points[i] + (points[i + 1] - points[i]) * t;
        }
    }
    points[0]
}
