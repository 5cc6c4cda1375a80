//! The point of a surface nearest to a given one, and the point where a line meets a surface, from a start.
//!
//! Closest point: Newton on half the squared distance over the rectangle of the domain, with
//! Levenberg-Marquardt damping as the trust region. Where the Hessian is not positive definite, the Gauss-Newton
//! matrix takes its place, so every step goes down; damping is relative to its diagonal, so the parametrization's
//! scale does not matter. A parameter at its bound stays there while the gradient presses outwards; a closed
//! direction wraps around instead. At a pole (Su = 0) the damping alone keeps the step finite and the other
//! direction decides.
//!
//! Line: Newton on the two components across the line. Cost: a jet of order 2 (1) an iteration, usually 2-5.
//! Failure is in the result: `converged` for the foot, the remaining distance for the line. Both are local; for
//! global answers start from a tessellation ([`crate::kernel::mesh::surface_set`]).

use glam::{DMat2, DVec2, DVec3};

use super::{Surface, SurfaceJet};

/// The foot of a point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Its parameters.
    pub uv: DVec2,
    /// The point.
    pub point: DVec3,
    /// How far it is from the given point.
    pub distance: f64,
    /// Whether the tangential residual fell below the rounding of the evaluation; false at creases (C0 knots)
    /// and when the iterations ran out, where the foot is the best point met.
    pub converged: bool,
}

/// Where a line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFoot {
    /// The parameters of the point.
    pub uv: DVec2,
    /// The point on the surface.
    pub point: DVec3,
    /// Its place along the line: `origin + t * direction` is the nearest point of the line.
    pub t: f64,
    /// How far the point is from the line; about the rounding of an evaluation where they meet.
    pub residual: f64,
}

/// Which parameter directions run around without a seam.
pub type Closed = [bool; 2];

const MAX_ITERATIONS: usize = 50;

/// Which directions of a surface are closed: opposite borders coincide to 1e-9 of the size of the control net.
pub fn closed_directions(surface: &Surface) -> Closed {
    let [u, v] = surface.domain();
    let eps = 1e-9 * surface.bounds().diagonal();
    let coincide = |at: &dyn Fn(f64, f64) -> DVec2| {
        let mut apart = 0.0_f64;
        let meets = (0..=16).all(|i| {
            let s = f64::from(i) / 16.0;
            let (a, b) = (surface.eval(at(0.0, s)), surface.eval(at(1.0, s)));
            apart = apart.max(surface.eval(at(0.5, s)).distance(a));
            a.distance(b) <= eps
        });
        // A strip that collapses altogether is not closed, it is degenerate.
        meets && apart > eps
    };
    let place = |s: f64, t: f64| DVec2::new(u[0] + (u[1] - u[0]) * s, v[0] + (v[1] - v[0]) * t);
    [coincide(&|a, s| place(a, s)), coincide(&|a, s| place(s, a))]
}

/// Brings parameters back into the domain: around in closed directions, to the border in others.
pub(crate) fn into_domain(uv: DVec2, domain: [[f64; 2]; 2], closed: Closed) -> DVec2 {
    let mut uv = uv;
    for k in 0..2 {
        let [a, b] = domain[k];
        if closed[k] && !(a..=b).contains(&uv[k]) {
            uv[k] = a + (uv[k] - a).rem_euclid(b - a);
        }
        uv[k] = uv[k].clamp(a, b);
    }
    uv
}

