//! The osculating torus of a subpatch, with true upper bounds of what it misses by.
//!
//! Thesis 4.1.3 takes the torus from the curvatures at the middle of the subpatch. Here the frame and the curvatures
//! are rounded to what a leaf stores first, and everything else is measured against that torus, in powers of (s, t)
//! on [-1, 1]^2 about the middle. With w = c(y, z, k2) the distance is
//!
//! ```text
//! d = c(x, w, k1) = q + (-k2 z^2 + (k2 - k1) w^2 + k1 d^2) / 2,   q = z - k1 x^2 / 2 - k2 y^2 / 2
//! ```
//!
//! (both identities c = z - k (y^2 + z^2) / 2 + k c^2 / 2). q is a polynomial whose terms up to order 2 vanish but for
//! rounding; its terms up to order 3 are computed, the rest is bounded by sums of absolute coefficients. The bracket
//! is of order 4. Differentiated, the same identities bound d_u and d_v, and with them the angle between the gradient
//! of the distance (the torus' normal) and Su x Sv. A rational patch is q w^2 over w^2.
//!
//! Which principal direction is the tube and which the spine gives two tori of the same contact; the one that is
//! closer to the four corners is taken.

use pulp::Simd;

use super::net::{Shape, point, powers};
use super::torus::LEAF_NUMBERS;
use crate::kernel::num::lanes::{F, F3};

const UP: f64 = 1.0 + 1.3e-7;

/// Sums of absolute coefficients of a coordinate by order 0, 1, 2, 3 and more, and of its derivatives (by the
/// order of the coefficient).
struct Sums<S: Simd> {
    value: [F<S>; 5],
    by_s: [F<S>; 5],
    by_t: [F<S>; 5],
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn of<H: Shape>(shape: H, c: &[F<S>]) -> Self {
        let [p, q] = shape.degree();
        let zero = c[0].with(0.0);
        let mut sums = Self { value: [zero; 5], by_s: [zero; 5], by_t: [zero; 5] };
        if p == 3 && q == 3 {
            // Written out: the compiler does not unroll the loop below.
            let (c20, c02, c11) = (c[2].abs(), c[8].abs(), c[5].abs());
            let (c10, c01) = (c[1].abs(), c[4].abs());
            let (c30, c21, c12, c03) = (c[3].abs(), c[6].abs(), c[9].abs(), c[12].abs());
            let (c31, c22, c13) = (c[7].abs(), c[10].abs(), c[13].abs());
            let (c32, c23, c33) = (c[11].abs(), c[14].abs(), c[15].abs());
            let (twice, thrice) = (c22 + c23, c31 + c32 + c33);
            let (twice_t, thrice_t) = (c22 + c32, c13 + c23 + c33);
            sums.value = [c[0].abs(), c10 + c01, c20 + c11 + c02, c30 + c21 + c12 + c03, thrice + c22 + c13 + c23];
            sums.by_s =
                [zero, c10, c20 + c20 + c11, c30 * 3.0 + (c21 + c21) + c12, thrice * 3.0 + (twice + twice) + c13];
            sums.by_t =
                [zero, c01, c02 + c02 + c11, c03 * 3.0 + (c12 + c12) + c21, thrice_t * 3.0 + (twice_t + twice_t) + c31];
            return sums;
        }
        for j in 0..=q {
            for i in 0..=p {
                let c = c[j * (p + 1) + i].abs();
                let order = (i + j).min(4);
                sums.value[order] += c;
                sums.by_s[order] += c * i as f64;
                sums.by_t[order] += c * j as f64;
            }
        }
        sums
    }
}

#[inline(always)]
fn total<S: Simd>(a: &[F<S>; 5]) -> F<S> {
    (a[0] + a[1]) + (a[2] + a[3]) + a[4]
}

/// Bounds the terms of order 4 and more of a product.
#[inline(always)]
fn tail<S: Simd>(a: &[F<S>; 5], b: &[F<S>; 5]) -> F<S> {
    let b3 = b[3] + b[4];
    let b2 = b[2] + b3;
    let b1 = b[1] + b2;
    a[0] * b[4] + a[1] * b3 + a[2] * b2 + a[3] * b1 + a[4] * (b[0] + b1)
}

/// The terms (i, j) of order up to 3, in the order 00 10 01 20 11 02 30 21 12 03.
const TERMS: [(usize, usize); 10] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

type Low<S> = [F<S>; 10];

