//! Walks through the tool as users take them, with the mistakes that new ones make.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::corners::{CornerFix, CornerState};
use super::testing::{scene_of, tiles};
use super::*;
use crate::kernel::geom::{Curve, Side, Surface};
use crate::kernel::job::Job;
use crate::model::document::{Document, Shape};
use crate::model::healing;
use crate::model::spec::{PatchSpec, Piece};
use crate::view::pick::Target;

struct Walk {
    tool: PatchTool,
    document: Document,
    scene: Scene,
}

impl Walk {
    fn new(document: Document) -> Self {
        let scene = scene_of(&document);
        let mut walk = Self { tool: PatchTool::new(&document.tolerances(), document.unit), document, scene };
        walk.send(Event::Start);
        walk
    }

    fn on_tiles() -> Self {
        Self::new(tiles().0)
    }

    fn send(&mut self, event: Event) -> Vec<Effect> {
        self.tool.handle(event, &self.scene)
    }

    fn key(&mut self, key: Key) -> Vec<Effect> {
        self.send(Event::Key(key))
    }

    /// Clicks a border of a surface at a fraction of its domain.
    fn border(&mut self, surface: usize, side: Side, t: f64) -> Vec<Effect> {
        self.border_with(surface, side, t, Modifiers::NONE)
    }

    fn border_with(&mut self, surface: usize, side: Side, t: f64, held: Modifiers) -> Vec<Effect> {
        let item = self.scene.surface(surface).unwrap();
        let curve = CurveRef::Border(item.id(), side);
        let point = item.geometry.curve_jet(&curve, t).unwrap()[0];
        self.click(Target::Curve { curve, t }, point, held)
    }

    fn free_curve(&mut self, entity: usize, t: f64) -> Vec<Effect> {
        let item = &self.scene.items()[entity];
        let curve = CurveRef::Free(item.id());
        let point = item.geometry.curve_jet(&curve, t).unwrap()[0];
        self.click(Target::Curve { curve, t }, point, Modifiers::NONE)
    }

    fn surface(&mut self, surface: usize, uv: DVec2) -> Vec<Effect> {
        let item = self.scene.surface(surface).unwrap();
        let crate::view::display::Geometry::Surface(s) = &item.geometry else { panic!() };
        let (entity, point) = (item.id(), s.eval(uv));
        self.click(Target::Surface { entity, uv }, point, Modifiers::NONE)
    }

    fn click(&mut self, target: Target, point: DVec3, held: Modifiers) -> Vec<Effect> {
        let hit = PickHit { target, point, distance: 0.0, depth: 1.0, hidden: false };
        self.send(Event::Click { hit: Some(hit), snap: None, held })
    }

    fn point(&mut self, p: [f64; 3]) -> Vec<Effect> {
        let snap = Snap {
            kind: crate::view::snap::SnapKind::End,
            point: DVec3::from_array(p),
            pixel: DVec2::ZERO,
            distance: 0.0,
            on: Vec::new(),
            gap: 0.0,
        };
        self.send(Event::Click { hit: None, snap: Some(snap), held: Modifiers::NONE })
    }

    /// The hole's four sides with Enter between them.
    fn pick_hole(&mut self) {
        for (k, (tile, side)) in HOLE.into_iter().enumerate() {
            if k > 0 {
                self.key(Key::Enter);
            }
            self.border(tile, side, 0.5);
        }
    }

    fn notice(&self) -> &str {
        self.tool.notice().map_or("", |n| n.text.as_str())
    }

    fn refused(&self) -> bool {
        self.tool.notice().is_some_and(|n| n.refused)
    }

    fn counts(&self) -> [usize; 4] {
        [0, 1, 2, 3].map(|k: usize| self.tool.sides()[k].pieces.len())
    }

    /// What a worker would answer.
    fn heal(&self, effects: &[Effect]) -> Result<Arc<crate::model::document::Patch>, String> {
        let Some(Effect::Run(spec)) = effects.iter().find(|e| matches!(e, Effect::Run(_))) else {
            panic!("no run in {effects:?}")
        };
        let healing = healing::run(&self.document, spec, &Job::new()).map_err(|e| e.to_string())?;
        Ok(Arc::new(healing.patches.into_iter().next().unwrap().1))
    }
}

