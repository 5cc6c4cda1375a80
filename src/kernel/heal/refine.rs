//! One resolution after the other, HJR99 3.6, until the error is small enough.
//!
//! Every chain of opposite sides has its number of spans. A patch whose error at e (or f) is too large asks for
//! twice as many along u (or v); if only g or the Gauss points are too large, for both. All patches are made anew
//! at the new numbers, since edges belong to two of them. It ends when no patch asks, when what is asked for is
//! above the maximum, or on cancel, with the last resolution that was finished.

use glam::DVec3;
use rayon::prelude::*;

use super::boundary_loop::{self, BoundaryLoop};
use super::connect::{Edge, Topology, connect};
use super::coons::coons;
use super::deviation::{self, Reference};
use super::fit;
use super::grid::Grid;
use super::hardy;
use super::normals::normals;
use super::project::{Sample, Status, project};
use super::report::{BoundaryMode, HealStep, PatchReport};
use super::side::SideCurve;
use super::slab;
use super::{HealError, HealOptions, Healed, HealedPatch, PatchInput, SharedBoundary};
use crate::kernel::geom::Aabb;
use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};

/// What is known before anything is projected.
pub(super) struct Plan {
    loops: Vec<BoundaryLoop>,
    topology: Topology,
    slabs: Vec<f64>,
}

/// Joins, closes and connects the sides.
pub(super) fn plan(patches: &[PatchInput], options: &HealOptions) -> Result<Plan, HealError> {
    options.check()?;
    if patches.is_empty() {
        return Err(HealError::NoPatch);
    }
    let mut loops = Vec::new();
    for patch in patches {
        let tolerance = patch.joining_tol.unwrap_or(options.joining_tol);
        let mut sides = Vec::new();
        for (k, pieces) in patch.sides.iter().enumerate() {
            let mut side = SideCurve::chain(pieces, tolerance).map_err(|source| HealError::Side {
                patch: patch.name.clone(),
                side: k + 1,
                source,
            })?;
            for &(_, to) in patch.moves.iter().filter(|m| m.0 == k) {
                let [a, b] = side.ends();
                side = side.with_ends(if a.distance(to) <= b.distance(to) { [to, b] } else { [a, to] });
            }
            sides.push(side);
        }
        let Ok(sides) = <[SideCurve; 4]>::try_from(sides) else { return Err(HealError::NoPatch) };
        let closed = boundary_loop::close(&sides, tolerance, patch.choice)
            .map_err(|source| HealError::Loop { patch: patch.name.clone(), source })?;
        loops.push(closed);
    }
    let names: Vec<String> = patches.iter().map(|p| p.name.clone()).collect();
    let modes: Vec<[BoundaryMode; 4]> = patches.iter().map(|p| p.modes).collect();
    let topology = connect(&loops, &names, &modes, options.joining_tol)?;
    let slabs = topology
        .corners
        .iter()
        .map(|c| options.slab.unwrap_or_else(|| slab::default_distance(c.map(|v| topology.vertices[v]))))
        .collect();
    Ok(Plan { loops, topology, slabs })
}

impl Plan {
    /// Whether two different patches have an edge in common.
    pub(super) fn shares_an_edge(&self) -> bool {
        self.topology.edges.iter().any(|e| e.uses.iter().any(|u| u.patch != e.uses[0].patch))
    }

    /// The boxes of influence of the patches, from a coarse Coons grid (grown by a tenth of the slab for what the
    /// finer ones may add).
    pub(super) fn boxes(&self, options: &HealOptions) -> Vec<Aabb> {
        let counts = vec![options.min_resolution.max(16); self.topology.chains];
        let edges: Vec<Vec<DVec3>> = self.topology.edges.iter().map(|e| e.curve.samples(counts[e.chain])).collect();
        (0..self.slabs.len())
            .map(|p| {
                let grid = coons_of(&self.topology, &edges, p);
                slab::influence(&grid, &normals(&grid), self.slabs[p]).grown(0.1 * self.slabs[p])
            })
            .collect()
    }
}

