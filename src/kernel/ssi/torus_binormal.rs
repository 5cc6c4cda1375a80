//! Binormals of two tori: the lines that meet both at right angles (thesis 5.3, a polynomial of degree 8).
//!
//! Every normal of a torus meets its spine circle at a right angle, so that the binormals of two tori are the common
//! normals of two circles (Neff, "Finding the distance between two circles in three-dimensional space", IBM J. Res. Dev. 34
//! (1990); the thesis cites the same polynomial). In the plane of the first circle a point Q = C2(phi) of the second has
//! its nearest and its farthest point of the first circle in the direction of its projection, at distance rho from the
//! centre, and the squared distance |Q|^2 + R1^2 -+ 2 R1 rho is critical where
//!
//! ```text
//! F(phi) = ((|Q|^2)')^2 rho^2 - R1^2 ((rho^2)')^2 = 0,
//! ```
//!
//! a trigonometric polynomial of degree 4. It is written in t = tan((phi - phi_k) / 2) over four quarter turns, where t
//! stays below tan(pi / 8): degree 8 in Bernstein form, whose sign variations isolate all roots. Limits get their own
//! cases: a circle through infinity is the axis of a cylinder, a plane has normals of one direction; where the lines
//! form a family (coaxial circles, parallel axes, parallel planes) the answer says so and lists none.
//!
//! The engine decides nothing by them: a torus is a second-order copy, and [`super::contact`] excludes by the exact gap.
//! They are starting points: for contacts that Newton's method misses from the gap's own critical point, and for the
//! binormal near a picked point. Cost: about 10 us for two circles.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use super::bernstein::{chebyshev_node, roots, to_bernstein};
use crate::kernel::bvh::OsculatingTorus;

/// What all normals of a torus or of one of its limits meet at a right angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spine {
    /// The spine circle of a torus.
    Circle {
        /// Its centre.
        center: DVec3,
        /// Two orthogonal unit vectors in its plane.
        axes: [DVec3; 2],
        /// Its radius.
        radius: f64,
    },
    /// The axis of a cylinder.
    Line {
        /// A point of it.
        point: DVec3,
        /// Its unit direction.
        direction: DVec3,
    },
    /// A plane: all normals have one direction.
    Plane {
        /// A point of the plane.
        point: DVec3,
        /// Its unit normal.
        normal: DVec3,
    },
}

/// A line that meets both tori at right angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommonNormal {
    /// Its points on the two spines; on a plane the foot of the other.
    pub on: [DVec3; 2],
    /// Its unit direction.
    pub direction: DVec3,
}

/// The binormals of two tori.
#[derive(Clone, Debug, PartialEq)]
pub enum CommonNormals {
    /// All of them, at most eight.
    Isolated(Vec<CommonNormal>),
    /// A whole family.
    Continuum,
}

/// A curvature times the size below which a circle is taken for a line.
const FLAT: f64 = 1e-7;
/// Rounding of a polynomial whose largest value is 1.
const NOISE: f64 = 1e-13;

impl Spine {
    /// That of an osculating torus; curvatures of less than `FLAT / size` are none.
    pub fn of(torus: &OsculatingTorus, size: f64) -> Self {
        let [tube, turn] = torus.k;
        let flat = |k: f64| k.abs() * size < FLAT;
        match (flat(tube), flat(turn)) {
            (true, true) => Self::Plane { point: torus.point, normal: torus.normal },
            (true, false) => Self::Line { point: torus.point + torus.normal / turn, direction: torus.e[0] },
            (false, true) => Self::Line { point: torus.point + torus.normal / tube, direction: torus.e[1] },
            (false, false) => Self::Circle {
                center: torus.point + torus.normal / turn,
                axes: [torus.e[1], torus.normal],
                radius: (1.0 / turn - 1.0 / tube).abs(),
            },
        }
    }
}

