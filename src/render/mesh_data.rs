//! Triangles as the graphics card takes them. Packing them costs about 20 ns a vertex and is done once, in a worker where
//! there are many: what is left for the window's thread is to copy two buffers.
//!
//! Triangles come in runs of [`RUN`] with a box around each, for culling. A triangle with a corner that is not there or
//! not finite is left out.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::cull::{Bounds, Run};
use crate::kernel::mesh::tessellate::SurfaceMesh;

/// Triangles in one culled run.
const RUN: usize = 4096;
/// Runs that are looked at to see whether triangles are in any order.
const SAMPLES: usize = 16;

/// One vertex of a surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, PartialEq, Zeroable)]
pub(super) struct SurfaceVertex {
    pub position: [f32; 3],
    /// Signed normalized 16-bit.
    pub normal: [i16; 4],
}

impl SurfaceVertex {
    fn new(position: Vec3, normal: Vec3) -> Self {
        let length = normal.length();
        let scale = if length > 0.0 && length.is_finite() { 32767.0 / length } else { 0.0 };
        let [x, y, z] = (normal * scale).to_array().map(|c| c.round() as i16);
        Self { position: position.to_array(), normal: [x, y, z, 0] }
    }

    fn is_finite(&self) -> bool {
        self.position.iter().all(|c| c.is_finite())
    }
}

/// Triangles with normals, relative to an origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    pub(super) origin: DVec3,
    pub(super) vertices: Vec<SurfaceVertex>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) runs: Vec<Run>,
    /// The box around all runs; `None` without a triangle.
    pub(super) bounds: Option<Bounds>,
}

/// Whether other threads help. The window's thread must not ask them: they may be busy for long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Threads {
    One,
    All,
}

impl Threads {
    fn map<T: Send>(self, count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
        match self {
            Self::One => (0..count).map(f).collect(),
            Self::All => (0..count).into_par_iter().with_min_len(16).map(f).collect(),
        }
    }
}

impl MeshData {
    /// Vertices relative to the model position `origin`; one normal a vertex, of any length (a zero normal, or one that
    /// is not there, makes the triangle's own normal stand in); three indices a triangle, counter-clockwise seen from the
    /// side of the normal. Neighbours in the list should be neighbours in space: it is culled in runs.
    pub fn new(origin: DVec3, positions: &[[f32; 3]], normals: &[[f32; 3]], triangles: Vec<[u32; 3]>) -> Self {
        let normal = |k: usize| Vec3::from(normals.get(k).copied().unwrap_or_default());
        let vertex = |k: usize| SurfaceVertex::new(Vec3::from(positions[k]), normal(k));
        Self::packed(origin, Threads::One.map(positions.len(), vertex), triangles, Threads::One)
    }

    /// The triangles of a surface.
    pub(super) fn of_surface(origin: DVec3, mesh: &SurfaceMesh, threads: Threads) -> Self {
        let normal = |k: usize| mesh.normals.get(k).copied().unwrap_or_default().as_vec3();
        let vertex = |k: usize| SurfaceVertex::new((mesh.points[k] - origin).as_vec3(), normal(k));
        let vertices = threads.map(mesh.points.len(), vertex);
        Self::packed(origin, vertices, threads.map(mesh.triangles.len(), |t| mesh.triangles[t]), threads)
    }

    fn packed(origin: DVec3, vertices: Vec<SurfaceVertex>, mut triangles: Vec<[u32; 3]>, threads: Threads) -> Self {
        // The largest index and the finite vertices say in most cases that every triangle is whole, without a look at
        // each corner's vertex.
        let sound = triangles.iter().flatten().max().is_none_or(|&k| (k as usize) < vertices.len())
            && vertices.iter().all(SurfaceVertex::is_finite);
        if !sound {
            let whole = |k: &u32| vertices.get(*k as usize).is_some_and(SurfaceVertex::is_finite);
            triangles.retain(|t| t.iter().all(whole));
        }
        let own = |k: usize| &triangles[k * RUN..triangles.len().min((k + 1) * RUN)];
        let boxed = |own: &[[u32; 3]]| Bounds::of(own.iter().flatten().map(|&v| &vertices[v as usize].position));
        let count = triangles.len().div_ceil(RUN);
        // Where the triangles are in no order, every run reaches all over and a look at all corners' places, each of
        // them a miss of the caches, would tell nothing.
        let scattered = (count > SAMPLES).then(|| {
            let all = Bounds::of(vertices.iter().map(|v| &v.position).filter(|p| p.iter().all(|c| c.is_finite())));
            let wide = |k: &usize| {
                boxed(own(k * (count / SAMPLES)))
                    .zip(all)
                    .is_some_and(|(b, all)| 2.0 * b.half.max_element() > all.half.max_element())
            };
            all.filter(|_| (0..SAMPLES).all(|k| wide(&k)))
        });
        let scattered = scattered.flatten();
        let run = |k: usize| {
            let start = (3 * k * RUN) as u32;
            Some(Run {
                range: start..start + 3 * own(k).len() as u32,
                bounds: scattered.map_or_else(|| boxed(own(k)), Some)?,
            })
        };
        let runs: Vec<Run> = threads.map(count, run).into_iter().flatten().collect();
        let bounds = runs.iter().map(|r| r.bounds).reduce(Bounds::union);
        Self { origin, vertices, triangles, runs, bounds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_triangles_are_left_out_and_the_others_lie_in_their_boxes() {
        let n = RUN as u32 + 7;
        let mut positions: Vec<[f32; 3]> = (0..n + 2).map(|k| [k as f32, (k % 3) as f32, 1.0]).collect();
        positions[5][1] = f32::NAN;
        let mut triangles: Vec<[u32; 3]> = (0..n).map(|k| [k, k + 1, k + 2]).collect();
        triangles.push([0, 1, n + 2]);
        let mesh = MeshData::new(DVec3::ZERO, &positions, &[], triangles);
        assert_eq!(mesh.triangles.len(), n as usize - 3, "three triangles meet the bad vertex, one names none");
        assert_eq!(mesh.runs.len(), 2);
        assert_eq!(mesh.runs[1].range.end as usize, 3 * mesh.triangles.len());
        for run in &mesh.runs {
            for triangle in &mesh.triangles[run.range.start as usize / 3..run.range.end as usize / 3] {
                for &k in triangle {
                    let away = (Vec3::from(mesh.vertices[k as usize].position) - run.bounds.center).abs();
                    assert!(away.cmple(run.bounds.half + 1e-3).all());
                }
            }
        }
    }

    #[test]
    fn all_threads_make_the_same_of_a_surface_as_one() {
        let points: Vec<DVec3> =
            (0..3000).map(|k| DVec3::new(f64::from(k), f64::from(k % 7), f64::from(k % 5))).collect();
        let triangles: Vec<[u32; 3]> = (0..2998).map(|k| [k, k + 2, k + 1]).collect();
        let normals = points.iter().map(|p| p.normalize_or_zero() * 3.0).collect();
        let (points, triangles) = (points.into(), triangles.into());
        let mesh = SurfaceMesh { points, normals, triangles, ..SurfaceMesh::default() };
        let [one, all] = [Threads::One, Threads::All].map(|t| MeshData::of_surface(DVec3::ONE, &mesh, t));
        assert_eq!(one, all);
        assert_eq!(one.vertices[7].position, [6.0, -1.0, 1.0]);
        let length: f64 = one.vertices[7].normal.map(|c| f64::from(c).powi(2)).iter().sum::<f64>().sqrt();
        assert!((length - 32767.0).abs() < 2.0);
    }
}
