//! The ends of intersection curves: where a border of one surface meets the other sheet.
//!
//! One parameter stays where it is; Newton's method finds the other one and the point on the other sheet: three
//! equations in three unknowns against a surface, one against a plane.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::refine::{MAX_ITERATIONS, Sheet};
use crate::kernel::geom::Surface;

/// Moves `uv` along the border where parameter `fixed` (0: u, 1: v) is constant until its point lies on the
/// other sheet. Returns the parameters and point on the border, and the parameters on the other sheet. `None`
/// where the border runs along the other sheet, leaves its surface, or does not get within `floor` times 100.
pub fn meet(
    surface: Option<&Arc<Surface>>,
    mut uv: DVec2,
    fixed: usize,
    other: Sheet<'_>,
    floor: f64,
) -> Option<((DVec2, DVec3), Option<DVec2>)> {
    let surface = surface?;
    let free = 1 - fixed;
    let domain = surface.domain()[free];
    let mut st = if let Sheet::Surface(_, st) = other { Some(st) } else { None };
    let mut last = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        let jet = surface.jet(uv, 1);
        let tangent = [jet.u(), jet.v()][free];
        let (gap, step) = match (&other, st) {
            (Sheet::Surface(other, _), Some(at)) => {
                let b = other.jet(at, 1);
                let gap = b.p() - jet.p();
                let step = DMat3::from_cols(tangent, -b.u(), -b.v()).inverse() * gap;
                if !step.is_finite() {
                    return None;
                }
                let next = other.clamped(at + DVec2::new(step.y, step.z));
                if gap.length() > floor {
                    st = Some(next);
                }
                (gap.length(), step.x)
            }
            (Sheet::Plane(corner, normal), _) => {
                let gap = (*corner - jet.p()).dot(*normal);
                (gap.abs(), gap / tangent.dot(*normal))
            }
            _ => return None,
        };
        if gap <= floor || (gap <= 100.0 * floor && gap >= 0.5 * last) {
            return Some(((uv, jet.p()), st));
        }
        last = gap;
        if !step.is_finite() {
            return None;
        }
        uv[free] = (uv[free] + step).clamp(domain[0], domain[1]);
    }
    None
}
