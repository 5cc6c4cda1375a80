//! Marching along a branch of S(p) = S(q), from miter points straight on and from seeds in both directions.
//!
//! Predictor along the null vector of the Jacobian, Newton corrector in the plane across it, in the chart
//! ([`super::chart`]) that is regular where the pair is. The step is controlled by what is measured: how far the
//! middle of the chord in the domain is from the middle of the chord in space, on both sheets. A branch ends where a
//! parameter point meets an open border, where r passes through 0 (another miter point), or where it closes; a closed
//! curve may return with its two parameter points exchanged.
//!
//! Cost: 2 to 3 evaluations of the chart a point.

use glam::{DMat3, DVec2};

use super::chart::{Chart, Value};
use super::cusp::CuspNode;
use super::degenerate::beside;
use super::miter::MiterPoint;
use super::sheet::Sheet;
use crate::kernel::job::Job;
use crate::kernel::num::linear;

/// How a trace ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    Border,
    /// In a miter point at these parameters.
    Miter(DVec2),
    Loop,
    /// In the junction with this number.
    Triple(usize),
    /// Newton failed or a cap was hit.
    Lost,
}

/// A branch: pairs of parameter points in order. Parameters run on across seams.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub nodes: Vec<[DVec2; 2]>,
    pub ends: [End; 2],
}

/// What controls the march.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// How far a chord may be from both sheets, in the space of size 1.
    pub tol: f64,
    /// Below this distance in the domain the pair is marched in the chart that is regular at the diagonal.
    pub near: f64,
    /// The most points of one branch.
    pub cap: usize,
}

const LONGEST: f64 = 0.02;
const SHORTEST: f64 = 1e-10;

/// Solves the 4 x 4 system `[j; row] d = [f, g]`.
fn solve(j: &[glam::DVec3; 4], row: &[f64; 4], f: glam::DVec3, g: f64) -> Option<[f64; 4]> {
    linear::solve([j.map(|c| c.x), j.map(|c| c.y), j.map(|c| c.z), *row], [f.x, f.y, f.z, g])
}

fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn length(a: &[f64; 4]) -> f64 {
    dot(a, a).sqrt()
}

/// The unit null vector of a 3 x 4 Jacobian; `None` where its rank is below 3.
pub(crate) fn tangent(value: &Value) -> Option<[f64; 4]> {
    let j = &value.j;
    let det = |a: usize, b: usize, c: usize| DMat3::from_cols(j[a], j[b], j[c]).determinant();
    let t = [det(1, 2, 3), -det(0, 2, 3), det(0, 1, 3), -det(0, 1, 2)];
    let n = length(&t);
    let size: f64 = j.iter().map(|c| c.length()).fold(0.0, f64::max);
    (n > 1e-11 * size * size * size).then(|| t.map(|x| x / n))
}

/// Newton on F = 0 in the plane through `y` across `row`. `None` when it does not converge nearby.
pub(crate) fn correct(sheet: &Sheet, chart: Chart, row: &[f64; 4], reach: f64) -> Option<(Chart, Value)> {
    let start = chart.y();
    let mut y = start;
    let mut last = f64::INFINITY;
    for _ in 0..12 {
        let here = chart.with(y);
        let value = here.value(sheet);
        let offset = dot(row, &[y[0] - start[0], y[1] - start[1], y[2] - start[2], y[3] - start[3]]);
        let d = solve(&value.j, row, -value.f, -offset)?;
        for k in 0..4 {
            y[k] += d[k];
        }
        let step = length(&d);
        let moved = length(&[y[0] - start[0], y[1] - start[1], y[2] - start[2], y[3] - start[3]]);
        if !moved.is_finite() || moved > reach {
            return None;
        }
        if step < 1e-13 || (step < 1e-9 && step > 0.3 * last) {
            let here = chart.with(y);
            return Some((here, here.value(sheet)));
        }
        last = step;
    }
    None
}

