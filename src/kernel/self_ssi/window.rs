//! Proofs about a window: a rectangle of the domain against itself.
//!
//! *Injective.* A Gauss map inside an open hemisphere gives local injectivity only. Sufficient on a convex domain is a
//! pair of vectors P = (p, q) for which the quadratic form x -> (P x) . (dS x) is positive definite everywhere: for two
//! points that differ by x, the derivative of S along the segment between them then has a positive product with P x.
//! That form is linear in dS = (Su, Sv), so it is enough that it is positive definite at the points of a hull of
//! dS; P is sought by perceptron steps on the worst hull point. (With p . Sv = q . Su = 0 in the middle this is
//! min(p.Su) min(q.Sv) > max|p.Sv + q.Su|^2 / 4, only sharper.)
//!
//! *Beside a pole*, where Su = t X with t the distance from the collapsed side, take P x = (mean of t) du p + dv q: the
//! product with the mean derivative is the same form in ((mean of t) du, dv), with X weighted by t in place of Su, so
//! that the test on all pairs of hull points of X and Sv proves that two points coincide in the pole only.
//!
//! *Cross-cap.* Near a generic miter point m with null direction e, points that coincide are m' +- r (k, 1) in the
//! frame (e', e), e' perpendicular to e, with zeros of the mean of k S_x + S_y along the segment. Where the Jacobian of
//! that mean by (m', k), preconditioned by its value at m, is regular over the window, every r has at most one
//! solution: the window contains no miter point but m, and no self-intersection but the branch through m, other than
//! branches that cross its border.

use glam::{DMat2, DMat3, DVec2, DVec3};

use super::hull::Rect;
use super::jets::Jets;

/// How many directions P are tried.
const TRIES: usize = 24;

/// Whether the surface is proved injective over a window in which its derivatives stay in the hull of these.
pub(crate) fn injective(frames: &[[DVec3; 2]]) -> bool {
    if frames.is_empty() {
        return false;
    }
    // Measure the domain so that dS has unit second moments: null directions count as much as others.
    let (mut e, mut f, mut g) = (0.0, 0.0, 0.0);
    for [u, v] in frames {
        e += u.length_squared();
        f += u.dot(*v);
        g += v.length_squared();
    }
    let n = frames.len() as f64;
    let (e, f, g) = (e / n, f / n, g / n);
    let det = e * g - f * f;
    if det.is_nan() || e <= 0.0 || det <= 1e-20 * e * g {
        return false;
    }
    // Inverse of the Cholesky factor: (Su, Sv) -> (Su / l, (Sv - m Su) / k).
    let (l, m) = (e.sqrt(), f / e);
    let k = (det / e).sqrt();
    let white: Vec<[DVec3; 2]> = frames.iter().map(|[u, v]| [*u / l, (*v - *u * m) / k]).collect();
    let mut p = [DVec3::ZERO; 2];
    for [u, v] in &white {
        p = [p[0] + *u / n, p[1] + *v / n];
    }
    for _ in 0..TRIES {
        // The smallest eigenvalue of the form over all points, and where it is.
        let (mut worst, mut at, mut x) = (f64::INFINITY, 0, DVec2::X);
        for (i, [u, v]) in white.iter().enumerate() {
            let (a, b, c) = (p[0].dot(*u), 0.5 * (p[0].dot(*v) + p[1].dot(*u)), p[1].dot(*v));
            let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
            let root = half.hypot(b);
            if mean - root < worst {
                (worst, at) = (mean - root, i);
                // (b, -half - root) and (half - root, b) both span the eigenspace; the longer is accurate.
                let (y, z) = (DVec2::new(b, -half - root), DVec2::new(half - root, b));
                x = if y.length_squared() > z.length_squared() { y } else { z };
            }
        }
        let size = p[0].length() + p[1].length();
        if worst > 1e-11 * size {
            return true;
        }
        let x = if x == DVec2::ZERO { DVec2::X } else { x.normalize() };
        let d = white[at][0] * x.x + white[at][1] * x.y;
        let squared = d.length_squared();
        if squared.is_nan() || squared <= 1e-28 {
            return false;
        }
        let step = (0.05 * squared.sqrt() * size.max(1e-3) - worst) / squared;
        p = [p[0] + d * (step * x.x), p[1] + d * (step * x.y)];
    }
    false
}

type Interval = [f64; 2];

/// The sum of two intervals.
pub(crate) fn add(a: Interval, b: Interval) -> Interval {
    [a[0] + b[0], a[1] + b[1]]
}

