//! The intersection tools in the window, driven by simulated mouse and keys: intersect, look, keep the curves; the cylinder demo follows its slider; a surface is intersected with itself.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::sync::Arc;

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::ui::Options;
use patchwright::view::intersection::Drawing;
use patchwright::view::intersection::marks::Focus;
use patchwright::view::uv::{UvGlyph, UvMark, UvShape};
use window::*;

const NONE: Modifiers = Modifiers::NONE;

/// Clicks a surface in the outliner's place: the set is filled through the selection.
fn select(window: &mut Window, names: &[&str]) {
    let ids: Vec<_> = {
        let document = window.state().editor.document();
        names.iter().map(|n| document.entities().iter().find(|e| e.name == *n).unwrap().id).collect()
    };
    window.state_mut().editor.selection.set(ids);
    settle(window);
}

/// A bowl and four walls around a square of it. The walls do not quite meet: curves on walls that do would be one curve.
fn walled_bowl() -> Document {
    let knots = || Knots::bezier(2, -1.0, 1.0).unwrap();
    let square = [1.0, -1.0, 1.0];
    let at = |k: usize| {
        let (i, j) = (k % 3, k / 3);
        DVec3::new(i as f64 - 1.0, j as f64 - 1.0, 0.2 * (square[i] + square[j]))
    };
    let bowl = Surface::new(knots(), knots(), (0..9).map(at).collect(), None).unwrap();
    let mut document = Document::new(Unit::Metre);
    document.add("bowl", Shape::Surface(Arc::new(bowl)), None);
    let ring = [(-0.6, -0.4), (0.6, -0.4), (0.6, 0.4), (-0.6, 0.4), (-0.6, -0.4)];
    for (k, pair) in ring.windows(2).enumerate() {
        let [a, b] = [pair[0], pair[1]].map(|(x, y)| DVec3::new(x, y, 0.0));
        let (a, b) = (a.lerp(b, 2e-4), b.lerp(a, 2e-4));
        let ends = [a, b, a, b].map(|p| p - DVec3::Z * 0.3);
        let ends = [ends[0], ends[1], ends[2] + DVec3::Z * 0.8, ends[3] + DVec3::Z * 0.8];
        document.add(format!("wall {k}"), Shape::Surface(Arc::new(Surface::bilinear(ends).unwrap())), None);
    }
    document
}

