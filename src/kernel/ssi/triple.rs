//! Points of three bodies: where the curve of two bodies crosses a third one, the curves of all three pairs pass through
//! one point (HJR99 section 4, "curve-curve intersections"). Every curve is cut there, and each pair that has a curve there
//! gets a junction with its own parameters; the position is the same for all.
//!
//! [`super::triple_search`] finds them on the chords of the curves; here they are merged, told from places where a curve only
//! runs on, and cut at.
//!
//! Two curves that both end in the point, with no third, run on into one another at the shared border of two patches: that
//! is no junction. Where the patches meet at a crease, the crease is a curve of its own, and the three meet in a junction.
//!
//! Cost: that of the search, and a sort. The result does not depend on the number of threads.

use std::collections::{BTreeMap, HashMap};

use glam::DVec2;

use super::result::{CurveEnd, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind};
use super::split::{Cut, split};
use super::three::{Bodies, Met};
use super::triple_search::{Found, search};
use crate::kernel::geom::Aabb;
use crate::kernel::job::Job;

/// The lengths of a model.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// What two points may be apart and still be one.
    pub same: f64,
    /// The height that counts as contact.
    pub gap: f64,
    /// What rounding leaves of the distance of points that are one.
    pub rounding: f64,
}

impl Size {
    /// Of a model with these bounds.
    pub fn of(bounds: &Aabb, gap: f64) -> Self {
        let far = bounds.max_abs() + bounds.diagonal();
        Self { same: 1e-9 * bounds.diagonal(), gap, rounding: 2e-14 * bounds.diagonal() + 16.0 * f64::EPSILON * far }
    }
}

/// Finds the points of three bodies on the curves of a result and cuts the curves there.
pub fn cut(result: &mut Intersection, bodies: &impl Bodies, size: Size, job: &Job) {
    job.phase("Looking for points of three surfaces");
    let Some(found) = search(&result.curves, bodies, size, job) else {
        // Cancelled: the curves are whole, and say that this was not done.
        result.complete = false;
        return;
    };
    let points = merged(found, size.same);
    let mut cuts: BTreeMap<usize, Vec<Cut>> = BTreeMap::new();
    // More than three bodies may meet in one point: a pair has one junction there.
    let mut of_pair: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    let arms = arms(&result.curves, &points, 2.0 * size.same);
    for (point, arms) in points.iter().zip(arms) {
        if point.passes.len() < 2 || arms < 3 {
            continue;
        }
        for &(number, at) in &point.passes {
            let curve = &result.curves[number];
            let own = &curve.points[(at.floor() as usize).min(curve.points.len() - 1)];
            let here = point.on(own);
            let end = stretch_end(curve, at);
            let of_curve =
                |e: usize| !curve.closed && end == Some(e) && (at as usize + 1 == curve.points.len() || at == 0.0);
            if (0..2).any(|e| of_curve(e) && curve.ends[e] == CurveEnd::Junction) {
                continue; // a contact of its own two surfaces
            }
            let pair = [own.a.min(own.b), own.a.max(own.b)];
            let ids = of_pair.entry(pair).or_default();
            let known = ids.iter().copied().find(|&id| result.junctions[id].xyz.distance(here.xyz) <= 2.0 * size.same);
            let id = known.unwrap_or_else(|| {
                let CurvePoint { xyz, a, uv, b, st } = here;
                let kind = JunctionKind::ThreeSurfaces;
                result.junctions.push(Junction { xyz, a, uv, b, st, gap: point.met.gap, kind });
                ids.push(result.junctions.len() - 1);
                result.junctions.len() - 1
            });
            let there = Some((id, here));
            let chords = curve.points.len() as f64 - 1.0;
            let cut = match end {
                // A curve that ends here, or runs on in another patch.
                Some(0) if curve.closed || at > 0.0 => {
                    Cut { at: if at > 0.0 { at - 0.5 } else { chords - 0.5 }, before: None, after: there }
                }
                Some(1) if curve.closed || at < chords => Cut { at: at + 0.5, before: there, after: None },
                _ => Cut { at, before: there, after: there },
            };
            cuts.entry(number).or_default().push(cut);
        }
    }
    if cuts.is_empty() {
        return;
    }
    let curves = std::mem::take(&mut result.curves);
    for (number, curve) in curves.into_iter().enumerate() {
        let Some(mut cuts) = cuts.remove(&number) else {
            result.curves.push(curve);
            continue;
        };
        cuts.sort_by(|x, y| x.at.total_cmp(&y.at));
        cuts.dedup_by(|next, kept| {
            let one = next.at == kept.at;
            if one {
                kept.before = kept.before.or(next.before);
                kept.after = kept.after.or(next.after);
            }
            one
        });
        result.curves.extend(split(curve, &cuts, size.same));
    }
}

