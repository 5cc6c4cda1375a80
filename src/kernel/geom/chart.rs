//! A surface as a place to find points on: where its parameters close, where it has poles, and the parameters of a
//! point in space.
//!
//! A point is located among a coarse grid of samples and then by Newton ([`super::closest`]); [`Chart::follow`] starts
//! from a place nearby and lets parameters run on over a seam, so that a curve around a closed surface has continuous
//! parameters. A surface whose loops cross its seam is cut open elsewhere by [`reseamed`], which changes no point.
//!
//! Cost: some hundred evaluations once, then a few a point. [`Chart::locate`] can miss the nearest point where the
//! surface bends between two samples; its distance then shows it.

use glam::{DVec2, DVec3};

use super::closest::{Closed, Foot, closed_directions, closest_from};
use super::{Direction, Side, Surface, SurfaceError};

/// The most samples along one direction of the grid.
const MAX_LINES: usize = 64;
/// How many of the nearest samples are tried.
const STARTS: usize = 4;
/// How far off a followed point may be before the whole surface is searched, as a fraction of its size.
const LOST: f64 = 1e-5;
/// A border shorter than this fraction of the surface's size is a pole.
const POLE: f64 = 1e-9;

/// A surface with what is needed to find points on it.
#[derive(Clone, Debug)]
pub struct Chart<'a> {
    surface: &'a Surface,
    closed: Closed,
    poles: [Option<DVec3>; 4],
    grid: Vec<(DVec2, DVec3)>,
    size: f64,
}

impl<'a> Chart<'a> {
    /// Looks at a surface.
    pub fn new(surface: &'a Surface) -> Self {
        let lines = [0, 1].map(|k| {
            let knots = &surface.knots()[k];
            let breaks = knots.breaks();
            let spans = breaks.len() - 1;
            let per_span = if knots.degree() == 1 { 1 } else { (knots.degree() + 1).clamp(3, 8) };
            let total = (spans * per_span).clamp(4, MAX_LINES);
            // Even in the knots' index, so that spans of any length get their share.
            let at = |i: usize| {
                let x = i as f64 / total as f64 * spans as f64;
                let span = (x as usize).min(spans - 1);
                breaks[span] + (breaks[span + 1] - breaks[span]) * (x - span as f64)
            };
            (0..=total).map(at).collect::<Vec<f64>>()
        });
        let mut grid = Vec::with_capacity(lines[0].len() * lines[1].len());
        let bu: Vec<_> = lines[0].iter().map(|&u| surface.knots()[0].basis(u, 0)).collect();
        for &v in &lines[1] {
            let bv = surface.knots()[1].basis(v, 0);
            for (&u, bu) in lines[0].iter().zip(&bu) {
                grid.push((DVec2::new(u, v), surface.jet_from(bu, &bv, 0).p()));
            }
        }
        let size = super::Aabb::of(grid.iter().map(|g| g.1)).diagonal();
        let poles = Side::ALL.map(|side| {
            let border = surface.border(side).ok()?;
            let first = border.points().first().copied()?;
            border.points().iter().all(|p| p.distance(first) <= POLE * size).then_some(first)
        });
        Self { surface, closed: closed_directions(surface), poles, grid, size }
    }

    /// The surface.
    pub fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// The diagonal of a box around samples of the surface.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Which directions close.
    pub fn closed(&self) -> Closed {
        self.closed
    }

    /// The length of the domain along a direction.
    pub fn period(&self, k: usize) -> f64 {
        let [a, b] = self.surface.domain()[k];
        b - a
    }

    /// The point to which a border collapses.
    pub fn pole(&self, side: Side) -> Option<DVec3> {
        self.poles[side as usize]
    }

    /// The border that is a pole within `reach` of `p`.
    pub fn pole_near(&self, p: DVec3, reach: f64) -> Option<Side> {
        Side::ALL.into_iter().find(|&s| self.pole(s).is_some_and(|pole| pole.distance(p) <= reach))
    }

    /// Parameters brought into the domain: around where it closes, to the border elsewhere.
    pub fn wrapped(&self, uv: DVec2) -> DVec2 {
        let domain = self.surface.domain();
        let mut out = self.surface.clamped(uv);
        for k in 0..2 {
            let [a, b] = domain[k];
            if self.closed[k] && !(a..=b).contains(&uv[k]) {
                out[k] = (a + (uv[k] - a).rem_euclid(b - a)).clamp(a, b);
            }
        }
        out
    }

    /// `uv` moved by whole periods so that it is as near to `to` as can be.
    pub fn unwrapped(&self, uv: DVec2, to: DVec2) -> DVec2 {
        let mut out = uv;
        for k in (0..2).filter(|&k| self.closed[k]) {
            let period = self.period(k);
            out[k] += period * ((to[k] - uv[k]) / period).round();
        }
        out
    }

    /// The point at parameters that may have run on over a seam.
    pub fn eval(&self, uv: DVec2) -> DVec3 {
        self.surface.eval(self.wrapped(uv))
    }

