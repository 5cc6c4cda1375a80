//! The whole job in the window, driven by simulated mouse and keys: open, pick four sides, heal, judge, accept, undo,
//! redo, save. Picking is done on the CPU, so all of it runs without a graphics adapter; the test that looks at pictures
//! reports itself as skipped without one, and `PATCHWRIGHT_REQUIRE_GPU=1` makes that a failure.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::path::Path;
use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use patchwright::render::Gpu;
use patchwright::ui::{Action, Numpad, Options, Page, Tool};
use patchwright::view::patch_tool::Event as PatchEvent;
use window::*;

/// Four borders of one panel, healed and accepted.
fn heal_left_panel(window: &mut Window) {
    key(window, Modifiers::NONE, Key::P);
    assert_eq!(prompt(window), "Patch · Pick side 1 of 4");
    for curve in ["border u min", "border v min", "border u max", "border v max"] {
        pick(window, "left panel", curve);
    }
    picture(window, "editor_picked");
    key(window, Modifiers::NONE, Key::Enter);
    assert!(prompt(window).starts_with("Patch · Four sides"), "{}", prompt(window));
    key(window, Modifiers::NONE, Key::Enter);
    assert!(prompt(window).contains("Healed"), "{}", prompt(window));
    picture(window, "editor_result");
}

fn patches(window: &Window) -> usize {
    window.state().editor.document().patches().count()
}

#[test]
fn the_whole_job_by_mouse() {
    let mut window = opened("surfaces_with_gap.igs");
    assert_eq!(window.state().editor.document().surfaces().count(), 2);
    heal_left_panel(&mut window);
    assert_eq!(patches(&window), 0, "nothing is added before it is accepted");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(patches(&window), 1);
    let report = window.state().editor.document().patches().next().unwrap().1.report.clone();
    // The patch lies over an original that is there: nothing of it may be invented.
    assert!(report.reached && report.artificial == 0, "{report:?}");

    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(patches(&window), 0);
    assert!(!window.state().editor.history.is_dirty());
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(patches(&window), 1);
    assert!(window.state().editor.history.is_dirty());

    let folder = tempfile::tempdir().unwrap();
    for name in ["healed.patchwright.ron", "healed.igs"] {
        let path = folder.path().join(name);
        key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
        key(&mut window, Modifiers::COMMAND, Key::A);
        window.event(Event::Text(path.display().to_string()));
        window.step();
        key(&mut window, Modifiers::NONE, Key::Enter);
        assert!(!window.state().editor.history.is_dirty(), "{name}");
        let back = patchwright::io::open(&path).unwrap().document;
        assert_eq!(back.patches().count() + back.surfaces().count(), 3, "{name}");
    }
}

#[test]
fn discarding_and_leaving_change_nothing() {
    let mut window = opened("surfaces_with_gap.igs");
    heal_left_panel(&mut window);
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "the sides are kept: {}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(prompt(&window).starts_with("Patch"), "one Esc only warns: {}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(prompt(&window).starts_with("Select"), "{}", prompt(&window));
    assert_eq!(patches(&window), 0);
    assert!(!window.state().editor.history.is_dirty());
}

/// Types a path into the save dialog and saves there.
fn save_as(window: &mut Window, path: &Path) {
    key(window, Modifiers::COMMAND, Key::A);
    window.event(Event::Text(path.display().to_string()));
    window.step();
    key(window, Modifiers::NONE, Key::Enter);
    settle(window);
    assert!(path.exists(), "{}", path.display());
}

