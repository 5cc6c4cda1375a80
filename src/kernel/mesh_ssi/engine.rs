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

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::join::join;
use super::near::{Place, near_places};
use super::places::{self, Step};
use super::refine::{Refined, Sheet as Touch, TANGENTIAL, refine};
use super::sheet::Sheet;
use super::topology::{Mesh, Point};
use super::trace::Chain;
use super::{MeshIntersection, intersect};
use crate::kernel::geom::closest::{closed_directions, line_from};
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::result::{
    CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind, Unresolved,
};
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
struct Pair<'s> {
    sheets: [&'s Sheet; 2],
    numbers: [usize; 2],
    common: Common,
}

/// What all pairs have in common.
#[derive(Clone, Copy)]
struct Common {
    tol: f64,
    chord_tol: f64,
    /// The distance of the two surface points that counts as none.
    floor: f64,
    max_inserted: usize,
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

    /// A chain as a curve of the answer, or as several where it passes places that are handed over: refined, and as dense as
    /// the tolerance asks for. `cuts`: which ends of each curve lie on the border of a place.
    fn finish(
        &self,
        found: &MeshIntersection,
        chain: &Chain,
        places: &[Place],
        out: &mut Intersection,
        cuts: &mut Vec<[bool; 2]>,
    ) {
        let starts: Vec<CurvePoint> = (0..chain.points.len()).map(|k| self.start_at(found, chain, k)).collect();
        let uv: Vec<DVec2> = starts.iter().map(|p| p.uv).collect();
        for steps in places::outside(&uv, chain.closed, places) {
            self.stretch(found, chain, &starts, &steps, places, out, cuts);
        }
    }

    /// One stretch of a chain.
    #[expect(clippy::too_many_arguments, reason = "a chain, its stretch, and where both go")]
    fn stretch(
        &self,
        found: &MeshIntersection,
        chain: &Chain,
        starts: &[CurvePoint],
        steps: &[Step],
        places: &[Place],
        out: &mut Intersection,
        cuts: &mut Vec<[bool; 2]>,
    ) {
        let whole = steps.len() == chain.points.len() && steps.iter().all(|s| matches!(s, Step::Node(_)));
        let closed = chain.closed && whole;
        let mut points: Vec<CurvePoint> = Vec::with_capacity(steps.len());
        let mut triangles: Vec<[u32; 2]> = Vec::with_capacity(steps.len());
        let mut failed: Option<(CurvePoint, String)> = None;
        let of_segment = |s: usize| found.topology.segments[chain.segments[s] as usize].triangles;
        for (at, step) in steps.iter().enumerate() {
            let made = match *step {
                Step::Node(k) if closed && at + 1 == steps.len() => Ok((points[0], k - 1)),
                Step::Node(k) => {
                    let point = &found.topology.points[chain.points[k] as usize];
                    let fixed = (point.uses.len() == 1).then(|| self.border(point)).flatten();
                    let own = of_segment(k.min(chain.segments.len() - 1));
                    let refined = self.at_point(starts[k], point, own, fixed).map_err(|reason| (starts[k], reason));
                    // What moves into a place when it is refined is the other engine's.
                    if refined.as_ref().is_ok_and(|p| places.iter().any(|place| place.contains(p.uv))) {
                        continue;
                    }
                    refined.map(|p| (p, k.saturating_sub(1)))
                }
                Step::Cut { segment, t, fixed, value } => {
                    let (p, q) = (starts[segment], starts[segment + 1]);
                    let mut start =
                        CurvePoint { xyz: p.xyz.lerp(q.xyz, t), uv: p.uv.lerp(q.uv, t), st: p.st.lerp(q.st, t), ..p };
                    start.uv[fixed] = value;
                    let cut = self.refined(start, of_segment(segment), Some((0, fixed)));
                    cut.map(|p| (p, segment)).map_err(|reason| (start, reason))
                }
            };
            // The triangles of the chord that ends here; a chord over several segments takes the last one's.
            let (point, segment) = made.unwrap_or_else(|(start, reason)| {
                failed.get_or_insert((start, reason));
                (start, 0)
            });
            if !points.is_empty() {
                triangles.push(of_segment(segment));
            }
            points.push(point);
        }
        if points.len() < 2 {
            return;
        }
        let (points, error_bound) = self.adapted(points, &triangles, closed);
        let cut = [steps.first(), steps.last()].map(|s| matches!(s, Some(Step::Cut { .. })));
        let end = |e: usize| match steps[if e == 0 { 0 } else { steps.len() - 1 }] {
            Step::Node(k) if found.topology.points[chain.points[k] as usize].uses.len() != 1 => CurveEnd::Junction,
            _ => CurveEnd::Boundary,
        };
        let ends = if closed { [CurveEnd::Loop; 2] } else { [end(0), end(1)] };
        if failed.is_none() && error_bound > self.common.tol {
            let reason = format!("{} points were inserted and {error_bound:.3e} is left", self.common.max_inserted);
            failed = points.first().map(|p| (*p, reason));
        }
        let mut end_ids = [None; 2];
        for (k, id) in end_ids.iter_mut().enumerate().filter(|(k, _)| ends[*k] == CurveEnd::Junction) {
            let at = if k == 0 { points[0] } else { points[points.len() - 1] };
            *id = Some(bifurcation(&at, 1e3 * self.common.floor, &mut out.junctions));
        }
        if let Some((at, reason)) = failed {
            out.unresolved.push(Unresolved {
                a: at.a,
                uv_box: [[at.uv.x; 2], [at.uv.y; 2]],
                b: at.b,
                st_box: [[at.st.x; 2], [at.st.y; 2]],
                reason,
            });
        }
        out.curves.push(IntersectionCurve {
            kind: CurveKind::Transversal,
            closed,
            ends,
            end_ids,
            error_bound,
            region: None,
            points,
        });
        cuts.push(cut);
    }

