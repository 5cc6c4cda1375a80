//! Bounds of the derivatives of rational pieces.
//!
//! First derivatives: (P_u w - P w_u) / w^2 is rational with the positive weights of w^2, so that quotients of Bernstein
//! coefficients are its control points, for u and v together. Second derivatives: interval arithmetic on
//! S_uu = (P_uu - 2 w_u S_u - w_uu S) / w, and third ones in the same way. All with P moved to a local origin, so that they converge with the rectangle.

use glam::{DVec2, DVec3, DVec4};

use super::net::{derivative, differences};
use super::sheet::Sheet;
use crate::kernel::geom::{Aabb, MAX_DEGREE};

impl Sheet {
    /// Pairs (Su, Sv) around those of a rational net: (P_u w - P w_u) / w^2 and the same for v are rational with the
    /// positive weights of w^2, so that the quotients of the Bernstein coefficients are their control points. `None`
    /// where a weight of the (continued) net is not positive.
    pub fn rational_frames(&self, net: &[DVec4], size: DVec2) -> Option<Vec<[DVec3; 2]>> {
        let [p, q] = self.degree;
        let (low, high) = net.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x.w), h.max(x.w)));
        if low.is_nan() || low <= 1e-3 * high {
            return None;
        }
        // About a local origin, so that the differences converge with the net.
        let origin = net.iter().fold(DVec3::ZERO, |sum, h| sum + h.truncate() / h.w) / net.len() as f64;
        let net: Vec<DVec4> = net.iter().map(|h| (h.truncate() - origin * h.w).extend(h.w)).collect();
        let (width, height) = (p + 1, q + 1);
        let binomial = |n: usize| {
            let mut row = [1.0; MAX_DEGREE + 1];
            for k in 1..=n {
                row[k] = row[k - 1] * (n - k + 1) as f64 / k as f64;
            }
            row
        };
        let (bp, bq) = (binomial(p), binomial(q));
        // P w_u - w P_u needs the net and its derivative, both with the binomials of their degrees.
        let whole: Vec<DVec4> = (0..net.len()).map(|k| net[k] * (bp[k % width] * bq[k / width])).collect();
        let slope = |d: usize| -> Vec<DVec4> {
            let (n, b) = if d == 0 { (p, binomial(p.max(1) - 1)) } else { (q, binomial(q.max(1) - 1)) };
            let step = if d == 0 { 1 } else { width };
            let (w, h) = if d == 0 { (p, height) } else { (width, q) };
            (0..w * h)
                .map(|k| {
                    let (i, j) = (k % w, k / w);
                    let at = j * width + i;
                    let factor = n as f64 / size[d] * if d == 0 { b[i] * bq[j] } else { bp[i] * b[j] };
                    (net[at + step] - net[at]) * factor
                })
                .collect()
        };
        let (wide, tall) = (2 * p + 1, 2 * q + 1);
        let mut weight = vec![0.0; wide * tall];
        for (k, a) in whole.iter().enumerate() {
            for (l, b) in whole.iter().enumerate() {
                weight[(k / width + l / width) * wide + k % width + l % width] += a.w * b.w;
            }
        }
        let mut out = vec![[DVec3::ZERO; 2]; wide * tall];
        for d in 0..2 {
            let (slope, w) = (slope(d), if d == 0 { p } else { width });
            for (k, a) in slope.iter().enumerate() {
                for (l, b) in whole.iter().enumerate() {
                    let at = (k / w + l / width) * wide + k % w + l % width;
                    let value = a.truncate() * b.w - b.truncate() * a.w;
                    // Times (1 - t) + t, for the degree of the weights.
                    out[at][d] += value;
                    out[at + if d == 0 { 1 } else { wide }][d] += value;
                }
            }
        }
        for (frame, w) in out.iter_mut().zip(weight) {
            *frame = frame.map(|x| x / w);
        }
        Some(out)
    }
}

/// An interval of vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval3 {
    pub low: DVec3,
    pub high: DVec3,
}

impl Interval3 {
    pub fn of(points: &[DVec3]) -> Self {
        let b = Aabb::of(points.iter().copied());
        Self { low: b.min, high: b.max }
    }

