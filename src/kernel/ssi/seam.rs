//! Seams: borders of the two sides that run along each other, as those of neighbours in a model do.
//!
//! Neighbours with one tangent plane along a common edge have no crossing there, but no box, no normal and no gap
//! function tells so: pairs of nodes along the edge stay undecided however small they are. This module proves for
//! such a pair that it meets within the joining tolerance of the edge only.
//!
//! Let v and t be the parameters that lead inwards from the edges, in nodes a and b that lie at them. A(x, v) = B(y, t)
//! says, by the mean value theorem along the edges (which are one curve within delta) and inwards,
//!
//! ```text
//! v Av - t Bt + s (p Ta + q Tb) + e = 0,   p, q >= 0, s = 1 or -1, |e| <= delta,
//! ```
//!
//! with Av, Bt, Ta, Tb in the hulls of the derivatives over the nodes. A covector w with w.Av >= alpha > 0, -w.Bt >=
//! beta > 0 and |w.T| small, and the direction tau of the edge, along which both T advance, bound v and t by a small
//! multiple of delta. It holds for neighbours that go on (and at a crease), not where one folds back on the other.
//!
//! That the edges are one curve within the joining tolerance is checked at [`SAMPLES`] places; edges are polynomials,
//! whose difference cannot be large between so many places at which it is small.

use glam::{DVec2, DVec3};

use super::piece::Piece;
use super::side::{BorderEdge, Side};
use super::tree::{Node, reach};

/// At how many places two edges are compared.
const SAMPLES: usize = 48;

/// A stretch of a border of a piece of A that runs along one of a piece of B.
#[derive(Clone, Copy, Debug)]
pub struct Seam {
    /// Which borders: the parameter that is fixed (0: u, 1: v), and its value.
    borders: [(usize, f64); 2],
    /// From where to where on each, ascending.
    range: [[f64; 2]; 2],
    /// Whether the edges run against each other.
    reversed: bool,
}

fn on_edge(fixed: usize, value: f64, t: f64) -> DVec2 {
    let mut uv = DVec2::splat(value);
    uv[1 - fixed] = t;
    uv
}

/// All seams between a piece of A and a piece of B.
pub fn seams(sides: [&Side; 2], pa: usize, pb: usize, joining: f64) -> Vec<Seam> {
    let mut out = Vec::new();
    for x in sides[0].borders_of(pa) {
        for y in sides[1].borders_of(pb) {
            if x.bounds.grown(joining).overlaps(&y.bounds) {
                out.extend(seam(sides, x, y, joining));
            }
        }
    }
    out
}

fn seam(sides: [&Side; 2], x: &BorderEdge, y: &BorderEdge, joining: f64) -> Option<Seam> {
    if [x, y].iter().any(|e| e.bounds.diagonal() <= 4.0 * joining) {
        return None; // a pole has no direction
    }
    let (a, b) = (&sides[0].pieces[x.piece], &sides[1].pieces[y.piece]);
    // The ends of the common stretch are ends of one of the two edges.
    let onto = |side: usize, edge: &BorderEdge, p: DVec3| {
        let (uv, distance) = sides[side].onto_edge(edge, p)?;
        (distance <= joining).then_some(uv[1 - edge.fixed])
    };
    let mut ends: Vec<[f64; 2]> = Vec::new();
    for t in [0.0, 1.0] {
        ends.extend(onto(1, y, a.point(on_edge(x.fixed, x.value, t))).map(|s| [t, s]));
        ends.extend(onto(0, x, b.point(on_edge(y.fixed, y.value, t))).map(|s| [s, t]));
    }
    let first = ends.iter().copied().min_by(|p, q| p[0].total_cmp(&q[0]))?;
    let last = ends.iter().copied().max_by(|p, q| p[0].total_cmp(&q[0]))?;
    let point = |t: f64| a.point(on_edge(x.fixed, x.value, t));
    if point(first[0]).distance(point(last[0])) <= 4.0 * joining || first[1] == last[1] {
        return None;
    }
    let along = (1..SAMPLES).all(|k| {
        let f = k as f64 / SAMPLES as f64;
        onto(1, y, point(first[0] + (last[0] - first[0]) * f)).is_some()
    });
    along.then(|| Seam {
        borders: [(x.fixed, x.value), (y.fixed, y.value)],
        range: [[first[0], last[0]], [first[1].min(last[1]), first[1].max(last[1])]],
        reversed: last[1] < first[1],
    })
}

/// A node at a seam: its derivatives inwards and along the edge in the sense of the edge of A.
struct Edged<'a> {
    node: &'a Node,
    inward: (DVec3, [f64; 3]),
    along: (DVec3, [f64; 3]),
}

impl<'a> Edged<'a> {
    fn of(node: &'a Node, (fixed, value): (usize, f64), reversed: bool) -> Option<Self> {
        let touches = if value > 0.5 { node.high[fixed] >= 1.0 } else { node.low[fixed] <= 0.0 };
        if !touches || node.n == DVec3::ZERO {
            return None;
        }
        let both = [(node.au, node.dx), (node.av, node.dy)];
        let (inward, along) = (both[fixed], both[1 - fixed]);
        let sign = if value > 0.5 { -1.0 } else { 1.0 };
        let turn = if reversed { -1.0 } else { 1.0 };
        Some(Self { node, inward: (inward.0 * sign, inward.1), along: (along.0 * turn, along.1) })
    }

