//! All surfaces of a model, each against itself.

use rayon::prelude::*;

use super::{SelfIntersectError, SelfIntersectOptions, SelfIntersection, self_intersect};
use crate::kernel::geom::Surface;
use crate::kernel::job::Job;
use crate::kernel::ssi::result::{CurveEnd, Intersection};

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
        append(&mut all, part);
    }
    all
}

/// Adds the result of one more surface, renumbering what its curves refer to.
fn append(all: &mut Intersection, mut one: Intersection) {
    let (miters, regions) = (all.miters.len(), all.regions.len());
    let junctions = all.junctions.len();
    for curve in &mut one.curves {
        for (end, id) in curve.ends.iter().zip(&mut curve.end_ids) {
            let first = if *end == CurveEnd::Junction { junctions } else { miters };
            *id = id.map(|id| id + first);
        }
        curve.region = curve.region.map(|r| r + regions);
    }
    all.complete &= one.complete;
    all.tol = all.tol.max(one.tol);
    all.curves.append(&mut one.curves);
    all.junctions.append(&mut one.junctions);
    all.miters.append(&mut one.miters);
    all.regions.append(&mut one.regions);
    all.unresolved.append(&mut one.unresolved);
    all.counts.leaf_pairs += one.counts.leaf_pairs;
    all.counts.nodes_built += one.counts.nodes_built;
    all.time_ms.build += one.time_ms.build;
    all.time_ms.traverse += one.time_ms.traverse;
    all.time_ms.curves += one.time_ms.curves;
}