/// The locally closest point to `p` from a start.
pub fn closest_from(surface: &Surface, closed: Closed, p: DVec3, start: DVec2) -> Foot {
    let domain = surface.domain();
    let mut uv = into_domain(start, domain, closed);
    let mut jet = surface.jet(uv, 2);
    let mut squared = jet.p().distance_squared(p);
    let mut damping = 0.0_f64;
    let mut converged = false;
    for _ in 0..MAX_ITERATIONS {
        let r = jet.p() - p;
        let gradient = DVec2::new(r.dot(jet.u()), r.dot(jet.v()));
        let free = [0, 1].map(|k| {
            closed[k] || !((uv[k] <= domain[k][0] && gradient[k] > 0.0) || (uv[k] >= domain[k][1] && gradient[k] < 0.0))
        });
        // The tangential residual as a length, against what an evaluation can resolve.
        let rounding = 8.0 * f64::EPSILON * (jet.p().abs().max_element() + p.abs().max_element() + r.length());
        let speed = [jet.u().length(), jet.v().length()];
        let residual = |k: usize| if speed[k] > 0.0 { gradient[k].abs() / speed[k] } else { 0.0 };
        if (0..2).all(|k| !free[k] || residual(k) <= rounding) {
            converged = true;
            break;
        }
        let step = bounded_step(&jet, r, gradient, free, uv, domain, closed, damping);
        let next = into_domain(uv + step, domain, closed);
        if next == uv {
            converged = damping == 0.0;
            break;
        }
        let candidate = surface.jet(next, 2);
        let new_squared = candidate.p().distance_squared(p);
        if new_squared < squared {
            (uv, jet, squared) = (next, candidate, new_squared);
            damping = if damping < 1e-5 { 0.0 } else { damping * 0.1 };
        } else if new_squared <= squared + rounding * (2.0 * r.length() + rounding) && damping <= 1e-2 {
            // Too close for the squared distance to tell: go on while the tangential residual still shrinks.
            let r = candidate.p() - p;
            let now = DVec2::new(r.dot(candidate.u()), r.dot(candidate.v()));
            if now.length_squared() > 0.25 * gradient.length_squared() {
                converged = true;
                break;
            }
            (uv, jet, squared) = (next, candidate, new_squared);
        } else {
            damping = (damping * 10.0).max(1e-3);
            if damping > 1e12 {
                break;
            }
        }
    }
    Foot { uv, point: jet.p(), distance: squared.sqrt(), converged }
}

/// The damped Newton step, with parameters that it would push over a bound held there.
#[allow(clippy::too_many_arguments)] // one formula, its pieces
fn bounded_step(
    jet: &SurfaceJet,
    r: DVec3,
    gradient: DVec2,
    free: [bool; 2],
    uv: DVec2,
    domain: [[f64; 2]; 2],
    closed: Closed,
    damping: f64,
) -> DVec2 {
    let (e, f, g) = (jet.u().length_squared(), jet.u().dot(jet.v()), jet.v().length_squared());
    let [suu, suv, svv] = jet.second().map(|d| d.dot(r));
    let newton = [e + suu, f + suv, g + svv];
    let definite = |[a, b, c]: [f64; 3]| a > 1e-3 * e && c > 1e-3 * g && a * c - b * b > 1e-6 * a * c;
    let [a, b, c] = if definite(newton) { newton } else { [e, f, g] };
    // A vanishing derivative (a pole) still gets something to divide by.
    let floor = 1e-14 * (e + g) + f64::MIN_POSITIVE;
    let (a, c) = (a + damping * e + floor, c + damping * g + floor);
    let one = |k: usize| -gradient[k] / if k == 0 { a } else { c };
    let solved = match free {
        [true, true] => {
            let determinant = a * c - b * b;
            if determinant > 1e-14 * a * c {
                DVec2::new(b * gradient.y - c * gradient.x, b * gradient.x - a * gradient.y) / determinant
            } else {
                DVec2::new(one(0), one(1))
            }
        }
        [true, false] => DVec2::new(one(0), 0.0),
        [false, true] => DVec2::new(0.0, one(1)),
        [false, false] => DVec2::ZERO,
    };
    // No step over more than half of the domain; one over a bound stops there and the other parameter is solved
    // again with it.
    let mut step = solved;
    for k in 0..2 {
        let half = 0.5 * (domain[k][1] - domain[k][0]);
        step[k] = step[k].clamp(-half, half);
        if !closed[k] {
            let bounded = step[k].clamp(domain[k][0] - uv[k], domain[k][1] - uv[k]);
            if bounded != step[k] && free[1 - k] {
                let other = 1 - k;
                step[other] = -(gradient[other] + b * bounded) / if other == 0 { a } else { c };
                let half = 0.5 * (domain[other][1] - domain[other][0]);
                step[other] = step[other].clamp(-half, half);
            }
            step[k] = bounded;
        }
    }
    step
}

