//! Surfaces as structured grids that fit together: chosen counts and spacing, shared edges identical point for point.
//!
//! Every edge is divided once (see [`super::edge_net`]) and its points are given to all surfaces at it, so a seam has no
//! gap in the grid whatever the gap of the surfaces was; the largest distance that a point was moved for that is
//! reported. Inside, the grid lines join the divisions of opposite borders: the point (i, j) lies where the straight
//! line in the domain from the i-th point of v = min to the i-th of v = max meets that from the j-th point of u = min to
//! the j-th of u = max, which is on the surface exactly.
//!
//! Spacing along an edge: even in parameter; even in arc length; or clustered by the hyperbolic tangent towards chosen
//! sides in arc length (Vinokur, *On one-dimensional stretching functions for finite-difference calculations*,
//! J. Comput. Phys. 50, 1983): s = 1 + tanh(d (x - 1)) / tanh(d) towards the start, and the symmetric form towards both
//! ends. A side that attracts lines does so along all edges of the class that ends on it.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

mod division;

use self::division::{Division, counts, divide, fraction_at};
use super::edge_net::EdgeNet;
use super::grid::Grid;
use super::tri_mesh::{Group, MeshError, TriMesh};
use super::weld::Welder;
use crate::kernel::geom::{Side, Surface};
use crate::kernel::job::Job;

/// How many points an edge gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Counts {
    /// This many on every edge.
    Points(usize),
    /// As many as keep the triangles of the grid within this distance of the surfaces.
    ChordTolerance(f64),
}

/// How the points lie along an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spacing {
    /// Even in the surface's parameter.
    #[default]
    Uniform,
    /// Even in arc length.
    ArcLength,
    /// In arc length, clustered with this stretching towards the sides chosen; even where none is.
    Tanh(f64),
}

/// How to make grids.
#[derive(Clone, Debug, PartialEq)]
pub struct GridOptions {
    /// How many points.
    pub counts: Counts,
    /// How they are spaced.
    pub spacing: Spacing,
    /// The sides that attract grid lines (for [`Spacing::Tanh`]): the place of the surface, and the side.
    pub clusters: Vec<(usize, Side)>,
    /// What two borders may be apart and still be one edge, in model units.
    pub joining: f64,
    /// The most points of one edge. Default 2049.
    pub most: usize,
}

impl GridOptions {
    /// Even in parameter, at a joining tolerance.
    pub fn new(counts: Counts, joining: f64) -> Self {
        Self { counts, spacing: Spacing::Uniform, clusters: Vec::new(), joining, most: 2049 }
    }
}

/// Why no grid was made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StructuredError {
    /// There is nothing to make a grid of.
    #[error("there is no surface or patch to make a grid of")]
    NoSurface,
    /// A number of points is out of range.
    #[error("{got} points an edge: expected 2 to {most}")]
    Points {
        /// The number asked for.
        got: usize,
        /// The largest that is possible.
        most: usize,
    },
    /// A length or stretching is not positive.
    #[error("the {what} is {got}: expected a positive number")]
    NotPositive {
        /// Which.
        what: &'static str,
        /// Its value.
        got: f64,
    },
    /// A cluster names a surface that is not there.
    #[error("grid lines cannot be clustered at surface {got}: there are {count}, counted from 0")]
    Cluster {
        /// The number.
        got: usize,
        /// How many there are.
        count: usize,
    },
}

/// Grids that fit together.
#[derive(Clone, Debug, Default)]
pub struct GridSet {
    /// One surface grid for each surface; i runs along u.
    pub grids: Vec<Grid>,
    /// How many pairs of borders are one edge.
    pub seams: usize,
    /// The largest distance of two borders that are one edge, where their grid points are.
    pub largest_gap: f64,
    /// Between which two surfaces it is.
    pub largest_between: Option<[usize; 2]>,
    /// How far the middles of the grid's cells and cell edges are from the surfaces at most.
    pub chord_error: f64,
    /// Whether `most` made a grid coarser than the tolerance asks for.
    pub capped: bool,
    /// False when the job was cancelled; then some grids are missing.
    pub complete: bool,
}

