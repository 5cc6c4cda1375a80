//! Triple points: where three sheets of the surface pass through one point (thesis 6.3 and Fig. 6.1: the solution curves of
//! a global self-intersection cross those of a local one).
//!
//! In space three branches cross there, one for each pair of sheets; in the domain the preimages of two branches cross in
//! each of the three parameter points. So crossings of the preimage polylines are found with a grid over the domain,
//! polished by Newton on S(x) = S(y) = S(z), and every branch that passes is cut there. Cost: proportional to the number of
//! points. How it fails: where the three tangent planes have a line in common the point cannot be polished, and three
//! sheets that share a curve have no triple points of their own; the number of such crossings is returned.

use std::collections::HashMap;

use glam::DVec2;

use super::march::{End, Trace, turns};
use super::sheet::Sheet;
use crate::kernel::num::linear;

/// Cells of the grid over the domain in each direction.
const CELLS: f64 = 64.0;
/// Parameter points closer than this are one.
const SAME: f64 = 1e-7;

/// One chord of a preimage: trace, side, index, and its ends.
#[derive(Clone, Copy)]
struct Chord {
    trace: usize,
    side: usize,
    at: usize,
    ends: [DVec2; 2],
}

/// Finds the triple points of the traced branches and cuts the branches there. Returns the points, and how many
/// crossings could not be polished or have a branch missing.
pub(crate) fn cut(sheet: &Sheet, traces: &mut Vec<Trace>) -> (Vec<[DVec2; 3]>, usize) {
    let mut points: Vec<[DVec2; 3]> = Vec::new();
    let mut open = 0;
    for (a, b, s, t) in crossings(sheet, traces) {
        let x = a.ends[0].lerp(a.ends[1], s);
        let other = |c: &Chord, at: f64| {
            let nodes = &traces[c.trace].nodes;
            nodes[c.at][1 - c.side].lerp(nodes[c.at + 1][1 - c.side], at)
        };
        let (y, z) = (other(&a, s), other(&b, t));
        let size = a.ends[0].distance(a.ends[1]) + b.ends[0].distance(b.ends[1]);
        let distance = |p: DVec2, q: DVec2| (p - q - turns(sheet, p, q)).length();
        // Two branches of the same pair of sheets, or both preimages at a miter point: no third sheet is to be expected.
        let doubtful = distance(y, z).min(distance(x, y)).min(distance(x, z)) < 4.0 * size;
        match polished(sheet, [x, y, z], 4.0 * size + 1e-6) {
            Some([x, y, z]) if distance(x, y).min(distance(y, z)).min(distance(x, z)) < 1e-5 => {}
            Some(found) => {
                let known = |old: &[DVec2; 3]| old.iter().all(|p| found.iter().any(|q| distance(*p, *q) < SAME));
                if !points.iter().any(known) {
                    points.push(found);
                }
            }
            None if doubtful => {}
            None => open += 1,
        }
    }
    points.sort_by(|a, b| (a[0].y, a[0].x).partial_cmp(&(b[0].y, b[0].x)).unwrap_or(std::cmp::Ordering::Equal));
    for (number, point) in points.iter().enumerate() {
        for (i, j) in [(0, 1), (1, 2), (0, 2)] {
            if !split(sheet, traces, [point[i], point[j]], number) {
                open += 1;
            }
        }
    }
    (points, open)
}

/// Chords of preimages that cross, with where on each.
fn crossings(sheet: &Sheet, traces: &[Trace]) -> Vec<(Chord, Chord, f64, f64)> {
    let mut grid: HashMap<(i64, i64), Vec<Chord>> = HashMap::new();
    let mut found = Vec::new();
    for (trace, t) in traces.iter().enumerate() {
        for (at, pair) in t.nodes.windows(2).enumerate() {
            for side in 0..2 {
                let middle = (pair[0][side] + pair[1][side]) * 0.5;
                let shift = sheet.wrapped(middle) - middle;
                let ends = [pair[0][side] + shift, pair[1][side] + shift];
                let chord = Chord { trace, side, at, ends };
                let (low, high) = (ends[0].min(ends[1]) * CELLS, ends[0].max(ends[1]) * CELLS);
                let mut met: Vec<Chord> = Vec::new();
                for j in low.y.floor() as i64..=high.y.floor() as i64 {
                    for i in low.x.floor() as i64..=high.x.floor() as i64 {
                        let cell = grid.entry((i, j)).or_default();
                        for other in cell.iter() {
                            let next = other.trace == trace && other.side == side && other.at.abs_diff(at) < 2;
                            let same = |c: &Chord| c.trace == other.trace && c.side == other.side && c.at == other.at;
                            if !next && !met.iter().any(same) {
                                met.push(*other);
                            }
                        }
                        cell.push(chord);
                    }
                }
                for other in met {
                    if let Some((s, t)) = crossed(chord.ends, other.ends) {
                        found.push((chord, other, s, t));
                    }
                }
            }
        }
    }
    found
}

