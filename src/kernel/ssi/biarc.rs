//! Intersection curves as matched G1 biarcs in both parameter domains (thesis 5.2.1), with the error bound of 5.2.2.
//!
//! Between two points of the curve with their directions in a domain lie two circular arcs that meet with a common
//! tangent (Bolton, "Biarc curves", CAD 7 (1975), with equal tangent lengths). A segment is refined ([`super::refined`])
//! until |S_A(u, v) - S_B(s, t)| along the matched pair of biarcs is bounded below the tolerance by
//! samples and Filip's term, so that each of the two curves on surfaces is within the tolerance of the other surface.
//! Segments are u- or v-monotone in both domains and run from piece border to piece border, junction or end.
//!
//! The thesis matches arcs by their angle. Here the arc length in each domain is a cubic function of the common
//! parameter whose ends have the true speeds of the curve: the points then differ along the curve by the fourth order
//! of the length, not by the second, and segments may be long. Cost: about 1000 samples for a length of one diagonal
//! at the default tolerance.

use glam::{DVec2, DVec3};

use super::derivative_bounds::filip;
use super::refined::{Element, refined};
use super::result::IntersectionCurve;
use super::spline_fit::{FitError, prepared};
use super::strand::{Ground, Knot, Strand};
use crate::kernel::geom::Surface;

/// A circular arc, or a straight segment, in a parameter domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Where it starts.
    pub start: DVec2,
    /// The unit tangent there.
    pub direction: DVec2,
    /// One over the radius, positive when it turns left; zero for a segment.
    pub curvature: f64,
    /// Its length.
    pub length: f64,
}

impl Arc {
    /// The arc that leaves `start` in a unit direction and ends in `end`.
    pub fn through(start: DVec2, direction: DVec2, end: DVec2) -> Self {
        let chord = end - start;
        let square = chord.length_squared();
        if !(square > 0.0) {
            return Self { start, direction, curvature: 0.0, length: 0.0 };
        }
        let half = direction.perp_dot(chord).atan2(direction.dot(chord));
        let length = if half.abs() < 1e-9 { square.sqrt() } else { square.sqrt() * half / half.sin() };
        Self { start, direction, curvature: 2.0 * direction.perp_dot(chord) / square, length }
    }

    /// The point at an arc length.
    pub fn point(&self, s: f64) -> DVec2 {
        let half = 0.5 * self.curvature * s;
        let chord = if half.abs() < 1e-9 { s } else { s * half.sin() / half };
        self.start + self.direction.rotate(DVec2::from_angle(half)) * chord
    }

    /// The unit tangent at an arc length.
    pub fn tangent(&self, s: f64) -> DVec2 {
        self.direction.rotate(DVec2::from_angle(self.curvature * s))
    }

    /// Its end.
    pub fn end(&self) -> DVec2 {
        self.point(self.length)
    }

    /// The arc travelled the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let direction = -self.tangent(self.length);
        Self { start: self.end(), direction, curvature: -self.curvature, length: self.length }
    }
}

/// The biarc between two points with unit tangents. `None` when a point or tangent is not finite, or both are equal.
pub fn biarc(p: DVec2, dp: DVec2, q: DVec2, dq: DVec2) -> Option<[Arc; 2]> {
    let chord = q - p;
    if !(chord.length_squared() > 0.0) || !dp.is_finite() || !dq.is_finite() {
        return None;
    }
    // Equal lengths d of both control legs: |q - d dq - p - d dp| = 2 d.
    let sum = dp + dq;
    let along = chord.dot(sum);
    let spread = 2.0 * (1.0 - dp.dot(dq));
    let root = (along * along + spread * chord.length_squared()).sqrt();
    // The positive root, in the form that does not cancel.
    let d = if along > 0.0 { chord.length_squared() / (along + root) } else { (root - along) / spread };
    if !d.is_finite() {
        // Parallel tangents across the chord: two half circles.
        let middle = 0.5 * (p + q);
        let second = Arc::through(q, -dq, middle).reversed();
        return Some([Arc::through(p, dp, middle), second]);
    }
    let joint = 0.5 * (p + dp * d + q - dq * d);
    Some([Arc::through(p, dp, joint), Arc::through(q, -dq, joint).reversed()])
}