    pub fn corners(&self) -> Vec<DVec3> {
        let pick = |bit: usize, k: usize| if k >> bit & 1 == 0 { self.low } else { self.high };
        (0..8).map(|k| DVec3::new(pick(0, k).x, pick(1, k).y, pick(2, k).z)).collect()
    }

    fn minus(self, other: Self) -> Self {
        Self { low: self.low - other.high, high: self.high - other.low }
    }

    fn times(self, [a, b]: [f64; 2]) -> Self {
        let products = [self.low * a, self.low * b, self.high * a, self.high * b];
        Self {
            low: products.iter().fold(DVec3::INFINITY, |m, &p| m.min(p)),
            high: products.iter().fold(DVec3::NEG_INFINITY, |m, &p| m.max(p)),
        }
    }
}

/// Quotient-rule bounds of one rational net.
pub(crate) struct Quotient {
    /// S minus the local origin.
    s: Interval3,
    over_w: [f64; 2],
    p: [Interval3; 2],
    pp: [Interval3; 3],
    w: [[f64; 2]; 2],
    ww: [[f64; 2]; 3],
}

impl Quotient {
    /// `None` where a weight of the (continued) net is not positive.
    pub fn new(sheet: &Sheet, net: &[DVec4], size: DVec2) -> Option<Self> {
        let w_low = net.iter().fold(f64::INFINITY, |m, h| m.min(h.w));
        let w_high = net.iter().fold(0.0, |m: f64, h| m.max(h.w));
        if w_low.is_nan() || w_low <= 1e-3 * w_high {
            return None;
        }
        let origin = net.iter().fold(DVec3::ZERO, |sum, h| sum + h.truncate() / h.w) / net.len() as f64;
        let p: Vec<DVec3> = net.iter().map(|h| h.truncate() - origin * h.w).collect();
        let w: Vec<DVec3> = net.iter().map(|h| DVec3::X * h.w).collect();
        let s = Interval3::of(&p.iter().zip(net).map(|(&p, h)| p / h.w).collect::<Vec<_>>());
        let (du, dv) = (sheet.degree[0], sheet.degree[1]);
        let all = |net: &[DVec3]| {
            let u = sheet.differences(net, 0, size.x);
            let v = sheet.differences(net, 1, size.y);
            let uu = differences(&u, du, dv + 1, 0, du - 1, size.x);
            let uv = differences(&u, du, dv + 1, 1, dv, size.y);
            let vv = differences(&v, du + 1, dv, 1, dv - 1, size.y);
            [u, v, uu, uv, vv].map(|x| Interval3::of(&x))
        };
        let (a, b) = (all(&p), all(&w).map(|x| [x.low.x, x.high.x]));
        Some(Self {
            s,
            over_w: [1.0 / w_high, 1.0 / w_low],
            p: [a[0], a[1]],
            pp: [a[2], a[3], a[4]],
            w: [b[0], b[1]],
            ww: [b[2], b[3], b[4]],
        })
    }

    fn first(&self, d: usize) -> Interval3 {
        self.p[d].minus(self.s.times(self.w[d])).times(self.over_w)
    }

    /// Bounds of the third derivatives uuu, uuv, uvv, vvv; `net` and `size` are those that it was made of.
    pub fn third(&self, sheet: &Sheet, net: &[DVec4], size: DVec2) -> [Interval3; 4] {
        let origin = net.iter().fold(DVec3::ZERO, |sum, h| sum + h.truncate() / h.w) / net.len() as f64;
        let p: Vec<DVec3> = net.iter().map(|h| h.truncate() - origin * h.w).collect();
        let w: Vec<DVec3> = net.iter().map(|h| DVec3::X * h.w).collect();
        // Two directions as the place of their second derivative among uu, uv, vv.
        let second = |a: usize, b: usize| self.second(a + b, a, b);
        [0, 1, 2, 3].map(|k| {
            // k derivatives by v, 3 - k by u.
            let [a, b, c] = [0, 1, 2].map(|i| usize::from(i >= 3 - k));
            let of = |net: &[DVec3]| Interval3::of(&derivative(net, sheet.degree, [3 - k, k], size));
            let www = of(&w);
            of(&p)
                .minus(second(b, c).times(self.w[a]))
                .minus(second(a, c).times(self.w[b]))
                .minus(second(a, b).times(self.w[c]))
                .minus(self.first(c).times(self.ww[a + b]))
                .minus(self.first(b).times(self.ww[a + c]))
                .minus(self.first(a).times(self.ww[b + c]))
                .minus(self.s.times([www.low.x, www.high.x]))
                .times(self.over_w)
        })
    }