/// The branch point in the plane `normal . x = level`, by Newton from a pair close to it.
pub(crate) fn on_plane(sheet: &Sheet, start: Chart, normal: glam::DVec3, level: f64) -> Option<Chart> {
    let mut chart = start;
    for _ in 0..30 {
        let value = chart.value(sheet);
        let [a, b] = chart.points().map(|p| sheet.jet(p, 1));
        let height = 0.5 * normal.dot(a.s + b.s) - level;
        let row = [0, 1, 2, 3].map(|k| {
            let mut unit = [0.0; 4];
            unit[k] = 1.0;
            let [p, q] = chart.motion(unit);
            0.5 * normal.dot(a.d[0] * p.x + a.d[1] * p.y + b.d[0] * q.x + b.d[1] * q.y)
        });
        let d = solve(&value.j, &row, -value.f, -height)?;
        let y = chart.y();
        chart = chart.with([0, 1, 2, 3].map(|k| y[k] + d[k]));
        let moved = [0, 1].map(|k| chart.points()[k].distance(start.points()[k]));
        if !(moved[0].max(moved[1]) < 0.2) {
            return None;
        }
        if length(&d) < 1e-12 {
            return Some(chart);
        }
    }
    None
}

/// How far inside the open borders both points are; negative outside.
fn inside(sheet: &Sheet, [p, q]: [DVec2; 2]) -> f64 {
    let mut least = f64::INFINITY;
    for d in 0..2 {
        if !sheet.periodic[d] {
            for t in [p[d], q[d]] {
                least = least.min(t).min(1.0 - t);
            }
        }
    }
    least
}

/// What shrinks to zero where a branch ends: the distance from the borders, and r.
fn left(sheet: &Sheet, chart: &Chart) -> f64 {
    let border = inside(sheet, chart.points());
    match chart {
        Chart::Near(y) => border.min(y[3]),
        Chart::Far(_) => border,
    }
}

fn middle(sheet: &Sheet, [p, q]: [DVec2; 2]) -> glam::DVec3 {
    (sheet.point(p) + sheet.point(q)) * 0.5
}

/// The distance between the middles of two chords, in the domain and in space, on both sheets.
pub(crate) fn deviation(sheet: &Sheet, a: [DVec2; 2], b: [DVec2; 2]) -> f64 {
    let chord = (middle(sheet, a) + middle(sheet, b)) * 0.5;
    let of = |k: usize| sheet.point((a[k] + b[k]) * 0.5).distance(chord);
    of(0).max(of(1))
}

/// Integers that bring `q` closest to `p` in closed directions.
pub(crate) fn turns(sheet: &Sheet, p: DVec2, q: DVec2) -> DVec2 {
    let turn = |d: usize| if sheet.periodic[d] { (p[d] - q[d]).round() } else { 0.0 };
    DVec2::new(turn(0), turn(1))
}