    /// A point of a chain with its parameters on both sides.
    fn start_at(&self, found: &MeshIntersection, chain: &Chain, k: usize) -> CurvePoint {
        let point = &found.topology.points[chain.points[k] as usize];
        let segment = chain.segments[k.min(chain.segments.len() - 1)];
        self.start(point, found.topology.segments[segment as usize].triangles)
    }

    /// A point of the triangulations with its parameters on both sides.
    fn start(&self, point: &Point, triangles: [u32; 2]) -> CurvePoint {
        let p = point.position;
        let [a, b] = self.sheets;
        let (uv, st) = match point.key.edge_of {
            Mesh::A => (a.uv_on(point.key.edge, p), b.uv_in(triangles[1], p)),
            Mesh::B => (a.uv_in(triangles[0], p), b.uv_on(point.key.edge, p)),
        };
        let [na, nb] = self.numbers;
        CurvePoint { xyz: p, a: na, uv, b: nb, st }
    }

    /// For the end of a curve on the border of a surface: the side whose border it is, and which of its
    /// parameters stays where it is.
    fn border(&self, point: &Point) -> Option<(usize, usize)> {
        let side = usize::from(point.key.edge_of == Mesh::B);
        let sheet = self.sheets[side];
        let domain = sheet.surface()?.domain();
        let uv = point.key.edge.map(|k| sheet.uv_of(k));
        (0..2).find(|&d| uv[0][d] == uv[1][d] && domain[d].contains(&uv[0][d])).map(|d| (side, d))
    }

    /// The point of both sheets next to a point of the triangulations. One that lies on an edge of a mesh stays on it.
    fn at_point(
        &self,
        start: CurvePoint,
        point: &Point,
        triangles: [u32; 2],
        fixed: Option<(usize, usize)>,
    ) -> Result<CurvePoint, String> {
        let side = usize::from(point.key.edge_of == Mesh::B);
        let (own, other) = (self.sheets[side], self.sheets[1 - side]);
        if let (None, Some(surface)) = (own.surface(), other.surface()) {
            let [p, q] = own.edge(point.key.edge);
            let uv = if side == 0 { start.st } else { start.uv };
            let foot = line_from(surface, closed_directions(surface), p, q - p, uv);
            // An edge that only the triangles meet is left to the planes.
            if foot.residual <= self.common.floor.max(1e-3 * self.common.tol) && (-1e-9..=1.0 + 1e-9).contains(&foot.t)
            {
                let mut at = CurvePoint { xyz: foot.point, ..start };
                *(if side == 0 { &mut at.st } else { &mut at.uv }) = foot.uv;
                return Ok(at);
            }
        }
        self.refined(start, triangles, fixed)
    }

