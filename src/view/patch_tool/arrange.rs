//! How picked pieces make sides, and how sides follow each other, while they are still being picked.
//!
//! Pieces of a side are chained end to end by the smallest sum of gaps. Four sides make the loop that
//! [`crate::kernel::heal::boundary_loop`] finds; a second one that is nearly as good is kept beside it. Two and three sides make what can already be said: two that face each other or meet in
//! a corner, three with the fourth side open.

use glam::DVec3;

use super::piece::Picked;
use crate::kernel::heal::boundary_loop::{LoopChoice, arrange};

/// Pieces chained into one line.
#[derive(Clone, Debug, PartialEq)]
pub struct SideLine {
    /// The pieces in the order of the chain, with whether each runs backwards in it.
    pub chain: Vec<(usize, bool)>,
    /// The points along it.
    pub points: Vec<DVec3>,
    /// The widest gap between two pieces.
    pub gap: f64,
}

impl SideLine {
    /// Its end points.
    pub fn ends(&self) -> [DVec3; 2] {
        [self.points[0], self.points[self.points.len() - 1]]
    }

    /// Its length.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    /// How far along it the place nearest to a point is.
    pub fn along(&self, p: DVec3) -> f64 {
        let (k, _, foot) = super::piece::nearest_on_at(&self.points, p);
        self.points[..=k].windows(2).map(|p| p[0].distance(p[1])).sum::<f64>() + self.points[k].distance(foot)
    }

    /// `n` points at equal distances along it, run backwards when `reversed`.
    pub fn resampled(&self, n: usize, reversed: bool) -> Vec<DVec3> {
        let mut out = resample(&self.points, n);
        if reversed {
            out.reverse();
        }
        out
    }
}

/// `n >= 2` points at equal distances along a polyline.
pub fn resample(points: &[DVec3], n: usize) -> Vec<DVec3> {
    let mut lengths = vec![0.0];
    for pair in points.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
    }
    let total = lengths[lengths.len() - 1];
    let mut k = 0;
    (0..n)
        .map(|i| {
            let target = total * i as f64 / (n - 1) as f64;
            while k + 2 < points.len() && lengths[k + 1] < target {
                k += 1;
            }
            let step = lengths[k + 1] - lengths[k];
            let s = if step > 0.0 { ((target - lengths[k]) / step).clamp(0.0, 1.0) } else { 0.0 };
            points[k].lerp(points[k + 1], s)
        })
        .collect()
}

/// Chains pieces; `None` without any. The first piece runs forwards unless that costs more.
pub fn chain(pieces: &[Picked]) -> Option<SideLine> {
    let ends: Vec<[DVec3; 2]> = pieces.iter().map(Picked::ends).collect();
    let mut best: Option<(f64, Vec<(usize, bool)>)> = None;
    for start in 0..ends.len() {
        for backwards in [false, true] {
            let mut order = vec![(start, backwards)];
            let mut free: Vec<usize> = (0..ends.len()).filter(|&k| k != start).collect();
            let mut tip = ends[start][usize::from(!backwards)];
            let mut cost = 0.0;
            while !free.is_empty() {
                let (mut at, mut turn, mut gap) = (0, false, f64::INFINITY);
                for (slot, &k) in free.iter().enumerate() {
                    for turned in [false, true] {
                        let d = tip.distance(ends[k][usize::from(turned)]);
                        if d < gap {
                            (at, turn, gap) = (slot, turned, d);
                        }
                    }
                }
                let k = free.remove(at);
                order.push((k, turn));
                tip = ends[k][usize::from(!turn)];
                cost += gap;
            }
            if best.as_ref().is_none_or(|(c, _)| cost < *c * (1.0 - 1e-12)) {
                best = Some((cost, order));
            }
        }
    }
    let (_, chain) = best?;
    let mut points: Vec<DVec3> = Vec::new();
    let mut gap: f64 = 0.0;
    for &(k, backwards) in &chain {
        let mut piece = pieces[k].points.clone();
        if backwards {
            piece.reverse();
        }
        if let Some(last) = points.last() {
            gap = gap.max(last.distance(piece[0]));
        }
        points.extend(piece);
    }
    Some(SideLine { chain, points, gap })
}

