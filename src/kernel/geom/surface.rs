//! B-spline surfaces, polynomial and rational.

use glam::{DAffine3, DVec2, DVec3, DVec4};

use super::blossom;
use super::curve::{cartesian, checked_weights, homogeneous};
use super::knots::{Basis, KnotError, Knots, MAX_DEGREE};
use super::{Aabb, BezierPatch, Curve, CurveError};

/// One of the two parameter directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Direction {
    /// Along u.
    U,
    /// Along v.
    V,
}

/// One of the four sides of the domain, in the order in which edges are numbered: v = min, u = max, v = max,
/// u = min. Each runs in increasing parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Side {
    /// v = min, running along u.
    VMin,
    /// u = max, running along v.
    UMax,
    /// v = max, running along u.
    VMax,
    /// u = min, running along v.
    UMin,
}

impl Side {
    /// All four, in order.
    pub const ALL: [Self; 4] = [Self::VMin, Self::UMax, Self::VMax, Self::UMin];
}

/// Why numbers are no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A knot vector is not one.
    #[error("{direction:?} knots: {source}")]
    Knots {
        /// Which of the two.
        direction: Direction,
        /// What is wrong with it.
        source: KnotError,
    },
    /// The number of control points does not go with the knots.
    #[error("{got} control points, the knots need {nu} x {nv}")]
    Count {
        /// Control points along u.
        nu: usize,
        /// Control points along v.
        nv: usize,
        /// What was given.
        got: usize,
    },
    /// The number of weights is not the number of control points.
    #[error("{got} weights for {expected} control points")]
    WeightCount {
        /// The number of control points.
        expected: usize,
        /// The number of weights.
        got: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("control point ({i}, {j}) is {point}, which is not finite")]
    NotFinite {
        /// Index along u.
        i: usize,
        /// Index along v.
        j: usize,
        /// Its coordinates.
        point: DVec3,
    },
    /// A weight is zero, negative or not finite.
    #[error("weight ({i}, {j}) is {value}, weights must be positive and finite")]
    Weight {
        /// Index along u.
        i: usize,
        /// Index along v.
        j: usize,
        /// Its value.
        value: f64,
    },
}

/// A B-spline surface. Control points are Cartesian with u running fastest (`points[j * nu + i]`); `weights`
/// is `None` for polynomial surfaces.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "RawSurface")]
pub struct Surface {
    knots: [Knots; 2],
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSurface {
    knots: [Knots; 2],
    points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

impl TryFrom<RawSurface> for Surface {
    type Error = SurfaceError;

    fn try_from(raw: RawSurface) -> Result<Self, SurfaceError> {
        let [u, v] = raw.knots;
        Self::new(u, v, raw.points, raw.weights)
    }
}

/// A point of a surface with its partial derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceJet {
    /// `d[k][l]` is the derivative taken k times by u and l times by v; zero where k + l exceeds the order.
    pub d: [[DVec3; 4]; 4],
}

impl SurfaceJet {
    /// The point.
    pub fn p(&self) -> DVec3 {
        self.d[0][0]
    }

    /// The first derivative by u.
    pub fn u(&self) -> DVec3 {
        self.d[1][0]
    }

    /// The first derivative by v.
    pub fn v(&self) -> DVec3 {
        self.d[0][1]
    }

    /// The second derivatives uu, uv, vv.
    pub fn second(&self) -> [DVec3; 3] {
        [self.d[2][0], self.d[1][1], self.d[0][2]]
    }

    /// Su x Sv, not normalized.
    pub fn cross(&self) -> DVec3 {
        self.u().cross(self.v())
    }

