//! An intersection curve as strands: runs of points on one Bezier piece of each surface, with tangents and rates.
//!
//! What fits curves through the points ([`super::spline_fit`], [`super::biarc`]) needs the same three things: where a
//! piece ends (derivatives may jump there), the direction of the curve in space and in both domains at every point,
//! and a further exact point where two neighbours are too far apart. Directions are those of N_A x N_B where the
//! surfaces cross by more than [`LEAST_SINE`], else those of the parabola through three neighbours.
//!
//! Everything is in the unit frame in space and in the surfaces' own parameters in the domains.

use glam::{DVec2, DVec3};

use super::binormal::polish;
use super::correct::{Condition, PointPair, correct};
use super::derivative_bounds::DerivativeBounds;
use super::node::rates;
use super::piece::{Jet1, Patch, Piece};
use super::result::{CurvePoint, IntersectionCurve};
use super::side::{Frame, Side};
use crate::kernel::geom::{Aabb, Surface};

/// The sine of the angle between the surfaces from which on their normals give the direction of the curve.
const LEAST_SINE: f64 = 1e-6;
/// Where the direction comes from the neighbours, a larger turn (radians) between two chords is a corner.
const CORNER: f64 = 0.35;

/// The surface under the middle of a step is no farther off its chord than this many chords, unless the step crosses a
/// seam.
const JUMP: f64 = 4.0;

/// Points closer than this are one.
const SAME: f64 = 1e-9;

/// A point of a strand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    /// The arc length up to here, by chords.
    pub t: f64,
    /// The point.
    pub p: DVec3,
    /// The parameters on both surfaces.
    pub at: [DVec2; 2],
    /// The unit tangent.
    pub tangent: DVec3,
    /// How fast the parameters change with arc length.
    pub rates: [DVec2; 2],
    /// Whether the direction is that of the normals.
    pub crossing: bool,
}

/// Points on one piece of each surface.
#[derive(Clone, Debug)]
pub(super) struct Strand {
    /// The numbers of the surfaces.
    pub surfaces: [usize; 2],
    /// The pieces, as places in the lists of the sides.
    pub pieces: [usize; 2],
    /// At least two points.
    pub knots: Vec<Knot>,
    /// Whether it continues the one before: the same surfaces, and parameters that do not jump.
    pub continues: bool,
}

/// The pieces of the surfaces that a curve runs on, with bounds of their derivatives by the surfaces' parameters.
pub(super) struct Ground {
    pub frame: Frame,
    side: Side,
    bounds: Vec<DerivativeBounds>,
}

impl Ground {
    pub fn new(surfaces: &[(usize, &Surface)]) -> Self {
        let bounds = surfaces.iter().fold(Aabb::EMPTY, |all, (_, s)| all.union(&s.bounds()));
        let frame = Frame::of(&bounds);
        let side = Side::new(surfaces, &frame);
        let bounds = side.pieces.iter().map(|p| DerivativeBounds::of(p).over(p.high - p.low)).collect();
        Self { frame, side, bounds }
    }

    pub fn bounds(&self, piece: usize) -> &DerivativeBounds {
        &self.bounds[piece]
    }

    fn piece(&self, piece: usize) -> &Piece {
        &self.side.pieces[piece]
    }

    /// The point of a piece at parameters of its surface.
    pub fn point(&self, piece: usize, at: DVec2) -> DVec3 {
        self.piece(piece).point(local(self.piece(piece), at))
    }

    /// The same with first derivatives by the parameters of its surface.
    fn jet(&self, piece: usize, at: DVec2) -> Jet1 {
        let piece = self.piece(piece);
        let jet = piece.jet1(local(piece, at));
        let size = piece.high - piece.low;
        Jet1 { p: jet.p, u: jet.u / size.x, v: jet.v / size.y }
    }

    /// The piece of a surface under the middle of two parameter points.
    fn piece_under(&self, surface: usize, x: DVec2, y: DVec2) -> Option<usize> {
        let middle = 0.5 * (x + y);
        let away = |p: &Piece| (p.low - middle).max(middle - p.high).max_element();
        let own = self.side.pieces.iter().enumerate().filter(|(_, p)| p.surface == surface);
        own.min_by(|(_, x), (_, y)| away(x).total_cmp(&away(y))).map(|(k, _)| k)
    }