/// The points of a patch's four sides in increasing parameter, from those of the edges.
fn sides_of<T: Clone>(topology: &Topology, edges: &[Vec<T>], patch: usize) -> [Vec<T>; 4] {
    topology.patches[patch].map(|(edge, reversed)| {
        let mut points = edges[edge].clone();
        if reversed {
            points.reverse();
        }
        points
    })
}

fn coons_of(topology: &Topology, edges: &[Vec<DVec3>], patch: usize) -> Grid<DVec3> {
    let [bottom, right, top, left] = sides_of(topology, edges, patch);
    coons(&bottom, &right, &top, &left)
}

/// Everything at one resolution.
struct Stage {
    patches: Vec<HealedPatch>,
}

/// Refines until done.
pub(super) fn run(
    inputs: &[PatchInput],
    plan: &Plan,
    set: &SurfaceSet,
    options: &HealOptions,
    job: &Job,
) -> Result<Healed, HealError> {
    for (input, closed) in inputs.iter().zip(&plan.loops) {
        if closed.alternative.is_some() {
            job.warn(format!("patch \"{}\": its sides close in another way almost as well", input.name));
        }
    }
    if !set.capped().is_empty() {
        job.warn(format!("surfaces {:?} are tessellated more coarsely than asked for", set.capped()));
    }
    let topology = &plan.topology;
    let mut counts = vec![options.min_resolution.min(options.max_resolution); topology.chains];
    let mut history: Vec<Vec<HealStep>> = vec![Vec::new(); inputs.len()];
    let mut last: Option<Stage> = None;
    let rounds = (options.max_resolution as f64 / options.min_resolution as f64).log2().max(0.0).ceil() + 1.0;
    let mut round = 0.0;
    let complete = loop {
        job.phase(&format!("Resolution {}", counts.iter().max().copied().unwrap_or(0)));
        let Some(mut stage) = stage(inputs, plan, set, options, &counts, job)? else { break false };
        let mut wanted = vec![false; topology.chains];
        for (p, patch) in stage.patches.iter_mut().enumerate() {
            let resolution = patch.report.resolution;
            if history[p].last().is_none_or(|s| s.resolution != resolution) {
                history[p].push(HealStep { resolution, max_error: patch.report.max_error });
            }
            patch.report.iterations = history[p].len();
            patch.report.history.clone_from(&history[p]);
            let [e, f, g] = patch.deviation.max.map(|d| d > options.tol);
            let own = topology.patches[p].map(|(edge, _)| topology.edges[edge].chain);
            wanted[own[0]] |= e || (g && !f);
            wanted[own[1]] |= f || (g && !e);
        }
        last = Some(stage);
        round += 1.0;
        job.progress(round / (rounds + 1.0));
        let mut changed = false;
        for (count, wanted) in counts.iter_mut().zip(wanted) {
            if wanted && 2 * *count <= options.max_resolution {
                *count *= 2;
                changed = true;
            }
        }
        if !changed {
            break true;
        }
    };
    if complete {
        job.progress(1.0);
    }
    let mut patches = last.map_or(Vec::new(), |s| s.patches);
    patches.iter_mut().for_each(|p| p.report.incomplete = !complete);
    let shared = shared_boundaries(topology, &patches);
    Ok(Healed { patches, shared, loops: plan.loops.clone(), complete })
}

