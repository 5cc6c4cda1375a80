//! The point-pair corrector: Newton's method on A(u, v) = B(s, t) with one further condition.
//!
//! Four equations in four unknowns: three planes in space where they cross clearly, else elimination with row scaling and
//! partial pivoting. Quadratic where the surfaces
//! cross; near tangency the achievable accuracy along the surfaces is about eps / angle, and the corrector stops
//! when the steps no longer shrink. Nothing is clamped: callers decide what lies in a domain. Cost: 2-3 iterations
//! of two evaluations. It fails (`None`) when the system is singular, the steps do not shrink within
//! [`ITERATIONS`], or a parameter runs away.

use glam::{DVec2, DVec3};

use super::piece::{Jet1, Patch};

/// The most Newton steps that a correction takes.
pub const ITERATIONS: usize = 12;

/// The sine of the angle between the surfaces, times that between the curve and the plane, from which on a step is found by
/// products of normals.
const LEAST_DET: f64 = 1e-6;

/// Parameters on both surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointPair {
    /// On the first.
    pub uv: DVec2,
    /// On the second.
    pub st: DVec2,
}

impl PointPair {
    /// The four parameters in order u, v, s, t.
    pub fn to_array(self) -> [f64; 4] {
        [self.uv.x, self.uv.y, self.st.x, self.st.y]
    }

    /// The pair of four parameters u, v, s, t.
    pub fn from_array(x: [f64; 4]) -> Self {
        Self { uv: DVec2::new(x[0], x[1]), st: DVec2::new(x[2], x[3]) }
    }
}

/// The condition that makes the point of the curve unique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Condition {
    /// The midpoint of the two surface points lies in the plane through `point` across `direction`.
    Plane {
        /// A point of the plane.
        point: DVec3,
        /// Its unit normal.
        direction: DVec3,
    },
    /// One of the parameters u, v, s, t (0..4) has this value.
    Fixed(usize, f64),
}

/// A corrected point with what was evaluated there.
#[derive(Clone, Copy, Debug)]
pub struct Corrected {
    /// The parameters.
    pub at: PointPair,
    /// The first surface there.
    pub a: Jet1,
    /// The second surface there.
    pub b: Jet1,
    /// The distance of the two surface points.
    pub residual: f64,
}

impl Corrected {
    /// The point midway between the two surface points.
    pub fn point(&self) -> DVec3 {
        0.5 * (self.a.p + self.b.p)
    }

    /// The unit normals of both surfaces, zero where a surface is degenerate.
    pub fn normals(&self) -> [DVec3; 2] {
        [self.a.cross().normalize_or_zero(), self.b.cross().normalize_or_zero()]
    }
}

/// Moves `start` onto the intersection of the two surfaces under a condition. `floor` is the distance of the
/// surface points below which rounding reigns (some 1e-15 times the coordinates).
pub fn correct(
    a: &impl Patch,
    b: &impl Patch,
    start: PointPair,
    condition: Condition,
    floor: f64,
) -> Option<Corrected> {
    let mut x = start.to_array();
    let mut last = f64::INFINITY;
    let (mut polished, mut good) = (false, None);
    for _ in 0..ITERATIONS {
        let at = PointPair::from_array(x);
        let (ja, jb) = (a.jet1(at.uv), b.jet1(at.st));
        let residual = ja.p.distance(jb.p);
        if polished || !residual.is_finite() {
            return residual.is_finite().then_some(Corrected { at, a: ja, b: jb, residual });
        }
        let off = match condition {
            Condition::Plane { point, direction } => (0.5 * (ja.p + jb.p) - point).dot(direction).abs(),
            Condition::Fixed(k, value) => (value - x[k.min(3)]).abs() * [ja.u, ja.v, jb.u, jb.v][k.min(3)].length(),
        };
        let step = newton_step(&ja, &jb, at, condition)?;
        let length = (ja.u * step[0] + ja.v * step[1]).length() + (jb.u * step[2] + jb.v * step[3]).length();
        if residual <= floor && (length <= 1e-13 || (off <= 1e-12 && length >= 0.5 * last)) {
            return Some(Corrected { at, a: ja, b: jb, residual });
        }
        let turn = step.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        for (value, step) in x.iter_mut().zip(step) {
            *value += step;
        }
        // A step at the level of rounding is as good as linear: nothing is evaluated once more for it.
        if length < 1e-12 && turn < 1e-11 && residual < 1e-9 && length <= 0.5 * last {
            let a = Jet1 { p: ja.p + ja.u * step[0] + ja.v * step[1], ..ja };
            let b = Jet1 { p: jb.p + jb.u * step[2] + jb.v * step[3], ..jb };
            return Some(Corrected { at: PointPair::from_array(x), a, b, residual: a.p.distance(b.p) });
        }
        if x.iter().any(|v| !(v.abs() < 1e8)) {
            return None;
        }
        // One step after a small one is as good as Newton gets; near a pole small in space is not small in parameters.
        if length < 1e-9 && residual < 1e-9 && length <= 0.5 * last {
            polished = turn < 1e-9;
            good = Some(Corrected { at, a: ja, b: jb, residual });
        }
        last = length;
    }
    good
}

