//! The triangles of a mesh with normals to shade them by.
//!
//! A corner's normal is the mean, weighted by area, of the normals of those triangles at its vertex that are within
//! [`CREASE`] of its own triangle's, so that smooth parts look smooth and edges sharp; a vertex is split where its
//! corners differ. Meshes above [`LARGE`] triangles get one normal a vertex: there a crease is a pixel wide.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::kernel::mesh::tessellate::SurfaceMesh;
use crate::kernel::mesh::tri_mesh::TriMesh;

/// The angle between triangles above which an edge looks sharp, in degrees.
const CREASE: f64 = 35.0;
/// From this many triangles on vertices are not split.
const LARGE: usize = 400_000;

/// Triangles in the order of the mesh, with normals and without parameters.
pub(super) fn shaded(mesh: &TriMesh) -> SurfaceMesh {
    if mesh.triangles().len() > LARGE { smooth(mesh) } else { creased(mesh) }
}

fn smooth(mesh: &TriMesh) -> SurfaceMesh {
    let (points, triangles) = (mesh.points(), mesh.triangles());
    let shared = mesh.shared();
    // Sums of squares of the model's size stay within the range of f32.
    let scale = mesh.bounds().diagonal().max(f64::MIN_POSITIVE).recip();
    // Two halves, whatever the number of threads, so that the sums are always the same.
    let half = |own: &[[u32; 3]]| {
        let mut sums = vec![Vec3::ZERO; points.len()];
        for &[a, b, c] in own {
            let [p, q, r] = [a, b, c].map(|k| points[k as usize]);
            let area = (scale * (q - p)).cross(scale * (r - p)).as_vec3();
            [a, b, c].into_iter().for_each(|k| sums[k as usize] += area);
        }
        sums
    };
    let (first, second) = triangles.split_at(triangles.len() / 2);
    let (sums, others) = rayon::join(|| half(first), || half(second));
    let unit = |(a, b): (&Vec3, &Vec3)| (a.as_dvec3() + b.as_dvec3()).normalize_or_zero();
    SurfaceMesh {
        points: shared.0,
        normals: sums.par_iter().zip(&others).map(unit).collect(),
        triangles: shared.1,
        ..SurfaceMesh::default()
    }
}

fn creased(mesh: &TriMesh) -> SurfaceMesh {
    let areas: Vec<DVec3> = (0..mesh.triangles().len()).map(|t| mesh.area_vector(t)).collect();
    let units: Vec<DVec3> = areas.iter().map(|a| a.normalize_or_zero()).collect();
    // The triangles at each vertex, as runs of one list.
    let mut first = vec![0_u32; mesh.points().len() + 1];
    mesh.triangles().iter().flatten().for_each(|&k| first[k as usize + 1] += 1);
    for k in 1..first.len() {
        first[k] += first[k - 1];
    }
    let mut fill = first.clone();
    let mut around = vec![0_u32; 3 * mesh.triangles().len()];
    for (t, corners) in mesh.triangles().iter().enumerate() {
        for &k in corners {
            around[fill[k as usize] as usize] = t as u32;
            fill[k as usize] += 1;
        }
    }
    let cosine = CREASE.to_radians().cos();
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let mut made: HashMap<(u32, [i16; 3]), u32> = HashMap::with_capacity(mesh.points().len());
    let corners = |(t, corners): (usize, &[u32; 3])| {
        corners.map(|k| {
            let near = &around[first[k as usize] as usize..first[k as usize + 1] as usize];
            let alike = near.iter().filter(|&&o| units[o as usize].dot(units[t]) >= cosine);
            let sum: DVec3 = alike.map(|&o| areas[o as usize]).sum();
            let normal = sum.try_normalize().unwrap_or(units[t]);
            let rounded = (normal * 1000.0).round();
            let key = (k, [rounded.x as i16, rounded.y as i16, rounded.z as i16]);
            *made.entry(key).or_insert_with(|| {
                points.push(mesh.points()[k as usize]);
                normals.push(normal);
                points.len() as u32 - 1
            })
        })
    };
    let triangles: Vec<[u32; 3]> = mesh.triangles().iter().enumerate().map(corners).collect();
    SurfaceMesh { points: Arc::new(points), normals, triangles: Arc::new(triangles), ..SurfaceMesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_roof_is_split_at_its_ridge_and_a_shallow_one_is_not() {
        for (height, vertices) in [(1.0, 6), (0.1, 4)] {
            let points = vec![
                DVec3::new(-1.0, 0.0, 0.0),
                DVec3::new(0.0, 0.0, height),
                DVec3::new(0.0, 1.0, height),
                DVec3::new(1.0, 0.0, 0.0),
            ];
            let mesh = TriMesh::new(points, vec![[0, 1, 2], [1, 3, 2]]).unwrap();
            let shown = shaded(&mesh);
            assert_eq!(shown.points.len(), vertices);
            assert_eq!(shown.triangles.len(), 2);
            for (t, corners) in shown.triangles.iter().enumerate() {
                for &k in corners {
                    assert!(shown.normals[k as usize].dot(mesh.area_vector(t).normalize()) > 0.8);
                }
            }
            let plain = smooth(&mesh);
            assert_eq!((plain.points.len(), plain.triangles.len()), (4, 2));
        }
    }
}