/// The whole path: intersect, keep the curves, pick them as the sides of a patch, heal.
#[test]
fn intersect_keep_pick_heal_and_undo() {
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(walled_bowl(), None, "walled bowl".to_owned(), true);
    settle(&mut window);
    let walls = ["wall 0", "wall 1", "wall 2", "wall 3"];
    select(&mut window, &["bowl", walls[0], walls[1], walls[2], walls[3]]);
    key(&mut window, NONE, Key::X);
    assert_eq!(prompt(&window), "Intersect · Intersect the two sets");
    key(&mut window, NONE, Key::Enter);
    assert!(window.query_by_label_contains("Complete: no branch is missing").is_some(), "{}", prompt(&window));
    key(&mut window, NONE, Key::N);
    assert_eq!(prompt(&window), "Intersect · Curve 1 chosen");
    assert!(window.query_by_label_contains("Signed gap").is_some());
    key(&mut window, NONE, Key::Escape);
    assert_eq!(prompt(&window), "Intersect · Click a curve or a point");
    key(&mut window, NONE, Key::K);
    let curves = |window: &Window| window.state().editor.document().curves().count();
    assert_eq!(curves(&window), window.state().editor.found_intersection().unwrap().result.curves.len());

    // The walls would hide the curves.
    key(&mut window, NONE, Key::Escape);
    select(&mut window, &walls);
    key(&mut window, NONE, Key::H);
    key(&mut window, NONE, Key::Home);
    let entities = window.state().editor.document().entities().to_vec();
    key(&mut window, NONE, Key::P);
    for entity in entities.iter().filter(|e| e.curve().is_some()) {
        pick(&mut window, &entity.name, "curve");
    }
    picture(&mut window, "intersect_kept_sides");
    key(&mut window, NONE, Key::Enter);
    assert!(prompt(&window).starts_with("Patch · Four sides"), "{}", prompt(&window));
    key(&mut window, NONE, Key::Enter);
    assert!(prompt(&window).contains("Healed"), "{}", prompt(&window));
    key(&mut window, NONE, Key::Enter);
    let report = window.state().editor.document().patches().next().unwrap().1.report.clone();
    assert!(report.reached, "{report:?}");

    key(&mut window, NONE, Key::Escape);
    key(&mut window, NONE, Key::Escape);
    for _ in 0..3 {
        key(&mut window, Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(curves(&window), 0, "the patch, the hiding and the kept curves are one undo each");
}

#[test]
fn the_two_cylinders_follow_the_slider() {
    let mut window = window(builder(), Options::default());
    window.state_mut().editor.start_coaxial_demo();
    settle(&mut window);
    let crossings = |window: &Window| {
        let found = window.state().editor.found_intersection().unwrap();
        assert!(found.result.complete);
        found.result.junctions.len()
    };
    assert_eq!(crossings(&window), 2);
    picture(&mut window, "coaxial_1deg");
    for degrees in [0.3, 0.01, 10.0] {
        window.state_mut().editor.turn_cylinder(degrees);
        settle(&mut window);
        assert_eq!(crossings(&window), 2, "{degrees}");
    }
    assert_eq!(window.state().editor.history.steps().1, 1, "the drag is one step");
    key(&mut window, NONE, Key::G);
    picture(&mut window, "coaxial_gap");
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert!(window.query_by_label_contains("The model has changed").is_some());
}

#[test]
fn all_pairs_of_what_is_visible() {
    let mut window = opened("intersecting_surfaces.igs");
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::X);
    assert!(window.state().editor.found_intersection().is_some_and(|f| f.result.complete));
    assert!(window.state().editor.has_found_curves());
}

/// Three squares in the coordinate planes have one point in common: one line of the list, one mark, no gap of 1e-16.
#[test]
fn a_point_of_three_surfaces_is_listed_once() {
    let mut window = window(builder(), Options::default());
    let mut document = Document::new(Unit::Metre);
    let at = DVec3::new(0.3, 0.1, 0.2);
    for (name, x, y) in [("floor", DVec3::X, DVec3::Y), ("wall", DVec3::X, DVec3::Z), ("door", DVec3::Y, DVec3::Z)] {
        let corners = [-x - y, x - y, y - x, x + y].map(|p| p + at);
        document.add(name, Shape::Surface(Arc::new(Surface::bilinear(corners).unwrap())), None);
    }
    window.state_mut().editor.show_document(document, None, "three squares".to_owned(), true);
    settle(&mut window);
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::X);
    picture(&mut window, "intersect_three_surfaces");
    let found = window.state().editor.found_intersection().unwrap();
    assert_eq!((found.result.junctions.len(), found.result.curves.len()), (3, 6));
    let marks = Drawing::new(found, Focus::default(), true).glyphs;
    assert_eq!(marks.iter().filter(|g| g.at.distance(at) < 1e-12).count(), 1);
    let said = |text: &str| window.query_all_by_label_contains(text).next().is_some();
    assert!(said("Three surfaces meet 1") && said("floor, wall and door, no gap"));
    assert!(!said("Three surfaces meet 2") && !said("Three surfaces meet 3"));
}

#[test]
fn a_surface_without_self_intersection_is_proved_free() {
    let mut window = opened("surfaces_with_gap.igs");
    select(&mut window, &["left panel"]);
    key(&mut window, Modifiers::SHIFT, Key::X);
    assert_eq!(prompt(&window), "Self-intersection · Find where it meets itself");
    key(&mut window, NONE, Key::Enter);
    assert!(window.query_by_label_contains("No self-intersection").is_some(), "{}", prompt(&window));
    picture(&mut window, "self_free");
}

#[test]
fn esc_leaves_step_by_step_and_changes_nothing() {
    let mut window = opened("intersecting_surfaces.igs");
    key(&mut window, NONE, Key::X);
    assert_eq!(prompt(&window), "Intersect · Click a surface or mesh for the first set");
    key(&mut window, NONE, Key::Enter);
    assert!(prompt(&window).starts_with("Intersect"), "Enter says what is missing and stays");
    key(&mut window, NONE, Key::Escape);
    assert!(prompt(&window).starts_with("Select"), "{}", prompt(&window));
    assert!(!window.state().editor.history.is_dirty());
}

