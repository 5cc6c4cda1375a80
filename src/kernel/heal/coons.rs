//! The discrete bilinear Coons patch, HJR99 (4).
//!
//! The boundary points are uniform in arc length, so u = I / M and v = J / N on all four sides and in between.
//! The result interpolates the boundary points to the bit. Cost: linear.

use glam::DVec3;

use super::grid::Grid;

/// The grid of the Coons patch of `bottom` and `top` (along u, m + 1 points each), `left` and `right` (along v,
/// n + 1 points each). Shared corners must be the same points.
pub fn coons(bottom: &[DVec3], right: &[DVec3], top: &[DVec3], left: &[DVec3]) -> Grid<DVec3> {
    let (m, n) = (bottom.len() - 1, left.len() - 1);
    let (c00, c10, c01, c11) = (bottom[0], bottom[m], top[0], top[m]);
    Grid::from_fn(m, n, |i, j| {
        if j == 0 {
            return bottom[i];
        }
        if j == n {
            return top[i];
        }
        if i == 0 {
            return left[j];
        }
        if i == m {
            return right[j];
        }
        let (u, v) = (i as f64 / m as f64, j as f64 / n as f64);
        let ruled = left[j].lerp(right[j], u) + bottom[i].lerp(top[i], v);
        ruled - c00.lerp(c10, u).lerp(c01.lerp(c11, u), v)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_that_are_bilinearly_blended_are_reproduced() {
        // f = a(u) + b(v) + c(u) v + d(v) u is what the Coons scheme reproduces.
        let f = |u: f64, v: f64| DVec3::new(u, v, u.sin() + (3.0 * v).cos() + u * u * v + v * v * v * u);
        let (m, n) = (7, 5);
        let u = |i: usize| i as f64 / m as f64;
        let v = |j: usize| j as f64 / n as f64;
        let along = |y: f64| (0..=m).map(|i| f(u(i), y)).collect::<Vec<_>>();
        let across = |x: f64| (0..=n).map(|j| f(x, v(j))).collect::<Vec<_>>();
        let grid = coons(&along(0.0), &across(1.0), &along(1.0), &across(0.0));
        for i in 0..=m {
            for j in 0..=n {
                assert!(grid[(i, j)].distance(f(u(i), v(j))) < 1e-15);
            }
        }
    }
}
