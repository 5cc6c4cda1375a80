//! Following the model: T carries a side on by tangency, C and dragged ends trim it.

use glam::DVec3;

use super::arrange::{self, SideLine};
use super::corners::trim_at;
use super::meetings::meetings;
use super::piece::{Picked, PieceError};
use super::{PatchTool, Stage, sentence};
use crate::view::display::CurveRef;
use crate::view::feature_edges::EdgeKind;
use crate::view::scene::{ItemKind, Scene};

/// T follows curves that turn by less than this, in degrees.
const CHAINS: f64 = 10.0;
/// The most curves that T adds at once.
const CHAIN_LIMIT: usize = 200;

impl PatchTool {
    pub(super) fn trim_end(&mut self, side: usize, piece: usize, end: usize, to: DVec3, scene: &Scene) {
        let Some(picked) = self.sides.get(side).and_then(|s| s.pieces.get(piece)) else { return };
        if self.sides[side].shared {
            self.refuse_shared(side);
            return;
        }
        match picked.moved(scene, end, to) {
            Ok(trimmed) => {
                self.touch(side);
                self.sides[side].pieces[piece] = trimmed;
            }
            Err(PieceError::Point) => self.refuse("Nothing would be left of the piece; Backspace takes it out"),
            Err(error) => self.refuse(sentence(&error.to_string())),
        }
    }

    pub(super) fn trim_side(&mut self, side: usize, at: DVec3, scene: &Scene) -> bool {
        let keep = self.cut.as_ref().zip(self.lines[side].as_ref()).map(|(cut, line)| cut.middle(side, line));
        if self.sides[side].shared {
            self.refuse_shared(side);
            return false;
        }
        let pieces = &self.sides[side].pieces;
        let Some(line) = arrange::chain(pieces) else { return false };
        match trim_at(scene, pieces, &line, at, keep) {
            Ok(trimmed) => {
                self.touch(side);
                self.sides[side].pieces = trimmed;
                true
            }
            // The crossing is at its end already.
            Err(PieceError::Point) => false,
            Err(error) => {
                self.refuse(sentence(&error.to_string()));
                false
            }
        }
    }

    pub(super) fn trim_all(&mut self, scene: &Scene) {
        if !matches!(self.stage, Stage::Side(_) | Stage::Review) {
            return;
        }
        let tol = self.options.joining_tol;
        let mut cuts: Vec<(usize, DVec3)> = Vec::new();
        for a in 0..4 {
            if let (Some(cut), Some(line)) = (&self.cut, &self.lines[a]) {
                cuts.extend(cut.ends(a, line).map(|at| (a, at)));
                continue;
            }
            for b in a + 1..4 {
                if let (Some(p), Some(q)) = (&self.lines[a], &self.lines[b])
                    && let Some(meeting) = meetings(&p.points, &q.points, tol).first()
                {
                    cuts.extend([(a, meeting.point), (b, meeting.point)]);
                }
            }
        }
        let mut trimmed = 0;
        for (side, at) in cuts {
            let Some(line) = arrange::chain(&self.sides[side].pieces) else { continue };
            // A crossing on a part that is cut off already is no end any more.
            if super::piece::nearest_on(&line.points, at).1 > tol {
                continue;
            }
            // An end that is there already stays as it is.
            if line.ends().iter().any(|e| e.distance(at) <= tol) {
                continue;
            }
            trimmed += usize::from(self.trim_side(side, at, scene));
        }
        if trimmed > 0 {
            self.say(format!("Trimmed {trimmed} ends to where the sides cross"));
        } else if self.notice.is_none() {
            self.refuse("No two sides cross within the joining tolerance");
        }
    }

    /// Adds the curves that carry on the side smoothly, at both ends, until there is none, or two.
    pub(super) fn chain(&mut self, scene: &Scene) {
        let Stage::Side(side) = self.stage else {
            self.refuse("T carries on a side while it is picked; 1-4 goes to one");
            return;
        };
        if self.sides[side].shared {
            self.refuse_shared(side);
            return;
        }
        if self.sides[side].pieces.is_empty() {
            self.refuse(format!("Side {} has no curve to carry on yet", side + 1));
            return;
        }
        let mut added = 0;
        let mut fork = false;
        while added < CHAIN_LIMIT {
            let Some(line) = arrange::chain(&self.sides[side].pieces) else { break };
            let [a, b] = line.ends();
            if a.distance(b) <= self.options.joining_tol {
                break;
            }
            match self.next_in_chain(&line, scene) {
                Next::One(piece) => {
                    self.touch(side);
                    self.sides[side].pieces.push(piece);
                    added += 1;
                }
                Next::Fork => {
                    fork = true;
                    break;
                }
                Next::None => break,
            }
        }
        let curves = if added == 1 { "1 curve".to_owned() } else { format!("{added} curves") };
        match (added, fork) {
            (0, false) => self.refuse("No curve carries on here smoothly; click the next one"),
            (0, true) => self.refuse("Two curves carry on here; click the one that is meant"),
            (_, true) => self.say(format!("Added {curves}; then two carry on, click the one that is meant")),
            (CHAIN_LIMIT, _) => self.say(format!("Added {curves}, the most at once; T goes on")),
            _ => self.say(format!("Added {curves}")),
        }
    }