/// The borders around the hole: below, right, above, left.
const HOLE: [(usize, Side); 4] = [(1, Side::VMax), (4, Side::UMin), (6, Side::VMin), (3, Side::UMax)];

/// Tiles of which the fourth misses the others by `gap` at the hole.
fn tiles_with_gap(gap: f64) -> Document {
    let (document, _) = tiles();
    let mut moved = document.clone();
    let id = document.entities()[4].id;
    moved.edit(id, |e| {
        let Shape::Surface(s) = &e.shape else { return };
        let shift = glam::DAffine3::from_translation(DVec3::new(gap, 0.0, 0.0));
        e.shape = Shape::Surface(Arc::new(s.transformed(&shift)));
    });
    moved
}

#[test]
fn the_main_path_from_start_to_an_accepted_patch() {
    let mut w = Walk::on_tiles();
    assert!(w.tool.prompt().starts_with("Patch · Pick side 1 of 4 · Click a curve"), "{}", w.tool.prompt());
    w.border(1, Side::VMax, 0.5);
    assert_eq!(
        w.tool.prompt(),
        "Patch · Pick side 1 of 4 · Enter next side · Backspace undo pick · T chain · X flip · Esc cancel"
    );
    assert!(w.tool.preview().is_none());
    w.key(Key::Enter);
    w.border(4, Side::UMin, 0.5);
    assert!(w.tool.preview().is_some(), "from side 2 on");
    w.key(Key::Enter);
    w.border(6, Side::VMin, 0.5);
    w.key(Key::Enter);
    let effects = w.border(3, Side::UMax, 0.5);
    assert!(matches!(effects[..], [Effect::Project(_)]), "the fourth side asks for a projection");
    assert!(w.tool.prompt().contains("Enter review"));
    w.key(Key::Enter);
    assert_eq!(w.tool.stage(), Stage::Review);
    assert_eq!(w.tool.corners().len(), 4);
    assert!(w.tool.corners().iter().all(|c| c.state == CornerState::Closed && c.gap < 1e-12));
    assert!(w.tool.prompt().starts_with("Patch · Four sides, widest gap 0 mm · Enter heal"), "{}", w.tool.prompt());
    let effects = w.key(Key::Enter);
    assert_eq!(w.tool.stage(), Stage::Running);
    assert_eq!(w.tool.prompt(), "Patch · Healing · Esc cancel");
    // The hole has nothing to project on, so heal over tile 1 and around instead: what matters is what comes back.
    let Some(Effect::Run(spec)) = effects.first() else { panic!() };
    assert_eq!(spec.patches[0].sides[0], [Piece::Edge { face: 1, ring: 0, edge: 2, from: 0.0, to: 1.0 }]);
    w.send(Event::Finished(Err("no sample meets an original".into())));
    assert_eq!(w.tool.stage(), Stage::Review);
    assert!(w.refused() && w.notice().starts_with("No sample"));
}

