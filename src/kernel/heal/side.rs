//! One side of a patch: several curves joined end to end, sampled by arc length as a whole.
//!
//! The pieces come in any order and direction; the chain with the smallest sum of gaps is searched (all orders up
//! to six pieces, greedily from every start beyond). Gaps within the joining tolerance are closed: both ends move
//! to their middle, and the displacement fades linearly along each piece. Larger ones are refused by name.

use glam::DVec3;

use crate::kernel::geom::arc_length::ArcLength;
use crate::kernel::geom::closest_curve::descend;
use crate::kernel::geom::{Aabb, Curve};

/// Why pieces are no side.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SideError {
    /// There is nothing to join.
    #[error("it has no piece; pick at least one curve for it")]
    Empty,
    /// A piece is a point.
    #[error("piece {piece} has zero length (it is the point {at})")]
    ZeroPiece {
        /// Which piece, from 1.
        piece: usize,
        /// Where it is.
        at: DVec3,
    },
    /// Two neighbouring pieces do not meet.
    #[error("pieces {pieces:?} do not meet: {gap:.3e} apart at {at}, the joining tolerance is {tolerance:.3e}")]
    Gap {
        /// Which pieces, from 1.
        pieces: [usize; 2],
        /// How far they are apart.
        gap: f64,
        /// What would be closed.
        tolerance: f64,
        /// Where.
        at: DVec3,
    },
}

/// Ends moved by less than this fraction of a piece's length have only been rounded.
const UNMOVED: f64 = 1e-14;
/// Places that are tried before Newton looks for the nearest point of a part of a piece.
const PLACES: usize = 8;

#[derive(Clone, Debug)]
struct Piece {
    curve: Curve,
    arc: ArcLength,
    reversed: bool,
    /// The length of the side before this piece.
    before: f64,
    /// What is added at its start and end (in the side's direction).
    shift: [DVec3; 2],
}

impl Piece {
    fn end(&self, k: usize) -> DVec3 {
        self.curve.ends()[if self.reversed { 1 - k } else { k }]
    }

    /// The curve parameter at a length from the piece's start in the side's direction.
    fn parameter(&self, length: f64) -> f64 {
        let length = if self.reversed { self.arc.length() - length } else { length };
        self.arc.parameter_at(&self.curve, length)
    }

    fn at(&self, length: f64) -> DVec3 {
        let f = length / self.arc.length();
        self.curve.eval(self.parameter(length)) + self.shift[0].lerp(self.shift[1], f)
    }

    /// The distance of `p` from the part between two lengths, which is short enough to have one nearest point.
    fn distance(&self, p: DVec3, within: [f64; 2]) -> f64 {
        let [a, b] = within.map(|s| self.parameter(s));
        let (low, high) = (a.min(b), a.max(b));
        let moved = self.shift.iter().any(|s| s.length() > UNMOVED * self.arc.length());
        let way = if self.reversed { -1.0 } else { 1.0 };
        let drift = (self.shift[1] - self.shift[0]) / self.arc.length() * way;
        // From p to the curve at t, and its derivatives by t. What the drift adds to the second is left out.
        let at = |t: f64| {
            let [c, d, dd, _] = self.curve.derivatives(t, 2);
            if !moved {
                return [c - p, d, dd];
            }
            let s = self.arc.length_at(&self.curve, t);
            let s = if self.reversed { self.arc.length() - s } else { s };
            [c + self.shift[0].lerp(self.shift[1], s / self.arc.length()) - p, d + drift * d.length(), dd]
        };
        // The best of a few places has the nearest point between its neighbours; Newton finds it there.
        let place = |k: usize| low + (high - low) * k as f64 / PLACES as f64;
        let squared = |k: usize| at(place(k))[0].length_squared();
        let best = (0..=PLACES).map(|k| (squared(k), k)).min_by(|x, y| x.0.total_cmp(&y.0));
        let Some((_, k)) = best else { return f64::INFINITY };
        let around = [place(k.saturating_sub(1)), place((k + 1).min(PLACES))];
        descend(at, around, place(k), 4.0 * f64::EPSILON * p.abs().max_element()).1
    }