/// A biarc in each domain over the same stretch of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiarcPair {
    /// In the parameters of the first surface.
    pub in_a: [Arc; 2],
    /// In the parameters of the second surface.
    pub in_b: [Arc; 2],
    /// The derivatives of the arc lengths in both domains by the matching parameter in [0, 1], at its two ends.
    pub speeds: [[f64; 2]; 2],
    /// An upper bound of |S_A - S_B| over matched points, in model units.
    pub bound: f64,
}

impl BiarcPair {
    /// The matched points of both domains at a parameter in [0, 1].
    pub fn at(&self, t: f64) -> [DVec2; 2] {
        [0, 1].map(|side| {
            let arcs = [&self.in_a, &self.in_b][side];
            on(arcs, matched(arcs, self.speeds[side], t))
        })
    }
}

/// The arc length at a matching parameter: cubic, from 0 to the whole, with given speeds at the ends.
fn matched(arcs: &[Arc; 2], speeds: [f64; 2], t: f64) -> f64 {
    let whole = arcs[0].length + arcs[1].length;
    let g = 1.0 - t;
    whole * t * t * (3.0 - 2.0 * t) + speeds[0] * g * g * t - speeds[1] * t * t * g
}

fn on(arcs: &[Arc; 2], s: f64) -> DVec2 {
    if s <= arcs[0].length { arcs[0].point(s) } else { arcs[1].point(s - arcs[0].length) }
}

/// Consecutive biarcs on one pair of surfaces.
#[derive(Clone, Debug)]
pub struct BiarcRun {
    /// The number of the first surface.
    pub a: usize,
    /// The number of the second surface.
    pub b: usize,
    /// The biarcs, each starting where the one before ends.
    pub pairs: Vec<BiarcPair>,
}

/// An intersection curve as biarcs.
#[derive(Clone, Debug)]
pub struct Biarcs {
    /// Patch after patch.
    pub runs: Vec<BiarcRun>,
    /// An upper bound, over the whole curve, of the distance of each curve on a surface to the other surface; in model
    /// units.
    pub bound: f64,
    /// Whether the bound is within the tolerance asked for.
    pub within: bool,
}

/// Fits biarcs to an intersection curve; `surfaces` must hold those that its points name, `tol` is in model units.
pub fn fit_biarcs(curve: &IntersectionCurve, surfaces: &[(usize, &Surface)], tol: f64) -> Result<Biarcs, FitError> {
    let (ground, strands) = prepared(curve, surfaces, tol)?;
    let wanted = tol * ground.frame.scale;
    let mut runs: Vec<BiarcRun> = Vec::new();
    for strand in &strands {
        let [a, b] = strand.surfaces;
        if !strand.continues || runs.is_empty() {
            runs.push(BiarcRun { a, b, pairs: Vec::new() });
        }
        let Some(run) = runs.last_mut() else { continue };
        for part in monotone(&strand.knots) {
            let tried = |x: &Knot, y: &Knot| {
                Some(Tried { ground: &ground, strand, wanted, from: x.t, to: y.t, pair: pair_between(x, y)? })
            };
            let pairs = refined(&ground, strand, part, wanted, tried).into_iter();
            run.pairs.extend(pairs.map(|(t, _, bound)| BiarcPair { bound: bound / ground.frame.scale, ..t.pair }));
        }
    }
    runs.retain(|run| !run.pairs.is_empty());
    let bound = runs.iter().flat_map(|r| &r.pairs).map(|p| p.bound).fold(0.0, f64::max);
    Ok(Biarcs { runs, bound, within: bound <= tol })
}