    /// The range of a covector over a hull of derivatives.
    fn range(&self, k: DVec3, hull: &(DVec3, [f64; 3])) -> [f64; 2] {
        let spread = reach(self.node.split(k), hull.1);
        [k.dot(hull.0) - spread, k.dot(hull.0) + spread]
    }

    fn most(&self, k: DVec3, hull: &(DVec3, [f64; 3])) -> f64 {
        let [low, high] = self.range(k, hull);
        high.max(-low)
    }
}

impl Seam {
    /// Whether two nodes of the pieces meet within a small multiple of the joining tolerance of this seam only.
    pub fn is_all(&self, pieces: [&Piece; 2], a: &Node, b: &Node, joining: f64) -> bool {
        let (Some(x), Some(y)) = (Edged::of(a, self.borders[0], false), Edged::of(b, self.borders[1], self.reversed))
        else {
            return false;
        };
        let tau = (x.along.0.normalize_or_zero() + y.along.0.normalize_or_zero()).normalize_or_zero();
        let across = |v: DVec3| (v - tau * v.dot(tau)).normalize_or_zero();
        let w = across(x.inward.0) - across(y.inward.0);
        if tau == DVec3::ZERO || w.length() < 0.1 {
            return false;
        }
        let w = w.normalize();
        let advance = [x.range(tau, &x.along)[0], y.range(tau, &y.along)[0]];
        if !(advance[0] > 0.0 && advance[1] > 0.0) {
            return false;
        }
        let slip = (x.most(w, &x.along) / advance[0]).max(y.most(w, &y.along) / advance[1]);
        let inwards = [
            x.range(w, &x.inward)[0] - slip * x.most(tau, &x.inward),
            y.range(-w, &y.inward)[0] - slip * y.most(tau, &y.inward),
        ];
        let near = |k: usize, v: DVec3| inwards[k] > 0.0 && (1.0 + slip) * v.length() <= 16.0 * inwards[k];
        near(0, x.inward.0) && near(1, y.inward.0) && self.together(pieces, a, b, joining)
    }

    /// Whether both nodes lie along the seam and share a stretch, or at least a point, of it.
    fn together(&self, pieces: [&Piece; 2], a: &Node, b: &Node, joining: f64) -> bool {
        let stretch = |k: usize, node: &Node| {
            let free = 1 - self.borders[k].0;
            [node.low[free], node.high[free]]
        };
        let own = [stretch(0, a), stretch(1, b)];
        let within = |k: usize| own[k][0] >= self.range[k][0] - 1e-9 && own[k][1] <= self.range[k][1] + 1e-9;
        if !within(0) || !within(1) {
            return false;
        }
        let place = |k: usize, t: f64| pieces[k].point(on_edge(self.borders[k].0, self.borders[k].1, t));
        // An end of one of the stretches lies on the other one.
        let (from, to) = (place(0, own[0][0]), place(0, own[0][1]));
        let inside = |p: DVec3, from: DVec3, to: DVec3| {
            let chord = to - from;
            let f = (p - from).dot(chord) / chord.length_squared();
            p.distance(from) <= 4.0 * joining || p.distance(to) <= 4.0 * joining || (f > 0.0 && f < 1.0)
        };
        let ends = own[1].map(|t| place(1, t));
        ends.iter().any(|&p| inside(p, from, to)) || [from, to].iter().any(|&p| inside(p, ends[0], ends[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::side::Frame;
    use super::super::tree::Tree;
    use super::*;
    use crate::kernel::geom::{Direction, Surface};

    /// Whether the roots of two single patches meet along a seam only.
    fn proved(a: &Surface, b: &Surface) -> bool {
        let frame = Frame::of(&a.bounds().union(&b.bounds()));
        let sides = [Side::new(&[(0, a)], &frame), Side::new(&[(1, b)], &frame)];
        let trees = [Tree::new(&sides[0]), Tree::new(&sides[1])];
        let pieces = [&sides[0].pieces[0], &sides[1].pieces[0]];
        let found = seams([&sides[0], &sides[1]], 0, 0, 1e-6);
        found.iter().any(|s| s.is_all(pieces, &trees[0].nodes[0], &trees[1].nodes[0], 1e-6))
    }

    fn strip(y: [f64; 2], z: [f64; 2]) -> Surface {
        let p = DVec3::new;
        Surface::bilinear([p(0.0, y[0], z[0]), p(1.0, y[0], z[0]), p(0.0, y[1], z[1]), p(1.0, y[1], z[1])]).unwrap()
    }

    #[test]
    fn neighbours_meet_in_their_edge_only_and_folded_sheets_may_not() {
        let a = strip([0.0, 1.0], [0.0, 0.0]);
        assert!(proved(&a, &strip([0.0, -1.0], [0.0, 0.0])));
        assert!(proved(&a, &strip([-1.0, 0.0], [0.0, 0.0]).reversed(Direction::U)));
        assert!(proved(&a, &strip([-1.0, 1e-7], [0.0, 0.0])), "a gap within the joining tolerance");
        assert!(proved(&a, &strip([0.0, -1.0], [0.0, 0.4])));
        assert!(!proved(&a, &strip([0.0, 1.0], [0.0, 0.0])), "the same sheet");
        assert!(!proved(&a, &strip([0.1, -1.0], [0.0, 0.0])), "they overlap");
        // A short neighbour of a long one.
        let short = strip([0.0, -1.0], [0.0, 0.0]).restricted([0.25, 0.5], [0.0, 1.0]).unwrap();
        let part = a.restricted([0.25, 0.5], [0.0, 1.0]).unwrap();
        assert!(!proved(&a, &short) && proved(&part, &short));
    }
}
