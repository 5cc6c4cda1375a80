//! Collinear-normal points of two patches, polished on the exact surfaces, and the relative second fundamental form.
//!
//! Newton's method on the gradient of the gap, in the tangent plane of A at the current point, with the foot on B
//! found again in every iteration (plain Newton on the four binormal equations fails near tangency). The Hessian of
//! the gap is the difference of the two second fundamental forms as graphs over that plane. Accuracy along the
//! surfaces: about eps / |relative curvature|.

use glam::{DMat2, DVec2, DVec3};

use super::correct::PointPair;
use super::gap_fit::{foot_along, frame_across};
use super::piece::{Jet2, Patch};

/// A point of A, its foot on B along A's normal, and how the surfaces differ there to second order.
#[derive(Clone, Copy, Debug)]
pub struct Binormal {
    /// The parameters.
    pub at: PointPair,
    /// The point on A.
    pub p: DVec3,
    /// A's unit normal.
    pub n: DVec3,
    /// Two unit vectors across it.
    pub frame: [DVec3; 2],
    /// (A - B) . n.
    pub gap: f64,
    /// The gradient of the gap in the frame.
    pub gradient: DVec2,
    /// The relative second fundamental form in the frame: xx, xy, yy.
    pub form: [f64; 3],
}

impl Binormal {
    /// The eigenvalue of the form that is larger in magnitude, with its direction in the frame, and the other one.
    pub fn principal(&self) -> (f64, DVec2, f64) {
        let [a, b, c] = self.form;
        let (mean, radius) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
        let e = DVec2::from_angle(0.5 * (2.0 * b).atan2(a - c));
        if mean >= 0.0 { (mean + radius, e, mean - radius) } else { (mean - radius, e.perp(), mean + radius) }
    }

    /// A direction of the frame in space.
    pub fn in_space(&self, d: DVec2) -> DVec3 {
        self.frame[0] * d.x + self.frame[1] * d.y
    }
}

/// The graph of a jet over the frame: the matrix from parameters to the plane, the gradient and the Hessian.
fn graph(jet: &Jet2, n: DVec3, frame: [DVec3; 2]) -> Option<(DMat2, DVec2, [f64; 3])> {
    let [e1, e2] = frame;
    let plane = |v: DVec3| DVec2::new(v.dot(e1), v.dot(e2));
    let m = DMat2::from_cols(plane(jet.u), plane(jet.v));
    let scale = jet.u.length() * jet.v.length();
    if !(m.determinant().abs() > 1e-10 * scale) {
        return None;
    }
    let inverse = m.inverse();
    let cross = jet.u.cross(jet.v);
    let gradient = -plane(cross) / cross.dot(n);
    let second = jet.second.map(|d| d.dot(n) - gradient.dot(plane(d)));
    let h = DMat2::from_cols(DVec2::new(second[0], second[1]), DVec2::new(second[1], second[2]));
    let h = inverse.transpose() * h * inverse;
    Some((m, gradient, [h.x_axis.x, h.x_axis.y, h.y_axis.y]))
}

/// Looks at one point of A and its foot on B.
pub fn look(a: &impl Patch, b: &impl Patch, at: PointPair) -> Option<(Binormal, DMat2)> {
    let ja = a.jet2(at.uv);
    let n = ja.u.cross(ja.v).normalize_or_zero();
    if n == DVec3::ZERO {
        return None;
    }
    let frame = frame_across(n);
    let (st, _) = foot_along(b, ja.p, frame, at.st)?;
    let jb = b.jet2(st);
    let (m, gradient_a, form_a) = graph(&ja, n, frame)?;
    let (_, gradient_b, form_b) = graph(&jb, n, frame)?;
    let form = [form_a[0] - form_b[0], form_a[1] - form_b[1], form_a[2] - form_b[2]];
    let at = PointPair { uv: at.uv, st };
    let gap = (ja.p - jb.p).dot(n);
    Some((Binormal { at, p: 0.5 * (ja.p + jb.p), n, frame, gap, gradient: gradient_a - gradient_b, form }, m))
}

/// The collinear-normal point near `start`; with `ridge`, only across the direction in which the form is largest: the
/// floor of a valley. Steps are at most `reach`.
pub fn polish(a: &impl Patch, b: &impl Patch, start: PointPair, reach: f64, ridge: bool) -> Option<Binormal> {
    let mut at = start;
    let mut last = f64::INFINITY;
    for _ in 0..40 {
        let (look, m) = look(a, b, at)?;
        let step = if ridge {
            let (k, e, _) = look.principal();
            if k == 0.0 {
                return Some(look);
            }
            -e * (look.gradient.dot(e) / k)
        } else {
            let [xx, xy, yy] = look.form;
            let h = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy));
            if h.determinant() == 0.0 {
                return Some(look);
            }
            -(h.inverse() * look.gradient)
        };
        let length = step.length();
        if !length.is_finite() {
            return None;
        }
        if length < 1e-15 || (length < 1e-8 && length >= 0.5 * last) {
            return Some(look);
        }
        let step = step * (reach / length).min(1.0);
        at = PointPair { uv: look.at.uv + m.inverse() * step, st: look.at.st };
        if (at.uv - 0.5).abs().max_element() > 2.0 {
            return None;
        }
        last = length;
    }
    None
}