#[test]
fn a_plane_is_swept_through_the_miter_point_of_the_cross_cap() {
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.open_example("cross_cap");
    settle(&mut window);
    assert_eq!(prompt(&window), "Self-intersection · Miter point 1 chosen");
    let found = window.state().editor.found_intersection().unwrap();
    assert_eq!((found.result.curves.len(), found.result.miters.len(), found.result.complete), (1, 1, true));
    window.get_by_label("Cut with a plane").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("Elliptic: a figure-8").is_some());
    picture(&mut window, "plane_elliptic");
    window.get_by_label("Through the point").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("Elliptic: the point alone").is_some());
    // Beyond the parabolic tilt the sections are hyperbolic.
    window.get_all_by_label_contains("Parabolic at").next().unwrap().click();
    settle(&mut window);
    assert!(window.query_by_label_contains("Parabolic: a cusp").is_some());
    picture(&mut window, "plane_parabolic");
}

/// The area that two overlapping patches of one surface share.
#[test]
fn a_coincident_region_is_named_and_hatched() {
    let k = Knots::bezier(2, 0.0, 1.0).unwrap();
    let net = (0..9).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), if i == 4 { 1.5 } else { 0.0 })).collect();
    let whole = Surface::new(k.clone(), k, net, None).unwrap();
    let mut document = Document::new(Unit::Millimetre);
    for (name, at) in [("lower", [0.0, 0.7]), ("upper", [0.3, 1.0])] {
        document.add(name, Shape::Surface(Arc::new(whole.restricted(at, at).unwrap())), None);
    }
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(document, None, "overlap".to_owned(), true);
    settle(&mut window);
    select(&mut window, &["lower", "upper"]);
    key(&mut window, NONE, Key::X);
    key(&mut window, NONE, Key::Enter);
    let found = window.state().editor.found_intersection().unwrap();
    assert_eq!((found.result.regions.len(), found.result.complete), (1, true));
    let drawing = Drawing::new(found, Focus::default(), false);
    let (lines, _) = &drawing.hatching;
    assert!(lines.len() > 20);
    // Every hatch line lies in the square that both cover.
    for p in lines.iter().flatten() {
        assert!(p.x > 0.6 - 1e-9 && p.x < 1.4 + 1e-9 && p.y > 0.6 - 1e-9 && p.y < 1.4 + 1e-9, "{p}");
    }
    assert!(window.query_by_label_contains("Coincident").is_some());
    key(&mut window, NONE, Key::U);
    picture(&mut window, "coincident");
}

/// Both preimages are in the uv view; the cursor's partners move with it.
#[test]
fn the_uv_view_shows_both_domains() {
    let mut window = opened("intersecting_surfaces.igs");
    select(&mut window, &["left panel", "right panel"]);
    key(&mut window, NONE, Key::X);
    key(&mut window, NONE, Key::Enter);
    key(&mut window, NONE, Key::U);
    key(&mut window, NONE, Key::N);
    let pictures = window.state().editor.tool_uv();
    assert_eq!(pictures.len(), 2);
    let cursors = |window: &Window| -> Vec<glam::DVec2> {
        let pictures = window.state().editor.tool_uv();
        let ring = |m: &UvMark| match m.shape {
            UvShape::Point(at, UvGlyph::Ring) => Some(at),
            _ => None,
        };
        pictures.iter().filter_map(|p| p.marks.iter().find_map(ring)).collect()
    };
    let before = cursors(&window);
    assert_eq!(before.len(), 2);
    window.state_mut().editor.put_intersection_cursor(0.25);
    settle(&mut window);
    let after = cursors(&window);
    assert!(before.iter().zip(&after).all(|(a, b)| a.distance(*b) > 1e-3), "{before:?} {after:?}");
}

/// (x, y^2, y^3 + (x^2 - 1/4) y): a loop of double points between two miter points.
fn two_miters() -> Document {
    let (line, square) = ([-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]);
    let y = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0];
    let (y2, y3) = ([1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0], [-1.0, 1.0, -1.0, 1.0]);
    let at = |k: usize| {
        let (i, j) = (k % 3, k / 3);
        DVec3::new(line[i], y2[j], y3[j] + (square[i] - 0.25) * y[j])
    };
    let [u, v] = [2, 3].map(|degree| Knots::bezier(degree, -1.0, 1.0).unwrap());
    let surface = Surface::new(u, v, (0..12).map(at).collect(), None).unwrap();
    let mut document = Document::new(Unit::Metre);
    document.add("two miters", Shape::Surface(Arc::new(surface)), None);
    document
}

