//! Where the triangulations of two surfaces cannot be trusted: places at which the surfaces are near and their normals
//! agree.
//!
//! HJR99 section 4: critical points, "where the normals of both intersecting surfaces are exactly or nearly collinear",
//! are where the intersection of triangulations "may not accurately reflect the intersection of the underlying
//! surfaces". Every closed curve that is too small for the triangles encloses such a point (Sederberg et al.), and
//! every junction is one, so a pair of surfaces without any is one whose topology the triangles get right.

use glam::{DVec2, DVec3};

use super::sheet::Sheet;
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;

/// How often the triangles of a pair are quartered to see whether their normals really agree.
const QUARTERED: usize = 3;

/// A triangle of a surface with what the surface has at its corners.
#[derive(Clone, Copy)]
struct Cell {
    uv: [DVec2; 3],
    points: [DVec3; 3],
    normals: [DVec3; 3],
}

impl Cell {
    fn new(surface: &Surface, uv: [DVec2; 3]) -> Self {
        let jets = uv.map(|uv| surface.jet(uv, 1));
        let normals = jets.each_ref().map(|j| j.normal().unwrap_or(DVec3::ZERO));
        Self { uv, points: jets.each_ref().map(|j| j.p()), normals }
    }

    /// The normal of the triangle and the angle up to which the surface's normal differs from it: twice that at the
    /// corners, to be on the safe side. Where there is none, every normal is allowed.
    fn cone(&self) -> (DVec3, f64) {
        let [a, b, c] = self.points;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == DVec3::ZERO || self.normals.contains(&DVec3::ZERO) {
            return (DVec3::ZERO, std::f64::consts::PI);
        }
        let angle = |n: DVec3| n.dot(normal).abs().min(1.0).acos();
        (normal, 2.0 * self.normals.map(angle).into_iter().fold(0.0, f64::max))
    }

    fn quarters(&self, surface: &Surface) -> [Self; 4] {
        let [a, b, c] = self.uv;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|uv| Self::new(surface, uv))
    }
}

/// Whether two triangles are within `margin` of one another, as far as boxes and planes tell, with normals that may agree.
fn agree(a: &Cell, b: &Cell, margin: f64) -> bool {
    let extent = |c: &Cell| {
        let [p, q, r] = c.points;
        (p.min(q).min(r), p.max(q).max(r))
    };
    let ((low, high), (other_low, other_high)) = (extent(a), extent(b));
    if (low - margin).cmpgt(other_high).any() || (other_low - margin).cmpgt(high).any() {
        return false;
    }
    let ((na, wa), (nb, wb)) = (a.cone(), b.cone());
    let beside = |normal: DVec3, plane: &Cell, other: &Cell| {
        let heights = other.points.map(|p| normal.dot(p - plane.points[0]));
        heights.iter().all(|h| *h > margin) || heights.iter().all(|h| *h < -margin)
    };
    na.dot(nb).abs().min(1.0).acos() <= wa + wb && !beside(na, a, b) && !beside(nb, b, a)
}

fn search(surfaces: [&Surface; 2], a: &Cell, b: &Cell, margin: f64, left: usize) -> bool {
    if !agree(a, b, margin) {
        return false;
    }
    if left == 0 {
        return true;
    }
    let (parts, others) = (a.quarters(surfaces[0]), b.quarters(surfaces[1]));
    parts.iter().any(|p| others.iter().any(|q| search(surfaces, p, q, margin, left - 1)))
}

/// The first pair of triangles of two surfaces that hold a place at which the surfaces are within `margin` of one another
/// with normals that agree, as far as the triangles quartered [`QUARTERED`] times tell. Pairs come in the order of the
/// trees.
pub fn near_agreement(a: &Sheet, b: &Sheet, margin: f64, job: &Job) -> Option<[u32; 2]> {
    let (Some(sa), Some(sb)) = (a.surface(), b.surface()) else { return None };
    let pairs = a.tree().pairs_within(b.tree(), margin, job);
    pairs.into_iter().find(|&[ta, tb]| {
        let (p, q) = (Cell::new(sa, a.corner_uv(ta)), Cell::new(sb, b.corner_uv(tb)));
        search([sa, sb], &p, &q, margin, QUARTERED)
    })
}
