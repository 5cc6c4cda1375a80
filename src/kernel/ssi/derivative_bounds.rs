//! Upper bounds of the derivatives of a Bezier piece over its whole domain, and Filip's bound along curves on it.
//!
//! Filip, Magedson and Markot, "Surface algorithms using bounds on derivatives", CAGD 3 (1986): between samples at
//! distance h a vector function D is at most h^2/8 max |D''| off its linear interpolant, and that is nowhere longer
//! than the longer of its ends. Thesis 5.2.2 asks for this term behind the error of sampled curves. For polynomial
//! pieces the derivatives are bounded by their control nets, for rational ones by Leibniz' rule on numerator and
//! weight: N = S w gives |S_ij| <= (|N_ij| + sum |S_kl| |w_(i-k)(j-l)|) / min w, coordinates measured from the middle
//! of the piece. Cost: a few passes over the net. It never fails; weights that are not positive give infinity.

use glam::{DVec2, DVec3, DVec4};

use super::piece::Piece;

/// Bounds of |d^(i+j) S / du^i dv^j|, `i + j <= 3`, by local parameters or those of a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivativeBounds {
    s: [[f64; 4]; 4],
}

impl DerivativeBounds {
    /// Those of a piece, by its local parameters in [0, 1].
    pub fn of(piece: &Piece) -> Self {
        let control = |p: &DVec4| p.truncate() / p.w;
        let middle = piece.points.iter().map(control).sum::<DVec3>() / piece.points.len() as f64;
        let radius = piece.points.iter().map(|p| control(p).distance(middle)).fold(0.0, f64::max);
        let least = piece.points.iter().map(|p| p.w).fold(f64::INFINITY, f64::min);
        let centered: Vec<DVec4> = piece.points.iter().map(|p| (p.truncate() - middle * p.w).extend(p.w)).collect();
        let mut nets = [[[0.0; 2]; 4]; 4];
        let mut along_u = centered;
        let [p, q] = piece.degree;
        for i in 0..4 {
            let width = (p + 1).saturating_sub(i);
            let mut net = along_u.clone();
            for j in 0..4 - i {
                for v in &net {
                    nets[i][j][0] = f64::max(nets[i][j][0], v.truncate().length());
                    nets[i][j][1] = f64::max(nets[i][j][1], v.w.abs());
                }
                net = differences(&net, width, 1, q.saturating_sub(j) as f64);
            }
            along_u = differences(&along_u, width, 0, p.saturating_sub(i) as f64);
        }
        let mut s = [[0.0; 4]; 4];
        s[0][0] = radius;
        for order in 1..4 {
            for i in 0..=order {
                let j = order - i;
                let mut sum = nets[i][j][0];
                if piece.rational {
                    for k in 0..=i {
                        for l in 0..=j {
                            if (k, l) != (i, j) {
                                sum += choose(i, k) * choose(j, l) * s[k][l] * nets[i - k][j - l][1];
                            }
                        }
                    }
                    sum = if least > 0.0 { sum / least } else { f64::INFINITY };
                }
                s[i][j] = sum;
            }
        }
        Self { s }
    }

    /// The same by parameters that run over a rectangle of this size while the local ones run over [0, 1]^2.
    #[must_use]
    pub fn over(mut self, size: DVec2) -> Self {
        for i in 0..4 {
            for j in 0..4 - i {
                self.s[i][j] /= size.x.powi(i as i32) * size.y.powi(j as i32);
            }
        }
        self
    }

    /// A bound of the first derivative along a parameter velocity whose components are at most those of `w`.
    pub fn first(&self, w: DVec2) -> f64 {
        let w = w.abs();
        self.s[1][0] * w.x + self.s[0][1] * w.y
    }

    /// A bound of the second derivative along two such velocities.
    pub fn second(&self, v: DVec2, w: DVec2) -> f64 {
        let (v, w) = (v.abs(), w.abs());
        self.s[2][0] * v.x * w.x + self.s[1][1] * (v.x * w.y + v.y * w.x) + self.s[0][2] * v.y * w.y
    }

    /// A bound of the third derivative along one such velocity and twice along another.
    pub fn third(&self, v: DVec2, w: DVec2) -> f64 {
        let (v, w) = (v.abs(), w.abs());
        let by_u = self.s[3][0] * w.x * w.x + 2.0 * self.s[2][1] * w.x * w.y + self.s[1][2] * w.y * w.y;
        let by_v = self.s[2][1] * w.x * w.x + 2.0 * self.s[1][2] * w.x * w.y + self.s[0][3] * w.y * w.y;
        v.x * by_u + v.y * by_v
    }
}

