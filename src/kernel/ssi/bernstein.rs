//! Bivariate polynomials in Bernstein form: fitted from samples, bounded by their coefficients, split, evaluated.
//!
//! Fits interpolate at the Chebyshev-Lobatto nodes. The conversion matrices are computed once per degree (at most
//! [`MAX_FIT`]); their condition number at degree 8 is about 10^3, which costs three digits of sixteen.

use std::sync::OnceLock;

/// The largest degree of a fit.
pub const MAX_FIT: usize = 12;

/// Chebyshev-Lobatto node `i` of `0..=n` on [0, 1], increasing.
pub fn chebyshev_node(n: usize, i: usize) -> f64 {
    if 2 * i == n {
        return 0.5;
    }
    0.5 - 0.5 * (std::f64::consts::PI * i as f64 / n as f64).cos()
}

/// Bernstein coefficients (u fastest) from values at the tensor Chebyshev nodes.
pub fn to_bernstein(degree: [usize; 2], values: &[f64]) -> Vec<f64> {
    let [p, q] = degree;
    let (mu, mv) = (matrix(p), matrix(q));
    let width = p + 1;
    // Row after row, so that neighbours are added side by side.
    let mut half = vec![0.0; values.len()];
    for (row, out) in mv.chunks_exact(q + 1).zip(half.chunks_exact_mut(width)) {
        for (m, line) in row.iter().zip(values.chunks_exact(width)) {
            out.iter_mut().zip(line).for_each(|(o, v)| *o += m * v);
        }
    }
    let columns = transposed(mu, width);
    let mut out = vec![0.0; values.len()];
    for (line, out) in half.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        for (v, column) in line.iter().zip(columns.chunks_exact(width)) {
            out.iter_mut().zip(column).for_each(|(o, m)| *o += m * v);
        }
    }
    out
}

/// The transpose of a square matrix.
fn transposed(m: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|k| m[(k % n) * n + k / n]).collect()
}

/// The inverse of the matrix of Bernstein values at the nodes.
fn matrix(n: usize) -> &'static [f64] {
    static CACHE: [OnceLock<Vec<f64>>; MAX_FIT + 1] = [const { OnceLock::new() }; MAX_FIT + 1];
    let n = n.min(MAX_FIT);
    CACHE[n].get_or_init(|| {
        let size = n + 1;
        let mut rows: Vec<Vec<f64>> = (0..size)
            .map(|k| {
                let mut row = basis(n, chebyshev_node(n.max(1), k))[..=n].to_vec();
                row.extend((0..size).map(|j| if j == k { 1.0 } else { 0.0 }));
                row
            })
            .collect();
        for k in 0..size {
            let pivot = (k..size).max_by(|&i, &j| rows[i][k].abs().total_cmp(&rows[j][k].abs())).unwrap_or(k);
            rows.swap(k, pivot);
            let lead = rows[k].clone();
            for (i, row) in rows.iter_mut().enumerate() {
                if i == k {
                    row.iter_mut().for_each(|v| *v /= lead[k]);
                } else {
                    let factor = row[k] / lead[k];
                    row.iter_mut().zip(&lead).for_each(|(v, l)| *v -= factor * l);
                }
            }
        }
        rows.iter().flat_map(|row| row[size..].iter().copied()).collect()
    })
}

/// The Bernstein polynomials of degree `n <= MAX_FIT`; the entries beyond are zero.
fn basis(n: usize, t: f64) -> [f64; MAX_FIT + 1] {
    basis_of(n.min(MAX_FIT), [&powers(t), &powers(1.0 - t)])
}

/// The powers 0, 1, 2.. of a number.
#[inline(always)]
fn powers<const W: usize>(t: f64) -> [f64; W] {
    let mut out = [1.0; W];
    for k in 1..W {
        out[k] = out[k - 1] * t;
    }
    out
}

