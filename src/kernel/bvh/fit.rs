//! The volumes of one subpatch from its control net: rectangle-swept sphere, bounding sphere, normal cone.
//!
//! Thesis 4.1.2: the plane at the middle of the bilinear patch, a rectangle around the projected control points, all
//! six faces of that box moved in together until it collapses to a rectangle, and the largest distance of a control
//! point to it as radius. The best rectangle around a nearly bilinear net is flush with one of its two directions,
//! so those two are tried; the smaller area wins.
//!
//! The normal cone comes from the tangent nets (thesis 4.1.1 expands a spherical quadrangle instead). In the frame
//! (e1, e2, m) of the same plane every tangent of the u-net rises out of the plane by a slope of at most tu and fans
//! out in the plane by at most an angle, likewise v; the plane spanned by any two of them has a slope s against m with
//! s^2 <= (tu^2 + tv^2 + 2 tu tv |cos g|) / sin^2 g, g the smallest angle that they can make in the plane. A planar patch
//! has a cone of angle 0 however skew its parameters are, and tangents that vanish (a pole) do not count.
//! For a rational patch the tangent net is that of the numerators Nu D - N Du: for i < k, j <= l the vectors
//! w_kl w_ij (P_kl - P_ij) + w_kj w_il (P_kj - P_il).
//!
//! Rounding: `slack` bounds the error of a coordinate in `f64` and is added to every length; what rounding to `f32`
//! moves is measured and added to the radii. No fused multiply-add, so that all lane counts give the same bytes.

use pulp::Simd;

use super::net::{Shape, corners, point};
use crate::kernel::num::lanes::{F, F3};

/// What a node stores, before the cast.
pub(crate) struct Fitted<S: Simd> {
    pub center: F3<S>,
    pub axes: [F3<S>; 2],
    pub half: [F<S>; 2],
    pub radius: F<S>,
    pub sphere: F<S>,
    pub cone: F3<S>,
}

/// Enough to survive rounding to `f32` to nearest.
const UP: f64 = 1.0 + 1.3e-7;
/// Sine of a half angle beyond which a cone says nothing.
const WIDE: f64 = 0.9999;

