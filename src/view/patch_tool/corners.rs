//! The corner card: where the sides meet, how far they miss each other, and what can be done about it.

use glam::DVec3;

use super::arrange::{Order, SideLine};
use super::meetings::{Cut, meetings};
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

/// The four corners of a loop. `cut`: how the loop closes when its sides are cut.
pub(super) fn corners(
    order: &Order,
    lines: &[Option<SideLine>; 4],
    cut: Option<&Cut>,
    tol: f64,
    chosen: &[Chosen],
) -> Vec<Corner> {
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
                    let crossing = match (&lines[sides[0]], &lines[sides[1]], cut) {
                        (_, Some(line), Some(cut)) => Some(cut.ends(sides[1], line)[usize::from(order.reversed[k])]),
                        (Some(a), Some(b), None) => meetings(&a.points, &b.points, tol).first().map(|m| m.point),
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

/// A side's pieces cut at a point of it. The part towards `keep` stays; without that the piece that is cut keeps the
/// part that was clicked (the longer part of a segment or polyline). Pieces beyond the cut go.
pub(super) fn trim_at(
    scene: &Scene,
    pieces: &[Picked],
    line: &SideLine,
    at: DVec3,
    keep: Option<DVec3>,
) -> Result<Vec<Picked>, PieceError> {
    let place_of = |p: DVec3| {
        let far = |k: usize| pieces[line.chain[k].0].distance(p);
        (0..line.chain.len()).min_by(|&a, &b| far(a).total_cmp(&far(b))).unwrap_or(0)
    };
    let place = place_of(at);
    let (index, backwards) = line.chain[place];
    let piece = &pieces[index];
    // Which end of the piece's own direction goes.
    let end = match (&piece.source, keep.map(|p| (place_of(p), p))) {
        (_, Some((other, _))) if other != place => usize::from((other > place) == backwards),
        (_, Some((_, p))) => {
            let [a, b] = piece.split(scene, at)?;
            usize::from(a.distance(p) < b.distance(p))
        }
        (super::piece::Source::Curve { clicked, .. }, None) => {
            let t = piece.nearest_parameter(scene, at).ok_or(PieceError::Gone)?;
            usize::from(t > *clicked)
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
