//! The whole job in the window, driven by simulated mouse and keys: open, pick four sides, heal, judge, accept, undo,
//! redo, save. Picking is done on the CPU, so all of it runs without a graphics adapter; the test that looks at pictures
//! reports itself as skipped without one, and `PATCHWRIGHT_REQUIRE_GPU=1` makes that a failure.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, HarnessBuilder};
use patchwright::render::Gpu;
use patchwright::ui::{App, Options};

type Window = Harness<'static, App>;

fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(name)
}

fn builder() -> HarnessBuilder<App> {
    Harness::builder().with_size([1400.0, 900.0]).with_max_steps(64)
}

fn window(builder: HarnessBuilder<App>, options: Options) -> Window {
    let mut window = builder.build_eframe(|cc| App::new(cc, options));
    settle(&mut window);
    window
}

fn opened(name: &str) -> Window {
    window(builder(), Options { files: vec![asset(name)], ..Options::default() })
}

/// Steps until nothing is computed or moves any more.
fn settle(window: &mut Window) {
    let start = Instant::now();
    let mut calm = 0;
    while calm < 4 {
        window.step();
        let editor = &window.state().editor;
        let busy = !editor.jobs.active().is_empty() || editor.viewport.is_moving() || editor.files.is_opening();
        calm = if busy { 0 } else { calm + 1 };
        assert!(start.elapsed() < Duration::from_secs(120), "never calm: {:?}", editor.jobs.active());
        if busy {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn key(window: &mut Window, modifiers: Modifiers, key: Key) {
    for pressed in [true, false] {
        window.event(Event::Key { key, physical_key: None, pressed, repeat: false, modifiers });
    }
    settle(window);
}

fn click(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    window.step();
    for pressed in [true, false] {
        window.event(Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        window.step();
    }
    settle(window);
}

/// Clicks a curve where the editor itself says that it can be picked.
fn pick(window: &mut Window, surface: &str, curve: &str) {
    let hints = window.state().editor.curve_hints(1.0);
    let hint = hints.iter().find(|h| h.name == surface && h.curve == curve);
    let hint = hint.unwrap_or_else(|| panic!("{curve} of {surface} cannot be picked: {hints:?}"));
    click(window, pos2(hint.at[0], hint.at[1]));
}

fn prompt(window: &Window) -> String {
    let (tool, prompt, _) = window.state().editor.prompt();
    format!("{tool} · {prompt}")
}

fn picture(window: &mut Window, name: &str) {
    if let Some(folder) = std::env::var_os("PATCHWRIGHT_PICTURES").filter(|_| window.state().editor.viewport.can_draw())
    {
        window.render().unwrap().save(Path::new(&folder).join(format!("{name}.png"))).unwrap();
    }
}

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

fn hover(window: &mut Window, at: Pos2) {
    window.event(Event::PointerMoved(at));
    window.step();
    settle(window);
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

#[test]
fn unsaved_work_is_asked_about_and_recovered_after_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let journal = patchwright::io::autosave::Journal::at(folder.path());
    let options =
        Options { files: vec![asset("surfaces_with_gap.igs")], journal: Some(journal.clone()), ..Options::default() };
    let mut window = window(builder(), options);
    window.get_by_label("right panel").click();
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::Delete);
    let start = Instant::now();
    while !window.state().editor.is_autosaved() {
        settle(&mut window);
        assert!(start.elapsed() < Duration::from_secs(20), "never autosaved");
    }
    key(&mut window, Modifiers::COMMAND, Key::Q);
    assert!(window.query_by_label_contains("Save the changes?").is_some());
    // While the session runs nothing is to be recovered; a crash is a session that never said goodbye.
    assert!(journal.recoverable().is_empty());
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