    /// The unit normal, `None` where Su x Sv vanishes relative to |Su| |Sv|.
    pub fn normal(&self) -> Option<DVec3> {
        let n = self.cross();
        let scale = self.u().length() * self.v().length();
        (n.length() > 1e-13 * scale && scale > 0.0).then(|| n.normalize())
    }
}

const BINOMIAL: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

impl Surface {
    /// Checks and keeps a surface. Weights that are all equal are dropped.
    pub fn new(u: Knots, v: Knots, points: Vec<DVec3>, weights: Option<Vec<f64>>) -> Result<Self, SurfaceError> {
        let (nu, nv) = (u.control_count(), v.control_count());
        if nu.checked_mul(nv) != Some(points.len()) {
            return Err(SurfaceError::Count { nu, nv, got: points.len() });
        }
        if let Some(at) = points.iter().position(|p| !p.is_finite()) {
            return Err(SurfaceError::NotFinite { i: at % nu, j: at / nu, point: points[at] });
        }
        if let Some(w) = weights.as_ref().filter(|w| w.len() != points.len()) {
            return Err(SurfaceError::WeightCount { expected: points.len(), got: w.len() });
        }
        let weights =
            checked_weights(weights).map_err(|(at, value)| SurfaceError::Weight { i: at % nu, j: at / nu, value })?;
        Ok(Self { knots: [u, v], points, weights })
    }

    /// The bilinear patch with corners (0,0), (1,0), (0,1), (1,1).
    pub fn bilinear(corners: [DVec3; 4]) -> Result<Self, SurfaceError> {
        let knots = |direction| Knots::bezier(1, 0.0, 1.0).map_err(|source| SurfaceError::Knots { direction, source });
        Self::new(knots(Direction::U)?, knots(Direction::V)?, corners.to_vec(), None)
    }

    /// The knot vectors along u and v.
    pub fn knots(&self) -> &[Knots; 2] {
        &self.knots
    }

    /// The numbers of control points along u and v.
    pub fn counts(&self) -> [usize; 2] {
        [self.knots[0].control_count(), self.knots[1].control_count()]
    }

    /// The control points, u running fastest.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Control point (i, j).
    pub fn point(&self, i: usize, j: usize) -> DVec3 {
        self.points[j * self.counts()[0] + i]
    }

    /// The weights of a rational surface, in the order of the points.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// The domain: `[[u0, u1], [v0, v1]]`.
    pub fn domain(&self) -> [[f64; 2]; 2] {
        [self.knots[0].domain(), self.knots[1].domain()]
    }

    /// `uv` moved to the nearest point of the domain.
    pub fn clamped(&self, uv: DVec2) -> DVec2 {
        let [u, v] = self.domain();
        DVec2::new(uv.x.clamp(u[0], u[1]), uv.y.clamp(v[0], v[1]))
    }

    /// A box around the control points, hence around the surface.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.points.iter().copied())
    }

    /// The control points as (w x, w y, w z, w).
    pub fn homogeneous(&self) -> Vec<DVec4> {
        homogeneous(&self.points, self.weights())
    }

    /// The point at `uv`.
    pub fn eval(&self, uv: DVec2) -> DVec3 {
        self.jet(uv, 0).p()
    }

    /// The point and its partial derivatives up to `order <= 3` at `uv`.
    pub fn jet(&self, uv: DVec2, order: usize) -> SurfaceJet {
        match self.knots[0].degree().max(self.knots[1].degree()) {
            0..=3 => self.small_jet::<4>(uv, order),
            4..=7 => self.small_jet::<8>(uv, order),
            _ => self.small_jet::<{ MAX_DEGREE + 1 }>(uv, order),
        }
    }

    #[inline]
    fn small_jet<const N: usize>(&self, uv: DVec2, order: usize) -> SurfaceJet {
        let [u, v] = &self.knots;
        let bu = u.small_basis::<N>(u.span(uv.x), uv.x, order);
        let bv = v.small_basis::<N>(v.span(uv.y), uv.y, order);
        self.jet_from(&bu, &bv, order)
    }

    /// The same from basis values that the caller has tabulated (a grid needs each only once).
    pub fn jet_from<const N: usize>(&self, bu: &Basis<N>, bv: &Basis<N>, order: usize) -> SurfaceJet {
        // Constant orders and degrees let the loops unroll.
        match (order, self.knots.each_ref().map(Knots::degree)) {
            (0, [3, 3]) => self.summed(bu, bv, 0, [3, 3]),
            (1, [3, 3]) => self.summed(bu, bv, 1, [3, 3]),
            (2, [3, 3]) => self.summed(bu, bv, 2, [3, 3]),
            (_, degree) => self.summed(bu, bv, order.min(3), degree),
        }
    }

