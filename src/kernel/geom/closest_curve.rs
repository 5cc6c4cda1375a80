//! The point of a curve nearest to a given one: for certain, and locally from a start.
//!
//! The Bezier pieces are halved, the nearest first. A piece is no nearer than its chord less what its control points
//! are off the chord, which falls with the square of its length; a rational piece lies in the hull of the same
//! points, its weights being positive. What cannot beat the best foot is dropped. Newton on half the squared
//! distance, kept between bounds, polishes once per piece that is about as flat as it is far.
//!
//! Cost: about 40 halvings and three Newton searches a point. It cannot fail: where more than [`MAX_PIECES`] pieces
//! are equally near (the centre of a circle), the search stops and `lower` says what is certain.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec3, DVec4};

use super::blossom;
use super::{Curve, Knots};

/// The foot of a point on a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFoot {
    /// Its parameter.
    pub t: f64,
    /// The point.
    pub point: DVec3,
    /// How far it is from the given point.
    pub distance: f64,
    /// No point of the curve is nearer than this; the distance itself, to rounding, unless the search was cut short.
    pub lower: f64,
}

/// The most pieces that one search looks at.
pub const MAX_PIECES: usize = 4096;
/// The most Newton steps of one polish; halving alone then leaves 1e-12 of the bounds.
const MAX_STEPS: usize = 40;
/// What the distance must be known to, relative to it and to the size of the coordinates.
const CERTAIN: f64 = 1e-14;

struct Piece {
    lower: f64,
    from: f64,
    to: f64,
    net: Vec<DVec4>,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    /// The nearest is the greatest; of equals, the first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.lower.total_cmp(&self.lower).then(other.from.total_cmp(&self.from))
    }
}

impl Piece {
    fn new(p: DVec3, from: f64, to: f64, net: Vec<DVec4>) -> (Self, f64) {
        let point = |h: &DVec4| h.truncate() / h.w;
        let (a, b) = (point(&net[0]), point(&net[net.len() - 1]));
        let off = net.iter().map(|h| to_segment(point(h), a, b)).fold(0.0, f64::max);
        (Self { lower: (to_segment(p, a, b) - off).max(0.0), from, to, net }, off)
    }

    fn halves(&self, p: DVec3) -> [(Self, f64); 2] {
        let (mut low, mut high) = (self.net.clone(), self.net.clone());
        for level in 1..high.len() {
            for i in 0..high.len() - level {
                high[i] = (high[i] + high[i + 1]) * 0.5;
            }
            low[level] = high[0];
        }
        let middle = 0.5 * (self.from + self.to);
        [Self::new(p, self.from, middle, low), Self::new(p, middle, self.to, high)]
    }
}

fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    let length = d.length_squared();
    let s = if length > 0.0 { ((p - a).dot(d) / length).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + d * s)
}

/// Where the squared length of a vector r is least between two parameters, from a start: Newton, halving where it
/// leaves the bounds. `at` gives r with its first and second derivative; it ends with a step that moves r by less
/// than `close`. The parameter and the length.
pub(crate) fn descend(
    at: impl Fn(f64) -> [DVec3; 3],
    [mut low, mut high]: [f64; 2],
    start: f64,
    close: f64,
) -> (f64, f64) {
    let mut t = start.clamp(low, high);
    let mut best = (t, f64::INFINITY);
    for _ in 0..MAX_STEPS {
        let [r, d, dd] = at(t);
        if r.length() < best.1 {
            best = (t, r.length());
        }
        let slope = r.dot(d);
        if slope > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let bend = d.length_squared() + r.dot(dd);
        let next = if bend > 0.0 { t - slope / bend } else { f64::NAN };
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - t).abs() * d.length() <= close || next == t {
            break;
        }
        t = next;
    }
    best
}

/// The locally closest point to `p` between two parameters, from a start.
pub fn closest_between(curve: &Curve, p: DVec3, bounds: [f64; 2], start: f64) -> CurveFoot {
    let at = |t: f64| {
        let [c, d, dd, _] = curve.derivatives(t, 2);
        [c - p, d, dd]
    };
    let (t, distance) = descend(at, bounds, start, rounding(curve, p));
    CurveFoot { t, point: curve.eval(t), distance, lower: 0.0 }
}

/// What an evaluation of the curve, less `p`, can be off by.
fn rounding(curve: &Curve, p: DVec3) -> f64 {
    4.0 * f64::EPSILON * (curve.bounds().max_abs() + p.abs().max_element())
}