/// The lines that meet both spines at right angles.
pub fn common_normals(a: &Spine, b: &Spine) -> CommonNormals {
    match (*a, *b) {
        (Spine::Circle { .. }, Spine::Circle { .. }) => circles(a, b),
        (Spine::Circle { .. }, Spine::Line { point, direction }) => circle_line(a, point, direction),
        (Spine::Circle { .. }, Spine::Plane { point, normal }) => circle_plane(a, point, normal),
        (Spine::Line { point: p, direction: d }, Spine::Line { point: q, direction: e }) => lines(p, d, q, e),
        (Spine::Line { direction, .. }, Spine::Plane { normal, .. }) => family(direction.dot(normal).abs() < 1e-12),
        (Spine::Plane { normal: m, .. }, Spine::Plane { normal: n, .. }) => family(m.cross(n).length() < 1e-12),
        _ => match common_normals(b, a) {
            CommonNormals::Isolated(list) => CommonNormals::Isolated(
                list.into_iter().map(|c| CommonNormal { on: [c.on[1], c.on[0]], direction: -c.direction }).collect(),
            ),
            CommonNormals::Continuum => CommonNormals::Continuum,
        },
    }
}

/// All or none.
fn family(all: bool) -> CommonNormals {
    if all { CommonNormals::Continuum } else { CommonNormals::Isolated(Vec::new()) }
}

/// A spine circle about the origin of its own plane, in units of the larger of both circles.
#[derive(Clone, Copy)]
struct Ring {
    center: DVec3,
    axes: [DVec3; 2],
    radius: f64,
}

impl Ring {
    fn of(spine: &Spine) -> Option<Self> {
        match *spine {
            Spine::Circle { center, axes, radius } => Some(Self { center, axes, radius }),
            _ => None,
        }
    }

    fn outward(&self, angle: f64) -> DVec3 {
        let e = DVec2::from_angle(angle);
        self.axes[0] * e.x + self.axes[1] * e.y
    }

    fn point(&self, angle: f64) -> DVec3 {
        self.center + self.outward(angle) * self.radius
    }

    fn derivative(&self, angle: f64) -> DVec3 {
        self.outward(angle + FRAC_PI_2) * self.radius
    }

    /// The angle in which a point lies, and its distance from the axis.
    fn seen(&self, p: DVec3) -> (f64, f64) {
        let d = p - self.center;
        let flat = DVec2::new(d.dot(self.axes[0]), d.dot(self.axes[1]));
        (flat.to_angle(), flat.length())
    }
}

/// All angles at which a trigonometric polynomial of degree `n <= 4` vanishes; `None` when it does everywhere.
fn zeros(n: usize, f: impl Fn(f64) -> f64) -> Option<Vec<f64>> {
    let most = (0..16).map(|k| f(f64::from(k) * 0.39).abs()).fold(0.0, f64::max);
    if !(most > 0.0) {
        return None;
    }
    let reach = (FRAC_PI_2 / 4.0).tan();
    let mut out = Vec::new();
    for quarter in 0..4 {
        let middle = f64::from(quarter) * FRAC_PI_2;
        let values: Vec<f64> = (0..=2 * n)
            .map(|i| {
                let t = reach * (2.0 * chebyshev_node(2 * n, i) - 1.0);
                f(middle + 2.0 * t.atan()) / most * (1.0 + t * t).powi(n as i32)
            })
            .collect();
        let found = roots(&to_bernstein([2 * n, 0], &values), NOISE);
        out.extend(found.iter().map(|x| middle + 2.0 * (reach * (2.0 * x - 1.0)).atan()));
    }
    Some(out)
}