/// Fits the volumes of a net. `scratch` has room for three numbers per control point.
#[inline(always)]
pub(crate) fn fit<S: Simd, H: Shape>(simd: S, shape: H, net: &[F<S>], scratch: &mut [F<S>], slack: F<S>) -> Fitted<S> {
    let n = shape.count();
    let zero = F::splat(simd, 0.0);
    let one = F::splat(simd, 1.0);

    // The plane at the middle of the bilinear patch.
    let [c00, c10, c01, c11] = corners(shape, net);
    let (rise, fall) = (c11 - c00, c10 - c01);
    let (a, b) = (rise + fall, rise - fall);
    let cross = a.cross(b);
    let (aa, bb, cc) = (a.dot(a), b.dot(b), cross.dot(cross));
    // Where it has none (an edge closed on itself, a patch without width) any plane along it bounds as well.
    let tiny = aa * bb * 1e-24;
    let longer = F3::less(aa, bb, b, a);
    let length = aa.max(bb);
    let x_axis = F3::new(one, zero, zero);
    let y_axis = F3::new(zero, one, zero);
    let along = F3::less(zero, length, longer * (one / length.sqrt()), x_axis);
    let aside = along.cross(F3::less(along.x.abs(), one * 0.6, x_axis, y_axis));
    let aside = aside * (one / aside.dot(aside).sqrt());
    let m = F3::less(tiny, cc, cross * (one / cc.sqrt()), aside);
    let e1 = F3::less(tiny, cc, a * (one / aa.sqrt()), along);
    let e2 = m.cross(e1);
    let (bx, by) = (b.dot(e1), b.dot(e2));
    let turn = one / (bx * bx + by * by).sqrt();
    let cos = tiny.less(cc, bx * turn, one);
    let sin = tiny.less(cc, by * turn, zero);

    // The net in the frame, and both boxes.
    let (xs, rest) = scratch.split_at_mut(n);
    let (ys, rest) = rest.split_at_mut(n);
    let zs = &mut rest[..n];
    let huge = one * f64::MAX;
    let (mut low, mut high) = ([huge; 5], [-huge; 5]);
    for i in 0..n {
        let p = point(shape, net, i);
        let (x, y, z) = (p.dot(e1), p.dot(e2), p.dot(m));
        (xs[i], ys[i], zs[i]) = (x, y, z);
        let turned = (x * cos + y * sin, y * cos - x * sin);
        (low[0], high[0]) = (low[0].min(x), high[0].max(x));
        (low[1], high[1]) = (low[1].min(y), high[1].max(y));
        (low[2], high[2]) = (low[2].min(z), high[2].max(z));
        (low[3], high[3]) = (low[3].min(turned.0), high[3].max(turned.0));
        (low[4], high[4]) = (low[4].min(turned.1), high[4].max(turned.1));
    }
    let first = (high[0] - low[0]) * (high[1] - low[1]);
    let second = (high[3] - low[3]) * (high[4] - low[4]);
    let (turn_cos, turn_sin) = (second.less(first, cos, one), second.less(first, sin, zero));
    let (low_x, high_x) = (second.less(first, low[3], low[0]), second.less(first, high[3], high[0]));
    let (low_y, high_y) = (second.less(first, low[4], low[1]), second.less(first, high[4], high[1]));
    let (cx, hx) = ((low_x + high_x) * 0.5, (high_x - low_x) * 0.5);
    let (cy, hy) = ((low_y + high_y) * 0.5, (high_y - low_y) * 0.5);
    let (cz, hz) = ((low[2] + high[2]) * 0.5, (high[2] - low[2]) * 0.5);

    // All faces move in until the thinnest direction is gone.
    let thin = hx.min(hy).min(hz);
    let (rx, ry, rz) = (hx - thin, hy - thin, hz - thin);
    let mut swept = zero;
    let mut sphere = zero;
    for i in 0..n {
        let x = xs[i] * turn_cos + ys[i] * turn_sin - cx;
        let y = ys[i] * turn_cos - xs[i] * turn_sin - cy;
        let z = zs[i] - cz;
        let (dx, dy, dz) = ((x.abs() - rx).max(zero), (y.abs() - ry).max(zero), (z.abs() - rz).max(zero));
        swept = swept.max(dx * dx + dy * dy + dz * dz);
        sphere = sphere.max(x * x + y * y + z * z);
    }
    let (swept, sphere) = (swept.sqrt(), sphere.sqrt());

    // The two directions that are left span the rectangle.
    let f1 = e1 * turn_cos + e2 * turn_sin;
    let f2 = e2 * turn_cos - e1 * turn_sin;
    let center = f1 * cx + f2 * cy + m * cz;
    let (u, hu) = (F3::less(zero, rx, f1, f2), zero.less(rx, rx, ry));
    let v = F3::less(zero, rz, m, F3::less(zero, rx, f2, f1));
    let hv = zero.less(rz, rz, zero.less(rx, ry, rx));

    // Rounding to f32, and what it moves.
    let stored = [u.rounded(), v.rounded()];
    let stored_center = center.rounded();
    let (du, dv) = ((stored[0] - u).taxicab(), (stored[1] - v).taxicab());
    let moved = (stored_center - center).taxicab() + slack;
    let bent = (du * hu + (du + dv) * hv) * 2.0;
    Fitted {
        center: stored_center,
        axes: stored,
        half: [hu * UP, hv * UP],
        radius: (swept + moved + bent) * UP,
        sphere: (sphere + moved) * UP,
        cone: cone(simd, shape, net, [xs, ys, zs], [cos, sin], m, tiny.less(cc, one, zero), slack),
    }
}

/// Slopes and fan of a tangent net about its direction in the plane.
struct Fan<S: Simd> {
    slope: F<S>,
    spread: F<S>,
    /// The least component along the direction; a cone needs it positive.
    forward: F<S>,
}

impl<S: Simd> Fan<S> {
    #[inline(always)]
    fn new(one: F<S>) -> Self {
        Self { slope: one * 0.0, spread: one * 0.0, forward: one }
    }

