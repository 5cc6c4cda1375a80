//! Unit normals of a grid of points by central differences, one-sided at the border: HJR99 (5).
//!
//! Where the differences vanish or are parallel (a degenerate corner or side), the nearest defined normal of the
//! column or row is taken. The result is zero only when the whole grid lies on a line.

use glam::DVec3;

use super::grid::Grid;

/// The normals of a grid.
pub fn normals(points: &Grid<DVec3>) -> Grid<DVec3> {
    let (m, n) = (points.m(), points.n());
    let mut out = Grid::from_fn(m, n, |i, j| {
        let along = points[((i + 1).min(m), j)] - points[(i.max(1) - 1, j)];
        let across = points[(i, (j + 1).min(n))] - points[(i, j.max(1) - 1)];
        let cross = along.cross(across);
        let scale = along.length() * across.length();
        if cross.length() > 1e-9 * scale { cross.normalize_or_zero() } else { DVec3::ZERO }
    });
    if out.values().contains(&DVec3::ZERO) {
        let given = out.clone();
        for j in 0..=n {
            for i in 0..=m {
                if given[(i, j)] == DVec3::ZERO {
                    out[(i, j)] = nearest(&given, i, j);
                }
            }
        }
    }
    out
}

/// The defined normal nearest in index space, ties in row order.
fn nearest(given: &Grid<DVec3>, i: usize, j: usize) -> DVec3 {
    let mut best = (usize::MAX, DVec3::ZERO);
    for b in 0..=given.n() {
        for a in 0..=given.m() {
            let distance = a.abs_diff(i).pow(2) + b.abs_diff(j).pow(2);
            if distance < best.0 && given[(a, b)] != DVec3::ZERO {
                best = (distance, given[(a, b)]);
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_a_graph_central_differences_are_second_order() {
        let f = |x: f64, y: f64| DVec3::new(x, y, 0.3 * (2.0 * x).sin() + 0.2 * y * y);
        let worst = |n: usize| {
            let h = 1.0 / n as f64;
            let grid = normals(&Grid::from_fn(n, n, |i, j| f(i as f64 * h, j as f64 * h)));
            let mut worst = 0.0_f64;
            for i in 1..n {
                for j in 1..n {
                    let (x, y) = (i as f64 * h, j as f64 * h);
                    let truth = DVec3::new(-0.6 * (2.0 * x).cos(), -0.4 * y, 1.0).normalize();
                    worst = worst.max(grid[(i, j)].distance(truth));
                }
            }
            worst
        };
        assert!(worst(20) < worst(10) / 3.5);
    }

    #[test]
    fn a_degenerate_corner_takes_its_neighbour() {
        // The side u = 0 collapses to the origin.
        let grid = normals(&Grid::from_fn(4, 4, |i, j| DVec3::new(i as f64, i as f64 * j as f64, 0.0)));
        assert!(grid.values().iter().all(|n| (*n - DVec3::Z).length() < 1e-12));
        let flat = normals(&Grid::from_fn(2, 2, |i, _| DVec3::X * i as f64));
        assert!(flat.values().iter().all(|n| *n == DVec3::ZERO));
    }
}
