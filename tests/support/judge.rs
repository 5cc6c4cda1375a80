//! Judges an intersection against an oracle, as the issue defines "right": every arc covered, nothing in excess, no
//! duplicates, counts equal, every junction of the right degree, isolated points once.
#![allow(dead_code, clippy::unwrap_used, reason = "a test helper may stop the test; not every test uses all")]

use glam::DVec3;
use patchwright::kernel::ssi::Intersection;
use patchwright::kernel::ssi::result::{CurveEnd, IntersectionCurve, JunctionKind};
use serde_json::Value;

use super::cases::points;

/// The distance from a point to a polyline.
fn distance(p: DVec3, line: &[DVec3]) -> f64 {
    if line.len() == 1 {
        return p.distance(line[0]);
    }
    line.windows(2)
        .map(|w| {
            let d = w[1] - w[0];
            let t =
                if d.length_squared() > 0.0 { ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
            p.distance(w[0] + d * t)
        })
        .fold(f64::INFINITY, f64::min)
}

/// How far a point is from a polyline, beyond what the chords of the polyline themselves may be off.
fn excess(p: DVec3, line: &[DVec3]) -> f64 {
    line.windows(2).map(|w| distance(p, w) - 0.7 * w[0].distance(w[1])).fold(f64::INFINITY, f64::min)
}

fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}

fn polyline(curve: &IntersectionCurve) -> Vec<DVec3> {
    curve.points.iter().map(|p| p.xyz).collect()
}