/// How many curves leave each point, all patches that meet there counted: where two do, one runs on.
fn arms(curves: &[IntersectionCurve], points: &[Point], same: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&i, &j| points[i].met.xyz.x.total_cmp(&points[j].met.xyz.x).then(i.cmp(&j)));
    let place = |k: usize| points[order[k]].met.xyz;
    let mut out = vec![0; points.len()];
    for k in 0..order.len() {
        let within = |&l: &usize| (place(l).x - place(k).x).abs() <= same;
        let before = (0..k).rev().take_while(within);
        let all = before.chain(k..order.len()).take_while(|l| *l < k || within(l));
        let here = all.filter(|&l| place(l).distance(place(k)) <= same);
        let mut passes: Vec<(usize, f64)> = here.flat_map(|l| points[order[l]].passes.iter().copied()).collect();
        passes.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
        passes.dedup();
        let mut ends: HashMap<(usize, usize), usize> = HashMap::new();
        for (curve, at) in passes {
            match stretch_end(&curves[curve], at) {
                None => out[order[k]] += 2,
                Some(_) => *ends.entry((curve, stretch_start(&curves[curve], at as usize))).or_default() += 1,
            }
        }
        // A stretch that both starts and ends here is a corner of patches that the curve passes.
        out[order[k]] += ends.values().filter(|&&count| count == 1).count();
    }
    out
}

/// The first point of the stretch of a curve on one pair of patches.
fn stretch_start(curve: &IntersectionCurve, at: usize) -> usize {
    let pair = |k: usize| (curve.points[k].a, curve.points[k].b);
    let before = |k: usize| if k > 0 { Some(k - 1) } else { curve.closed.then_some(curve.points.len() - 2) };
    let mut first = at;
    for _ in 0..curve.points.len() {
        match before(first).filter(|&k| pair(k) == pair(first)) {
            Some(k) => first = k,
            None => break,
        }
    }
    first
}

/// Whether a place is an end (0: the start, 1) of a stretch of a curve on one pair of patches.
pub(super) fn stretch_end(curve: &IntersectionCurve, at: f64) -> Option<usize> {
    if at.fract() != 0.0 {
        return None;
    }
    let (k, n) = (at as usize, curve.points.len());
    let pair = |k: usize| curve.points.get(k).map(|p| (p.a, p.b));
    let before = if k > 0 {
        pair(k - 1)
    } else if curve.closed {
        pair(n - 2)
    } else {
        None
    };
    let after = if k + 1 < n {
        pair(k + 1)
    } else if curve.closed {
        pair(1)
    } else {
        None
    };
    if after != pair(k) {
        Some(1)
    } else if before != pair(k) {
        Some(0)
    } else {
        None
    }
}

/// A point of three with every curve that passes it.
struct Point {
    bodies: [usize; 3],
    met: Met,
    blur: f64,
    passes: Vec<(usize, f64)>,
}

impl Point {
    /// The point as one of a curve.
    fn on(&self, of: &CurvePoint) -> CurvePoint {
        let place = |n: usize, or: DVec2| self.bodies.iter().position(|b| *b == n).map_or(or, |k| self.met.uv[k]);
        CurvePoint { xyz: self.met.xyz, a: of.a, uv: place(of.a, of.uv), b: of.b, st: place(of.b, of.st) }
    }
}

/// Points that were found from several pairs of curves, once each.
fn merged(mut found: Vec<Found>, same: f64) -> Vec<Point> {
    found.sort_by(|x, y| {
        let by = x.bodies.cmp(&y.bodies).then(x.met.xyz.x.total_cmp(&y.met.xyz.x));
        by.then(x.passes[0].0.cmp(&y.passes[0].0)).then(x.passes[0].1.total_cmp(&y.passes[0].1))
    });
    let widest = found.iter().map(|f| f.blur).fold(0.0, f64::max);
    let mut out: Vec<Point> = Vec::new();
    for one in found {
        let reach = 4.0 * same + widest + one.blur;
        let near = |p: &&mut Point| p.bodies == one.bodies && one.met.xyz.x - p.met.xyz.x <= reach;
        let mut known = out.iter_mut().rev().take_while(near);
        let home = known.find(|p| p.met.xyz.distance(one.met.xyz) <= 2.0 * same + p.blur.max(one.blur));
        let Some(home) = home else {
            out.push(Point { bodies: one.bodies, met: one.met, blur: one.blur, passes: one.passes.to_vec() });
            continue;
        };
        home.blur = home.blur.max(one.blur);
        if one.met.gap < home.met.gap {
            home.met = one.met;
        }
        for pass in one.passes {
            let known = |p: &(usize, f64)| p.0 == pass.0 && (p.1 - pass.1).abs() < 1.0;
            if !home.passes.iter().any(known) {
                home.passes.push(pass);
            }
        }
    }
    for point in &mut out {
        point.passes.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
    }
    out
}