    /// The strands of a curve. `None` when a surface that it names is missing.
    pub fn strands(&self, curve: &IntersectionCurve) -> Option<Vec<Strand>> {
        let mut strands: Vec<Strand> = Vec::new();
        let mut t = 0.0;
        let local_point = |p: &CurvePoint| (p.xyz - self.frame.origin) * self.frame.scale;
        for w in curve.points.windows(2) {
            let (x, y) = (&w[0], &w[1]);
            let (p, q) = (local_point(x), local_point(y));
            let same = x.a == y.a && x.b == y.b;
            if !same || p.distance(q) < 1e-13 {
                // A change of patch or a seam: the same point seen elsewhere.
                t += p.distance(q);
                continue;
            }
            let pieces = [self.piece_under(x.a, x.uv, y.uv)?, self.piece_under(x.b, x.st, y.st)?];
            // Across a seam that is open by a little the points differ, and the parameters jump: between them the
            // surface is elsewhere.
            let middles = [0.5 * (x.uv + y.uv), 0.5 * (x.st + y.st)];
            let away = |side: usize| self.point(pieces[side], middles[side]).distance(0.5 * (p + q));
            if away(0).max(away(1)) > JUMP * p.distance(q) {
                t += p.distance(q);
                continue;
            }
            let knot = |t: f64, p: DVec3, c: &CurvePoint| Knot {
                t,
                p,
                at: [c.uv, c.st],
                tangent: DVec3::ZERO,
                rates: [DVec2::ZERO; 2],
                crossing: false,
            };
            let joins = strands.last().is_some_and(|s| {
                let last = &s.knots[s.knots.len() - 1];
                s.surfaces == [x.a, x.b] && last.at == [x.uv, x.st]
            });
            let next_t = t + p.distance(q);
            match strands.last_mut().filter(|s| joins && s.pieces == pieces) {
                Some(strand) => strand.knots.push(knot(next_t, q, y)),
                None => strands.push(Strand {
                    surfaces: [x.a, x.b],
                    pieces,
                    knots: vec![knot(t, p, x), knot(next_t, q, y)],
                    continues: joins,
                }),
            }
            t = next_t;
        }
        self.give_directions(&mut strands, curve.closed);
        let cut = strands.into_iter().flat_map(at_corners).collect();
        Some(cut)
    }

    /// Tangents and rates of all points.
    fn give_directions(&self, strands: &mut [Strand], closed: bool) {
        // The points of the whole curve, for parabolas across the borders of pieces.
        let mut line: Vec<(f64, DVec3)> = Vec::new();
        for knot in strands.iter().flat_map(|s| &s.knots) {
            // The same point seen on two pieces counts once.
            if line.last().is_none_or(|(t, _)| knot.t > *t + SAME) {
                line.push((knot.t, knot.p));
            }
        }
        for strand in strands {
            for k in 0..strand.knots.len() {
                let knot = strand.knots[k];
                let chord = parabola(&line, knot.t, closed);
                // Where a strand ends in a corner the parabola leans to the shorter of the two chords there.
                let last = strand.knots.len() - 1;
                let own = strand.knots[(k + 1).min(last)].p - strand.knots[if k == last { k - 1 } else { k }].p;
                let own = if k == 0 || k == last { own.normalize_or_zero() } else { chord };
                let crossed = self.cross(strand.pieces, &knot);
                let along = |n: DVec3| [chord, own].into_iter().map(|d| n.dot(d)).find(|d| d.abs() > 0.3);
                let (tangent, crossing) = match crossed.and_then(|n| Some((n, along(n)?))) {
                    Some((n, sign)) => (n * sign.signum(), true),
                    None => (chord, false),
                };
                let knot = self.directed(strand.pieces, knot, tangent, crossing);
                strand.knots[k] = knot;
            }
            // Where a surface is degenerate the rates are those of the neighbours.
            for k in 0..strand.knots.len() {
                if strand.knots[k].rates.iter().all(|r| r.is_finite()) {
                    continue;
                }
                let (i, j) = (k.saturating_sub(1), (k + 1).min(strand.knots.len() - 1));
                let (x, y) = (strand.knots[i], strand.knots[j]);
                strand.knots[k].rates = [0, 1].map(|side| (y.at[side] - x.at[side]) / (y.t - x.t));
            }
        }
    }

    fn cross(&self, pieces: [usize; 2], knot: &Knot) -> Option<DVec3> {
        let normals = [0, 1].map(|side| self.jet(pieces[side], knot.at[side]).cross().normalize_or_zero());
        let cross = normals[0].cross(normals[1]);
        (cross.length() > LEAST_SINE).then(|| cross.normalize())
    }

    fn directed(&self, pieces: [usize; 2], knot: Knot, tangent: DVec3, crossing: bool) -> Knot {
        let jets = [0, 1].map(|side| self.jet(pieces[side], knot.at[side]));
        let rates = match rates(&jets[0], &jets[1], tangent) {
            Some([u, v, s, t]) => [DVec2::new(u, v), DVec2::new(s, t)],
            None => [DVec2::NAN; 2],
        };
        Knot { tangent, rates, crossing, ..knot }
    }

