//! What clicks do: curves, surfaces and their iso-curves, points, splits, shared sides.

use glam::{DVec2, DVec3};

use super::arrange::{self, SideLine};
use super::follow::joint_angles;
use super::piece::{Picked, PieceError};
use super::{Mode, PatchTool, SidePick, Stage, sentence};
use crate::kernel::geom::Direction;
use crate::model::document::{EntityId, Shape};
use crate::view::display::CurveRef;
use crate::view::feature_edges::EdgePiece;
use crate::view::navigation::Modifiers;
use crate::view::pick::{PickHit, Target};
use crate::view::scene::{ItemKind, Scene};
use crate::view::snap::Snap;

/// A curve carries on a side when it turns by less than this at the joint, in degrees.
const CARRIES_ON: f64 = 30.0;
/// A border that passes through a surface is near it for at most this many joining tolerances.
const PASSING: f64 = 8.0;

impl PatchTool {
    pub(super) fn click(&mut self, hit: Option<PickHit>, snap: Option<Snap>, held: Modifiers, scene: &Scene) {
        let Stage::Side(side) = self.stage else {
            match self.stage {
                Stage::Review => self.refuse("All four sides are picked; 1-4 goes back to one, Enter heals"),
                Stage::Running => self.refuse("Still healing; Esc cancels"),
                Stage::Result => self.refuse("Judge the patch first; Enter accepts, 1-4 adjusts, Esc discards"),
                Stage::Idle | Stage::Side(_) => {}
            }
            return;
        };
        match &self.mode {
            Mode::Line(_) | Mode::Polyline(_) | Mode::Draw(_) => {
                match snap.map(|s| s.point).or(hit.map(|h| h.point)) {
                    Some(p) => self.add_point(p, scene),
                    None => self.refuse("No point here; click on a curve or a surface"),
                }
                return;
            }
            Mode::Iso { entity, fixed, .. } => {
                let (entity, fixed) = (*entity, *fixed);
                if let Some(PickHit { target: Target::Surface { entity: clicked, .. }, point, .. }) = hit
                    && clicked == entity
                {
                    self.take_iso(Some(point), fixed, scene);
                    return;
                }
                self.mode = Mode::Curves;
            }
            Mode::Curves => {}
        }
        let Some(hit) = hit else {
            self.refuse("Nothing to pick here; curves are picked within 16 pixels");
            return;
        };
        match hit.target {
            Target::Curve { curve, t } => self.click_curve(side, curve, t, hit.point, held, scene),
            Target::Surface { entity, uv } => self.click_surface(entity, uv, scene),
            Target::Point(_) => self.refuse("A point is no side; L draws a segment between two points"),
        }
    }

    /// The stretch of a border that is of one kind around a parameter. Short stretches of other kinds do not end it:
    /// there the border only passes through another surface, and that is where it will be cut.
    pub(super) fn stretch_at(&self, curve: &CurveRef, t: f64, scene: &Scene) -> Option<[f64; 2]> {
        let mut pieces: Vec<&EdgePiece> = self.edges.pieces.iter().filter(|p| p.curve == *curve).collect();
        pieces.sort_by(|a, b| a.range[0].total_cmp(&b.range[0]));
        let own = pieces.iter().position(|p| p.range[0] <= t && t <= p.range[1])?;
        let geometry = &scene.curve_item(curve)?.geometry;
        let is_short = |p: &EdgePiece| {
            let at = |k: u32| {
                let t = p.range[0] + (p.range[1] - p.range[0]) * f64::from(k) / 8.0;
                geometry.curve_jet(curve, t).map_or(DVec3::NAN, |jet| jet[0])
            };
            (1..=8).map(|k| at(k).distance(at(k - 1))).sum::<f64>() <= PASSING * self.options.joining_tol
        };
        let is_same = |p: &EdgePiece| p.kind == pieces[own].kind && p.neighbours == pieces[own].neighbours;
        let reach = |rest: &mut dyn Iterator<Item = usize>| {
            rest.take_while(|&k| is_same(pieces[k]) || is_short(pieces[k])).last().unwrap_or(own)
        };
        let (first, last) = (reach(&mut (0..own).rev()), reach(&mut (own + 1..pieces.len())));
        Some([pieces[first].range[0], pieces[last].range[1]])
    }

