//! The auxiliary-plane method (Hosaka 1992; HJR99 section 4 (18)-(26)): from a point on two triangulations to a
//! point on both parametric surfaces, or on one of them and a triangle.
//!
//! With p on surface s and q on surface r, both tangent planes and a third plane perpendicular to them meet in a
//! point x; each parameter pair then moves so that its surface point follows x in its own tangent plane. The
//! printed (18)-(26) exchange the two surfaces' points; here each plane goes through its own surface's point and
//! each point moves with its own partials. The third plane goes through the middle of p and q. Converges
//! quadratically where the surfaces cross; where the normals are nearly parallel the method is undefined and
//! says so, and the point is for the collinear-normal machinery.

use glam::{DVec2, DVec3};

use crate::kernel::geom::Surface;
use crate::kernel::ssi::three::Touch;

/// What a point is refined on.
#[derive(Clone, Copy, Debug)]
pub enum Sheet<'a> {
    /// A parametric surface, and where to start.
    Surface(&'a Surface, DVec2),
    /// A fixed plane: the triangle of a mesh without a parametric description (corner, unit normal).
    Plane(DVec3, DVec3),
}

/// A refined point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// The point: the middle of the two sheets' points.
    pub point: DVec3,
    /// Parameters on the first sheet, where it has them.
    pub a: Option<DVec2>,
    /// Parameters on the second sheet, where it has them.
    pub b: Option<DVec2>,
    /// How far the two sheets' points are still apart.
    pub gap: f64,
    /// How many iterations it took.
    pub iterations: usize,
}

/// Why a point was not refined.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// The sheets are tangent to one another here.
    #[error("the normals differ by {angle:.3e} rad only; the auxiliary planes have no common point")]
    Tangential {
        /// The angle between the normals.
        angle: f64,
    },
    /// A surface has no normal here.
    #[error("a surface has no normal at ({}, {})", uv.x, uv.y)]
    Singular {
        /// Where.
        uv: DVec2,
    },
    /// The points did not come together.
    #[error("still {gap:.3e} apart after {iterations} iterations, {tol:.3e} was asked for")]
    NotConverged {
        /// The distance left.
        gap: f64,
        /// The distance asked for.
        tol: f64,
        /// Iterations done.
        iterations: usize,
    },
}

/// The most iterations; 5 are enough from a sensible triangulation.
pub const MAX_ITERATIONS: usize = 20;
/// Normals closer than this (radians) count as parallel.
pub const TANGENTIAL: f64 = 1e-4;

fn touch(sheet: &Sheet<'_>) -> Result<Touch, RefineError> {
    match sheet {
        Sheet::Plane(point, normal) => Ok(Touch { point: *point, normal: *normal, partials: None }),
        Sheet::Surface(surface, uv) => Touch::of(surface, *uv).ok_or(RefineError::Singular { uv: *uv }),
    }
}

/// Moves a sheet's parameters so that its point follows `x` in the tangent plane ((22)-(26)).
fn follow(sheet: &mut Sheet<'_>, touch: &Touch, x: DVec3) {
    if let (Sheet::Surface(surface, uv), Some(step)) = (sheet, touch.step_to(x)) {
        *uv = surface.clamped(*uv + step);
    }
}