    #[inline(always)]
    fn summed<const N: usize>(&self, bu: &Basis<N>, bv: &Basis<N>, order: usize, [p, q]: [usize; 2]) -> SurfaceJet {
        let nu = self.counts()[0];
        let mut jet = SurfaceJet::default();
        let Some(weights) = &self.weights else {
            for j in 0..=q {
                let start = (bv.first + j) * nu + bu.first;
                let mut along_u = [DVec3::ZERO; 4];
                for (i, point) in self.points[start..=start + p].iter().enumerate() {
                    for (k, sum) in along_u.iter_mut().enumerate().take(order + 1) {
                        *sum += *point * bu.d[k][i];
                    }
                }
                for k in 0..=order {
                    for l in 0..=order - k {
                        jet.d[k][l] += along_u[k] * bv.d[l][j];
                    }
                }
            }
            return jet;
        };
        let mut a = [[DVec4::ZERO; 4]; 4];
        for j in 0..=q {
            let start = (bv.first + j) * nu + bu.first;
            let row = self.points[start..=start + p].iter().zip(&weights[start..=start + p]);
            let mut along_u = [DVec4::ZERO; 4];
            for (i, (point, &w)) in row.enumerate() {
                let h = (*point * w).extend(w);
                for (k, sum) in along_u.iter_mut().enumerate().take(order + 1) {
                    *sum += h * bu.d[k][i];
                }
            }
            for k in 0..=order {
                for l in 0..=order - k {
                    a[k][l] += along_u[k] * bv.d[l][j];
                }
            }
        }
        for k in 0..=order {
            for l in 0..=order - k {
                jet.d[k][l] = a[k][l].truncate();
            }
        }
        divide_by_weight(&mut jet, &a, order);
        jet
    }

    /// The iso-curve at u = c (running along v) or at v = c (running along u).
    pub fn iso_curve(&self, fixed: Direction, c: f64) -> Result<Curve, CurveError> {
        let net = self.homogeneous();
        let [nu, nv] = self.counts();
        let (knots, points): (_, Vec<DVec4>) = match fixed {
            Direction::U => {
                let b = self.knots[0].basis(c, 0);
                let point =
                    |j: usize| (0..=self.knots[0].degree()).map(|i| net[j * nu + b.first + i] * b.d[0][i]).sum();
                (&self.knots[1], (0..nv).map(point).collect())
            }
            Direction::V => {
                let b = self.knots[1].basis(c, 0);
                let point =
                    |i: usize| (0..=self.knots[1].degree()).map(|j| net[(b.first + j) * nu + i] * b.d[0][j]).sum();
                (&self.knots[0], (0..nu).map(point).collect())
            }
        };
        let (points, weights) = cartesian(&points, self.weights.is_some());
        Curve::new(knots.clone(), points, weights)
    }

    /// One of the four border curves, in increasing parameter.
    pub fn border(&self, side: Side) -> Result<Curve, CurveError> {
        let [u, v] = self.domain();
        match side {
            Side::VMin => self.iso_curve(Direction::V, v[0]),
            Side::UMax => self.iso_curve(Direction::U, u[1]),
            Side::VMax => self.iso_curve(Direction::V, v[1]),
            Side::UMin => self.iso_curve(Direction::U, u[0]),
        }
    }

    /// The surface moved by an affine map.
    #[must_use]
    pub fn transformed(&self, map: &DAffine3) -> Self {
        Self { points: self.points.iter().map(|&p| map.transform_point3(p)).collect(), ..self.clone() }
    }