    pub(super) fn click_surface(&mut self, entity: EntityId, uv: DVec2, scene: &Scene) {
        if scene.item(entity).is_some_and(|item| item.kind == ItemKind::Patch) {
            self.refuse("A healed patch has no iso-curves to pick; click one of its sides to share it");
            return;
        }
        if scene.item(entity).is_some_and(|item| item.kind == ItemKind::Mesh) {
            self.refuse(
                "A mesh has no iso-curves; click one of its borders, feature edges or grid lines, or draw with W",
            );
            return;
        }
        self.mode = Mode::Iso { entity, uv, fixed: Direction::U };
    }

    pub(super) fn click_curve(
        &mut self,
        side: usize,
        curve: CurveRef,
        t: f64,
        point: DVec3,
        held: Modifiers,
        scene: &Scene,
    ) {
        if let Some(item) = scene.curve_item(&curve).filter(|item| item.kind == ItemKind::Patch) {
            match side_at(scene, item.id(), point) {
                Some(source) => self.share(source),
                None => self.refuse("This patch's sides are gone from the model; pick other curves"),
            }
            return;
        }
        // What other pieces have of this curve, to find the stretch around the click that is still free.
        let mut free = [f64::NEG_INFINITY, f64::INFINITY];
        for (k, other) in self.sides.iter().enumerate() {
            for (index, piece) in other.pieces.iter().enumerate() {
                let Some((_, range)) = piece.stretch().filter(|(c, _)| *c == curve) else { continue };
                if t <= range[0] {
                    free[1] = free[1].min(range[0]);
                } else if t >= range[1] {
                    free[0] = free[0].max(range[1]);
                } else if held.shift {
                    self.split(k, index, point, scene);
                    return;
                } else {
                    self.refuse(format!(
                        "This is a piece of side {} already; Shift+click splits it, Backspace takes it back",
                        k + 1
                    ));
                    return;
                }
            }
        }
        let domain = scene.curve_item(&curve).and_then(|item| item.geometry.curve_domain(&curve));
        // A border that is only in part free (or open, or shared) is taken in that part.
        let stretch = self.stretch_at(&curve, t, scene).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let range = domain.map(|[a, b]| [a.max(free[0]).max(stretch[0]), b.min(free[1]).min(stretch[1])]);
        match Picked::of_curve(scene, curve, range, t) {
            Ok(piece) if held.shift => match piece.split(scene, point) {
                Ok([a, b]) => {
                    if self.add(side, a) {
                        let Stage::Side(side) = self.stage else { return };
                        self.sides[side].pieces.push(b);
                        self.say("Split in two pieces; Backspace frees the second one, for another side to take");
                    }
                }
                Err(_) => self.refuse("The split would leave a piece without length; click farther from the end"),
            },
            Ok(piece) => {
                self.add(side, piece);
            }
            Err(error) => self.refuse(sentence(&error.to_string())),
        }
    }

    pub(super) fn split(&mut self, side: usize, index: usize, at: DVec3, scene: &Scene) {
        if self.sides[side].shared {
            self.refuse_shared(side);
            return;
        }
        match self.sides[side].pieces[index].split(scene, at) {
            Ok([a, b]) => {
                let pieces = &mut self.sides[side].pieces;
                pieces[index] = a;
                // Last, so that Backspace takes it back.
                pieces.push(b);
                self.say(format!(
                    "Split in two pieces of side {}; Backspace frees the second one, for another side to take",
                    side + 1
                ));
            }
            Err(_) => self.refuse("The split would leave a piece without length; click farther from the end"),
        }
    }

    pub(super) fn refuse_shared(&mut self, side: usize) {
        self.refuse(format!(
            "Side {} is shared with its neighbour, and two patches share a side whole; Backspace takes it out",
            side + 1
        ));
    }

