//! From traces to curves: points in the surface's own parameters, seams crossed with the shared point given on both
//! sides, and an upper bound of the distance between every chord and both sheets.
//!
//! The bound is Filip's: between two parameter points a step (du, dv) apart, the surface along the straight step and
//! the chord in space differ by at most (|du|^2 Muu + 2 |du dv| Muv + |dv|^2 Mvv) / 8, with the maxima of the second
//! derivatives over the rectangle. Chords whose bound exceeds the tolerance are halved.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::chart::Chart;
use super::hull::Rect;
use super::march::{self, Trace};
use super::sheet::Sheet;
use crate::kernel::ssi::result::CurvePoint;

/// Rectangles of second-derivative bounds a piece has in each direction.
const CELLS: f64 = 16.0;

/// Turns traces into points with error bounds.
pub(crate) struct Assembler<'a> {
    sheet: &'a Sheet,
    number: usize,
    second: HashMap<[i64; 5], [f64; 3]>,
}

impl<'a> Assembler<'a> {
    pub fn new(sheet: &'a Sheet, number: usize) -> Self {
        Self { sheet, number, second: HashMap::new() }
    }

    /// Halves chords until their bound is at most `tol`, and returns the largest bound that is left.
    pub fn refine(&mut self, trace: &mut Trace, tol: f64) -> f64 {
        let mut worst = 0.0_f64;
        let mut out = Vec::with_capacity(trace.nodes.len());
        let mut nodes = trace.nodes.iter().copied();
        let Some(mut last) = nodes.next() else { return 0.0 };
        out.push(last);
        for node in nodes {
            let mut open = vec![(node, 0)];
            while let Some((end, depth)) = open.pop() {
                let bound = self.bound(last, end);
                if bound > tol
                    && depth < 8
                    && let Some(middle) = self.middle(last, end)
                {
                    open.push((end, depth + 1));
                    open.push((middle, depth + 1));
                    continue;
                }
                worst = worst.max(bound);
                out.push(end);
                last = end;
            }
        }
        trace.nodes = out;
        worst
    }

    /// The branch point in the plane across the middle of a chord.
    fn middle(&self, a: [DVec2; 2], b: [DVec2; 2]) -> Option<[DVec2; 2]> {
        let [p, q] = [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5];
        let turn = march::turns(self.sheet, p, q);
        let near = (p - q - turn).length() < 0.2;
        let chart = Chart::of(p, if near { q + turn } else { q }, 0.2);
        let t = march::tangent(&chart.value(self.sheet))?;
        let length = (b[0] - a[0]).length() + (b[1] - a[1]).length();
        let [p, q] = march::correct(self.sheet, chart, &t, length)?.0.points();
        Some([p, if near { q - turn } else { q }])
    }

    /// The bound of one chord on both sheets.
    pub fn bound(&mut self, a: [DVec2; 2], b: [DVec2; 2]) -> f64 {
        let apart = |n: [DVec2; 2]| self.sheet.point(n[0]).distance(self.sheet.point(n[1]));
        let ends = 0.5 * apart(a).max(apart(b));
        let mut worst = 0.0_f64;
        for k in 0..2 {
            let d = (b[k] - a[k]).abs();
            let [uu, uv, vv] = self.second(a[k].min(b[k]), a[k].max(b[k]));
            worst = worst.max((d.x * d.x * uu + 2.0 * d.x * d.y * uv + d.y * d.y * vv) / 8.0);
        }
        worst + ends
    }