/// Cuts points into runs that are u- or v-monotone in both domains.
fn monotone(knots: &[Knot]) -> Vec<&[Knot]> {
    let mut out = Vec::new();
    let mut start = 0;
    // Per domain and coordinate: the sign of the steps so far (0: none yet), or none when it has changed.
    let fresh = [[Some(0.0_f64); 2]; 2];
    let mut signs = fresh;
    for k in 1..knots.len() {
        let step = |signs: &mut [[Option<f64>; 2]; 2]| {
            for side in 0..2 {
                let d = knots[k].at[side] - knots[k - 1].at[side];
                for c in 0..2 {
                    if let Some(sign) = signs[side][c]
                        && d[c] != 0.0
                    {
                        signs[side][c] = (sign * d[c] >= 0.0).then_some(d[c].signum());
                    }
                }
            }
            signs.iter().all(|s| s[0].is_some() || s[1].is_some())
        };
        if !step(&mut signs) {
            out.push(&knots[start..k]);
            start = k - 1;
            signs = fresh;
            step(&mut signs);
        }
    }
    out.push(&knots[start..]);
    out
}

/// A pair of biarcs between two points.
struct Tried<'a> {
    ground: &'a Ground,
    strand: &'a Strand,
    wanted: f64,
    from: f64,
    to: f64,
    pair: BiarcPair,
}

impl Element for Tried<'_> {
    fn off(&self, k: &Knot) -> f64 {
        let at = self.pair.at((k.t - self.from) / (self.to - self.from));
        let on = |side: usize| self.ground.point(self.strand.pieces[side], at[side]).distance(k.p);
        on(0).max(on(1))
    }

    fn bound(&self, hasty: bool) -> f64 {
        bounded(self.ground, self.strand, &self.pair, self.wanted, hasty)
    }
}

/// `None` for a stretch that is a point in one of the domains.
fn pair_between(x: &Knot, y: &Knot) -> Option<BiarcPair> {
    let h = y.t - x.t;
    let arcs = |side: usize| {
        let unit = |k: &Knot| k.rates[side].try_normalize();
        biarc(x.at[side], unit(x)?, y.at[side], unit(y)?)
    };
    let speeds = [0, 1].map(|side| [x.rates[side].length() * h, y.rates[side].length() * h]);
    Some(BiarcPair { in_a: arcs(0)?, in_b: arcs(1)?, speeds, bound: f64::INFINITY })
}