/// Refines until the two sheets' points are within `tol`.
pub fn refine(mut a: Sheet<'_>, mut b: Sheet<'_>, tol: f64) -> Result<Refined, RefineError> {
    let mut gap = f64::INFINITY;
    for iterations in 0..=MAX_ITERATIONS {
        let (p, q) = (touch(&a)?, touch(&b)?);
        let direction = p.normal.cross(q.normal);
        let sine = direction.length();
        if sine < TANGENTIAL {
            return Err(RefineError::Tangential { angle: sine });
        }
        let axis = direction / sine;
        // A fixed plane has no point of its own that the third plane should pass.
        let middle = axis.dot(match (&a, &b) {
            (Sheet::Plane(..), _) => q.point,
            (_, Sheet::Plane(..)) => p.point,
            _ => 0.5 * (p.point + q.point),
        });
        let (dp, dq) = (p.normal.dot(p.point), q.normal.dot(q.point));
        let x = (dp * q.normal.cross(axis) + dq * axis.cross(p.normal) + middle * direction) / direction.dot(axis);
        // On a fixed plane the point is wherever x is; on a surface it is the surface's own point.
        let on = |sheet: &Sheet<'_>, t: &Touch| if matches!(sheet, Sheet::Plane(..)) { x } else { t.point };
        let (pa, pb) = (on(&a, &p), on(&b, &q));
        gap = pa.distance(pb);
        if gap <= tol {
            let uv = |sheet: &Sheet<'_>| if let Sheet::Surface(_, uv) = sheet { Some(*uv) } else { None };
            return Ok(Refined { point: 0.5 * (pa + pb), a: uv(&a), b: uv(&b), gap, iterations });
        }
        follow(&mut a, &p, x);
        follow(&mut b, &q, x);
    }
    Err(RefineError::NotConverged { gap, tol, iterations: MAX_ITERATIONS })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    /// z = 0.3 x^2 - 0.2 y^2 + h over [-1, 1]^2, with parameters (x, y).
    fn saddle(h: f64) -> Surface {
        let knots = || Knots::bezier(2, -1.0, 1.0).unwrap();
        let [x, square] = [[-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]];
        let points = (0..9).map(|k| (k % 3, k / 3));
        let points = points.map(|(i, j)| DVec3::new(x[i], x[j], 0.3 * square[i] - 0.2 * square[j] + h)).collect();
        Surface::new(knots(), knots(), points, None).unwrap()
    }

    fn tilted() -> Surface {
        Surface::bilinear(
            [[0.0, -1.0, -0.9], [0.1, 1.0, -1.0], [0.0, -1.0, 1.0], [-0.1, 1.0, 1.1]].map(DVec3::from_array),
        )
        .unwrap()
    }

    #[test]
    fn transversal_points_reach_1e_10_within_5_iterations() {
        let (s, r) = (saddle(0.05), tilted());
        let mut worst = 0;
        for k in 0..20 {
            let y = -0.9 + 0.09 * f64::from(k);
            let start = Sheet::Surface(&s, DVec2::new(0.1, y));
            let refined = refine(start, Sheet::Surface(&r, DVec2::new(0.5 + 0.5 * y, 0.45)), 1e-10).unwrap();
            worst = worst.max(refined.iterations);
            let (a, b) = (refined.a.unwrap(), refined.b.unwrap());
            assert!(s.eval(a).distance(refined.point) < 1e-10 && r.eval(b).distance(refined.point) < 1e-10);
            let z = 0.3 * refined.point.x.powi(2) - 0.2 * refined.point.y.powi(2) + 0.05;
            assert!((refined.point.z - z).abs() < 1e-10);
        }
        assert!(worst <= 5, "{worst}");
    }

    #[test]
    fn a_surface_refines_against_a_triangle_on_its_side_only() {
        let s = saddle(0.0);
        let plane = Sheet::Plane(DVec3::new(0.3, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.2).normalize());
        let refined = refine(Sheet::Surface(&s, DVec2::new(0.35, 0.4)), plane, 1e-12).unwrap();
        let p = refined.point;
        assert!(((p.x - 0.3) + 0.2 * p.z).abs() < 1e-11 && (p.z - 0.3 * p.x * p.x + 0.2 * p.y * p.y).abs() < 1e-11);
        assert_eq!(refined.b, None);
    }

    #[test]
    fn tangent_sheets_are_handed_over() {
        let s = saddle(0.0);
        let plane = Sheet::Plane(DVec3::ZERO, DVec3::Z);
        assert!(matches!(refine(Sheet::Surface(&s, DVec2::ZERO), plane, 1e-10), Err(RefineError::Tangential { .. })));
    }
}
