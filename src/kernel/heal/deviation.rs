//! How far a fitted patch is from the originals, HJR99 3.6.
//!
//! Check points: e and f in the middle of the spans of the grid lines along u and v, g in the middle of the
//! pieces, and the 2 x 2 Gauss points of every piece, where the oscillation of a bicubic that e, f and g may miss
//! shows. Each is measured to its true closest point on the originals. Left out are points whose piece (or span)
//! has an artificial sample or one kept away from the originals, and points that hang over a gap narrower than
//! their piece: nothing lies above or below them within the slab. Points on a kept boundary are measured to the
//! picked curve, too. Cost: one closest point, a few microseconds, each; linear in M N.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::grid::Grid;
use super::project::{Sample, Status};
use super::side::SideCurve;
use crate::kernel::geom::{Basis, Knots, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};

/// What a check point sits on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The middle of a span along u.
    E,
    /// The middle of a span along v.
    F,
    /// The middle of a piece.
    G,
    /// A Gauss point of a piece.
    Gauss,
}

/// One measured point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// What it sits on.
    pub kind: Kind,
    /// Its parameters on the patch.
    pub uv: DVec2,
    /// The point of the patch.
    pub point: DVec3,
    /// Its distance; `None` where it was left out.
    pub distance: Option<f64>,
}

/// All check points, and what they say together.
#[derive(Clone, Debug, Default)]
pub struct Deviation {
    /// In order of v, then u.
    pub checks: Vec<Check>,
    /// The largest distance at e, at f, and at g and Gauss points.
    pub max: [f64; 3],
    /// The root mean square of all.
    pub rms: f64,
    /// How many were measured.
    pub checked: usize,
    /// How many were left out.
    pub skipped: usize,
    /// Whether a cancelled job left some out.
    pub incomplete: bool,
}

impl Deviation {
    /// The largest distance of all.
    pub fn largest(&self) -> f64 {
        self.max.into_iter().fold(0.0, f64::max)
    }

    /// The worst points, largest first.
    pub fn worst(&self, count: usize) -> Vec<Check> {
        let mut sorted: Vec<Check> = self.checks.iter().filter(|c| c.distance.is_some()).copied().collect();
        sorted.sort_by(|a, b| b.distance.unwrap_or(0.0).total_cmp(&a.distance.unwrap_or(0.0)));
        sorted.truncate(count);
        sorted
    }
}

/// What a patch is measured against.
pub struct Reference<'a> {
    /// The originals.
    pub set: &'a SurfaceSet,
    /// The samples that the patch interpolates.
    pub samples: &'a Grid<Sample>,
    /// Kept sides v = 0, u = 1, v = 1, u = 0 in increasing parameter; `None` where projected.
    pub kept: [Option<&'a SideCurve>; 4],
    /// Half the thickness of the slab.
    pub slab: f64,
    /// Errors below this are good enough; only larger ones are asked whether they hang over a gap.
    pub tol: f64,
}

/// Where check points lie in a span: at its start, in its middle, at its two Gauss points.
fn places() -> [f64; 4] {
    let g = 0.5 / 3f64.sqrt();
    [0.0, 0.5, 0.5 - g, 0.5 + g]
}

/// The basis functions of one direction at the places of every span.
fn tabulated(knots: &Knots, spans: usize) -> Vec<[(f64, Basis); 4]> {
    let at = |k: usize, place: f64| (k as f64 + place) / spans as f64;
    (0..=spans).map(|k| places().map(|place| (at(k, place), knots.basis(at(k, place), 0)))).collect()
}

/// What one row of cells is measured with.
struct Row<'a> {
    surface: &'a Surface,
    reference: &'a Reference<'a>,
    u: &'a [[(f64, Basis); 4]],
    v: &'a [(f64, Basis); 4],
    j: usize,
    scratch: Scratch,
    out: Vec<Check>,
}

/// Measures a patch whose knots are uniform with the samples at them.
pub fn measure(surface: &Surface, reference: &Reference, job: &Job) -> Deviation {
    let (m, n) = (reference.samples.m(), reference.samples.n());
    let (u, v) = (tabulated(&surface.knots()[0], m), tabulated(&surface.knots()[1], n));
    let rows: Vec<Vec<Check>> = (0..=n)
        .into_par_iter()
        .map(|j| {
            let mut row = Row { surface, reference, u: &u, v: &v[j], j, scratch: Scratch::default(), out: Vec::new() };
            if !job.is_cancelled() {
                (0..=m).for_each(|i| row.cell(i));
            }
            row.out
        })
        .collect();
    let mut out = Deviation { incomplete: job.is_cancelled(), ..Deviation::default() };
    let mut squares = 0.0;
    for check in rows.into_iter().flatten() {
        if let Some(d) = check.distance {
            let slot = match check.kind {
                Kind::E => 0,
                Kind::F => 1,
                Kind::G | Kind::Gauss => 2,
            };
            out.max[slot] = out.max[slot].max(d);
            squares += d * d;
            out.checked += 1;
        } else {
            out.skipped += 1;
        }
        out.checks.push(check);
    }
    out.rms = if out.checked > 0 { (squares / out.checked as f64).sqrt() } else { 0.0 };
    out
}