    /// The same surface with u and v exchanged (its normal turns over).
    #[must_use]
    pub fn swapped(&self) -> Self {
        let [nu, nv] = self.counts();
        let swap = |at: usize| (at % nv) * nu + at / nv;
        Self {
            knots: [self.knots[1].clone(), self.knots[0].clone()],
            points: (0..nu * nv).map(|at| self.points[swap(at)]).collect(),
            weights: self.weights.as_ref().map(|w| (0..nu * nv).map(|at| w[swap(at)]).collect()),
        }
    }

    /// The same surface with one direction run backwards over the same domain (its normal turns over).
    #[must_use]
    pub fn reversed(&self, direction: Direction) -> Self {
        let [nu, nv] = self.counts();
        let flip = |at: usize| match direction {
            Direction::U => at / nu * nu + (nu - 1 - at % nu),
            Direction::V => (nv - 1 - at / nu) * nu + at % nu,
        };
        let mut knots = self.knots.clone();
        knots[direction as usize] = knots[direction as usize].reversed();
        Self {
            knots,
            points: (0..nu * nv).map(|at| self.points[flip(at)]).collect(),
            weights: self.weights.as_ref().map(|w| (0..nu * nv).map(|at| w[flip(at)]).collect()),
        }
    }

    /// The piece over a subrectangle of the domain, with clamped knots.
    pub fn restricted(&self, u: [f64; 2], v: [f64; 2]) -> Result<Self, SurfaceError> {
        let error = |direction| move |source| SurfaceError::Knots { direction, source };
        let ku = self.knots[0].restricted(u[0], u[1]).map_err(error(Direction::U))?;
        let kv = self.knots[1].restricted(v[0], v[1]).map_err(error(Direction::V))?;
        Ok(self.along(Direction::U, ku, blossom::refine).along(Direction::V, kv, blossom::refine))
    }

    /// The same surface with `t` inserted `times` more as a knot.
    pub fn knot_inserted(&self, direction: Direction, t: f64, times: usize) -> Result<Self, SurfaceError> {
        let knots = self.knots[direction as usize]
            .inserted(t, times)
            .map_err(|source| SurfaceError::Knots { direction, source })?;
        Ok(self.along(direction, knots, blossom::refine))
    }

    /// The same surface at one degree more along a direction.
    pub fn elevated(&self, direction: Direction) -> Result<Self, SurfaceError> {
        let knots =
            self.knots[direction as usize].elevated().map_err(|source| SurfaceError::Knots { direction, source })?;
        Ok(self.along(direction, knots, blossom::elevate))
    }

    /// The Bezier pieces, v-rows of pieces one after the other with u running fastest. Their number is
    /// `(knots[0].breaks().len() - 1) * (knots[1].breaks().len() - 1)`.
    pub fn bezier_patches(&self) -> Vec<BezierPatch> {
        let breaks = [self.knots[0].breaks(), self.knots[1].breaks()];
        let full = |k: &Knots, b: &[f64]| Knots::clamped(k.degree(), b, k.degree());
        let (Ok(ku), Ok(kv)) = (full(&self.knots[0], &breaks[0]), full(&self.knots[1], &breaks[1])) else {
            return Vec::new(); // cannot happen: breaks of valid knots are valid
        };
        let split = self.along(Direction::U, ku, blossom::refine).along(Direction::V, kv, blossom::refine);
        let net = split.homogeneous();
        let [nu, _] = split.counts();
        let (p, q) = (self.knots[0].degree(), self.knots[1].degree());
        let mut patches = Vec::new();
        for (b, v) in breaks[1].windows(2).enumerate() {
            for (a, u) in breaks[0].windows(2).enumerate() {
                let points = (0..=q)
                    .flat_map(|j| (0..=p).map(move |i| (b * q + j) * nu + a * p + i))
                    .map(|at| net[at])
                    .collect();
                patches.push(BezierPatch {
                    degree: [p, q],
                    points,
                    rational: self.weights.is_some(),
                    low: DVec2::new(u[0], v[0]),
                    high: DVec2::new(u[1], v[1]),
                });
            }
        }
        patches
    }

