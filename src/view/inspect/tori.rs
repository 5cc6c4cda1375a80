//! The leaf tori as triangles: of each only the used patch, the quadrangle of the matched corners (Thesis 4.1.3), with
//! the deviation of the leaf as its value; and one whole torus.

use glam::{DVec2, DVec3};

use super::shown::Scale;
use crate::kernel::bvh::{NodeId, OsculatingTorus, SurfaceTree};
use crate::kernel::job::Job;

/// Triangles with normals and a value a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TorusMesh {
    /// Vertices.
    pub points: Vec<DVec3>,
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// The deviation bound of the leaf; infinite where its tube is thinner than the leaf is wide.
    pub values: Vec<f32>,
    /// The scale of the values.
    pub scale: Option<Scale>,
    /// How many leaves are drawn, and how many of them have such thin tubes.
    pub leaves: [usize; 2],
}

/// Up to this many leaves have patches of 4 x 4 cells; up to sixteen times as many of 2 x 2; the rest of one.
const FINE: usize = 4096;

/// The used patches of the tori of `leaves`; `None` when it was cancelled.
pub fn leaf_tori(tree: &SurfaceTree, leaves: &[NodeId], job: &Job) -> Option<TorusMesh> {
    job.phase("Drawing the tori");
    let cells: u32 = match leaves.len() {
        0..=FINE => 4,
        n if n <= 16 * FINE => 2,
        _ => 1,
    };
    let mut mesh = TorusMesh::default();
    let mut sound = Vec::with_capacity(leaves.len());
    for (k, &id) in leaves.iter().enumerate() {
        if k % 1024 == 0 {
            if job.is_cancelled() {
                return None;
            }
            job.progress(k as f64 / leaves.len() as f64);
        }
        let Some(torus) = tree.torus(id) else { continue };
        let thin = is_thin(&torus);
        mesh.leaves[0] += 1;
        mesh.leaves[1] += usize::from(thin);
        let value = if thin { f32::INFINITY } else { torus.deviation as f32 };
        if !thin {
            sound.push(value);
        }
        let grid = |k: u32| f64::from(k) / f64::from(cells);
        let at = |i: u32, j: u32| torus.matched(DVec2::new(grid(i), grid(j)));
        push(&mut mesh, &torus, cells, cells, value, at);
    }
    mesh.scale = Some(Scale::of(&sound));
    Some(mesh)
}

/// Whether the tube is thinner than its used patch is wide: the thesis' sign of a miter point nearby.
fn is_thin(torus: &OsculatingTorus) -> bool {
    torus.k[0].abs() * torus.half[0] > 1.0
}

fn push(mesh: &mut TorusMesh, torus: &OsculatingTorus, m: u32, n: u32, value: f32, at: impl Fn(u32, u32) -> DVec2) {
    let first = mesh.points.len() as u32;
    for j in 0..=n {
        for i in 0..=m {
            let st = at(i, j);
            mesh.points.push(torus.eval(st));
            mesh.normals.push(torus.normal_at(st));
            mesh.values.push(value);
        }
    }
    for j in 0..n {
        for i in 0..m {
            let a = first + j * (m + 1) + i;
            mesh.triangles.push([a, a + 1, a + m + 2]);
            mesh.triangles.push([a, a + m + 2, a + m + 1]);
        }
    }
}

/// The whole torus, or as much of it as lies within `reach` of the contact point along each circle: the circles of
/// a nearly flat torus are as good as endless.
pub fn whole_torus(torus: &OsculatingTorus, reach: f64) -> TorusMesh {
    let (m, n) = (48, 96);
    let mut mesh = TorusMesh::default();
    let end = |k: f64| std::f64::consts::PI.min(k.abs() * reach);
    let parameter = |k: f64, t: f64| {
        // From an angle in -end..end to the half-angle parameter, which is the way itself where k is 0.
        if k == 0.0 { reach * t } else { 2.0 * (0.5 * end(k) * t).tan() / k.abs() }
    };
    let place = |k: u32, of: u32| 2.0 * f64::from(k) / f64::from(of) - 1.0;
    push(&mut mesh, torus, m, n, 0.0, |i, j| {
        DVec2::new(parameter(torus.k[0], place(i, m)), parameter(torus.k[1], place(j, n)))
    });
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::bvh::BvhOptions;
    use crate::view::display::tests::sphere;

    #[test]
    fn used_patches_are_as_near_to_the_surface_as_their_leaves_say() {
        let surface = sphere();
        let tree = SurfaceTree::new(&surface, &BvhOptions { height: 3, ..BvhOptions::default() }).unwrap();
        let leaves = tree.level(3);
        let mesh = leaf_tori(&tree, &leaves, &Job::new()).unwrap();
        assert_eq!(mesh.leaves, [leaves.len(), 0]);
        assert_eq!(mesh.points.len(), leaves.len() * 25);
        let scale = mesh.scale.unwrap();
        for (p, value) in mesh.points.iter().zip(&mesh.values) {
            // The unit sphere: every torus is the sphere itself, within the bound of its leaf and f32.
            let off = (p.length() - 1.0).abs();
            assert!(off < 1e-5 + f64::from(*value), "{off} {value}");
            assert!(f64::from(*value) <= scale.high * 1.001);
        }
    }

    #[test]
    fn a_whole_torus_lies_on_the_torus_and_closes() {
        let normal = DVec3::Z;
        let torus = |k: [f64; 2]| OsculatingTorus {
            point: DVec3::new(1.0, 2.0, 3.0),
            e: [DVec3::X, DVec3::Y],
            normal,
            k,
            half: [0.1; 2],
            corners: [DVec2::ZERO; 4],
            deviation: 0.0,
            normal_sin: 0.0,
        };
        for k in [[2.0, 0.5], [-1.0, 0.25], [0.0, 0.5], [0.0, 0.0]] {
            let torus = torus(k);
            let mesh = whole_torus(&torus, 50.0);
            for (p, n) in mesh.points.iter().zip(&mesh.normals) {
                assert!(torus.distance(*p).abs() < 1e-9 * 50.0, "{k:?} {p}");
                assert!((n.length() - 1.0).abs() < 1e-12);
            }
            if let Some(whole) = torus.radii() {
                let reach = mesh.points.iter().map(|p| (*p - whole.center).length()).fold(0.0, f64::max);
                assert!((reach - whole.major - whole.minor).abs() < 0.01 * reach);
            }
        }
    }
}
