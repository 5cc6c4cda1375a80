//! Surfaces with a closed form.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use patchwright::kernel::geom::{Knots, Surface};

/// A full circle of nine control points: cosine, sine, weight.
const CIRCLE: [(f64, f64, f64); 9] = [
    (1.0, 0.0, 1.0),
    (1.0, 1.0, FRAC_1_SQRT_2),
    (0.0, 1.0, 1.0),
    (-1.0, 1.0, FRAC_1_SQRT_2),
    (-1.0, 0.0, 1.0),
    (-1.0, -1.0, FRAC_1_SQRT_2),
    (0.0, -1.0, 1.0),
    (1.0, -1.0, FRAC_1_SQRT_2),
    (1.0, 0.0, 1.0),
];

fn circle_knots() -> Knots {
    Knots::clamped(2, &[0.0, 0.25, 0.5, 0.75, 1.0], 2).unwrap()
}

/// A profile (radius, height, weight) turned about the z axis.
fn turned(profile: &[(f64, f64, f64)], knots: Knots) -> Surface {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for &(r, z, w) in profile {
        for (c, s, v) in CIRCLE {
            points.push(DVec3::new(r * c, r * s, z));
            weights.push(v * w);
        }
    }
    Surface::new(circle_knots(), knots, points, Some(weights)).unwrap()
}

/// A cylinder about the z axis.
pub fn cylinder(radius: f64, low: f64, high: f64) -> Surface {
    turned(&[(radius, low, 1.0), (radius, high, 1.0)], Knots::bezier(1, 0.0, 1.0).unwrap())
}

/// A torus about the z axis.
pub fn torus(major: f64, minor: f64) -> Surface {
    let profile: Vec<_> = CIRCLE.iter().map(|&(c, s, w)| (major + minor * c, minor * s, w)).collect();
    turned(&profile, circle_knots())
}

/// A sphere about the origin with its poles on the z axis.
pub fn sphere(radius: f64) -> Surface {
    let arc =
        [(0.0, -1.0, 1.0), (1.0, -1.0, FRAC_1_SQRT_2), (1.0, 0.0, 1.0), (1.0, 1.0, FRAC_1_SQRT_2), (0.0, 1.0, 1.0)];
    let profile: Vec<_> = arc.iter().map(|&(c, s, w)| (radius * c, radius * s, w)).collect();
    turned(&profile, Knots::clamped(2, &[0.0, 0.5, 1.0], 2).unwrap())
}

/// The rectangle of half sizes `x`, `y` at height z.
pub fn rectangle(x: f64, y: f64, z: f64) -> Surface {
    Surface::bilinear([(-x, -y), (x, -y), (-x, y), (x, y)].map(|(x, y)| DVec3::new(x, y, z))).unwrap()
}

/// The graph of a polynomial of degree at most `degree` in each variable over [-1, 1]^2, by interpolation.
pub fn graph(degree: usize, f: impl Fn(f64, f64) -> f64) -> Surface {
    let n = degree;
    let knots = || Knots::bezier(n, -1.0, 1.0).unwrap();
    let node = |i: usize| -(std::f64::consts::PI * (i as f64 + 0.5) / (n as f64 + 1.0)).cos();
    // Solve for the Bernstein coefficients of one variable after the other.
    let solve = |values: &[f64]| -> Vec<f64> {
        let k = knots();
        let mut m: Vec<Vec<f64>> = (0..=n)
            .map(|i| {
                let b = k.basis(node(i), 0);
                let mut row: Vec<f64> = (0..=n).map(|j| b.d[0][j]).collect();
                row.push(values[i]);
                row
            })
            .collect();
        for c in 0..=n {
            let pivot = (c..=n).max_by(|&a, &b| m[a][c].abs().total_cmp(&m[b][c].abs())).unwrap();
            m.swap(c, pivot);
            for r in 0..=n {
                if r != c {
                    let factor = m[r][c] / m[c][c];
                    for j in c..=n + 1 {
                        let v = m[c][j];
                        m[r][j] -= factor * v;
                    }
                }
            }
        }
        (0..=n).map(|r| m[r][n + 1] / m[r][r]).collect()
    };
    let rows: Vec<Vec<f64>> =
        (0..=n).map(|j| solve(&(0..=n).map(|i| f(node(i), node(j))).collect::<Vec<_>>())).collect();
    let columns: Vec<Vec<f64>> = (0..=n).map(|i| solve(&(0..=n).map(|j| rows[j][i]).collect::<Vec<_>>())).collect();
    let at = |i: usize| -1.0 + 2.0 * i as f64 / n as f64;
    let points =
        (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| DVec3::new(at(i), at(j), columns[i][j]));
    Surface::new(knots(), knots(), points.collect(), None).unwrap()
}