/// Makes all patches at given numbers of spans; `None` when cancelled.
fn stage(
    inputs: &[PatchInput],
    plan: &Plan,
    set: &SurfaceSet,
    options: &HealOptions,
    counts: &[usize],
    job: &Job,
) -> Result<Option<Stage>, HealError> {
    let topology = &plan.topology;
    let on_curves: Vec<Vec<DVec3>> = topology.edges.par_iter().map(|e| e.curve.samples(counts[e.chain])).collect();
    let grids: Vec<(Grid<DVec3>, Grid<DVec3>)> = (0..inputs.len())
        .into_par_iter()
        .map(|p| {
            let grid = coons_of(topology, &on_curves, p);
            let normals = normals(&grid);
            (grid, normals)
        })
        .collect();
    if job.is_cancelled() {
        return Ok(None);
    }
    let edges = edge_samples(plan, set, options, &on_curves, &grids, job);
    let beziers: Vec<Vec<DVec3>> = edges.iter().zip(&topology.edges).map(|(s, e)| edge_bezier(s, e)).collect();
    let mut patches = Vec::new();
    for (p, (grid, normals)) in grids.into_iter().enumerate() {
        let sides = sides_of(topology, &edges, p);
        let samples = interior(&grid, &normals, &sides, plan.slabs[p], set, options, job);
        let Some(samples) = samples else { return Ok(None) };
        let [projected, several, artificial, kept] = deviation::count(&samples);
        if projected == 0 {
            let samples = samples.values().len();
            return Err(HealError::NoProjection { patch: inputs[p].name.clone(), samples, slab: plan.slabs[p] });
        }
        let borders = sides_of(topology, &beziers, p);
        let net = fit::bezier_net(
            &samples.map(|s| s.point),
            &samples.map(|s| s.status.is_projected()),
            [&borders[0], &borders[1], &borders[2], &borders[3]],
            options.twist,
        );
        // The net is finite and the knots are uniform, so this only fails on coordinates that overflowed.
        let Ok(surface) = fit::surface(&net) else {
            return Err(HealError::Option {
                name: "coordinates",
                got: format!("too large in patch \"{}\"", inputs[p].name),
                expected: "finite",
            });
        };
        let turned = kept_sides(topology, p);
        let reference = Reference {
            set,
            samples: &samples,
            kept: [0, 1, 2, 3].map(|s| turned[s].as_ref()),
            slab: plan.slabs[p],
            tol: options.tol,
        };
        let deviation = deviation::measure(&surface, &reference, job);
        if deviation.incomplete {
            return Ok(None);
        }
        let max_error = deviation.largest();
        let report = PatchReport {
            max_error,
            rms: deviation.rms,
            resolution: [grid.m(), grid.n()],
            projected,
            several,
            artificial,
            kept,
            checked: deviation.checked,
            skipped: deviation.skipped,
            reached: max_error <= options.tol,
            ..PatchReport::default()
        };
        let name = inputs[p].name.clone();
        patches.push(HealedPatch { name, surface, samples, coons: grid, slab: plan.slabs[p], deviation, report });
    }
    Ok(Some(Stage { patches }))
}

/// The Bezier points of an edge. On a kept curve every sample is real, wherever the originals are.
fn edge_bezier(samples: &[Sample], edge: &Edge) -> Vec<DVec3> {
    let points: Vec<DVec3> = samples.iter().map(|s| s.point).collect();
    let real = |s: &Sample| edge.mode == BoundaryMode::Keep || s.status.is_projected();
    fit::bezier_row_in_runs(&points, &samples.iter().map(real).collect::<Vec<_>>())
}

/// The kept sides of a patch in increasing parameter.
fn kept_sides(topology: &Topology, patch: usize) -> [Option<SideCurve>; 4] {
    topology.patches[patch].map(|(edge, reversed)| {
        let edge = &topology.edges[edge];
        (edge.mode == BoundaryMode::Keep).then(|| if reversed { edge.curve.reversed() } else { edge.curve.clone() })
    })
}

/// The border of a grid in increasing parameter of a slot.
fn border<T: Copy>(grid: &Grid<T>, slot: usize) -> Vec<T> {
    match slot {
        0 => grid.row(0).to_vec(),
        1 => grid.column(grid.m()),
        2 => grid.row(grid.n()).to_vec(),
        _ => grid.column(0),
    }
}

