//! What the engine could not decide, as entries of the result.

use glam::{DVec2, DVec3};

use super::contact::Cell;
use super::correct::PointPair;
use super::engine::{Chain, Engine};
use super::result::Unresolved;
use super::traverse::{OpenPair, TOO_SMALL, Traversal};
use super::tree::Node;
use super::undecided::{self, Undecided};

/// What is nearer than this is one point, in the unit frame: ten times what pairs of nodes are divided down to.
pub(super) const SAME_POINT: f64 = 1e-8;

impl Engine {
    /// Lists what the descent left, apart from points in which only borders meet (no crossing is there) and those
    /// that a curve runs into.
    pub(super) fn open_pairs(&mut self, pairs: &[OpenPair]) {
        let mut open = Vec::new();
        for pair in pairs {
            let (a, b) = (&self.trees[0].nodes[pair.a], &self.trees[1].nodes[pair.b]);
            if pair.reason == TOO_SMALL && (self.only_touches([a, b]) || self.is_isolated(a.c)) {
                continue;
            }
            open.push(Undecided {
                entry: self.unresolved_at([a.piece, b.piece], [a.low, a.high], [b.low, b.high], pair.reason),
                extent: a.bounds.union(&b.bounds).diagonal() / self.frame.scale,
            });
        }
        self.unresolved.extend(undecided::merged(open));
    }

    /// Whether a pair of nodes as small as a point lies on borders of both sides, or at an end of a curve, or in a pole that
    /// a curve passes as near as that.
    fn only_touches(&self, pair: [&Node; 2]) -> bool {
        let near = |p: DVec3| p.distance(pair[0].c) < SAME_POINT;
        let in_pole = |side: usize| {
            let mut borders = self.sides[side].borders_of(pair[side].piece).iter();
            borders.any(|e| e.bounds.diagonal() < SAME_POINT && near(e.bounds.center()))
        };
        let on_border = |side: usize| {
            let node = pair[side];
            let mut borders = self.sides[side].borders_of(node.piece).iter();
            borders.any(|e| if e.value > 0.5 { node.high[e.fixed] >= 1.0 } else { node.low[e.fixed] <= 0.0 })
        };
        let poles = [in_pole(0), in_pole(1)];
        let ends = |c: &Chain| [c.nodes.first(), c.nodes.last()].into_iter().flatten().any(|n| near(n.p));
        let passes = |c: &Chain| c.nodes.iter().any(|n| near(n.p));
        (0..2).all(|side| poles[side] || on_border(side))
            || self.chains.iter().any(ends)
            || (poles.contains(&true) && self.chains.iter().any(passes))
    }

    pub(super) fn cancelled(&mut self, traversal: &Traversal) {
        self.open_pairs(&traversal.unresolved);
        let whole = [DVec2::ZERO, DVec2::ONE];
        let entry = self.unresolved_at([0, 0], whole, whole, "cancelled");
        self.unresolved.push(entry);
    }

    fn unresolved_at(&self, pair: [usize; 2], a: [DVec2; 2], b: [DVec2; 2], reason: &str) -> Unresolved {
        let (pa, pb) = (&self.sides[0].pieces[pair[0]], &self.sides[1].pieces[pair[1]]);
        let boxed = |piece: &super::piece::Piece, rect: [DVec2; 2]| {
            let (low, high) = (piece.to_surface(rect[0]), piece.to_surface(rect[1]));
            [[low.x, high.x], [low.y, high.y]]
        };
        Unresolved {
            a: pa.surface,
            uv_box: boxed(pa, a),
            b: pb.surface,
            st_box: boxed(pb, b),
            reason: reason.to_owned(),
        }
    }

    pub(super) fn give_up(&mut self, pair: [usize; 2], at: PointPair, reason: &str) {
        let around = |x: DVec2| [(x - 1e-3).clamp(DVec2::ZERO, DVec2::ONE), (x + 1e-3).clamp(DVec2::ZERO, DVec2::ONE)];
        let entry = self.unresolved_at(pair, around(at.uv), around(at.st), reason);
        if !self.unresolved.contains(&entry) {
            self.unresolved.push(entry);
        }
    }

    /// Cells that no gap function decided, unless a junction explains them.
    pub(super) fn settle_undecided(&mut self, cells: &[Cell]) {
        let mut open = Vec::new();
        for cell in cells {
            let piece = &self.sides[0].pieces[cell.pa];
            let p = piece.point(cell.middle.uv);
            let explained = self.in_contact(p);
            if !explained {
                let size = piece.point(cell.low).distance(p) + piece.point(cell.high).distance(p);
                let around = [cell.middle.st - 1e-4, cell.middle.st + 1e-4];
                let reason = "the contact is of higher order than can be told";
                open.push(Undecided {
                    entry: self.unresolved_at([cell.pa, cell.pb], [cell.low, cell.high], around, reason),
                    extent: size / self.frame.scale,
                });
            }
        }
        self.unresolved.extend(undecided::merged(open));
    }
}