/// Makes grids of surfaces.
pub fn structured(surfaces: &[Arc<Surface>], options: &GridOptions, job: &Job) -> Result<GridSet, StructuredError> {
    check(surfaces.len(), options)?;
    job.phase("Finding shared edges");
    let net = EdgeNet::new(surfaces, options.joining);
    let (counts, capped) = counts(surfaces, &net, options);
    job.phase("Dividing edges");
    // The fractions of the arc length at which an edge is divided come from the border that leads it.
    let lead: Vec<Division> = (0..net.borders.len())
        .into_par_iter()
        .map(|b| {
            if net.edge[b].of == b { divide(&net, b, counts[b], options) } else { Division { t: vec![], own: vec![] } }
        })
        .collect();
    let fractions: Vec<Vec<f64>> =
        lead.par_iter().enumerate().map(|(b, d)| d.t.iter().map(|&t| fraction_at(&net, b, t)).collect()).collect();
    let divisions: Vec<Division> = (0..net.borders.len())
        .into_par_iter()
        .map(|b| {
            let edge = net.edge[b];
            let s = &fractions[edge.of];
            let border = &net.borders[b];
            let length = border.arc.length();
            let [start, end] = border.curve.domain();
            let n = counts[b];
            let t: Vec<f64> = if edge.of == b {
                lead[b].t.clone()
            } else {
                let f = |k: usize| if edge.reversed { 1.0 - s[n - 1 - k] } else { s[k] };
                let at = |k: usize| match k {
                    0 => start,
                    k if k + 1 == n => end,
                    k => border.arc.parameter_at(&border.curve, f(k) * length),
                };
                (0..n).map(at).collect()
            };
            let own = t.iter().map(|&t| border.curve.eval(t)).collect();
            Division { t, own }
        })
        .collect();
    // One point for each vertex: that of the border with the lowest number.
    let mut corners: BTreeMap<usize, DVec3> = BTreeMap::new();
    for (b, ends) in net.vertices.iter().enumerate() {
        let own = &divisions[b].own;
        for (end, &vertex) in ends.iter().enumerate() {
            corners.entry(vertex).or_insert(own[if end == 0 { 0 } else { own.len() - 1 }]);
        }
    }
    let given = |b: usize| -> Vec<DVec3> {
        let edge = net.edge[b];
        let mut points = divisions[edge.of].own.clone();
        if edge.reversed {
            points.reverse();
        }
        let last = points.len() - 1;
        (points[0], points[last]) = (corners[&net.vertices[b][0]], corners[&net.vertices[b][1]]);
        points
    };
    let mut out = GridSet { seams: net.seams.len(), capped, complete: true, ..GridSet::default() };
    for b in 0..net.borders.len() {
        let gap = given(b).iter().zip(&divisions[b].own).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
        if gap > out.largest_gap {
            out.largest_gap = gap;
            out.largest_between = Some([net.edge[b].of / 4, b / 4]);
        }
    }
    job.phase("Filling grids");
    let done = std::sync::atomic::AtomicUsize::new(0);
    let grids: Vec<Option<(Grid, f64)>> = (0..surfaces.len())
        .into_par_iter()
        .map(|s| {
            let made = (!job.is_cancelled())
                .then(|| fill(&surfaces[s], &divisions[4 * s..4 * s + 4], [0, 1, 2, 3].map(|k| given(4 * s + k))));
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(done as f64 / surfaces.len() as f64);
            made.flatten()
        })
        .collect();
    for made in grids {
        match made {
            Some((grid, chord)) => {
                out.chord_error = out.chord_error.max(chord);
                out.grids.push(grid);
            }
            None => out.complete = false,
        }
    }
    Ok(out)
}

fn check(count: usize, options: &GridOptions) -> Result<(), StructuredError> {
    let positive = |what, got: f64| {
        if got > 0.0 && got.is_finite() { Ok(()) } else { Err(StructuredError::NotPositive { what, got }) }
    };
    if count == 0 {
        return Err(StructuredError::NoSurface);
    }
    match options.counts {
        Counts::Points(got) if !(2..=options.most).contains(&got) => {
            return Err(StructuredError::Points { got, most: options.most });
        }
        Counts::ChordTolerance(tol) => positive("chord tolerance", tol)?,
        Counts::Points(_) => {}
    }
    if let Spacing::Tanh(stretch) = options.spacing {
        positive("stretching", stretch)?;
    }
    positive("joining tolerance", options.joining)?;
    match options.clusters.iter().find(|(s, _)| *s >= count) {
        Some(&(got, _)) => Err(StructuredError::Cluster { got, count }),
        None => Ok(()),
    }
}