#[test]
fn the_saved_specification_heals_the_same_bits_from_the_command_line() {
    let mut window = opened("surfaces_with_gap.igs");
    key(&mut window, Modifiers::NONE, Key::P);
    // Options that are not the defaults must come along.
    let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
    let mut options = session.tool.options().clone();
    (options.tol, options.neighbours, options.min_resolution) = (0.3 * options.tol, 6, 6);
    window.state_mut().editor.patch_event(PatchEvent::Options(Box::new(options)));
    for curve in ["border u min", "border v min", "border u max", "border v max"] {
        pick(&mut window, "left panel", curve);
    }
    for _ in 0..3 {
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    assert_eq!(patches(&window), 1, "{}", prompt(&window));
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let ctx = window.ctx.clone();
    window.state_mut().editor.perform(&ctx, Action::SaveSpec);
    settle(&mut window);
    save_as(&mut window, &path("session.ron"));
    let text = std::fs::read_to_string(path("session.ron")).unwrap();
    assert!(text.contains("neighbours: 6") && text.contains("min_resolution: 6"), "{text}");

    let out = std::process::Command::new(env!("CARGO_BIN_EXE_patchwright"))
        .arg("heal")
        .arg(asset("surfaces_with_gap.igs"))
        .arg("--patches")
        .arg(path("session.ron"))
        .arg("--out")
        .arg(path("again.patchwright.ron"))
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let again = patchwright::io::open(&path("again.patchwright.ron")).unwrap().document;
    let bits = |document: &patchwright::model::document::Document| -> Vec<u64> {
        let (_, patch) = document.patches().next().unwrap();
        patch.surface.points().iter().flat_map(|p| p.to_array().map(f64::to_bits)).collect()
    };
    assert_eq!(bits(&again), bits(window.state().editor.document()));
}

#[test]
fn an_accepted_patch_is_adjusted_in_its_place() {
    let mut window = opened("surfaces_with_gap.igs");
    heal_left_panel(&mut window);
    key(&mut window, Modifiers::NONE, Key::Enter);
    key(&mut window, Modifiers::NONE, Key::Escape);
    let before = window.state().editor.document().patches().next().map(|(id, p)| (id, p.clone())).unwrap();
    window.state_mut().editor.selection.set([before.0]);
    key(&mut window, Modifiers::NONE, Key::E);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
    let mut options = session.tool.options().clone();
    assert_eq!(options.settings().with_patches(Vec::new()).tol, before.1.settings.tol);
    options.min_resolution = 12;
    window.state_mut().editor.patch_event(PatchEvent::Options(Box::new(options)));
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::Enter);
    key(&mut window, Modifiers::NONE, Key::Enter);
    let after: Vec<_> = window.state().editor.document().patches().map(|(id, p)| (id, p.clone())).collect();
    assert_eq!(after.len(), 1, "{}", prompt(&window));
    assert_eq!(after[0].0, before.0);
    assert_ne!(after[0].1.report.resolution, before.1.report.resolution);
    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::COMMAND, Key::Z);
    let (_, undone) = window.state().editor.document().patches().next().unwrap();
    assert!(std::sync::Arc::ptr_eq(undone, &before.1));
}