/// The levels of the ternary tree, its failed windows and converted leaves, in the Inspect tool.
#[test]
fn the_search_for_self_intersections_is_looked_into() {
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(two_miters(), None, "two miters".to_owned(), true);
    settle(&mut window);
    select(&mut window, &["two miters"]);
    key(&mut window, NONE, Key::I);
    window.get_by_label("Self-intersection search").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("Complete: 1 curve, 2 miter points").is_some(), "{}", prompt(&window));
    picture(&mut window, "ternary");
    // The root is split: level 0 has one node, and the uv view says which level it shows.
    key(&mut window, NONE, Key::Num0);
    assert_eq!(prompt(&window), "Inspect · Level 0: hover a node in either view, click to pin it");
    key(&mut window, NONE, Key::PageDown);
    assert_eq!(prompt(&window), "Inspect · Level 1: hover a node in either view, click to pin it");
    let pane = window.get_by_label_contains("uv view of two miters · self-intersection search, level 1").rect();
    hover(&mut window, pane.center() + egui::vec2(3.0, 5.0));
    assert!(window.query_by_label("Proved").is_some());
    click(&mut window, pane.center() + egui::vec2(3.0, 5.0));
    hover(&mut window, egui::pos2(4.0, 4.0));
    assert!(window.query_by_label("Pinned node").is_some());
    // A leaf is explained with its diagram, and both views go there.
    window.get_by_label_contains("Miter point 1: R").click();
    settle(&mut window);
    assert!(window.query_by_label("Leaf conversion, not to scale").is_some());
    key(&mut window, NONE, Key::W);
    picture(&mut window, "ternary_leaf");
    key(&mut window, NONE, Key::S);
    assert!(prompt(&window).starts_with("Inspect · "), "{}", prompt(&window));
    assert!(window.query_all_by_label("Height").next().is_some(), "S goes back to the hierarchy");
}

/// A bowl and a flat mesh: the triangles are intersected, the curve can be kept, and a mesh is not searched.
#[test]
fn a_mesh_is_intersected_with_a_surface() {
    use patchwright::kernel::mesh::facets::Facets;
    use patchwright::kernel::mesh::tri_mesh::TriMesh;
    let mut document = walled_bowl();
    document.retain(|e| e.name == "bowl");
    let [x, y] = [DVec3::X, DVec3::Y].map(|d| d * 0.9);
    let corners = [-x - y, x - y, x + y, y - x].map(|p| p + DVec3::Z * 0.05).to_vec();
    let mesh = Facets::of_mesh(TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap());
    document.add("floor", Shape::Mesh(Arc::new(mesh)), None);
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(document, None, "bowl".to_owned(), true);
    settle(&mut window);
    select(&mut window, &["bowl", "floor"]);
    key(&mut window, NONE, Key::X);
    key(&mut window, NONE, Key::Enter);
    assert!(window.query_by_label_contains("Complete on the triangles").is_some(), "{}", prompt(&window));
    picture(&mut window, "mesh_and_surface");
    key(&mut window, NONE, Key::N);
    assert_eq!(prompt(&window), "Intersect · Curve 1 chosen");
    key(&mut window, NONE, Key::K);
    assert_eq!(window.state().editor.document().curves().count(), 1);
    key(&mut window, NONE, Key::Escape);
    key(&mut window, NONE, Key::Escape);
    select(&mut window, &["floor"]);
    key(&mut window, Modifiers::SHIFT, Key::X);
    assert_eq!(prompt(&window), "Self-intersection · Click a surface");
}

/// Both engines' curves over one another, with what they are apart.
#[test]
fn the_result_on_triangles_is_laid_over_the_exact_one() {
    let mut window = opened("intersecting_surfaces.igs");
    select(&mut window, &["left panel", "right panel"]);
    key(&mut window, NONE, Key::X);
    key(&mut window, NONE, Key::Enter);
    window.get_by_label("Lay the result on triangles over it").click();
    settle(&mut window);
    assert!(window.query_by_label_contains("On triangles: ").is_some());
    assert!(window.query_by_label_contains("apart").is_some());
    picture(&mut window, "both_engines");
}

#[test]
fn a_click_in_the_outliner_fills_the_sets() {
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(walled_bowl(), None, "walled bowl".to_owned(), true);
    settle(&mut window);
    key(&mut window, NONE, Key::X);
    for name in ["bowl", "wall 0"] {
        window.get_by_label(name).click();
        settle(&mut window);
    }
    assert!(prompt(&window).contains("Intersect the two sets"), "{}", prompt(&window));
    key(&mut window, NONE, Key::Enter);
    assert!(prompt(&window).contains("Click a curve or a point"), "{}", prompt(&window));
    // With a result on screen the outliner selects again.
    window.get_by_label("wall 1").click();
    settle(&mut window);
    assert_eq!(window.state().editor.selection.ids().len(), 1);
}
