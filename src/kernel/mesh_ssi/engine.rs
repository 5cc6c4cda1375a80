//! The whole of HJR99 section 4: triangulate, intersect the trees, trace, refine on the parametric sides, insert
//! and delete points to meet the tolerance. The answer has the form of the hybrid engine's.
//!
//! A pair of surfaces that come near with agreeing normals (see [`super::near`]), or of which a point cannot be refined
//! because they do, is handed over to the hybrid engine as a whole, with a warning that says so: there the triangles
//! decide nothing. On the other pairs of surfaces the topology is that of the triangles. A mesh or block is its own truth:
//! against one, a point is refined on the surface's side only, along the edge of the mesh on which it lies or in the
//! plane of the triangle. `error_bound` is measured at the middle of every chord, on both sides.
//!
//! Branches of three different bodies meet in points (HJR99 4): see [`super::triple`].

use std::time::Instant;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::join::join;
use super::near::near_agreement;
use super::refine::{Refined, Sheet as Touch, TANGENTIAL, refine};
use super::sheet::Sheet;
use super::topology::{Mesh, Point};
use super::trace::Chain;
use super::triple;
use super::{MeshIntersection, intersect};
use crate::kernel::geom::Aabb;
use crate::kernel::geom::closest::{closed_directions, line_from};
use crate::kernel::job::Job;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::result::{
    Counts, CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Times, Unresolved,
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
    tol: f64,
    /// The distance of the two surface points that counts as none.
    floor: f64,
    max_inserted: usize,
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
    let bounds = a.iter().chain(b).fold(Aabb::EMPTY, |all, (_, body)| all.union(&body.bounds()));
    let diagonal = bounds.diagonal();
    let (tol, chord_tol) = (options.tol.unwrap_or(1e-6 * diagonal), options.chord_tol.unwrap_or(1e-4 * diagonal));
    for (what, value) in [("tolerance", tol), ("chord tolerance", chord_tol)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(MeshSsiError::Tolerance { what, value });
        }
    }
    let start = Instant::now();
    job.phase("Triangulating");
    let sheets = |bodies: &[(usize, Body)]| -> Vec<(usize, Sheet)> {
        bodies.par_iter().map(|(number, body)| (*number, Sheet::new(body, chord_tol))).collect()
    };
    let (left, right) = (sheets(a), sheets(b));
    let mut out = Intersection { tol, complete: true, ..Intersection::default() };
    for (number, sheet) in left.iter().chain(&right) {
        if sheet.capped {
            job.warn(format!("surface {number}: the triangulation is coarser than the chord tolerance asks for"));
            out.complete = false;
        }
    }
    let mut times = Times { build: start.elapsed().as_secs_f64() * 1e3, ..Times::default() };
    for (done, ((na, sa), (nb, sb))) in left.iter().flat_map(|l| right.iter().map(move |r| (l, r))).enumerate() {
        job.progress(done as f64 / (left.len() * right.len()) as f64);
        if job.is_cancelled() {
            out.complete = false;
            break;
        }
        let start = Instant::now();
        if let Some([ta, _]) = near_agreement(sa, sb, 2.0 * chord_tol, job) {
            let at = sa.plane(ta).0;
            hand_over([(*na, sa), (*nb, sb)], tol, &format!("come near with agreeing normals at {at}"), &mut out, job);
            times.curves += start.elapsed().as_secs_f64() * 1e3;
            continue;
        }
        let found = intersect(sa.triangles(), sa.tree(), sb.triangles(), sb.tree(), job);
        times.traverse += start.elapsed().as_secs_f64() * 1e3;
        out.complete &= found.complete;
        out.counts.leaf_pairs += found.topology.segments.len();
        let start = Instant::now();
        let pair = Pair {
            sheets: [sa, sb],
            numbers: [*na, *nb],
            tol,
            floor: 1e-14 * (diagonal + bounds.max_abs()),
            max_inserted: options.max_inserted,
        };
        let before = (out.curves.len(), out.unresolved.len());
        for chain in &found.chains {
            pair.finish(&found, chain, &mut out);
        }
        if let Some(place) = out.unresolved.get(before.1).filter(|_| sa.surface().is_some() && sb.surface().is_some()) {
            let why = format!("have a point that cannot be refined ({})", place.reason);
            out.curves.truncate(before.0);
            out.unresolved.truncate(before.1);
            hand_over([(*na, sa), (*nb, sb)], tol, &why, &mut out, job);
        }
        times.curves += start.elapsed().as_secs_f64() * 1e3;
    }
    out.curves = join(std::mem::take(&mut out.curves), JOINING * diagonal);
    let all: Vec<(usize, &Sheet)> = left.iter().chain(&right).map(|(n, s)| (*n, s)).collect();
    out.junctions.extend(triple::points(&out.curves, &all, JOINING * diagonal, job));
    out.complete &= out.unresolved.is_empty();
    out.counts = Counts { nodes_built: left.iter().chain(&right).map(|(_, s)| s.tree().len()).sum(), ..out.counts };
    out.time_ms = times;
    Ok(out)
}

