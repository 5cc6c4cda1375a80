//! The picked sides as a patch specification, and back.

use super::arrange::{self, Layout};
use super::corners::{CornerFix, CornerState};
use super::piece::{Picked, PieceError};
use super::{PatchTool, SidePick};
use crate::model::spec::{Arrangement, EndMove, HealSpec, Joining, PatchSpec};
use crate::view::scene::{ItemKind, Scene};

impl PatchTool {
    /// The sides as a specification: each side's pieces in the order and direction of its chain, so that reading it
    /// gives the same chain again.
    pub fn patch_spec(&self, scene: &Scene) -> Result<PatchSpec, PieceError> {
        let mut spec = PatchSpec { name: self.options.name.clone(), ..PatchSpec::default() };
        for (k, side) in self.sides.iter().enumerate() {
            spec.boundary[k] = side.boundary;
            let Some(line) = arrange::chain(&side.pieces) else { continue };
            for (index, backwards) in line.chain {
                spec.sides[k].push(side.pieces[index].to_piece(scene, backwards)?);
            }
        }
        spec.joining = self.joining();
        Ok(spec)
    }

    /// What was decided by hand. Nothing is written that the search would find by itself.
    fn joining(&self) -> Joining {
        let mut joining = Joining::default();
        let by_hand = self.other_loop || self.sides.iter().any(|s| s.flipped);
        if let (true, Layout::Loop(..), Some(order)) = (by_hand, &self.layout, self.order()) {
            let mut arrangement = Arrangement { order: [0; 4], reversed: [false; 4] };
            for k in 0..4 {
                (arrangement.order[k], arrangement.reversed[k]) = (order.sides[k], order.reversed[k]);
            }
            joining.arrangement = Some(arrangement);
        }
        for corner in &self.corners {
            match corner.state {
                CornerState::ClosedBy(CornerFix::Average) => {
                    let wide = corner.gap * (1.0 + 1e-6);
                    joining.tol = Some(joining.tol.unwrap_or(self.options.joining_tol).max(wide));
                }
                CornerState::ClosedBy(CornerFix::MoveSide(side)) => {
                    let to = corner.point();
                    joining.moves.push(EndMove { side, to: (to.x, to.y, to.z) });
                }
                _ => {}
            }
        }
        joining
    }

    /// The whole heal of this one patch.
    pub fn heal_spec(&self, scene: &Scene) -> Result<HealSpec, PieceError> {
        Ok(self.options.settings().with_patches(vec![self.patch_spec(scene)?]))
    }

    /// Takes the sides of a specification over. Pieces that are not there are left out and named.
    pub(super) fn load(&mut self, spec: &PatchSpec, settings: &HealSpec, scene: &Scene) -> Vec<String> {
        let mut missing = Vec::new();
        self.options.take(settings);
        // All surfaces by number are all surfaces.
        let count = scene.items().iter().filter(|item| matches!(item.kind, ItemKind::Surface | ItemKind::Mesh)).count();
        self.options.onto = self.options.onto.take().filter(|list| (0..count).any(|k| !list.contains(&k)));
        for (k, pieces) in spec.sides.iter().enumerate() {
            self.sides[k] = SidePick { boundary: spec.boundary[k], ..SidePick::default() };
            for piece in pieces {
                match Picked::from_piece(scene, piece) {
                    Ok(picked) => self.sides[k].pieces.push(picked),
                    Err(error) => missing.push(format!("side {}: {error}", k + 1)),
                }
            }
        }
        self.options.name.clone_from(&spec.name);
        self.chosen.clear();
        self.other_loop = false;
        self.refresh();
        self.load_joining(&spec.joining);
        missing
    }

    /// Finds the decisions again that made a [`Joining`].
    fn load_joining(&mut self, joining: &Joining) {
        if let (Some(wanted), Layout::Loop(best, other)) = (joining.arrangement, &self.layout) {
            let differs = |order: &arrange::Order| order.sides != wanted.order;
            if differs(best) && other.as_ref().is_some_and(|o| !differs(o)) {
                self.other_loop = true;
            }
            let Some(order) = self.order().cloned() else { return };
            for (place, side) in order.sides.iter().enumerate() {
                let at = wanted.order.iter().position(|s| s == side).unwrap_or(place);
                self.sides[*side].flipped = order.reversed[place] != wanted.reversed[at];
            }
            self.refresh();
        }
        for corner in &self.corners {
            let moved = joining.moves.iter().find(|m| {
                let to = glam::DVec3::new(m.to.0, m.to.1, m.to.2);
                corner.sides.contains(&m.side)
                    && corner.ends.iter().any(|e| e.distance(to) < 1e-9 * (1.0 + to.length()))
            });
            let by_tol = joining.tol.is_some_and(|tol| corner.gap <= tol);
            match moved {
                Some(m) => self.chosen.push((corner.sides, CornerFix::MoveSide(m.side))),
                None if by_tol && !corner.is_settled() => self.chosen.push((corner.sides, CornerFix::Average)),
                None => {}
            }
        }
        self.refresh();
    }
}
