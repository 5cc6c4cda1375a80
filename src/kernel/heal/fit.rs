//! The C1 bicubic B-spline through a grid of points, HJR99 (14)-(16).
//!
//! Knots are uniform over [0, 1]. Derivatives along rows and columns are five-point differences (of fourth order
//! inside and at the ends), so the Hermite pieces converge with h^4. Twists come from the same differences taken
//! in both directions; [`Twist::Zero`] is (16), which makes every interior Bezier quadrilateral at a sample a
//! parallelogram and is only O(h^2). (15) prints five end knots and `v_{m+4}` for `v_{n+4}`; four and n are meant.
//! Triple interior knots read as C0 in other programs, so the surface is written with double ones: of the Bezier
//! net, the row at every interior sample is dropped, since it is the mean of its neighbours. Cost: linear.

use glam::DVec3;

use super::grid::Grid;
use crate::kernel::geom::{Knots, Surface, SurfaceError};

/// How the interior Bezier points of a piece are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Twist {
    /// Mixed differences of the samples.
    #[default]
    Scheme,
    /// HJR99 (16): zero.
    Zero,
}

/// Derivatives by the index at equidistant samples: exact for polynomials of degree 4 (with fewer than five
/// samples, for as many as there are).
pub fn tangents(p: &[DVec3]) -> Vec<DVec3> {
    let last = p.len() - 1;
    let stencil = |at: usize, weights: &[f64]| weights.iter().zip(&p[at..]).map(|(w, p)| *p * *w).sum::<DVec3>();
    (0..=last)
        .map(|i| match last {
            0 => DVec3::ZERO,
            1 => p[1] - p[0],
            2 => match i {
                0 => stencil(0, &[-1.5, 2.0, -0.5]),
                1 => stencil(0, &[-0.5, 0.0, 0.5]),
                _ => stencil(0, &[0.5, -2.0, 1.5]),
            },
            3 => {
                const W: [[f64; 4]; 4] = [
                    [-11.0 / 6.0, 3.0, -1.5, 1.0 / 3.0],
                    [-1.0 / 3.0, -0.5, 1.0, -1.0 / 6.0],
                    [1.0 / 6.0, -1.0, 0.5, 1.0 / 3.0],
                    [-1.0 / 3.0, 1.5, -3.0, 11.0 / 6.0],
                ];
                stencil(0, &W[i])
            }
            _ => {
                const W: [[f64; 5]; 5] = [
                    [-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25],
                    [-0.25, -5.0 / 6.0, 1.5, -0.5, 1.0 / 12.0],
                    [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0],
                    [-1.0 / 12.0, 0.5, -1.5, 5.0 / 6.0, 0.25],
                    [0.25, -4.0 / 3.0, 3.0, -4.0, 25.0 / 12.0],
                ];
                let start = i.saturating_sub(2).min(last - 4);
                stencil(start, &W[i - start])
            }
        })
        .collect()
}

/// The same where some samples were made up: a real sample takes its derivative from the run of real samples that
/// it is in, if that has at least three, so that what fills a gap does not bend the surface beside it.
pub fn tangents_in_runs(p: &[DVec3], real: &[bool]) -> Vec<DVec3> {
    let mut out = tangents(p);
    let mut start = 0;
    while start < p.len() {
        let end = (start..p.len()).find(|&k| real[k] != real[start]).unwrap_or(p.len());
        if real[start] && end - start >= 3 && end - start < p.len() {
            out[start..end].copy_from_slice(&tangents(&p[start..end]));
        }
        start = end;
    }
    out
}

/// The 3 M + 1 Bezier points of the C1 cubic through M + 1 points.
pub fn bezier_row(points: &[DVec3]) -> Vec<DVec3> {
    bezier_row_in_runs(points, &vec![true; points.len()])
}

/// The same where only some samples are real.
pub fn bezier_row_in_runs(points: &[DVec3], real: &[bool]) -> Vec<DVec3> {
    let d = tangents_in_runs(points, real);
    let mut out = vec![points[0]];
    for i in 1..points.len() {
        out.extend([points[i - 1] + d[i - 1] / 3.0, points[i] - d[i] / 3.0, points[i]]);
    }
    out
}