    /// Adds a piece to a side, or to the next one when it does not carry this one on. False when there is no place.
    pub(super) fn add(&mut self, side: usize, piece: Picked) -> bool {
        let line = arrange::chain(&self.sides[side].pieces);
        let carries_on = line.as_ref().is_none_or(|line| self.carries_on(line, &piece, CARRIES_ON));
        let mut target = side;
        if self.sides[side].shared || !(carries_on || self.holding) {
            match self.next_empty(side) {
                Some(next) => {
                    target = next;
                    let why =
                        if self.sides[side].shared { "is shared whole" } else { "is not carried on by this curve" };
                    self.say(format!("Side {} {why}, so side {} was started; Backspace undoes", side + 1, next + 1));
                }
                None if self.sides[side].shared => {
                    self.refuse_shared(side);
                    return false;
                }
                None => {
                    self.refuse("All four sides have curves; 1-4 goes to a side to add to it, Backspace takes one out");
                    return false;
                }
            }
        } else if let Some(line) = line
            && !carries_on
        {
            let gap = ends_apart(&line, &piece);
            if gap > self.options.joining_tol {
                self.say(format!("This piece misses the rest of side {} by {}", side + 1, self.length(gap)));
            }
        }
        let [a, b] = piece.ends();
        if a.distance(b) <= self.options.joining_tol && self.notice.is_none() {
            self.say(format!(
                "Side {} closes on itself; Shift+click where a corner shall be splits it, and Backspace frees the rest \
                 for the other sides",
                target + 1
            ));
        }
        self.touch(target);
        self.sides[target].pieces.push(piece);
        self.stage = Stage::Side(target);
        if target != side {
            self.holding = false;
        }
        true
    }

    /// What was decided about the corners of a side no longer holds.
    pub(super) fn touch(&mut self, side: usize) {
        self.chosen.retain(|(pair, _)| !pair.contains(&side));
    }

    /// Whether a piece starts at an end of a line and turns by less than an angle there.
    pub(super) fn carries_on(&self, line: &SideLine, piece: &Picked, degrees: f64) -> bool {
        joint_angles(line, piece, self.options.joining_tol).iter().any(|(_, angle)| *angle <= degrees)
    }

    pub(super) fn next_empty(&self, side: usize) -> Option<usize> {
        (1..4).map(|k| (side + k) % 4).find(|&k| self.sides[k].pieces.is_empty())
    }

    pub(super) fn add_point(&mut self, p: DVec3, scene: &Scene) {
        let (Mode::Line(points) | Mode::Polyline(points) | Mode::Draw(points)) = &mut self.mode else { return };
        if points.last().is_some_and(|q| *q == p) {
            self.refuse("This is the same point again; pick another one");
            return;
        }
        points.push(p);
        if matches!(&self.mode, Mode::Line(points) if points.len() == 2) {
            self.finish_points(scene);
        }
    }

    pub(super) fn finish_points(&mut self, scene: &Scene) {
        let Stage::Side(side) = self.stage else { return };
        let made = match &self.mode {
            Mode::Line(points) if points.len() == 2 => Picked::line(points[0], points[1]),
            Mode::Polyline(points) => Picked::polyline(points),
            Mode::Draw(points) => Picked::drawn(scene, points),
            _ => return,
        };
        match made {
            Ok(piece) => {
                self.mode = Mode::Curves;
                self.add(side, piece);
            }
            Err(error) => self.refuse(sentence(&error.to_string())),
        }
    }

    /// Takes the iso-curve with `fixed`, or of the two the one that is nearer to a point.
    pub(super) fn take_iso(&mut self, near: Option<DVec3>, fixed: Direction, scene: &Scene) {
        let Stage::Side(side) = self.stage else { return };
        let Some([first, second]) = self.iso_choice(scene) else {
            self.mode = Mode::Curves;
            self.refuse(sentence(&PieceError::Gone.to_string()));
            return;
        };
        debug_assert!(matches!(self.mode, Mode::Iso { fixed: f, .. } if f == fixed));
        let other = near.is_some_and(|p| second.distance(p) < 0.5 * first.distance(p));
        self.mode = Mode::Curves;
        self.add(side, if other { second } else { first });
    }

    /// Shares a side of the patch that was accepted last.
    pub(super) fn reuse(&mut self, from: usize) {
        match self.last.as_ref().and_then(|last| last.get(from)).cloned() {
            Some(source) => self.share(source),
            None => self.refuse("There is no accepted patch to share a side with"),
        }
    }