#[inline(always)]
fn low<S: Simd, H: Shape>(shape: H, coefficients: &[F<S>]) -> Low<S> {
    let [p, q] = shape.degree();
    let zero = coefficients[0].with(0.0);
    let mut low = [zero; 10];
    if p == 3 && q == 3 {
        let c = coefficients;
        return [c[0], c[1], c[4], c[2], c[5], c[8], c[3], c[6], c[9], c[12]];
    }
    for (low, (i, j)) in low.iter_mut().zip(TERMS) {
        if i <= p && j <= q {
            *low = coefficients[j * (p + 1) + i];
        }
    }
    low
}

/// One mixed term of a product.
#[inline(always)]
fn mix<S: Simd>(a: &Low<S>, b: &Low<S>, i: usize, j: usize) -> F<S> {
    a[i] * b[j] + a[j] * b[i]
}

/// The terms up to order 3 of a product.
#[inline(always)]
fn product<S: Simd>(a: &Low<S>, b: &Low<S>) -> Low<S> {
    [
        a[0] * b[0],
        mix(a, b, 0, 1),
        mix(a, b, 0, 2),
        mix(a, b, 0, 3) + a[1] * b[1],
        mix(a, b, 0, 4) + mix(a, b, 1, 2),
        mix(a, b, 0, 5) + a[2] * b[2],
        mix(a, b, 0, 6) + mix(a, b, 1, 3),
        mix(a, b, 0, 7) + mix(a, b, 1, 4) + mix(a, b, 2, 3),
        mix(a, b, 0, 8) + mix(a, b, 1, 5) + mix(a, b, 2, 4),
        mix(a, b, 0, 9) + mix(a, b, 2, 5),
    ]
}

/// The terms up to order 3 of half a square.
#[inline(always)]
fn half_square<S: Simd>(a: &Low<S>) -> Low<S> {
    [
        a[0] * a[0] * 0.5,
        a[0] * a[1],
        a[0] * a[2],
        a[0] * a[3] + a[1] * a[1] * 0.5,
        a[0] * a[4] + a[1] * a[2],
        a[0] * a[5] + a[2] * a[2] * 0.5,
        a[0] * a[6] + a[1] * a[3],
        a[0] * a[7] + a[1] * a[4] + a[2] * a[3],
        a[0] * a[8] + a[1] * a[5] + a[2] * a[4],
        a[0] * a[9] + a[2] * a[5],
    ]
}

/// c(y, z, k) and the half-angle parameter of the foot point.
#[inline(always)]
fn circle<S: Simd>(y: F<S>, z: F<S>, k: F<S>) -> (F<S>, F<S>) {
    let one = y.with(1.0);
    let (a, b) = (one - k * z, k * y);
    let root = (a * a + b * b).sqrt();
    ((z + z - k * (y * y + z * z)) / (one + root), (y + y) / (a + root))
}

/// Bound of |c| where |y| <= Y and |z| <= Z.
#[inline(always)]
fn circle_bound<S: Simd>(y: F<S>, z: F<S>, k: F<S>) -> F<S> {
    let one = y.with(1.0);
    let k = k.abs();
    let n = z + z + k * (y * y + z * z);
    n / (one + (one - k * n).max(one * 0.0).sqrt())
}

/// What bounds a derivative of the distance.
struct Slope<S: Simd> {
    /// Bounds of |y| and |z|.
    of: [F<S>; 2],
    bw: F<S>,
    inverse_w: F<S>,
    inverse_d: F<S>,
    k2: F<S>,
    difference: F<S>,
}

impl<S: Simd> Slope<S> {
    /// From bounds of the derivatives of q and of the coordinates.
    #[inline(always)]
    fn bound(&self, q: F<S>, derivative: &[F<S>; 3]) -> F<S> {
        let [y, z] = self.of;
        let w = (derivative[2] + self.k2 * (y * derivative[1] + z * derivative[2])) * self.inverse_w;
        (q + self.k2 * z * derivative[2] + self.difference * self.bw * w) * self.inverse_d
    }
}

/// The sum over orders 2 and more.
#[inline(always)]
fn above_one<S: Simd>(a: &[F<S>; 5]) -> F<S> {
    a[2] + a[3] + a[4]
}

/// Bound of the half-angle parameter of (y, z) on a circle of curvature `k` >= 0, |c| <= `c`.
#[inline(always)]
fn extent<S: Simd>(y: F<S>, z: F<S>, c: F<S>, k: F<S>) -> F<S> {
    let zero = y.with(0.0);
    let left = y.with(1.0) - k * (z + c) * 0.5;
    zero.less(left, y / left, y.with(f64::INFINITY)) * UP
}

