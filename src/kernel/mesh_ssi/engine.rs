//! The whole of HJR99 section 4: triangulate, intersect the trees, trace, refine on the parametric sides, insert
//! and delete points to meet the tolerance. The answer has the form of the hybrid engine's.
//!
//! Places at which two surfaces come near with agreeing normals (see [`super::near`]) are handed over to the hybrid engine,
//! which intersects the first surface restricted to each of them with the second one, and the curves of both engines are
//! joined at the borders of the places ([`super::places`]); a warning says so. There the triangles decide nothing, elsewhere
//! the topology is theirs. A pair goes over as a whole where the places are most of the surface, where a point outside them
//! cannot be refined, or where the curves do not join. A mesh or block is its own truth:
//! against one, a point is refined on the surface's side only, along the edge of the mesh on which it lies or in the
//! plane of the triangle. `error_bound` is measured at the middle of every chord, on both sides.
//!
//! Branches of three different bodies meet in points (HJR99 4), which are found when curves have been cut down to faces:
//! see [`crate::kernel::ssi::triple`].

use std::time::Instant;

use rayon::prelude::*;

use super::intersect;
use super::join::join;
use super::near::{Place, near_places};
use super::places;
use super::sheet::Sheet;
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::result::{Intersection, Unresolved};
use crate::kernel::ssi::{self, SsiOptions};

/// What the ends of two curves on a common border may be apart, as a fraction of the diagonal.
const JOINING: f64 = 1e-9;

/// How to intersect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshSsiOptions {
    /// How closely curves follow, in model units. Default: 1e-6 of the diagonal.
    pub tol: Option<f64>,
    /// How closely triangles follow parametric surfaces, in model units. Default: 1e-4 of the diagonal.
    pub chord_tol: Option<f64>,
    /// The most points that a chord may be cut into. Default 1024.
    pub max_inserted: usize,
}

impl Default for MeshSsiOptions {
    fn default() -> Self {
        Self { tol: None, chord_tol: None, max_inserted: 1024 }
    }
}

/// Why bodies were not intersected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshSsiError {
    /// A tolerance is not positive.
    #[error("the {what} is {value}, it must be positive and finite")]
    Tolerance {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// One side is empty.
    #[error("side {side} has nothing to intersect")]
    Empty {
        /// `a` or `b`.
        side: char,
    },
}

/// What one pair of bodies has in common with another: their numbers and tolerances.
pub(super) struct Pair<'s> {
    pub(super) sheets: [&'s Sheet; 2],
    pub(super) numbers: [usize; 2],
    pub(super) common: Common,
}

/// What all pairs have in common.
#[derive(Clone, Copy)]
pub(super) struct Common {
    pub(super) tol: f64,
    chord_tol: f64,
    /// The distance of the two surface points that counts as none.
    pub(super) floor: f64,
    pub(super) max_inserted: usize,
    diagonal: f64,
}

/// Intersects all bodies of one side with all of the other; each comes with its number.
pub fn intersect_bodies(
    a: &[(usize, Body)],
    b: &[(usize, Body)],
    options: &MeshSsiOptions,
    job: &Job,
) -> Result<Intersection, MeshSsiError> {
    for (side, bodies) in [('a', a), ('b', b)] {
        if bodies.is_empty() {
            return Err(MeshSsiError::Empty { side });
        }
    }
    let pairs = (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| [i, a.len() + j])).collect();
    run(&[a, b].concat(), pairs, options, job)
}

/// Intersects every two of some bodies, the one that comes first as `a`.
pub fn intersect_all(
    bodies: &[(usize, Body)],
    options: &MeshSsiOptions,
    job: &Job,
) -> Result<Intersection, MeshSsiError> {
    if bodies.len() < 2 {
        return Err(MeshSsiError::Empty { side: if bodies.is_empty() { 'a' } else { 'b' } });
    }
    let pairs = (0..bodies.len()).flat_map(|i| (i + 1..bodies.len()).map(move |j| [i, j])).collect();
    run(bodies, pairs, options, job)
}

