//! Four sides in any order and direction -> one oriented closed loop (HJR99 3.2, step 1 of 3.1).
//!
//! The first side keeps its place and direction; of the 6 x 8 ways to go on through the other three, the one with
//! the smallest sum of corner gaps is taken. Another loop whose sum is within 10 % is reported with the result,
//! so that a user can switch. Gaps within the joining tolerance are closed (both ends move to their middle);
//! larger ones, sides of zero length, sides that close on themselves, coincide or cross are errors by name.

use glam::DVec3;

use super::side::SideCurve;

/// How four sides follow each other: `order[k]` is the side at place k, run backwards where `reversed[k]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopChoice {
    /// The side at each place of the loop, from 0.
    pub order: [usize; 4],
    /// Whether it runs backwards there.
    pub reversed: [bool; 4],
}

/// Why four sides are no loop. Sides count from 1 in messages.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoopError {
    /// A side is a point.
    #[error("side {side} has zero length ({length:.3e}, at {at}); the joining tolerance is {tolerance:.3e}")]
    ZeroLength {
        /// Which side.
        side: usize,
        /// Its length.
        length: f64,
        /// Where it is.
        at: DVec3,
        /// Below this a side is a point.
        tolerance: f64,
    },
    /// A side ends where it starts.
    #[error("side {side} closes on itself at {at}; split it so that the loop has four corners")]
    Closed {
        /// Which side.
        side: usize,
        /// Where.
        at: DVec3,
    },
    /// Two sides are the same curve.
    #[error("sides {} and {} coincide (nowhere more than {distance:.3e} apart); pick another curve for one", sides[0], sides[1])]
    Coincide {
        /// Which two.
        sides: [usize; 2],
        /// How far they are apart at most.
        distance: f64,
    },
    /// The sides do not close.
    #[error("the sides do not close: {gap:.3e} between sides {} and {} at {at}, the joining tolerance is {tolerance:.3e}{}",
        sides[0], sides[1], others(*more))]
    CornerGap {
        /// The two sides at the widest corner.
        sides: [usize; 2],
        /// How far their ends are apart.
        gap: f64,
        /// What would be closed.
        tolerance: f64,
        /// The middle of the gap.
        at: DVec3,
        /// How many other corners are open too.
        more: usize,
    },
    /// What was decided by hand is no order of four sides.
    #[error("the order {order:?} does not name each of the sides 0 to 3 once")]
    Order {
        /// What was given.
        order: [usize; 4],
    },
    /// Two sides meet away from their corner.
    #[error("sides {} and {} cross or touch at {at}, away from a corner", sides[0], sides[1])]
    Cross {
        /// Which two.
        sides: [usize; 2],
        /// Where.
        at: DVec3,
    },
}

fn others(more: usize) -> String {
    match more {
        0 => String::new(),
        1 => "; one other corner is open too".into(),
        n => format!("; {n} other corners are open too"),
    }
}

/// A closed loop: side k runs from corner k to corner k + 1.
#[derive(Clone, Debug)]
pub struct BoundaryLoop {
    /// The sides in loop order and direction, closed at the corners.
    pub sides: [SideCurve; 4],
    /// How they came from the given ones.
    pub choice: LoopChoice,
    /// The corners; corner k is where side k starts.
    pub corners: [DVec3; 4],
    /// The gap that was closed at each corner.
    pub gaps: [f64; 4],
    /// Another way to close the loop whose gaps sum to within 10 % of this one's.
    pub alternative: Option<LoopChoice>,
}

impl LoopChoice {
    fn ends(&self, ends: &[[DVec3; 2]; 4], place: usize) -> [DVec3; 2] {
        let [a, b] = ends[self.order[place]];
        if self.reversed[place] { [b, a] } else { [a, b] }
    }

