//! A node: rectangle-swept sphere, bounding sphere and normal cone of a subpatch, in one cache line.
//!
//! All coordinates are `f32` relative to the owner's `f64` origin, rounded outward: whatever rounding moves is
//! added to the radii, so that the stored volumes contain the subpatch. The normal cone is its axis scaled by
//! 1 + sin of the half angle, which keeps seven digits of small angles; the zero vector means that no cone of less
//! than a half space is known.

use glam::DVec3;
use pulp::Simd;

use super::fit::Fitted;
use super::rectangle::Rectangle;
use crate::kernel::num::lanes::F3;

/// Bounds of the normals of a subpatch: all lie within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Unit axis.
    pub axis: DVec3,
    /// Sine of the half angle, below 1.
    pub sin: f64,
}

impl NormalCone {
    /// Whether no normal of one cone is parallel to one of the other, the same or the opposite way.
    pub fn apart(&self, other: &Self) -> bool {
        // sin and cos of the sum of the half angles, against the angle between the axes as lines.
        let cos = |s: f64| (1.0 - s * s).max(0.0).sqrt();
        let (ca, cb) = (cos(self.sin), cos(other.sin));
        let cos_sum = ca * cb - self.sin * other.sin;
        cos_sum > 0.0 && self.axis.dot(other.axis).abs() < cos_sum - 1e-12
    }

    /// The half angle in radians.
    pub fn half_angle(&self) -> f64 {
        self.sin.min(1.0).asin()
    }

    /// Whether a unit vector lies in it.
    pub fn contains(&self, normal: DVec3) -> bool {
        self.axis.dot(normal) > 0.0 && self.axis.cross(normal).length() <= self.sin
    }
}

/// A node. 64 bytes; see the module's text.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Node {
    center: [f32; 3],
    axes: [[f32; 3]; 2],
    half: [f32; 2],
    radius: f32,
    sphere: f32,
    cone: [f32; 3],
}

impl Node {
    /// The node of one lane of a fit.
    #[inline(always)]
    pub(crate) fn of_lane<S: Simd>(fitted: &Fitted<S>, lane: usize) -> Self {
        Self {
            center: lane_vector(&fitted.center, lane),
            axes: [lane_vector(&fitted.axes[0], lane), lane_vector(&fitted.axes[1], lane)],
            half: [fitted.half[0].lanes()[lane] as f32, fitted.half[1].lanes()[lane] as f32],
            radius: fitted.radius.lanes()[lane] as f32,
            sphere: fitted.sphere.lanes()[lane] as f32,
            cone: lane_vector(&fitted.cone, lane),
        }
    }

    /// A node from a rectangle and a cone, without radii yet.
    pub(crate) fn rounded(center: DVec3, axes: [DVec3; 2], half: [f64; 2], cone: Option<NormalCone>) -> Self {
        let f = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32];
        Self {
            center: f(center),
            axes: axes.map(f),
            half: half.map(|h| (h * (1.0 + 1.3e-7)) as f32),
            cone: cone.filter(|c| c.sin < 0.9999).map_or([0.0; 3], |c| f(c.axis * (1.0 + c.sin + 1e-6))),
            ..Self::default()
        }
    }

    /// Sets both radii, rounded outward, with room for directions that are not exactly orthonormal.
    pub(crate) fn set_radii(&mut self, swept: f64, sphere: f64) {
        let room = 4e-7 * (sphere + self.half[0].max(self.half[1]) as f64);
        self.radius = ((swept + room) * (1.0 + 1.3e-7)) as f32;
        self.sphere = ((sphere + room) * (1.0 + 1.3e-7)) as f32;
    }

    /// The centre of rectangle and sphere, relative to the owner's origin.
    #[inline]
    pub fn center(&self) -> DVec3 {
        vector(self.center)
    }

    /// The spanning directions of the rectangle as they are stored: unit and orthogonal to about 1e-7.
    #[inline]
    pub fn axes(&self) -> [DVec3; 2] {
        self.axes.map(vector)
    }

    /// Half the edge lengths of the rectangle.
    #[inline]
    pub fn half(&self) -> [f64; 2] {
        self.half.map(f64::from)
    }

    /// The radius of the sphere that sweeps the rectangle.
    #[inline]
    pub fn radius(&self) -> f64 {
        f64::from(self.radius)
    }

    /// The radius of the bounding sphere around [`Self::center`].
    #[inline]
    pub fn sphere_radius(&self) -> f64 {
        f64::from(self.sphere)
    }

    /// The rectangle with exactly orthonormal directions.
    pub fn rectangle(&self) -> Rectangle {
        Rectangle::new(self.center(), self.axes(), self.half())
    }

    /// Whether the swept sphere contains a point given relative to the owner's origin.
    pub fn contains(&self, p: DVec3) -> bool {
        self.rectangle().distance_to(p) <= self.radius()
    }

    /// The normal cone; `None` when it is not known to be within a half space.
    #[inline]
    pub fn cone(&self) -> Option<NormalCone> {
        let v = vector(self.cone);
        let length = v.length();
        (length >= 1.0).then(|| NormalCone { axis: v / length, sin: length - 1.0 })
    }
}

#[inline]
fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]))
}

#[inline(always)]
fn lane_vector<S: Simd>(v: &F3<S>, lane: usize) -> [f32; 3] {
    [v.x.lanes()[lane] as f32, v.y.lanes()[lane] as f32, v.z.lanes()[lane] as f32]
}
