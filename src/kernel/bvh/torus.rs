//! The osculating torus in curvature form, finite where the surface is flat.
//!
//! Thesis 2.4 and 4.1.3 give a torus its two radii, which go to infinity at parabolic and planar points (and print u
//! and v exchanged throughout (2.19)-(2.29)). Here it is a point, a frame and two curvatures, the meridian's along
//! e1 and the rotation's along e2. With the signed height over a circle of curvature k that touches the axis at 0,
//!
//! ```text
//! c(y, z, k) = (2z - k (y^2 + z^2)) / (1 + sqrt((1 - k z)^2 + (k y)^2)),
//! ```
//!
//! the signed distance to the sheet that touches is c(x, c(y, z, k2), k1). Points of the torus are addressed by
//! half-angle parameters s = 2 tan(angle / 2) / k along both circles: lengths at the contact point, plain coordinates
//! where k = 0, and rational, so that no angle is ever computed while a tree is built.

use glam::{DVec2, DVec3};

/// A torus patch that osculates a subpatch, with what it is known to miss by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OsculatingTorus {
    /// The contact point.
    pub point: DVec3,
    /// Unit directions of the meridian (tube) and of the rotation (spine).
    pub e: [DVec3; 2],
    /// The unit normal e1 x e2.
    pub normal: DVec3,
    /// Curvatures of the meridian and of the rotation at the contact point, positive towards the normal.
    pub k: [f64; 2],
    /// Half-angle parameters of every foot point lie within plus and minus these.
    pub half: [f64; 2],
    /// Half-angle parameters of the foot points of the corners (0,0), (1,0), (0,1), (1,1).
    pub corners: [DVec2; 4],
    /// No point of the subpatch is farther from the torus than this.
    pub deviation: f64,
    /// Sine of the largest angle between the normal of the subpatch and that of the torus at the foot point;
    /// infinite where no bound below a right angle is known.
    pub normal_sin: f64,
}

/// Signed height of (y, z) over the circle of curvature k that touches the y axis at 0 from above for k > 0.
#[inline]
pub(crate) fn height(y: f64, z: f64, k: f64) -> f64 {
    let (a, b) = (1.0 - k * z, k * y);
    (2.0 * z - k * (y * y + z * z)) / (1.0 + (a * a + b * b).sqrt())
}

/// Half-angle parameter of the foot of (y, z) on that circle; infinite at the far side.
#[inline]
pub(crate) fn half_angle(y: f64, z: f64, k: f64) -> f64 {
    let (a, b) = (1.0 - k * z, k * y);
    2.0 * y / (a + (a * a + b * b).sqrt())
}

/// The point of that circle at a half-angle parameter, as (y, z).
#[inline]
pub(crate) fn on_circle(s: f64, k: f64) -> (f64, f64) {
    let q = 0.25 * k * k * s * s;
    if q.is_finite() { (s / (1.0 + q), 0.5 * k * s * s / (1.0 + q)) } else { (0.0, 2.0 / k) }
}

impl OsculatingTorus {
    /// A point in the frame: (along e1, along e2, along the normal).
    pub fn local(&self, p: DVec3) -> DVec3 {
        let d = p - self.point;
        DVec3::new(d.dot(self.e[0]), d.dot(self.e[1]), d.dot(self.normal))
    }

    /// The signed distance of a point to the sheet that touches the surface, positive on the normal's side.
    pub fn distance(&self, p: DVec3) -> f64 {
        let d = self.local(p);
        height(d.x, height(d.y, d.z, self.k[1]), self.k[0])
    }

    /// The half-angle parameters of the foot point of `p`.
    pub fn project(&self, p: DVec3) -> DVec2 {
        let d = self.local(p);
        let w = height(d.y, d.z, self.k[1]);
        DVec2::new(half_angle(d.x, w, self.k[0]), half_angle(d.y, d.z, self.k[1]))
    }

    /// The point with the given half-angle parameters.
    pub fn eval(&self, st: DVec2) -> DVec3 {
        let (x, w) = on_circle(st.x, self.k[0]);
        let (y, z) = on_circle(st.y, self.k[1]);
        // Turning (0, w) about the rotation's axis at height 1 / k2.
        let k = self.k[1];
        let y_turned = y * (1.0 - k * w);
        let z_turned = z + w * (1.0 - k * z);
        self.point + self.e[0] * x + self.e[1] * y_turned + self.normal * z_turned
    }

