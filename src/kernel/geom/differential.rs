//! Differential geometry of surfaces: fundamental forms, principal curvatures and directions, and the normal
//! where Su x Sv vanishes.
//!
//! From "Freeform SSI and self-intersection with a hybrid BVH" (thesis), chapter 2.1, equations (2.3)-(2.12);
//! (2.12) is printed with the wrong denominator, it divides by E G - F^2. Curvature is positive where the surface
//! bends towards its normal Su x Sv.
//!
//! The principal curvatures are the eigenvalues of the second form in an orthonormal tangent frame, a symmetric
//! 2 x 2 matrix. That needs no root of H^2 - K, which loses half of the digits near umbilics, and the directions
//! are orthonormal everywhere; at an umbilic they are simply those of the frame (e1 along Su).

use glam::{DVec2, DVec3};

use super::{Surface, SurfaceJet};

/// The first and second fundamental forms at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FundamentalForms {
    /// E, F, G: Su.Su, Su.Sv, Sv.Sv.
    pub first: [f64; 3],
    /// e, f, g: Suu.N, Suv.N, Svv.N.
    pub second: [f64; 3],
    /// The unit normal that the second form refers to.
    pub normal: DVec3,
}

impl FundamentalForms {
    /// From a jet of order 2; `None` where there is no normal.
    pub fn of(jet: &SurfaceJet) -> Option<Self> {
        let normal = jet.normal()?;
        let (u, v) = (jet.u(), jet.v());
        Some(Self { first: [u.dot(u), u.dot(v), v.dot(v)], second: jet.second().map(|d| d.dot(normal)), normal })
    }

    /// E G - F^2, the squared length of Su x Sv.
    pub fn area_squared(&self) -> f64 {
        self.first[0] * self.first[2] - self.first[1] * self.first[1]
    }

    /// The normal curvature in the direction a Su + b Sv.
    pub fn normal_curvature(&self, a: f64, b: f64) -> f64 {
        let form = |[p, q, r]: [f64; 3]| p * a * a + 2.0 * q * a * b + r * b * b;
        form(self.second) / form(self.first)
    }
}

/// The principal curvatures and directions at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// The unit normal.
    pub normal: DVec3,
    /// The larger and the smaller principal curvature.
    pub k: [f64; 2],
    /// Their unit directions; `e[0]`, `e[1]`, `normal` are a right-handed orthonormal frame.
    pub e: [DVec3; 2],
}

impl Curvature {
    /// From a jet of order 2; `None` where there is no normal.
    pub fn of(jet: &SurfaceJet) -> Option<Self> {
        let normal = jet.normal()?;
        let (u, v) = (jet.u(), jet.v());
        let length = u.length();
        let t1 = u / length;
        let t2 = normal.cross(t1);
        // (Su, Sv) = (t1, t2) R with R = [[length, along], [0, across]]; the shape operator is R^-T II R^-1.
        let (along, across) = (v.dot(t1), v.dot(t2));
        let [e, f, g] = jet.second().map(|d| d.dot(normal));
        let p = e / (length * length);
        let q = (f / length - p * along) / across;
        let r = (g - along * (2.0 * f / length - p * along)) / (across * across);
        let (half, mean) = (0.5 * (p - r), 0.5 * (p + r));
        let radius = half.hypot(q);
        let (sin, cos) = (0.5 * q.atan2(half)).sin_cos();
        let e1 = t1 * cos + t2 * sin;
        Some(Self { normal, k: [mean + radius, mean - radius], e: [e1, normal.cross(e1)] })
    }

    /// The Gaussian curvature.
    pub fn gaussian(&self) -> f64 {
        self.k[0] * self.k[1]
    }

    /// The mean curvature.
    pub fn mean(&self) -> f64 {
        0.5 * (self.k[0] + self.k[1])
    }

    /// The normal curvature in a tangent direction (of any length).
    pub fn normal_curvature(&self, direction: DVec3) -> f64 {
        let (a, b) = (direction.dot(self.e[0]), direction.dot(self.e[1]));
        (self.k[0] * a * a + self.k[1] * b * b) / (a * a + b * b)
    }
}

