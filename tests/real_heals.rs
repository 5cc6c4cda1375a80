//! Regions of real models healed in the window by simulated mouse and keys, from the picks to the file: what was broken
//! is picked, healed, accepted, saved, and read by another program. Skipped by name where the shared data is missing.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/mesher.rs"]
mod mesher;
#[path = "support/window.rs"]
mod window;

use std::path::Path;

use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::DVec2;
use patchwright::ui::{Action, Options, Tool};
use window::*;

fn patches(window: &Window) -> usize {
    window.state().editor.document().patches().count()
}

/// Writes the patches as STEP by the export dialog; a mesher must take them as this many faces, edges and free edges.
fn exported(window: &mut Window, faces: usize, edges: usize, free: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("patches.step");
    key(window, Modifiers::COMMAND, Key::E);
    export_to(window, &path);
    mesher::conforms(&path, faces, edges, free);
}

/// Clicks the eye beside an entity.
fn toggle_eye(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    settle(window);
}

#[test]
fn a_leaf_of_a_real_model_is_healed_up_to_the_stem_it_runs_into() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/models/pocc_surf114.igs");
    if !model.exists() {
        println!("skipped: no shared data");
        return;
    }
    let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
    // Where the leaf enters the stem, kept as a curve. The stem's seam is crossed on the way.
    for label in ["Hide Surface 2", "Hide Surface 3"] {
        toggle_eye(&mut window, label);
    }
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::X);
    key(&mut window, Modifiers::NONE, Key::K);
    assert_eq!(window.state().editor.document().curves().count(), 1);
    key(&mut window, Modifiers::NONE, Key::Escape);
    key(&mut window, Modifiers::NONE, Key::Escape);
    toggle_eye(&mut window, "Hide Surface 1");
    // From nearby: the whole leaf is thirty times larger than the curve.
    let name = "intersection 1 of Surface 0 and Surface 1";
    let (id, _) = window.state().editor.document().curves().next().unwrap();
    window.state_mut().editor.selection.set([id]);
    key(&mut window, Modifiers::NONE, Key::F);
    key(&mut window, Modifiers::NONE, Key::P);
    pick(&mut window, name, "curve");
    key(&mut window, Modifiers::NONE, Key::Enter);
    key(&mut window, Modifiers::NONE, Key::Home);
    for curve in ["border v min", "iso u 5.00", "border v max"] {
        pick(&mut window, "Surface 0", curve);
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    picture(&mut window, "editor_leaf_picked");
    // The borders were clicked beyond the iso-curve; the only loop that closes is the one by the stem.
    key(&mut window, Modifiers::NONE, Key::C);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Enter);
    picture(&mut window, "editor_leaf_healed");
    let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
    let report = session.tool.result().map(|p| p.report.clone()).unwrap_or_else(|| panic!("{}", prompt(&window)));
    println!("leaf: {:.2e} on {} samples, {} artificial", report.max_error, report.projected, report.artificial);
    assert!(report.reached && report.artificial == 0, "{report:?}");
    key(&mut window, Modifiers::NONE, Key::Enter);
    for _ in 0..2 {
        key(&mut window, Modifiers::NONE, Key::Escape);
    }
    exported(&mut window, 1, 4, 4);
}

/// Clicks a surface where it has these parameters and takes the iso-curve with u (else v) fixed.
fn pick_iso(window: &mut Window, entity: usize, uv: [f64; 2], fixed_u: bool) {
    let viewport = &window.state().editor.viewport;
    let item = viewport.scene.surface(entity).unwrap();
    let at = viewport.project(item.geometry.surface().unwrap().eval(uv.into())).unwrap();
    click(window, at);
    let wanted = if fixed_u { "iso-curve along v" } else { "iso-curve along u" };
    if !prompt(window).contains(wanted) {
        key(window, Modifiers::NONE, Key::Tab);
    }
    assert!(prompt(window).contains(wanted), "{}", prompt(window));
    key(window, Modifiers::NONE, Key::Enter);
}

#[test]
fn a_region_of_an_airliner_is_healed_by_mouse_and_exported_for_a_mesher() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/models/afem_777.stp");
    if !model.exists() {
        println!("skipped: no shared data");
        return;
    }
    let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
    // The lower fuselage, where the wing and the gear pod run through it, alone and from below.
    let fuselage = window.state().editor.viewport.scene.surface(3).unwrap().id();
    window.state_mut().editor.selection.set([fuselage]);
    key(&mut window, Modifiers::SHIFT, Key::H);
    let ctx = window.ctx.clone();
    window.state_mut().editor.perform(&ctx, Action::Bottom);
    settle(&mut window);
    key(&mut window, Modifiers::NONE, Key::F);
    // Nearer, by the wheel: iso-lines at knots are within the pick radius otherwise.
    let viewport = &window.state().editor.viewport;
    let surface = viewport.scene.surface(3).unwrap().geometry.surface().unwrap().clone();
    let at = viewport.project(surface.eval(DVec2::new(1.25, 0.5))).unwrap();
    window.event(Event::PointerMoved(at));
    settle(&mut window);
    for _ in 0..8 {
        let (unit, delta) = (egui::MouseWheelUnit::Line, egui::vec2(0.0, 1.0));
        let (phase, modifiers) = (egui::TouchPhase::Move, Modifiers::NONE);
        let source = egui::MouseWheelSource::Wheel;
        window.event(Event::MouseWheel { unit, delta, phase, modifiers, source });
        settle(&mut window);
    }
    key(&mut window, Modifiers::NONE, Key::P);
    for (uv, fixed_u) in [([1.15, 0.37], true), ([1.25, 0.3], false), ([1.35, 0.37], true), ([1.25, 0.64], false)] {
        pick_iso(&mut window, 3, uv, fixed_u);
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    key(&mut window, Modifiers::NONE, Key::C);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    key(&mut window, Modifiers::NONE, Key::Enter);
    let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
    let report = session.tool.result().map(|p| p.report.clone()).unwrap_or_else(|| panic!("{}", prompt(&window)));
    println!("fuselage: {:.2e} ft on {} samples, {} artificial", report.max_error, report.projected, report.artificial);
    assert!(report.reached, "{report:?}");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(patches(&window), 1);

    // The neighbour behind it, with the side between them shared.
    let at = window.state().editor.viewport.project(surface.eval(DVec2::new(1.35, 0.47))).unwrap();
    click(&mut window, at);
    key(&mut window, Modifiers::NONE, Key::Enter);
    for (uv, fixed_u) in [([1.38, 0.3], false), ([1.42, 0.38], true), ([1.38, 0.64], false)] {
        pick_iso(&mut window, 3, uv, fixed_u);
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    key(&mut window, Modifiers::NONE, Key::C);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    for _ in 0..2 {
        key(&mut window, Modifiers::NONE, Key::Enter);
    }
    assert_eq!(patches(&window), 2, "{}", prompt(&window));
    for _ in 0..2 {
        key(&mut window, Modifiers::NONE, Key::Escape);
    }

    exported(&mut window, 2, 7, 6);
}