    /// The unit normal there.
    pub fn normal_at(&self, st: DVec2) -> DVec3 {
        let (x, w) = on_circle(st.x, self.k[0]);
        let (y, z) = on_circle(st.y, self.k[1]);
        let (sin1, cos1) = (self.k[0] * x, 1.0 - self.k[0] * w);
        let (sin2, cos2) = (self.k[1] * y, 1.0 - self.k[1] * z);
        (self.normal * cos2 - self.e[1] * sin2) * cos1 - self.e[0] * sin1
    }

    /// Angles of the meridian and of the rotation at half-angle parameters, in radians.
    pub fn angles(&self, st: DVec2) -> [f64; 2] {
        [2.0 * (0.5 * self.k[0] * st.x).atan(), 2.0 * (0.5 * self.k[1] * st.y).atan()]
    }

    /// Half the angles of the patch along meridian and rotation, positions only.
    pub fn half_angles(&self) -> [f64; 2] {
        self.angles(DVec2::from(self.half)).map(f64::abs)
    }

    /// The largest angle between the subpatch's normal and the torus' normal at the foot point; at most pi.
    pub fn normal_deviation(&self) -> f64 {
        if self.normal_sin < 1.0 { self.normal_sin.asin() } else { std::f64::consts::PI }
    }

    /// Half the angles of the patch along meridian and rotation, large enough that the Gauss map of that patch
    /// contains every normal of the subpatch. Latitude widens longitude: near a pole of the Gauss sphere the
    /// rotation's angle is pi.
    pub fn half_angles_of_normals(&self) -> [f64; 2] {
        let [meridian, rotation] = self.half_angles();
        let grow = self.normal_deviation();
        let latitude = meridian + grow;
        // A cap of angle `grow` at latitude `meridian` spans asin(sin grow / cos meridian) of longitude.
        let widest = grow.sin() / meridian.cos();
        let longitude = if latitude < std::f64::consts::FRAC_PI_2 && widest < 1.0 {
            rotation + widest.asin()
        } else {
            std::f64::consts::PI
        };
        [latitude.min(std::f64::consts::PI), longitude.min(std::f64::consts::PI)]
    }

    /// The half-angle parameters that belong to (u, v) in the unit square: bilinear between the corners.
    pub fn matched(&self, uv: DVec2) -> DVec2 {
        let [a, b, c, d] = self.corners;
        a.lerp(b, uv.x).lerp(c.lerp(d, uv.x), uv.y)
    }

    /// The torus of the offset at distance d: the spine circle stays, the tube changes. `None` where the offset is
    /// singular at the contact point. Bounds are not carried over.
    pub fn offset(&self, d: f64) -> Option<Self> {
        let scale = self.k.map(|k| 1.0 - k * d);
        if scale.contains(&0.0) {
            return None;
        }
        Some(Self {
            point: self.point + self.normal * d,
            k: [self.k[0] / scale[0], self.k[1] / scale[1]],
            half: [self.half[0] * scale[0].abs(), self.half[1] * scale[1].abs()],
            corners: self.corners.map(|c| DVec2::new(c.x * scale[0], c.y * scale[1])),
            ..*self
        })
    }

    /// Major and minor radius, centre and axis of the whole torus, for display; `None` when a radius is infinite.
    pub fn radii(&self) -> Option<WholeTorus> {
        let [k1, k2] = self.k;
        (k1 != 0.0 && k2 != 0.0).then(|| WholeTorus {
            center: self.point + self.normal / k2,
            axis: self.e[0],
            major: (1.0 / k2 - 1.0 / k1).abs(),
            minor: (1.0 / k1).abs(),
        })
    }
}

/// A torus by its radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WholeTorus {
    /// The centre.
    pub center: DVec3,
    /// The unit axis.
    pub axis: DVec3,
    /// The radius of the spine circle.
    pub major: f64,
    /// The radius of the tube.
    pub minor: f64,
}

/// A leaf's torus as it is stored: 96 bytes, `f32`, the point relative to the centre of the leaf's node.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafTorus {
    point: [f32; 3],
    e1: [f32; 3],
    normal: [f32; 3],
    k: [f32; 2],
    half: [f32; 2],
    corners: [[f32; 2]; 4],
    deviation: f32,
    normal_sin: f32,
}

/// The numbers of a [`LeafTorus`].
pub(crate) const LEAF_NUMBERS: usize = 23;

