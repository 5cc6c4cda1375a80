//! The pair test: a pair of boxes holds no solution, or solutions on traced branches only.
//!
//! With the parameter x4 along which the solution curve runs fastest, the other three columns of the Jacobian,
//! preconditioned at the middle, are bounded over a box 3.25 times as large (on the piece, continued). Where I - E is an
//! M-matrix there is at most one solution for each x4 in the large box; the slopes (I - E)^-1 |Y c4| bound how far the
//! solution curve moves, so that a curve that meets the small box runs through the large one over the whole range of x4,
//! and Newton at any x4 finds it. No certificate rests on what Newton fails to find.

use glam::{DMat3, DVec2, DVec3};

use super::chart::Value;
use super::hull::{Rect, range};
use super::march::{self, Pace};
use super::register::Register;
use super::sheet::Sheet;
use super::window::contracts;
use crate::kernel::job::Job;

/// How much larger than the box the box of the pair test is.
const GROWTH: f64 = 3.25;

/// What the test says.
pub(crate) enum Verdict {
    Empty,
    Covered,
    Split,
}

/// The pair test. See the module's text.
pub(crate) fn examine(
    sheet: &Sheet,
    register: &mut Register,
    pace: &Pace,
    job: &Job,
    [(a, pa), (b, pb)]: [(&Rect, usize); 2],
) -> Verdict {
    let (half_a, half_b) = (a.size() * 0.5, b.size() * 0.5);
    let half = [half_a.x, half_a.y, half_b.x, half_b.y];
    let center = [a.center().x, a.center().y, b.center().x, b.center().y];
    let (ja, jb) = (sheet.jet_on(pa, a.center(), 1), sheet.jet_on(pb, b.center(), 1));
    let columns = [ja.d[0] * half[0], ja.d[1] * half[1], -jb.d[0] * half[2], -jb.d[1] * half[3]];
    let Some(t) = march::tangent(&Value { f: DVec3::ZERO, j: columns }) else {
        return Verdict::Split;
    };
    let k = (0..4).fold(0, |best, k| if t[k].abs() > t[best].abs() { k } else { best });
    let others: Vec<usize> = (0..4).filter(|&j| j != k).collect();
    let frame = DMat3::from_cols(columns[others[0]], columns[others[1]], columns[others[2]]);
    let inverse = frame.inverse();
    if !inverse.is_finite() {
        return Verdict::Split;
    }
    let step = inverse * (ja.s - jb.s);
    // A cheap look first: at the middle the curve is far out of reach of any box that could pass.
    let grow = (GROWTH - 1.0) * 0.5;
    let (ga, gb) = (sheet.hull_on(pa, &a.grown(grow)), sheet.hull_on(pb, &b.grown(grow)));
    let mut error = [[0.0; 3]; 3];
    let mut drift = [0.0; 3];
    for i in 0..3 {
        let y = inverse.row(i);
        let of = |c: usize| {
            let points = [&ga.du, &ga.dv, &gb.du, &gb.dv][c];
            let [low, high] = range(y, points);
            let s = half[c] * if c < 2 { 1.0 } else { -1.0 };
            if s >= 0.0 { [low * s, high * s] } else { [high * s, low * s] }
        };
        for (j, &c) in others.iter().enumerate() {
            let unit = if i == j { 1.0 } else { 0.0 };
            let [low, high] = of(c);
            error[i][j] = (high - unit).abs().max((low - unit).abs());
        }
        let [low, high] = of(k);
        drift[i] = low.abs().max(high.abs());
    }
    if (0..3).any(|i| step[i].abs() > 1.0 + error[i].iter().sum::<f64>() + drift[i]) {
        return Verdict::Empty;
    }
    if !contracts(&error) {
        return Verdict::Split;
    }
    let rest = DMat3::IDENTITY
        - DMat3::from_cols(
            DVec3::new(error[0][0], error[1][0], error[2][0]),
            DVec3::new(error[0][1], error[1][1], error[2][1]),
            DVec3::new(error[0][2], error[1][2], error[2][2]),
        );
    let slope = rest.inverse() * DVec3::from(drift);
    if !slope.is_finite() || slope.max_element() * 2.0 + 1.0 > GROWTH {
        return Verdict::Split;
    }
    let at = |x4: f64| -> Option<[f64; 4]> { solve_at(sheet, [pa, pb], center, half, k, x4, step, &others) };
    let Some(z) = at(0.0) else { return Verdict::Split };
    for (i, &c) in others.iter().enumerate() {
        let offset = (z[c] - center[c]).abs() / half[c];
        if offset > 1.0 + slope[i] {
            // Newton in a box with one solution at most: outside the reach of the small box, so none meets it.
            return if offset < GROWTH { Verdict::Empty } else { Verdict::Split };
        }
    }
    let mut reach = [1.0; 4];
    for (i, &c) in others.iter().enumerate() {
        reach[c] = slope[i];
    }
    let limits = [sheet.pieces[pa].low, sheet.pieces[pa].high, sheet.pieces[pb].low, sheet.pieces[pb].high];
    let mut open = vec![(-1.0, 1.0, 0)];
    let mut settled = true;
    while let Some((from, to, depth)) = open.pop() {
        let Some(z) = at(0.5 * (from + to)) else {
            settled = false;
            break;
        };
        let width: f64 = 0.5 * (to - from);
        let (mut least, mut outside, mut sure) = (f64::INFINITY, false, true);
        for c in 0..4 {
            let (low, high) = if c < 2 { (limits[0][c], limits[1][c]) } else { (limits[2][c - 2], limits[3][c - 2]) };
            let margin = (z[c] - low).min(high - z[c]);
            least = least.min(margin);
            outside |= margin < -(reach[c] * width * half[c]) - 1e-9;
            sure &= margin >= reach[c] * width * half[c];
        }
        if outside {
            continue;
        }
        let inside = least >= -1e-9;
        if inside && !register.contains(z) {
            let (p, q) = (DVec2::new(z[0], z[1]), DVec2::new(z[2], z[3]));
            match march::through(sheet, p, q, pace, job) {
                Some(trace) => register.add(trace),
                None => {
                    settled = false;
                    break;
                }
            }
            if !register.contains(z) {
                settled = false;
                break;
            }
        }
        if !sure && depth < if inside { 3 } else { 8 } {
            let middle = 0.5 * (from + to);
            open.push((from, middle, depth + 1));
            open.push((middle, to, depth + 1));
        }
    }
    if settled { Verdict::Covered } else { Verdict::Split }
}

