//! Intersection of triangulations (HJR99 section 4, ALGORITHMS section 5): trees, triangle pairs with exact
//! signs, Point / PointUse / Segment topology, chains.

mod adapted;
pub mod border;
mod chain_curve;
mod chain_point;
pub mod engine;
pub mod join;
pub mod near;
pub mod perturbed;
pub mod places;
pub mod refine;
pub mod sheet;
pub mod solids;
pub mod topology;
pub mod trace;

use glam::DVec3;

use super::job::Job;
use super::mesh::tri_tree::TriTree;
use topology::{Topology, Triangles};
use trace::Chain;

/// The intersection of two triangulations.
#[derive(Clone, Debug, Default)]
pub struct MeshIntersection {
    /// Points and segments.
    pub topology: Topology,
    /// The curves, open ones first.
    pub chains: Vec<Chain>,
    /// Whether every pair of triangles was looked at (not so when the job was cancelled).
    pub complete: bool,
}

impl MeshIntersection {
    /// The positions along a chain.
    pub fn positions<'a>(&'a self, chain: &'a Chain) -> impl Iterator<Item = DVec3> + 'a {
        chain.points.iter().map(|&p| self.topology.points[p as usize].position)
    }

    /// The points in which more than two segments meet.
    pub fn bifurcations(&self) -> impl Iterator<Item = usize> + '_ {
        self.topology.points.iter().enumerate().filter(|(_, p)| p.uses.len() > 2).map(|(at, _)| at)
    }
}

