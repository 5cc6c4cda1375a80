//! Proofs about a window: a rectangle of the domain against itself.
//!
//! *Injective.* A Gauss map inside an open hemisphere gives local injectivity only. Sufficient on a convex domain is a
//! pair of vectors p, q with p.Su > 0, q.Sv > 0 and (p.Su)(q.Sv) > (p.Sv + q.Su)^2 / 4 everywhere: for two points that
//! differ by (du, dv), the derivative of S along the segment between them has a positive product with
//! du p + dv q. Bounded on hulls of Su and Sv.
//!
//! *Cross-cap.* Near a generic miter point m with null direction e, points that coincide are m' +- r (k, 1) in the
//! frame (e', e), e' perpendicular to e, with zeros of the mean of k S_x + S_y along the segment. Where the Jacobian of
//! that mean by (m', k), preconditioned by its value at m, is regular over the window, every r has at most one
//! solution: the window contains no miter point but m, and no self-intersection but the branch through m, other than
//! branches that cross its border.

use glam::{DMat3, DVec2, DVec3};

use super::hull::{Hull, Rect, SecondHull, range};

/// Whether the surface is proved injective over the window with this hull.
pub(crate) fn injective(hull: &Hull) -> bool {
    let mean = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let (u, v) = (mean(&hull.du), mean(&hull.dv));
    let n = u.cross(v);
    let area = n.length_squared();
    if area.is_nan() || area <= 1e-24 * u.length_squared() * v.length_squared() {
        return false;
    }
    let (p, q) = (v.cross(n) / area, n.cross(u) / area);
    let (pu, qv) = (range(p, &hull.du)[0], range(q, &hull.dv)[0]);
    let (pv, qu) = (range(p, &hull.dv), range(q, &hull.du));
    let cross = (pv[1] + qu[1]).max(-pv[0] - qu[0]);
    pu > 0.0 && qv > 0.0 && pu * qv > 0.25 * cross * cross
}

/// A closed interval of numbers, for the few sums that the test needs.
type Interval = [f64; 2];

fn scaled([a, b]: Interval, s: f64) -> Interval {
    if s >= 0.0 { [a * s, b * s] } else { [b * s, a * s] }
}

fn sum(a: Interval, b: Interval) -> Interval {
    [a[0] + b[0], a[1] + b[1]]
}

/// `a` times anything in -k..=k.
fn swept(a: Interval, k: f64) -> Interval {
    let m = a[0].abs().max(a[1].abs()) * k;
    [-m, m]
}

/// Whether the window around a miter point is proved to hold only that miter point's branch. `null` is the unit
/// null direction at the miter point, `at` the second derivatives uu, uv, vv there and `first` the derivatives.
pub(crate) fn cross_cap(
    rect: &Rect,
    hull: &Hull,
    second: &SecondHull,
    null: DVec2,
    first: [DVec3; 2],
    at: [DVec3; 3],
) -> bool {
    let (e, x) = (null, null.perp());
    let s_x = first[0] * x.x + first[1] * x.y;
    let mix = |a: DVec2, b: DVec2| at[0] * (a.x * b.x) + at[1] * (a.x * b.y + a.y * b.x) + at[2] * (a.y * b.y);
    let frame = DMat3::from_cols(mix(x, e), mix(e, e), s_x);
    let determinant = frame.determinant();
    let volume = frame.x_axis.length() * frame.y_axis.length() * frame.z_axis.length();
    if determinant.is_nan() || determinant.abs() <= 1e-12 * volume || volume == 0.0 {
        return false;
    }
    let inverse = frame.inverse();
    // |k| <= bound, from the component of the mean of k S_x + S_y along S_x at m.
    let a = s_x / s_x.length_squared();
    let (au, av) = (range(a, &hull.du), range(a, &hull.dv));
    let ax = sum(scaled(au, x.x), scaled(av, x.y));
    let ae = sum(scaled(au, e.x), scaled(av, e.y));
    if ax[0].is_nan() || ax[0] <= 0.0 {
        return false;
    }
    let slope = ae[0].abs().max(ae[1].abs()) / ax[0];
    let size = rect.size();
    let reach = 0.5 * (size.x * e.x.abs() + size.y * e.y.abs());
    let mut error = [[0.0; 3]; 3];
    for i in 0..3 {
        let y = inverse.row(i);
        let [uu, uv, vv] = [0, 1, 2].map(|k| range(y, &second.0[k]));
        let (du, dv) = (range(y, &hull.du), range(y, &hull.dv));
        let mixed = |a: DVec2, b: DVec2| {
            sum(sum(scaled(uu, a.x * b.x), scaled(uv, a.x * b.y + a.y * b.x)), scaled(vv, a.y * b.y))
        };
        let (xx, xe, ee) = (mixed(x, x), mixed(x, e), mixed(e, e));
        let tilt = sum(swept(xx, slope), xe);
        let bend = reach * 0.25 * (tilt[1] - tilt[0]);
        let columns = [tilt, sum(swept(xe, slope), ee), sum(sum(scaled(du, x.x), scaled(dv, x.y)), [-bend, bend])];
        for (j, c) in columns.into_iter().enumerate() {
            let unit = if i == j { 1.0 } else { 0.0 };
            error[i][j] = (c[1] - unit).abs().max((c[0] - unit).abs());
        }
    }
    contracts(&error)
}

/// Whether a matrix of non-negative numbers has a spectral radius below 1: I - E is an M-matrix.
pub(crate) fn contracts(e: &[[f64; 3]; 3]) -> bool {
    let m = |i: usize, j: usize| if i == j { 1.0 - e[i][j] } else { -e[i][j] };
    let two = m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
    let three = m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0))
        + m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
    m(0, 0) > 0.0 && two > 0.0 && three > 0.0
}