#[test]
fn a_heal_that_is_cancelled_offers_what_it_had() {
    let mut window = opened("oscillating_surfaces.igs");
    key(&mut window, Modifiers::NONE, Key::P);
    let example = patchwright::model::examples::all().into_iter().find(|e| e.name == "oscillating_surfaces").unwrap();
    // So fine that it takes its time.
    let mut settings = example.spec.settings();
    (settings.tol, settings.max_resolution) = (Some(1e-13), 1024);
    let patch = example.spec.patches[0].clone();
    window.state_mut().editor.patch_event(PatchEvent::StartWith(Box::new(patch), Box::new(settings)));
    settle(&mut window);
    window.event(Event::Key {
        key: Key::Enter,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    });
    window.step();
    // Until the first resolutions are done.
    let start = Instant::now();
    let healing = |window: &Window| {
        let active = window.state().editor.jobs.active();
        active.iter().find(|j| j.name.starts_with("Heal")).map(|j| j.job.current_phase())
    };
    let deep = |phase: Option<String>| {
        phase.and_then(|p| p.strip_prefix("Resolution ")?.parse::<usize>().ok()).is_some_and(|n| n >= 32)
    };
    while !deep(healing(&window)) {
        window.step();
        assert!(start.elapsed() < Duration::from_secs(60), "{}", prompt(&window));
    }
    let asked = Instant::now();
    window.event(Event::Key {
        key: Key::Escape,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    });
    window.step();
    assert!(prompt(&window).starts_with("Patch · Four sides"), "acknowledged in the same frame: {}", prompt(&window));
    let acknowledged = asked.elapsed();
    while healing(&window).is_some() {
        window.step();
    }
    eprintln!("cancel: shown after {acknowledged:.1?}, ended after {:.1?}", asked.elapsed());
    settle(&mut window);
    assert!(window.query_by_label("Keep partial").is_some());
    picture(&mut window, "editor_partial");
    window.get_by_label("Keep partial").click();
    settle(&mut window);
    assert!(prompt(&window).contains("in part"), "{}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Enter);
    let (_, patch) = window.state().editor.document().patches().next().unwrap();
    assert!(patch.report.incomplete && !patch.report.history.is_empty());
    window.state_mut().editor.show_page(Page::Patches);
    settle(&mut window);
    assert!(window.query_by_label_contains("(incomplete)").is_some());
}

#[test]
fn the_numeric_pad_turns_the_view_and_plain_digits_go_to_the_tool() {
    let pad = Numpad::default();
    let options = Options { files: vec![asset("surfaces_with_gap.igs")], numpad: pad.clone(), ..Options::default() };
    let mut window = window(builder(), options);
    let press = |window: &mut Window, digit: Key, modifiers: Modifiers, on_pad: bool| {
        for pressed in [true, false] {
            pad.note(digit, pressed, on_pad);
            window.event(Event::Key { key: digit, physical_key: Some(digit), pressed, repeat: false, modifiers });
        }
        settle(window);
    };
    let forward = |window: &Window| window.state().editor.viewport.camera.forward();
    let start = forward(&window);
    for digit in [Key::Num1, Key::Num3, Key::Num5, Key::Num7] {
        press(&mut window, digit, Modifiers::NONE, false);
    }
    assert_eq!(forward(&window), start, "no tool is on, but plain digits are no views");
    for (digit, modifiers, along) in [
        (Key::Num1, Modifiers::NONE, DVec3::Y),
        (Key::Num1, Modifiers::COMMAND, DVec3::NEG_Y),
        (Key::Num3, Modifiers::NONE, DVec3::NEG_X),
        (Key::Num3, Modifiers::COMMAND, DVec3::X),
        (Key::Num7, Modifiers::NONE, DVec3::NEG_Z),
        (Key::Num7, Modifiers::COMMAND, DVec3::Z),
    ] {
        press(&mut window, digit, modifiers, true);
        assert!(forward(&window).distance(along) < 1e-9, "{digit:?} {modifiers:?}: {}", forward(&window));
    }
    let projection = window.state().editor.viewport.camera.projection;
    press(&mut window, Key::Num5, Modifiers::NONE, true);
    assert_ne!(window.state().editor.viewport.camera.projection, projection);
    key(&mut window, Modifiers::NONE, Key::P);
    let before = forward(&window);
    press(&mut window, Key::Num3, Modifiers::NONE, false);
    assert_eq!((forward(&window), prompt(&window).as_str()), (before, "Patch · Pick side 3 of 4"));
    press(&mut window, Key::Num1, Modifiers::NONE, true);
    assert!(forward(&window).distance(DVec3::Y) < 1e-9 && prompt(&window).contains("side 3"));
}

#[test]
fn holding_still_lists_what_is_under_the_cursor_and_the_filter_narrows_it() {
    let mut window = opened("surfaces_with_gap.igs");
    let at = window.state().editor.viewport.rect.center();
    let hold = |window: &mut Window| {
        window.event(Event::PointerMoved(at));
        window.step();
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        window.event(button(true));
        for _ in 0..60 {
            window.step();
        }
        window.event(button(false));
        window.step();
    };
    hold(&mut window);
    assert!(window.state().editor.pick_list.is_some() && window.state().editor.selection.is_empty());
    key(&mut window, Modifiers::NONE, Key::Escape);
    for kind in ["Curves", "Surfaces"] {
        window.get_by_role_and_label(egui::Role::Button, kind).click();
        settle(&mut window);
    }
    click(&mut window, at);
    assert!(window.state().editor.selection.is_empty(), "nothing that may be picked is there");
    window.get_by_role_and_label(egui::Role::Button, "Surfaces").click();
    settle(&mut window);
    click(&mut window, at);
    assert_eq!(window.state().editor.selection.ids().len(), 1);
}

#[test]
fn every_menu_opens_and_every_action_in_it_has_a_name() {
    let mut window = opened("surfaces_with_gap.igs");
    for (menu, item) in [
        ("File", "Save as…"),
        ("Edit", "Settings…"),
        ("View", "Section plane"),
        ("Heal", "New patch"),
        ("Help", "About Patchwright"),
    ] {
        window.get_by_label(menu).click();
        settle(&mut window);
        assert!(window.query_all_by_label_contains(item).next().is_some(), "{item} in {menu}");
        key(&mut window, Modifiers::NONE, Key::Escape);
    }
}

#[test]
fn the_palette_does_what_is_typed() {
    let mut window = opened("surfaces_with_gap.igs");
    key(&mut window, Modifiers::COMMAND, Key::K);
    window.event(Event::Text("wirefr".to_owned()));
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(window.state().editor.viewport.display.wireframe);
}

#[test]
fn a_click_selects_hiding_hides_and_undo_shows_again() {
    let mut window = opened("surfaces_with_gap.igs");
    window.get_by_label("right panel").click();
    settle(&mut window);
    assert_eq!(window.state().editor.selection.ids().len(), 1);
    let visible = |window: &Window| window.state().editor.document().entities().iter().filter(|e| e.visible).count();
    key(&mut window, Modifiers::NONE, Key::H);
    assert_eq!(visible(&window), 1);
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(visible(&window), 2);
}

#[test]
fn the_uv_view_and_the_3d_view_share_one_cursor() {
    let mut window = opened("surfaces_with_gap.igs");
    window.get_by_label("right panel").click();
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::U);
    assert!(window.state().editor.settings.uv_view);
    let pane = window.get_by_label("uv view of right panel").rect();
    hover(&mut window, pane.center());
    let (entity, surface) = window.state().editor.document().surfaces().nth(1).map(|(e, s)| (e, s.clone())).unwrap();
    let [u, v] = surface.domain();
    let middle = glam::DVec2::new(0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]));
    let linked = window.state().editor.linked.unwrap();
    assert_eq!(linked.entity, entity);
    // The middle of the pane is the middle of the domain.
    assert!(linked.uv.distance(middle) < 1e-3 * (u[1] - u[0] + v[1] - v[0]), "{}", linked.uv);
    picture(&mut window, "uv_from_domain");
    // The same point in the 3D view gives the same parameters back.
    let at = window.state().editor.viewport.project(surface.eval(linked.uv)).unwrap();
    hover(&mut window, at);
    let back = window.state().editor.linked.unwrap();
    assert_eq!(back.entity, entity);
    assert!(back.uv.distance(linked.uv) < 0.02 * (u[1] - u[0] + v[1] - v[0]), "{} {}", back.uv, linked.uv);
    picture(&mut window, "uv_from_space");
    // Over neither view there is no cursor.
    hover(&mut window, pos2(4.0, 4.0));
    assert!(window.state().editor.linked.is_none());
    key(&mut window, Modifiers::NONE, Key::U);
    assert!(window.query_by_label("uv view of right panel").is_none());
}