/// Intersects pairs of bodies, in parallel and with the result in the order of the pairs.
fn run(
    bodies: &[(usize, Body)],
    mut pairs: Vec<[usize; 2]>,
    options: &MeshSsiOptions,
    job: &Job,
) -> Result<Intersection, MeshSsiError> {
    let bounds = bodies.iter().fold(Aabb::EMPTY, |all, (_, body)| all.union(&body.bounds()));
    let diagonal = bounds.diagonal();
    let (tol, chord_tol) = (options.tol.unwrap_or(1e-6 * diagonal), options.chord_tol.unwrap_or(1e-4 * diagonal));
    for (what, value) in [("tolerance", tol), ("chord tolerance", chord_tol)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(MeshSsiError::Tolerance { what, value });
        }
    }
    let start = Instant::now();
    job.phase("Triangulating");
    let sheets: Vec<Sheet> = bodies.par_iter().map(|(_, body)| Sheet::new(body, chord_tol)).collect();
    let mut out = Intersection { tol, complete: true, ..Intersection::default() };
    for ((number, _), sheet) in bodies.iter().zip(&sheets) {
        if sheet.capped {
            job.warn(format!("surface {number}: the triangulation is coarser than the chord tolerance asks for"));
            out.complete = false;
        }
    }
    out.time_ms.build = start.elapsed().as_secs_f64() * 1e3;
    out.counts.nodes_built = sheets.iter().map(|s| s.tree().len()).sum();
    let near = |&[i, j]: &[usize; 2]| bodies[i].1.bounds().grown(2.0 * chord_tol).overlaps(&bodies[j].1.bounds());
    pairs.retain(near);
    let floor = 1e-14 * (diagonal + bounds.max_abs());
    let common = Common { tol, chord_tol, floor, max_inserted: options.max_inserted, diagonal };
    job.phase("Intersecting triangles");
    let done = std::sync::atomic::AtomicUsize::new(0);
    let found: Vec<(Intersection, Option<String>)> = pairs
        .par_iter()
        .map(|&[i, j]| {
            let pair = Pair { sheets: [&sheets[i], &sheets[j]], numbers: [bodies[i].0, bodies[j].0], common };
            let found = pair.intersect(job);
            let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            job.progress(done as f64 / pairs.len() as f64);
            found
        })
        .collect();
    for (part, note) in found {
        note.into_iter().for_each(|note| job.warn(note));
        out.append(part);
    }
    out.curves = join(std::mem::take(&mut out.curves), JOINING * diagonal);
    out.complete &= out.unresolved.is_empty() && !job.is_cancelled();
    Ok(out)
}

/// Lets the hybrid engine intersect a pair of surfaces.
fn handed_over(numbers: [usize; 2], a: &Surface, b: &Surface, tol: f64, job: &Job) -> Intersection {
    let options = SsiOptions { tol: Some(tol), ..SsiOptions::default() };
    match ssi::intersect(&[(numbers[0], a)], &[(numbers[1], b)], &options, job) {
        Ok(found) => found,
        Err(error) => Intersection {
            unresolved: vec![Unresolved {
                a: numbers[0],
                uv_box: a.domain(),
                b: numbers[1],
                st_box: b.domain(),
                reason: format!("the hybrid engine says: {error}"),
            }],
            ..Intersection::default()
        },
    }
}

impl Pair<'_> {
    /// All of one pair, and a note where the hybrid engine did it.
    fn intersect(&self, job: &Job) -> (Intersection, Option<String>) {
        let mut out = Intersection { complete: true, ..Intersection::default() };
        let [sa, sb] = self.sheets;
        let [na, nb] = self.numbers;
        if job.is_cancelled() {
            return (Intersection::default(), None);
        }
        let start = Instant::now();
        let near = near_places(sa, sb, 2.0 * self.common.chord_tol, job);
        let mut note = None;
        let why = match &near {
            None => Some("come near with agreeing normals over most of the first one".to_owned()),
            Some(places) => {
                let found = intersect(sa.triangles(), sa.tree(), sb.triangles(), sb.tree(), job);
                out.time_ms.traverse = start.elapsed().as_secs_f64() * 1e3;
                out.complete = found.complete;
                out.counts.leaf_pairs = found.topology.segments.len();
                let mut cuts = Vec::new();
                for chain in &found.chains {
                    self.finish(&found, chain, places, &mut out, &mut cuts);
                }
                let unrefined =
                    out.unresolved.first().map(|u| format!("have a point that cannot be refined ({})", u.reason));
                match (unrefined, sa.surface(), sb.surface()) {
                    (None, Some(a), Some(b)) if !places.is_empty() => {
                        let joined = self.with_places(std::mem::take(&mut out), &cuts, places, [a, b], job);
                        let count = places.len();
                        let what = if count == 1 { "at one place, which was" } else { "at places which were" };
                        note = Some(format!(
                            "surfaces {na} and {nb} come near with agreeing normals {what} handed over to the hybrid \
                             engine ({count})"
                        ));
                        match joined {
                            Some(joined) => {
                                out = joined;
                                None
                            }
                            None => Some("have curves that do not join where they come near".to_owned()),
                        }
                    }
                    (unrefined, ..) => unrefined,
                }
            }
        };
        if let (Some(why), Some(a), Some(b)) = (why, sa.surface(), sb.surface()) {
            note = Some(format!("surfaces {na} and {nb} {why}: handed over to the hybrid engine as a whole"));
            out = handed_over([na, nb], a, b, self.common.tol, job);
        }
        out.time_ms.curves = start.elapsed().as_secs_f64() * 1e3 - out.time_ms.traverse;
        (out, note)
    }

    /// What was found outside the places with what the hybrid engine finds in them; `None` when it does not fit together.
    fn with_places(
        &self,
        outer: Intersection,
        cuts: &[[bool; 2]],
        places: &[Place],
        surfaces: [&Surface; 2],
        job: &Job,
    ) -> Option<Intersection> {
        let [a, b] = surfaces;
        let inner = places.iter().map(|place| {
            let piece = a.restricted([place.low.x, place.high.x], [place.low.y, place.high.y]).ok()?;
            Some(handed_over(self.numbers, &piece, b, self.common.tol, job))
        });
        let inner: Vec<Intersection> = inner.collect::<Option<_>>()?;
        places::together(outer, cuts, inner, surfaces, self.common.tol, JOINING * self.common.diagonal)
    }
}
