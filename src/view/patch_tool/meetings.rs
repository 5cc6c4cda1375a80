//! Where sides meet away from their ends, and the loop that they close when each is cut there.
//!
//! A side is often picked longer than it is needed: a whole border, a whole iso-curve. Its ends then say nothing about
//! the loop that is meant. Of each pair of polylines the places within the joining tolerance of each other are collected,
//! and the loop is looked for whose four corners are such places; among several, the one that keeps the parts that
//! were clicked, then the one with the smallest gaps. Cost: the product of the numbers of segments of two sides, most
//! of them turned away by one distance; at most [`MOST`]^4 loops.

use glam::DVec3;

use super::arrange::{Order, SideLine};

/// Meetings of one pair that are kept.
const MOST: usize = 8;
/// Two meetings of one pair are one when they are nearer than this along both, as a fraction of the shorter one.
const APART: f64 = 0.02;
/// What is left of a side must be longer than this fraction of it.
const LEFT: f64 = 1e-3;

/// A place where two polylines come within the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meeting {
    /// How far along each.
    pub at: [f64; 2],
    /// The middle between them.
    pub point: DVec3,
    /// How far they are apart.
    pub gap: f64,
}

/// All places where two polylines meet, the closest first.
pub(super) fn meetings(a: &[DVec3], b: &[DVec3], tol: f64) -> Vec<Meeting> {
    let lengths = |line: &[DVec3]| {
        let mut sums = vec![0.0];
        for pair in line.windows(2) {
            sums.push(sums[sums.len() - 1] + pair[0].distance(pair[1]));
        }
        sums
    };
    let (along_a, along_b) = (lengths(a), lengths(b));
    let mut all = Vec::new();
    for (i, s) in a.windows(2).enumerate() {
        for (j, t) in b.windows(2).enumerate() {
            let (p, q) = (along_a[i + 1] - along_a[i], along_b[j + 1] - along_b[j]);
            let reach = p + q + tol;
            if s[0].distance_squared(t[0]) > reach * reach {
                continue;
            }
            let (p, q) = nearest_of_segments(s, t);
            let gap = p.distance(q);
            if gap <= tol {
                let at = [along_a[i] + s[0].distance(p), along_b[j] + t[0].distance(q)];
                all.push(Meeting { at, point: 0.5 * (p + q), gap });
            }
        }
    }
    all.sort_by(|x, y| x.gap.total_cmp(&y.gap));
    let near = (APART * along_a[a.len() - 1].min(along_b[b.len() - 1])).max(2.0 * tol);
    let mut kept: Vec<Meeting> = Vec::new();
    for meeting in all {
        let same = |k: &Meeting| (0..2).all(|d| (k.at[d] - meeting.at[d]).abs() <= near);
        if kept.len() < MOST && !kept.iter().any(same) {
            kept.push(meeting);
        }
    }
    kept
}