/// Differences of a net of `width` columns along u (0) or v (1), times the degree.
fn differences(net: &[DVec4], width: usize, along: usize, degree: f64) -> Vec<DVec4> {
    if width == 0 || degree <= 0.0 {
        return Vec::new();
    }
    if along == 0 {
        net.chunks(width).flat_map(|row| row.windows(2).map(|w| (w[1] - w[0]) * degree)).collect()
    } else {
        net.iter().zip(net.iter().skip(width)).map(|(a, b)| (*b - *a) * degree).collect()
    }
}

fn choose(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
}

/// The most samples between two breaks. Fewer than wanted only make the bound larger.
const MOST_SAMPLES: f64 = 4096.0;

/// An upper bound of |D| over [start, end], where |D''| is at most `second`: samples, and Filip's term, which is made
/// no larger than a fifth of `wanted`. With `hasty` it stops early, with infinity, when a sample alone is over `wanted`.
pub fn filip(start: f64, end: f64, second: f64, wanted: f64, hasty: bool, mut d: impl FnMut(f64) -> DVec3) -> f64 {
    let length = end - start;
    let n = (length * (second / (1.6 * wanted)).sqrt()).ceil();
    let n = if n.is_nan() { MOST_SAMPLES } else { n.clamp(1.0, MOST_SAMPLES) };
    let h = length / n;
    let mut most: f64 = 0.0;
    for k in 0..=(n as usize) {
        let f = k as f64 / n;
        most = most.max(d(start * (1.0 - f) + end * f).length());
        if hasty && !(most <= wanted) {
            return f64::INFINITY;
        }
    }
    most + h * h * second / 8.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::ssi::piece::Patch;

    fn piece(rational: bool) -> Piece {
        let (p, q) = (3, 4);
        let points = (0..(p + 1) * (q + 1))
            .map(|k| {
                let (i, j) = (k % (p + 1), k / (p + 1));
                let w = if rational { 0.7 + 0.2 * ((k * 5) % 4) as f64 } else { 1.0 };
                (DVec3::new(i as f64, j as f64 * 0.8, ((k * 7) % 5) as f64 * 0.3) * w).extend(w)
            })
            .collect();
        Piece { surface: 0, index: [0, 0], degree: [p, q], rational, points, low: DVec2::ZERO, high: DVec2::ONE }
    }

    #[test]
    fn no_derivative_exceeds_its_bound() {
        for rational in [false, true] {
            let piece = piece(rational);
            let bounds = DerivativeBounds::of(&piece);
            let mut largest = [0.0_f64; 3];
            for k in 0..=400 {
                let uv = DVec2::new(f64::from(k % 21) / 20.0, f64::from(k / 21) / 19.1).min(DVec2::ONE);
                let w = DVec2::from_angle(f64::from(k));
                let jet = piece.jet2(uv);
                let first = (jet.u * w.x + jet.v * w.y).length() / bounds.first(w);
                let [uu, xy, vv] = jet.second;
                let second = (uu * w.x * w.x + xy * (2.0 * w.x * w.y) + vv * w.y * w.y).length() / bounds.second(w, w);
                let e = 1e-4;
                let along = |t: f64| {
                    let [uu, xy, vv] = piece.jet2(uv + w * t).second;
                    uu * w.x * w.x + xy * (2.0 * w.x * w.y) + vv * w.y * w.y
                };
                let third = (along(e) - along(-e)).length() / (2.0 * e) / bounds.third(w, w);
                largest = [largest[0].max(first), largest[1].max(second), largest[2].max(third)];
            }
            assert!(largest.iter().all(|&x| x < 1.0 && x > 0.02), "{rational} {largest:?}");
        }
    }

    #[test]
    fn the_filip_term_covers_what_lies_between_samples() {
        let d = |t: f64| DVec3::new((37.0 * t).sin(), (37.0 * t).cos(), 0.3 * t) * 1e-3;
        let second = 37.0 * 37.0 * 1e-3;
        let truth = (1e-6_f64 + 9e-8).sqrt();
        let bound = filip(0.0, 1.0, second, 2e-3, true, d);
        assert!(bound >= truth && bound < 1.5e-3, "{bound}");
        assert_eq!(filip(0.0, 1.0, second, 5e-4, true, d), f64::INFINITY);
    }
}