/// The Bezier net (3 M x 3 N spans) through a grid of points, of which some are real (see [`tangents_in_runs`]).
/// `borders` are the Bezier points of the sides v = 0, u = 1,
/// v = 1, u = 0 in increasing parameter, which belong to the edges and not to the patch.
pub fn bezier_net(points: &Grid<DVec3>, real: &Grid<bool>, borders: [&[DVec3]; 4], twist: Twist) -> Grid<DVec3> {
    let (m, n) = (points.m(), points.n());
    let rows: Vec<Vec<DVec3>> = (0..=n).map(|j| tangents_in_runs(points.row(j), real.row(j))).collect();
    let columns: Vec<Vec<DVec3>> = (0..=m).map(|i| tangents_in_runs(&points.column(i), &real.column(i))).collect();
    let mixed: Vec<Vec<DVec3>> = (0..=m)
        .map(|i| match twist {
            Twist::Scheme => tangents_in_runs(&rows.iter().map(|r| r[i]).collect::<Vec<_>>(), &real.column(i)),
            Twist::Zero => vec![DVec3::ZERO; n + 1],
        })
        .collect();
    Grid::from_fn(3 * m, 3 * n, |a, b| {
        if b == 0 {
            return borders[0][a];
        }
        if b == 3 * n {
            return borders[2][a];
        }
        if a == 0 {
            return borders[3][b];
        }
        if a == 3 * m {
            return borders[1][b];
        }
        // The sample that the Bezier point belongs to, and its step from there in thirds of a span.
        let (i, j) = ((a + 1) / 3, (b + 1) / 3);
        let (s, t) = ((a as f64 - 3.0 * i as f64) / 3.0, (b as f64 - 3.0 * j as f64) / 3.0);
        points[(i, j)] + rows[j][i] * s + columns[i][j] * t + mixed[i][j] * (s * t)
    })
}