/// `a` times anything in -k..=k.
pub(crate) fn swept(a: Interval, k: f64) -> Interval {
    let m = a[0].abs().max(a[1].abs()) * k;
    [-m, m]
}

/// Whether the window around a miter point is proved to hold only that miter point's branch. `null` is the unit
/// null direction at the miter point, `first` and `second` the derivatives (u, v and uu, uv, vv) there.
pub(crate) fn cross_cap(rect: &Rect, jets: &Jets, null: DVec2, first: [DVec3; 2], second: [DVec3; 3]) -> bool {
    let (e, x) = (null, null.perp());
    let s_x = first[0] * x.x + first[1] * x.y;
    let pair = |a: DVec2, b: DVec2| [a.x * b.x, a.x * b.y + a.y * b.x, a.y * b.y];
    let mix = |a: DVec2, b: DVec2| {
        let c = pair(a, b);
        second[0] * c[0] + second[1] * c[1] + second[2] * c[2]
    };
    let frame = DMat3::from_cols(mix(x, e), mix(e, e), s_x);
    let determinant = frame.determinant();
    let volume = frame.x_axis.length() * frame.y_axis.length() * frame.z_axis.length();
    if determinant.is_nan() || determinant.abs() <= 1e-12 * volume || volume == 0.0 {
        return false;
    }
    let inverse = frame.inverse();
    // |k| <= slope, from the component of the mean of k S_x + S_y along S_x at m.
    let a = s_x / s_x.length_squared();
    let along = jets.range(a, [x.x, x.y, 0.0, 0.0, 0.0]);
    let across = jets.range(a, [e.x, e.y, 0.0, 0.0, 0.0]);
    if along[0].is_nan() || along[0] <= 0.0 {
        return false;
    }
    let slope = across[0].abs().max(across[1].abs()) / along[0];
    let size = rect.size();
    let reach = 0.5 * (size.x * e.x.abs() + size.y * e.y.abs());
    let mut error = [[0.0; 3]; 3];
    for (i, row) in error.iter_mut().enumerate() {
        let y = inverse.row(i);
        let twice = |a: DVec2, b: DVec2| {
            let c = pair(a, b);
            jets.range(y, [0.0, 0.0, c[0], c[1], c[2]])
        };
        let (xx, xe, ee) = (twice(x, x), twice(x, e), twice(e, e));
        let tilt = add(swept(xx, slope), xe);
        let bend = reach * 0.25 * (tilt[1] - tilt[0]);
        let columns = [tilt, add(swept(xe, slope), ee), add(jets.range(y, [x.x, x.y, 0.0, 0.0, 0.0]), [-bend, bend])];
        for (j, c) in columns.into_iter().enumerate() {
            let unit = if i == j { 1.0 } else { 0.0 };
            row[j] = (c[1] - unit).abs().max((c[0] - unit).abs());
        }
    }
    contracts(&error)
}

/// Whether a matrix of non-negative numbers has a spectral radius below 1: I - E is an M-matrix.
pub(crate) fn contracts(e: &[[f64; 3]; 3]) -> bool {
    let m = |i: usize, j: usize| if i == j { 1.0 - e[i][j] } else { -e[i][j] };
    let two = DMat2::from_cols_array(&[m(0, 0), m(1, 0), m(0, 1), m(1, 1)]).determinant();
    let rows = [0, 1, 2].map(|i| DVec3::new(m(i, 0), m(i, 1), m(i, 2)));
    m(0, 0) > 0.0 && two > 0.0 && rows[0].dot(rows[1].cross(rows[2])) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_turn_by_less_than_half_are_injective() {
        let turned =
            |angle: f64| [DVec3::new(angle.cos(), angle.sin(), 0.0), DVec3::new(-angle.sin(), angle.cos(), 0.0)];
        assert!(injective(&[turned(-0.7), turned(0.0), turned(0.7)]));
        // Sv changes sign: a fold.
        assert!(!injective(&[[DVec3::X, DVec3::Y], [DVec3::X, -DVec3::Y]]));
        // Sv turns by almost 180 degrees around u: a sharp crease that is injective all the same.
        let crease = |angle: f64| [DVec3::X, DVec3::new(0.0, angle.cos(), angle.sin())];
        assert!(injective(&[crease(0.0), crease(1.5), crease(3.0)]));
    }

    #[test]
    fn matrices_contract_up_to_a_spectral_radius_of_one() {
        assert!(contracts(&[[0.3, 100.0, 0.0], [1e-4, 0.3, 0.0], [0.0, 0.0, 0.9]]));
        assert!(!contracts(&[[0.5, 0.6, 0.0], [0.6, 0.5, 0.0], [0.0, 0.0, 0.0]]));
    }
}
