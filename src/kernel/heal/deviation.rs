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
use crate::kernel::geom::Surface;
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

/// Measures a patch whose knots are uniform with the samples at them.
pub fn measure(surface: &Surface, reference: &Reference, job: &Job) -> Deviation {
    let (m, n) = (reference.samples.m(), reference.samples.n());
    let rows: Vec<Vec<Check>> = (0..=n)
        .into_par_iter()
        .map(|j| {
            let mut scratch = Scratch::default();
            let mut row = Vec::new();
            if job.is_cancelled() {
                return row;
            }
            for i in 0..=m {
                cell(surface, reference, i, j, &mut scratch, &mut row);
            }
            row
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

/// The check points that belong to the sample (i, j): e and f after it, g and the Gauss points of its piece.
fn cell(surface: &Surface, r: &Reference, i: usize, j: usize, scratch: &mut Scratch, out: &mut Vec<Check>) {
    let (m, n) = (r.samples.m(), r.samples.n());
    let at = |a: f64, b: f64| DVec2::new((i as f64 + a) / m as f64, (j as f64 + b) / n as f64);
    let on = |a: usize, b: usize| r.samples[(i + a, j + b)].status.is_projected();
    let mut add = |kind, uv, corners: bool, side: Option<(usize, f64)>| {
        out.push(check(surface, r, kind, uv, corners, side, scratch));
    };
    if i < m {
        let side = if j == 0 { Some(0) } else { (j == n).then_some(2) };
        add(Kind::E, at(0.5, 0.0), on(0, 0) && on(1, 0), side.map(|s| (s, at(0.5, 0.0).x)));
    }
    if j < n {
        let side = if i == 0 { Some(3) } else { (i == m).then_some(1) };
        add(Kind::F, at(0.0, 0.5), on(0, 0) && on(0, 1), side.map(|s| (s, at(0.0, 0.5).y)));
    }
    if i < m && j < n {
        let corners = on(0, 0) && on(1, 0) && on(0, 1) && on(1, 1);
        add(Kind::G, at(0.5, 0.5), corners, None);
        let g = 0.5 / 3f64.sqrt();
        for (a, b) in [(-g, -g), (g, -g), (-g, g), (g, g)] {
            add(Kind::Gauss, at(0.5 + a, 0.5 + b), corners, None);
        }
    }
}

fn check(
    surface: &Surface,
    r: &Reference,
    kind: Kind,
    uv: DVec2,
    corners: bool,
    side: Option<(usize, f64)>,
    scratch: &mut Scratch,
) -> Check {
    let point = surface.eval(uv);
    let kept = side.and_then(|(s, f)| {
        let spans = if s % 2 == 0 { r.samples.m() } else { r.samples.n() };
        Some(r.kept[s]?.distance_near(point, f, 1.0 / spans as f64))
    });
    let mut original = None;
    if corners {
        original = r.set.closest(point, f64::INFINITY, scratch).map(|foot| foot.distance);
        if original.is_some_and(|d| d > r.tol) && over_gap(surface, r, uv, point, scratch) {
            original = None;
        }
    }
    let distance = match (kept, original) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    };
    Check { kind, uv, point, distance }
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
