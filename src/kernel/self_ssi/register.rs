//! The branches that were traced, and whether a solution lies on one of them.
//!
//! Stretches of 16 chords have a box in the four parameters; inside one, the branch point with the same projection on
//! the chord decides.

use glam::DVec2;

use super::chart::Chart;
use super::march::{self, Trace};
use super::sheet::Sheet;

/// Traced branches with their boxes.
pub(crate) struct Register<'a> {
    sheet: &'a Sheet,
    pub traces: Vec<Trace>,
    boxes: Vec<Vec<[[f64; 4]; 2]>>,
}

impl<'a> Register<'a> {
    pub fn new(sheet: &'a Sheet) -> Self {
        Self { sheet, traces: Vec::new(), boxes: Vec::new() }
    }

    /// Adds a branch that was traced.
    pub fn add(&mut self, trace: Trace) {
        let boxes = trace
            .nodes
            .windows(2)
            .collect::<Vec<_>>()
            .chunks(16)
            .map(|chunk| {
                let mut b = [[f64::INFINITY; 4], [f64::NEG_INFINITY; 4]];
                for pair in chunk {
                    for [p, q] in *pair {
                        for (k, x) in [p.x, p.y, q.x, q.y].into_iter().enumerate() {
                            b[0][k] = b[0][k].min(x);
                            b[1][k] = b[1][k].max(x);
                        }
                    }
                }
                for k in 0..4 {
                    let slack = 0.1 * (b[1][k] - b[0][k]) + 1e-7;
                    b[0][k] -= slack;
                    b[1][k] += slack;
                }
                b
            })
            .collect();
        self.boxes.push(boxes);
        self.traces.push(trace);
    }

    /// Whether a solution lies on a traced branch.
    pub fn contains(&self, z: [f64; 4]) -> bool {
        let (p, q) = (DVec2::new(z[0], z[1]), DVec2::new(z[2], z[3]));
        for (trace, boxes) in self.traces.iter().zip(&self.boxes) {
            for (at, b) in boxes.iter().enumerate() {
                for pair in [[p, q], [q, p]] {
                    // Traces run on across seams: bring the pair to the turn of this stretch.
                    let middle = DVec2::new(b[0][0] + b[1][0], b[0][1] + b[1][1]) * 0.5;
                    let other = DVec2::new(b[0][2] + b[1][2], b[0][3] + b[1][3]) * 0.5;
                    let pair = [
                        pair[0] + march::turns(self.sheet, middle, pair[0]),
                        pair[1] + march::turns(self.sheet, other, pair[1]),
                    ];
                    let y = [pair[0].x, pair[0].y, pair[1].x, pair[1].y];
                    if (0..4).any(|k| y[k] < b[0][k] || y[k] > b[1][k]) {
                        continue;
                    }
                    let last = (at * 16 + 16).min(trace.nodes.len() - 1);
                    if trace.nodes[at * 16..=last].windows(2).any(|s| self.on_segment(pair, s[0], s[1])) {
                        return true;
                    }
                }
            }
        }
        false
    }

    /// Whether a solution lies on the branch between two of its nodes.
    fn on_segment(&self, y: [DVec2; 2], a: [DVec2; 2], b: [DVec2; 2]) -> bool {
        let along = [b[0] - a[0], b[1] - a[1]];
        let to = [y[0] - a[0], y[1] - a[1]];
        let dot = |a: [DVec2; 2], b: [DVec2; 2]| a[0].dot(b[0]) + a[1].dot(b[1]);
        let squared = dot(along, along);
        if squared <= 0.0 {
            return dot(to, to) < 1e-16;
        }
        let at = dot(to, along) / squared;
        if !(-0.05..=1.05).contains(&at) {
            return false;
        }
        let off = [to[0] - along[0] * at, to[1] - along[1] * at];
        let distance = dot(off, off);
        if distance < 1e-18 {
            return true;
        }
        if distance > 0.05 * squared + 1e-16 {
            return false;
        }
        // The branch point with the same projection on the chord decides.
        let [p, q] = [a[0] + along[0] * at, a[1] + along[1] * at];
        let row = [along[0].x, along[0].y, along[1].x, along[1].y].map(|x| x / squared.sqrt());
        let chart = Chart::Far([p.x, p.y, q.x, q.y]);
        match march::correct(self.sheet, chart, &row, 0.5 * squared.sqrt() + 1e-7) {
            Some((c, _)) => {
                let [p, q] = c.points();
                p.distance(y[0]) + q.distance(y[1]) < 1e-7
            }
            None => false,
        }
    }
}