#[test]
fn a_patch_over_iso_curves_heals_and_its_side_is_shared_with_the_neighbour() {
    let mut w = Walk::on_tiles();
    // Around the middle of tile 0: two iso-curves along v, two along u, trimmed where they cross.
    for (uv, tab) in [((0.2, 0.5), false), ((0.8, 0.5), false), ((0.5, 0.2), true), ((0.5, 0.8), true)] {
        w.surface(0, DVec2::new(uv.0, uv.1));
        assert!(matches!(w.tool.mode(), Mode::Iso { .. }) && w.tool.iso_choice(&w.scene).is_some());
        if tab {
            w.key(Key::Tab);
        }
        assert!(w.tool.prompt().contains(if tab { "iso-curve along u" } else { "iso-curve along v" }));
        w.key(Key::Enter);
        if w.tool.stage() != Stage::Side(3) {
            w.key(Key::Enter);
        }
    }
    assert_eq!(w.counts(), [1; 4]);
    let open = w.tool.corners().iter().filter(|c| !c.is_settled()).count();
    assert!(open > 0 && w.tool.corners().iter().any(|c| c.crossing.is_some()));
    assert!(w.tool.prompt().contains("C trims at crossings"), "{}", w.tool.prompt());
    w.key(Key::Enter);
    assert_eq!(w.tool.stage(), Stage::Review);
    w.key(Key::Enter);
    assert!(w.refused() && w.tool.stage() == Stage::Review, "open corners do not run: {}", w.notice());
    w.key(Key::Trim);
    assert!(w.tool.corners().iter().all(|c| c.gap < 1e-9), "{:?}", w.tool.corners());
    let effects = w.key(Key::Enter);
    let patch = w.heal(&effects).unwrap();
    assert!(patch.report.max_error < 1e-9);
    w.send(Event::Finished(Ok(patch)));
    assert_eq!(w.tool.stage(), Stage::Result);
    assert!(w.tool.prompt().starts_with("Patch · Healed, max error "), "{}", w.tool.prompt());
    w.click(Target::Point(0), DVec3::ZERO, Modifiers::NONE);
    assert!(w.refused(), "a click while judging says what to do");
    let effects = w.key(Key::Enter);
    let [Effect::Accept { name, .. }] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!(name, "Patch 1");
    assert_eq!(w.tool.stage(), Stage::Side(0));
    assert!(w.notice().contains("share it with the neighbour"));
    assert_eq!(w.tool.options().name, "Patch 2");
    // The neighbour: share the right side (the second one), and only whole.
    assert_eq!(w.tool.reusable().len(), 4);
    w.send(Event::Reuse { side: 1 });
    assert!(w.tool.sides()[0].shared);
    let shared = w.tool.patch_spec(&w.scene).unwrap().sides[0].clone();
    assert!(matches!(shared[..], [Piece::Iso { surface: 0, .. }]));
    w.send(Event::Reuse { side: 1 });
    assert!(w.refused() && w.notice().contains("already"));
    w.send(Event::Trim { side: 0, piece: 0, end: 0, to: DVec3::ZERO });
    assert!(w.notice().contains("whole"), "the full-face rule has a reason: {}", w.notice());
    w.border(0, Side::UMax, 0.5);
    assert_eq!(w.counts(), [1, 1, 0, 0], "a shared side takes nothing more, so the next one starts");
    w.key(Key::Backspace);
    w.key(Key::Backspace);
    w.key(Key::Backspace);
    assert_eq!(w.counts(), [0; 4]);
}

#[test]
fn four_clicks_without_enter_still_make_four_sides() {
    let mut w = Walk::on_tiles();
    for (tile, side) in HOLE {
        w.border(tile, side, 0.5);
    }
    assert_eq!(w.counts(), [1; 4]);
    assert!(w.tool.is_loop());
    w.border(0, Side::VMin, 0.5);
    assert!(w.refused() && w.counts() == [1; 4], "{}", w.notice());
    assert!(w.notice().starts_with("All four sides have curves"));
}

#[test]
fn any_order_and_extra_enters_do_no_harm() {
    for order in [[0, 2, 1, 3], [3, 1, 0, 2], [2, 0, 3, 1]] {
        let mut w = Walk::on_tiles();
        w.key(Key::Enter);
        assert!(w.refused() && w.notice().starts_with("Side 1 has no curve yet"));
        for k in order {
            w.border(HOLE[k].0, HOLE[k].1, 0.5);
            if w.tool.stage() != Stage::Side(3) {
                w.key(Key::Enter);
                w.key(Key::Enter);
                assert!(w.refused());
            }
        }
        assert!(w.tool.is_loop() && !w.tool.is_ambiguous());
        assert!(w.tool.corners().iter().all(|c| c.gap < 1e-12));
        assert!(w.tool.preview().is_some_and(|p| p.folds.is_empty()));
    }
}