    /// Applies a curve operation to every row (U) or column (V) of the control net.
    fn along(
        &self,
        direction: Direction,
        target: Knots,
        operation: fn(&Knots, &[DVec4], &Knots) -> Vec<DVec4>,
    ) -> Self {
        let net = self.homogeneous();
        let [nu, nv] = self.counts();
        let own = &self.knots[direction as usize];
        let count = target.control_count();
        let mut out;
        match direction {
            Direction::U => {
                out = Vec::with_capacity(count * nv);
                for row in net.chunks(nu) {
                    out.extend(operation(own, row, &target));
                }
            }
            Direction::V => {
                out = vec![DVec4::ZERO; nu * count];
                for i in 0..nu {
                    let column: Vec<DVec4> = (0..nv).map(|j| net[j * nu + i]).collect();
                    for (j, point) in operation(own, &column, &target).into_iter().enumerate() {
                        out[j * nu + i] = point;
                    }
                }
            }
        }
        let mut knots = self.knots.clone();
        knots[direction as usize] = target;
        let (points, weights) = cartesian(&out, self.weights.is_some());
        Self { knots, points, weights }
    }
}

/// The quotient rule (The NURBS Book, A4.4): `a` holds derivatives of the homogeneous surface.
fn divide_by_weight(jet: &mut SurfaceJet, a: &[[DVec4; 4]; 4], order: usize) {
    for k in 0..=order {
        for l in 0..=order - k {
            let mut v = a[k][l].truncate();
            for j in 1..=l {
                v -= jet.d[k][l - j] * (BINOMIAL[l][j] * a[0][j].w);
            }
            for i in 1..=k {
                v -= jet.d[k - i][l] * (BINOMIAL[k][i] * a[i][0].w);
                let mut mixed = DVec3::ZERO;
                for j in 1..=l {
                    mixed += jet.d[k - i][l - j] * (BINOMIAL[l][j] * a[i][j].w);
                }
                v -= mixed * BINOMIAL[k][i];
            }
            jet.d[k][l] = v / a[0][0].w;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2Swizzles;

    use super::*;

    /// A quarter cylinder of radius 2 and height 3: exactly rational.
    fn quarter_cylinder() -> Surface {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let points = [0.0, 3.0]
            .iter()
            .flat_map(|&z| [DVec3::new(2.0, 0.0, z), DVec3::new(2.0, 2.0, z), DVec3::new(0.0, 2.0, z)])
            .collect();
        Surface::new(
            Knots::bezier(2, 0.0, 1.0).unwrap(),
            Knots::bezier(1, 0.0, 1.0).unwrap(),
            points,
            Some([1.0, w, 1.0].repeat(2)),
        )
        .unwrap()
    }

    fn wavy() -> Surface {
        let u = Knots::clamped(3, &[0.0, 1.0, 2.5, 4.0], 1).unwrap();
        let v = Knots::clamped(2, &[-1.0, 0.0, 1.0], 2).unwrap();
        let (nu, nv) = (u.control_count(), v.control_count());
        let points = (0..nu * nv)
            .map(|at| DVec3::new((at % nu) as f64, (at / nu) as f64, ((at * 7) % 5) as f64 - 2.0))
            .collect();
        Surface::new(u, v, points, Some((0..nu * nv).map(|at| 0.5 + (at % 3) as f64).collect())).unwrap()
    }

    fn grid(s: &Surface) -> impl Iterator<Item = DVec2> + use<> {
        let [u, v] = s.domain();
        (0..=12).flat_map(move |i| {
            (0..=9).map(move |j| {
                DVec2::new(u[0] + (u[1] - u[0]) * f64::from(i) / 12.0, v[0] + (v[1] - v[0]) * f64::from(j) / 9.0)
            })
        })
    }

    #[test]
    fn a_rational_cylinder_is_exactly_round() {
        let s = quarter_cylinder();
        for uv in grid(&s) {
            let jet = s.jet(uv, 2);
            assert!((jet.p().truncate().length() - 2.0).abs() < 1e-14);
            assert!(jet.u().truncate().dot(jet.p().truncate()).abs() < 1e-13);
            let curvature = jet.second()[0].truncate().dot(jet.p().truncate()) / 2.0 / jet.u().length_squared();
            assert!((curvature + 0.5).abs() < 1e-13);
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let s = wavy();
        let h = 1e-5;
        for uv in [DVec2::new(0.3, -0.7), DVec2::new(1.7, 0.4), DVec2::new(3.1, 0.9)] {
            let jet = s.jet(uv, 3);
            for k in 0..3 {
                for l in 0..3 - k {
                    let at = |d: DVec2| s.jet(uv + d, 3).d[k][l];
                    let du = (at(DVec2::X * h) - at(-DVec2::X * h)) / (2.0 * h);
                    let dv = (at(DVec2::Y * h) - at(-DVec2::Y * h)) / (2.0 * h);
                    assert!(du.distance(jet.d[k + 1][l]) < 1e-6 * (1.0 + du.length()), "{k}{l}");
                    assert!(dv.distance(jet.d[k][l + 1]) < 1e-6 * (1.0 + dv.length()), "{k}{l}");
                }
            }
        }
    }

    #[test]
    fn every_rewriting_keeps_the_points() {
        let s = wavy();
        let piece = s.restricted([0.5, 3.0], [-0.5, 1.0]).unwrap();
        for uv in grid(&piece) {
            assert!(piece.eval(uv).distance(s.eval(uv)) < 1e-13);
        }
        let higher = s.elevated(Direction::U).unwrap().elevated(Direction::V).unwrap();
        let finer = s.knot_inserted(Direction::V, 0.25, 2).unwrap();
        for uv in grid(&s) {
            assert!(higher.eval(uv).distance(s.eval(uv)) < 1e-13);
            assert!(finer.eval(uv).distance(s.eval(uv)) < 1e-13);
            assert!(s.swapped().eval(uv.yx()).distance(s.eval(uv)) < 1e-14);
            assert!(s.reversed(Direction::U).eval(DVec2::new(4.0 - uv.x, uv.y)).distance(s.eval(uv)) < 1e-13);
        }
        for patch in s.bezier_patches() {
            for [a, b] in [[0.0, 0.0], [0.3, 0.8], [1.0, 1.0]] {
                let local = DVec2::new(a, b);
                assert!(patch.eval(local).distance(s.eval(patch.to_surface(local))) < 1e-13);
                let [low, high] = patch.split(Direction::U, 0.4);
                assert!(low.eval(local).distance(s.eval(low.to_surface(local))) < 1e-13);
                assert!(high.eval(local).distance(s.eval(high.to_surface(local))) < 1e-13);
            }
        }
        assert_eq!(s.bezier_patches().len(), 6);
    }

    #[test]
    fn borders_are_the_surface_on_its_border() {
        let s = wavy();
        let [u, v] = s.domain();
        for i in 0..=10 {
            let f = f64::from(i) / 10.0;
            let (cu, cv) = (u[0] + (u[1] - u[0]) * f, v[0] + (v[1] - v[0]) * f);
            assert!(s.border(Side::VMin).unwrap().eval(cu).distance(s.eval(DVec2::new(cu, v[0]))) < 1e-14);
            assert!(s.border(Side::UMax).unwrap().eval(cv).distance(s.eval(DVec2::new(u[1], cv))) < 1e-14);
        }
    }

    #[test]
    fn bad_nets_are_named() {
        let k = || Knots::bezier(1, 0.0, 1.0).unwrap();
        let mut points = vec![DVec3::ZERO; 4];
        assert!(matches!(Surface::new(k(), k(), points[..3].to_vec(), None), Err(SurfaceError::Count { got: 3, .. })));
        points[2].y = f64::NAN;
        assert!(matches!(Surface::new(k(), k(), points, None), Err(SurfaceError::NotFinite { i: 0, j: 1, .. })));
        let weights = Some(vec![1.0, 1.0, 1.0, 0.0]);
        assert!(matches!(
            Surface::new(k(), k(), vec![DVec3::ZERO; 4], weights),
            Err(SurfaceError::Weight { i: 1, j: 1, .. })
        ));
    }
}