/// Marches one way from a point on a branch, along the tangent with a positive product with `toward`.
fn one_way(sheet: &Sheet, start: Chart, toward: [DVec2; 2], pace: &Pace, job: &Job) -> (Vec<[DVec2; 2]>, End) {
    let first = start.points();
    let from_miter = matches!(start, Chart::Near(y) if y[3] == 0.0);
    let mut nodes = vec![first];
    let mut chart = start;
    let mut toward = toward;
    let mut offset = DVec2::ZERO;
    let mut h = (pace.tol.sqrt() * 4.0).min(0.01);
    let mut travelled = 0.0;
    let agrees = |a: [DVec2; 2], b: [DVec2; 2]| a[0].dot(b[0]) + a[1].dot(b[1]);
    loop {
        if nodes.len() >= pace.cap || job.is_cancelled() {
            return (nodes, End::Lost);
        }
        // The chart that suits the pair, with q on the same turn as p.
        let [p, q] = chart.points();
        let keep = matches!(chart, Chart::Near(y) if y[3] < pace.near);
        if !keep {
            let turn = turns(sheet, p, q);
            let near = (p - q - turn).length() < pace.near;
            if near && turn != DVec2::ZERO {
                offset -= turn;
            }
            chart = Chart::of(p, if near { q + turn } else { q }, pace.near);
        }
        let Some(mut t) = tangent(&chart.value(sheet)) else { return (nodes, End::Lost) };
        if agrees(chart.motion(t), toward) < 0.0 {
            t = t.map(|x| -x);
        }
        // One step, shortened until it is good.
        let before = chart.points();
        let (next, moved) = loop {
            if h < SHORTEST {
                return (nodes, End::Lost);
            }
            let y = chart.y();
            let guess = chart.with([0, 1, 2, 3].map(|k| y[k] + h * t[k]));
            if let Some((next, value)) = correct(sheet, guess, &t, 0.3 * h)
                && let Some(mut new) = tangent(&value)
            {
                if dot(&new, &t) < 0.0 {
                    new = new.map(|x| -x);
                }
                let error = deviation(sheet, before, next.points());
                if dot(&new, &t) > 0.9 && error <= 1.5 * pace.tol {
                    let moved = next.motion(new);
                    let grow = if error > 0.0 { 0.9 * (pace.tol / error).sqrt() } else { 2.0 };
                    let step = h;
                    h = (h * grow.clamp(0.5, 2.0)).min(LONGEST);
                    break ((next, step), moved);
                }
                h *= (0.8 * (pace.tol / error).sqrt()).clamp(0.1, 0.5);
            } else {
                h *= 0.3;
            }
        };
        let (next, step) = next;
        // Left the domain, or went through the diagonal: find where.
        if left(sheet, &next) < -1e-13 {
            let end = finish(sheet, chart, &t, step, left(sheet, &next));
            if let Some(end) = end {
                let [p, q] = end.points();
                if let Chart::Near(y) = end
                    && y[3].abs() < 1e-9
                    && inside(sheet, [p, q]) > -1e-9
                {
                    let m = DVec2::new(y[0], y[1]);
                    nodes.push([m, m + offset]);
                    return (nodes, End::Miter(sheet.wrapped(m)));
                }
                let snapped = [snap(sheet, p), snap(sheet, q)];
                let stored = [snapped[0], snapped[1] + offset];
                if nodes.last().is_some_and(|l| l[0].distance(p) + l[1].distance(stored[1]) > 1e-12) {
                    nodes.push(stored);
                } else if let (Some(last), true) = (nodes.last_mut(), !from_miter || travelled > 0.0) {
                    *last = stored;
                }
                return (nodes, End::Border);
            }
            return (nodes, End::Lost);
        }
        let [p, q] = next.points();
        let stored = [p, q + offset];
        // Closed: the start lies on this step, possibly with p and q exchanged.
        if !from_miter && travelled > 2.0 * step {
            for swap in [false, true] {
                let goal = if swap { [first[1], first[0]] } else { first };
                let shift = [turns(sheet, p, goal[0]), turns(sheet, q, goal[1])];
                let goal = [goal[0] + shift[0], goal[1] + shift[1]];
                let along = [p - before[0], q - before[1]];
                let to = [goal[0] - before[0], goal[1] - before[1]];
                let squared = agrees(along, along);
                let at = agrees(to, along) / squared;
                let off = [to[0] - along[0] * at, to[1] - along[1] * at];
                if at > 0.0 && at <= 1.0 && agrees(off, off) < 0.04 * squared {
                    nodes.push([goal[0], goal[1] + offset]);
                    return (nodes, End::Loop);
                }
            }
        }
        travelled += step;
        nodes.push(stored);
        toward = moved;
        chart = next;
    }
}