/// The Bernstein polynomials of degree `n < W` from the powers of t and 1 - t; the entries beyond are zero.
#[inline(always)]
fn basis_of<const W: usize>(n: usize, [t, s]: [&[f64; W]; 2]) -> [f64; W] {
    std::array::from_fn(|k| if k <= n { BINOMIALS[n][k] * t[k] * s[n - k] } else { 0.0 })
}

/// The binomial coefficients n over k.
const BINOMIALS: [[f64; MAX_FIT + 1]; MAX_FIT + 1] = {
    let mut out = [[0.0; MAX_FIT + 1]; MAX_FIT + 1];
    let mut n = 0;
    while n <= MAX_FIT {
        out[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            out[n][k] = out[n - 1][k - 1] + out[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    out
};

/// The Bernstein polynomials of degree `W - 1 >= 2` with their first and second derivatives.
#[inline(always)]
fn basis_with_derivatives<const W: usize>(t: f64) -> [[f64; W]; 3] {
    let n = W - 1;
    let (t, s) = (powers(t), powers(1.0 - t));
    let [all, low1, low2] = [0, 1, 2].map(|less| basis_of(n - less, [&t, &s]));
    let (f1, f2) = (n as f64, (n * (n - 1)) as f64);
    let at = |b: &[f64; W], i: usize, back: usize| if i >= back { b[i - back] } else { 0.0 };
    let first = std::array::from_fn(|i| f1 * (at(&low1, i, 1) - low1[i]));
    let second = std::array::from_fn(|i| f2 * (at(&low2, i, 2) - 2.0 * at(&low2, i, 1) + low2[i]));
    [all, first, second]
}

/// A polynomial of degree `W - 1 <= MAX_FIT` in both variables over [0, 1]^2.
#[derive(Clone, Copy, Debug)]
pub struct Poly2<const W: usize> {
    /// The coefficients, first variable fastest.
    pub c: [[f64; W]; W],
}

/// The value with first and second derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Value2 {
    /// The value.
    pub f: f64,
    /// By the first and the second variable.
    pub d: [f64; 2],
    /// xx, xy, yy.
    pub h: [f64; 3],
}

impl<const W: usize> Poly2<W> {
    /// The interpolant of values at the tensor Chebyshev nodes, first variable fastest.
    pub fn fit(values: &[[f64; W]; W]) -> Self {
        let m = matrix(W - 1);
        let columns: [[f64; W]; W] = std::array::from_fn(|i| std::array::from_fn(|j| m[j * W + i]));
        let mut half = [[0.0; W]; W];
        for (out, row) in half.iter_mut().zip(m.chunks_exact(W)) {
            for (line, m) in values.iter().zip(row) {
                (0..W).for_each(|i| out[i] += m * line[i]);
            }
        }
        let mut c = [[0.0; W]; W];
        for (out, line) in c.iter_mut().zip(&half) {
            for (column, v) in columns.iter().zip(line) {
                (0..W).for_each(|i| out[i] += v * column[i]);
            }
        }
        Self { c }
    }

    /// The value alone.
    pub fn value(&self, x: f64, y: f64) -> f64 {
        let at = |t: f64| -> [f64; W] { basis_of(W - 1, [&powers(t), &powers(1.0 - t)]) };
        let (bx, by) = (at(x), at(y));
        let mut along = [0.0; W];
        for (row, b) in self.c.iter().zip(by) {
            (0..W).for_each(|i| along[i] += row[i] * b);
        }
        (0..W).map(|i| along[i] * bx[i]).sum()
    }

    /// The value and derivatives; the degree is at least 2.
    pub fn eval(&self, x: f64, y: f64) -> Value2 {
        let (bx, by) = (basis_with_derivatives::<W>(x), basis_with_derivatives::<W>(y));
        let mut along = [[0.0; W]; 3];
        for (j, row) in self.c.iter().enumerate() {
            for (order, along) in along.iter_mut().enumerate() {
                (0..W).for_each(|i| along[i] += row[i] * by[order][j]);
            }
        }
        let sum = |by_x: usize, by_y: usize| (0..W).map(|i| along[by_y][i] * bx[by_x][i]).sum();
        Value2 { f: sum(0, 0), d: [sum(1, 0), sum(0, 1)], h: [sum(2, 0), sum(1, 1), sum(0, 2)] }
    }

    /// The two halves along the first (0) or second (1) variable, each over its own [0, 1]^2.
    pub fn split(&self, along: usize) -> [Self; 2] {
        let (mut first, mut second) = (*self, *self);
        if along == 0 {
            for (first, second) in first.c.iter_mut().zip(&mut second.c) {
                for level in 1..W {
                    for i in 0..W - level {
                        second[i] = 0.5 * (second[i] + second[i + 1]);
                    }
                    first[level] = second[0];
                }
            }
        } else {
            for level in 1..W {
                for j in 0..W - level {
                    for i in 0..W {
                        second.c[j][i] = 0.5 * (second.c[j][i] + second.c[j + 1][i]);
                    }
                }
                first.c[level] = second.c[0];
            }
        }
        [first, second]
    }

    /// The range of the coefficients.
    pub fn range(&self) -> [f64; 2] {
        range(self.c.as_flattened().iter().copied())
    }

    /// Ranges of the coefficients of both first derivatives.
    pub fn gradient_range(&self) -> [[f64; 2]; 2] {
        let f = (W - 1) as f64;
        let x = self.c.iter().flat_map(|row| row.windows(2).map(|w| w[1] - w[0]));
        let y = self.c.windows(2).flat_map(|w| (0..W).map(move |i| w[1][i] - w[0][i]));
        [range(x).map(|v| v * f), range(y).map(|v| v * f)]
    }

    /// Ranges of the coefficients of the second derivatives xx, xy, yy.
    pub fn hessian_range(&self) -> [[f64; 2]; 3] {
        let n = W - 1;
        let (f2, f11) = ((n * (n - 1)) as f64, (n * n) as f64);
        let xx = self.c.iter().flat_map(|row| row.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]));
        let yy = self.c.windows(3).flat_map(|w| (0..W).map(move |i| w[2][i] - 2.0 * w[1][i] + w[0][i]));
        let xy = self.c.windows(2).flat_map(|w| (0..n).map(move |i| w[1][i + 1] - w[0][i + 1] - w[1][i] + w[0][i]));
        [range(xx).map(|v| v * f2), range(xy).map(|v| v * f11), range(yy).map(|v| v * f2)]
    }

    /// The coefficients along one of the four edges: `fixed` variable (0 or 1) at 0 or 1.
    pub fn edge(&self, fixed: usize, at_end: bool) -> [f64; W] {
        let k = if at_end { W - 1 } else { 0 };
        if fixed == 0 { self.c.map(|row| row[k]) } else { self.c[k] }
    }
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
}