/// The samples of every edge: on the picked curve, or projected along the mean normal of the patches at it.
fn edge_samples(
    plan: &Plan,
    set: &SurfaceSet,
    options: &HealOptions,
    on_curves: &[Vec<DVec3>],
    grids: &[(Grid<DVec3>, Grid<DVec3>)],
    job: &Job,
) -> Vec<Vec<Sample>> {
    let topology = &plan.topology;
    let direction: Vec<Vec<DVec3>> = (0..topology.edges.len()).map(|e| edge_normals(topology, grids, e)).collect();
    let slab_of = |e: usize| topology.edges[e].uses.iter().map(|u| plan.slabs[u.patch]).fold(0.0, f64::max);
    let vertices: Vec<Sample> = (0..topology.vertices.len())
        .map(|v| {
            let x = topology.vertices[v];
            let mut scratch = Scratch::default();
            let touching: Vec<usize> =
                (0..topology.edges.len()).filter(|&e| topology.edges[e].ends.contains(&v)).collect();
            if touching.iter().any(|&e| topology.edges[e].mode == BoundaryMode::Keep) {
                return keep(set, x, options.tol, &mut scratch);
            }
            // The mean of the edges' normals here, turned to the first one's side.
            let mut n = DVec3::ZERO;
            for &e in &touching {
                let own =
                    if topology.edges[e].ends[0] == v { direction[e][0] } else { direction[e][direction[e].len() - 1] };
                n += if own.dot(n) < 0.0 { -own } else { own };
            }
            let d = touching.iter().map(|&e| slab_of(e)).fold(0.0, f64::max);
            let found = project(set, x, n.normalize_or_zero(), d, &mut scratch);
            found.unwrap_or_else(|| keep(set, x, options.tol, &mut scratch))
        })
        .collect();
    (0..topology.edges.len())
        .into_par_iter()
        .map(|e| {
            let edge = &topology.edges[e];
            let mut scratch = Scratch::default();
            let points = &on_curves[e];
            let last = points.len() - 1;
            if edge.mode == BoundaryMode::Keep {
                let mut samples: Vec<Sample> =
                    points.iter().map(|&x| keep(set, x, options.tol, &mut scratch)).collect();
                (samples[0], samples[last]) = (vertices[edge.ends[0]], vertices[edge.ends[1]]);
                return samples;
            }
            let d = slab_of(e);
            let mut found: Vec<Option<Sample>> =
                (0..=last).map(|k| project(set, points[k], direction[e][k], d, &mut scratch)).collect();
            for (k, v) in [(0, edge.ends[0]), (last, edge.ends[1])] {
                let t = place(points[k], direction[e][k], d, vertices[v].point);
                found[k] = Some(Sample { t, ..vertices[v] });
            }
            let known = Grid::from_fn(last, 0, |k, _| found[k].map(|s| s.t));
            let filled = hardy::fill(&known, &options.hardy, job);
            (0..=last)
                .map(|k| found[k].unwrap_or_else(|| artificial(points[k], direction[e][k], d, filled[(k, 0)])))
                .collect()
        })
        .collect()
}

/// The unit normals along an edge: of one patch, or the mean of two.
fn edge_normals(topology: &Topology, grids: &[(Grid<DVec3>, Grid<DVec3>)], e: usize) -> Vec<DVec3> {
    let mut sum: Vec<DVec3> = Vec::new();
    for u in &topology.edges[e].uses {
        let mut own = border(&grids[u.patch].1, u.slot);
        if u.reversed {
            own.reverse();
        }
        if sum.is_empty() {
            sum = own;
        } else {
            // Neighbours may be oriented against each other; all turn together, by the majority of the samples.
            let agree: f64 = sum.iter().zip(&own).map(|(a, b)| a.dot(*b)).sum();
            let sign = if agree < 0.0 { -1.0 } else { 1.0 };
            sum.iter_mut().zip(own).for_each(|(a, b)| *a += b * sign);
        }
    }
    sum.into_iter().map(DVec3::normalize_or_zero).collect()
}

/// A sample that stays where it is; it counts as projected when an original is within the tolerance.
fn keep(set: &SurfaceSet, x: DVec3, tol: f64, scratch: &mut Scratch) -> Sample {
    match set.closest(x, tol, scratch) {
        Some(foot) => Sample { point: x, status: Status::Hit, t: 0.5, on: Some((foot.surface, foot.uv)) },
        None => Sample { point: x, status: Status::Kept, t: 0.5, on: None },
    }
}