    /// The gap before each place: at corner k, between the side before and side k.
    fn gaps(&self, ends: &[[DVec3; 2]; 4]) -> [f64; 4] {
        [0, 1, 2, 3].map(|k| self.ends(ends, (k + 3) % 4)[1].distance(self.ends(ends, k)[0]))
    }
}

/// All 48 loops through the sides, with the first side at the first place running forwards.
fn choices() -> impl Iterator<Item = LoopChoice> {
    const ORDERS: [[usize; 4]; 6] =
        [[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3], [0, 2, 3, 1], [0, 3, 1, 2], [0, 3, 2, 1]];
    ORDERS.into_iter().flat_map(|order| {
        (0..8).map(move |bits| LoopChoice { order, reversed: [false, bits & 1 != 0, bits & 2 != 0, bits & 4 != 0] })
    })
}

/// The best loop and, when its gaps are within 10 %, the second best.
pub fn arrange(ends: &[[DVec3; 2]; 4]) -> (LoopChoice, Option<LoopChoice>) {
    let mut ranked: Vec<(f64, LoopChoice)> = choices().map(|c| (c.gaps(ends).iter().sum(), c)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0)); // stable: ties keep the order of the list
    let (best, second) = (ranked[0], ranked[1]);
    (best.1, (second.0 <= 1.1 * best.0).then_some(second.1))
}

/// Closes four sides into a loop. `forced` overrides the search.
pub fn close(sides: &[SideCurve; 4], tolerance: f64, forced: Option<LoopChoice>) -> Result<BoundaryLoop, LoopError> {
    if let Some(LoopChoice { order, .. }) = forced
        && (0..4).any(|k| !order.contains(&k))
    {
        return Err(LoopError::Order { order });
    }
    for (k, side) in sides.iter().enumerate() {
        let ends = side.ends();
        if side.length() <= tolerance {
            return Err(LoopError::ZeroLength { side: k + 1, length: side.length(), at: ends[0], tolerance });
        }
        if ends[0].distance(ends[1]) <= tolerance {
            return Err(LoopError::Closed { side: k + 1, at: ends[0] });
        }
    }
    let lines: Vec<Vec<DVec3>> = sides.iter().map(|s| s.samples(CHECK)).collect();
    for a in 0..4 {
        for b in a + 1..4 {
            let shorter = sides[a].length().min(sides[b].length());
            let near = tolerance.min(1e-3 * shorter);
            if let Some(distance) = coincide(&lines[a], &lines[b], near) {
                return Err(LoopError::Coincide { sides: [a + 1, b + 1], distance });
            }
        }
    }
    let ends = [0, 1, 2, 3].map(|k| sides[k].ends());
    let (choice, alternative) = match forced {
        Some(choice) => (choice, None),
        None => arrange(&ends),
    };
    let gaps = choice.gaps(&ends);
    let before = |k: usize| choice.ends(&ends, (k + 3) % 4)[1];
    let corners = [0, 1, 2, 3].map(|k| 0.5 * (before(k) + choice.ends(&ends, k)[0]));
    let open = gaps.iter().filter(|&&g| g > tolerance).count();
    if open > 0 {
        let widest = (0..4).max_by(|&a, &b| gaps[a].total_cmp(&gaps[b])).unwrap_or(0);
        let sides = [choice.order[(widest + 3) % 4] + 1, choice.order[widest] + 1];
        return Err(LoopError::CornerGap { sides, gap: gaps[widest], tolerance, at: corners[widest], more: open - 1 });
    }
    for a in 0..4 {
        for b in a + 1..4 {
            let (k, l) = (choice.order[a], choice.order[b]);
            let near = tolerance.min(1e-3 * sides[k].length().min(sides[l].length()));
            if let Some(at) = crossing(&lines[k], &lines[l], near) {
                return Err(LoopError::Cross { sides: [k.min(l) + 1, k.max(l) + 1], at });
            }
        }
    }
    let placed = [0, 1, 2, 3].map(|place| {
        let side = &sides[choice.order[place]];
        let side = if choice.reversed[place] { side.reversed() } else { side.clone() };
        side.with_ends([corners[place], corners[(place + 1) % 4]])
    });
    Ok(BoundaryLoop { sides: placed, choice, corners, gaps, alternative })
}