    fn turn(&mut self) {
        self.reversed = !self.reversed;
        self.shift.swap(0, 1);
    }
}

/// A side, as one curve over the fraction 0..=1 of its length.
#[derive(Clone, Debug)]
pub struct SideCurve {
    pieces: Vec<Piece>,
    length: f64,
    ends: [DVec3; 2],
    gap: f64,
}

impl SideCurve {
    /// Joins pieces. The direction is that of the first piece in the chain that was found.
    pub fn chain(curves: &[Curve], tolerance: f64) -> Result<Self, SideError> {
        if curves.is_empty() {
            return Err(SideError::Empty);
        }
        let mut pieces = Vec::new();
        for (k, curve) in curves.iter().enumerate() {
            let arc = ArcLength::new(curve);
            let bounds = curve.bounds();
            if arc.length() <= 1e-13 * bounds.max_abs() + f64::MIN_POSITIVE {
                return Err(SideError::ZeroPiece { piece: k + 1, at: curve.ends()[0] });
            }
            pieces.push(Piece { curve: curve.clone(), arc, reversed: false, before: 0.0, shift: [DVec3::ZERO; 2] });
        }
        let order = best_chain(&pieces.iter().map(|p| p.curve.ends()).collect::<Vec<_>>());
        let mut chain: Vec<Piece> = Vec::new();
        let (mut length, mut widest) = (0.0, 0.0_f64);
        for (position, &(k, reversed)) in order.iter().enumerate() {
            let mut piece = pieces[k].clone();
            piece.reversed = reversed;
            piece.before = length;
            length += piece.arc.length();
            if let Some(last) = chain.last_mut() {
                let (a, b) = (last.end(1), piece.end(0));
                let gap = a.distance(b);
                if gap > tolerance {
                    let pieces = [order[position - 1].0 + 1, k + 1];
                    return Err(SideError::Gap { pieces, gap, tolerance, at: 0.5 * (a + b) });
                }
                widest = widest.max(gap);
                last.shift[1] = 0.5 * (b - a);
                piece.shift[0] = 0.5 * (a - b);
            }
            chain.push(piece);
        }
        let ends = [chain[0].end(0), chain[chain.len() - 1].end(1)];
        Ok(Self { pieces: chain, length, ends, gap: widest })
    }

    /// Its length, as picked.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Where it starts and ends.
    pub fn ends(&self) -> [DVec3; 2] {
        self.ends
    }

    /// The widest gap that was closed between two of its pieces.
    pub fn widest_gap(&self) -> f64 {
        self.gap
    }

    /// The same side run the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let mut side = self.clone();
        side.pieces.reverse();
        for piece in &mut side.pieces {
            piece.turn();
            piece.before = self.length - piece.before - piece.arc.length();
        }
        side.ends.swap(0, 1);
        side
    }

    /// The same side with its ends moved; the displacement fades over the first and the last piece.
    #[must_use]
    pub fn with_ends(&self, ends: [DVec3; 2]) -> Self {
        let mut side = self.clone();
        let last = side.pieces.len() - 1;
        side.pieces[0].shift[0] += ends[0] - self.ends[0];
        side.pieces[last].shift[1] += ends[1] - self.ends[1];
        side.ends = ends;
        side
    }

    /// The point at a fraction of the length; exactly an end at 0 and 1.
    pub fn point(&self, fraction: f64) -> DVec3 {
        if fraction <= 0.0 {
            return self.ends[0];
        }
        if fraction >= 1.0 {
            return self.ends[1];
        }
        let (piece, length) = self.locate(fraction);
        piece.at(length)
    }

    fn locate(&self, fraction: f64) -> (&Piece, f64) {
        let s = fraction.clamp(0.0, 1.0) * self.length;
        let k = self.pieces.partition_point(|p| p.before <= s).max(1) - 1;
        let piece = &self.pieces[k];
        (piece, (s - piece.before).clamp(0.0, piece.arc.length()))
    }

    /// `spans + 1` points, uniform in arc length.
    pub fn samples(&self, spans: usize) -> Vec<DVec3> {
        (0..=spans).map(|i| self.point(i as f64 / spans as f64)).collect()
    }

    /// The distance of `p` from the side near a fraction of its length (within `reach` of it, a fraction too).
    pub fn distance_near(&self, p: DVec3, fraction: f64, reach: f64) -> f64 {
        let range = [fraction - reach, fraction + reach].map(|f| f.clamp(0.0, 1.0) * self.length);
        self.pieces
            .iter()
            .map(|piece| (piece, range.map(|s| (s - piece.before).clamp(0.0, piece.arc.length()))))
            .filter(|(_, [low, high])| low < high)
            .map(|(piece, within)| piece.distance(p, within))
            .fold(f64::INFINITY, f64::min)
    }

    /// A box around the control points of all pieces.
    pub fn bounds(&self) -> Aabb {
        self.pieces.iter().fold(Aabb::of(self.ends), |all, p| all.union(&p.curve.bounds()))
    }
}

