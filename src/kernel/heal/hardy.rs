//! Artificial projections by Hardy's localized reciprocal multiquadrics, HJR99 (11)-(13).
//!
//! t(u, v) = plane(u, v) + sum of c_i (R + |(u, v) - (u_i, v_i)|^2)^-gamma interpolates the known t of K
//! neighbours in index space. Different from the paper: it interpolates t minus its least-squares plane, since
//! with gamma = 0.001 the basis alone misses constants and slopes by about 1e-4 of the slab; and of the K
//! neighbours each octant gives its nearest first. The K nearest alone often lie on one rim of a gap, and what
//! they extrapolate from either side does not meet in the middle.
//!
//! The matrix is positive definite with condition 1e4 to 1e9. Cost: O(K^3) a sample plus the search for
//! neighbours, which is quadratic in the width of the gap. t is clamped to 0..=1: no sample leaves the slab.

use glam::DVec2;
use rayon::prelude::*;

use super::grid::Grid;
use crate::kernel::job::Job;

/// The parameters of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HardyOptions {
    /// K: how many known projections an artificial one is made from. Default 8 (the paper: five to ten).
    pub neighbours: usize,
    /// R; half the sum of the mean parameter spacings when `None`.
    pub r: Option<f64>,
    /// gamma. Default 0.001.
    pub gamma: f64,
}

impl Default for HardyOptions {
    fn default() -> Self {
        Self { neighbours: 8, r: None, gamma: 0.001 }
    }
}

/// t of every sample, given where it is known. Samples stay unknown only if none is known or the job was
/// cancelled.
pub fn fill(known: &Grid<Option<f64>>, options: &HardyOptions, job: &Job) -> Grid<Option<f64>> {
    let (m, n) = (known.m(), known.n());
    let spacing = DVec2::new(1.0 / m as f64, 1.0 / n.max(1) as f64);
    let r = options.r.unwrap_or(0.5 * (spacing.x + spacing.y));
    let rows: Vec<Vec<Option<f64>>> = (0..=n)
        .into_par_iter()
        .map(|j| {
            (0..=m)
                .map(|i| {
                    if known[(i, j)].is_some() || job.is_cancelled() {
                        return known[(i, j)];
                    }
                    let near = neighbours(known, i, j, options.neighbours.max(1));
                    let at = |(a, b): (usize, usize)| DVec2::new(a as f64, b as f64) * spacing;
                    let data: Vec<(DVec2, f64)> = near.iter().filter_map(|&k| Some((at(k), known[k]?))).collect();
                    value(&data, at((i, j)), r, options.gamma)
                })
                .collect()
        })
        .collect();
    Grid::from_rows(rows).unwrap_or_else(|| known.clone())
}

/// Up to K known samples around (i, j): the nearest of each octant first, then the nearest of all.
fn neighbours(known: &Grid<Option<f64>>, i: usize, j: usize, count: usize) -> Vec<(usize, usize)> {
    let (m, n) = (known.m() as isize, known.n() as isize);
    let (ci, cj) = (i as isize, j as isize);
    let mut found: Vec<(isize, usize, (usize, usize))> = Vec::new();
    let mut octants = [false; 8];
    let mut enough = None;
    for ring in 1..=m.max(n) {
        // A ring further out by sqrt(2) may hold nothing nearer than the corners of this one.
        if enough.is_some_and(|e: isize| 2 * ring * ring > 4 * e * e + 2) {
            break;
        }
        for (a, b) in ring_cells(ci, cj, ring) {
            if (0..=m).contains(&a) && (0..=n).contains(&b) && known[(a as usize, b as usize)].is_some() {
                let (x, y) = (a - ci, b - cj);
                let octant = octant(x, y);
                octants[octant] = true;
                found.push((x * x + y * y, octant, (a as usize, b as usize)));
            }
        }
        if enough.is_none() && found.len() >= count && octants.iter().all(|&o| o) {
            enough = Some(ring);
        }
    }
    found.sort_by_key(|f| (f.0, f.2.1, f.2.0));
    let mut taken = [false; 8];
    let mut out = Vec::new();
    for f in &found {
        if out.len() < count && !taken[f.1] {
            taken[f.1] = true;
            out.push(f.2);
        }
    }
    for f in &found {
        if out.len() < count && !out.contains(&f.2) {
            out.push(f.2);
        }
    }
    out
}

fn ring_cells(i: isize, j: isize, r: isize) -> impl Iterator<Item = (isize, isize)> {
    let rows = (-r..=r).flat_map(move |k| [(i + k, j - r), (i + k, j + r)]);
    let columns = (1 - r..r).flat_map(move |k| [(i - r, j + k), (i + r, j + k)]);
    rows.chain(columns)
}

fn octant(x: isize, y: isize) -> usize {
    let (sx, sy) = (usize::from(x < 0 || (x == 0 && y < 0)), usize::from(y < 0 || (y == 0 && x > 0)));
    (sx * 2 + sy) * 2 + usize::from(x.abs() > y.abs())
}

