//! Points of three bodies: where the intersection of one body with a second crosses that with a third (HJR99 section 4,
//! "curve-curve intersections").
//!
//! Chords of two curves that have exactly one body in common and come near are candidates; the point is that in which
//! the three tangent planes meet, with every parameter pair following it in its own plane, as in
//! [`super::refine`]. Curves that run on into one another at a shared border of neighbouring patches do not cross there:
//! ends do not count, and neither do planes that have no common point.

use glam::DVec3;

use super::refine::{Sheet as Touch, refine_three};
use super::sheet::Sheet;
use crate::kernel::job::Job;
use crate::kernel::mesh::tri_tree::TriTree;
use crate::kernel::ssi::result::{CurvePoint, IntersectionCurve, Junction, JunctionKind};

/// How far, in chord lengths, a refined point may be from its chords.
const REACH: f64 = 1.0;

/// The points of three bodies on these curves, one entry for each of the two curves that cross. `same`: what two
/// points may be apart and still be one.
pub fn points(curves: &[IntersectionCurve], sheets: &[(usize, &Sheet)], same: f64, job: &Job) -> Vec<Junction> {
    job.phase("Looking for points of three bodies");
    let mut corners: Vec<DVec3> = Vec::new();
    let mut owners: Vec<(usize, usize)> = Vec::new();
    for (c, curve) in curves.iter().enumerate() {
        for (k, pair) in curve.points.windows(2).enumerate() {
            if pair[0].a == pair[1].a && pair[0].b == pair[1].b {
                owners.push((c, k));
                corners.extend([pair[0].xyz, pair[1].xyz]);
            }
        }
    }
    let chords: Vec<[u32; 3]> = (0..owners.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect();
    let tree = TriTree::new(corners, &chords);
    let margin = curves.iter().map(|c| c.error_bound).fold(same, f64::max);
    let mut out: Vec<Junction> = Vec::new();
    let mut pairs = tree.pairs_within(&tree, margin, job);
    pairs.retain(|[k, m]| k < m);
    pairs.sort_unstable();
    for [k, m] in pairs {
        let ((c, at), (d, other)) = (owners[k as usize], owners[m as usize]);
        if c == d {
            continue;
        }
        let (p, q) = (&curves[c].points[at..at + 2], &curves[d].points[other..other + 2]);
        let Some(third) = third_body(&p[0], &q[0]) else { continue };
        let Some((s, t, gap)) = nearest([p[0].xyz, p[1].xyz], [q[0].xyz, q[1].xyz]) else { continue };
        if gap > 2.0 * margin {
            continue;
        }
        let (on_c, on_d) = (between(p, s), between(q, t));
        let Some(point) = refined(&on_c, &on_d, third, sheets) else { continue };
        let chord = p[0].xyz.distance(p[1].xyz).max(q[0].xyz.distance(q[1].xyz));
        let off = point.1.distance(on_c.xyz).max(point.1.distance(on_d.xyz));
        let at_end = |curve: &IntersectionCurve| {
            let ends = [&curve.points[0], &curve.points[curve.points.len() - 1]];
            !curve.closed && ends.iter().any(|e| e.xyz.distance(point.1) <= same)
        };
        if off > REACH * chord + margin || at_end(&curves[c]) || at_end(&curves[d]) {
            continue;
        }
        for found in point.0 {
            let known = |j: &Junction| j.a == found.a && j.b == found.b && j.xyz.distance(found.xyz) <= same;
            if !out.iter().any(known) {
                out.push(found);
            }
        }
    }
    out
}

/// Of two points on three bodies in all: the body of the second that is not of the first.
fn third_body(p: &CurvePoint, q: &CurvePoint) -> Option<usize> {
    let new: Vec<usize> = [q.a, q.b].into_iter().filter(|n| *n != p.a && *n != p.b).collect();
    if let [third] = new[..] { Some(third) } else { None }
}

fn between(pair: &[CurvePoint], s: f64) -> CurvePoint {
    let [p, q] = [&pair[0], &pair[1]];
    CurvePoint { xyz: p.xyz.lerp(q.xyz, s), uv: p.uv.lerp(q.uv, s), st: p.st.lerp(q.st, s), ..*p }
}

/// The nearest places of two segments and their distance.
fn nearest(p: [DVec3; 2], q: [DVec3; 2]) -> Option<(f64, f64, f64)> {
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, b, c, d, e) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let det = a * c - b * b;
    if !(det > 1e-12 * a * c) {
        return None;
    }
    let s = ((b * e - c * d) / det).clamp(0.0, 1.0);
    let t = ((b * s + e) / c).clamp(0.0, 1.0);
    let s = ((b * t - d) / a).clamp(0.0, 1.0);
    Some((s, t, (p[0] + u * s).distance(q[0] + v * t)))
}

/// The point of all three bodies near two points, as junctions of both curves.
fn refined(p: &CurvePoint, q: &CurvePoint, third: usize, sheets: &[(usize, &Sheet)]) -> Option<([Junction; 2], DVec3)> {
    let touch = |number: usize, uv: glam::DVec2, at: DVec3| -> Option<Touch<'_>> {
        let (_, sheet) = sheets.iter().find(|(n, _)| *n == number)?;
        Some(match sheet.surface() {
            Some(surface) => Touch::Surface(surface, uv),
            None => {
                let (corner, normal) = sheet.plane(sheet.tree().nearest(at, f64::INFINITY)?.triangle);
                Touch::Plane(corner, normal)
            }
        })
    };
    let third_uv = if q.a == third { q.uv } else { q.st };
    let three = [touch(p.a, p.uv, p.xyz)?, touch(p.b, p.st, p.xyz)?, touch(third, third_uv, q.xyz)?];
    let scale = p.xyz.abs().max_element().max(f64::MIN_POSITIVE);
    let (xyz, uv, gap) = refine_three(three, 1e-12 * scale).ok()?;
    let on = |body: usize, otherwise: glam::DVec2| {
        let place = [p.a, p.b, third].iter().position(|n| *n == body);
        place.and_then(|k| uv[k]).unwrap_or(otherwise)
    };
    let junction = |c: &CurvePoint| Junction {
        xyz,
        a: c.a,
        uv: on(c.a, c.uv),
        b: c.b,
        st: on(c.b, c.st),
        gap,
        kind: JunctionKind::ThreeSurfaces,
    };
    Some(([junction(p), junction(q)], xyz))
}