    /// Takes in a tangent with the given components along, across and out of the plane, known to within `slack`.
    #[inline(always)]
    fn add(&mut self, along: F<S>, across: F<S>, out: F<S>, slack: F<S>) {
        let (across, out) = (across.abs(), out.abs());
        let one = slack.with(1.0);
        let zero = slack.with(0.0);
        let vanishes = slack * 4.0;
        let size = along.abs() + across + out;
        let forward = along - slack;
        let inverse = one / forward;
        self.slope = self.slope.max(vanishes.less(size, (out + slack) * inverse, zero));
        self.spread = self.spread.max(vanishes.less(size, (across + slack) * inverse, zero));
        self.forward = self.forward.min(vanishes.less(size, forward, one));
    }
}

/// One coordinate of a vector of the tangent net of a rational patch.
#[inline(always)]
fn tangent<S: Simd>(w: &[F<S>], xs: &[F<S>], [ij, kl, kj, il]: [usize; 4]) -> F<S> {
    w[kl] * w[ij] * (xs[kl] - xs[ij]) + w[kj] * w[il] * (xs[kj] - xs[il])
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn cone<S: Simd, H: Shape>(
    simd: S,
    shape: H,
    net: &[F<S>],
    local: [&[F<S>]; 3],
    [cos, sin]: [F<S>; 2],
    m: F3<S>,
    plane: F<S>,
    slack: F<S>,
) -> F3<S> {
    let one = F::splat(simd, 1.0);
    let zero = F::splat(simd, 0.0);
    let [p, q] = shape.degree();
    let width = p + 1;
    let n = shape.count();
    let [xs, ys, zs] = local;
    let mut fans = [Fan::new(one), Fan::new(one)];
    if H::RATIONAL {
        let w = &net[3 * n..];
        let size = w[..n].iter().fold(zero, |size, &w| size.max(w));
        let slack = slack * (size * size) * 4.0;
        for i in 0..=p {
            for k in i..=p {
                for j in 0..=q {
                    for l in j..=q {
                        let (ij, kl, kj, il) = (j * width + i, l * width + k, j * width + k, l * width + i);
                        if i < k {
                            let ends = [ij, kl, kj, il];
                            let (x, y, z) = (tangent(w, xs, ends), tangent(w, ys, ends), tangent(w, zs, ends));
                            fans[0].add(x, y, z, slack);
                        }
                        if j < l {
                            let ends = [ij, kl, il, kj];
                            let (x, y, z) = (tangent(w, xs, ends), tangent(w, ys, ends), tangent(w, zs, ends));
                            fans[1].add(x * cos + y * sin, y * cos - x * sin, z, slack);
                        }
                    }
                }
            }
        }
    } else {
        for j in 0..=q {
            for i in 0..p {
                let at = j * width + i;
                fans[0].add(xs[at + 1] - xs[at], ys[at + 1] - ys[at], zs[at + 1] - zs[at], slack);
            }
        }
        for j in 0..q {
            for i in 0..width {
                let at = j * width + i;
                let (x, y) = (xs[at + width] - xs[at], ys[at + width] - ys[at]);
                fans[1].add(x * cos + y * sin, y * cos - x * sin, zs[at + width] - zs[at], slack);
            }
        }
    }
    let [u, v] = fans;
    // cos and sin of the sum of both spreads, and the smallest angle that is left between the tangents.
    let scale = one / ((one + u.spread * u.spread) * (one + v.spread * v.spread)).sqrt();
    let spread_cos = (one - u.spread * v.spread) * scale;
    let spread_sin = (u.spread + v.spread) * scale;
    let between = cos.abs() * spread_cos + sin.abs() * spread_sin;
    let slope = (u.slope * u.slope + v.slope * v.slope + u.slope * v.slope * between * 2.0) / (one - between * between);
    let sine = (slope / (one + slope)).sqrt() + 1e-6;
    let wide = one * 2.0;
    let mut sine = sine.less(one * WIDE, sine, wide);
    sine = zero.less(plane, sine, wide);
    sine = zero.less(u.forward.min(v.forward), sine, wide);
    sine = zero.less(spread_cos - cos.abs() + (-1e-12), sine, wide);
    m * sine.less(one, one + sine, zero)
}
