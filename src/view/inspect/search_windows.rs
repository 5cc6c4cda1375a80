//! The windows of one size that failed their test, as one area of grid cells: rows of cells to fill and border lines.
//! Windows overlap by all but one cell, so one by one they would hide each other.

use glam::DVec2;

use crate::kernel::self_ssi::record::Record;

/// The cells that lie in at least one failed window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WindowArea {
    /// Runs of cells, `[[u0, u1], [v0, v1]]`, disjoint.
    pub runs: Vec<[[f64; 2]; 2]>,
    /// Lines between cells of the area and others, one point for each grid line that they meet.
    pub border: Vec<Vec<DVec2>>,
    /// How many cells.
    pub cells: usize,
}

impl WindowArea {
    /// The area of the failed windows of a size. Cost: the cells of the grid.
    pub fn new(record: &Record, size: u32) -> Self {
        let [width, height] = record.lines.each_ref().map(|l| l.len().saturating_sub(1));
        let mut inside = vec![false; width * height];
        for window in record.windows.iter().filter(|w| w.size == size) {
            let [i, j] = window.first.map(|k| k as usize);
            let end = |k: usize, most: usize| (k + size as usize).min(most);
            for row in j..end(j, height) {
                for cell in inside.iter_mut().take(row * width + end(i, width)).skip(row * width + i) {
                    *cell = true;
                }
            }
        }
        let at = |i: usize, j: usize| i < width && j < height && inside[j * width + i];
        let [us, vs] = &record.lines;
        let mut out = Self { cells: inside.iter().filter(|c| **c).count(), ..Self::default() };
        for j in 0..height {
            for [from, to] in spans(width, |i| at(i, j)) {
                out.runs.push([[us[from], us[to]], [vs[j], vs[j + 1]]]);
            }
        }
        // Below the first and the last row there is nothing: one line more than rows.
        let below = |i: usize, j: usize| j > 0 && at(i, j - 1);
        for j in 0..=height {
            for [from, to] in spans(width, |i| below(i, j) != at(i, j)) {
                out.border.push((from..=to).map(|i| DVec2::new(us[i], vs[j])).collect());
            }
        }
        let left = |i: usize, j: usize| i > 0 && at(i - 1, j);
        for i in 0..=width {
            for [from, to] in spans(height, |j| left(i, j) != at(i, j)) {
                out.border.push((from..=to).map(|j| DVec2::new(us[i], vs[j])).collect());
            }
        }
        out
    }
}

/// The maximal runs of numbers below `count` for which `is` holds: first, and one past the last.
fn spans(count: usize, is: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut out: Vec<[usize; 2]> = Vec::new();
    for k in (0..count).filter(|&k| is(k)) {
        match out.last_mut().filter(|last| last[1] == k) {
            Some(last) => last[1] = k + 1,
            None => out.push([k, k + 1]),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::self_ssi::record::FailedWindow;

    #[test]
    fn overlapping_windows_are_one_area_with_its_border() {
        let line = |n: u32| (0..=n).map(f64::from).collect::<Vec<f64>>();
        let window = |size, first| FailedWindow { size, first, uv_box: [[0.0; 2]; 2] };
        let windows = vec![window(3, [1, 1]), window(3, [2, 1]), window(2, [6, 4])];
        let record = Record { lines: [line(9), line(6)], windows, ..Record::default() };
        let length = |area: &WindowArea| {
            let steps = area.border.iter().flat_map(|l| l.windows(2).map(|s| s[0].distance(s[1])));
            steps.sum::<f64>()
        };
        let large = WindowArea::new(&record, 3);
        assert_eq!((large.cells, large.runs.len()), (12, 3), "4 x 3 cells in three rows");
        assert_eq!(length(&large), 14.0);
        let small = WindowArea::new(&record, 2);
        assert_eq!((small.cells, length(&small)), (4, 8.0), "up to the border of the grid");
        let area: f64 = large.runs.iter().map(|[u, v]| (u[1] - u[0]) * (v[1] - v[0])).sum();
        assert_eq!(area, 12.0);
    }
}