/// The order and directions with the smallest sum of gaps. The first piece keeps its direction when there is
/// only one.
fn best_chain(ends: &[[DVec3; 2]]) -> Vec<(usize, bool)> {
    let n = ends.len();
    let mut best = (f64::INFINITY, Vec::new());
    if n == 1 {
        return vec![(0, false)];
    }
    for k in 0..n {
        for reversed in [false, true] {
            if n <= 6 {
                extend(ends, &mut vec![(k, reversed)], 0.0, &mut best);
            } else {
                greedy(ends, (k, reversed), &mut best);
            }
        }
    }
    best.1
}

fn tail(ends: &[[DVec3; 2]], (k, reversed): (usize, bool)) -> DVec3 {
    ends[k][if reversed { 0 } else { 1 }]
}

fn head(ends: &[[DVec3; 2]], (k, reversed): (usize, bool)) -> DVec3 {
    ends[k][if reversed { 1 } else { 0 }]
}

fn extend(ends: &[[DVec3; 2]], chain: &mut Vec<(usize, bool)>, sum: f64, best: &mut (f64, Vec<(usize, bool)>)) {
    if sum >= best.0 {
        return;
    }
    if chain.len() == ends.len() {
        *best = (sum, chain.clone());
        return;
    }
    let from = tail(ends, chain[chain.len() - 1]);
    for k in 0..ends.len() {
        if chain.iter().any(|c| c.0 == k) {
            continue;
        }
        for reversed in [false, true] {
            chain.push((k, reversed));
            extend(ends, chain, sum + from.distance(head(ends, (k, reversed))), best);
            chain.pop();
        }
    }
}