#[test]
fn the_same_curve_twice_and_clicks_on_nothing_say_why() {
    let mut w = Walk::on_tiles();
    w.send(Event::Click { hit: None, snap: None, held: Modifiers::NONE });
    assert!(w.refused() && w.notice().contains("16 pixels"));
    w.border(1, Side::VMax, 0.5);
    w.border(1, Side::VMax, 0.3);
    assert!(w.refused() && w.notice().starts_with("This is a piece of side 1 already"));
    w.key(Key::Enter);
    w.border(1, Side::VMax, 0.3);
    assert!(w.refused() && w.counts() == [1, 0, 0, 0]);
    w.key(Key::Tab);
    assert!(w.refused());
    w.key(Key::Digit(7));
    assert!(w.refused() && w.notice() == "A patch has four sides, 1 to 4");
    w.key(Key::Flip);
    assert!(w.refused() && w.notice().starts_with("Side 2 has no curve"));
}

#[test]
fn backspace_walks_back_through_everything() {
    let mut w = Walk::on_tiles();
    w.pick_hole();
    w.key(Key::Enter);
    assert_eq!(w.tool.stage(), Stage::Review);
    w.key(Key::Backspace);
    assert_eq!(w.tool.stage(), Stage::Side(3));
    for left in (0..4).rev() {
        w.key(Key::Backspace);
        assert_eq!(w.counts().iter().sum::<usize>(), left);
        if left > 0 {
            w.key(Key::Backspace);
            assert_eq!(w.tool.stage(), Stage::Side(left - 1), "an empty side goes back to the one before");
        }
    }
    w.key(Key::Backspace);
    assert!(w.refused() && w.notice() == "Nothing to undo yet");
}

#[test]
fn escape_steps_back_and_twice_leaves() {
    let mut w = Walk::on_tiles();
    w.key(Key::Line);
    w.key(Key::Escape);
    assert_eq!(w.tool.mode(), &Mode::Curves);
    w.border(1, Side::VMax, 0.5);
    assert!(w.key(Key::Escape).is_empty() && w.notice().contains("Esc again"));
    w.border(4, Side::UMin, 0.5);
    assert!(w.key(Key::Escape).is_empty(), "something happened in between, so it asks again");
    assert!(matches!(w.key(Key::Escape)[..], [Effect::Leave]));
    assert!(!w.tool.is_active() && w.counts() == [0; 4]);
    w.send(Event::Start);
    assert!(matches!(w.key(Key::Escape)[..], [Effect::Leave]), "nothing picked, nothing to ask");
}

#[test]
fn a_running_heal_can_be_cancelled_and_its_late_answer_is_dropped() {
    let mut w = Walk::on_tiles();
    w.pick_hole();
    w.key(Key::Enter);
    w.key(Key::Enter);
    assert_eq!(w.tool.stage(), Stage::Running);
    w.key(Key::Digit(2));
    assert!(w.refused() && w.tool.stage() == Stage::Running);
    assert!(matches!(w.key(Key::Escape)[..], [Effect::Cancel]));
    assert_eq!((w.tool.stage(), w.counts()), (Stage::Review, [1; 4]));
    w.send(Event::Finished(Err("late".into())));
    assert_eq!(w.tool.stage(), Stage::Review);
    assert!(!w.notice().is_empty());
}

#[test]
fn a_side_of_several_pieces_chains_by_tangency_and_holds_by_its_digit() {
    let mut w = Walk::on_tiles();
    // The outer border y = 0 of three tiles is one straight line.
    w.border(0, Side::VMin, 0.5);
    w.key(Key::Chain);
    assert_eq!(w.counts(), [3, 0, 0, 0], "{}", w.notice());
    let ends = w.tool.line(0).unwrap();
    assert!((ends[0].distance(ends[ends.len() - 1]) - 3.0).abs() < 1e-12);
    w.key(Key::Chain);
    assert!(w.refused());
    // A sharp corner inside a side needs the digit.
    w.key(Key::Digit(1));
    w.border(2, Side::UMax, 0.5);
    assert_eq!(w.counts(), [4, 0, 0, 0]);
    w.key(Key::Enter);
    w.border(5, Side::UMin, 0.5);
    assert_eq!(w.counts(), [4, 1, 0, 0]);
}