    /// The nearest point of the surface.
    pub fn locate(&self, p: DVec3) -> Foot {
        let mut best: [(f64, DVec2); STARTS] = [(f64::INFINITY, DVec2::ZERO); STARTS];
        for &(uv, q) in &self.grid {
            let d = p.distance_squared(q);
            if d < best[STARTS - 1].0 {
                let at = best.partition_point(|b| b.0 <= d);
                best[at..].rotate_right(1);
                best[at] = (d, uv);
            }
        }
        let mut found = closest_from(self.surface, self.closed, p, best[0].1);
        for &(_, start) in best[1..].iter().filter(|b| b.0.is_finite()) {
            if found.distance <= 1e-9 * self.size {
                break;
            }
            let other = closest_from(self.surface, self.closed, p, start);
            if other.distance < found.distance {
                found = other;
            }
        }
        found
    }

    /// The point of the surface near `p` that is found from `near`; its parameters run on from there over seams.
    pub fn follow(&self, p: DVec3, near: DVec2) -> Foot {
        let mut foot = closest_from(self.surface, self.closed, p, self.wrapped(near));
        if foot.distance > LOST * self.size {
            let other = self.locate(p);
            if other.distance < 0.5 * foot.distance {
                foot = other;
            }
        }
        foot.uv = self.unwrapped(foot.uv, near);
        foot
    }
}

/// The same closed surface cut open at `t` along a direction; its domain becomes `t..=t + period`. Exact; the old
/// seam becomes a knot of full multiplicity.
pub fn reseamed(surface: &Surface, direction: Direction, t: f64) -> Result<Surface, SurfaceError> {
    // Along u; the other direction is the same with both exchanged.
    let turned = if direction == Direction::U { surface.clone() } else { surface.swapped() };
    let [[a, b], v] = turned.domain();
    let t = if (a..b).contains(&t) { t } else { a + (t - a).rem_euclid(b - a) };
    if t <= a || t >= b {
        return Ok(surface.clone());
    }
    let (front, back) = (turned.restricted([t, b], v)?, turned.restricted([a, t], v)?);
    let p = front.knots()[0].degree();
    let mut knots = front.knots()[0].values().to_vec();
    knots.pop();
    knots.extend(back.knots()[0].values()[p + 1..].iter().map(|k| k + (b - a)));
    let ([nf, nv], [nb, _]) = (front.counts(), back.counts());
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for j in 0..nv {
        let weight = |s: &Surface, k: usize| s.weights().map_or(1.0, |w| w[k]);
        for i in 0..nf {
            points.push(front.points()[j * nf + i]);
            weights.push(weight(&front, j * nf + i));
        }
        // Homogeneous points agree at the seam up to a factor.
        let factor = weight(&front, j * nf + nf - 1) / weight(&back, j * nb);
        for i in 1..nb {
            points.push(back.points()[j * nb + i]);
            weights.push(weight(&back, j * nb + i) * factor);
        }
    }
    let ku = super::Knots::new(p, knots).map_err(|source| SurfaceError::Knots { direction, source })?;
    let rational = surface.weights().is_some();
    let out = Surface::new(ku, front.knots()[1].clone(), points, rational.then_some(weights))?;
    Ok(if direction == Direction::U { out } else { out.swapped() })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use super::super::sweep;
    use super::*;

    fn sphere() -> Surface {
        let meridian = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, -FRAC_PI_2, FRAC_PI_2).unwrap();
        sweep::revolved(&meridian, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap()
    }

    #[test]
    fn points_are_located_and_followed_over_the_seam() {
        let sphere = sphere();
        let chart = Chart::new(&sphere);
        assert_eq!(chart.closed(), [true, false]);
        assert!(chart.pole(Side::VMin).is_some() && chart.pole(Side::VMax).is_some());
        assert!(chart.pole(Side::UMin).is_none());
        let at = |a: f64| DVec3::new(a.cos(), a.sin(), 0.3).normalize() * 1.5;
        let mut near = chart.locate(at(5.0)).uv;
        for k in 0..=200 {
            let a = 5.0 + 0.1 * f64::from(k);
            let foot = chart.follow(at(a), near);
            assert!((foot.distance - 0.5).abs() < 1e-12);
            near = foot.uv;
        }
        // 20 radians further: three times over the seam.
        assert!((near.x - 25.0).abs() < 0.2, "{near}");
        assert!(chart.eval(near).distance(at(25.0) / 1.5) < 1e-12);
    }

    #[test]
    fn another_seam_changes_no_point() {
        let circle = sweep::arc(DVec3::X * 3.0, DVec3::X, DVec3::Z, 0.0, TAU).unwrap();
        let torus = sweep::revolved(&circle, DVec3::ZERO, DVec3::Z, 0.0, TAU).unwrap();
        for direction in [Direction::U, Direction::V] {
            let turned = reseamed(&torus, direction, 2.0).unwrap();
            let chart = Chart::new(&torus);
            assert_eq!(turned.domain()[direction as usize], [2.0, 2.0 + TAU]);
            for k in 0..60 {
                let uv = DVec2::new(2.0 + 0.1 * f64::from(k), 2.0 + PI * f64::from(k) / 30.0 * 0.99);
                assert!(turned.eval(turned.clamped(uv)).distance(chart.eval(turned.clamped(uv))) < 1e-12);
            }
        }
        let same = reseamed(&torus, Direction::U, 0.0).unwrap();
        assert_eq!(same, torus);
    }
}