/// All places in [0, 1] where a univariate Bernstein polynomial changes sign or touches zero within `noise`.
/// Sign variations of the coefficients separate the roots; a cluster that no subdivision separates gives one place.
pub fn roots(coefficients: &[f64], noise: f64) -> Vec<f64> {
    let mut out = Vec::new();
    // Most have none.
    let [min, max] = range(coefficients.iter().copied());
    if min > noise || max < -noise {
        return out;
    }
    let mut stack = vec![(coefficients.to_vec(), 0.0, 1.0)];
    while let Some((c, low, high)) = stack.pop() {
        let [min, max] = range(c.iter().copied());
        if min > noise || max < -noise {
            continue;
        }
        let last = c.len() - 1;
        let changes = c.windows(2).filter(|w| (w[0] < 0.0) != (w[1] < 0.0)).count();
        if changes == 1 && c[0].abs() > noise && c[last].abs() > noise {
            out.push(low + (high - low) * bisect(&c));
            continue;
        }
        if high - low < 1e-9 || (min >= -noise && max <= noise) {
            out.push(0.5 * (low + high));
            continue;
        }
        let (mut first, mut second) = (c.clone(), c);
        for level in 1..=last {
            for i in 0..=last - level {
                second[i] = 0.5 * (second[i] + second[i + 1]);
            }
            first[level] = second[0];
        }
        let middle = 0.5 * (low + high);
        stack.push((second, middle, high));
        stack.push((first, low, middle));
    }
    out.sort_by(f64::total_cmp);
    out.dedup_by(|b, a| *b - *a < 1e-8);
    out
}