/// The point between a step's start and its end where [`left`] is zero, by the Illinois method on the step length.
fn finish(sheet: &Sheet, chart: Chart, t: &[f64; 4], step: f64, over: f64) -> Option<Chart> {
    let y = chart.y();
    let (mut a, mut fa) = (0.0, left(sheet, &chart));
    let (mut b, mut fb) = (step, over);
    if fa <= 0.0 && !matches!(chart, Chart::Near(y) if y[3] == 0.0) {
        return Some(chart);
    }
    let mut best = chart;
    for _ in 0..60 {
        let s = if fa > 0.0 { (a * fb - b * fa) / (fb - fa) } else { 0.5 * (a + b) };
        let guess = chart.with([0, 1, 2, 3].map(|k| y[k] + s * t[k]));
        let (here, _) = correct(sheet, guess, t, step)?;
        let f = left(sheet, &here);
        best = here;
        if f.abs() < 1e-14 || (b - a) < 1e-15 {
            break;
        }
        if f > 0.0 {
            (a, fa) = (s, f);
            fb *= 0.5;
        } else {
            (b, fb) = (s, f);
            fa *= 0.5;
        }
    }
    Some(best)
}

/// Puts coordinates that rounding left beside an open border onto it.
fn snap(sheet: &Sheet, p: DVec2) -> DVec2 {
    let one = |d: usize, t: f64| {
        if sheet.periodic[d] {
            t
        } else if t.abs() < 1e-11 {
            0.0
        } else if (t - 1.0).abs() < 1e-11 {
            1.0
        } else {
            t.clamp(0.0, 1.0)
        }
    };
    DVec2::new(one(0, p.x), one(1, p.y))
}

/// The branch that starts in a miter point with null direction at angle `phi`.
pub(crate) fn from_miter(sheet: &Sheet, m: DVec2, phi: f64, pace: &Pace, job: &Job) -> Trace {
    let e = DVec2::from_angle(phi);
    let (nodes, end) = one_way(sheet, Chart::Near([m.x, m.y, phi, 0.0]), [e, -e], pace, job);
    Trace { nodes, ends: [End::Miter(m), end] }
}

/// The branches that start in a degenerate miter point, on either side of it along its kernel direction.
pub(crate) fn from_degenerate(
    sheet: &Sheet,
    miter: &MiterPoint,
    along: DVec2,
    sides: [bool; 2],
    pace: &Pace,
    job: &Job,
) -> Vec<Trace> {
    const START: f64 = 1e-3;
    let node = CuspNode { at: miter.at, phi: miter.phi };
    let start = |sign: f64| {
        let found = beside(sheet, node, along, sign * START)?;
        let chart = Chart::Near([found.at.x, found.at.y, found.phi, found.rho.max(0.0).sqrt()]);
        let (chart, _) = correct(sheet, chart, &[along.x, along.y, 0.0, 0.0], 2.0 * START)?;
        let e = DVec2::from_angle(found.phi);
        let (mut nodes, end) = one_way(sheet, chart, [along * sign + e, along * sign - e], pace, job);
        nodes.insert(0, [miter.at; 2]);
        Some(Trace { nodes, ends: [End::Miter(miter.at), end] })
    };
    [(sides[0], 1.0), (sides[1], -1.0)].into_iter().filter(|s| s.0).filter_map(|(_, sign)| start(sign)).collect()
}

/// The branch through a pair that lies on it, both ways. `None` where the pair is singular.
pub(crate) fn through(sheet: &Sheet, p: DVec2, q: DVec2, pace: &Pace, job: &Job) -> Option<Trace> {
    let q = if (p - q - turns(sheet, p, q)).length() < pace.near { q + turns(sheet, p, q) } else { q };
    let chart = Chart::of(p, q, pace.near);
    let t = tangent(&chart.value(sheet))?;
    let (chart, value) = correct(sheet, chart, &t, 0.01)?;
    let t = tangent(&value)?;
    let ahead = chart.motion(t);
    let (mut nodes, end) = one_way(sheet, chart, ahead, pace, job);
    if end == End::Loop {
        return Some(Trace { nodes, ends: [End::Loop; 2] });
    }
    let (back, start) = one_way(sheet, chart, ahead.map(|d| -d), pace, job);
    let mut all: Vec<_> = back.into_iter().skip(1).rev().collect();
    all.append(&mut nodes);
    Some(Trace { nodes: all, ends: [start, end] })
}
