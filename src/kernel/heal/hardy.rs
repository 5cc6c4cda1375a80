//! Artificial projections by Hardy's localized reciprocal multiquadrics, HJR99 (11)-(13).
//!
//! t(u, v) = plane(u, v) + sum of c_i (R + |(u, v) - (u_i, v_i)|^2)^-gamma interpolates the known t of K
//! neighbours in index space. Different from the paper: it interpolates t minus its least-squares plane, since
//! with gamma = 0.001 the basis alone misses constants and slopes by about 1e-4 of the slab; and of the K
//! neighbours each octant gives its nearest first. The K nearest alone often lie on one rim of a gap, and what
//! they extrapolate from either side does not meet in the middle.
//!
//! The matrix is positive definite with condition 1e4 to 1e9. Cost: O(K^3) a sample plus the search for
//! neighbours, whose rings are looked at until every octant has one or leaves the grid. t is clamped to 0..=1: no sample leaves the slab.

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
    // By distance, then row by row.
    type Key = (isize, usize, usize);
    let mut of_octant: [Option<Key>; 8] = [None; 8];
    let mut nearest: Vec<Key> = Vec::with_capacity(count + 1);
    let reaches: [isize; 8] = std::array::from_fn(|o| reach(o, [ci, cj], [m, n]));
    for ring in 1..=m.max(n) {
        let mut done = true;
        for (o, best) in of_octant.iter_mut().enumerate() {
            // Whether a sample this far out may still be the nearest of the octant, or among the nearest of all.
            let wanted = |key: Option<&Key>| key.is_none_or(|k| ring * ring <= k.0);
            let last = nearest.last().filter(|_| nearest.len() == count);
            if ring > reaches[o] || !(wanted(best.as_ref()) || wanted(last)) {
                continue;
            }
            done = false;
            for (x, y) in arc(o, ring) {
                let (a, b) = (ci + x, cj + y);
                if (0..=m).contains(&a) && (0..=n).contains(&b) && known[(a as usize, b as usize)].is_some() {
                    let key = (x * x + y * y, b as usize, a as usize);
                    if best.is_none_or(|best| key < best) {
                        *best = Some(key);
                    }
                    if nearest.len() < count || nearest.last().is_some_and(|last| key < *last) {
                        nearest.insert(nearest.partition_point(|k| *k < key), key);
                        nearest.truncate(count);
                    }
                }
            }
        }
        if done {
            break;
        }
    }
    let mut out: Vec<Key> = of_octant.into_iter().flatten().collect();
    out.sort_unstable();
    out.truncate(count);
    for key in nearest {
        if out.len() < count && !out.contains(&key) {
            out.push(key);
        }
    }
    out.into_iter().map(|(_, b, a)| (a, b)).collect()
}

/// How many steps from a sample to the border of the grid in the direction that an octant lies along.
fn reach(octant: usize, at: [isize; 2], size: [isize; 2]) -> isize {
    let along_x = octant & 1 == 1;
    let negative = if along_x { octant & 4 != 0 } else { octant & 2 != 0 };
    let k = usize::from(!along_x);
    if negative { at[k] } else { size[k] - at[k] }
}

/// The steps of a ring that belong to an octant. Octants are numbered by the signs of x and y and by whether x is the
/// longer one; a step along an axis belongs to the octant behind it, counter-clockwise.
fn arc(octant: usize, ring: isize) -> impl Iterator<Item = (isize, isize)> {
    let sign = |bit: usize| if octant & bit != 0 { -1 } else { 1 };
    let (x, y, along_x) = (sign(4), sign(2), octant & 1 == 1);
    // From the axis outwards; the axis itself when the other coordinate turns the right way.
    let start = isize::from(if along_x { x == y } else { x != y });
    let end = if along_x { ring - 1 } else { ring };
    (start..=end).map(move |k| if along_x { (x * ring, y * k) } else { (x * k, y * ring) })
}

/// The interpolant of (12), plane removed, at a place. `None` without data.
fn value(data: &[(DVec2, f64)], at: DVec2, r: f64, gamma: f64) -> Option<f64> {
    let (center, mean, slope) = plane(data)?;
    let flat = |p: DVec2| mean + slope.dot(p - center);
    let phi = |a: DVec2, b: DVec2| (r + a.distance_squared(b)).powf(-gamma);
    let mut matrix = vec![vec![0.0; data.len()]; data.len()];
    for p in 0..data.len() {
        for q in 0..=p {
            matrix[p][q] = phi(data[p].0, data[q].0);
            matrix[q][p] = matrix[p][q];
        }
    }
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

    /// The octant of a step by its signs, with half-open borders.
    fn octant(x: isize, y: isize) -> usize {
        let (sx, sy) = (usize::from(x < 0 || (x == 0 && y < 0)), usize::from(y < 0 || (y == 0 && x > 0)));
        (sx * 2 + sy) * 2 + usize::from(x.abs() > y.abs())
    }

    #[test]
    fn the_arcs_of_eight_octants_are_a_ring() {
        for ring in 1..6 {
            let mut steps: Vec<(isize, isize)> = Vec::new();
            for o in 0..8 {
                for (x, y) in arc(o, ring) {
                    assert_eq!((octant(x, y), x.abs().max(y.abs())), (o, ring), "{x} {y}");
                    steps.push((x, y));
                }
            }
            steps.sort_unstable();
            steps.dedup();
            assert_eq!(steps.len() as isize, 8 * ring);
        }
    }

    #[test]
    fn the_neighbours_are_those_of_a_search_through_the_whole_grid() {
        let holes: [fn(usize, usize) -> bool; 3] = [
            |i, j| (4..=11).contains(&i) && (2..=6).contains(&j),
            |i, j| i > 2 || j > 7,
            |i, j| (i * 7 + j * 5) % 11 != 0,
        ];
        for hole in holes {
            let known = Grid::from_fn(14, 9, |i, j| (!hole(i, j)).then_some(0.5));
            for (i, j) in (0..=14).flat_map(|i| (0..=9).map(move |j| (i, j))).filter(|&(i, j)| hole(i, j)) {
                let mut all: Vec<(isize, usize, usize, usize)> = Vec::new();
                for b in 0..=9 {
                    for a in 0..=14 {
                        let (x, y) = (a as isize - i as isize, b as isize - j as isize);
                        if known[(a, b)].is_some() {
                            all.push((x * x + y * y, b, a, octant(x, y)));
                        }
                    }
                }
                all.sort_unstable();
                for count in [3, 8, 12] {
                    let mut expected: Vec<(usize, usize)> = Vec::new();
                    let mut taken = [false; 8];
                    for k in &all {
                        if expected.len() < count && !std::mem::replace(&mut taken[k.3], true) {
                            expected.push((k.2, k.1));
                        }
                    }
                    for k in &all {
                        if expected.len() < count && !expected.contains(&(k.2, k.1)) {
                            expected.push((k.2, k.1));
                        }
                    }
                    assert_eq!(neighbours(&known, i, j, count), expected, "{i} {j} {count}");
                }
            }
        }
    }
}