#[test]
fn inspecting_looks_into_a_hierarchy_in_both_views() {
    let mut window = opened("surfaces_with_gap.igs");
    window.get_by_label("right panel").click();
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::I);
    assert!(prompt(&window).starts_with("Inspect · Level 1"), "{}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Num2);
    assert!(prompt(&window).starts_with("Inspect · Level 2"), "a digit is a level: {}", prompt(&window));
    // The uv view shows the level; a click there pins the node under it, which the panel describes.
    let pane = window.get_by_label_contains("uv view of right panel · level 2").rect();
    hover(&mut window, pane.center() + egui::vec2(31.0, 17.0));
    assert!(window.query_by_label("Swept radius").is_some());
    click(&mut window, pane.center() + egui::vec2(31.0, 17.0));
    hover(&mut window, pos2(4.0, 4.0));
    assert!(window.query_by_label("Pinned node").is_some());
    let linked = window.state().editor.linked;
    assert!(linked.is_none(), "{linked:?}");
    // Tori, boxes, ghosts: everything is drawn without complaint.
    for k in [Key::T, Key::V, Key::V, Key::G, Key::Num3] {
        key(&mut window, Modifiers::NONE, k);
        assert!(prompt(&window).starts_with("Inspect"), "{}", prompt(&window));
    }
    // A second surface: the overlapping nodes.
    window.get_by_label("left panel").click_modifiers(Modifiers::COMMAND);
    settle(&mut window);
    assert_eq!(window.state().editor.selection.ids().len(), 2);
    window.get_by_label("Overlapping pairs only").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("overlapping pairs at level 3").is_some());
    key(&mut window, Modifiers::NONE, Key::Escape);
    if prompt(&window).starts_with("Inspect") {
        key(&mut window, Modifiers::NONE, Key::Escape);
    }
    assert!(prompt(&window).starts_with("Select"), "{}", prompt(&window));
}

