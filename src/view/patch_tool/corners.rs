//! The corner card: where the sides meet, how far they miss each other, and what can be done about it.

use glam::DVec3;

use super::arrange::{Order, SideLine};
use super::piece::{Picked, PieceError};
use crate::view::scene::Scene;

/// What is done about an open corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerFix {
    /// Both ends go to their middle.
    Average,
    /// The end of this side goes onto the other one.
    MoveSide(usize),
    /// A straight piece is put between the ends; it belongs to the first of the two sides.
    Bridge,
    /// Both sides end where they cross.
    Trim,
}

impl CornerFix {
    /// The words on its button.
    pub fn label(self) -> String {
        match self {
            Self::Average => "Average".to_owned(),
            Self::MoveSide(side) => format!("Move side {}", side + 1),
            Self::Bridge => "Insert bridge".to_owned(),
            Self::Trim => "Trim at crossing".to_owned(),
        }
    }
}

/// How a corner stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerState {
    /// The gap is within the joining tolerance: green tick.
    Closed,
    /// The gap is larger, but somebody said what to do about it.
    ClosedBy(CornerFix),
    /// The gap is larger: amber.
    Open,
}

/// One of the four corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Corner {
    /// The side that ends there and the one that starts there, from 0.
    pub sides: [usize; 2],
    /// Their ends.
    pub ends: [DVec3; 2],
    /// How far these are apart.
    pub gap: f64,
    /// How it stands.
    pub state: CornerState,
    /// Where the two sides cross, when they do away from these ends.
    pub crossing: Option<DVec3>,
}

impl Corner {
    /// Where the corner will be.
    pub fn point(&self) -> DVec3 {
        match self.state {
            CornerState::ClosedBy(CornerFix::MoveSide(side)) => self.ends[usize::from(side == self.sides[0])],
            _ => 0.5 * (self.ends[0] + self.ends[1]),
        }
    }

    /// Whether nothing has to be done about it.
    pub fn is_settled(&self) -> bool {
        self.state != CornerState::Open
    }

    /// What can be done about it, the most natural first.
    pub fn fixes(&self) -> Vec<CornerFix> {
        let [a, b] = self.sides;
        let mut out = vec![CornerFix::Average, CornerFix::MoveSide(a), CornerFix::MoveSide(b), CornerFix::Bridge];
        if self.crossing.is_some() {
            out.insert(0, CornerFix::Trim);
        }
        out
    }
}

/// A fix that was chosen, for the corner between two sides.
pub type Chosen = ([usize; 2], CornerFix);

/// The four corners of a loop.
pub fn corners(order: &Order, lines: &[Option<SideLine>; 4], tol: f64, chosen: &[Chosen]) -> Vec<Corner> {
    let end = |place: usize, end: usize| {
        let line = lines[order.sides[place]].as_ref();
        line.map_or(DVec3::NAN, |l| l.ends()[end ^ usize::from(order.reversed[place])])
    };
    let n = order.sides.len();
    (0..n)
        .map(|k| {
            let before = (k + n - 1) % n;
            let sides = [order.sides[before], order.sides[k]];
            let ends = [end(before, 1), end(k, 0)];
            let gap = ends[0].distance(ends[1]);
            let fix = chosen.iter().find(|(pair, _)| same_pair(*pair, sides)).map(|(_, fix)| *fix);
            let (state, crossing) = match (gap <= tol, fix) {
                (true, _) => (CornerState::Closed, None),
                (false, fix) => {
                    let crossing = match (&lines[sides[0]], &lines[sides[1]]) {
                        (Some(a), Some(b)) => crossing(&a.points, &b.points, tol),
                        _ => None,
                    };
                    (fix.map_or(CornerState::Open, CornerState::ClosedBy), crossing)
                }
            };
            Corner { sides, ends, gap, state, crossing }
        })
        .collect()
}

pub(super) fn same_pair(a: [usize; 2], b: [usize; 2]) -> bool {
    a == b || a == [b[1], b[0]]
}

/// Where two polylines come nearest to each other, when that is within the tolerance.
pub(super) fn crossing(a: &[DVec3], b: &[DVec3], tol: f64) -> Option<DVec3> {
    let mut best = (tol * tol, None);
    for s in a.windows(2) {
        for t in b.windows(2) {
            let reach = s[0].distance(s[1]) + t[0].distance(t[1]) + tol;
            if s[0].distance_squared(t[0]) > reach * reach {
                continue;
            }
            let (p, q) = nearest_of_segments(s, t);
            let d = p.distance_squared(q);
            if d <= best.0 {
                best = (d, Some(0.5 * (p + q)));
            }
        }
    }
    best.1
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

/// A side's pieces cut at a point of it. The piece that is cut keeps the part that was clicked (the longer part of a
/// segment or polyline); pieces beyond the cut go.
pub(super) fn trim_at(scene: &Scene, pieces: &[Picked], line: &SideLine, at: DVec3) -> Result<Vec<Picked>, PieceError> {
    let place = (0..line.chain.len())
        .min_by(|&a, &b| {
            let far = |k: usize| pieces[line.chain[k].0].distance(at);
            far(a).total_cmp(&far(b))
        })
        .unwrap_or(0);
    let (index, backwards) = line.chain[place];
    let piece = &pieces[index];
    // Which end of the piece's own direction goes.
    let end = match piece.source {
        super::piece::Source::Curve { clicked, .. } => {
            let t = piece.nearest_parameter(scene, at).ok_or(PieceError::Gone)?;
            usize::from(t > clicked)
        }
        _ => {
            let [a, b] = piece.split(scene, at)?;
            usize::from(a.length() > b.length())
        }
    };
    let cut = match piece.source {
        super::piece::Source::Curve { .. } => piece.moved(scene, end, at)?,
        _ => {
            let [a, b] = piece.split(scene, at)?;
            if end == 1 { a } else { b }
        }
    };
    // In the direction of the chain, what lies beyond the end that goes.
    let forward_end = if backwards { 1 - end } else { end };
    let keep = if forward_end == 1 { 0..place } else { place + 1..line.chain.len() };
    let mut out: Vec<(usize, Picked)> = keep.map(|k| (line.chain[k].0, pieces[line.chain[k].0].clone())).collect();
    out.push((index, cut));
    out.sort_by_key(|(k, _)| *k);
    Ok(out.into_iter().map(|(_, piece)| piece).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossings_are_where_lines_cross() {
        let a = [DVec3::ZERO, DVec3::X * 2.0];
        let b = [DVec3::new(0.5, -1.0, 1e-4), DVec3::new(0.5, 1.0, 1e-4)];
        assert!(crossing(&a, &b, 1e-3).unwrap().distance(DVec3::new(0.5, 0.0, 5e-5)) < 1e-12);
        assert_eq!(crossing(&a, &b, 1e-5), None);
        // Parallel lines within the tolerance touch somewhere; far apart they do not.
        assert_eq!(crossing(&a, &[DVec3::Y, DVec3::Y + DVec3::X], 0.5), None);
    }
}
