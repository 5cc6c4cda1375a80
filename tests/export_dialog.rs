//! The export dialog in the window: what it says before it writes, and what it writes.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::sync::Arc;

use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use patchwright::io::{self, SaveOptions};
use patchwright::kernel::geom::Surface;
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::ui::Options;
use window::*;

/// A floor and a roof of 30 degrees that begins 0.0015 above the floor's edge.
fn roof() -> Document {
    let mut document = Document::new(Unit::Millimetre);
    let slope = 30.0_f64.to_radians();
    let (run, rise) = (slope.cos(), slope.sin());
    let floor = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
    let up = |x: f64, s: f64| DVec3::new(x, 1.0 + s * run, 1.5e-3 + s * rise);
    for (name, corners) in [("floor", floor), ("roof", [up(0.0, 0.0), up(1.0, 0.0), up(0.0, 1.0), up(1.0, 1.0)])] {
        document.add(name, Shape::Surface(Arc::new(Surface::bilinear(corners).unwrap())), None);
    }
    document
}

#[test]
fn the_dialog_tells_gap_and_angle_and_writes_what_it_told() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("roof.patchwright.ron");
    io::save(&model, &roof(), &SaveOptions::default()).unwrap();
    let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
    key(&mut window, Modifiers::COMMAND, Key::E);
    for text in ["Largest edge gap", "0.00150 mm", "Largest normal angle", "30.000°"] {
        assert!(window.query_by_label_contains(text).is_some(), "{text} is not said");
    }
    picture(&mut window, "export");

    // As triangles the gap is closed, and the dialog says how large it was.
    window.get_by_label("STL").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("Largest seam gap").is_some());
    assert!(window.query_by_label_contains("closed in the file").is_some());
    let path = folder.path().join("roof.stl");
    window.get_by_label("Path").focus();
    key(&mut window, Modifiers::COMMAND, Key::A);
    window.event(Event::Text(path.display().to_string()));
    window.step();
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(path.exists(), "nothing was written");
    let back = io::open(&path).unwrap().document;
    let (_, facets) = back.meshes().next().unwrap();
    let inner = facets.mesh().defects();
    let loops = facets.mesh().border_loops();
    assert_eq!((loops.len(), inner.non_manifold_edges), (1, 0), "floor and roof are one sheet");
    assert!(window.query_by_label_contains("largest gap between edges that meet").is_some());
}

/// STEP was offered first for every model, and said at once that it cannot hold a mesh.
#[test]
fn what_is_offered_first_can_hold_the_model() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, path) in [
        ("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "sheet-exported.stl"),
        ("grid.fmt", "2 2 1\n0 1 0 1\n0 0 1 1\n4*0.0\n", "grid-exported.xyz"),
    ] {
        let model = folder.path().join(name);
        std::fs::write(&model, text).unwrap();
        let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
        key(&mut window, Modifiers::COMMAND, Key::E);
        settle(&mut window);
        assert!(window.query_by_label_contains("nothing that").is_none(), "{name}");
        assert!(window.query_by_label_contains("Meshes and blocks as they are").is_some(), "{name}");
        key(&mut window, Modifiers::NONE, Key::Enter);
        settle(&mut window);
        assert!(folder.path().join(path).exists(), "{name}: {path} was not written");
    }
}