#[test]
fn a_file_that_cannot_be_read_is_explained_and_the_model_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.igs");
    std::fs::write(&path, b"\x00\x01\x02 this is no model").unwrap();
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.open(vec![path]);
    settle(&mut window);
    assert!(window.query_by_label_contains("was not opened").is_some());
    assert_eq!(window.state().editor.document().surfaces().count(), 2);
}

/// Opens a model with a journal in a folder, hides a panel, deletes nothing else, and waits until that is put aside.
fn changed_and_autosaved(folder: &Path) -> Window {
    let journal = patchwright::io::autosave::Journal::at(folder);
    let options = Options { files: vec![asset("surfaces_with_gap.igs")], journal: Some(journal), ..Options::default() };
    let mut window = window(builder(), options);
    window.get_by_label("right panel").click();
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::Delete);
    key(&mut window, Modifiers::COMMAND, Key::A);
    key(&mut window, Modifiers::NONE, Key::H);
    let start = Instant::now();
    while !window.state().editor.is_autosaved() {
        settle(&mut window);
        assert!(start.elapsed() < Duration::from_secs(20), "never autosaved");
    }
    window
}

#[test]
fn unsaved_work_is_asked_about_before_quitting() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = changed_and_autosaved(folder.path());
    key(&mut window, Modifiers::COMMAND, Key::Q);
    assert!(window.query_by_label_contains("Save the changes?").is_some());
    // While the session runs nothing is to be recovered.
    assert!(patchwright::io::autosave::Journal::at(folder.path()).recoverable().is_empty());
}

const CRASH: &str = "PATCHWRIGHT_TEST_CRASH_IN";

/// Not a test of its own: the process that [`a_killed_session_is_offered_and_comes_back_as_it_was`] kills.
#[test]
fn a_session_that_will_be_killed() {
    let Some(folder) = std::env::var_os(CRASH) else { return };
    let window = changed_and_autosaved(Path::new(&folder));
    let text = patchwright::io::project::write(window.state().editor.document()).unwrap();
    // What the document was goes to the parent in one step, which is the sign to kill.
    std::fs::write(Path::new(&folder).join("written"), text).unwrap();
    std::fs::rename(Path::new(&folder).join("written"), Path::new(&folder).join("expected")).unwrap();
    std::thread::sleep(Duration::from_secs(60));
}

#[test]
fn a_killed_session_is_offered_and_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "a_session_that_will_be_killed", "--nocapture"])
        .env(CRASH, folder.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let (start, expected) = (Instant::now(), folder.path().join("expected"));
    while !expected.exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "the session never got as far");
        assert!(child.try_wait().unwrap().is_none(), "the session ended by itself");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let expected = std::fs::read_to_string(expected).unwrap();

    let journal = patchwright::io::autosave::Journal::at(folder.path());
    let options =
        || Options { files: vec![asset("part_of_a_patch.igs")], journal: Some(journal.clone()), ..Options::default() };
    let mut after = window(builder(), options());
    assert!(after.query_by_label_contains("surfaces_with_gap").is_some(), "the file of the lost session is named");
    assert!(after.query_by_label_contains("2 changes").is_some(), "and how much was done");
    picture(&mut after, "editor_recovery");
    after.get_by_label("Recover").click();
    settle(&mut after);
    let editor = &after.state().editor;
    assert_eq!(patchwright::io::project::write(editor.document()).unwrap(), expected);
    assert!(editor.history.is_dirty(), "it is in no file of the user's yet");
    let hidden = editor.document().entities().iter().filter(|e| !e.visible).count();
    assert_eq!((editor.document().entities().len(), hidden), (1, 1));
    // Until it is saved, it stays safe: killed again, it is offered again.
    let start = Instant::now();
    while !after.state().editor.is_autosaved() {
        settle(&mut after);
        assert!(start.elapsed() < Duration::from_secs(20), "never autosaved");
    }
}