/// Intersects two triangulations; the trees are those of the same triangles. Triangles without area meet
/// nothing and are listed. Cost: the tree's pairs, some 100 ns each.
pub fn intersect(
    a: Triangles<'_>,
    tree_a: &TriTree,
    b: Triangles<'_>,
    tree_b: &TriTree,
    job: &Job,
) -> MeshIntersection {
    job.phase("Testing triangle pairs");
    let pairs = tree_a.overlapping_pairs(tree_b, job);
    let mut topology = Topology::default();
    for (done, &pair) in pairs.iter().enumerate() {
        if done.is_multiple_of(4096) {
            job.progress(done as f64 / pairs.len() as f64);
            if job.is_cancelled() {
                break;
            }
        }
        topology.add_pair(a, b, pair);
    }
    job.phase("Tracing");
    let chains = trace::trace(&topology);
    MeshIntersection { topology, chains, complete: !job.is_cancelled() }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

    fn run(a: &Soup, b: &Soup) -> MeshIntersection {
        let tree = |m: &Soup| TriTree::new(m.0.clone(), &m.1);
        let view = |m: &'static Soup| Triangles { points: &m.0, triangles: &m.1 };
        let (a, b): (&'static Soup, &'static Soup) = (Box::leak(Box::new(a.clone())), Box::leak(Box::new(b.clone())));
        intersect(view(a), &tree(a), view(b), &tree(b), &Job::new())
    }

    /// A box with 12 triangles, outward.
    fn cuboid(low: DVec3, high: DVec3) -> Soup {
        let corner =
            |k: usize| DVec3::new([low.x, high.x][k & 1], [low.y, high.y][k >> 1 & 1], [low.z, high.z][k >> 2]);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        ((0..8).map(corner).collect(), triangles)
    }

    fn sphere(n: u32, radius: f64, center: DVec3) -> Soup {
        let mut points = vec![];
        let mut triangles = vec![];
        for j in 0..=n {
            for i in 0..2 * n {
                let (theta, phi) = (
                    std::f64::consts::PI * f64::from(j) / f64::from(n),
                    std::f64::consts::PI * f64::from(i) / f64::from(n),
                );
                points
                    .push(center + radius * DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
                let at = |i: u32, j: u32| {
                    if j == 0 {
                        0
                    } else if j == n {
                        n * 2 * n
                    } else {
                        j * 2 * n + i % (2 * n)
                    }
                };
                if j < n {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    triangles.extend(
                        [[a, c, b], [a, d, c]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
                    );
                }
            }
        }
        (points, triangles)
    }

    /// Two closed surfaces meet in closed curves, whatever the position: no ends, no bifurcations.
    fn assert_closed(result: &MeshIntersection) {
        assert!(result.chains.iter().all(|c| c.closed), "an end inside two closed meshes");
        assert_eq!(result.bifurcations().count(), 0);
        assert!(result.topology.without_area.is_empty());
    }

    #[test]
    fn two_spheres_meet_in_one_circle() {
        let result = run(&sphere(40, 1.0, DVec3::ZERO), &sphere(37, 1.0, DVec3::new(0.3, 0.7, 0.5)));
        assert_closed(&result);
        assert_eq!(result.chains.len(), 1);
        let radius = (1.0 - 0.25 * (0.09 + 0.49 + 0.25_f64)).sqrt();
        let middle = DVec3::new(0.3, 0.7, 0.5) / 2.0;
        for p in result.positions(&result.chains[0]) {
            assert!((p.distance(middle) - radius).abs() < 0.01);
        }
    }

    #[test]
    fn every_degenerate_placement_of_two_boxes_stays_closed() {
        // Shared faces, edges, corners, coplanar overlaps, identity: all shifts by halves.
        let a = cuboid(DVec3::ZERO, DVec3::splat(2.0));
        let mut meeting = 0;
        for k in 0..9 * 9 * 9 {
            let shift = DVec3::new(f64::from(k % 9), f64::from(k / 9 % 9), f64::from(k / 81)) * 0.5 - 2.0;
            for size in [1.0, 2.0] {
                let result = run(&a, &cuboid(shift, shift + size));
                assert_closed(&result);
                meeting += usize::from(!result.chains.is_empty());
            }
        }
        assert!(meeting > 100);
    }

    #[test]
    fn a_sphere_with_itself_and_with_its_duplicate_is_closed() {
        let a = sphere(12, 1.0, DVec3::ZERO);
        assert_closed(&run(&a, &a));
        let (mut points, mut triangles) = a.clone();
        let n = points.len() as u32;
        points.extend(a.0.iter().copied());
        triangles.extend(a.1.iter().map(|t| t.map(|k| k + n)));
        assert_closed(&run(&(points, triangles), &a));
    }

    #[test]
    fn a_sheet_across_a_box_ends_at_the_sheets_border() {
        let sheet = (
            vec![
                DVec3::new(-1.0, 1.0, 1.0),
                DVec3::new(1.0, 1.0, 1.0),
                DVec3::new(1.0, 1.0, 5.0),
                DVec3::new(-1.0, 1.0, 5.0),
            ],
            vec![[0, 1, 2], [0, 2, 3]],
        );
        let result = run(&cuboid(DVec3::ZERO, DVec3::splat(2.0)), &sheet);
        assert_eq!(result.chains.len(), 1);
        let chain = &result.chains[0];
        assert!(!chain.closed);
        let ends: Vec<DVec3> =
            [0, chain.points.len() - 1].map(|k| result.topology.points[chain.points[k] as usize].position).into();
        assert!(ends.contains(&DVec3::new(0.0, 1.0, 1.0)) && ends.contains(&DVec3::new(1.0, 1.0, 2.0)), "{ends:?}");
    }

    #[test]
    fn a_fin_of_three_sheets_bifurcates() {
        // Three half planes around the z axis share an edge; a horizontal sheet meets them in three curves.
        let mut points = vec![DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 1.0)];
        let mut triangles = vec![];
        for k in 0..3 {
            let (s, c) = (2.1 * f64::from(k)).sin_cos();
            points.push(DVec3::new(c, s, 0.1));
            triangles.push([0, 1, 2 + k as u32]);
        }
        let sheet =
            (vec![DVec3::new(-3.0, -3.0, 0.0), DVec3::new(3.0, -3.0, 0.0), DVec3::new(0.0, 4.0, 0.0)], vec![[0, 1, 2]]);
        let result = run(&(points, triangles), &sheet);
        assert_eq!(result.bifurcations().count(), 1);
        assert_eq!(result.chains.len(), 3);
    }
}