#[test]
fn with_known_edges_a_click_takes_the_free_stretch_and_t_stays_on_free_edges() {
    use crate::view::feature_edges::{EdgeOptions, feature_edges};
    let (mut document, _) = tiles();
    // A sheet over the left half of the border y = 0.
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let sheet = Surface::bilinear([corner(0.0, -1.0), corner(0.5, -1.0), corner(0.0, 0.0), corner(0.5, 0.0)]).unwrap();
    document.add("sheet", Shape::Surface(Arc::new(sheet)), None);
    let mut w = Walk::new(document);
    let options = EdgeOptions::new(w.tool.options().joining_tol);
    w.tool.set_edges(Arc::new(feature_edges(&w.document, &options, &Job::new())));
    w.border(0, Side::VMin, 0.9);
    assert!((w.tool.sides()[0].pieces[0].length() - 0.5).abs() < 0.01, "only the free half");
    w.key(Key::Chain);
    // Two more tiles to the right; not back along the sheet, which is shared.
    assert_eq!(w.counts(), [3, 0, 0, 0], "{}", w.notice());
    // A border of the hole ends in sharp corners, and what carries on straight is not free.
    w.key(Key::Enter);
    w.border(1, Side::VMax, 0.5);
    w.key(Key::Chain);
    assert_eq!(w.counts(), [3, 1, 0, 0], "{}", w.notice());
}

#[test]
fn shift_click_splits_and_trims_snap_to_the_curve() {
    let mut w = Walk::on_tiles();
    w.border_with(1, Side::VMax, 0.25, Modifiers::SHIFT);
    assert_eq!(w.counts(), [2, 0, 0, 0]);
    w.key(Key::Backspace);
    assert!((w.tool.sides()[0].pieces[0].length() - 0.25).abs() < 1e-12, "the second part is taken back");
    w.send(Event::Trim { side: 0, piece: 0, end: 1, to: DVec3::new(1.75, 1.4, 0.3) });
    assert!((w.tool.sides()[0].pieces[0].length() - 0.75).abs() < 1e-9);
    w.send(Event::Trim { side: 0, piece: 0, end: 1, to: DVec3::new(0.0, 1.0, 0.0) });
    assert!(w.refused() && (w.tool.sides()[0].pieces[0].length() - 0.75).abs() < 1e-9);
    w.border_with(1, Side::VMax, 0.5, Modifiers::SHIFT);
    assert_eq!(w.counts(), [2, 0, 0, 0], "a picked piece is split where it is");
    // What is left of a border may serve another side.
    w.key(Key::Enter);
    w.border(1, Side::VMax, 0.9);
    assert_eq!(w.counts(), [2, 1, 0, 0]);
    assert!((w.tool.sides()[1].pieces[0].length() - 0.25).abs() < 1e-9);
}

#[test]
fn lines_polylines_and_drawn_curves_are_pieces() {
    let mut w = Walk::on_tiles();
    w.key(Key::Line);
    w.key(Key::Enter);
    assert!(w.refused());
    w.point([1.0, 1.0, 0.0]);
    w.point([1.0, 1.0, 0.0]);
    assert!(w.refused(), "the same point twice");
    w.point([2.0, 1.0, 0.0]);
    assert_eq!((w.counts(), w.tool.mode()), ([1, 0, 0, 0], &Mode::Curves));
    w.key(Key::Enter);
    w.key(Key::Polyline);
    w.point([2.0, 1.0, 0.0]);
    w.key(Key::Enter);
    assert!(w.refused() && w.notice().contains("two points"));
    w.point([2.2, 1.5, 0.0]);
    w.point([9.0, 9.0, 9.0]);
    w.key(Key::Backspace);
    w.point([2.0, 2.0, 0.0]);
    assert!(w.tool.prompt().contains("Enter finish"));
    w.key(Key::Enter);
    assert_eq!(w.counts(), [1, 1, 0, 0]);
    w.key(Key::Enter);
    w.key(Key::Draw);
    w.send(Event::Click { hit: None, snap: None, held: Modifiers::NONE });
    assert!(w.refused() && w.notice().starts_with("No point here"));
    w.point([2.0, 2.0, 0.0]);
    w.point([1.0, 2.0, 0.0]);
    w.key(Key::Enter);
    w.key(Key::Enter);
    w.border(3, Side::UMax, 0.5);
    let spec = w.tool.patch_spec(&w.scene).unwrap();
    assert!(matches!(spec.sides[0][..], [Piece::Line(..)]));
    assert!(matches!(&spec.sides[1][..], [Piece::Polyline(points)] if points.len() == 3));
    assert!(matches!(&spec.sides[2][..], [Piece::Drawn(_)]));
    assert!(w.tool.corners().iter().all(|c| c.gap < 1e-9));
}

