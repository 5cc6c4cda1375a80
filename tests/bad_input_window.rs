//! What a user sees in the window when the input is bad: a message that says what, where and what to do; the model as it
//! was.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/bad_bodies.rs"]
mod bad_bodies;
#[path = "support/window.rs"]
mod window;

use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use patchwright::model::spec::{HealSpec, PatchSpec, Piece};
use patchwright::ui::{Action, Options, Page, Tool};
use patchwright::view::patch_tool::Event as PatchEvent;
use window::*;

type Point = (f64, f64, f64);

fn line(a: Point, b: Point) -> Vec<Piece> {
    vec![Piece::Line(a, b)]
}

/// Fills in four sides, asks for the patch, and returns what the window says.
fn answer(sides: [Vec<Piece>; 4]) -> String {
    let mut window = opened("part_of_a_patch.igs");
    key(&mut window, Modifiers::NONE, Key::P);
    let spec = PatchSpec { name: "patch".into(), sides, ..PatchSpec::default() };
    window.state_mut().editor.patch_event(PatchEvent::StartWith(Box::new(spec), Box::<HealSpec>::default()));
    settle(&mut window);
    for _ in 0..2 {
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    let Tool::Patch(session) = &window.state().editor.tool else { panic!("the tool was left") };
    let text = session.tool.notice().map(|n| n.text.clone()).unwrap_or_default();
    assert!(
        window.query_by_label_contains(&text).is_some() && !text.is_empty(),
        "nothing is said: {}",
        prompt(&window)
    );
    assert_eq!(session.tool.sides().iter().filter(|s| !s.pieces.is_empty()).count(), 4, "the picks are kept");
    assert_eq!(window.state().editor.document().patches().count(), 0);
    assert!(!window.state().editor.history.is_dirty());
    eprintln!("{text}");
    text
}

#[test]
fn four_sides_that_are_no_border_are_named() {
    let [a, b, c, d] = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)];
    let open = answer([line(a, b), line(b, c), line(c, d), line(d, (0.0, 0.5, 0.0))]);
    assert!(open.contains("apart") && open.contains("joining tolerance"), "{open}");
    let same = answer([line(a, b), line(b, a), line(a, b), line(b, a)]);
    assert!(same.contains("coincide") || same.contains("same"), "{same}");
    let crossing = answer([line(a, b), line(b, d), line(d, c), line(c, a)]);
    assert!(crossing.contains("cross"), "{crossing}");
    let point = answer([line(a, b), line(b, (1.0, 1e-7, 0.0)), line(b, c), line(c, a)]);
    assert!(point.contains("length"), "{point}");
}

#[test]
fn a_patch_over_nothing_says_that_nothing_is_there() {
    let at = |x: f64, y: f64| (1000.0 + x, 1000.0 + y, 1000.0);
    let text = answer([
        line(at(0.0, 0.0), at(1.0, 0.0)),
        line(at(1.0, 0.0), at(1.0, 1.0)),
        line(at(1.0, 1.0), at(0.0, 1.0)),
        line(at(0.0, 1.0), at(0.0, 0.0)),
    ]);
    assert!(text.contains("project"), "{text}");
}

#[test]
fn a_file_that_cannot_be_written_is_explained_and_the_work_stays_unsaved() {
    let mut window = opened("surfaces_with_gap.igs");
    key(&mut window, Modifiers::COMMAND, Key::A);
    key(&mut window, Modifiers::NONE, Key::H);
    assert!(window.state().editor.history.is_dirty());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    for path in [folder.path().join("not there").join("model.igs"), file.join("model.igs")] {
        let ctx = window.ctx.clone();
        window.state_mut().editor.perform(&ctx, Action::SaveAs);
        settle(&mut window);
        key(&mut window, Modifiers::COMMAND, Key::A);
        window.event(Event::Text(path.display().to_string()));
        window.step();
        key(&mut window, Modifiers::NONE, Key::Enter);
        settle(&mut window);
        let said = window.query_all_by_label_contains("model.igs").next().is_some();
        assert!(said, "{}", prompt(&window));
        assert!(window.state().editor.history.is_dirty(), "unsaved work stays marked as such");
        assert!(window.state().editor.dialog.is_some());
        key(&mut window, Modifiers::NONE, Key::Escape);
        key(&mut window, Modifiers::NONE, Key::Escape);
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "in the way");
}

#[test]
fn bad_meshes_and_grids_are_shown_and_the_report_says_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    for bad in bad_bodies::bad_bodies() {
        let path = folder.path().join(bad.name);
        std::fs::write(&path, &bad.bytes).unwrap();
        let mut window = window::window(builder(), Options { files: vec![path], ..Options::default() });
        let editor = &mut window.state_mut().editor;
        assert!(editor.dialog.is_none(), "{}", bad.name);
        assert_eq!(editor.viewport.scene.counts().0, bad.triangles, "{}", bad.name);
        // What was left out comes to the front by itself.
        assert_eq!(editor.page == Page::Report, bad.skipped, "{}", bad.name);
        editor.show_page(Page::Report);
        settle(&mut window);
        for reason in bad.said {
            assert!(window.query_by_label_contains(reason).is_some(), "{}: {reason}", bad.name);
        }
        let calm = bad.said.is_empty();
        assert_eq!(window.query_by_label_contains("Everything was read as it stands").is_some(), calm, "{}", bad.name);
    }
}
