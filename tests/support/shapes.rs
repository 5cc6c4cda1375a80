//! Surfaces with known self-intersections, for tests and benchmarks: splines through given functions, and the
//! families whose double curves are closed forms.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use glam::{DMat3, DQuat, DVec2, DVec3};
use patchwright::kernel::geom::{Curve, Knots, Surface};

/// Solves the interpolation problem of one direction: rows of basis values at the Greville abscissae.
fn interpolate_line(knots: &Knots, values: &[DVec3]) -> Vec<DVec3> {
    let n = knots.control_count();
    let mut rows: Vec<(Vec<f64>, DVec3)> = knots
        .greville()
        .iter()
        .zip(values)
        .map(|(&t, &value)| {
            let basis = knots.basis(t, 0);
            let mut row = vec![0.0; n];
            for i in 0..=knots.degree() {
                row[basis.first + i] = basis.d[0][i];
            }
            (row, value)
        })
        .collect();
    for c in 0..n {
        let pivot = (c..n).max_by(|&a, &b| rows[a].0[c].abs().total_cmp(&rows[b].0[c].abs())).unwrap();
        rows.swap(c, pivot);
        for r in c + 1..n {
            let m = rows[r].0[c] / rows[c].0[c];
            if m != 0.0 {
                for k in c..n {
                    let x = rows[c].0[k];
                    rows[r].0[k] -= m * x;
                }
                let x = rows[c].1;
                rows[r].1 -= x * m;
            }
        }
    }
    let mut out = vec![DVec3::ZERO; n];
    for c in (0..n).rev() {
        let sum: DVec3 = (c + 1..n).map(|k| out[k] * rows[c].0[k]).sum();
        out[c] = (rows[c].1 - sum) / rows[c].0[c];
    }
    out
}

/// The curve through `f` at the Greville abscissae.
pub fn curve_through(knots: &Knots, f: impl Fn(f64) -> DVec3) -> Curve {
    let values: Vec<DVec3> = knots.greville().iter().map(|&t| f(t)).collect();
    Curve::new(knots.clone(), interpolate_line(knots, &values), None).unwrap()
}

/// The spline through `f` at the Greville abscissae: exact where `f` is a polynomial of no higher degree.
pub fn interpolate(u: &Knots, v: &Knots, f: impl Fn(f64, f64) -> DVec3) -> Surface {
    let (gu, gv) = (u.greville(), v.greville());
    let rows: Vec<Vec<DVec3>> =
        gv.iter().map(|&t| interpolate_line(u, &gu.iter().map(|&s| f(s, t)).collect::<Vec<_>>())).collect();
    let (nu, nv) = (gu.len(), gv.len());
    let mut points = vec![DVec3::ZERO; nu * nv];
    for i in 0..nu {
        let column = interpolate_line(v, &rows.iter().map(|row| row[i]).collect::<Vec<_>>());
        for (j, p) in column.into_iter().enumerate() {
            points[j * nu + i] = p;
        }
    }
    Surface::new(u.clone(), v.clone(), points, None).unwrap()
}

/// One bicubic piece over [-1, 1].
pub fn square() -> Knots {
    Knots::bezier(3, -1.0, 1.0).unwrap()
}

/// Cubic over [-1, 1] with `n` spans.
pub fn spans(n: usize) -> Knots {
    let breaks: Vec<f64> = (0..=n).map(|k| -1.0 + 2.0 * k as f64 / n as f64).collect();
    Knots::clamped(3, &breaks, 1).unwrap()
}

/// A rigid motion in general position.
pub fn turned(p: DVec3) -> DVec3 {
    DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.7).normalize(), 1.1)) * p
        + DVec3::new(0.2, -0.4, 0.9)
}

/// The domain turned by an angle, so that nothing runs along u or v.
pub fn spun(u: f64, v: f64) -> DVec2 {
    DVec2::from_angle(0.4).rotate(DVec2::new(u, v)) + DVec2::new(0.03, -0.05)
}

/// The family (x, y^2, y^3 + c(x) y): double points are (x, +-y) with y^2 = -c(x), miter points the zeros of c.
pub fn ridge(c: impl Fn(f64) -> f64) -> impl Fn(f64, f64) -> DVec3 {
    move |u, v| turned(DVec3::new(u, v * v, v * v * v + c(u) * v))
}

/// Pulls a surface of a polynomial of degree 3 through a turned domain: the degree rises to 6 x 6.
pub fn sextic() -> Knots {
    Knots::bezier(6, -1.0, 1.0).unwrap()
}
