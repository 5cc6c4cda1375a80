//! All surfaces of a model, each against itself.

use rayon::prelude::*;

use super::{SelfIntersectError, SelfIntersectOptions, SelfIntersection, self_intersect};
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::ssi::result::Intersection;

/// Intersects each surface with itself, in parallel; the results are in the order of the surfaces and their numbers are
/// `numbers`. Progress counts surfaces. Cancelled: surfaces that were not reached are incomplete and empty.
pub fn self_intersect_all<S: AsRef<Surface> + Sync>(
    surfaces: &[(usize, S)],
    options: &SelfIntersectOptions,
    job: &Job,
) -> Result<Vec<SelfIntersection>, SelfIntersectError> {
    let done = std::sync::atomic::AtomicUsize::new(0);
    let all = surfaces.par_iter().map(|(number, surface)| {
        // Each keeps its own progress to itself: only their number counts.
        let result = self_intersect(surface.as_ref(), *number, options, &job.part(0.0, 0.0));
        let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        job.progress(count as f64 / surfaces.len() as f64);
        result
    });
    all.collect()
}

/// The results of several surfaces as one.
pub fn merged(parts: impl IntoIterator<Item = Intersection>) -> Intersection {
    let mut all = Intersection { complete: true, ..Intersection::default() };
    for part in parts {
        all.append(part);
    }
    all
}