/// The solution of S(p) = S(q) on two continued pieces with one of the four parameters fixed.
#[allow(clippy::too_many_arguments)]
fn solve_at(
    sheet: &Sheet,
    [pa, pb]: [usize; 2],
    center: [f64; 4],
    half: [f64; 4],
    k: usize,
    x4: f64,
    step: DVec3,
    others: &[usize],
) -> Option<[f64; 4]> {
    let mut z = center;
    z[k] += x4 * half[k];
    for (i, &c) in others.iter().enumerate() {
        z[c] -= step[i].clamp(-GROWTH, GROWTH) * half[c];
    }
    let mut last = f64::INFINITY;
    for _ in 0..20 {
        let (a, b) = (sheet.jet_on(pa, DVec2::new(z[0], z[1]), 1), sheet.jet_on(pb, DVec2::new(z[2], z[3]), 1));
        let columns = [a.d[0], a.d[1], -b.d[0], -b.d[1]];
        let frame = DMat3::from_cols(columns[others[0]], columns[others[1]], columns[others[2]]);
        let d = frame.inverse() * (b.s - a.s);
        if !d.is_finite() {
            return None;
        }
        for (i, &c) in others.iter().enumerate() {
            z[c] += d[i];
        }
        if (0..4).any(|c| (z[c] - center[c]).abs() > 4.0 * GROWTH * half[c]) {
            return None;
        }
        let size = d.length();
        if size < 1e-13 || (size < 1e-10 && size > 0.3 * last) {
            return Some(z);
        }
        last = size;
    }
    None
}