    /// Bounds of |Suu|, |Suv|, |Svv| over the cells around a rectangle.
    fn second(&mut self, low: DVec2, high: DVec2) -> [f64; 3] {
        let sheet = self.sheet;
        let at = sheet.piece_at(sheet.wrapped((low + high) * 0.5));
        let cell = sheet.pieces[at].size() / CELLS;
        let (i0, j0) = ((low.x / cell.x).floor(), (low.y / cell.y).floor());
        let (i1, j1) = ((high.x / cell.x).ceil().max(i0 + 1.0), (high.y / cell.y).ceil().max(j0 + 1.0));
        let key = [at as i64, i0 as i64, j0 as i64, i1 as i64, j1 as i64];
        *self.second.entry(key).or_insert_with(|| {
            let inside = |d: usize, t: f64| if sheet.periodic[d] { t } else { t.clamp(0.0, 1.0) };
            let low = DVec2::new(inside(0, i0 * cell.x), inside(1, j0 * cell.y));
            let high = DVec2::new(inside(0, i1 * cell.x), inside(1, j1 * cell.y));
            sheet.second_hull(&Rect::new(low, high)).0.map(|x| x.iter().map(|p| p.length()).fold(0.0, f64::max))
        })
    }

    /// A pair of parameter points in [0, 1]^2 as a point of a curve.
    pub fn point(&self, [p, q]: [DVec2; 2]) -> CurvePoint {
        let xyz: DVec3 = (self.sheet.point(p) + self.sheet.point(q)) * 0.5;
        CurvePoint {
            xyz: self.sheet.to_model(xyz),
            a: self.number,
            uv: self.sheet.to_surface(p),
            b: self.number,
            st: self.sheet.to_surface(q),
        }
    }

    /// The points of a trace, with points on seams given once for each side.
    pub fn points(&self, trace: &Trace) -> Vec<CurvePoint> {
        // Rounding must not make a curve along a seam jump from side to side.
        const SLACK: f64 = 1e-9;
        let coordinates = |n: &[DVec2; 2]| [n[0].x, n[0].y, n[1].x, n[1].y];
        let closed = |k: usize| self.sheet.periodic[k % 2];
        let Some(first) = trace.nodes.first() else { return Vec::new() };
        let ahead = trace.nodes.get(trace.nodes.len() / 2).unwrap_or(first);
        let mut turn = [0.0; 4];
        for k in 0..4 {
            if closed(k) {
                let (t, next) = (coordinates(first)[k], coordinates(ahead)[k]);
                turn[k] = t.floor();
                if (t - t.round()).abs() < SLACK {
                    turn[k] = if next < t { t.round() - 1.0 } else { t.round() };
                }
            }
        }
        let local = |n: [f64; 4], turn: &[f64; 4]| {
            let t: Vec<f64> = (0..4)
                .map(|k| if closed(k) { (n[k] - turn[k]).clamp(0.0, 1.0) } else { n[k].clamp(0.0, 1.0) })
                .collect();
            self.point([DVec2::new(t[0], t[1]), DVec2::new(t[2], t[3])])
        };
        let mut out: Vec<CurvePoint> = Vec::with_capacity(trace.nodes.len() + 4);
        let mut before = coordinates(first);
        for node in &trace.nodes {
            let here = coordinates(node);
            // Seams crossed on the way, in order.
            loop {
                let mut crossing: Option<(f64, usize, f64)> = None;
                for k in (0..4).filter(|&k| closed(k)) {
                    let t = here[k] - turn[k];
                    let (line, step) = if t > 1.0 + SLACK {
                        (turn[k] + 1.0, 1.0)
                    } else if t < -SLACK {
                        (turn[k], -1.0)
                    } else {
                        continue;
                    };
                    let at = ((line - before[k]) / (here[k] - before[k])).clamp(0.0, 1.0);
                    if crossing.is_none_or(|c| at < c.0) {
                        crossing = Some((at, k, step));
                    }
                }
                let Some((at, k, step)) = crossing else { break };
                let line = turn[k] + if step > 0.0 { 1.0 } else { 0.0 };
                let mut guess = [0, 1, 2, 3].map(|j| before[j] + (here[j] - before[j]) * at);
                guess[k] = line;
                let mut row = [0.0; 4];
                row[k] = 1.0;
                if let Some((c, _)) = march::correct(self.sheet, Chart::Far(guess), &row, 0.1) {
                    guess = c.y();
                    guess[k] = line;
                }
                out.push(local(guess, &turn));
                turn[k] += step;
                out.push(local(guess, &turn));
                before = guess;
            }
            out.push(local(here, &turn));
            before = here;
        }
        out
    }
}