/// How sides follow each other: the numbers of the sides that have pieces, in loop order, with their directions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Order {
    /// The side at each place.
    pub sides: Vec<usize>,
    /// Whether it runs backwards there.
    pub reversed: Vec<bool>,
}

/// What the sides picked so far make.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Nothing to show.
    Nothing,
    /// Two sides that face each other, in the same direction.
    Facing(Order),
    /// Two sides that meet: the second starts where the first ends.
    Meeting(Order),
    /// Three sides in a row; the fourth is open.
    Open(Order),
    /// Four sides in a loop, and another loop that is nearly as good.
    Loop(Order, Option<Order>),
}

/// The layout of the sides with these ends (`None`: not picked yet). Sides in `flipped` run against what would be best.
pub fn layout(ends: &[Option<[DVec3; 2]>; 4], flipped: [bool; 4]) -> Layout {
    let picked: Vec<usize> = (0..4).filter(|&k| ends[k].is_some()).collect();
    let e = |k: usize, backwards: bool| -> [DVec3; 2] {
        let [a, b] = ends[k].unwrap_or([DVec3::ZERO; 2]);
        if backwards { [b, a] } else { [a, b] }
    };
    let turn = |mut order: Order| {
        for (k, reversed) in order.sides.iter().zip(&mut order.reversed) {
            *reversed ^= flipped[*k];
        }
        order
    };
    match picked.as_slice() {
        [a, b] => {
            let meeting = rank(&[*a, *b], &e);
            let facing = [false, true]
                .into_iter()
                .map(|r| (e(*a, false)[0].distance(e(*b, r)[0]) + e(*a, false)[1].distance(e(*b, r)[1]), r))
                .min_by(|x, y| x.0.total_cmp(&y.0));
            // Sides that meet are a hundred times nearer to each other at one end than they are long.
            let size = e(*a, false)[0].distance(e(*a, false)[1]).min(e(*b, false)[0].distance(e(*b, false)[1]));
            match (meeting.into_iter().next(), facing) {
                (Some((gap, order)), _) if gap < 0.01 * size => Layout::Meeting(turn(order)),
                (_, Some((_, r))) => Layout::Facing(turn(Order { sides: vec![*a, *b], reversed: vec![false, r] })),
                _ => Layout::Nothing,
            }
        }
        [_, _, _] => match rank(&picked, &e).into_iter().next() {
            Some((_, order)) => Layout::Open(turn(order)),
            None => Layout::Nothing,
        },
        [_, _, _, _] => {
            let of = |c: LoopChoice| turn(Order { sides: c.order.to_vec(), reversed: c.reversed.to_vec() });
            let (best, other) = arrange(&[0, 1, 2, 3].map(|k| e(k, false)));
            Layout::Loop(of(best), other.map(of))
        }
        _ => Layout::Nothing,
    }
}