/// The closest point of a whole curve to `p`.
pub fn closest_on_curve(curve: &Curve, p: DVec3) -> CurveFoot {
    let breaks = curve.knots().breaks();
    let degree = curve.knots().degree();
    let mut best = curve.ends().into_iter().zip(curve.domain()).fold(
        CurveFoot { t: 0.0, point: DVec3::ZERO, distance: f64::INFINITY, lower: 0.0 },
        |best, (point, t)| {
            let distance = point.distance(p);
            if distance < best.distance { CurveFoot { t, point, distance, lower: 0.0 } } else { best }
        },
    );
    let Ok(full) = Knots::clamped(degree, &breaks, degree) else { return best }; // breaks of valid knots are valid
    let net = blossom::refine(curve.knots(), &curve.homogeneous(), &full);
    let rounding = CERTAIN * (curve.bounds().max_abs() + p.abs().max_element());
    let mut heap = BinaryHeap::new();
    for (k, pair) in breaks.windows(2).enumerate() {
        heap.push(Piece::new(p, pair[0], pair[1], net[k * degree..=(k + 1) * degree].to_vec()).0);
    }
    let mut looked = 0;
    let enough = |best: &CurveFoot| best.distance * (1.0 - CERTAIN) - rounding;
    while let Some(piece) = heap.pop() {
        if piece.lower >= enough(&best) {
            break;
        }
        if looked >= MAX_PIECES {
            best.lower = piece.lower;
            return best;
        }
        looked += 1;
        for (half, off) in piece.halves(p) {
            let inside = (half.from..=half.to).contains(&best.t);
            if !inside && off <= half.lower + 0.25 * off {
                // Flat as seen from p: one valley, which Newton finds.
                let foot = closest_between(curve, p, [half.from, half.to], 0.5 * (half.from + half.to));
                if foot.distance < best.distance {
                    best = foot;
                }
            }
            if half.lower < enough(&best) && half.from < half.to {
                heap.push(half);
            }
        }
    }
    best.lower = best.distance.min(enough(&best).max(0.0));
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wild(degree: usize, rational: bool, seed: u64) -> Curve {
        let mut seed = seed;
        let mut next = move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
        };
        // Not clamped, one double knot.
        let mut values: Vec<f64> = (0..2 * degree + 7).map(|k| k as f64 * 0.7).collect();
        if degree > 1 {
            values[degree + 2] = values[degree + 1];
        }
        let knots = Knots::new(degree, values).unwrap();
        let points: Vec<DVec3> = (0..knots.control_count()).map(|_| DVec3::new(next(), next(), next())).collect();
        let weights = rational.then(|| points.iter().map(|_| 10.0_f64.powf(next())).collect());
        Curve::new(knots, points, weights).unwrap()
    }

    #[test]
    fn the_foot_is_the_nearest_of_a_dense_search_and_the_bound_meets_it() {
        for degree in 1..=7 {
            for rational in [false, true] {
                let curve = wild(degree, rational, 31 * degree as u64 + u64::from(rational));
                let [a, b] = curve.domain();
                for k in 0..12 {
                    let p = DVec3::new((k as f64).sin(), (2.3 * k as f64).cos(), 0.1 * k as f64 - 0.6);
                    let foot = closest_on_curve(&curve, p);
                    assert!(foot.point.distance(curve.eval(foot.t)) == 0.0 && foot.distance == foot.point.distance(p));
                    assert!(foot.lower <= foot.distance && foot.lower > foot.distance - 1e-12, "{foot:?}");
                    let dense = (0..=4000).map(|i| curve.eval(a + (b - a) * f64::from(i) / 4000.0).distance(p));
                    let dense = dense.fold(f64::INFINITY, f64::min);
                    assert!(foot.distance <= dense + 1e-14 && foot.distance > dense - 0.01, "{degree} {k}");
                }
            }
        }
    }

    #[test]
    fn a_point_of_the_curve_is_its_own_foot() {
        let curve = wild(3, true, 5);
        let [a, b] = curve.domain();
        for k in 0..=20 {
            let p = curve.eval(a + (b - a) * f64::from(k) / 20.0);
            assert!(closest_on_curve(&curve, p).distance < 1e-14);
        }
    }

    #[test]
    fn the_centre_of_a_circle_is_equally_far_from_all_of_it_and_the_search_ends() {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        let points = vec![DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let curve = Curve::new(Knots::bezier(2, 0.0, 1.0).unwrap(), points, Some(vec![1.0, w, 1.0])).unwrap();
        let foot = closest_on_curve(&curve, DVec3::ZERO);
        assert!((foot.distance - 1.0).abs() < 1e-14);
        // Cut short: still a bound, and a good one.
        assert!(foot.lower <= 1.0 && foot.lower > 1.0 - 1e-6, "{}", foot.lower);
    }
}
