//! All pairs of a model: every two surfaces whose boxes meet, intersected, and the curves of neighbouring pairs joined.
//!
//! Pairs are found by a sweep over the surfaces' boxes, intersected in parallel, and put together in the order of
//! their numbers, so that the result does not depend on the number of threads. Tolerances come from the whole model.
//! A curve that leaves one patch through an edge and goes on in the neighbouring patch against the same third surface
//! is one curve, as it is where the neighbours are one side of [`super::intersect`].
//!
//! Cost: that of the pairs. Cancelling keeps the pairs that are done; the others are listed as unresolved.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::engine;
use super::options::{SsiError, SsiOptions};
use super::result::{CurveEnd, Intersection, IntersectionCurve, Unresolved};
use super::three::Surfaces;
use super::triple::{self, Size};
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;

/// Steps in which shares of the progress are counted.
const STEPS: f64 = 1e9;

/// The two places in `surfaces` of every pair whose boxes come within `reach` of each other, in ascending order.
pub fn candidate_pairs(surfaces: &[(usize, &Surface)], reach: f64) -> Vec<[usize; 2]> {
    let boxes: Vec<Aabb> = surfaces.iter().map(|(_, s)| s.bounds()).collect();
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&i, &j| boxes[i].min.x.total_cmp(&boxes[j].min.x).then(i.cmp(&j)));
    let mut pairs = Vec::new();
    for (k, &i) in order.iter().enumerate() {
        let grown = boxes[i].grown(reach);
        for &j in &order[k + 1..] {
            if boxes[j].min.x > grown.max.x {
                break;
            }
            if grown.overlaps(&boxes[j]) {
                pairs.push([i.min(j), i.max(j)]);
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

/// Intersects two sets of numbered surfaces. Where surfaces of one set cross on one of the other, the curves end in the
/// point of all three.
pub fn intersect(
    a: &[(usize, &Surface)],
    b: &[(usize, &Surface)],
    options: &SsiOptions,
    job: &Job,
) -> Result<Intersection, SsiError> {
    let mut found = engine::intersect(a, b, options, job)?;
    cut_at_thirds(&mut found, &[a, b].concat(), options, job)?;
    Ok(found)
}

/// Intersects every two of the numbered surfaces. In each point `a` is the surface that comes first in the list,
/// except along a curve that was joined over several pairs. Curves end in the points of three surfaces.
pub fn intersect_all(
    surfaces: &[(usize, &Surface)],
    options: &SsiOptions,
    job: &Job,
) -> Result<Intersection, SsiError> {
    let mut found = every_pair(surfaces, options, job)?;
    cut_at_thirds(&mut found, surfaces, options, job)?;
    Ok(found)
}

fn cut_at_thirds(
    found: &mut Intersection,
    surfaces: &[(usize, &Surface)],
    options: &SsiOptions,
    job: &Job,
) -> Result<(), SsiError> {
    if surfaces.len() > 2 && found.curves.len() > 1 {
        let bounds = surfaces.iter().fold(Aabb::EMPTY, |all, (_, s)| all.union(&s.bounds()));
        let size = Size::of(&bounds, options.checked(&bounds)?.gap);
        triple::cut(found, &Surfaces::new(surfaces.iter().copied()), size, job);
    }
    Ok(())
}

/// Every two of the surfaces without a look at third ones: curves may yet be cut down to faces before that.
pub(crate) fn every_pair(
    surfaces: &[(usize, &Surface)],
    options: &SsiOptions,
    job: &Job,
) -> Result<Intersection, SsiError> {
    let bounds = surfaces.iter().fold(Aabb::EMPTY, |all, (_, s)| all.union(&s.bounds()));
    let whole = options.checked(&bounds)?;
    let pairs = candidate_pairs(surfaces, whole.gap);
    job.phase("Intersecting pairs of surfaces");
    let spans = |s: &Surface| s.knots()[0].breaks().len() * s.knots()[1].breaks().len();
    let cost: Vec<f64> = pairs.iter().map(|p| p.iter().map(|&k| spans(surfaces[k].1) as f64).sum()).collect();
    let total = cost.iter().sum::<f64>().max(1.0);
    let done = AtomicU64::new(0);
    let results: Vec<Result<Intersection, SsiError>> = pairs
        .par_iter()
        .zip(&cost)
        .map(|(&[i, j], cost)| {
            if job.is_cancelled() {
                return Ok(not_examined(surfaces[i], surfaces[j]));
            }
            // A pair that is small in its model is not followed more coarsely than it is large.
            let diagonal = surfaces[i].1.bounds().union(&surfaces[j].1.bounds()).diagonal();
            let own = SsiOptions {
                tol: Some(whole.tol.min(1e-3 * diagonal).max(f64::MIN_POSITIVE)),
                gap_tol: options.gap_tol,
                joining: Some(whole.joining.min(1e-3 * diagonal).max(f64::MIN_POSITIVE)),
            };
            // A single pair reports its own progress; of several that run at once each counts when it is done.
            let inner = if pairs.len() == 1 { job.part(0.0, 1.0) } else { job.part(0.0, 0.0) };
            let result = engine::intersect(&[surfaces[i]], &[surfaces[j]], &own, &inner);
            let before = done.fetch_add((cost / total * STEPS) as u64, Ordering::Relaxed);
            job.progress(before as f64 / STEPS + cost / total);
            result
        })
        .collect();
    let mut all = Intersection { complete: true, tol: whole.tol, ..Intersection::default() };
    for one in results {
        all.append(one?);
    }
    join(&mut all.curves, whole.joining);
    job.progress(1.0);
    Ok(all)
}

/// The result of a pair that cancelling left out.
fn not_examined(a: (usize, &Surface), b: (usize, &Surface)) -> Intersection {
    let entry = Unresolved {
        a: a.0,
        uv_box: a.1.domain(),
        b: b.0,
        st_box: b.1.domain(),
        reason: "cancelled before it was examined".to_owned(),
    };
    Intersection { unresolved: vec![entry], ..Intersection::default() }
}

/// One end of an open curve.
struct OpenEnd {
    curve: usize,
    at_end: bool,
    p: DVec3,
    /// Outwards.
    direction: DVec3,
    pair: [usize; 2],
}

/// Joins curves that run on from pair to pair: two ends, and no third, within `joining`, in different pairs that
/// share a surface, and that do not double back.
fn join(curves: &mut Vec<IntersectionCurve>, joining: f64) {
    let mut ends: Vec<OpenEnd> = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        for at_end in [false, true] {
            if curve.closed || curve.ends[usize::from(at_end)] != CurveEnd::Boundary {
                continue;
            }
            let mut points: Vec<&_> = curve.points.iter().collect();
            if at_end {
                points.reverse();
            }
            let Some(first) = points.first() else { continue };
            let next = points.iter().find(|p| p.xyz.distance(first.xyz) > 2.0 * joining);
            let Some(next) = next else { continue };
            let direction = (first.xyz - next.xyz).normalize_or_zero();
            ends.push(OpenEnd { curve: k, at_end, p: first.xyz, direction, pair: [first.a, first.b] });
        }
    }
    // Neighbours by a sweep along x.
    ends.sort_by(|x, y| x.p.x.total_cmp(&y.p.x).then(x.curve.cmp(&y.curve)).then(x.at_end.cmp(&y.at_end)));
    let near = |k: usize| -> Vec<usize> {
        let close = |&j: &usize| ends[j].p.distance(ends[k].p) <= joining;
        let within = |&j: &usize| (ends[j].p.x - ends[k].p.x).abs() <= joining;
        let before = (0..k).rev().take_while(within).filter(close);
        before.chain((k + 1..ends.len()).take_while(within).filter(close)).collect()
    };
    let continues = |x: &OpenEnd, y: &OpenEnd| {
        x.pair != y.pair && x.pair.iter().any(|s| y.pair.contains(s)) && x.direction.dot(y.direction) < 0.95
    };
    let mut next: Vec<[Option<(usize, bool)>; 2]> = vec![[None; 2]; curves.len()];
    for k in 0..ends.len() {
        let around = near(k);
        if let [j] = around[..]
            && near(j).len() == 1
            && ends[j].curve != ends[k].curve
            && continues(&ends[k], &ends[j])
            && curves[ends[k].curve].kind == curves[ends[j].curve].kind
        {
            next[ends[k].curve][usize::from(ends[k].at_end)] = Some((ends[j].curve, ends[j].at_end));
        }
    }
    let mut taken = vec![false; curves.len()];
    let mut out = Vec::new();
    // Chains from their free ends first, in the order of the curves; what is left then are closed rings.
    for rings in [false, true] {
        for start in 0..curves.len() {
            let free = [0, 1].map(|e| next[start][e].is_none());
            if taken[start] || (!rings && !free[0] && !free[1]) {
                continue;
            }
            // Leave through the end that goes on; enter each next curve by the end that was linked.
            let mut link = Some((start, !rings && free[1] && !free[0]));
            let mut members = Vec::new();
            while let Some((curve, entered_at_end)) = link {
                if taken[curve] {
                    break;
                }
                taken[curve] = true;
                members.push((curve, entered_at_end));
                link = next[curve][usize::from(!entered_at_end)];
            }
            out.push(members);
        }
    }
    if out.iter().all(|members| members.len() == 1) {
        return;
    }
    let joined = out.into_iter().map(|members| merged(curves, &members, &next)).collect();
    *curves = joined;
}

/// The curves of a chain as one; each member says whether it is travelled from its end to its start.
fn merged(
    curves: &[IntersectionCurve],
    members: &[(usize, bool)],
    next: &[[Option<(usize, bool)>; 2]],
) -> IntersectionCurve {
    let travelled = |&(curve, backwards): &(usize, bool)| {
        let mut curve = curves[curve].clone();
        if backwards {
            curve.points.reverse();
            curve.ends.reverse();
            curve.end_ids.reverse();
        }
        curve
    };
    let mut list = members.iter().map(travelled);
    let Some(mut whole) = list.next() else { return curves[0].clone() };
    for mut more in list {
        // The surface that both share stays on its side.
        if let (Some(last), Some(first)) = (whole.points.last(), more.points.first())
            && (last.a == first.b || last.b == first.a)
        {
            more.points.iter_mut().for_each(|p| *p = p.swapped());
        }
        whole.points.append(&mut more.points);
        whole.error_bound = whole.error_bound.max(more.error_bound);
        (whole.ends[1], whole.end_ids[1]) = (more.ends[1], more.end_ids[1]);
    }
    let ring = members.len() > 1
        && members
            .last()
            .zip(members.first())
            .is_some_and(|(&(last, backwards), &first)| next[last][usize::from(!backwards)] == Some(first));
    if ring && let Some(&first) = whole.points.first() {
        whole.points.push(first);
        whole.closed = true;
        whole.ends = [CurveEnd::Loop; 2];
        whole.end_ids = [None; 2];
    }
    whole
}
