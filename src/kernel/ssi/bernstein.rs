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
    let mut b = [0.0; MAX_FIT + 1];
    b[0] = 1.0;
    for degree in 0..n {
        let mut carry = 0.0;
        for value in b.iter_mut().take(degree + 2) {
            let old = *value;
            *value = old * (1.0 - t) + carry;
            carry = old * t;
        }
    }
    b
}

/// The Bernstein polynomials of degree `2 <= n <= MAX_FIT` with their first and second derivatives, in one recurrence.
fn basis_with_derivatives(n: usize, t: f64) -> [[f64; MAX_FIT + 1]; 3] {
    let raised = |b: &[f64; MAX_FIT + 1], degree: usize| {
        let mut out = [0.0; MAX_FIT + 1];
        let mut carry = 0.0;
        for (out, old) in out.iter_mut().zip(b).take(degree + 2) {
            *out = old * (1.0 - t) + carry;
            carry = old * t;
        }
        out
    };
    let low2 = basis(n - 2, t);
    let low1 = raised(&low2, n - 2);
    let all = raised(&low1, n - 1);
    let (mut b1, mut b2) = ([0.0; MAX_FIT + 1], [0.0; MAX_FIT + 1]);
    let (f1, f2) = (n as f64, (n * (n - 1)) as f64);
    for i in 0..=n {
        let at = |b: &[f64; MAX_FIT + 1], back: usize| if i >= back { b[i - back] } else { 0.0 };
        b1[i] = f1 * (at(&low1, 1) - low1[i]);
        b2[i] = f2 * (at(&low2, 2) - 2.0 * at(&low2, 1) + low2[i]);
    }
    [all, b1, b2]
}

/// A polynomial of degree `n` in both variables over [0, 1]^2.
#[derive(Clone, Debug)]
pub struct Poly2 {
    /// The degree in each variable.
    pub n: usize,
    /// The coefficients, first variable fastest.
    pub c: Vec<f64>,
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

impl Poly2 {
    /// The interpolant of values at the nodes.
    pub fn fit(n: usize, values: &[f64]) -> Self {
        Self { n, c: to_bernstein([n, n], values) }
    }

    /// The value alone.
    pub fn value(&self, x: f64, y: f64) -> f64 {
        let n = self.n;
        let (bx, by) = (basis(n, x), basis(n, y));
        let along = |row: &[f64]| row.iter().zip(&bx).map(|(c, b)| c * b).sum::<f64>();
        self.c.chunks_exact(n + 1).zip(&by).map(|(row, b)| along(row) * b).sum()
    }

    /// The value and derivatives; the degree is at least 2.
    pub fn eval(&self, x: f64, y: f64) -> Value2 {
        let (bx, by) = (basis_with_derivatives(self.n, x), basis_with_derivatives(self.n, y));
        let mut out = Value2::default();
        for (j, row) in self.c.chunks_exact(self.n + 1).enumerate() {
            let (mut f, mut d, mut h) = (0.0, 0.0, 0.0);
            for ((c, b0), (b1, b2)) in row.iter().zip(&bx[0]).zip(bx[1].iter().zip(&bx[2])) {
                f += c * b0;
                d += c * b1;
                h += c * b2;
            }
            out.f += f * by[0][j];
            out.d[0] += d * by[0][j];
            out.d[1] += f * by[1][j];
            out.h[0] += h * by[0][j];
            out.h[1] += d * by[1][j];
            out.h[2] += f * by[2][j];
        }
        out
    }

    /// The two halves along the first (0) or second (1) variable, each over its own [0, 1]^2.
    pub fn split(&self, along: usize) -> [Self; 2] {
        let n = self.n;
        let (mut first, mut second) = (self.c.clone(), self.c.clone());
        let (stride, step) = if along == 0 { (1, n + 1) } else { (n + 1, 1) };
        for line in 0..=n {
            let at = |i: usize| line * step + i * stride;
            for level in 1..=n {
                for i in 0..=n - level {
                    second[at(i)] = 0.5 * (second[at(i)] + second[at(i + 1)]);
                }
                first[at(level)] = second[at(0)];
            }
        }
        [Self { n, c: first }, Self { n, c: second }]
    }

    /// The range of the coefficients.
    pub fn range(&self) -> [f64; 2] {
        range(self.c.iter().copied())
    }

    /// Ranges of the coefficients of both first derivatives.
    pub fn gradient_range(&self) -> [[f64; 2]; 2] {
        let (n, w) = (self.n, self.n + 1);
        let f = n as f64;
        let x = (0..w).flat_map(|j| (0..n).map(move |i| (j * w + i, j * w + i + 1)));
        let y = (0..n).flat_map(|j| (0..w).map(move |i| (j * w + i, (j + 1) * w + i)));
        [range(x.map(|(a, b)| (self.c[b] - self.c[a]) * f)), range(y.map(|(a, b)| (self.c[b] - self.c[a]) * f))]
    }

    /// Ranges of the coefficients of the second derivatives xx, xy, yy.
    pub fn hessian_range(&self) -> [[f64; 2]; 3] {
        let (n, w) = (self.n, self.n + 1);
        let c = |i: usize, j: usize| self.c[j * w + i];
        let (f2, f11) = ((n * (n - 1)) as f64, (n * n) as f64);
        let xx = (0..w).flat_map(|j| (0..n - 1).map(move |i| (i, j)));
        let yy = (0..n - 1).flat_map(|j| (0..w).map(move |i| (i, j)));
        let xy = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        [
            range(xx.map(|(i, j)| (c(i + 2, j) - 2.0 * c(i + 1, j) + c(i, j)) * f2)),
            range(xy.map(|(i, j)| (c(i + 1, j + 1) - c(i + 1, j) - c(i, j + 1) + c(i, j)) * f11)),
            range(yy.map(|(i, j)| (c(i, j + 2) - 2.0 * c(i, j + 1) + c(i, j)) * f2)),
        ]
    }

    /// The coefficients along one of the four edges: `fixed` variable (0 or 1) at 0 or 1.
    pub fn edge(&self, fixed: usize, at_end: bool) -> Vec<f64> {
        let (n, w) = (self.n, self.n + 1);
        let k = if at_end { n } else { 0 };
        (0..=n).map(|i| if fixed == 0 { self.c[i * w + k] } else { self.c[k * w + i] }).collect()
    }
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
}

/// All places in [0, 1] where a univariate Bernstein polynomial changes sign or touches zero within `noise`.
/// Sign variations of the coefficients separate the roots; a cluster that no subdivision separates gives one place.
pub fn roots(coefficients: &[f64], noise: f64) -> Vec<f64> {
    let mut out = Vec::new();
    let mut stack = vec![(coefficients.to_vec(), 0.0, 1.0)];
    while let Some((c, low, high)) = stack.pop() {
        let (min, max) = c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
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
        let n = 8;
        let values: Vec<f64> =
            (0..=n).flat_map(|j| (0..=n).map(move |i| f(chebyshev_node(n, i), chebyshev_node(n, j)))).collect();
        let p = Poly2::fit(n, &values);
        for (x, y) in [(0.1, 0.9), (0.5, 0.25), (1.0, 0.0)] {
            let v = p.eval(x, y);
            assert!((v.f - f(x, y)).abs() < 1e-13);
            assert!((v.d[0] - (1.0 - 3.0 * y * y + 5.0 * x.powi(4) * y.powi(7))).abs() < 1e-11);
            assert!((v.h[1] - (-6.0 * y + 35.0 * x.powi(4) * y.powi(6))).abs() < 1e-9);
        }
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