/// t of (10) of a point near the segment of x.
fn place(x: DVec3, n: DVec3, d: f64, y: DVec3) -> f64 {
    (0.5 - (y - x).dot(n) / (2.0 * d)).clamp(0.0, 1.0)
}

/// (13). Without any known t the sample stays on the Coons patch.
fn artificial(x: DVec3, n: DVec3, d: f64, t: Option<f64>) -> Sample {
    let t = t.unwrap_or(0.5);
    let [a, b] = slab::segment(x, n, d);
    // From x, so that t = 1/2 gives x to the bit.
    Sample { point: x + (b - a) * (t - 0.5), status: Status::Artificial, t, on: None }
}

/// The samples of a patch: its sides as they are, its interior projected and filled. `None` when cancelled.
fn interior(
    grid: &Grid<DVec3>,
    normals: &Grid<DVec3>,
    sides: &[Vec<Sample>; 4],
    d: f64,
    set: &SurfaceSet,
    options: &HealOptions,
    job: &Job,
) -> Option<Grid<Sample>> {
    let (m, n) = (grid.m(), grid.n());
    let side = |i: usize, j: usize| match (i, j) {
        (i, 0) => Some(sides[0][i]),
        (i, j) if j == n => Some(sides[2][i]),
        (0, j) => Some(sides[3][j]),
        (i, j) if i == m => Some(sides[1][j]),
        _ => None,
    };
    let rows: Vec<Vec<Option<Sample>>> = (0..=n)
        .into_par_iter()
        .map(|j| {
            let mut scratch = Scratch::default();
            (0..=m)
                .map(|i| {
                    if let Some(mut s) = side(i, j) {
                        s.t = place(grid[(i, j)], normals[(i, j)], d, s.point);
                        return Some(s);
                    }
                    if job.is_cancelled() {
                        return None;
                    }
                    project(set, grid[(i, j)], normals[(i, j)], d, &mut scratch)
                })
                .collect()
        })
        .collect();
    let found = Grid::from_rows(rows)?;
    let filled = hardy::fill(&found.map(|s| s.map(|s| s.t)), &options.hardy, job);
    if job.is_cancelled() {
        return None;
    }
    Some(Grid::from_fn(m, n, |i, j| {
        found[(i, j)].unwrap_or_else(|| artificial(grid[(i, j)], normals[(i, j)], d, filled[(i, j)]))
    }))
}

/// Measures what two patches have in common along each shared edge.
fn shared_boundaries(topology: &Topology, patches: &[HealedPatch]) -> Vec<SharedBoundary> {
    let mut out = Vec::new();
    for edge in &topology.edges {
        let [a, b] = edge.uses[..] else { continue };
        let (Some(p), Some(q)) = (patches.get(a.patch), patches.get(b.patch)) else { continue };
        let spans = if a.slot % 2 == 0 { p.samples.m() } else { p.samples.n() };
        let at = |u: &super::connect::Use, f: f64| {
            let f = if u.reversed { 1.0 - f } else { f };
            match u.slot {
                0 => glam::DVec2::new(f, 0.0),
                1 => glam::DVec2::new(1.0, f),
                2 => glam::DVec2::new(f, 1.0),
                _ => glam::DVec2::new(0.0, f),
            }
        };
        let (mut max_gap, mut angle) = (0.0_f64, 0.0_f64);
        for k in 0..=4 * spans {
            let f = k as f64 / (4 * spans) as f64;
            let (s, t) = (p.surface.jet(at(&a, f), 1), q.surface.jet(at(&b, f), 1));
            max_gap = max_gap.max(s.p().distance(t.p()));
            if let (Some(x), Some(y)) = (s.normal(), t.normal()) {
                // Neighbours may be oriented against each other: the angle is that of the tangent planes.
                angle = angle.max(x.cross(y).length().atan2(x.dot(y).abs()));
            }
        }
        out.push(SharedBoundary {
            patches: [a.patch, b.patch],
            slots: [a.slot, b.slot],
            max_gap,
            max_normal_angle_deg: angle.to_degrees(),
        });
    }
    out
}