/// The point where the line `origin + t * direction` meets the surface, from a start. Parameters stay in the
/// domain: past a border the residual says how far the line passes by.
pub fn line_from(surface: &Surface, closed: Closed, origin: DVec3, direction: DVec3, start: DVec2) -> LineFoot {
    let domain = surface.domain();
    let along = direction.normalize_or_zero();
    let (x, y) = along.any_orthonormal_pair();
    let across = |p: DVec3| DVec2::new((p - origin).dot(x), (p - origin).dot(y));
    let mut uv = into_domain(start, domain, closed);
    let mut jet = surface.jet(uv, 1);
    let mut miss = across(jet.p());
    let rounding = 4.0 * f64::EPSILON * (jet.p().abs().max_element() + origin.abs().max_element());
    let mut scale = 1.0;
    for _ in 0..MAX_ITERATIONS {
        if miss.length() <= rounding {
            break;
        }
        let matrix =
            DMat2::from_cols(DVec2::new(jet.u().dot(x), jet.u().dot(y)), DVec2::new(jet.v().dot(x), jet.v().dot(y)));
        let determinant = matrix.determinant();
        let size = matrix.x_axis.length() * matrix.y_axis.length();
        let step = if determinant.abs() > 1e-12 * size {
            matrix.inverse() * -miss
        } else {
            // The line is tangent: go down the gradient.
            let gradient = matrix.transpose() * miss;
            let curvature = (matrix * gradient).length_squared();
            if curvature > 0.0 { -gradient * (gradient.length_squared() / curvature) } else { break }
        };
        let mut step = step * scale;
        for k in 0..2 {
            // A component over a border stops there; the other one takes what is best with it.
            if !closed[k] {
                let bounded = step[k].clamp(domain[k][0] - uv[k], domain[k][1] - uv[k]);
                if bounded != step[k] {
                    let (own, other) =
                        if k == 0 { (matrix.x_axis, matrix.y_axis) } else { (matrix.y_axis, matrix.x_axis) };
                    let square = other.length_squared();
                    if square > 0.0 {
                        step[1 - k] = -other.dot(miss + own * bounded) / square;
                    }
                    step[k] = bounded;
                }
            }
        }
        let next = into_domain(uv + step, domain, closed);
        if next == uv {
            break;
        }
        let candidate = surface.jet(next, 1);
        let new_miss = across(candidate.p());
        if new_miss.length_squared() < miss.length_squared() {
            (uv, jet, miss) = (next, candidate, new_miss);
            scale = (2.0 * scale).min(1.0_f64);
        } else {
            scale *= 0.5;
            if scale < 1e-3 {
                break;
            }
        }
    }
    let length = direction.length();
    let t = if length > 0.0 { (jet.p() - origin).dot(along) / length } else { 0.0 };
    LineFoot { uv, point: jet.p(), t, residual: miss.length() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    /// The graph of a bicubic polynomial over [0, 1]^2 with one C2 knot line in each direction.
    fn wavy() -> Surface {
        let k = || Knots::clamped(3, &[0.0, 0.4, 1.0], 1).unwrap();
        let g = k().greville();
        let points = (0..25)
            .map(|at| {
                let (x, y) = (g[at % 5], g[at / 5]);
                DVec3::new(x, y, 0.3 * (3.0 * x).sin() * (2.0 * y).cos())
            })
            .collect();
        Surface::new(k(), k(), points, None).unwrap()
    }

    /// A dense search, refined again and again around its best point.
    fn slow_closest(s: &Surface, p: DVec3) -> f64 {
        let ([u, v], n) = (s.domain(), 40);
        let (mut low, mut high) = (DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
        let (outer_low, outer_high) = (low, high);
        let mut best = (f64::INFINITY, low);
        for _ in 0..24 {
            for i in 0..=n {
                for j in 0..=n {
                    let uv = low + (high - low) * DVec2::new(f64::from(i), f64::from(j)) / f64::from(n);
                    let d = s.eval(uv).distance(p);
                    if d < best.0 {
                        best = (d, uv);
                    }
                }
            }
            let reach = (high - low) * 0.27;
            (low, high) = ((best.1 - reach).max(outer_low), (best.1 + reach).min(outer_high));
        }
        best.0
    }

    #[test]
    fn feet_near_the_surface_are_the_global_ones() {
        let s = wavy();
        for (i, p) in
            [(0.3, 0.2, 0.1), (0.9, 0.95, 0.1), (1.3, 0.5, 0.0), (-0.2, -0.1, 0.1), (0.5, 1.2, -0.1)].iter().enumerate()
        {
            let p = DVec3::new(p.0, p.1, p.2);
            let foot = closest_from(&s, [false; 2], p, DVec2::new(p.x, p.y));
            assert!(foot.converged, "{i}");
            assert!((foot.distance - slow_closest(&s, p)).abs() < 1e-9, "{i}: {}", foot.distance);
        }
    }

    #[test]
    fn a_point_lifted_along_the_normal_comes_back_to_rounding() {
        let s = wavy();
        for i in 1..20 {
            for j in 1..20 {
                let uv = DVec2::new(f64::from(i) / 20.0, f64::from(j) / 20.0);
                let jet = s.jet(uv, 1);
                let p = jet.p() + jet.normal().unwrap() * 0.05;
                let foot = closest_from(&s, [false; 2], p, uv + DVec2::new(0.08, -0.06));
                assert!(foot.converged && foot.uv.distance(uv) < 1e-11, "{uv} {}", foot.uv);
                assert!((foot.distance - 0.05).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_triangle_shaped_patch_finds_feet_at_and_near_its_pole() {
        // u collapses at v = 1: S = ((1 - v) (2u - 1), v, (1 - v)^2 / 4).
        let ku = Knots::bezier(1, 0.0, 1.0).unwrap();
        let kv = Knots::bezier(2, 0.0, 1.0).unwrap();
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let points = vec![
            p(-1.0, 0.0, 0.25),
            p(1.0, 0.0, 0.25),
            p(-0.5, 0.5, 0.0),
            p(0.5, 0.5, 0.0),
            p(0.0, 1.0, 0.0),
            p(0.0, 1.0, 0.0),
        ];
        let s = Surface::new(ku, kv, points, None).unwrap();
        for q in [p(0.0, 1.5, 0.1), p(0.01, 0.99, 0.2), p(0.3, 0.9, 0.0), p(0.0, 1.0, 0.0)] {
            let foot = closest_from(&s, [false; 2], q, DVec2::new(0.5, 0.7));
            assert!((foot.distance - slow_closest(&s, q)).abs() < 1e-7, "{q}: {}", foot.distance);
        }
        let from_pole = closest_from(&s, [false; 2], p(0.3, 0.5, 0.1), DVec2::new(0.0, 1.0));
        assert!((from_pole.distance - slow_closest(&s, p(0.3, 0.5, 0.1))).abs() < 1e-7);
    }

    #[test]
    fn a_closed_direction_is_walked_around() {
        // A square tube, C0 in u, closed.
        let ku = Knots::clamped(1, &[0.0, 1.0, 2.0, 3.0, 4.0], 1).unwrap();
        let kv = Knots::bezier(1, 0.0, 1.0).unwrap();
        let ring = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)];
        let points = [0.0, 1.0].iter().flat_map(|&z| ring.map(|(x, y)| DVec3::new(x, y, z))).collect();
        let s = Surface::new(ku, kv, points, None).unwrap();
        assert_eq!(closed_directions(&s), [true, false]);
        let q = DVec3::new(0.7, -0.4, 0.5); // its foot is near u = 4, the start just behind the seam
        let foot = closest_from(&s, [true, false], q, DVec2::new(0.01, 0.5));
        assert!((foot.distance - 0.1 / 2f64.sqrt()).abs() < 1e-12 && foot.uv.x > 3.0, "{foot:?}");
    }

    #[test]
    fn lines_meet_the_surface_or_say_by_how_much_they_miss() {
        let s = wavy();
        let target = s.eval(DVec2::new(0.37, 0.61));
        let direction = DVec3::new(0.3, -0.2, 2.0);
        let foot = line_from(&s, [false; 2], target - direction * 0.7, direction, DVec2::new(0.5, 0.5));
        assert!(foot.residual < 1e-15 && (foot.t - 0.7).abs() < 1e-13, "{foot:?}");
        assert!(foot.uv.distance(DVec2::new(0.37, 0.61)) < 1e-13);
        let beside = line_from(&s, [false; 2], DVec3::new(1.25, 0.5, -1.0), DVec3::Z, DVec2::new(0.8, 0.4));
        assert!((beside.residual - 0.25).abs() < 1e-9 && beside.uv.x == 1.0, "{beside:?}");
    }
}
