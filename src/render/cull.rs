//! View-frustum culling of boxes, in the local coordinates of an item.
//!
//! The planes are read off the rows of projection x model-view (Gribb and Hartmann 2001); a box is outside when it
//! lies wholly behind one plane. Conservative: a box may be kept in vain, never dropped in vain.

use std::ops::Range;

use glam::{Mat4, Vec3, Vec4};

/// An axis-aligned box as centre and half extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub center: Vec3,
    pub half: Vec3,
}

impl Bounds {
    /// The box of some points; `None` without a finite one.
    pub fn of<'a>(points: impl IntoIterator<Item = &'a [f32; 3]>) -> Option<Self> {
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for p in points {
            let p = Vec3::from_array(*p);
            min = min.min(p);
            max = max.max(p);
        }
        (min.is_finite() && max.is_finite()).then(|| Self { center: (min + max) * 0.5, half: (max - min) * 0.5 })
    }

    pub fn union(self, other: Self) -> Self {
        let min = (self.center - self.half).min(other.center - other.half);
        let max = (self.center + self.half).max(other.center + other.half);
        Self { center: (min + max) * 0.5, half: (max - min) * 0.5 }
    }
}

/// A run of indices or instances with the box around what it draws.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub range: Range<u32>,
    pub bounds: Bounds,
}

/// Left, right, bottom, top and near plane. There is no far plane: reversed depth may have it at infinity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    planes: [Vec4; 5],
}

/// How a box lies to the frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Outside,
    Crossing,
    Inside,
}

impl Frustum {
    /// The frustum of a local-to-clip matrix, grown by `margin` pixels' worth of clip space on the four sides
    /// (lines and glyphs reach beyond their points).
    pub fn new(clip: &Mat4, margin: [f32; 2]) -> Self {
        let [x, y, z, w] = [clip.row(0), clip.row(1), clip.row(2), clip.row(3)];
        let (mx, my) = (1.0 + margin[0], 1.0 + margin[1]);
        Self { planes: [w * mx + x, w * mx - x, w * my + y, w * my - y, w - z] }
    }

    pub fn side(&self, b: &Bounds) -> Side {
        let mut side = Side::Inside;
        for plane in &self.planes {
            let n = plane.truncate();
            let at = n.dot(b.center) + plane.w;
            let reach = n.abs().dot(b.half);
            // A NaN matrix keeps everything.
            if at < -reach {
                return Side::Outside;
            }
            if at < reach {
                side = Side::Crossing;
            }
        }
        side
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::CameraData;
    use glam::DVec3;

    #[test]
    fn boxes_before_beside_and_behind_the_eye() {
        let camera = CameraData::perspective(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y, 1.0, 1.0, 0.1);
        let clip = (camera.projection * camera.view).as_mat4();
        let frustum = Frustum::new(&clip, [0.0; 2]);
        let at = |x: f32, y: f32, z: f32| Bounds { center: Vec3::new(x, y, z), half: Vec3::splat(0.5) };
        assert_eq!(frustum.side(&at(0.0, 0.0, 0.0)), Side::Inside);
        assert_eq!(frustum.side(&at(0.0, 0.0, -1e6)), Side::Inside);
        assert_eq!(frustum.side(&at(0.0, 0.0, 12.0)), Side::Outside);
        assert_eq!(frustum.side(&at(0.0, 0.0, 10.0)), Side::Crossing);
        // Half the field of view is 0.5 rad: at distance 10 the edge is at 10 tan(0.5) = 5.463, and at
        // 5.736 on the far side of a box of half size 0.5.
        assert_eq!(frustum.side(&at(6.4, 0.0, 0.0)), Side::Outside);
        assert_eq!(frustum.side(&at(0.0, -5.4, 0.0)), Side::Crossing);
        assert_eq!(frustum.side(&at(0.0, 4.6, 0.0)), Side::Inside);
    }
}
