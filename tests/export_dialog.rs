//! The export dialog in the window: what it says before it writes, and what it writes.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::sync::Arc;

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use patchwright::io::{self, ImportReport, SaveOptions, plot3d};
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

/// The export dialog over the roof, which was read from a file in the folder.
fn dialog_of_the_roof() -> (tempfile::TempDir, Window) {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("roof.patchwright.ron");
    io::save(&model, &roof(), &SaveOptions::default()).unwrap();
    let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
    key(&mut window, Modifiers::COMMAND, Key::E);
    (folder, window)
}

#[test]
fn the_dialog_tells_gap_and_angle_and_writes_what_it_told() {
    let (folder, mut window) = dialog_of_the_roof();
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
    export_to(&mut window, &path);
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

/// Writes the visible surfaces as a Plot3D grid from the dialog, clustered at a side that is chosen there.
#[test]
fn grid_lines_gather_at_the_sides_chosen_in_the_dialog() {
    let (folder, mut window) = dialog_of_the_roof();
    for label in ["Plot3D", "Clustered (tanh)"] {
        window.get_by_label(label).click();
        settle(&mut window);
    }
    assert!(window.query_by_label("Sides that attract grid lines").is_some());
    // The roof is the second of the two that are listed.
    window.get_all_by_label("v max").nth(1).unwrap().click();
    settle(&mut window);
    picture(&mut window, "export_tanh");
    let path = folder.path().join("roof.xyz");
    export_to(&mut window, &path);
    let (layout, grids) = plot3d::read(&std::fs::read(&path).unwrap(), &mut ImportReport::default()).unwrap();
    assert!(layout.multi_block && grids.len() == 2);
    // Vinokur's tangent, with the stretching that the dialog begins with: the last cell is a thirtieth of the first.
    let place = |clustered: bool, x: f64| if clustered { (2.5 * x).tanh() / 2.5_f64.tanh() } else { x };
    for (grid, clustered) in grids.iter().zip([false, true]) {
        assert_eq!(grid.counts(), [33, 33, 1]);
        let at = |i: usize, j: usize| grid.points()[j * 33 + i];
        for k in 0..32 {
            let [from, to] = [k, k + 1].map(|k| place(clustered, k as f64 / 32.0));
            // The edge between floor and roof is in the middle of its gap.
            let tol = if k == 0 { 1.5e-3 } else { 1e-12 };
            assert!((at(7, k).distance(at(7, k + 1)) - (to - from)).abs() < tol, "{clustered}, cell {k} along v");
            assert!((at(k, 7).distance(at(k + 1, 7)) - 1.0 / 32.0).abs() < 1e-12, "{clustered}, cell {k} along u");
        }
    }
    // The edge that both have is there once, point for point.
    assert_eq!(grids[0].points()[32 * 33..], grids[1].points()[..33]);
}
