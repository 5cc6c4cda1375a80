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
    fn of<H: Shape>(shape: H, coefficients: &[F<S>]) -> Self {
        let [p, q] = shape.degree();
        let zero = coefficients[0].with(0.0);
        let mut sums = Self { value: [zero; 5], by_s: [zero; 5], by_t: [zero; 5] };
        for j in 0..=q {
            for i in 0..=p {
                let c = coefficients[j * (p + 1) + i].abs();
                let order = (i + j).min(4);
                sums.value[order] += c;
                if i > 0 {
                    sums.by_s[order] += if i > 1 { c * i as f64 } else { c };
                }
                if j > 0 {
                    sums.by_t[order] += if j > 1 { c * j as f64 } else { c };
                }
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
    TERMS.map(|(i, j)| if i <= p && j <= q { coefficients[j * (p + 1) + i] } else { zero })
}

/// The terms up to order 3 of a product.
#[inline(always)]
fn product<S: Simd>(a: &Low<S>, b: &Low<S>) -> Low<S> {
    let mix = |i: usize, j: usize| a[i] * b[j] + a[j] * b[i];
    [
        a[0] * b[0],
        mix(0, 1),
        mix(0, 2),
        mix(0, 3) + a[1] * b[1],
        mix(0, 4) + mix(1, 2),
        mix(0, 5) + a[2] * b[2],
        mix(0, 6) + mix(1, 3),
        mix(0, 7) + mix(1, 4) + mix(2, 3),
        mix(0, 8) + mix(1, 5) + mix(2, 4),
        mix(0, 9) + mix(2, 5),
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
    let [p, q] = shape.degree();
    let zero = F::splat(simd, 0.0);
    let one = F::splat(simd, 1.0);
    let (powers_of, local) = scratch.split_at_mut(shape.size());
    powers(shape, net, matrices, powers_of);
    let coefficient = |i: usize, j: usize| {
        if i > p || j > q {
            return F3::new(zero, zero, zero);
        }
        let at = j * (p + 1) + i;
        F3::new(powers_of[at], powers_of[n + at], powers_of[2 * n + at])
    };

    // The point and its derivatives (halved where taken twice the same way).
    let mut jet = TERMS.map(|(i, j)| coefficient(i, j));
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
    let [middle, su, sv, suu, suv, svv, ..] = jet;

    // Principal curvatures and directions.
    let cross = su.cross(sv);
    let (uu, vv, cc) = (su.dot(su), sv.dot(sv), cross.dot(cross));
    let tiny = uu * vv * 1e-24;
    let regular = |yes: F<S>, no: F<S>| tiny.less(cc, yes, no);
    let (inverse_u, inverse_c) = (one / uu.sqrt(), one / cc.sqrt());
    let pick = |yes: F3<S>, no: F3<S>| F3::less(tiny, cc, yes, no);
    let t1 = pick(su * inverse_u, F3::new(one, zero, zero));
    let normal = pick(cross * inverse_c, F3::new(zero, zero, one));
    let t2 = normal.cross(t1);
    let (along, across) = (sv.dot(t1), sv.dot(t2));
    let (e, f, g) = (suu.dot(normal) * 2.0, suv.dot(normal), svv.dot(normal) * 2.0);
    let inverse_across = one / across;
    let fu = f * inverse_u;
    let c11 = e * inverse_u * inverse_u;
    let c12 = (fu - c11 * along) * inverse_across;
    let c22 = (g - along * (fu + fu - c11 * along)) * (inverse_across * inverse_across);
    let (c11, c12, c22) = (regular(c11, zero), regular(c12, zero), regular(c22, zero));
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
    let curvature = |k: F<S>| k.min(limit).max(-limit);
    let (k_high, k_low) = (curvature(mean + radius), curvature(mean - radius));

    // The tube along a1 or along a2: whichever torus is closer to the corners.
    let corner_at = [0, p, n - p - 1, n - 1];
    let (mut along_first, mut along_second) = (zero, zero);
    for at in corner_at {
        let d = point(shape, net, at) - middle;
        let (x, y, z) = (d.dot(a1), d.dot(a2), d.dot(normal));
        let (w, _) = circle(y, z, k_low);
        along_first = along_first.max(circle(x, w, k_high).0.abs());
        let (w, _) = circle(x, z, k_high);
        along_second = along_second.max(circle(y, w, k_low).0.abs());
    }
    let tube = |first: F<S>, second: F<S>| along_second.less(along_first, second, first);
    let (k1, k2) = (tube(k_high, k_low).rounded(), tube(k_low, k_high).rounded());

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
    let (xx, yy) = (product(&xl, &xl), product(&yl, &yl));
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
    for (k, (i, j)) in TERMS.into_iter().enumerate() {
        let term = (terms[k] - half1 * xx[k] - half2 * yy[k]).abs();
        q_sum += term;
        if i > 0 {
            q_s += term * i as f64;
        }
        if j > 0 {
            q_t += term * j as f64;
        }
    }
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
    let (inverse_w, inverse_d) = (one / turn_w, one / turn_d);
    let derivative = |q: F<S>, b: &[F<S>; 3]| {
        let w = (b[2] + k2_abs * (by * b[1] + bz * b[2])) * inverse_w;
        (q + k2_abs * bz * b[2] + difference * bw * w) * inverse_d
    };
    let (d_s, d_t) = (derivative(q_s, &bound_s), derivative(q_t, &bound_t));

    // Against the tangents, each times the weight: at the middle, and how far they stray.
    let vector = |k: usize| F3::new(xl[k], yl[k], zl[k]);
    let (main_s, main_t) = (vector(1), vector(2));
    let stray = |sums: [&[F<S>; 5]; 3], weight: F<S>| {
        let rest = |a: &[F<S>; 5]| a[2] + a[3] + a[4];
        rest(sums[0]) + rest(sums[1]) + rest(sums[2]) + (bx + by + bz) * weight
    };
    let stray_s = stray([&x.by_s, &y.by_s, &z.by_s], weight_s);
    let stray_t = stray([&x.by_t, &y.by_t, &z.by_t], weight_t);
    let cross = main_s.cross(main_t);
    let (long_s, long_t) = (main_s.dot(main_s).sqrt(), main_t.dot(main_t).sqrt());
    let area = cross.dot(cross).sqrt() - long_s * stray_t - long_t * stray_s - stray_s * stray_t;
    let sine = (d_s * (long_t + stray_t) + d_t * (long_s + stray_s)) * scale / area;
    let unbounded = one * f64::INFINITY;
    let mut sine = sine + 1e-15;
    for condition in [area, turn_w, turn_d, one - sine] {
        sine = zero.less(condition, sine, unbounded);
    }

    // Extents: the half-angle parameter differs from the coordinate by a factor 1 / (1 - eta).
    let extent = |y: F<S>, z: F<S>, c: F<S>, k: F<S>| {
        let left = one - k * (z + c) * 0.5;
        zero.less(left, y / left, unbounded) * UP
    };
    let half_1 = extent(bx, bw, crude, k1_abs);
    let half_2 = extent(by, bz, bw, k2_abs);

    let mut out = [zero; LEAF_NUMBERS];
    let mut set = |at: usize, v: F3<S>| (out[at], out[at + 1], out[at + 2]) = (v.x, v.y, v.z);
    set(0, stored_point);
    set(3, stored_e1);
    set(6, stored_normal);
    (out[9], out[10], out[11], out[12]) = (k1, k2, half_1, half_2);
    for (at, corner) in corner_at.into_iter().enumerate() {
        let d = point(shape, net, corner) - contact;
        let (w, t) = circle(d.dot(e2), d.dot(normal), k2);
        let (_, s) = circle(d.dot(e1), w, k1);
        (out[13 + 2 * at], out[14 + 2 * at]) = (s, t);
    }
    (out[21], out[22]) = ((distance + slack) * UP, sine * UP);
    out
}