#[test]
fn pictures_of_the_window() {
    if let Err(error) = Gpu::headless() {
        let required = std::env::var_os("PATCHWRIGHT_REQUIRE_GPU").is_some_and(|v| v == "1");
        assert!(!required, "pictures_of_the_window: {error}");
        eprintln!("skipped: no Vulkan adapter: pictures_of_the_window");
        return;
    }
    let options = Options { files: vec![asset("surfaces_with_gap.igs")], ..Options::default() };
    let mut window = window(builder().wgpu(), options);
    let empty = window.render().unwrap();
    let rect = window.state().editor.viewport.rect;
    // The model is in the middle of the view and differs from the backdrop beside it.
    let at = |x: f32, y: f32| empty.get_pixel(x as u32, y as u32).0;
    let center = rect.center();
    let backdrop = at(rect.left() + 6.0, center.y);
    let row = (0..200).filter(|k| at(center.x - 100.0 + *k as f32, center.y) != backdrop).count();
    assert!(row > 50, "only {row} of 200 pixels in the middle show something");
    picture(&mut window, "editor_open");
    heal_left_panel(&mut window);
    let healed = window.render().unwrap();
    let changed = empty.pixels().zip(healed.pixels()).filter(|(a, b)| a != b).count();
    assert!(changed > 10_000, "the deviation map shows: {changed} pixels changed");
}

/// The middle of a border, in the window.
fn border_at(window: &Window, surface: usize, side: patchwright::kernel::geom::Side, f: f64) -> (Pos2, DVec3) {
    let viewport = &window.state().editor.viewport;
    let item = &viewport.scene.items()[surface];
    let curve = item.geometry.surface().unwrap().border(side).unwrap();
    let [start, end] = curve.domain();
    let p = curve.eval(start + f * (end - start));
    (viewport.project(p).unwrap(), p)
}

#[test]
fn measuring_two_borders_gives_the_gap_that_dense_sampling_gives() {
    use patchwright::kernel::geom::Side;
    let mut window = opened("surfaces_with_gap.igs");
    key(&mut window, Modifiers::NONE, Key::M);
    assert_eq!(prompt(&window), "Measure · Click the first point, curve or surface");
    // The two borders that should be one: found as the nearest pair.
    let curves: Vec<_> = {
        let items = window.state().editor.viewport.scene.items();
        let border = |k: usize, side| items[k].geometry.surface().unwrap().border(side).unwrap();
        let all = [Side::UMin, Side::UMax, Side::VMin, Side::VMax];
        let pairs = all.into_iter().flat_map(|a| all.into_iter().map(move |b| (a, b)));
        let middle = |c: &patchwright::kernel::geom::Curve| c.eval(0.5 * (c.domain()[0] + c.domain()[1]));
        let apart = |&(a, b): &(Side, Side)| middle(&border(0, a)).distance(middle(&border(1, b)));
        let (a, b) = pairs.min_by(|x, y| apart(x).total_cmp(&apart(y))).unwrap();
        vec![(0, a, border(0, a)), (1, b, border(1, b))]
    };
    for (k, (surface, side, _)) in curves.iter().enumerate() {
        let (at, _) = border_at(&window, *surface, *side, if k == 0 { 0.37 } else { 0.61 });
        click(&mut window, at);
    }
    let Tool::Measure(session) = &window.state().editor.tool else { panic!() };
    let found = session.found().unwrap().clone();
    let [least, largest] = found.gap.expect("two curves were clicked").map(|s| s.length());
    let sampled = |a: &patchwright::kernel::geom::Curve, b: &patchwright::kernel::geom::Curve| {
        let at = |c: &patchwright::kernel::geom::Curve, k: usize| {
            let [start, end] = c.domain();
            c.eval(start + (end - start) * k as f64 / 400.0)
        };
        (0..=400)
            .map(|i| (0..=400).map(|j| at(a, i).distance(at(b, j))).fold(f64::INFINITY, f64::min))
            .collect::<Vec<_>>()
    };
    let all: Vec<f64> =
        sampled(&curves[0].2, &curves[1].2).into_iter().chain(sampled(&curves[1].2, &curves[0].2)).collect();
    let (low, high) = all.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), d| (l.min(*d), h.max(*d)));
    let step = 2e-2 * high;
    assert!(least <= low + 1e-12 && least >= low - step, "{least} against {low}");
    assert!((largest - high).abs() <= step, "{largest} against {high}");
    picture(&mut window, "editor_measured");
    // Backspace takes the second place back, Esc the first, Esc again the tool.
    key(&mut window, Modifiers::NONE, Key::Backspace);
    assert_eq!(prompt(&window), "Measure · Click the second point, curve or surface");
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert_eq!(prompt(&window), "Measure · Click the first point, curve or surface");
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert!(prompt(&window).starts_with("Select"), "{}", prompt(&window));
}