fn greedy(ends: &[[DVec3; 2]], start: (usize, bool), best: &mut (f64, Vec<(usize, bool)>)) {
    let (mut chain, mut sum) = (vec![start], 0.0);
    let mut left: Vec<usize> = (0..ends.len()).filter(|&k| k != start.0).collect();
    while !left.is_empty() {
        let from = tail(ends, chain[chain.len() - 1]);
        let next = left
            .iter()
            .enumerate()
            .flat_map(|(at, &k)| [false, true].map(|r| (from.distance(head(ends, (k, r))), at, (k, r))))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((gap, at, next)) = next else { break };
        sum += gap;
        chain.push(next);
        left.remove(at);
    }
    if sum < best.0 {
        *best = (sum, chain);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(a: (f64, f64), b: (f64, f64)) -> Curve {
        Curve::segment(DVec3::new(a.0, a.1, 0.0), DVec3::new(b.0, b.1, 0.0)).unwrap()
    }

    #[test]
    fn pieces_chain_in_any_order_and_direction() {
        for count in [3, 9] {
            let mut curves: Vec<Curve> =
                (0..count)
                    .map(f64::from)
                    .map(|k| {
                        if (k as i32) % 2 == 0 {
                            line((k, 0.0), (k + 1.0, 0.0))
                        } else {
                            line((k + 1.0, 0.0), (k, 0.0))
                        }
                    })
                    .collect();
            curves.rotate_left(2);
            curves.swap(0, 1);
            let side = SideCurve::chain(&curves, 1e-6).unwrap();
            assert!((side.length() - f64::from(count)).abs() < 1e-12);
            let side = if side.ends()[0].x > 0.5 { side.reversed() } else { side };
            for i in 0..=30 {
                let f = f64::from(i) / 30.0;
                assert!(side.point(f).distance(DVec3::X * (f * f64::from(count))) < 1e-12);
                assert!(side.reversed().point(1.0 - f).distance(side.point(f)) < 1e-12);
            }
        }
    }

    #[test]
    fn small_gaps_are_closed_continuously_and_large_ones_are_named() {
        let curves = [line((0.0, 0.0), (1.0, 0.0)), line((2.0, 0.02), (1.0, 0.02))];
        let side = SideCurve::chain(&curves, 0.05).unwrap();
        assert!((side.widest_gap() - 0.02).abs() < 1e-15);
        let jump = side.point(0.5 - 1e-9).distance(side.point(0.5 + 1e-9));
        assert!(jump < 1e-8, "{jump}");
        assert!((side.point(0.5).y - 0.01).abs() < 1e-8);
        let error = SideCurve::chain(&curves, 0.01).unwrap_err();
        assert!(matches!(error, SideError::Gap { pieces: [1, 2], .. }), "{error}");
        assert!(error.to_string().contains("2.000e-2"), "{error}");
    }

    #[test]
    fn a_point_is_no_piece_and_nothing_is_no_side() {
        let dot = line((3.0, 4.0), (3.0, 4.0));
        let error = SideCurve::chain(&[line((0.0, 0.0), (3.0, 4.0)), dot], 1e-3).unwrap_err();
        assert!(matches!(error, SideError::ZeroPiece { piece: 2, .. }));
        assert!(matches!(SideCurve::chain(&[], 1e-3), Err(SideError::Empty)));
    }

    #[test]
    fn moved_ends_are_met_exactly_and_the_distance_is_that_of_the_moved_side() {
        let side = SideCurve::chain(&[line((0.0, 0.0), (1.0, 0.0))], 1e-3).unwrap();
        let ends = [DVec3::new(0.0, 0.1, 0.0), DVec3::new(1.0, -0.1, 0.0)];
        let moved = side.with_ends(ends);
        assert_eq!([moved.point(0.0), moved.point(1.0)], ends);
        let p = moved.point(0.3) + DVec3::Z * 0.5;
        assert!((moved.distance_near(p, 0.32, 0.1) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_distance_near_a_fraction_is_that_of_a_dense_search() {
        let arch = |x: f64, h: f64| {
            let p = |dx: f64, y: f64| DVec3::new(x + dx, y, 0.2 * dx * y);
            Curve::new(
                crate::kernel::geom::Knots::bezier(3, 0.0, 1.0).unwrap(),
                vec![p(0.0, 0.0), p(0.1, h), p(0.8, h), p(1.0, 0.0)],
                Some(vec![1.0, 2.0, 0.7, 1.0]),
            )
            .unwrap()
        };
        let side = SideCurve::chain(&[arch(0.0, 0.8), arch(1.0, -0.5).reversed(), arch(2.0, 0.3)], 1e-6).unwrap();
        let side = side.with_ends([side.ends()[0] + DVec3::Y * 0.05, side.ends()[1] - DVec3::Z * 0.03]);
        for side in [side.reversed(), side] {
            for k in 0..60 {
                let (f, reach) = (f64::from(k) / 59.0, 0.02 + 0.001 * f64::from(k));
                let p = side.point(f) + DVec3::new(0.02, -0.01, 0.04) * f64::from(k % 5);
                let steps = 4000;
                let dense = (0..=steps)
                    .map(|i| (f + reach * (2.0 * f64::from(i) / f64::from(steps) - 1.0)).clamp(0.0, 1.0))
                    .map(|f| side.point(f).distance(p))
                    .fold(f64::INFINITY, f64::min);
                let found = side.distance_near(p, f, reach);
                assert!(found <= dense + 1e-14 && found > dense - 2e-4 * reach, "{k}: {found} {dense}");
            }
        }
    }
}