/// The grid of one surface between the given points on its borders, and its chord error.
fn fill(surface: &Surface, divisions: &[Division], given: [Vec<DVec3>; 4]) -> Option<(Grid, f64)> {
    let (ni, nj) = (divisions[0].t.len(), divisions[1].t.len());
    let [du, dv] = surface.domain();
    let unit = |t: f64, [a, b]: [f64; 2]| (t - a) / (b - a);
    let along = |k: usize, at: usize| unit(divisions[k].t[at], [du, dv][k % 2]);
    let place = |i: usize, j: usize| {
        let (ub, ut) = (along(0, i), along(2, i));
        let (vl, vr) = (along(3, j), along(1, j));
        let scale = 1.0 - (ut - ub) * (vr - vl);
        DVec2::new((ub + (ut - ub) * vl) / scale, (vl + (vr - vl) * ub) / scale)
    };
    let at = |p: DVec2| surface.eval(DVec2::new(du[0] + (du[1] - du[0]) * p.x, dv[0] + (dv[1] - dv[0]) * p.y));
    let mut points = Vec::with_capacity(ni * nj);
    for j in 0..nj {
        for i in 0..ni {
            points.push(match (i, j) {
                (i, 0) => given[0][i],
                (i, j) if j + 1 == nj => given[2][i],
                (0, j) => given[3][j],
                (i, j) if i + 1 == ni => given[1][j],
                (i, j) => at(place(i, j)),
            });
        }
    }
    let mut chord = 0.0_f64;
    let mut middle = |a: (usize, usize), b: (usize, usize)| {
        let p = 0.5 * (points[a.1 * ni + a.0] + points[b.1 * ni + b.0]);
        chord = chord.max(p.distance(at(0.5 * (place(a.0, a.1) + place(b.0, b.1)))));
    };
    for j in 0..nj {
        for i in 0..ni {
            if i + 1 < ni {
                middle((i, j), (i + 1, j));
            }
            if j + 1 < nj {
                middle((i, j), (i, j + 1));
            }
            if i + 1 < ni && j + 1 < nj {
                middle((i, j), (i + 1, j + 1));
            }
        }
    }
    Some((Grid::new([ni, nj, 1], points, None).ok()?, chord))
}