    /// The point of both sheets next to `start`.
    fn refined(
        &self,
        start: CurvePoint,
        triangles: [u32; 2],
        fixed: Option<(usize, usize)>,
    ) -> Result<CurvePoint, String> {
        let [a, b] = self.sheets;
        if a.surface().is_none() && b.surface().is_none() {
            return Ok(start);
        }
        let touch = |side: usize, uv: DVec2| match self.sheets[side].surface() {
            Some(surface) => Touch::Surface(surface, uv),
            None => {
                let (corner, normal) = self.sheets[side].plane(triangles[side]);
                Touch::Plane(corner, normal)
            }
        };
        let with =
            |r: Refined| CurvePoint { xyz: r.point, uv: r.a.unwrap_or(start.uv), st: r.b.unwrap_or(start.st), ..start };
        match fixed {
            Some((side, direction)) => {
                let uv = [start.uv, start.st];
                let other = touch(1 - side, uv[1 - side]);
                let (own, other) =
                    super::border::meet(self.sheets[side].surface(), uv[side], direction, other, self.common.floor)
                        .ok_or_else(|| {
                            "the end of a curve on a border was not reached from the triangles".to_owned()
                        })?;
                let mut point = start;
                (point.uv, point.st) =
                    if side == 0 { (own.0, other.unwrap_or(start.st)) } else { (other.unwrap_or(start.uv), own.0) };
                point.xyz = own.1;
                Ok(point)
            }
            None => refine(touch(0, start.uv), touch(1, start.st), self.common.floor)
                .or_else(|_| refine(touch(0, start.uv), touch(1, start.st), 1e-3 * self.common.tol))
                .map(with)
                .map_err(|e| format!("{e} (normals within {TANGENTIAL} rad are for the hybrid engine)")),
        }
    }

    /// Inserts points where the middle of a chord is off by more than the tolerance, then drops points that are
    /// not needed. `triangles`: those of each chord. Returns the points and a bound of the distance of the polyline,
    /// from what is measured at chord middles.
    fn adapted(&self, points: Vec<CurvePoint>, triangles: &[[u32; 2]], closed: bool) -> (Vec<CurvePoint>, f64) {
        if self.sheets.iter().all(|s| s.surface().is_none()) {
            // The segments of two meshes are the truth.
            return (points, self.common.floor);
        }
        let middle = |p: &CurvePoint, q: &CurvePoint, triangles: [u32; 2]| {
            let start =
                CurvePoint { xyz: 0.5 * (p.xyz + q.xyz), uv: 0.5 * (p.uv + q.uv), st: 0.5 * (p.st + q.st), ..*p };
            self.refined(start, triangles, None).ok().map(|m| (m, distance_to_chord(m.xyz, p.xyz, q.xyz)))
        };
        let mut dense = vec![points[0]];
        let mut worst = 0.0_f64;
        for (pair, &triangles) in points.windows(2).zip(triangles) {
            let mut stack = vec![pair[1]];
            let mut inserted = 0;
            while let (Some(&from), Some(&to)) = (dense.last(), stack.last()) {
                match middle(&from, &to, triangles) {
                    Some((m, off)) if off > 0.25 * self.common.tol && inserted < self.common.max_inserted => {
                        inserted += 1;
                        stack.push(m);
                    }
                    measured => {
                        worst = worst.max(measured.map_or(0.0, |(_, off)| off));
                        dense.push(to);
                        stack.pop();
                    }
                }
            }
        }
        let mut kept = vec![dense[0]];
        let mut dropped = 0.0_f64;
        let mut at = 0;
        while at + 1 < dense.len() {
            let mut next = at + 1;
            // A closed curve keeps at least three chords.
            let limit = if closed { dense.len() / 3 } else { dense.len() };
            while next + 1 < dense.len() && next + 1 - at <= limit.max(1) {
                let off = (at + 1..=next)
                    .map(|k| distance_to_chord(dense[k].xyz, dense[at].xyz, dense[next + 1].xyz))
                    .fold(0.0, f64::max);
                if off > 0.25 * self.common.tol {
                    break;
                }
                dropped = dropped.max(off);
                next += 1;
            }
            kept.push(dense[next]);
            at = next;
        }
        (kept, 1.5 * worst + dropped + self.common.floor)
    }
}

/// The number of the junction at a point in which more than two segments meet, made when it is new.
fn bifurcation(at: &CurvePoint, same: f64, junctions: &mut Vec<Junction>) -> usize {
    junctions.iter().position(|j| j.xyz.distance(at.xyz) <= same).unwrap_or_else(|| {
        let kind = JunctionKind::HigherOrder;
        junctions.push(Junction { xyz: at.xyz, a: at.a, uv: at.uv, b: at.b, st: at.st, gap: 0.0, kind });
        junctions.len() - 1
    })
}

fn distance_to_chord(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let chord = b - a;
    let t = ((p - a).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
    p.distance(a + chord * if t.is_finite() { t } else { 0.0 })
}
