//! The Defects panel in the window: found, stepped through, shown, and mended with a patch whose sides are filled in.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::sync::Arc;

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use patchwright::kernel::geom::Surface;
use patchwright::model::document::{Document, Shape, Unit};
use window::*;

const NONE: Modifiers = Modifiers::NONE;

/// Two unit squares with a gap of 8e-4 between them, and a third that stands through the first.
fn broken() -> Document {
    let mut document = Document::new(Unit::Metre);
    let mut add = |name: &str, o: DVec3, u: DVec3, v: DVec3| {
        let surface = Surface::bilinear([o, o + u, o + v, o + u + v]).unwrap();
        document.add(name, Shape::Surface(Arc::new(surface)), None);
    };
    add("left", DVec3::ZERO, DVec3::X, DVec3::Y);
    add("right", DVec3::X * 1.0008, DVec3::X, DVec3::Y);
    add("wall", DVec3::new(0.3, 0.2, -0.2), DVec3::Y * 0.5, DVec3::Z * 0.4);
    document
}

#[test]
fn defects_are_found_stepped_through_and_mended() {
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(broken(), None, "broken".to_owned(), true);
    settle(&mut window);
    key(&mut window, Modifiers::COMMAND, Key::D);
    for text in ["Crossing faces (1)", "Gaps (1)"] {
        assert!(window.query_by_label_contains(text).is_some(), "{text} is not listed");
    }
    picture(&mut window, "defects");
    // F8 goes to the first, and the camera with it.
    let before = window.state().editor.viewport.camera;
    key(&mut window, NONE, Key::F8);
    let after = window.state().editor.viewport.camera;
    assert!(after.distance < before.distance, "{} {}", after.distance, before.distance);
    let chosen = |window: &Window| window.state().editor.defects.current().cloned().unwrap();
    let first = chosen(&window);
    assert!(window.state().editor.selection.ids().iter().all(|id| first.entities.contains(id)));
    // On to the gap.
    let mut steps = 0;
    while chosen(&window).kind != patchwright::model::defects::DefectKind::Gap {
        key(&mut window, NONE, Key::F8);
        steps += 1;
        assert!(steps < 20, "the gap is not among them");
    }
    let gap = chosen(&window);
    assert!((gap.size - 8e-4).abs() < 1e-9, "{}", gap.size);
    window.get_by_label("Fix with patch").click();
    settle(&mut window);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    for _ in 0..2 {
        key(&mut window, NONE, Key::Enter);
    }
    let document = window.state().editor.document();
    let (_, patch) = document.patches().next().unwrap_or_else(|| panic!("{}", prompt(&window)));
    let bounds = patch.surface.bounds();
    let size = bounds.max - bounds.min;
    // HJR99 section 3.8: one patch over both and the gap between them.
    assert!((size - DVec3::new(2.0008, 1.0, 0.0)).length() < 1e-9, "{size}");
    assert!(patch.report.reached && patch.report.projected > patch.report.artificial, "{:?}", patch.report);
}