/// Spans of the polylines on which coincidence and crossings are looked for.
const CHECK: usize = 64;

/// The largest distance between two polylines when it is within `near`.
fn coincide(a: &[DVec3], b: &[DVec3], near: f64) -> Option<f64> {
    let one_sided = |a: &[DVec3], b: &[DVec3]| {
        a.iter().try_fold(0.0_f64, |worst, &p| {
            let d = distance_to_polyline(p, b);
            (d <= near).then_some(worst.max(d))
        })
    };
    Some(one_sided(a, b)?.max(one_sided(b, a)?))
}

/// The distance from a point to a polyline.
pub(super) fn distance_to_polyline(p: DVec3, line: &[DVec3]) -> f64 {
    line.windows(2)
        .map(|w| {
            let d = w[1] - w[0];
            let t = ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0);
            // A repeated point divides 0 by 0.
            (w[0] + if t.is_finite() { d * t } else { DVec3::ZERO }).distance_squared(p)
        })
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

/// Where two polylines come within `near` of each other, away from their ends (a twentieth of the line).
fn crossing(a: &[DVec3], b: &[DVec3], near: f64) -> Option<DVec3> {
    let margin = CHECK / 20;
    let inner = |k: usize| k >= margin && k + 1 + margin < CHECK + 1;
    for (i, s) in a.windows(2).enumerate() {
        for (j, t) in b.windows(2).enumerate() {
            // A corner is an end of both; an end on the inside of the other side is a crossing.
            if !inner(i) && !inner(j) {
                continue;
            }
            let reach = s[0].distance(s[1]) + t[0].distance(t[1]) + near;
            if s[0].distance_squared(t[0]) > reach * reach {
                continue;
            }
            let (p, q) = closest_of_segments(s[0], s[1], t[0], t[1]);
            if p.distance(q) <= near {
                return Some(0.5 * (p + q));
            }
        }
    }
    None
}

