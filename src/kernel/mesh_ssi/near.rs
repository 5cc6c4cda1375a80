//! Where the triangulations of two surfaces cannot be trusted: places at which the surfaces are near and their normals
//! agree.
//!
//! HJR99 section 4: critical points, "where the normals of both intersecting surfaces are exactly or nearly collinear",
//! are where the intersection of triangulations "may not accurately reflect the intersection of the underlying
//! surfaces". Every closed curve that is too small for the triangles encloses such a point (Sederberg et al.), and
//! every junction is one, so a pair of surfaces without any is one whose topology the triangles get right.

use super::sheet::Sheet;
use crate::kernel::job::Job;

/// The first pair of triangles of two surfaces that are within `margin` of one another, as far as their boxes tell,
/// and whose normals may agree. Pairs come in the order of the trees.
pub fn near_agreement(a: &Sheet, b: &Sheet, margin: f64, job: &Job) -> Option<[u32; 2]> {
    if a.surface().is_none() || b.surface().is_none() {
        return None;
    }
    let pairs = a.tree().pairs_within(b.tree(), margin, job);
    pairs.into_iter().find(|&[ta, tb]| {
        let ((na, wa), (nb, wb)) = (a.cone(ta), b.cone(tb));
        na.dot(nb).abs().min(1.0).acos() <= wa + wb
    })
}