#[test]
fn an_open_corner_is_amber_and_can_be_closed_in_every_way() {
    let gap = 0.1;
    for fix in [CornerFix::Average, CornerFix::MoveSide(1), CornerFix::Bridge] {
        let mut w = Walk::new(tiles_with_gap(gap));
        w.pick_hole();
        let open: Vec<usize> = (0..4).filter(|&k| !w.tool.corners()[k].is_settled()).collect();
        assert_eq!(open.len(), 2, "tile 4 misses both its neighbours");
        assert!(w.tool.prompt().contains("Gap 0.1 mm between sides"), "{}", w.tool.prompt());
        w.key(Key::Enter);
        w.key(Key::Enter);
        assert!(w.refused() && w.notice().contains("0.1 mm apart"), "{}", w.notice());
        for _ in 0..open.len() {
            let at = w.tool.corners().iter().position(|c| !c.is_settled()).unwrap();
            assert!(w.tool.corners()[at].fixes().contains(&fix));
            w.send(Event::Fix { corner: at, fix });
        }
        assert!(w.tool.corners().iter().all(Corner::is_settled), "{fix:?}");
        let spec = w.tool.patch_spec(&w.scene).unwrap();
        match fix {
            CornerFix::Average => assert!(spec.joining.tol.is_some_and(|t| t >= gap && t < 1.001 * gap)),
            CornerFix::MoveSide(_) => assert!(spec.joining.moves.len() == 2 && spec.joining.moves[0].side == 1),
            _ => assert!(spec.sides.iter().map(Vec::len).sum::<usize>() == 6),
        }
        w.tool.stage = Stage::Review;
        let effects = w.key(Key::Enter);
        // The kernel takes the same decisions: nothing to project on in the hole, but the loop closes.
        let answer = w.heal(&effects);
        assert!(answer.as_ref().err().is_none_or(|e| !e.contains("do not close")), "{answer:?}");
        // And a replay finds them again.
        let mut again = Walk::new(tiles_with_gap(gap));
        again.send(Event::StartWith(Box::new(spec.clone()), Box::default()));
        assert!(again.tool.corners().iter().all(Corner::is_settled));
        assert_eq!(again.tool.patch_spec(&again.scene).unwrap(), spec);
    }
}

#[test]
fn flipping_a_side_turns_the_preview_over_and_back() {
    let mut w = Walk::on_tiles();
    w.border(1, Side::VMax, 0.5);
    w.key(Key::Enter);
    w.border(6, Side::VMin, 0.5);
    assert!(w.tool.preview().unwrap().folds.is_empty());
    w.key(Key::Flip);
    assert!(!w.tool.preview().unwrap().folds.is_empty());
    assert!(w.tool.prompt().contains("Preview folds"), "{}", w.tool.prompt());
    w.key(Key::Preview);
    assert!(w.tool.preview().is_none());
    w.key(Key::Preview);
    w.key(Key::Flip);
    assert!(w.tool.preview().unwrap().folds.is_empty());
}