/// The closest points of two segments (Ericson, *Real-time collision detection*, 2005, 5.1.9).
fn closest_of_segments(p1: DVec3, q1: DVec3, p2: DVec3, q2: DVec3) -> (DVec3, DVec3) {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f, c, b) = (d1.length_squared(), d2.length_squared(), d2.dot(r), d1.dot(r), d1.dot(d2));
    if a <= 0.0 || e <= 0.0 {
        let t = if e > 0.0 { (f / e).clamp(0.0, 1.0) } else { 0.0 };
        let s = if a > 0.0 { (-c / a).clamp(0.0, 1.0) } else { 0.0 };
        return (p1 + d1 * s, p2 + d2 * t);
    }
    let denominator = a * e - b * b;
    let mut s = if denominator > 1e-14 * a * e { ((b * f - c * e) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = (b * s + f) / e;
    if t < 0.0 {
        t = 0.0;
        s = (-c / a).clamp(0.0, 1.0);
    } else if t > 1.0 {
        t = 1.0;
        s = ((b - c) / a).clamp(0.0, 1.0);
    }
    (p1 + d1 * s, p2 + d2 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Curve;

    fn p(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.0)
    }

    fn side(a: DVec3, b: DVec3) -> SideCurve {
        SideCurve::chain(&[Curve::segment(a, b).unwrap()], 1e-6).unwrap()
    }

    fn square() -> [SideCurve; 4] {
        [(0.0, 0.0, 2.0, 0.0), (2.0, 0.0, 2.0, 1.0), (2.0, 1.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.0)]
            .map(|(a, b, c, d)| side(p(a, b), p(c, d)))
    }

    #[test]
    fn every_order_and_direction_gives_the_same_loop() {
        let given = square();
        for choice in choices() {
            let shuffled = [0, 1, 2, 3].map(|k| {
                let s = &given[choice.order[k]];
                if choice.reversed[k] { s.reversed() } else { s.clone() }
            });
            let closed = close(&shuffled, 1e-3, None).unwrap();
            assert_eq!(closed.gaps, [0.0; 4]);
            assert_eq!(closed.corners, [p(0.0, 0.0), p(2.0, 0.0), p(2.0, 1.0), p(0.0, 1.0)]);
            for k in 0..4 {
                assert_eq!(closed.sides[k].ends(), [closed.corners[k], closed.corners[(k + 1) % 4]]);
            }
        }
    }

    #[test]
    fn gaps_are_closed_within_the_tolerance_and_named_beyond() {
        let mut sides = square();
        sides[2] = side(p(2.0, 1.1), p(0.0, 1.0));
        let closed = close(&sides, 0.2, None).unwrap();
        assert!((closed.gaps[2] - 0.1).abs() < 1e-15);
        assert_eq!(closed.corners[2], p(2.0, 1.05));
        assert_eq!(closed.sides[1].point(1.0), closed.sides[2].point(0.0));
        match close(&sides, 0.05, None) {
            Err(LoopError::CornerGap { sides: [2, 3], gap, more: 0, .. }) => assert!((gap - 0.1).abs() < 1e-15),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn sides_that_coincide_cross_close_or_vanish_are_named() {
        let mut sides = square();
        sides[3] = sides[1].reversed();
        assert!(matches!(close(&sides, 1e-3, None), Err(LoopError::Coincide { sides: [2, 4], .. })));
        let bow = [
            side(p(0.0, 0.0), p(2.0, 1.0)),
            side(p(2.0, 1.0), p(2.0, 0.0)),
            side(p(2.0, 0.0), p(0.0, 1.0)),
            side(p(0.0, 1.0), p(0.0, 0.0)),
        ];
        match close(&bow, 1e-3, None) {
            Err(LoopError::Cross { sides: [1, 3], at }) => assert!(at.distance(p(1.0, 0.5)) < 1e-3),
            other => panic!("{other:?}"),
        }
        let mut sides = square();
        sides[1] = side(p(2.0, 0.0), p(2.0, 1e-5));
        assert!(matches!(close(&sides, 1e-3, None), Err(LoopError::ZeroLength { side: 2, .. })));
        let ring = Curve::polyline(&[p(0.0, 0.0), p(1.0, 1.0), p(0.0, 1.0), p(0.0, 0.0)]).unwrap();
        sides[1] = SideCurve::chain(&[ring], 1e-3).unwrap();
        assert!(matches!(close(&sides, 1e-3, None), Err(LoopError::Closed { side: 2, .. })));
    }

    #[test]
    fn two_equally_good_loops_are_reported() {
        // Sides 2 and 4 end in the middle between both ends of their neighbours: either direction is as good.
        let sides = [
            side(p(0.0, 0.0), p(2.0, 0.0)),
            side(p(2.2, 0.0), p(2.2, 1.0)),
            side(p(2.0, 1.0), p(0.0, 1.0)),
            side(p(-0.5, 0.5), p(0.5, 0.5)),
        ];
        let closed = close(&sides, 0.9, None).unwrap();
        let other = closed.alternative.expect("ambiguous");
        assert_eq!(other.order, closed.choice.order);
        assert_ne!(other.reversed, closed.choice.reversed);
        assert!(close(&square(), 1e-3, None).unwrap().alternative.is_none());
        let forced = close(&sides, 0.9, Some(other)).unwrap();
        assert_eq!((forced.choice, forced.alternative), (other, None));
        let twice = LoopChoice { order: [0, 1, 1, 3], reversed: [false; 4] };
        assert!(matches!(close(&sides, 0.9, Some(twice)), Err(LoopError::Order { .. })));
    }
}