/// The surface of a Bezier net, with double interior knots and weights 1.
pub fn surface(net: &Grid<DVec3>) -> Result<Surface, SurfaceError> {
    let (m, n) = (net.m() / 3, net.n() / 3);
    let kept = |spans: usize| (0..=3 * spans).filter(move |k| k % 3 != 0 || *k == 0 || *k == 3 * spans);
    let points = kept(n).flat_map(|b| kept(m).map(move |a| net[(a, b)])).collect();
    let knots = |spans: usize, direction| {
        let breaks: Vec<f64> = (0..=spans).map(|i| i as f64 / spans as f64).collect();
        Knots::clamped(3, &breaks, 2).map_err(|source| SurfaceError::Knots { direction, source })
    };
    use crate::kernel::geom::Direction::{U, V};
    Surface::new(knots(m, U)?, knots(n, V)?, points, None)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    fn fitted(points: &Grid<DVec3>, twist: Twist) -> Surface {
        let (m, n) = (points.m(), points.n());
        let borders = [
            bezier_row(points.row(0)),
            bezier_row(&points.column(m)),
            bezier_row(points.row(n)),
            bezier_row(&points.column(0)),
        ];
        surface(&bezier_net(points, &points.map(|_| true), [&borders[0], &borders[1], &borders[2], &borders[3]], twist))
            .unwrap()
    }

    fn sampled(m: usize, n: usize, f: impl Fn(f64, f64) -> DVec3) -> Grid<DVec3> {
        Grid::from_fn(m, n, |i, j| f(i as f64 / m as f64, j as f64 / n as f64))
    }

    fn error(s: &Surface, f: impl Fn(f64, f64) -> DVec3) -> f64 {
        let at = |k: i32| f64::from(k) / 97.0;
        (0..=97)
            .flat_map(|i| (0..=97).map(move |j| (at(i), at(j))))
            .map(|(u, v)| s.eval(DVec2::new(u, v)).distance(f(u, v)))
            .fold(0.0, f64::max)
    }

    #[test]
    fn bicubic_polynomials_are_reproduced_with_twists_and_not_without() {
        let f = |u: f64, v: f64| DVec3::new(u, v + u * u * v, (u * u * u - u) * (v * v * v + 2.0 * v) + u * v);
        let grid = sampled(6, 5, f);
        assert!(error(&fitted(&grid, Twist::Scheme), f) < 1e-13);
        assert!(error(&fitted(&grid, Twist::Zero), f) > 1e-3);
        // The difference is invisible on the grid lines, where (16) is exact too.
        let s = fitted(&grid, Twist::Zero);
        for k in 0..=50 {
            let v = f64::from(k) / 50.0;
            assert!(s.eval(DVec2::new(0.5, v)).distance(f(0.5, v)) < 1e-13);
        }
    }

    #[test]
    fn the_error_falls_with_the_fourth_power() {
        let f = |u: f64, v: f64| DVec3::new(u, v, (3.0 * u).sin() * (2.0 * v).cos());
        let [coarse, fine] = [8, 16].map(|n| error(&fitted(&sampled(n, n, f), Twist::Scheme), f));
        assert!(fine < coarse / 12.0, "{coarse} {fine}");
    }

    #[test]
    fn samples_are_interpolated_and_the_surface_is_c1_with_double_knots() {
        let f = |u: f64, v: f64| DVec3::new(u, v, (9.0 * u * v).sin());
        let grid = sampled(7, 9, f);
        let s = fitted(&grid, Twist::Scheme);
        for (k, spans) in [7, 9].iter().enumerate() {
            let knots = &s.knots()[k];
            assert!(knots.is_clamped() && knots.degree() == 3);
            let inner = knots.multiplicities();
            assert!(inner[1..inner.len() - 1].iter().all(|x| x.1 == 2) && inner.len() == spans + 1);
        }
        assert!(s.weights().is_none());
        for j in 0..=9 {
            for i in 0..=7 {
                let uv = DVec2::new(i as f64 / 7.0, j as f64 / 9.0);
                assert!(s.eval(uv).distance(grid[(i, j)]) < 1e-15);
                let h = 1e-9;
                let low = s.jet((uv - h).max(DVec2::ZERO), 1);
                let high = s.jet((uv + h).min(DVec2::ONE), 1);
                assert!(low.u().distance(high.u()) < 1e-5 && low.v().distance(high.v()) < 1e-5);
            }
        }
    }

    #[test]
    fn a_wrong_sample_in_a_gap_leaves_the_pieces_beside_it_alone() {
        let f = |u: f64, v: f64| DVec3::new(u, v, u * u * v - v * v);
        let grid = Grid::from_fn(12, 4, |i, j| {
            f(i as f64 / 12.0, j as f64 / 4.0) + if i == 6 { DVec3::Z } else { DVec3::ZERO }
        });
        let real = Grid::from_fn(12, 4, |i, _| i != 6);
        let row = |j: usize| bezier_row_in_runs(grid.row(j), real.row(j));
        let column = |i: usize| bezier_row_in_runs(&grid.column(i), &real.column(i));
        let borders = [row(0), column(12), row(4), column(0)];
        let net = bezier_net(&grid, &real, [&borders[0], &borders[1], &borders[2], &borders[3]], Twist::Scheme);
        let s = surface(&net).unwrap();
        for i in (0..=100).filter(|i| !(42..=58).contains(i)) {
            for j in 0..=20 {
                let (u, v) = (f64::from(i) / 100.0, f64::from(j) / 20.0);
                assert!(s.eval(DVec2::new(u, v)).distance(f(u, v)) < 1e-13);
            }
        }
    }

    #[test]
    fn short_rows_use_what_they_have() {
        for count in 1..=5 {
            let row: Vec<DVec3> = (0..=count).map(|i| DVec3::new(i as f64, (i * i.min(1)) as f64, 0.0)).collect();
            assert!(tangents(&row).iter().all(|t| (t.x - 1.0).abs() < 1e-13 && (t.y - 1.0).abs() < 1e-12));
        }
    }
}
