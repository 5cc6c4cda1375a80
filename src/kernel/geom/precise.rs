//! What curves and surfaces are, computed with twice the digits: the reference of the tests.
//!
//! A number is the unevaluated sum of two `f64` (Dekker, *A floating-point technique for extending the available
//! precision*, 1971), about 32 digits. Derivatives come from differenced control points and de Boor's recursion, so
//! that nothing is shared with the evaluation that is tested.

use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec2;

use super::{Knots, Surface};

/// A number with twice the digits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Double(f64, f64);

fn two_sum(a: f64, b: f64) -> Double {
    let s = a + b;
    let t = s - a;
    Double(s, (a - (s - t)) + (b - t))
}

impl From<f64> for Double {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }
}

impl From<Double> for f64 {
    fn from(x: Double) -> Self {
        x.0 + x.1
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        let s = two_sum(self.0, o.0);
        let t = two_sum(self.1, o.1);
        let s = two_sum(s.0, s.1 + t.0);
        two_sum(s.0, s.1 + t.1)
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, o: Self) -> Self {
        let p = self.0 * o.0;
        two_sum(p, self.0.mul_add(o.0, -p) + (self.0 * o.1 + self.1 * o.0))
    }
}

impl Div for Double {
    type Output = Self;

    fn div(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let rest = self - o * q.into();
        let next = rest.0 / o.0;
        let rest = rest - o * next.into();
        two_sum(q, next) + (rest.0 / o.0).into()
    }
}

/// The k-th derivative at t of the spline with these knots and control values.
fn spline(knots: &Knots, t: f64, values: &[Double], k: usize) -> Double {
    let (mut p, mut u) = (knots.degree(), knots.values());
    let mut values = values.to_vec();
    for _ in 0..k {
        if p == 0 {
            return 0.0.into();
        }
        let factor: Double = (p as f64).into();
        values = (1..values.len())
            .map(|i| {
                let length = Double::from(u[i + p]) - u[i].into();
                // Knots of full multiplicity: the control value has no support.
                if length.0 > 0.0 { factor * (values[i] - values[i - 1]) / length } else { 0.0.into() }
            })
            .collect();
        u = &u[1..u.len() - 1];
        p -= 1;
    }
    // The span of the whole spline, in the trimmed knots.
    let span = knots.span(t) - k;
    let mut d: Vec<Double> = values[span - p..=span].to_vec();
    for r in 1..=p {
        for j in (r..=p).rev() {
            let (low, high) = (u[span + j - p], u[span + 1 + j - r]);
            let s = (Double::from(t) - low.into()) / (Double::from(high) - low.into());
            d[j] = d[j - 1] + (d[j] - d[j - 1]) * s;
        }
    }
    d[p]
}

const BINOMIAL: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

/// All partial derivatives up to order 3, `[k][l]` k times by u and l times by v.
pub(super) fn jet(surface: &Surface, uv: DVec2) -> [[[f64; 3]; 4]; 4] {
    let [nu, nv] = surface.counts();
    let [ku, kv] = surface.knots();
    let weight = |at: usize| Double::from(surface.weights().map_or(1.0, |w| w[at]));
    let mut a = [[[Double::default(); 4]; 4]; 4];
    for (k, row) in a.iter_mut().enumerate() {
        for (l, a) in row.iter_mut().enumerate().take(4 - k) {
            for (dim, a) in a.iter_mut().enumerate() {
                let at = |at: usize| match dim {
                    3 => weight(at),
                    _ => weight(at) * surface.points()[at][dim].into(),
                };
                let column: Vec<Double> = (0..nv)
                    .map(|j| {
                        let row: Vec<Double> = (0..nu).map(|i| at(j * nu + i)).collect();
                        spline(ku, uv.x, &row, k)
                    })
                    .collect();
                *a = spline(kv, uv.y, &column, l);
            }
        }
    }
    // Leibniz: A = S w, solved for the derivatives of S in increasing order.
    let mut s = [[[Double::default(); 3]; 4]; 4];
    for k in 0..4 {
        for l in 0..4 - k {
            for dim in 0..3 {
                let mut rest = a[k][l][dim];
                for i in 0..=k {
                    for j in 0..=l {
                        if i + j > 0 {
                            let factor = Double::from(BINOMIAL[k][i] * BINOMIAL[l][j]);
                            rest = rest - factor * a[i][j][3] * s[k - i][l - j][dim];
                        }
                    }
                }
                s[k][l][dim] = rest / a[0][0][3];
            }
        }
    }
    s.map(|row| row.map(|d| d.map(f64::from)))
}