/// What Newton's method adds to the four parameters at which these jets were taken.
#[inline(always)]
pub fn newton_step(a: &Jet1, b: &Jet1, at: PointPair, condition: Condition) -> Option<[f64; 4]> {
    if let Condition::Plane { point, direction } = condition
        && let Some(step) = step_to_plane(a, b, point, direction)
    {
        return Some(step);
    }
    solve4(equations(a, b, &at.to_array(), condition))
}

/// The step for the plane: where it meets both tangent planes, in terms of the derivatives. `None` where the three planes
/// are too nearly dependent for products of their normals.
#[inline(always)]
fn step_to_plane(a: &Jet1, b: &Jet1, point: DVec3, direction: DVec3) -> Option<[f64; 4]> {
    let (na, nb) = (a.cross(), b.cross());
    let along = na.cross(nb);
    let det = along.dot(direction);
    let squares = [na.length_squared(), nb.length_squared()];
    if !(det * det > LEAST_DET * LEAST_DET * squares[0] * squares[1]) {
        return None;
    }
    let gap = b.p - a.p;
    // From the point of A and from that of B.
    let x = (direction.cross(na) * nb.dot(gap) + along * direction.dot(point - a.p)) / det;
    let y = x - gap;
    let (wa, wb) = (na / squares[0], nb / squares[1]);
    let step = [x.cross(a.v).dot(wa), a.u.cross(x).dot(wa), y.cross(b.v).dot(wb), b.u.cross(y).dot(wb)];
    Some(step)
}

/// The linear equations of a step: that both points be one, and the condition.
#[inline(always)]
fn equations(a: &Jet1, b: &Jet1, x: &[f64; 4], condition: Condition) -> [[f64; 5]; 4] {
    let gap = a.p - b.p;
    let mut rows = [[0.0; 5]; 4];
    for (k, row) in rows.iter_mut().take(3).enumerate() {
        *row = [a.u[k], a.v[k], -b.u[k], -b.v[k], -gap[k]];
    }
    match condition {
        Condition::Plane { point, direction } => {
            let off = (0.5 * (a.p + b.p) - point).dot(direction);
            rows[3] = [
                0.5 * a.u.dot(direction),
                0.5 * a.v.dot(direction),
                0.5 * b.u.dot(direction),
                0.5 * b.v.dot(direction),
                -off,
            ];
        }
        Condition::Fixed(k, value) => {
            let size = [a.u, a.v, b.u, b.v][k.min(3)].length();
            rows[3][k.min(3)] = size;
            rows[3][4] = (value - x[k.min(3)]) * size;
        }
    }
    rows
}

/// Solves four equations in four unknowns (the fifth column is the right-hand side).
#[inline(always)]
fn solve4(mut m: [[f64; 5]; 4]) -> Option<[f64; 4]> {
    for row in &mut m {
        let size = row[..4].iter().fold(0.0, |s: f64, v| s.max(v.abs()));
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        row.iter_mut().for_each(|v| *v /= size);
    }
    for k in 0..4 {
        let pivot = (k..4).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))?;
        m.swap(k, pivot);
        if m[k][k].abs() < 1e-15 {
            return None;
        }
        for i in k + 1..4 {
            let factor = m[i][k] / m[k][k];
            for j in k..5 {
                m[i][j] -= factor * m[k][j];
            }
        }
    }
    let mut x = [0.0; 4];
    for k in (0..4).rev() {
        let sum: f64 = (k + 1..4).map(|j| m[k][j] * x[j]).sum();
        x[k] = (m[k][4] - sum) / m[k][k];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Surface;

    #[test]
    fn two_planes_meet_in_their_line() {
        let a = Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y]).unwrap();
        let b = Surface::bilinear([
            DVec3::new(0.3, 0.0, -1.0),
            DVec3::new(0.3, 1.0, -1.0),
            DVec3::new(0.3, 0.0, 1.0),
            DVec3::new(0.3, 1.0, 1.0),
        ])
        .unwrap();
        let start = PointPair { uv: DVec2::new(0.5, 0.5), st: DVec2::new(0.5, 0.1) };
        let plane = Condition::Plane { point: DVec3::new(0.0, 0.25, 0.0), direction: DVec3::Y };
        let hit = correct(&a, &b, start, plane, 1e-15).unwrap();
        assert!(hit.point().distance(DVec3::new(0.3, 0.25, 0.0)) < 1e-15);
        let hit = correct(&a, &b, start, Condition::Fixed(2, 0.75), 1e-15).unwrap();
        assert!(hit.point().distance(DVec3::new(0.3, 0.75, 0.0)) < 1e-15);
        assert!(correct(&a, &a, start, plane, 1e-15).is_none());
    }
}