impl LeafTorus {
    /// From its numbers, which are exactly representable or already rounded outward.
    #[inline(always)]
    pub(crate) fn from_numbers(n: &[f64; LEAF_NUMBERS]) -> Self {
        let mut f = [0.0; LEAF_NUMBERS];
        for i in 0..LEAF_NUMBERS {
            f[i] = n[i] as f32;
        }
        Self {
            point: [f[0], f[1], f[2]],
            e1: [f[3], f[4], f[5]],
            normal: [f[6], f[7], f[8]],
            k: [f[9], f[10]],
            half: [f[11], f[12]],
            corners: [[f[13], f[14]], [f[15], f[16]], [f[17], f[18]], [f[19], f[20]]],
            deviation: f[21],
            normal_sin: f[22],
        }
    }

    /// The deviation of position.
    pub fn deviation(&self) -> f64 {
        f64::from(self.deviation)
    }

    /// The torus; `center` is the centre of the leaf's node in the coordinates that the torus is wanted in.
    pub fn decode(&self, center: DVec3) -> OsculatingTorus {
        let vector = |v: [f32; 3]| DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
        let normal = vector(self.normal);
        let normal = normal / normal.length();
        let e1 = vector(self.e1);
        let e1 = e1 - normal * e1.dot(normal);
        let e1 = e1 / e1.length();
        OsculatingTorus {
            point: center + vector(self.point),
            e: [e1, normal.cross(e1)],
            normal,
            k: self.k.map(f64::from),
            half: self.half.map(f64::from),
            corners: self.corners.map(|[s, t]| DVec2::new(f64::from(s), f64::from(t))),
            deviation: f64::from(self.deviation),
            normal_sin: f64::from(self.normal_sin),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

    fn with(k: [f64; 2]) -> OsculatingTorus {
        let normal = DVec3::new(1.0, 2.0, -0.5).normalize();
        let e1 = normal.any_orthonormal_vector();
        OsculatingTorus {
            point: DVec3::new(3.0, -1.0, 2.0),
            e: [e1, normal.cross(e1)],
            normal,
            k,
            half: [1.0; 2],
            corners: [DVec2::ZERO; 4],
            deviation: 0.0,
            normal_sin: 0.0,
        }
    }

    #[test]
    fn the_curvature_form_is_the_distance_to_the_tube() {
        let mut random = Random(3);
        for k in [[1.0, 0.3], [-2.0, 0.5], [0.7, -0.2], [-1.0, -0.25]] {
            let torus = with(k);
            let whole = torus.radii().unwrap();
            for _ in 0..200 {
                let p = torus.point + random.vector() * 0.3;
                let d = p - whole.center;
                let along = d.dot(whole.axis);
                let out = (d - whole.axis * along).length();
                let signed = (out - whole.major).hypot(along) - whole.minor;
                assert!((signed.abs() - torus.distance(p).abs()).abs() < 1e-12, "{k:?}");
            }
        }
    }

    #[test]
    fn points_lie_on_the_torus_and_project_onto_themselves() {
        let mut random = Random(4);
        for k in [[0.0, 0.0], [0.0, 0.8], [-0.6, 0.0], [1e-12, -1e-9], [0.9, 0.3], [-0.7, 0.4]] {
            let torus = with(k);
            for _ in 0..100 {
                let st = DVec2::new(random.signed(), random.signed());
                let p = torus.eval(st);
                assert!(torus.distance(p).abs() < 1e-14 * 16.0, "{k:?}");
                assert!(torus.project(p).distance(st) < 1e-13 * 16.0, "{k:?}");
                // The distance grows with slope 1 along the normal.
                let n = torus.normal_at(st);
                assert!((n.length() - 1.0).abs() < 1e-14);
                let h = 1e-3;
                assert!((torus.distance(p + n * h) - h).abs() < 1e-13 * 16.0, "{k:?}");
                assert!(torus.project(p + n * h).distance(st) < 1e-12, "{k:?}");
            }
        }
    }

    #[test]
    fn an_offset_keeps_the_spine() {
        let torus = with([0.8, -0.3]);
        let (before, after) = (torus.radii().unwrap(), torus.offset(0.4).unwrap().radii().unwrap());
        assert!(before.center.distance(after.center) < 1e-12 && (before.major - after.major).abs() < 1e-12);
        assert!((after.minor - (before.minor - 0.4)).abs() < 1e-12);
        assert!(with([2.0, 0.0]).offset(0.5).is_none());
        let far = torus.eval(DVec2::new(0.3, -0.4));
        let moved = far + torus.normal_at(DVec2::new(0.3, -0.4)) * 0.4;
        assert!(torus.offset(0.4).unwrap().distance(moved).abs() < 1e-13);
    }
}