mod tests {
    use glam::DVec3;

    use super::*;

    /// Deterministic numbers (Knuth's linear congruence).
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn signed(&mut self) -> f64 {
            2.0 * self.next() - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.signed(), self.signed(), self.signed())
        }
    }

    /// What rounding can do to each derivative: the sizes of all terms that are added up, times one unit.
    fn sizes(surface: &Surface, uv: DVec2) -> [[f64; 4]; 4] {
        let [ku, kv] = surface.knots();
        let (bu, bv) = (ku.basis(uv.x, 3), kv.basis(uv.y, 3));
        let nu = surface.counts()[0];
        let mut a = [[[0.0; 2]; 4]; 4];
        for (k, row) in a.iter_mut().enumerate() {
            for (l, a) in row.iter_mut().enumerate().take(4 - k) {
                for j in 0..=kv.degree() {
                    for i in 0..=ku.degree() {
                        let at = (bv.first + j) * nu + bu.first + i;
                        let w = surface.weights().map_or(1.0, |w| w[at]) * (bu.d[k][i] * bv.d[l][j]).abs();
                        a[0] += w * surface.points()[at].abs().max_element();
                        a[1] += w;
                    }
                }
            }
        }
        let mut s = [[0.0; 4]; 4];
        for k in 0..4 {
            for l in 0..4 - k {
                let mut sum = a[k][l][0];
                for i in 0..=k {
                    for j in 0..=l {
                        if i + j > 0 {
                            sum += BINOMIAL[k][i] * BINOMIAL[l][j] * a[i][j][1] * s[k - i][l - j];
                        }
                    }
                }
                s[k][l] = sum / a[0][0][1];
            }
        }
        s
    }

    fn knots(degree: usize, random: &mut Random) -> Knots {
        let mut values = Vec::new();
        let mut t = random.signed();
        // Not clamped, with interior knots of any multiplicity up to the degree.
        loop {
            let times = 1 + (random.next() * degree as f64) as usize;
            values.extend(std::iter::repeat_n(t, times));
            t += 0.05 + random.next();
            if values.len() >= 2 * degree + 5
                && let Ok(knots) = Knots::new(degree, values.clone())
            {
                return knots;
            }
        }
    }

    #[test]
    fn twice_the_digits_are_there() {
        let third = Double::from(1.0) / 3.0.into();
        let rest = third * 3.0.into() - 1.0.into();
        assert!(f64::from(rest).abs() < 1e-31 && third.1 != 0.0);
        let root = Double::from(2.0_f64.sqrt());
        let error = root * root - 2.0.into();
        assert!(f64::from(error) == 2.0_f64.sqrt().mul_add(2.0_f64.sqrt(), -2.0));
    }

    #[test]
    fn derivatives_to_the_third_agree_with_twice_the_precision() {
        let mut random = Random(71);
        let mut worst = [0.0_f64; 4];
        for degree in 1..=7 {
            for rational in [false, true] {
                let (u, v) = (knots(degree, &mut random), knots(8 - degree, &mut random));
                let (nu, nv) = (u.control_count(), v.control_count());
                let points: Vec<DVec3> = (0..nu * nv).map(|_| random.vector() * 3.0 + DVec3::X * 10.0).collect();
                let weights = rational.then(|| points.iter().map(|_| 10.0_f64.powf(1.5 * random.signed())).collect());
                let surface = Surface::new(u, v, points, weights).unwrap();
                let [du, dv] = surface.domain();
                for _ in 0..12 {
                    let uv =
                        DVec2::new(du[0] + (du[1] - du[0]) * random.next(), dv[0] + (dv[1] - dv[0]) * random.next());
                    let (fast, slow, size) = (surface.jet(uv, 3), jet(&surface, uv), sizes(&surface, uv));
                    for k in 0..4 {
                        for l in 0..4 - k {
                            let error = fast.d[k][l].distance(DVec3::from(slow[k][l]));
                            worst[k + l] = worst[k + l].max(error / (f64::EPSILON * size[k][l]));
                        }
                    }
                }
            }
        }
        // In units in the last place of the terms that are added up.
        println!("{worst:?}");
        assert!(worst.iter().all(|&w| w < 16.0), "{worst:?}");
    }
}