/// All rows of the sides in any order and direction, by the sum of their gaps.
fn rank(picked: &[usize], ends: &impl Fn(usize, bool) -> [DVec3; 2]) -> Vec<(f64, Order)> {
    let mut orders = Vec::new();
    permute(&mut picked.to_vec(), 0, &mut orders);
    let mut out = Vec::new();
    for sides in orders {
        let n = sides.len();
        for bits in 0..1_usize << n {
            let reversed: Vec<bool> = (0..n).map(|k| bits >> (n - 1 - k) & 1 == 1).collect();
            let at = |k: usize| ends(sides[k], reversed[k]);
            let gap: f64 = (1..n).map(|k| at(k - 1)[1].distance(at(k)[0])).sum();
            out.push((gap, Order { sides: sides.clone(), reversed }));
        }
    }
    // Stable: among equals the order of picking wins.
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// All permutations of what follows the first `fixed` entries, in lexicographic order.
fn permute(list: &mut Vec<usize>, fixed: usize, out: &mut Vec<Vec<usize>>) {
    if fixed + 1 >= list.len() {
        out.push(list.clone());
        return;
    }
    for k in fixed..list.len() {
        let moved = list.remove(k);
        list.insert(fixed, moved);
        permute(list, fixed + 1, out);
        let moved = list.remove(fixed);
        list.insert(k, moved);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.0)
    }

    const SQUARE: [[(f64, f64); 2]; 4] =
        [[(0.0, 0.0), (2.0, 0.0)], [(2.0, 0.0), (2.0, 1.0)], [(2.0, 1.0), (0.0, 1.0)], [(0.0, 1.0), (0.0, 0.0)]];

    fn ends(list: [Option<[(f64, f64); 2]>; 4]) -> [Option<[DVec3; 2]>; 4] {
        list.map(|e| e.map(|e| e.map(|(x, y)| p(x, y))))
    }

    #[test]
    fn any_order_and_direction_of_a_square_closes() {
        let mut orders = Vec::new();
        permute(&mut vec![0, 1, 2, 3], 0, &mut orders);
        assert_eq!(orders.len(), 24);
        for order in orders {
            for bits in 0..16 {
                let side = |k: usize| {
                    let [a, b] = SQUARE[order[k]];
                    Some(if bits >> k & 1 == 1 { [b, a] } else { [a, b] })
                };
                let ends = ends([side(0), side(1), side(2), side(3)]);
                let Layout::Loop(found, other) = layout(&ends, [false; 4]) else { panic!() };
                assert_eq!((found.sides[0], found.reversed[0], other), (0, false, None));
                for k in 0..4 {
                    let end = |k: usize, end: usize| {
                        let e = ends[found.sides[k]].unwrap();
                        e[end ^ usize::from(found.reversed[k])]
                    };
                    assert_eq!(end(k, 1), end((k + 1) % 4, 0));
                }
            }
        }
    }

    #[test]
    fn two_sides_face_or_meet() {
        let facing = layout(&ends([Some(SQUARE[0]), None, Some(SQUARE[2]), None]), [false; 4]);
        assert_eq!(facing, Layout::Facing(Order { sides: vec![0, 2], reversed: vec![false, true] }));
        let flipped = layout(&ends([Some(SQUARE[0]), None, Some(SQUARE[2]), None]), [false, false, true, false]);
        assert_eq!(flipped, Layout::Facing(Order { sides: vec![0, 2], reversed: vec![false, false] }));
        let meeting = layout(&ends([Some(SQUARE[0]), Some(SQUARE[1]), None, None]), [false; 4]);
        assert_eq!(meeting, Layout::Meeting(Order { sides: vec![0, 1], reversed: vec![false, false] }));
        let turned = layout(&ends([Some(SQUARE[1]), Some([SQUARE[0][1], SQUARE[0][0]]), None, None]), [false; 4]);
        let Layout::Meeting(order) = turned else { panic!("{turned:?}") };
        assert_eq!(order.sides.len(), 2);
    }

    #[test]
    fn three_sides_leave_the_fourth_open() {
        let Layout::Open(order) = layout(&ends([Some(SQUARE[2]), Some(SQUARE[0]), Some(SQUARE[1]), None]), [false; 4])
        else {
            panic!()
        };
        assert_eq!(order.sides[1], 2, "the middle one is in the middle");
    }

    #[test]
    fn a_loop_that_is_nearly_as_good_is_kept() {
        let sides = [
            Some([(0.0, 0.0), (2.0, 0.0)]),
            Some([(2.2, 0.0), (2.2, 1.0)]),
            Some([(2.0, 1.0), (0.0, 1.0)]),
            // In the middle between both ends of its neighbours: either direction is as good.
            Some([(-0.5, 0.5), (0.5, 0.5)]),
        ];
        let Layout::Loop(_, other) = layout(&ends(sides), [false; 4]) else { panic!() };
        assert!(other.is_some());
    }

    #[test]
    fn pieces_chain_in_any_order() {
        let piece = |a: DVec3, b: DVec3| Picked::line(a, b).unwrap();
        let pieces =
            [piece(p(2.0, 0.0), p(1.0, 0.0)), piece(p(0.0, 0.0), p(1.0, 0.0)), piece(p(3.0, 0.1), p(2.0, 0.1))];
        let line = chain(&pieces).unwrap();
        assert!((line.gap - 0.1).abs() < 1e-15);
        let [a, b] = line.ends();
        assert!((a.distance(b) - 3.0).abs() < 0.01);
        assert_eq!(line.chain.len(), 3);
        let even = line.resampled(11, false);
        let step = even[0].distance(even[1]);
        assert!(even.windows(2).filter(|w| (w[0].distance(w[1]) - step).abs() < 0.02).count() >= 9);
        assert!(chain(&[]).is_none());
    }
}
