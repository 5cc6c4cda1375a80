//! How far a tessellated surface is from a set of others, vertex by vertex: the numbers behind the deviation map
//! (HJR99 3.6 measures the same by closest points).
//!
//! A deviation is the distance to the true closest point, positive on the side of the vertex' normal. Where the
//! nearest point of the originals lies sideways, over a gap or past a border, there is nothing to deviate from: the
//! value is NaN, drawn as "no data". Cost: a few microseconds a vertex, on all threads.

use glam::DVec3;
use rayon::prelude::*;

use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};
use crate::kernel::mesh::tessellate::SurfaceMesh;

/// A foot whose direction leaves the normal by more than 45 degrees lies sideways.
const SIDEWAYS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Vertices between two looks at the cancel flag.
const BLOCK: usize = 512;

/// Signed deviations of a mesh and what they amount to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deviation {
    /// One a vertex; NaN without data.
    pub values: Vec<f32>,
    /// The largest magnitude.
    pub max: f64,
    /// The root mean square.
    pub rms: f64,
    /// Vertices with data.
    pub measured: usize,
    /// Whether it was cancelled; the vertices that are missing have no data.
    pub cancelled: bool,
}

/// Measures every vertex of a mesh against the originals. Distances beyond `limit` are no data; those below `noise`
/// have no direction worth trusting and always count.
pub fn deviation(mesh: &SurfaceMesh, originals: &SurfaceSet, limit: f64, noise: f64, job: &Job) -> Deviation {
    let blocks: Vec<Vec<f64>> = mesh
        .points
        .par_chunks(BLOCK)
        .zip(mesh.normals.par_chunks(BLOCK))
        .map_init(Scratch::default, |scratch, (points, normals)| {
            if job.is_cancelled() {
                return vec![f64::NAN; points.len()];
            }
            points.iter().zip(normals).map(|(&p, &n)| signed(p, n, originals, limit, noise, scratch)).collect()
        })
        .collect();
    let values: Vec<f64> = blocks.into_iter().flatten().collect();
    let known = || values.iter().copied().filter(|v| !v.is_nan());
    let measured = known().count();
    Deviation {
        max: known().fold(0.0, |m, v| m.max(v.abs())),
        rms: if measured > 0 { (known().map(|v| v * v).sum::<f64>() / measured as f64).sqrt() } else { 0.0 },
        measured,
        cancelled: job.is_cancelled(),
        values: values.into_iter().map(|v| v as f32).collect(),
    }
}

fn signed(p: DVec3, normal: DVec3, originals: &SurfaceSet, limit: f64, noise: f64, scratch: &mut Scratch) -> f64 {
    let Some(foot) = originals.closest(p, limit, scratch) else { return f64::NAN };
    let height = (p - foot.point).dot(normal);
    if foot.distance > noise && height.abs() < SIDEWAYS * foot.distance {
        return f64::NAN;
    }
    foot.distance.copysign(height)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::Surface;
    use crate::kernel::mesh::tessellate::{TessellateOptions, tessellate};

    fn square(z: f64, width: f64) -> Surface {
        let at = |x, y| DVec3::new(x, y, z);
        Surface::bilinear([at(0.0, 0.0), at(width, 0.0), at(0.0, 1.0), at(width, 1.0)]).unwrap()
    }

    #[test]
    fn parallel_planes_deviate_by_their_distance_with_its_sign() {
        let job = Job::new();
        let originals = SurfaceSet::new(vec![(0, Arc::new(square(0.0, 1.0)))], 1e-3, &job);
        for z in [0.25, -0.125] {
            let mesh = tessellate(&square(z, 1.0), &TessellateOptions::new(1e-3));
            let found = deviation(&mesh, &originals, 1.0, 1e-9, &job);
            assert!(found.values.iter().all(|&v| v == z as f32));
            assert_eq!((found.max, found.rms, found.measured), (z.abs(), z.abs(), mesh.points.len()));
        }
    }

    #[test]
    fn past_a_border_there_is_no_data() {
        let job = Job::new();
        let originals = SurfaceSet::new(vec![(0, Arc::new(square(0.0, 1.0)))], 1e-3, &job);
        let mesh = tessellate(&square(0.1, 2.0), &TessellateOptions::new(1e-3));
        let found = deviation(&mesh, &originals, 10.0, 1e-9, &job);
        for (p, v) in mesh.points.iter().zip(&found.values) {
            assert_eq!(v.is_nan(), p.x > 1.1, "{p} {v}");
        }
        let near = deviation(&mesh, &originals, 0.05, 1e-9, &job);
        assert!(near.values.iter().all(|v| v.is_nan()) && near.max == 0.0 && near.measured == 0);
    }
}