/// Everything that is wrong; empty when the answer is right.
pub fn faults(result: &Intersection, oracle: &Value) -> Vec<String> {
    let mut out = Vec::new();
    if !result.complete {
        let reasons: Vec<&str> = result.unresolved.iter().map(|u| u.reason.as_str()).take(3).collect();
        out.push(format!("incomplete: {} unresolved, {reasons:?}", result.unresolved.len()));
    }
    let ours: Vec<Vec<DVec3>> = result.curves.iter().map(polyline).collect();
    let arcs: Vec<(Vec<DVec3>, bool, f64)> = oracle["arcs"]
        .as_array()
        .map(|list| {
            list.iter()
                .map(|a| (points(&a["pts"]), a["closed"].as_bool().unwrap(), a["tol"].as_f64().unwrap()))
                .collect()
        })
        .unwrap_or_default();
    // Coverage, each way, one curve for one arc.
    let mut taken = vec![None; ours.len()];
    for (k, (arc, closed, tol)) in arcs.iter().enumerate() {
        let covers = |line: &[DVec3]| arc.iter().map(|&p| distance(p, line)).fold(0.0, f64::max);
        let best = (0..ours.len())
            .filter(|&j| taken[j].is_none())
            .map(|j| (covers(&ours[j]), j))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match best {
            Some((worst, j)) if worst <= *tol => {
                taken[j] = Some(k);
                let back = ours[j].iter().map(|&p| excess(p, arc)).fold(0.0, f64::max);
                if back > *tol {
                    out.push(format!("curve {j} leaves arc {k} by {back:.1e}"));
                }
                if result.curves[j].closed != *closed {
                    out.push(format!("curve {j} closed: {}, arc {k}: {closed}", result.curves[j].closed));
                }
                let (mine, theirs) = (length(&ours[j]), length(arc));
                // An oracle's tiny loop is a coarse polygon.
                let coarse = if arc.len() < 20 { 0.3 } else { 0.02 };
                if (mine - theirs).abs() > coarse * theirs + 4.0 * tol {
                    out.push(format!("curve {j} has length {mine:.6}, arc {k} has {theirs:.6}"));
                }
            }
            other => out.push(format!("arc {k} ({} points, closed {closed}) is not covered: {other:?}", arc.len())),
        }
    }
    for (j, taken) in taken.iter().enumerate() {
        if taken.is_none() && result.curves[j].region.is_none() {
            out.push(format!(
                "curve {j} is in excess ({} points, length {:.3e}, {:?}, ends {:?})",
                ours[j].len(),
                length(&ours[j]),
                result.curves[j].kind,
                result.curves[j].ends
            ));
        }
    }
    if let Some(boundary) = oracle["overlap_boundary"].as_array() {
        let boundary = points(&Value::Array(boundary.clone()));
        let lines: Vec<Vec<DVec3>> =
            result.regions.iter().flat_map(|r| r.boundary.iter().map(|l| l.iter().map(|p| p.xyz).collect())).collect();
        if lines.len() != 1 {
            out.push(format!("{} region boundaries, expected 1", lines.len()));
        } else {
            let missed = boundary.iter().map(|&p| distance(p, &lines[0])).fold(0.0, f64::max);
            let extra = lines[0].iter().map(|&p| excess(p, &boundary)).fold(0.0, f64::max);
            if missed > 1e-5 || extra > 1e-5 {
                out.push(format!("the region's boundary is off by {missed:.1e} and {extra:.1e}"));
            }
        }
        if result.regions.iter().any(|r| r.max_distance > 1e-9) {
            out.push("the region's distance bound is poor".into());
        }
    }
    // Junctions and their degrees.
    let wanted = points(&oracle["junctions"]);
    let degrees: Vec<usize> = oracle["junction_degree"]
        .as_array()
        .map(|d| d.iter().map(|d| d.as_u64().unwrap() as usize).collect())
        .unwrap_or_default();
    let theta = oracle["theta"].as_f64().unwrap_or(1.0);
    let near = 1e-6_f64.max(5.0 * f64::EPSILON * 4.0 / theta);
    let found: Vec<usize> =
        (0..result.junctions.len()).filter(|&j| result.junctions[j].kind != JunctionKind::Isolated).collect();
    if found.len() != wanted.len() {
        out.push(format!("{} junctions, expected {}", found.len(), wanted.len()));
    }
    for (k, p) in wanted.iter().enumerate() {
        let Some(&j) = found
            .iter()
            .min_by(|&&x, &&y| result.junctions[x].xyz.distance(*p).total_cmp(&result.junctions[y].xyz.distance(*p)))
        else {
            continue;
        };
        let off = result.junctions[j].xyz.distance(*p);
        if off > near {
            out.push(format!("junction {k} is off by {off:.1e}"));
        }
        let degree = result
            .curves
            .iter()
            .flat_map(|c| c.ends.iter().zip(c.end_ids))
            .filter(|(end, id)| **end == CurveEnd::Junction && *id == Some(j))
            .count();
        if degrees.get(k).is_some_and(|&d| d != degree) {
            out.push(format!("junction {k} has degree {degree}, expected {}", degrees[k]));
        }
    }
    let isolated = points(&oracle["isolated"]);
    let lonely: Vec<DVec3> =
        result.junctions.iter().filter(|j| j.kind == JunctionKind::Isolated).map(|j| j.xyz).collect();
    if lonely.len() != isolated.len() {
        out.push(format!("{} isolated contacts, expected {}", lonely.len(), isolated.len()));
    }
    for p in &isolated {
        if !lonely.iter().any(|q| q.distance(*p) < 1e-5) {
            out.push(format!("the isolated contact {p} is missing"));
        }
    }
    let count = |name: &str| oracle[name].as_u64().map(|n| n as usize);
    let loops = result.curves.iter().filter(|c| c.closed && c.region.is_none()).count();
    if count("n_loops").is_some_and(|n| n != loops) {
        out.push(format!("{loops} loops, expected {}", oracle["n_loops"]));
    }
    if count("n_components").is_some_and(|n| n != components(result)) {
        out.push(format!("{} components, expected {}", components(result), oracle["n_components"]));
    }
    out
}

/// Connected components: curves joined at junctions, isolated contacts, regions.
fn components(result: &Intersection) -> usize {
    let n = result.curves.len();
    let total = n + result.junctions.len() + result.regions.len();
    let mut parent: Vec<usize> = (0..total).collect();
    fn root(parent: &[usize], mut k: usize) -> usize {
        while parent[k] != k {
            k = parent[k];
        }
        k
    }
    for (k, curve) in result.curves.iter().enumerate() {
        let mut joined: Vec<usize> = curve.end_ids.iter().flatten().map(|j| n + j).collect();
        joined.extend(curve.region.map(|r| n + result.junctions.len() + r));
        for other in joined {
            let (x, y) = (root(&parent, k), root(&parent, other));
            parent[x] = y;
        }
    }
    (0..total).filter(|&k| parent[k] == k).count()
}