/// An upper bound of |S_A - S_B| over a pair, in the unit frame.
fn bounded(ground: &Ground, strand: &Strand, pair: &BiarcPair, wanted: f64, hasty: bool) -> f64 {
    // Between the places where either side changes from its first to its second arc everything is smooth.
    let mut breaks = vec![0.0, 1.0];
    let mut second: f64 = 0.0;
    for side in 0..2 {
        let arcs = [&pair.in_a, &pair.in_b][side];
        let [v0, v1] = pair.speeds[side];
        let whole = arcs[0].length + arcs[1].length;
        // The speed is a quadratic with Bernstein coefficients v0, 3 whole - v0 - v1, v1.
        let coefficients = [v0, 3.0 * whole - v0 - v1, v1];
        if coefficients.iter().any(|c| !(*c >= 0.0)) {
            return f64::INFINITY; // the matching runs backwards: too long
        }
        let speed = coefficients.iter().copied().fold(0.0, f64::max);
        let change = 2.0 * (coefficients[1] - v0).abs().max((v1 - coefficients[1]).abs());
        let s = ground.bounds(strand.pieces[side]);
        let mut most: f64 = 0.0;
        for arc in arcs {
            let turn = (arc.curvature * arc.length).abs();
            let along = (arc.direction.abs() + turn).min(DVec2::ONE);
            let across = (arc.direction.perp().abs() + turn).min(DVec2::ONE);
            let term = s.second(along, along) * speed * speed
                + s.first(along) * change
                + s.first(across) * arc.curvature.abs() * speed * speed;
            most = most.max(term);
        }
        second += most;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if matched(arcs, pair.speeds[side], middle) < arcs[0].length { low = middle } else { high = middle }
        }
        breaks.push(0.5 * (low + high));
    }
    breaks.sort_by(f64::total_cmp);
    let d = |t: f64| -> DVec3 {
        let at = pair.at(t);
        ground.point(strand.pieces[0], at[0]) - ground.point(strand.pieces[1], at[1])
    };
    breaks.windows(2).map(|w| filip(w[0], w[1], second, wanted, hasty, d)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_biarc_meets_its_ends_with_their_tangents_and_has_one_tangent_in_between() {
        for k in 0..40 {
            let (p, q) = (DVec2::new(0.3, -0.2), DVec2::new(0.3, -0.2) + DVec2::from_angle(f64::from(k)) * 0.7);
            let dp = DVec2::from_angle(f64::from(k) + 1.3 * (f64::from(k) * 0.7).sin());
            let dq = DVec2::from_angle(f64::from(k) + 1.2 * (f64::from(k) * 1.1).cos());
            let [x, y] = biarc(p, dp, q, dq).unwrap();
            assert!(x.start == p && x.direction == dp);
            assert!(x.end().distance(y.start) < 1e-13);
            assert!(x.tangent(x.length).distance(y.direction) < 1e-12);
            assert!(y.end().distance(q) < 1e-12);
            assert!(y.tangent(y.length).distance(dq) < 1e-12);
        }
    }

    #[test]
    fn points_of_a_circle_give_back_the_circle() {
        let at = |t: f64| DVec2::from_angle(t) * 2.0;
        let arcs = biarc(at(0.2), at(0.2).perp() / 2.0, at(1.4), at(1.4).perp() / 2.0).unwrap();
        for arc in arcs {
            assert!((arc.curvature - 0.5).abs() < 1e-12);
            for k in 0..=4 {
                assert!((arc.point(arc.length * f64::from(k) / 4.0).length() - 2.0).abs() < 1e-12);
            }
        }
        assert!((arcs[0].length + arcs[1].length - 2.4).abs() < 1e-12);
    }

    #[test]
    fn straight_and_opposite_tangents_are_no_special_case() {
        let [x, y] = biarc(DVec2::ZERO, DVec2::X, DVec2::X * 2.0, DVec2::X).unwrap();
        assert_eq!((x.curvature, y.curvature, x.length + y.length), (0.0, 0.0, 2.0));
        // A half turn.
        let [x, y] = biarc(DVec2::ZERO, DVec2::Y, DVec2::X * 2.0, -DVec2::Y).unwrap();
        assert!((x.length + y.length - std::f64::consts::PI).abs() < 1e-12);
        // An S of two half circles.
        let [x, y] = biarc(DVec2::ZERO, DVec2::Y, DVec2::X * 2.0, DVec2::Y).unwrap();
        assert!((x.length + y.length - std::f64::consts::PI).abs() < 1e-12);
        assert!(x.curvature < 0.0 && y.curvature > 0.0);
        assert!(biarc(DVec2::ONE, DVec2::X, DVec2::ONE, DVec2::X).is_none());
    }

    #[test]
    fn runs_are_monotone_in_a_coordinate() {
        let knot = |t: f64| Knot {
            t,
            p: DVec3::ZERO,
            at: [DVec2::from_angle(t), DVec2::new(t, 0.0)],
            tangent: DVec3::X,
            rates: [DVec2::X; 2],
            crossing: true,
        };
        let knots: Vec<Knot> = (0..=100).map(|k| knot(0.01 + f64::from(k) * 0.062)).collect();
        let runs = monotone(&knots);
        assert!(runs.len() >= 2 && runs.len() <= 4);
        assert_eq!(runs.iter().map(|r| r.len() - 1).sum::<usize>(), 100);
    }
}