/// Where two segments cross.
fn crossed(a: [DVec2; 2], b: [DVec2; 2]) -> Option<(f64, f64)> {
    let (d, e, f) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let det = d.perp_dot(e);
    if det.abs() <= 1e-9 * d.length() * e.length() {
        return None;
    }
    let (s, t) = (f.perp_dot(e) / det, f.perp_dot(d) / det);
    let on = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
    (on(s) && on(t)).then_some((s, t))
}

/// Newton on S(x) = S(y) = S(z), with the points kept within a distance of their start and apart from each other.
fn polished(sheet: &Sheet, start: [DVec2; 3], reach: f64) -> Option<[DVec2; 3]> {
    let mut p = start;
    for _ in 0..20 {
        let [a, b, c] = p.map(|p| sheet.jet(p, 1));
        let mut rows = [[0.0; 6]; 6];
        let (f, g) = (b.s - a.s, c.s - a.s);
        for k in 0..3 {
            let of = |v: glam::DVec3| v.to_array()[k];
            rows[k] = [of(a.d[0]), of(a.d[1]), -of(b.d[0]), -of(b.d[1]), 0.0, 0.0];
            rows[3 + k] = [of(a.d[0]), of(a.d[1]), 0.0, 0.0, -of(c.d[0]), -of(c.d[1])];
        }
        let d = linear::solve(rows, [f.x, f.y, f.z, g.x, g.y, g.z])?;
        let step = [DVec2::new(d[0], d[1]), DVec2::new(d[2], d[3]), DVec2::new(d[4], d[5])];
        for k in 0..3 {
            p[k] += step[k];
            if p[k].distance(start[k]) > reach.max(1e-3) {
                return None;
            }
        }
        if step.iter().all(|s| s.length() < 1e-13) {
            break;
        }
    }
    let [a, b, c] = p.map(|p| sheet.point(p));
    (a.distance(b).max(a.distance(c)) <= 1e-11_f64.max(4.0 * sheet.rounding)).then_some(p)
}

/// Cuts a branch through a pair of parameter points there, one that does not end there yet; false where none passes.
pub(crate) fn split(sheet: &Sheet, traces: &mut Vec<Trace>, pair: [DVec2; 2], number: usize) -> bool {
    let mut best: Option<(f64, usize, usize, [DVec2; 2])> = None;
    for (trace, t) in traces.iter().enumerate() {
        let near = |x: DVec2, y: DVec2| (x - y - turns(sheet, x, y)).length() < SAME;
        let here =
            |n: &[DVec2; 2]| near(n[0], pair[0]) && near(n[1], pair[1]) || near(n[0], pair[1]) && near(n[1], pair[0]);
        let outer = [t.nodes.first(), t.nodes.last()];
        if outer.iter().zip(t.ends).any(|(n, end)| end == End::Triple(number) && n.is_some_and(here)) {
            continue;
        }
        for (at, s) in t.nodes.windows(2).enumerate() {
            for swap in [false, true] {
                let [p, q] = if swap { [pair[1], pair[0]] } else { pair };
                let there = [p + turns(sheet, s[0][0], p), q + turns(sheet, s[0][1], q)];
                let (along, to) = ([s[1][0] - s[0][0], s[1][1] - s[0][1]], [there[0] - s[0][0], there[1] - s[0][1]]);
                let squared = along[0].length_squared() + along[1].length_squared();
                let f = ((along[0].dot(to[0]) + along[1].dot(to[1])) / squared.max(1e-300)).clamp(0.0, 1.0);
                let off = (to[0] - along[0] * f).length_squared() + (to[1] - along[1] * f).length_squared();
                // Chords are off by the square of their length.
                if off <= 0.05 * squared + 1e-16 && best.is_none_or(|b| off < b.0) {
                    best = Some((off, trace, at, there));
                }
            }
        }
    }
    let Some((_, trace, at, there)) = best else { return false };
    let Trace { mut nodes, ends } = traces.swap_remove(trace);
    let tail = nodes.split_off(at + 1);
    let close = |a: &[DVec2; 2]| a[0].distance(there[0]) + a[1].distance(there[1]) < 1e-12;
    if nodes.last().is_none_or(|n| !close(n)) {
        nodes.push(there);
    }
    let mut rest = vec![there];
    rest.extend(tail.into_iter().skip_while(close));
    if ends == [End::Loop; 2] {
        // A loop becomes one branch from the point to itself; parameters run on across seams.
        let (last, first) = (rest[rest.len() - 1], nodes[0]);
        let swapped = |p: DVec2, q: DVec2| (p - q - turns(sheet, p, q)).length() > 1e-6;
        let exchanged = swapped(last[0], first[0]);
        rest.extend(nodes.iter().skip(1).map(|&[p, q]| {
            let [p, q] = if exchanged { [q, p] } else { [p, q] };
            [
                p + turns(sheet, last[0], if exchanged { first[1] } else { first[0] }),
                q + turns(sheet, last[1], if exchanged { first[0] } else { first[1] }),
            ]
        }));
        traces.push(Trace { nodes: rest, ends: [End::Triple(number); 2] });
        return true;
    }
    for (part, ends) in [(nodes, [ends[0], End::Triple(number)]), (rest, [End::Triple(number), ends[1]])] {
        if part.len() > 1 {
            traces.push(Trace { nodes: part, ends });
        }
    }
    true
}