impl Row<'_> {
    /// The check points that belong to the sample (i, j): e and f after it, g and the Gauss points of its piece.
    fn cell(&mut self, i: usize) {
        let samples = self.reference.samples;
        let (m, n, j) = (samples.m(), samples.n(), self.j);
        if i < m {
            let side = if j == 0 { Some(0) } else { (j == n).then_some(2) };
            self.check(Kind::E, i, [1, 0], side.map(|s| (s, self.u[i][1].0)));
        }
        if j < n {
            let side = if i == 0 { Some(3) } else { (i == m).then_some(1) };
            self.check(Kind::F, i, [0, 1], side.map(|s| (s, self.v[1].0)));
        }
        if i < m && j < n {
            self.check(Kind::G, i, [1, 1], None);
            for place in [[2, 2], [3, 2], [2, 3], [3, 3]] {
                self.check(Kind::Gauss, i, place, None);
            }
        }
    }

    /// Measures the point at places of the spans behind the sample (i, j). `side` is the side that it lies on and
    /// where.
    fn check(&mut self, kind: Kind, i: usize, place: [usize; 2], side: Option<(usize, f64)>) {
        let r = self.reference;
        let ((u, bu), (v, bv)) = (&self.u[i][place[0]], &self.v[place[1]]);
        let uv = DVec2::new(*u, *v);
        let point = self.surface.jet_from(bu, bv, 0).p();
        let kept = side.and_then(|(s, f)| {
            let spans = if s % 2 == 0 { r.samples.m() } else { r.samples.n() };
            Some(r.kept[s]?.distance_near(point, f, 1.0 / spans as f64))
        });
        let original = self.guess(i, place).and_then(|guess| {
            let foot = match guess {
                Guess::Near(surface, uv) => r.set.closest_near(point, (surface, uv), &mut self.scratch),
                Guess::Anywhere => r.set.closest(point, f64::INFINITY, &mut self.scratch),
            };
            let distance = foot?.distance;
            let hangs = distance > r.tol && over_gap(self.surface, r, uv, point, &mut self.scratch);
            (!hangs).then_some(distance)
        });
        let distance = match (kept, original) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        self.out.push(Check { kind, uv, point, distance });
    }

    /// Where on the originals a check point is about, from the samples at the corners of its piece (or the ends of
    /// its span); `None` when one of them is not on an original, so that the point is not measured to them.
    fn guess(&self, i: usize, place: [usize; 2]) -> Option<Guess> {
        let samples = self.reference.samples;
        let [s, t] = place.map(|k| places()[k]);
        let corner = |a: usize, b: usize| {
            let sample = &samples[(i + a, self.j + b)];
            if sample.status.is_projected() { sample.on } else { None }
        };
        let first = corner(0, 0)?;
        let (mut uv, mut one) = (DVec2::ZERO, true);
        for b in 0..=usize::from(t > 0.0) {
            for a in 0..=usize::from(s > 0.0) {
                let (surface, at) = corner(a, b)?;
                one &= surface == first.0;
                uv += at * (if a == 1 { s } else { 1.0 - s }) * (if b == 1 { t } else { 1.0 - t });
            }
        }
        Some(if one { Guess::Near(first.0, uv) } else { Guess::Anywhere })
    }
}

/// Where a closest point is looked for.
enum Guess {
    /// Near parameters of a surface.
    Near(usize, DVec2),
    /// Anywhere: the samples around lie on several.
    Anywhere,
}

/// Whether nothing lies above or below a point of the patch within the slab.
fn over_gap(surface: &Surface, r: &Reference, uv: DVec2, point: DVec3, scratch: &mut Scratch) -> bool {
    let Some(normal) = surface.jet(uv, 1).normal() else { return false };
    super::project::project(r.set, point, normal, r.slab, scratch).is_none()
}

/// Counts samples by status: projected, of these several, artificial, kept.
pub fn count(samples: &Grid<Sample>) -> [usize; 4] {
    let of = |s: Status| samples.values().iter().filter(|x| x.status == s).count();
    let several = of(Status::Several);
    [of(Status::Hit) + several, several, of(Status::Artificial), of(Status::Kept)]
}