fn circles(a: &Spine, b: &Spine) -> CommonNormals {
    let (Some(a), Some(b)) = (Ring::of(a), Ring::of(b)) else { return CommonNormals::Isolated(Vec::new()) };
    let size = a.radius.max(b.radius).max(a.center.distance(b.center));
    if !(size > 0.0 && size.is_finite()) {
        return CommonNormals::Continuum;
    }
    let scaled = |r: Ring| Ring { center: (r.center - a.center) / size, radius: r.radius / size, ..r };
    let (first, second) = (scaled(a), scaled(b));
    let parts = |angle: f64| {
        let (q, dq) = (second.point(angle), second.derivative(angle));
        let flat = |v: DVec3| DVec2::new(v.dot(first.axes[0]), v.dot(first.axes[1]));
        let (f, df) = (flat(q), flat(dq));
        (2.0 * q.dot(dq), f.length_squared(), 2.0 * f.dot(df))
    };
    let function = |angle: f64| {
        let (s, rho2, slope) = parts(angle);
        s * s * rho2 - first.radius * first.radius * slope * slope
    };
    // Coaxial circles: both derivatives vanish everywhere.
    let flat = (0..16).all(|k| {
        let (s, _, slope) = parts(f64::from(k) * 0.39);
        s.abs() < 1e-12 && slope.abs() < 1e-12
    });
    let Some(angles) = (if flat { None } else { zeros(4, function) }) else { return CommonNormals::Continuum };
    let mut out: Vec<CommonNormal> = Vec::new();
    for phi in angles {
        let (theta, rho) = first.seen(second.point(phi));
        let mut starts = vec![theta, theta + 2.0 * FRAC_PI_2];
        if rho < 1e-4 {
            // On the axis of the first circle its whole circle is equally far: the second condition decides.
            starts.extend([theta + FRAC_PI_2, theta - FRAC_PI_2]);
        }
        for start in starts {
            let Some([theta, phi]) = settled(&first, &second, [start, phi]) else { continue };
            let on = [a.point(theta), b.point(phi)];
            let across = (on[1] - on[0]).try_normalize();
            // Circles that meet have the common perpendicular of their tangents.
            let tangents = first.derivative(theta).cross(second.derivative(phi));
            let far = on[0].distance(on[1]) > 1e-9 * size;
            let Some(direction) = across.filter(|_| far).or_else(|| tangents.try_normalize()) else { continue };
            let known =
                |c: &CommonNormal| c.on[0].distance(on[0]) < 1e-7 * size && c.on[1].distance(on[1]) < 1e-7 * size;
            if !out.iter().any(known) {
                out.push(CommonNormal { on, direction });
            }
        }
    }
    CommonNormals::Isolated(out)
}

/// The critical point of the squared distance near two angles, by Newton's method; `None` when there is none near.
fn settled(a: &Ring, b: &Ring, start: [f64; 2]) -> Option<[f64; 2]> {
    let [mut theta, mut phi] = start;
    for _ in 0..30 {
        let (p, dp) = (a.point(theta), a.derivative(theta));
        let (q, dq) = (b.point(phi), b.derivative(phi));
        let d = p - q;
        let gradient = DVec2::new(d.dot(dp), -d.dot(dq));
        let (ddp, ddq) = (a.center - p, b.center - q);
        let (aa, ab, bb) = (dp.dot(dp) + d.dot(ddp), -dp.dot(dq), dq.dot(dq) - d.dot(ddq));
        let det = aa * bb - ab * ab;
        if gradient.length() < 1e-15 {
            break;
        }
        if !(det.abs() > 1e-14) {
            // A double root: as good as its isolation.
            return (gradient.length() < 1e-7).then_some([theta, phi]);
        }
        let step = DVec2::new(bb * gradient.x - ab * gradient.y, aa * gradient.y - ab * gradient.x) / det;
        theta -= step.x;
        phi -= step.y;
        if step.length() < 1e-14 {
            break;
        }
    }
    let turned = |x: f64, y: f64| {
        let d = (x - y).rem_euclid(4.0 * FRAC_PI_2);
        d.min(4.0 * FRAC_PI_2 - d)
    };
    let d = a.point(theta) - b.point(phi);
    let off = d.dot(a.derivative(theta)).abs().max(d.dot(b.derivative(phi)).abs());
    // A start with the wrong sign runs elsewhere; that place has its own root.
    (off < 1e-11 && turned(phi, start[1]) < 1e-2).then_some([theta, phi])
}

fn circle_line(circle: &Spine, point: DVec3, direction: DVec3) -> CommonNormals {
    let Some(ring) = Ring::of(circle) else { return CommonNormals::Isolated(Vec::new()) };
    let size = ring.radius.max(ring.center.distance(point));
    let slope = |angle: f64| {
        let (d, dq) = ((ring.point(angle) - point) / size, ring.derivative(angle) / size);
        d.dot(dq) - d.dot(direction) * dq.dot(direction)
    };
    let flat = (0..16).all(|k| slope(f64::from(k) * 0.39).abs() < 1e-12);
    let Some(angles) = (if flat { None } else { zeros(2, slope) }) else { return CommonNormals::Continuum };
    let mut out: Vec<CommonNormal> = Vec::new();
    for angle in angles {
        let p = ring.point(angle);
        let q = point + direction * (p - point).dot(direction);
        let far = p.distance(q) > 1e-9 * size;
        let across = (q - p).try_normalize().filter(|_| far);
        let Some(normal) = across.or_else(|| ring.derivative(angle).cross(direction).try_normalize()) else { continue };
        if !out.iter().any(|c| c.on[0].distance(p) < 1e-7 * size) {
            out.push(CommonNormal { on: [p, q], direction: normal });
        }
    }
    CommonNormals::Isolated(out)
}