    /// Makes a side of an accepted patch a side of this one, whole and with what becomes of its curve.
    fn share(&mut self, source: SidePick) {
        let Stage::Side(current) = self.stage else {
            self.refuse("A side can be shared while sides are picked");
            return;
        };
        if self.sides.iter().any(|s| s.pieces == source.pieces) {
            self.refuse("This side is shared already");
            return;
        }
        let empty = self.sides[current].pieces.is_empty();
        let Some(side) = (if empty { Some(current) } else { self.next_empty(current) }) else {
            self.refuse("All four sides have curves; Backspace takes one out");
            return;
        };
        self.touch(side);
        self.sides[side] = SidePick { shared: true, flipped: false, ..source };
        self.stage = Stage::Side(side);
        self.say(format!("Side {} is shared with the accepted patch", side + 1));
    }
}

/// The side of an accepted patch that is nearest to a point.
fn side_at(scene: &Scene, patch: EntityId, point: DVec3) -> Option<SidePick> {
    let Shape::Patch(patch) = &scene.item(patch)?.entity.shape else { return None };
    let mut best: Option<(f64, SidePick)> = None;
    for (pieces, boundary) in patch.spec.sides.iter().zip(patch.spec.boundary) {
        let Ok(pieces) = pieces.iter().map(|p| Picked::from_piece(scene, p)).collect::<Result<Vec<_>, _>>() else {
            continue;
        };
        let Some(line) = arrange::chain(&pieces) else { continue };
        let (_, far) = super::piece::nearest_on(&line.points, point);
        if best.as_ref().is_none_or(|(d, _)| far < *d) {
            best = Some((far, SidePick { pieces, boundary, ..SidePick::default() }));
        }
    }
    best.map(|b| b.1)
}

fn ends_apart(line: &SideLine, piece: &Picked) -> f64 {
    let ends = piece.ends();
    line.ends().iter().flat_map(|a| ends.map(|b| a.distance(b))).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::testing::scene_of;
    use super::*;
    use crate::kernel::geom::{Side, Surface};
    use crate::kernel::job::Job;
    use crate::kernel::tol::Tolerances;
    use crate::model::document::{Document, Unit};
    use crate::view::feature_edges::{EdgeOptions, feature_edges};

    #[test]
    fn a_border_that_passes_through_a_wall_is_picked_whole_and_one_that_ends_being_shared_in_part() {
        let mut document = Document::new(Unit::Millimetre);
        let mut sheet = |o: [f64; 3], u: DVec3, v: DVec3| {
            let o = DVec3::from_array(o);
            let surface = Surface::bilinear([o, o + u, o + v, o + u + v]).unwrap();
            document.add("sheet", Shape::Surface(Arc::new(surface)), None)
        };
        let floor = sheet([0.0, 0.0, 0.0], DVec3::X * 4.0, DVec3::Y);
        // A wall through the border at x = 1 and 30 degrees, and a floor that goes on for x > 3.
        let along = DVec3::new(3.0_f64.sqrt(), 1.0, 0.0);
        sheet([1.0 - along.x, -1.0, -1.0], along * 2.0, DVec3::Z * 2.0);
        sheet([3.0, 0.0, 0.0], DVec3::NEG_Y, DVec3::X);
        let scene = scene_of(&document);
        let tol = 0.1;
        let edges = feature_edges(&document, &EdgeOptions::new(tol), &Job::new());
        let border = CurveRef::Border(floor, Side::VMin);
        assert!(edges.pieces.iter().filter(|p| p.curve == border).count() > 2, "the wall cuts the border: {edges:?}");
        let mut tool = PatchTool::new(&Tolerances::of(&document.bounds()), Unit::Millimetre);
        tool.options.joining_tol = tol;
        tool.set_edges(Arc::new(edges));
        for t in [0.1, 0.5] {
            let [from, to] = tool.stretch_at(&border, t, &scene).unwrap();
            assert!(from == 0.0 && (to - 0.75).abs() < 0.03, "{from} {to}");
        }
        let [from, to] = tool.stretch_at(&border, 0.9, &scene).unwrap();
        assert!((from - 0.75).abs() < 0.03 && to == 1.0, "{from} {to}");
    }
}