/// The interpolant of (12), plane removed, at a place. `None` without data.
fn value(data: &[(DVec2, f64)], at: DVec2, r: f64, gamma: f64) -> Option<f64> {
    let (center, mean, slope) = plane(data)?;
    let flat = |p: DVec2| mean + slope.dot(p - center);
    let phi = |a: DVec2, b: DVec2| (r + a.distance_squared(b)).powf(-gamma);
    let matrix: Vec<Vec<f64>> = data.iter().map(|p| data.iter().map(|q| phi(p.0, q.0)).collect()).collect();
    let rest: Vec<f64> = data.iter().map(|&(p, t)| t - flat(p)).collect();
    // A singular matrix needs coincident samples, which an index grid has not; the plane is then what is left.
    let bumps = solve(matrix, rest).map_or(0.0, |c| c.iter().zip(data).map(|(c, (p, _))| c * phi(at, *p)).sum());
    let t: f64 = flat(at) + bumps;
    t.is_finite().then(|| t.clamp(0.0, 1.0))
}

/// The least-squares plane: centre, value there, slope. Directions in which the data have no extent get none.
fn plane(data: &[(DVec2, f64)]) -> Option<(DVec2, f64, DVec2)> {
    if data.is_empty() {
        return None;
    }
    let count = data.len() as f64;
    let center = data.iter().map(|d| d.0).sum::<DVec2>() / count;
    let mean = data.iter().map(|d| d.1).sum::<f64>() / count;
    let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, DVec2::ZERO);
    for &(p, t) in data {
        let q = p - center;
        (xx, xy, yy) = (xx + q.x * q.x, xy + q.x * q.y, yy + q.y * q.y);
        right += q * (t - mean);
    }
    let determinant = xx * yy - xy * xy;
    let slope = if determinant > 1e-9 * (xx + yy) * (xx + yy) {
        DVec2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / determinant
    } else if xx + yy > 0.0 {
        // All on a line: the slope along it.
        right / (xx + yy)
    } else {
        DVec2::ZERO
    };
    Some((center, mean, slope))
}

/// Gaussian elimination with partial pivoting; `None` when singular.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&p, &q| a[p][k].abs().total_cmp(&a[q][k].abs()))?;
        a.swap(k, pivot);
        b.swap(k, pivot);
        if !(a[k][k].abs() > 1e-15) {
            return None;
        }
        for row in k + 1..n {
            let factor = a[row][k] / a[k][k];
            for column in k..n {
                a[row][column] -= factor * a[k][column];
            }
            b[row] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|c| a[k][c] * b[c]).sum();
        b[k] = (b[k] - sum) / a[k][k];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_hole(n: usize, f: impl Fn(f64, f64) -> f64, hole: impl Fn(usize, usize) -> bool) -> Grid<Option<f64>> {
        Grid::from_fn(n, n, |i, j| (!hole(i, j)).then(|| f(i as f64 / n as f64, j as f64 / n as f64)))
    }

    #[test]
    fn planes_are_continued_exactly_and_known_values_stay() {
        let f = |x: f64, y: f64| 0.3 + 0.2 * x - 0.1 * y;
        let known = with_hole(12, f, |i, j| (4..=8).contains(&i) && (3..=9).contains(&j));
        let full = fill(&known, &HardyOptions::default(), &Job::new());
        for j in 0..=12 {
            for i in 0..=12 {
                let truth = f(i as f64 / 12.0, j as f64 / 12.0);
                assert!((full[(i, j)].unwrap() - truth).abs() < 1e-9, "{i} {j}");
            }
        }
    }

    #[test]
    fn it_interpolates_its_data() {
        let data: Vec<(DVec2, f64)> = (0..8)
            .map(f64::from)
            .map(|k| (DVec2::new((k * 0.7).sin(), (k * 1.3).cos()), 0.5 + 0.3 * (k * 2.1).sin()))
            .collect();
        for &(p, t) in &data {
            assert!((value(&data, p, 0.1, 0.001).unwrap() - t).abs() < 1e-6);
        }
    }

    #[test]
    fn a_bump_is_filled_much_better_than_by_its_mean() {
        let f = |x: f64, y: f64| 0.5 + 0.2 * (2.0 * x).sin() * (2.0 * y).cos();
        let known = with_hole(20, f, |i, j| (7..=13).contains(&i) && (7..=13).contains(&j));
        let full = fill(&known, &HardyOptions::default(), &Job::new());
        for k in 7..=13 {
            let truth = f(k as f64 / 20.0, 0.5);
            assert!((full[(k, 10)].unwrap() - truth).abs() < 0.01);
        }
    }

    #[test]
    fn symmetric_data_are_filled_symmetrically_enough_and_nothing_known_stays_unknown() {
        let known =
            with_hole(10, |x, y| 0.5 + (x - 0.5) * (y - 0.5), |i, j| (3..=7).contains(&i) && (3..=7).contains(&j));
        let full = fill(&known, &HardyOptions::default(), &Job::new());
        assert!((full[(5, 5)].unwrap() - 0.5).abs() < 1e-3);
        let none = Grid::from_fn(3, 3, |_, _| None);
        assert!(fill(&none, &HardyOptions::default(), &Job::new()).values().iter().all(Option::is_none));
    }

    #[test]
    fn one_row_works_for_edges() {
        let known = Grid::from_fn(10, 0, |i, _| (!(3..=6).contains(&i)).then_some(0.1 * i as f64));
        let full = fill(&known, &HardyOptions::default(), &Job::new());
        for i in 0..=10 {
            assert!((full[(i, 0)].unwrap() - 0.1 * i as f64).abs() < 1e-6);
        }
    }

    #[test]
    fn octants_are_eight() {
        let mut seen = [0; 8];
        for (x, y) in ring_cells(0, 0, 3) {
            seen[octant(x, y)] += 1;
        }
        assert!(seen.iter().all(|&s| s > 0) && seen.iter().sum::<i32>() == 24, "{seen:?}");
    }
}