fn circle_plane(circle: &Spine, point: DVec3, normal: DVec3) -> CommonNormals {
    let Some(ring) = Ring::of(circle) else { return CommonNormals::Isolated(Vec::new()) };
    let flat = DVec2::new(ring.axes[0].dot(normal), ring.axes[1].dot(normal));
    if flat.length() < 1e-12 {
        return CommonNormals::Continuum;
    }
    let list = [0.0, 2.0 * FRAC_PI_2].map(|turn| {
        let p = ring.point(flat.to_angle() + turn);
        CommonNormal { on: [p, p - normal * (p - point).dot(normal)], direction: normal }
    });
    CommonNormals::Isolated(list.to_vec())
}

fn lines(p: DVec3, d: DVec3, q: DVec3, e: DVec3) -> CommonNormals {
    let cross = d.cross(e);
    let square = cross.length_squared();
    if square < 1e-24 {
        return CommonNormals::Continuum;
    }
    let between = q - p;
    let (s, t) = (between.cross(e).dot(cross) / square, between.cross(d).dot(cross) / square);
    CommonNormals::Isolated(vec![CommonNormal { on: [p + d * s, q + e * t], direction: cross / square.sqrt() }])
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }

        fn ring(&mut self) -> Ring {
            let x = self.vector().normalize();
            let y = x.cross(self.vector()).normalize();
            Ring { center: self.vector(), axes: [x, y], radius: 0.6 + 0.5 * self.next() }
        }
    }

    fn spine(r: &Ring) -> Spine {
        Spine::Circle { center: r.center, axes: r.axes, radius: r.radius }
    }

    fn isolated(c: CommonNormals) -> Vec<CommonNormal> {
        match c {
            CommonNormals::Isolated(list) => list,
            CommonNormals::Continuum => panic!("a continuum"),
        }
    }

    /// Critical points of the squared distance on the torus of both angles, from a dense grid of starts.
    fn brute(a: &Ring, b: &Ring) -> Vec<[DVec3; 2]> {
        let mut out: Vec<[DVec3; 2]> = Vec::new();
        for k in 0..60 * 60 {
            let start = [f64::from(k % 60), f64::from(k / 60)].map(|x| x * std::f64::consts::TAU / 60.0);
            let [mut theta, mut phi] = start;
            for _ in 0..60 {
                let (p, dp, q, dq) = (a.point(theta), a.derivative(theta), b.point(phi), b.derivative(phi));
                let d = p - q;
                let g = DVec2::new(d.dot(dp), -d.dot(dq));
                let (aa, ab) = (dp.dot(dp) + d.dot(a.center - p), -dp.dot(dq));
                let bb = dq.dot(dq) - d.dot(b.center - q);
                let det = aa * bb - ab * ab;
                let step = DVec2::new(bb * g.x - ab * g.y, aa * g.y - ab * g.x) / det;
                let step = step * (0.1 / step.length()).min(1.0);
                theta -= step.x;
                phi -= step.y;
            }
            let (p, q) = (a.point(theta), b.point(phi));
            let off = (p - q).dot(a.derivative(theta)).abs().max((p - q).dot(b.derivative(phi)).abs());
            if off < 1e-12 && !out.iter().any(|[x, y]| x.distance(p) < 1e-6 && y.distance(q) < 1e-6) {
                out.push([p, q]);
            }
        }
        out
    }

    #[test]
    fn circles_have_the_common_normals_that_a_dense_search_finds() {
        let mut random = Random(7);
        let mut counts = [0; 9];
        for k in 0..60 {
            let (a, b) = (random.ring(), random.ring());
            let found = isolated(common_normals(&spine(&a), &spine(&b)));
            let wanted = brute(&a, &b);
            assert_eq!(found.len(), wanted.len(), "pair {k}");
            for [p, q] in &wanted {
                assert!(found.iter().any(|c| c.on[0].distance(*p) < 1e-6 && c.on[1].distance(*q) < 1e-6), "pair {k}");
            }
            for c in &found {
                assert!(c.direction.cross(c.on[1] - c.on[0]).length() < 1e-9);
            }
            counts[found.len()] += 1;
        }
        // Morse theory on the torus of both angles: an even number, at least four; Neff's bound is eight.
        assert!(counts[4] > 0 && counts[6] > 0 && counts.iter().step_by(2).sum::<i32>() == 60, "{counts:?}");
    }

    #[test]
    fn limits_have_their_own_cases() {
        let ring = Ring { center: DVec3::ZERO, axes: [DVec3::X, DVec3::Y], radius: 2.0 };
        let circle = spine(&ring);
        // Coaxial, and the axis itself.
        let above = spine(&Ring { center: DVec3::Z, ..ring });
        assert_eq!(common_normals(&circle, &above), CommonNormals::Continuum);
        let axis = Spine::Line { point: DVec3::ZERO, direction: DVec3::Z };
        assert_eq!(common_normals(&axis, &circle), CommonNormals::Continuum);
        // A line across: along it, two normals; through the circle's points over it, two more.
        let line = Spine::Line { point: DVec3::new(0.3, 0.0, 1.0), direction: DVec3::Y };
        let found = isolated(common_normals(&circle, &line));
        assert_eq!(found.len(), 4);
        for c in &found {
            assert!(c.direction.y.abs() < 1e-12 && (c.on[0].length() - 2.0).abs() < 1e-12);
        }
        // Planes: the two points of the circle whose tangent lies in the plane.
        let plane = Spine::Plane { point: DVec3::ZERO, normal: DVec3::new(0.6, 0.0, 0.8) };
        let found = isolated(common_normals(&plane, &circle));
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|c| c.on[1].y.abs() < 1e-12 && (c.on[1].x.abs() - 2.0).abs() < 1e-12));
        let flat = Spine::Plane { point: DVec3::X, normal: DVec3::Z };
        assert_eq!(common_normals(&circle, &flat), CommonNormals::Continuum);
        assert_eq!(common_normals(&plane, &flat), CommonNormals::Isolated(Vec::new()));
        // Skew lines.
        let other = Spine::Line { point: DVec3::new(5.0, 1.0, 2.0), direction: DVec3::X };
        let found = isolated(common_normals(&axis, &other));
        assert_eq!(found.len(), 1);
        assert!(
            found[0].on[0].distance(DVec3::Z * 2.0) < 1e-12
                && found[0].on[1].distance(DVec3::new(0.0, 1.0, 2.0)) < 1e-12
        );
    }

    #[test]
    fn a_circle_of_growing_radius_becomes_its_line() {
        let ring = Ring { center: DVec3::new(0.1, -0.2, 0.3), axes: [DVec3::X, DVec3::Z], radius: 0.7 };
        let line = isolated(common_normals(
            &spine(&ring),
            &Spine::Line { point: DVec3::new(0.0, 0.5, 0.4), direction: DVec3::new(0.6, 0.8, 0.0) },
        ));
        let direction = DVec3::new(0.6, 0.8, 0.0);
        for radius in [1e3, 1e5] {
            let point = DVec3::new(0.0, 0.5, 0.4);
            let big = Ring { center: point - DVec3::Z * radius, axes: [direction, DVec3::Z], radius };
            let found = isolated(common_normals(&spine(&ring), &spine(&big)));
            for c in &line {
                let nearest = found.iter().map(|f| f.on[0].distance(c.on[0])).fold(f64::INFINITY, f64::min);
                assert!(nearest < 10.0 / radius, "{radius}: {nearest}");
            }
        }
    }

    #[test]
    fn a_circle_point_on_the_other_axis_is_no_trap() {
        // The second circle passes through the axis of the first.
        let a = Ring { center: DVec3::ZERO, axes: [DVec3::X, DVec3::Y], radius: 1.0 };
        let b = Ring { center: DVec3::new(0.5, 0.0, 0.7), axes: [DVec3::X, DVec3::new(0.0, 0.6, 0.8)], radius: 0.5 };
        let found = isolated(common_normals(&spine(&a), &spine(&b)));
        assert_eq!(found.len(), brute(&a, &b).len());
    }
}