    fn next_in_chain(&self, line: &SideLine, scene: &Scene) -> Next {
        let tol = self.options.joining_tol;
        let used = |curve: &CurveRef| {
            self.sides.iter().flat_map(|s| &s.pieces).any(|p| p.stretch().is_some_and(|(c, _)| c == *curve))
        };
        let mut found: Vec<(f64, Picked)> = Vec::new();
        let near = |p: DVec3| line.ends().iter().any(|e| e.distance(p) <= tol);
        for item in scene.items().iter().filter(|i| i.visible() && i.kind != ItemKind::Patch) {
            let Some(display) = &item.display else { continue };
            for curve in &display.curves {
                let ends = [curve.points[0], curve.points[curve.points.len() - 1]];
                if curve.curve.is_iso() || used(&curve.curve) || !ends.iter().any(|p| near(*p)) {
                    continue;
                }
                let n = curve.points.len() - 1;
                let at = if near(ends[0]) { curve.t[0] } else { curve.t[n] };
                let stretch = self.stretch_at(&curve.curve, at, scene);
                let Ok(piece) = Picked::of_curve(scene, curve.curve, stretch, at) else { continue };
                let least = joint_angles(line, &piece, tol).into_iter().map(|(_, a)| a).fold(f64::INFINITY, f64::min);
                if least <= CHAINS {
                    found.push((least, piece));
                }
            }
        }
        // Borders that two surfaces share are one way to go on, and what lies on the side already is none.
        let beside = |points: &[DVec3], p: &Picked| {
            let n = p.points.len();
            [n / 4, n / 2, 3 * n / 4].iter().all(|&k| super::piece::nearest_on(points, p.points[k]).1 <= tol)
        };
        found.retain(|(_, p)| !beside(&line.points, p));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A side of free edges stays on free edges as long as there are any to follow.
        let open = |p: &Picked| {
            let Some((curve, [a, b])) = p.stretch() else { return false };
            self.edges.at(&curve, 0.5 * (a + b)).is_some_and(|e| matches!(e.kind, EdgeKind::Free | EdgeKind::Gap))
        };
        let of_side = self.sides.iter().filter_map(|s| arrange::chain(&s.pieces).filter(|l| l == line).map(|_| s));
        if of_side.take(1).any(|s| s.pieces.iter().all(open)) {
            found.retain(|(_, p)| open(p));
        }
        let mut distinct: Vec<(f64, Picked)> = Vec::new();
        for (angle, piece) in found {
            if !distinct.iter().any(|(_, other)| beside(&other.points, &piece) || beside(&piece.points, other)) {
                distinct.push((angle, piece));
            }
        }
        // Curves at different ends of the side do not compete.
        let end_of = |p: &Picked| joint_angles(line, p, tol).first().map(|(end, _)| *end);
        let mut ways = distinct.into_iter();
        let Some((angle, first)) = ways.next() else { return Next::None };
        let rival = ways.find(|(_, p)| end_of(p) == end_of(&first));
        match rival {
            Some((other, _)) if other < 2.0 * angle + 1.0 => Next::Fork,
            _ => Next::One(first),
        }
    }
}

enum Next {
    One(Picked),
    Fork,
    None,
}

/// Where ends of a piece lie on ends of a line (0 start, 1 end): the end of the line and the angle by which the
/// direction turns there, in degrees.
pub(super) fn joint_angles(line: &SideLine, piece: &Picked, tol: f64) -> Vec<(usize, f64)> {
    let n = line.points.len();
    let outwards = [line.points[0] - line.points[1], line.points[n - 1] - line.points[n - 2]];
    let mut out = Vec::new();
    for (k, (tip, direction)) in line.ends().into_iter().zip(outwards).enumerate() {
        for end in 0..2 {
            if piece.ends()[end].distance(tip) <= tol {
                let into = -piece.outwards(end);
                out.push((k, direction.angle_between(into).to_degrees()));
            }
        }
    }
    out
}