#[test]
fn of_two_loops_that_fit_tab_takes_the_other_and_the_specification_says_so() {
    let mut document = Document::new(Unit::Millimetre);
    for [a, b] in
        [[(0.0, 0.0), (2.0, 0.0)], [(2.2, 0.0), (2.2, 1.0)], [(2.0, 1.0), (0.0, 1.0)], [(-0.5, 0.5), (0.5, 0.5)]]
    {
        let p = |(x, y): (f64, f64)| DVec3::new(x, y, 0.0);
        document.add("c", Shape::Curve(Arc::new(Curve::segment(p(a), p(b)).unwrap())), None);
    }
    let mut w = Walk::new(document);
    for k in 0..4 {
        w.free_curve(k, 0.5);
    }
    assert!(w.tool.is_ambiguous() && w.tool.prompt().contains("Two loops fit, Tab switches"));
    let first = w.tool.order().cloned();
    assert!(w.tool.patch_spec(&w.scene).unwrap().joining.arrangement.is_none());
    w.key(Key::Tab);
    assert_ne!(w.tool.order().cloned(), first);
    let spec = w.tool.patch_spec(&w.scene).unwrap();
    let arrangement = spec.joining.arrangement.unwrap();
    assert_eq!(arrangement.reversed.to_vec(), w.tool.order().unwrap().reversed);
    let other = w.tool.order().cloned();
    w.send(Event::StartWith(Box::new(spec), Box::default()));
    assert_eq!(w.tool.order().cloned(), other, "a replay takes the same loop");
    w.key(Key::Tab);
    assert_eq!(w.tool.order().cloned(), first);
}

#[test]
fn adjusting_goes_back_to_a_side_and_discarding_keeps_the_sides() {
    let mut w = Walk::on_tiles();
    w.pick_hole();
    w.key(Key::Enter);
    w.key(Key::Enter);
    let surface = Arc::new(Surface::bilinear([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE]).unwrap());
    let (spec, settings, report) = Default::default();
    let patch = crate::model::document::Patch { surface, spec, settings, report };
    w.send(Event::Finished(Ok(Arc::new(patch.clone()))));
    assert!(w.tool.result().is_some() && w.tool.prompt().contains("tolerance not reached"));
    w.key(Key::Escape);
    assert!(w.tool.result().is_none() && w.tool.stage() == Stage::Review && w.counts() == [1; 4]);
    w.key(Key::Enter);
    w.send(Event::Finished(Ok(Arc::new(patch))));
    w.key(Key::Digit(2));
    assert_eq!(w.tool.stage(), Stage::Side(1));
    assert!(w.notice().contains("until Enter"));
    w.key(Key::Backspace);
    assert_eq!(w.counts(), [1, 0, 1, 1]);
}

#[test]
fn a_crossing_on_a_part_that_was_cut_off_does_not_bring_it_back() {
    let mut document = Document::new(Unit::Millimetre);
    let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    // The first curve crosses the second at x = 2 and the third at x = -5; clicked at 5, only 2..10 is meant.
    for [a, b] in [[p(-10.0, 0.0), p(10.0, 0.0)], [p(2.0, -3.0), p(2.0, 3.0)], [p(-5.0, -3.0), p(-5.0, 3.0)]] {
        document.add("curve", Shape::Curve(Arc::new(Curve::segment(a, b).unwrap())), None);
    }
    let mut w = Walk::new(document);
    for (k, f) in [(0, 0.75), (1, 0.9), (2, 0.9)] {
        w.free_curve(k, f);
        w.key(Key::Enter);
    }
    w.key(Key::Trim);
    let ends = w.tool.sides()[0].pieces[0].ends();
    assert!(ends.iter().any(|e| e.distance(p(2.0, 0.0)) < 1e-9), "{ends:?}");
    assert!(ends.iter().any(|e| e.distance(p(10.0, 0.0)) < 1e-9), "{ends:?}");
}