/// The numbers of the leaf's torus, in the order of `LeafTorus::from_numbers`. `center` is the node's centre;
/// `scratch` has room for two nets.
#[inline(always)]
pub(crate) fn osculate<S: Simd, H: Shape>(
    simd: S,
    shape: H,
    net: &[F<S>],
    matrices: [&[f64]; 2],
    center: F3<S>,
    scratch: &mut [F<S>],
    slack: F<S>,
) -> [F<S>; LEAF_NUMBERS] {
    let n = shape.count();
    let [p, _] = shape.degree();
    let zero = F::splat(simd, 0.0);
    let one = F::splat(simd, 1.0);
    let (powers_of, local) = scratch.split_at_mut(shape.size());
    powers(shape, net, matrices, powers_of);

    // The point and its derivatives (halved where taken twice the same way).
    let (lx, ly, lz) =
        (low(shape, &powers_of[..n]), low(shape, &powers_of[n..2 * n]), low(shape, &powers_of[2 * n..3 * n]));
    let mut jet = [F3::new(zero, zero, zero); 6];
    for k in 0..6 {
        jet[k] = F3::new(lx[k], ly[k], lz[k]);
    }
    if H::RATIONAL {
        let weight = low(shape, &powers_of[3 * n..4 * n]);
        let inverse = one / weight[0];
        jet[0] = jet[0] * inverse;
        for k in 1..3 {
            jet[k] = (jet[k] - jet[0] * weight[k]) * inverse;
        }
        jet[3] = (jet[3] - jet[0] * weight[3] - jet[1] * weight[1]) * inverse;
        jet[4] = (jet[4] - jet[0] * weight[4] - jet[1] * weight[2] - jet[2] * weight[1]) * inverse;
        jet[5] = (jet[5] - jet[0] * weight[5] - jet[2] * weight[2]) * inverse;
    }
    let [middle, su, sv, suu, suv, svv] = jet;

    // Principal curvatures and directions.
    let cross = su.cross(sv);
    let (uu, vv, cc) = (su.dot(su), sv.dot(sv), cross.dot(cross));
    let tiny = uu * vv * 1e-24;
    let (inverse_u, inverse_c) = (one / uu.sqrt(), one / cc.sqrt());
    let t1 = F3::less(tiny, cc, su * inverse_u, F3::new(one, zero, zero));
    let normal = F3::less(tiny, cc, cross * inverse_c, F3::new(zero, zero, one));
    let t2 = normal.cross(t1);
    let (along, across) = (sv.dot(t1), sv.dot(t2));
    let (e, f, g) = (suu.dot(normal) * 2.0, suv.dot(normal), svv.dot(normal) * 2.0);
    let inverse_across = one / across;
    let fu = f * inverse_u;
    let c11 = e * inverse_u * inverse_u;
    let c12 = (fu - c11 * along) * inverse_across;
    let c22 = (g - along * (fu + fu - c11 * along)) * (inverse_across * inverse_across);
    let (c11, c12, c22) = (tiny.less(cc, c11, zero), tiny.less(cc, c12, zero), tiny.less(cc, c22, zero));
    let (half, mean) = ((c11 - c22) * 0.5, (c11 + c22) * 0.5);
    let radius = (half * half + c12 * c12).sqrt();
    let inverse = one / radius;
    let cos2 = zero.less(radius, half * inverse, one);
    let sin2 = zero.less(radius, c12 * inverse, zero);
    let major = ((one + cos2.abs()) * 0.5).sqrt();
    let minor = sin2 / (major + major);
    let (cos, sin) = (cos2.less(zero, minor, major), cos2.less(zero, major, minor));
    let a1 = t1 * cos + t2 * sin;
    let a2 = normal.cross(a1);
    let limit = one * 1e30;
    let (k_high, k_low) = ((mean + radius).min(limit).max(-limit), (mean - radius).min(limit).max(-limit));

    // The tube along a1 or along a2: whichever torus is closer to the corners, by the terms up to order 4.
    let corner_at = [0, p, n - p - 1, n - 1];
    let mut corner_points = [middle; 4];
    let (mut along_first, mut along_second) = (zero, zero);
    for at in 0..4 {
        corner_points[at] = point(shape, net, corner_at[at]);
        let d = corner_points[at] - middle;
        let (x, y, z) = (d.dot(a1), d.dot(a2), d.dot(normal));
        let (bent_x, bent_y) = (k_high * x * x * 0.5, k_low * y * y * 0.5);
        let (over_y, over_x) = (z - bent_y, z - bent_x);
        let q = over_y - bent_x;
        let difference = (k_high - k_low) * 0.5;
        let z2 = z * z * 0.5;
        along_first = along_first.max((q - k_low * z2 - difference * over_y * over_y).abs());
        along_second = along_second.max((q - k_high * z2 + difference * over_x * over_x).abs());
    }
    let k1 = along_second.less(along_first, k_low, k_high).rounded();
    let k2 = along_second.less(along_first, k_high, k_low).rounded();

    // What is stored, and the frame that it decodes to.
    let stored_e1 = F3::less(along_second, along_first, a2, a1).rounded();
    let stored_normal = normal.rounded();
    let stored_point = (middle - center).rounded();
    let normal = stored_normal * (one / stored_normal.dot(stored_normal).sqrt());
    let e1 = stored_e1 - normal * stored_e1.dot(normal);
    let e1 = e1 * (one / e1.dot(e1).sqrt());
    let e2 = normal.cross(e1);
    let contact = center + stored_point;

    // Coordinates in that frame.
    for at in 0..n {
        let mut d = F3::new(powers_of[at], powers_of[n + at], powers_of[2 * n + at]);
        if H::RATIONAL {
            d = d - contact * powers_of[3 * n + at];
        } else if at == 0 {
            d = d - contact;
        }
        local[at] = d.dot(e1);
        local[n + at] = d.dot(e2);
        local[2 * n + at] = d.dot(normal);
    }
    let (xs, ys, zs) = (&local[..n], &local[n..2 * n], &local[2 * n..3 * n]);
    let (x, y, z) = (Sums::of(shape, xs), Sums::of(shape, ys), Sums::of(shape, zs));
    let (xl, yl, zl) = (low(shape, xs), low(shape, ys), low(shape, zs));

    // q, times the squared weight where there is one.
    let (half1, half2) = (k1 * 0.5, k2 * 0.5);
    let (xx, yy) = (half_square(&xl), half_square(&yl));
    let (half1_abs, half2_abs) = (half1.abs(), half2.abs());
    let mut terms = zl;
    let (mut q_tail, mut q_tail_s, mut q_tail_t) = (z.value[4], z.by_s[4], z.by_t[4]);
    let (mut least_weight, mut most_weight, mut weight_s, mut weight_t) = (one, one, zero, zero);
    if H::RATIONAL {
        let ws = &powers_of[3 * n..4 * n];
        let (w, wl) = (Sums::of(shape, ws), low(shape, ws));
        let rest = total(&w.value) - w.value[0];
        // The least control weight bounds as well, and is positive.
        let control = net[3 * n + 1..4 * n].iter().fold(net[3 * n], |least, &w| least.min(w));
        (least_weight, most_weight) = (control.max(w.value[0] - rest), w.value[0] + rest);
        (weight_s, weight_t) = (total(&w.by_s), total(&w.by_t));
        terms = product(&zl, &wl);
        q_tail = tail(&z.value, &w.value);
        q_tail_s = tail(&z.by_s, &w.value) + tail(&z.value, &w.by_s);
        q_tail_t = tail(&z.by_t, &w.value) + tail(&z.value, &w.by_t);
    }
    q_tail += half1_abs * tail(&x.value, &x.value) + half2_abs * tail(&y.value, &y.value);
    q_tail_s += (half1_abs * tail(&x.by_s, &x.value) + half2_abs * tail(&y.by_s, &y.value)) * 2.0;
    q_tail_t += (half1_abs * tail(&x.by_t, &x.value) + half2_abs * tail(&y.by_t, &y.value)) * 2.0;
    // The bound of the rounding of one term of q.
    let reach = total(&x.value) + total(&y.value) + total(&z.value);
    let scale = if H::RATIONAL { most_weight } else { one };
    let noise = slack * scale * (scale + (half1_abs + half2_abs) * reach * 2.0) * 4.0;
    let (mut q_sum, mut q_s, mut q_t) = (q_tail + noise, q_tail_s + noise, q_tail_t + noise);
    let mut term = [zero; 10];
    for k in 0..10 {
        term[k] = (terms[k] - k1 * xx[k] - k2 * yy[k]).abs();
    }
    let [t00, t10, t01, t20, t11, t02, t30, t21, t12, t03] = term;
    q_sum += ((t00 + t10) + (t01 + t20)) + ((t11 + t02) + (t30 + t21)) + (t12 + t03);
    q_s += t10 + t11 + t12 + (t20 + t21) * 2.0 + t30 * 3.0;
    q_t += t01 + t11 + t21 + (t02 + t12) * 2.0 + t03 * 3.0;
    let mut bound = [total(&x.value), total(&y.value), total(&z.value)];
    let mut bound_s = [total(&x.by_s), total(&y.by_s), total(&z.by_s)];
    let mut bound_t = [total(&x.by_t), total(&y.by_t), total(&z.by_t)];
    if H::RATIONAL {
        let inverse = one / least_weight;
        for k in 0..3 {
            bound[k] = bound[k] * inverse;
            bound_s[k] = (bound_s[k] + bound[k] * weight_s) * inverse;
            bound_t[k] = (bound_t[k] + bound[k] * weight_t) * inverse;
        }
        let square = inverse * inverse;
        q_sum = q_sum * square;
        q_s = q_s * square + q_sum * weight_s * inverse * 2.0;
        q_t = q_t * square + q_sum * weight_t * inverse * 2.0;
    }

    // The distance and its derivatives.
    let [bx, by, bz] = bound;
    let (k1_abs, k2_abs, difference) = (k1.abs(), k2.abs(), (k2 - k1).abs());
    let bw = circle_bound(by, bz, k2);
    let flat = k2_abs * bz * bz + difference * bw * bw;
    let crude = circle_bound(bx, bw, k1);
    let better = (q_sum + (flat + k1_abs * crude * crude) * 0.5).min(crude);
    let distance = (q_sum + (flat + k1_abs * better * better) * 0.5).min(crude);
    let turn_w = one - k2_abs * bw;
    let turn_d = one - k1_abs * distance;
    let slope = Slope { of: [by, bz], bw, inverse_w: one / turn_w, inverse_d: one / turn_d, k2: k2_abs, difference };
    let (d_s, d_t) = (slope.bound(q_s, &bound_s), slope.bound(q_t, &bound_t));

    // Against the tangents, each times the weight: at the middle, and how far they stray.
    let main_s = F3::new(xl[1], yl[1], zl[1]);
    let main_t = F3::new(xl[2], yl[2], zl[2]);
    let mut stray_s = above_one(&x.by_s) + above_one(&y.by_s) + above_one(&z.by_s);
    let mut stray_t = above_one(&x.by_t) + above_one(&y.by_t) + above_one(&z.by_t);
    if H::RATIONAL {
        stray_s += (bx + by + bz) * weight_s;
        stray_t += (bx + by + bz) * weight_t;
    }
    let cross = main_s.cross(main_t);
    let (long_s, long_t) = (main_s.dot(main_s).sqrt(), main_t.dot(main_t).sqrt());
    let area = cross.dot(cross).sqrt() - long_s * stray_t - long_t * stray_s - stray_s * stray_t;
    let sine = (d_s * (long_t + stray_t) + d_t * (long_s + stray_s)) * scale / area;
    let unbounded = one * f64::INFINITY;
    let mut sine = sine + 1e-15;
    sine = zero.less(area.min(turn_w).min(turn_d), sine, unbounded);
    sine = sine.less(one, sine, unbounded);

    // Extents: the half-angle parameter differs from the coordinate by a factor 1 / (1 - eta).
    let half_1 = extent(bx, bw, crude, k1_abs);
    let half_2 = extent(by, bz, bw, k2_abs);

    let mut out = [zero; LEAF_NUMBERS];
    (out[0], out[1], out[2]) = (stored_point.x, stored_point.y, stored_point.z);
    (out[3], out[4], out[5]) = (stored_e1.x, stored_e1.y, stored_e1.z);
    (out[6], out[7], out[8]) = (stored_normal.x, stored_normal.y, stored_normal.z);
    (out[9], out[10], out[11], out[12]) = (k1, k2, half_1, half_2);
    for at in 0..4 {
        let d = corner_points[at] - contact;
        let (w, t) = circle(d.dot(e2), d.dot(normal), k2);
        let (_, s) = circle(d.dot(e1), w, k1);
        (out[13 + 2 * at], out[14 + 2 * at]) = (s, t);
    }
    (out[21], out[22]) = ((distance + slack) * UP, sine * UP);
    out
}
