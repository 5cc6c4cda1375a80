//! Control nets: restricted to a rectangle, differentiated, written at higher degrees.

use glam::{DVec2, DVec3, DVec4};

use super::hull::Rect;
use super::sheet::Sheet;

impl Sheet {
    /// The homogeneous control points of a piece restricted (or continued) to a rectangle.
    pub fn net(&self, piece: usize, rect: &Rect) -> Vec<DVec4> {
        let piece = &self.pieces[piece];
        let size = piece.size();
        let (a, b) = ((rect.low - piece.low) / size, (rect.high - piece.low) / size);
        let mut net = piece.points.clone();
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        for j in 0..height {
            restrict(&mut net, j * width, 1, width, a.x, b.x);
        }
        for i in 0..width {
            restrict(&mut net, i, width, height, a.y, b.y);
        }
        net
    }

    /// The net of a derivative of a net of the sheet's degrees.
    pub fn differences(&self, net: &[DVec3], direction: usize, length: f64) -> Vec<DVec3> {
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        differences(net, width, height, direction, self.degree[direction], length)
    }
}

/// Restricts one line of control points to `a..b` in place.
fn restrict(net: &mut [DVec4], start: usize, stride: usize, count: usize, a: f64, b: f64) {
    let at = |i: usize| start + i * stride;
    let keep_high = |net: &mut [DVec4], t: f64| {
        for level in 1..count {
            for i in 0..count - level {
                net[at(i)] = net[at(i)] + (net[at(i + 1)] - net[at(i)]) * t;
            }
        }
    };
    let keep_low = |net: &mut [DVec4], t: f64| {
        for level in 1..count {
            for i in (level..count).rev() {
                net[at(i)] = net[at(i - 1)] + (net[at(i)] - net[at(i - 1)]) * t;
            }
        }
    };
    // Cut first where more is left, so that the second cut never divides by a small length.
    if b.abs() > (1.0 - a).abs() {
        if b != 1.0 {
            keep_low(net, b);
        }
        if a != 0.0 {
            keep_high(net, a / b);
        }
    } else {
        if a != 0.0 {
            keep_high(net, a);
        }
        if b != 1.0 {
            keep_low(net, (b - a) / (1.0 - a));
        }
    }
}

/// Differences of a `width` x `height` net along a direction, times degree over length: the derivative's net.
pub(crate) fn differences(
    net: &[DVec3],
    width: usize,
    height: usize,
    direction: usize,
    degree: usize,
    length: f64,
) -> Vec<DVec3> {
    if degree == 0 {
        return vec![DVec3::ZERO];
    }
    let factor = degree as f64 / length;
    let (w, h, step) = if direction == 0 { (width - 1, height, 1) } else { (width, height - 1, width) };
    (0..w * h).map(|k| (k / w) * width + k % w).map(|at| (net[at + step] - net[at]) * factor).collect()
}

/// The net of the derivative taken `by[0]` times by u and `by[1]` times by v, of a net over a rectangle of this size.
pub(crate) fn derivative(net: &[DVec3], mut degree: [usize; 2], by: [usize; 2], size: DVec2) -> Vec<DVec3> {
    let (mut net, mut count) = (net.to_vec(), [degree[0] + 1, degree[1] + 1]);
    for d in 0..2 {
        for _ in 0..by[d] {
            if degree[d] == 0 {
                return vec![DVec3::ZERO];
            }
            net = differences(&net, count[0], count[1], d, degree[d], size[d]);
            (degree[d], count[d]) = (degree[d] - 1, count[d] - 1);
        }
    }
    net
}

/// A net of degrees `from` written at the higher degrees `to`.
pub(crate) fn elevated(net: &[DVec3], from: [usize; 2], to: [usize; 2]) -> Vec<DVec3> {
    let mut rows: Vec<Vec<DVec3>> = net.chunks_exact(from[0] + 1).map(<[DVec3]>::to_vec).collect();
    let blend = |a: DVec3, b: DVec3, i: usize, n: usize| a.lerp(b, 1.0 - i as f64 / n as f64);
    for n in from[0] + 1..=to[0] {
        for row in &mut rows {
            let last = row[n - 1];
            row.push(last);
            for i in (1..n).rev() {
                row[i] = blend(row[i - 1], row[i], i, n);
            }
        }
    }
    for n in from[1] + 1..=to[1] {
        rows.push(rows[n - 1].clone());
        for j in (1..n).rev() {
            for i in 0..rows[j].len() {
                rows[j][i] = blend(rows[j - 1][i], rows[j][i], j, n);
            }
        }
    }
    rows.concat()
}