#[test]
fn what_a_cancelled_heal_had_can_be_kept_until_something_changes() {
    let mut w = Walk::on_tiles();
    w.pick_hole();
    w.key(Key::Enter);
    let effects = w.key(Key::Enter);
    let mut patch = (*w.heal(&effects).unwrap()).clone();
    patch.report.incomplete = true;
    let patch = Arc::new(patch);
    assert!(matches!(w.key(Key::Escape)[..], [Effect::Cancel]));
    assert_eq!(w.tool.stage(), Stage::Review, "acknowledged at once");
    w.key(Key::Keep);
    assert!(w.refused(), "not there yet");
    w.send(Event::Cancelled(Some(Arc::clone(&patch))));
    assert!(w.notice().contains("K keeps") && w.tool.prompt().contains("K keep"), "{}", w.tool.prompt());
    w.key(Key::Keep);
    assert!(w.tool.prompt().contains("in part"), "{}", w.tool.prompt());
    let accepted = w.key(Key::Enter);
    assert!(matches!(&accepted[..], [Effect::Accept { patch, .. }] if patch.report.incomplete));
    // Another wish makes it stale.
    w.pick_hole();
    w.key(Key::Enter);
    w.key(Key::Enter);
    w.key(Key::Escape);
    w.send(Event::Cancelled(Some(patch)));
    let options = Options { tol: 7.0, ..w.tool.options().clone() };
    w.send(Event::Options(Box::new(options)));
    assert!(w.tool.partial().is_none());
    w.key(Key::Keep);
    assert!(w.refused());
}

#[test]
fn a_closed_curve_says_that_it_has_no_corners() {
    let mut document = Document::new(Unit::Millimetre);
    let ring: Vec<DVec3> = (0..=32)
        .map(|k| f64::from(k % 32) / 32.0 * std::f64::consts::TAU)
        .map(|a| DVec3::new(a.cos(), a.sin(), 0.0))
        .collect();
    document.add("ring", Shape::Curve(Arc::new(Curve::polyline(&ring).unwrap())), None);
    let mut w = Walk::new(document);
    w.free_curve(0, 0.3);
    assert!(w.notice().contains("closes on itself"), "{}", w.notice());
    assert!(w.notice().contains("Shift+click"));
}

#[test]
fn every_prompt_names_tool_task_and_keys() {
    let mut w = Walk::on_tiles();
    let mut seen = Vec::new();
    let mut keep = |w: &Walk| seen.push(w.tool.prompt());
    keep(&w);
    for key in [Key::Line, Key::Polyline, Key::Draw, Key::Escape] {
        w.key(key);
        keep(&w);
    }
    w.surface(0, DVec2::new(0.5, 0.5));
    keep(&w);
    w.key(Key::Enter);
    keep(&w);
    w.key(Key::Backspace);
    w.pick_hole();
    keep(&w);
    w.key(Key::Enter);
    keep(&w);
    w.key(Key::Enter);
    keep(&w);
    for prompt in seen {
        assert!(prompt.starts_with("Patch · ") && prompt.matches(" · ").count() >= 2, "{prompt}");
        assert!(prompt.contains("Esc "), "{prompt}");
        assert!(!prompt.contains('\u{2014}') && !prompt.ends_with('.'), "{prompt}");
    }
}

#[test]
fn a_side_that_no_longer_crosses_its_neighbours_is_not_offered_a_trim() {
    let mut w = Walk::on_tiles();
    let with_fourth_at = |w: &mut Walk, x: f64| {
        let line = |a: (f64, f64), b: (f64, f64)| vec![Piece::Line((a.0, a.1, 0.0), (b.0, b.1, 0.0))];
        let sides = [
            line((0.2, 0.5), (2.8, 0.5)),
            line((0.5, 0.2), (0.5, 2.8)),
            line((0.2, 2.5), (2.8, 2.5)),
            line((x, 0.2), (x, 2.8)),
        ];
        w.send(Event::StartWith(Box::new(PatchSpec { sides, ..PatchSpec::default() }), Box::default()));
    };
    with_fourth_at(&mut w, 2.5);
    assert!(w.tool.corners().iter().all(|c| c.crossing.is_some()), "{:?}", w.tool.corners());
    with_fourth_at(&mut w, 9.0);
    let of_fourth = w.tool.corners().iter().filter(|c| c.sides.contains(&3)).collect::<Vec<_>>();
    assert!(!of_fourth.is_empty() && of_fourth.iter().all(|c| c.crossing.is_none()), "{of_fourth:?}");
}