    pub fn second(&self, at: usize, a: usize, b: usize) -> Interval3 {
        self.pp[at]
            .minus(self.first(a).times(self.w[b]))
            .minus(self.first(b).times(self.w[a]))
            .minus(self.s.times(self.ww[at]))
            .times(self.over_w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::{Knots, Surface};
    use crate::kernel::self_ssi::hull::{Rect, range};

    #[test]
    fn rational_derivatives_lie_in_the_hull_of_their_frames() {
        let (ku, kv) = (Knots::bezier(3, 0.0, 1.0).unwrap(), Knots::bezier(2, 0.0, 1.0).unwrap());
        let h = |at: usize, m: usize| ((at * 7919 + 13) % m) as f64 / m as f64;
        let points = (0..12).map(|at| DVec3::new(h(at, 31), h(at, 37), h(at, 41))).collect();
        let weights = (0..12).map(|at| 0.5 + h(at, 23)).collect();
        let sheet = Sheet::new(&Surface::new(ku, kv, points, Some(weights)).unwrap(), 1e-12);
        for rect in [Rect::new(DVec2::ZERO, DVec2::ONE), Rect::new(DVec2::new(0.2, 0.6), DVec2::new(0.3, 0.75))] {
            let frames = sheet.frames(&rect);
            let size = |y: DVec3, d: usize| range(y, &frames.iter().map(|f| f[d]).collect::<Vec<_>>());
            for k in 0..36 {
                let at = rect.low + rect.size() * DVec2::new(f64::from(k % 6), f64::from(k / 6)) / 5.0;
                let jet = sheet.jet(at, 1);
                for y in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.5)] {
                    for d in 0..2 {
                        let [low, high] = size(y, d);
                        let value = y.dot(jet.d[d]);
                        assert!(low - 1e-12 <= value && value <= high + 1e-12, "{low} {value} {high}");
                    }
                }
            }
            // Tight: at the corners the control point is the derivative.
            let corner = sheet.jet(rect.low, 1);
            assert!(frames[0][0].distance(corner.d[0]) < 1e-11 && frames[0][1].distance(corner.d[1]) < 1e-11);
        }
    }

    #[test]
    fn rational_third_derivatives_lie_in_their_bounds() {
        let (ku, kv) = (Knots::bezier(3, 0.0, 1.0).unwrap(), Knots::bezier(2, 0.0, 1.0).unwrap());
        let h = |at: usize, m: usize| ((at * 7919 + 13) % m) as f64 / m as f64;
        let points = (0..12).map(|at| DVec3::new(h(at, 31), h(at, 37), h(at, 41))).collect();
        let weights = (0..12).map(|at| 0.8 + 0.3 * h(at, 23)).collect();
        let surface = Surface::new(ku, kv, points, Some(weights)).unwrap();
        let sheet = Sheet::new(&surface, 1e-12);
        let mut widths = Vec::new();
        for size in [0.2, 0.02] {
            let rect = Rect::new(DVec2::new(0.4, 0.3), DVec2::new(0.4 + size, 0.3 + size));
            let third = sheet.third_hull(&rect).unwrap();
            for k in 0..4 {
                let [low, high] = range(DVec3::X, &third[k]);
                widths.push(high - low);
                for f in [0.0, 0.3, 1.0] {
                    let d = surface.jet(rect.low + rect.size() * f, 3).d[3 - k][k] / sheet.scale;
                    for y in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 0.5)] {
                        let [low, high] = range(y, &third[k]);
                        let slack = 1e-9 * (high - low);
                        assert!(low - slack <= y.dot(d) && y.dot(d) <= high + slack, "{k}: {low} {} {high}", y.dot(d));
                    }
                }
            }
        }
        // They converge with the rectangle.
        assert!((0..4).all(|k| widths[4 + k] < 0.2 * widths[k]), "{widths:?}");
    }
}