    /// A further point of the curve midway between two neighbours of a strand; an interpolated one where it cannot be
    /// corrected.
    pub fn between(&self, strand: &Strand, x: &Knot, y: &Knot) -> Knot {
        let h = y.t - x.t;
        let middle = |side: usize| 0.5 * (x.at[side] + y.at[side]) + (x.rates[side] - y.rates[side]) * (0.125 * h);
        let chord = y.p - x.p;
        let mut knot = Knot {
            t: 0.5 * (x.t + y.t),
            p: 0.5 * (x.p + y.p) + (x.tangent - y.tangent) * (0.125 * h),
            at: [middle(0), middle(1)],
            ..*x
        };
        let [a, b] = strand.pieces.map(|p| self.piece(p));
        let start = PointPair { uv: local(a, knot.at[0]), st: local(b, knot.at[1]) };
        let inside = |v: DVec2| v.min_element() > -1e-9 && v.max_element() < 1.0 + 1e-9;
        // Where the surfaces touch only the floor of the gap tells where the curve is.
        let found = if x.crossing && y.crossing {
            let plane = Condition::Plane { point: knot.p, direction: chord.normalize_or_zero() };
            correct(a, b, start, plane, 1e-15).filter(|h| h.residual < 1e-10).map(|h| (h.at, h.point()))
        } else {
            polish(a, b, start, 0.05, true).filter(|f| f.gap.abs() < 1e-10).map(|f| (f.at, f.p))
        };
        if let Some((at, p)) = found
            && p.distance(knot.p) < 0.2 * chord.length()
            && inside(at.uv)
            && inside(at.st)
        {
            knot.p = p;
            knot.at = [a.to_surface(at.uv), b.to_surface(at.st)];
        }
        let average = (x.tangent + y.tangent).normalize_or_zero();
        match self.cross(strand.pieces, &knot) {
            Some(n) if n.dot(average).abs() > 0.3 => {
                self.directed(strand.pieces, knot, n * n.dot(average).signum(), true)
            }
            _ => self.directed(strand.pieces, knot, average, false),
        }
    }
}

/// The parameters in [0, 1]^2 of a piece.
fn local(piece: &Piece, at: DVec2) -> DVec2 {
    (at - piece.low) / (piece.high - piece.low)
}

/// The unit tangent at `t` of the parabola through the point there and its neighbours.
fn parabola(line: &[(f64, DVec3)], t: f64, closed: bool) -> DVec3 {
    let n = line.len();
    let k = line.partition_point(|(s, _)| *s < t - SAME).min(n - 1);
    if n < 3 {
        return (line[n - 1].1 - line[0].1).normalize_or_zero();
    }
    let length = line[n - 1].0 - line[0].0;
    let at = |i: usize| line[i];
    let [x, y, z] = if k == 0 {
        if closed { [(at(n - 2).0 - length, at(n - 2).1), at(0), at(1)] } else { [at(0), at(1), at(2)] }
    } else if k == n - 1 {
        if closed { [at(n - 2), at(n - 1), (at(1).0 + length, at(1).1)] } else { [at(n - 3), at(n - 2), at(n - 1)] }
    } else {
        [at(k - 1), at(k), at(k + 1)]
    };
    let (first, second) = ((y.1 - x.1) / (y.0 - x.0), (z.1 - y.1) / (z.0 - y.0));
    let bend = (second - first) / (z.0 - x.0);
    let t = line[k].0;
    (first + bend * (2.0 * t - x.0 - y.0)).normalize_or_zero()
}

/// Cuts a strand where it turns sharply and nothing else gives its direction.
fn at_corners(strand: Strand) -> Vec<Strand> {
    let k = &strand.knots;
    let chord = |i: usize| (k[i + 1].p - k[i].p).normalize_or_zero();
    let corner = |i: &usize| !k[*i].crossing && chord(i - 1).dot(chord(*i)) < CORNER.cos();
    let corners: Vec<usize> = (1..k.len() - 1).filter(corner).collect();
    if corners.is_empty() {
        return vec![strand];
    }
    let mut out = Vec::new();
    let mut start = 0;
    for end in corners.into_iter().chain([strand.knots.len() - 1]) {
        let mut part = Strand { knots: strand.knots[start..=end].to_vec(), ..strand.clone() };
        part.continues = strand.continues || start > 0;
        let last = part.knots.len() - 1;
        // One-sided directions at the corner.
        for (at, from, to) in [(0, 0, 1), (last, last - 1, last)] {
            let (x, y) = (part.knots[from], part.knots[to]);
            if (at == 0 && start > 0) || (at == last && end + 1 < strand.knots.len()) {
                part.knots[at].tangent = (y.p - x.p).normalize_or_zero();
                part.knots[at].rates = [0, 1].map(|side| (y.at[side] - x.at[side]) / (y.t - x.t));
            }
        }
        out.push(part);
        start = end;
    }
    out
}