/// The only root of a polynomial whose end values have opposite signs.
fn bisect(c: &[f64]) -> f64 {
    let value = |t: f64| {
        let b = basis(c.len() - 1, t);
        b.iter().zip(c).map(|(b, c)| b * c).sum::<f64>()
    };
    let (mut low, mut high) = (0.0, 1.0);
    let (mut f_low, mut f_high) = (c[0], c[c.len() - 1]);
    // The secant rule, where an end that stays twice counts half (Dowell and Jarratt, "A modified regula falsi", BIT 11
    // (1971)); every fifth time a bisection.
    let (mut stayed, mut before) = (0, f64::INFINITY);
    for k in 0..60 {
        let secant = (low * f_high - high * f_low) / (f_high - f_low);
        let bisected = k % 5 == 4 || !(low < secant && secant < high);
        let middle = if bisected { 0.5 * (low + high) } else { secant };
        let f = value(middle);
        if f == 0.0 {
            return middle;
        }
        if (f < 0.0) == (f_low < 0.0) {
            (low, f_low) = (middle, f);
            if stayed == 1 {
                f_high *= 0.5;
            }
            stayed = 1;
        } else {
            (high, f_high) = (middle, f);
            if stayed == -1 {
                f_low *= 0.5;
            }
            stayed = -1;
        }
        if high - low < 1e-14 || (!bisected && (middle - before).abs() < 1e-14) {
            return middle;
        }
        before = middle;
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_reproduce_polynomials() {
        let f = |x: f64, y: f64| 1.0 + x - 3.0 * x * y * y + x.powi(5) * y.powi(7);
        let at = |i: usize| chebyshev_node(8, i);
        let p: Poly2<9> = Poly2::fit(&std::array::from_fn(|j| std::array::from_fn(|i| f(at(i), at(j)))));
        for (x, y) in [(0.1, 0.9), (0.5, 0.25), (1.0, 0.0)] {
            let v = p.eval(x, y);
            assert!((v.f - f(x, y)).abs() < 1e-13);
            assert!((v.d[0] - (1.0 - 3.0 * y * y + 5.0 * x.powi(4) * y.powi(7))).abs() < 1e-11);
            assert!((v.h[1] - (-6.0 * y + 35.0 * x.powi(4) * y.powi(6))).abs() < 1e-9);
        }
        let [left, _] = p.split(0);
        assert!((left.value(0.3, 0.5) - f(0.15, 0.5)).abs() < 1e-13);
        let [low, high] = p.split(1);
        assert!((low.eval(0.3, 0.5).f - f(0.3, 0.25)).abs() < 1e-13);
        assert!((high.eval(0.3, 0.5).f - f(0.3, 0.75)).abs() < 1e-13);
    }

    #[test]
    fn roots_are_all_found() {
        let roots_of = |zeros: &[f64]| {
            let n = 8;
            let values: Vec<f64> = (0..=n).map(|i| zeros.iter().map(|z| chebyshev_node(n, i) - z).product()).collect();
            let m = matrix(n);
            let c: Vec<f64> = (0..=n).map(|i| (0..=n).map(|k| m[i * (n + 1) + k] * values[k]).sum()).collect();
            roots(&c, 1e-15)
        };
        for zeros in [vec![0.5], vec![0.1, 0.11, 0.9], vec![0.25, 0.250001], vec![-0.1, 1.5]] {
            let inside: Vec<f64> = zeros.iter().copied().filter(|z| (0.0..=1.0).contains(z)).collect();
            let found = roots_of(&zeros);
            assert_eq!(found.len(), inside.len(), "{zeros:?} {found:?}");
            assert!(found.iter().zip(&inside).all(|(a, b)| (a - b).abs() < 1e-8));
        }
    }
}