/// The unit normal at `uv`. Where Su x Sv vanishes on the border (a pole, a collapsed edge) it is the limit along
/// the way into the domain; `None` where that vanishes to second order too, or inside the domain (a cusp has two).
pub fn unit_normal(surface: &Surface, uv: DVec2) -> Option<DVec3> {
    let jet = surface.jet(uv, 3);
    let [u, v] = surface.domain();
    // A derivative that vanishes evaluates to rounding: small beside what it changes by across the domain.
    let (du, dv) = (u[1] - u[0], v[1] - v[0]);
    let vanishes = |k: usize, l: usize| {
        let change = jet.d[k + 1][l].length() * du + jet.d[k][l + 1].length() * dv;
        jet.d[k][l].length() <= 1e-12 * change
    };
    if let Some(normal) = jet.normal().filter(|_| !vanishes(1, 0) && !vanishes(0, 1)) {
        return Some(normal);
    }
    let inward = |t: f64, [low, high]: [f64; 2]| {
        let away = 1e-9 * (high - low);
        if t - low <= away {
            high - low
        } else if high - t <= away {
            low - high
        } else {
            0.0
        }
    };
    let way = DVec2::new(inward(uv.x, u), inward(uv.y, v));
    if way == DVec2::ZERO {
        return None;
    }
    // Derivatives of Su and Sv along the way, then Leibniz for their cross product.
    let (x, y) = (way.x, way.y);
    let along = |k: usize, l: usize, order: usize| match order {
        0 => jet.d[k][l],
        1 => jet.d[k + 1][l] * x + jet.d[k][l + 1] * y,
        _ => jet.d[k + 2][l] * (x * x) + jet.d[k + 1][l + 1] * (2.0 * x * y) + jet.d[k][l + 2] * (y * y),
    };
    let su = [0, 1, 2].map(|order| along(1, 0, order));
    let sv = [0, 1, 2].map(|order| along(0, 1, order));
    let size = |d: [DVec3; 3]| d.iter().map(|d| d.length()).fold(0.0, f64::max);
    let scale = size(su) * size(sv);
    let first = su[1].cross(sv[0]) + su[0].cross(sv[1]);
    if first.length() > 1e-10 * scale {
        return Some(first.normalize());
    }
    let second = su[2].cross(sv[0]) + 2.0 * su[1].cross(sv[1]) + su[0].cross(sv[2]);
    (second.length() > 1e-10 * scale).then(|| second.normalize())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_1_SQRT_2;

    use super::super::Knots;
    use super::*;

    /// The quarter turn about the z axis of a profile (radius, height, weight) in the half plane.
    fn revolved(profile: &[(f64, f64, f64)]) -> Surface {
        let quarter = [(1.0, 0.0, 1.0), (1.0, 1.0, FRAC_1_SQRT_2), (0.0, 1.0, 1.0)];
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for &(radius, height, w) in profile {
            for (x, y, wq) in quarter {
                points.push(DVec3::new(radius * x, radius * y, height));
                weights.push(w * wq);
            }
        }
        let v = Knots::bezier(profile.len() - 1, 0.0, 1.0).unwrap();
        Surface::new(Knots::bezier(2, 0.0, 1.0).unwrap(), v, points, Some(weights)).unwrap()
    }

    fn grid() -> impl Iterator<Item = DVec2> {
        (1..8).flat_map(|i| (1..8).map(move |j| DVec2::new(f64::from(i) / 8.0, f64::from(j) / 8.0)))
    }

    #[test]
    fn a_sphere_is_umbilic_everywhere() {
        let s = revolved(&[(3.0, 0.0, 1.0), (3.0, 3.0, FRAC_1_SQRT_2), (0.0, 3.0, 1.0)]);
        for uv in grid() {
            let jet = s.jet(uv, 2);
            let c = Curvature::of(&jet).unwrap();
            assert!(c.normal.distance(jet.p() / 3.0) < 1e-14);
            for k in c.k {
                assert!((k + 1.0 / 3.0).abs() < 1e-13);
            }
            assert!(c.e[0].dot(c.e[1]).abs() < 1e-14 && c.e[0].cross(c.e[1]).distance(c.normal) < 1e-14);
        }
    }

    #[test]
    fn the_pole_of_a_sphere_has_its_limit_normal() {
        let s = revolved(&[(3.0, 0.0, 1.0), (3.0, 3.0, FRAC_1_SQRT_2), (0.0, 3.0, 1.0)]);
        for u in [0.0, 0.2, 0.5, 1.0] {
            assert!(unit_normal(&s, DVec2::new(u, 1.0)).unwrap().distance(DVec3::Z) < 1e-13);
        }
    }

    #[test]
    fn torus_curvatures_follow_the_closed_form() {
        // Tube radius 1 around a spine of radius 3, the outer quarter: 1/r and cos(v) / (R + r cos(v)).
        let s = revolved(&[(4.0, 0.0, 1.0), (4.0, 1.0, FRAC_1_SQRT_2), (3.0, 1.0, 1.0)]);
        for uv in grid() {
            let jet = s.jet(uv, 2);
            let c = Curvature::of(&jet).unwrap();
            let rho = jet.p().truncate().length();
            let expected = [-(rho - 3.0) / rho, -1.0];
            assert!((c.k[0] - expected[0]).abs() < 1e-12 && (c.k[1] - expected[1]).abs() < 1e-12);
            // The parallel is the direction of the smaller absolute curvature.
            assert!(c.e[0].z.abs() < 1e-12);
            let forms = FundamentalForms::of(&jet).unwrap();
            let [e, f, g] = forms.second;
            assert!((c.gaussian() - (e * g - f * f) / forms.area_squared()).abs() < 1e-12);
            let direction = jet.u() * 0.3 - jet.v() * 0.7;
            assert!((c.normal_curvature(direction) - forms.normal_curvature(0.3, -0.7)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_skewed_parameter_grid_does_not_change_curvature() {
        // z = x^2 - x y + 2 y^2 over a sheared, stretched grid: at the origin k are the eigenvalues of its Hessian.
        let shear = |s: f64, t: f64| (1e3 * s + 40.0 * t, 3.0 * t);
        let height = |x: f64, y: f64| x * x - x * y + 2.0 * y * y;
        let jet = |s: f64, t: f64| {
            let (x, y) = shear(s, t);
            DVec3::new(x, y, height(x, y))
        };
        let mut at = SurfaceJet::default();
        at.d[1][0] = jet(1.0, 0.0) - DVec3::Z * jet(1.0, 0.0).z;
        at.d[0][1] = jet(0.0, 1.0) - DVec3::Z * jet(0.0, 1.0).z;
        at.d[2][0] = DVec3::Z * (2.0 * jet(1.0, 0.0).z);
        at.d[0][2] = DVec3::Z * (2.0 * jet(0.0, 1.0).z);
        at.d[1][1] = DVec3::Z * (jet(1.0, 1.0).z - jet(1.0, 0.0).z - jet(0.0, 1.0).z);
        let c = Curvature::of(&at).unwrap();
        let root = 2.0_f64.sqrt();
        assert!((c.k[0] - (3.0 + root)).abs() < 1e-9 && (c.k[1] - (3.0 - root)).abs() < 1e-9);
    }

    #[test]
    fn near_an_umbilic_curvatures_keep_their_digits_and_directions_their_frame() {
        // z = (a x^2 + b y^2) / 2 turned by an angle, with b - a from 1 down to 0: at the origin k are a and b.
        for split in [1.0, 1e-4, 1e-8, 1e-12, 1e-15, 0.0] {
            for turn in [0.0_f64, 0.3, 1.1, 2.6] {
                let (a, b) = (0.7, 0.7 + split);
                let (sin, cos) = turn.sin_cos();
                let mut jet = SurfaceJet::default();
                (jet.d[1][0], jet.d[0][1]) = (DVec3::X, DVec3::Y);
                jet.d[2][0] = DVec3::Z * (a * cos * cos + b * sin * sin);
                jet.d[1][1] = DVec3::Z * ((b - a) * sin * cos);
                jet.d[0][2] = DVec3::Z * (a * sin * sin + b * cos * cos);
                let c = Curvature::of(&jet).unwrap();
                // The root of H^2 - K would lose half of the digits: 1e-8.
                assert!((c.k[0] - b).abs() < 1e-15 && (c.k[1] - a).abs() < 1e-15, "{split} {turn}: {:?}", c.k);
                assert!(c.e[0].dot(c.e[1]).abs() < 1e-15 && c.e[0].cross(c.e[1]).distance(c.normal) < 1e-15);
                if split >= 1e-8 {
                    let along = DVec3::new(sin, cos, 0.0);
                    assert!(c.e[0].cross(along).length() < 1e-14 / split, "{split} {turn}");
                }
            }
        }
    }

    #[test]
    fn a_cusp_inside_the_domain_has_no_normal() {
        // (u^2, u^3, v): Su vanishes along u = 0, and the normal turns over there.
        let k = |degree| Knots::bezier(degree, -1.0, 1.0).unwrap();
        let row = [(1.0, -1.0), (-1.0 / 3.0, 1.0), (-1.0 / 3.0, -1.0), (1.0, 1.0)];
        let points = [-1.0, 1.0].iter().flat_map(|&v| row.map(|(x, y)| DVec3::new(x, y, v))).collect();
        let s = Surface::new(k(3), k(1), points, None).unwrap();
        assert!(s.eval(DVec2::new(0.5, 0.0)).distance(DVec3::new(0.25, 0.125, 0.0)) < 1e-14);
        assert_eq!(unit_normal(&s, DVec2::new(0.0, 0.3)), None);
    }
}