/// Lets the hybrid engine intersect a pair of surfaces, and adds what it finds.
fn hand_over(pair: [(usize, &Sheet); 2], tol: f64, why: &str, out: &mut Intersection, job: &Job) {
    let [(na, sa), (nb, sb)] = pair;
    let (Some(a), Some(b)) = (sa.surface(), sb.surface()) else { return };
    job.warn(format!("surfaces {na} and {nb} {why}: handed over to the hybrid engine"));
    let options = SsiOptions { tol: Some(tol), ..SsiOptions::default() };
    match ssi::intersect(&[(na, a.as_ref())], &[(nb, b.as_ref())], &options, job) {
        Ok(found) => out.append(found),
        Err(error) => {
            out.unresolved.push(Unresolved {
                a: na,
                uv_box: a.domain(),
                b: nb,
                st_box: b.domain(),
                reason: format!("the hybrid engine says: {error}"),
            });
        }
    }
}

impl Pair<'_> {
    /// A chain as a curve of the answer: refined, and as dense as the tolerance asks for.
    fn finish(&self, found: &MeshIntersection, chain: &Chain, out: &mut Intersection) {
        let mut points: Vec<CurvePoint> = Vec::with_capacity(chain.points.len());
        let mut failed: Option<(CurvePoint, String)> = None;
        for (k, &number) in chain.points.iter().enumerate() {
            if chain.closed && k + 1 == chain.points.len() {
                points.push(points[0]);
                break;
            }
            let point = &found.topology.points[number as usize];
            let segment = found.topology.segments[chain.segments[k.min(chain.segments.len() - 1)] as usize];
            let start = self.start(point, segment.triangles);
            let fixed = (point.uses.len() == 1).then(|| self.border(point)).flatten();
            match self.at_point(start, point, segment.triangles, fixed) {
                Ok(refined) => points.push(refined),
                Err(reason) => {
                    failed.get_or_insert((start, reason));
                    points.push(start);
                }
            }
        }
        let triangles: Vec<[u32; 2]> =
            chain.segments.iter().map(|&s| found.topology.segments[s as usize].triangles).collect();
        let (points, error_bound) = self.adapted(points, &triangles, chain.closed);
        let end = |at: u32| match found.topology.points[at as usize].uses.len() {
            1 => CurveEnd::Boundary,
            _ => CurveEnd::Junction,
        };
        let ends = if chain.closed {
            [CurveEnd::Loop; 2]
        } else {
            [end(chain.points[0]), end(chain.points[chain.points.len() - 1])]
        };
        if failed.is_none() && error_bound > self.tol {
            let reason = format!("{} points were inserted and {error_bound:.3e} is left", self.max_inserted);
            failed = points.first().map(|p| (*p, reason));
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
            closed: chain.closed,
            ends,
            end_ids: [None, None],
            error_bound,
            region: None,
            points,
        });
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
            if foot.residual <= self.floor.max(1e-3 * self.tol) && (-1e-9..=1.0 + 1e-9).contains(&foot.t) {
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
                    super::border::meet(self.sheets[side].surface(), uv[side], direction, other, self.floor)
                        .ok_or_else(|| {
                            "the end of a curve on a border was not reached from the triangles".to_owned()
                        })?;
                let mut point = start;
                (point.uv, point.st) =
                    if side == 0 { (own.0, other.unwrap_or(start.st)) } else { (other.unwrap_or(start.uv), own.0) };
                point.xyz = own.1;
                Ok(point)
            }
            None => refine(touch(0, start.uv), touch(1, start.st), self.floor)
                .or_else(|_| refine(touch(0, start.uv), touch(1, start.st), 1e-3 * self.tol))
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
            return (points, self.floor);
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
                    Some((m, off)) if off > 0.25 * self.tol && inserted < self.max_inserted => {
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
                if off > 0.25 * self.tol {
                    break;
                }
                dropped = dropped.max(off);
                next += 1;
            }
            kept.push(dense[next]);
            at = next;
        }
        (kept, 1.5 * worst + dropped + self.floor)
    }
}

fn distance_to_chord(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let chord = b - a;
    let t = ((p - a).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
    p.distance(a + chord * if t.is_finite() { t } else { 0.0 })
}