/// The grids as one triangle mesh with a group for each; shared points are one vertex.
pub fn welded(grids: &[Grid], names: &[String]) -> Result<TriMesh, MeshError> {
    let total: usize = grids.iter().map(|g| g.points().len()).sum();
    let mut welder = Welder::with_capacity(total);
    let mut triangles = Vec::with_capacity(2 * total);
    let mut groups = Vec::with_capacity(grids.len());
    for (k, grid) in grids.iter().enumerate() {
        let start = triangles.len();
        let part = grid.triangulated()?;
        for corners in part.triangles() {
            let mut own = [0; 3];
            for (own, &v) in own.iter_mut().zip(corners) {
                let vertex = welder.vertex(part.points()[v as usize]);
                *own = vertex.ok_or(MeshError::TooMany { got: total, limit: u32::MAX as usize })?;
            }
            if own[0] != own[1] && own[1] != own[2] && own[2] != own[0] {
                triangles.push(own);
            }
        }
        let name = names.get(k).cloned().unwrap_or_default();
        groups.push(Group { name, triangles: start..triangles.len() });
    }
    let mut mesh = TriMesh::new(welder.into_points(), triangles)?;
    mesh.groups = groups;
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    /// A quarter of the unit cylinder (u around, v up), from `quarter` on; turned ones have their v down.
    fn quarter(quarter: usize, turned: bool) -> Arc<Surface> {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let ring =
            [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0), (0.0, -1.0), (1.0, -1.0)];
        let row = |z: f64| [0, 1, 2].map(|k| ring[(2 * quarter + k) % 8]).map(|(x, y)| DVec3::new(x, y, z));
        let rows = if turned { [row(1.0), row(0.0)] } else { [row(0.0), row(1.0)] };
        let (ku, kv) = (Knots::bezier(2, 0.0, 1.0).unwrap(), Knots::bezier(1, 0.0, 1.0).unwrap());
        Arc::new(Surface::new(ku, kv, rows.concat(), Some([1.0, w, 1.0].repeat(2))).unwrap())
    }

    fn cylinder() -> Vec<Arc<Surface>> {
        (0..4).map(|k| quarter(k, k % 2 == 1)).collect()
    }

    #[test]
    fn shared_edges_are_identical_point_for_point_and_the_mesh_is_closed_there() {
        for spacing in [Spacing::Uniform, Spacing::ArcLength, Spacing::Tanh(2.0)] {
            let options =
                GridOptions { spacing, clusters: vec![(0, Side::VMin)], ..GridOptions::new(Counts::Points(9), 1e-6) };
            let set = structured(&cylinder(), &options, &Job::new()).unwrap();
            assert_eq!((set.grids.len(), set.seams), (4, 4));
            assert!(set.largest_gap < 1e-14, "{}", set.largest_gap);
            let mesh = welded(&set.grids, &[]).unwrap();
            // Only the two rims are free, each of 4 x 8 edges.
            assert_eq!(mesh.defects().border_edges, 64, "{spacing:?}");
            assert_eq!(mesh.points().len(), 32 * 9);
            assert!(mesh.points().iter().all(|p| (p.truncate().length() - 1.0).abs() < 1e-14));
        }
    }

    #[test]
    fn spacing_is_even_in_arc_length_or_clusters_where_asked_through_turned_neighbours() {
        let heights = |set: &GridSet, s: usize| -> Vec<f64> {
            let [ni, nj, _] = set.grids[s].counts();
            (0..nj).map(|j| set.grids[s].points()[j * ni].z).collect()
        };
        let even = GridOptions { spacing: Spacing::ArcLength, ..GridOptions::new(Counts::Points(11), 1e-6) };
        let set = structured(&cylinder(), &even, &Job::new()).unwrap();
        let points = set.grids[0].points();
        let chords: Vec<f64> = (0..10).map(|i| points[i].distance(points[i + 1])).collect();
        assert!(chords.iter().all(|c| (c - chords[0]).abs() < 1e-12), "{chords:?}");
        let towards = GridOptions { spacing: Spacing::Tanh(2.5), clusters: vec![(0, Side::VMin)], ..even };
        let set = structured(&cylinder(), &towards, &Job::new()).unwrap();
        for s in 0..4 {
            let mut z = heights(&set, s);
            z.sort_by(f64::total_cmp);
            let steps: Vec<f64> = z.windows(2).map(|p| p[1] - p[0]).collect();
            // Lines gather at z = 0 on every patch, and the steps grow by the tanh law.
            assert!(steps.windows(2).all(|p| p[1] > p[0]), "{s}: {steps:?}");
            let expected = 1.0 + (2.5 * (0.1 - 1.0_f64)).tanh() / 2.5_f64.tanh();
            assert!((z[1] - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn a_chord_tolerance_is_kept() {
        for tol in [1e-2, 1e-4] {
            let options = GridOptions::new(Counts::ChordTolerance(tol), 1e-6);
            let set = structured(&cylinder(), &options, &Job::new()).unwrap();
            assert!(set.chord_error <= tol && !set.capped, "{} {tol}", set.chord_error);
            assert!(set.chord_error > 0.05 * tol, "no waste: {}", set.chord_error);
        }
    }

    #[test]
    fn a_seam_with_a_gap_is_closed_and_measured() {
        let moved = quarter(1, false).transformed(&glam::DAffine3::from_translation(DVec3::Z * 1e-4));
        let options = GridOptions::new(Counts::Points(5), 1e-3);
        let set = structured(&[quarter(0, false), Arc::new(moved)], &options, &Job::new()).unwrap();
        assert!((set.largest_gap - 1e-4).abs() < 1e-12);
        assert_eq!(set.largest_between, Some([0, 1]));
        assert_eq!(welded(&set.grids, &[]).unwrap().defects().border_edges, 4 * 4 + 2 * 4);
    }

    #[test]
    fn senseless_requests_are_refused() {
        let ask = |change: &dyn Fn(&mut GridOptions), surfaces: &[Arc<Surface>]| {
            let mut options = GridOptions::new(Counts::Points(5), 1e-3);
            change(&mut options);
            structured(surfaces, &options, &Job::new()).unwrap_err()
        };
        assert_eq!(ask(&|_| {}, &[]), StructuredError::NoSurface);
        let one = [quarter(0, false)];
        assert!(matches!(ask(&|o| o.counts = Counts::Points(1), &one), StructuredError::Points { got: 1, .. }));
        assert!(matches!(ask(&|o| o.counts = Counts::ChordTolerance(0.0), &one), StructuredError::NotPositive { .. }));
        assert!(matches!(ask(&|o| o.spacing = Spacing::Tanh(f64::NAN), &one), StructuredError::NotPositive { .. }));
        assert!(matches!(
            ask(&|o| o.clusters = vec![(3, Side::UMin)], &one),
            StructuredError::Cluster { got: 3, count: 1 }
        ));
    }
}