/// The nearest points of two segments: the inner solution where it is inside both, else the best of the four ends.
fn nearest_of_segments(s: &[DVec3], t: &[DVec3]) -> (DVec3, DVec3) {
    let (d, e, r) = (s[1] - s[0], t[1] - t[0], s[0] - t[0]);
    let (a, b, c) = (d.length_squared(), d.dot(e), e.length_squared());
    let det = a * c - b * b;
    if det > 1e-14 * a * c {
        let (u, v) = ((b * e.dot(r) - c * d.dot(r)) / det, (a * e.dot(r) - b * d.dot(r)) / det);
        if (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v) {
            return (s[0] + d * u, t[0] + e * v);
        }
    }
    let foot = |p: DVec3, q: &[DVec3]| {
        let d = q[1] - q[0];
        let x = ((p - q[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0);
        if x.is_finite() { q[0] + d * x } else { q[0] }
    };
    let pairs = [(s[0], foot(s[0], t)), (s[1], foot(s[1], t)), (foot(t[0], s), t[0]), (foot(t[1], s), t[1])];
    let mut best = pairs[0];
    for pair in pairs {
        if pair.0.distance_squared(pair.1) < best.0.distance_squared(best.1) {
            best = pair;
        }
    }
    best
}

/// Four sides in a loop that closes when each is cut where it meets its neighbours.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cut {
    /// The loop.
    pub order: Order,
    /// What is left of each side, by the number of the side: how far along it, the start before the end.
    pub spans: [[f64; 2]; 4],
}

impl Cut {
    /// What is left of a side.
    pub fn of(&self, side: usize, line: &SideLine) -> Vec<DVec3> {
        between(&line.points, self.spans[side])
    }

    /// The two ends of what is left of a side.
    pub fn ends(&self, side: usize, line: &SideLine) -> [DVec3; 2] {
        let left = self.of(side, line);
        [left.first(), left.last()].map(|p| p.copied().unwrap_or(line.points[0]))
    }

    /// A point inside what is left of a side.
    pub fn middle(&self, side: usize, line: &SideLine) -> DVec3 {
        let [from, to] = self.spans[side];
        let half = between(&line.points, [from, 0.5 * (from + to)]);
        half.last().copied().unwrap_or(line.points[0])
    }
}

/// The part of a polyline between two lengths along it.
fn between(points: &[DVec3], [from, to]: [f64; 2]) -> Vec<DVec3> {
    let mut out = Vec::new();
    let mut at = 0.0;
    for pair in points.windows(2) {
        let step = pair[0].distance(pair[1]);
        let place =
            |x: f64| if step > 0.0 { pair[0].lerp(pair[1], ((x - at) / step).clamp(0.0, 1.0)) } else { pair[0] };
        if at + step >= from && at <= to {
            if out.is_empty() {
                out.push(place(from));
            }
            out.push(place(to.min(at + step)));
        }
        at += step;
    }
    out.dedup();
    out
}

/// The loop that the sides close when they are cut where they meet; `None` when there is none. `clicked`: how far along
/// each side it was clicked.
pub(super) fn close_by_cutting(lines: [&SideLine; 4], clicked: &[Vec<f64>; 4], tol: f64) -> Option<Cut> {
    // Loops are the same run backwards: the first side stays first, and the second place comes before the fourth.
    const ORDERS: [[usize; 4]; 3] = [[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3]];
    let mut of_pairs = vec![Vec::new(); 16];
    for a in 0..4 {
        for b in a + 1..4 {
            let found = meetings(&lines[a].points, &lines[b].points, tol);
            of_pairs[b * 4 + a] = found.iter().map(|m| Meeting { at: [m.at[1], m.at[0]], ..*m }).collect();
            of_pairs[a * 4 + b] = found;
        }
    }
    let lengths = lines.map(SideLine::length);
    let mut best: Option<((usize, f64), Cut)> = None;
    for order in ORDERS {
        let corner = |k: usize| &of_pairs[order[(k + 3) % 4] * 4 + order[k]];
        for first in corner(0) {
            for second in corner(1) {
                for third in corner(2) {
                    for fourth in corner(3) {
                        let corners = [first, second, third, fourth];
                        let mut spans = [[0.0; 2]; 4];
                        let mut reversed = Vec::with_capacity(4);
                        let mut outside = 0;
                        let mut whole = true;
                        for (place, &side) in order.iter().enumerate() {
                            let [start, end] = [corners[place].at[1], corners[(place + 1) % 4].at[0]];
                            whole &= (end - start).abs() > (2.0 * tol).max(LEFT * lengths[side]);
                            reversed.push(start > end);
                            spans[side] = [start.min(end), start.max(end)];
                            let inside = |c: &f64| spans[side][0] <= *c && *c <= spans[side][1];
                            outside += clicked[side].iter().filter(|c| !inside(c)).count();
                        }
                        let cost = (outside, corners.iter().map(|c| c.gap).sum::<f64>());
                        if whole && best.as_ref().is_none_or(|(c, _)| cost < *c) {
                            best = Some((cost, Cut { order: Order { sides: order.to_vec(), reversed }, spans }));
                        }
                    }
                }
            }
        }
    }
    best.map(|(_, cut)| cut)
}

#[cfg(test)]
mod tests {
    use super::super::arrange::chain;
    use super::super::piece::Picked;
    use super::*;

    fn line(points: &[(f64, f64)]) -> SideLine {
        let points: Vec<DVec3> = points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        chain(&[Picked::polyline(&points).unwrap()]).unwrap()
    }

    #[test]
    fn meetings_are_where_lines_cross_and_where_they_touch() {
        let a = line(&[(0.0, 0.0), (4.0, 0.0)]);
        let b = line(&[(1.0, -1.0), (1.0, 1.0), (3.0, 1.0), (3.0, 1e-4)]);
        let found = meetings(&a.points, &b.points, 1e-3);
        assert_eq!(found.len(), 2);
        assert!((found[0].at[0] - 1.0).abs() < 1e-12 && (found[0].at[1] - 1.0).abs() < 1e-12);
        assert!((found[1].at[0] - 3.0).abs() < 1e-12 && (found[1].gap - 1e-4).abs() < 1e-12);
        assert_eq!(meetings(&a.points, &b.points, 1e-5).len(), 1);
        assert!(meetings(&a.points, &line(&[(0.0, 1.0), (4.0, 1.0)]).points, 0.5).is_empty());
    }

    /// The sides of the unit square, each longer at both ends.
    fn cross_hatch() -> [SideLine; 4] {
        [
            line(&[(-2.0, 0.0), (5.0, 0.0)]),
            line(&[(0.0, -3.0), (0.0, 2.0)]),
            line(&[(4.0, 1.0), (-1.0, 1.0)]),
            line(&[(1.0, 3.0), (1.0, -2.0)]),
        ]
    }

    #[test]
    fn four_long_lines_close_the_square_between_them() {
        let sides = cross_hatch();
        let cut = close_by_cutting(sides.each_ref(), &Default::default(), 1e-3).unwrap();
        for (k, side) in sides.iter().enumerate() {
            let left = cut.of(k, side);
            assert_eq!(left.len(), 2);
            assert!((left[0].distance(left[1]) - 1.0).abs() < 1e-12, "{left:?}");
        }
        // The end of each is the start of the next.
        for place in 0..4 {
            let ends = |place: usize| {
                let mut ends = cut.of(cut.order.sides[place], &sides[cut.order.sides[place]]);
                if cut.order.reversed[place] {
                    ends.reverse();
                }
                ends
            };
            assert!(ends(place)[1].distance(ends((place + 1) % 4)[0]) < 1e-12);
        }
    }

    #[test]
    fn the_part_that_was_clicked_stays() {
        // A ring cut by two lines: the left half and the right half both close a loop with two bars.
        let ring: Vec<(f64, f64)> =
            (0..=256).map(|k| f64::from(k) / 256.0 * std::f64::consts::TAU).map(|a| (a.cos(), a.sin())).collect();
        let outer: Vec<(f64, f64)> = ring.iter().map(|(x, y)| (2.0 * x, 2.0 * y)).collect();
        let sides = [line(&ring), line(&[(0.0, 0.5), (0.0, 3.0)]), line(&outer), line(&[(0.0, -0.5), (0.0, -3.0)])];
        for (turn, left) in [(0.5, true), (0.99, false)] {
            let clicked = [vec![turn * sides[0].length()], vec![], vec![turn * sides[2].length()], vec![]];
            let cut = close_by_cutting(sides.each_ref(), &clicked, 1e-3);
            if left {
                let kept = cut.unwrap().of(0, &sides[0]);
                assert!(kept.iter().all(|p| p.x < 1e-3), "the left half was clicked");
            } else {
                // The right half crosses the end of the ring, which is no single part of it.
                assert!(cut.is_some());
            }
        }
    }

    #[test]
    fn sides_that_do_not_meet_close_nothing() {
        let mut sides = cross_hatch();
        sides[3] = line(&[(9.0, 0.0), (9.0, 1.0)]);
        assert_eq!(close_by_cutting(sides.each_ref(), &Default::default(), 1e-3), None);
    }
}
