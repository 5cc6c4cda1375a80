//! Healing on triangle meshes and Plot3D blocks in the window, by simulated mouse and keys: rims of holes, borders,
//! feature edges and grid lines are picked as sides. The surfaces are known in closed form.
#![cfg(feature = "editor")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test helper may stop the test")]

#[path = "support/window.rs"]
mod window;

use std::fmt::Write as _;
use std::sync::Arc;

use egui::{Key, Modifiers};
use glam::{DVec2, DVec3};
use patchwright::kernel::geom::{Curve, Knots, Side, Surface};
use patchwright::kernel::mesh::facets::{FacetCurveKind, Facets};
use patchwright::kernel::mesh::tri_mesh::TriMesh;
use patchwright::model::document::{Document, Patch, Shape, Unit};
use patchwright::ui::{Action, Options, Tool};
use window::*;

const NONE: Modifiers = Modifiers::NONE;

/// A sheet of `n[0]` x `n[1]` cells over a rectangle, z by a function, the cells of a hole left out.
fn sheet(
    [x, y]: [[f64; 2]; 2],
    n: [usize; 2],
    height: impl Fn(f64, f64) -> f64,
    hole: impl Fn(usize, usize) -> bool,
) -> Facets {
    let at = |k: usize, n: usize, r: [f64; 2]| r[0] + (r[1] - r[0]) * k as f64 / n as f64;
    let points = (0..(n[0] + 1) * (n[1] + 1)).map(|k| {
        let (x, y) = (at(k % (n[0] + 1), n[0], x), at(k / (n[0] + 1), n[1], y));
        DVec3::new(x, y, height(x, y))
    });
    let index = |i: usize, j: usize| (j * (n[0] + 1) + i) as u32;
    let cells = (0..n[0] * n[1]).map(|k| (k % n[0], k / n[0])).filter(|&(i, j)| !hole(i, j));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    // The points in the hole belong to nothing.
    Facets::of_mesh(TriMesh::new(points.collect(), triangles.collect()).unwrap())
}

/// Shows a document of one mesh, from above.
fn shown(facets: Facets) -> Window {
    let mut document = Document::new(Unit::Metre);
    document.add("mesh", Shape::Mesh(Arc::new(facets)), None);
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(document, None, "mesh".to_owned(), true);
    from_above(&mut window);
    window
}

fn from_above(window: &mut Window) {
    settle(window);
    let ctx = window.ctx.clone();
    window.state_mut().editor.perform(&ctx, Action::Top);
    settle(window);
}

/// The curves of the mesh or block.
fn curves(window: &Window) -> Vec<(String, FacetCurveKind, Curve)> {
    let (_, facets) = window.state().editor.document().meshes().next().unwrap();
    facets.curves().iter().map(|c| (c.name.clone(), c.kind, c.curve.clone())).collect()
}

/// Those that lie in a box in the plane.
fn within(window: &Window, kind: FacetCurveKind, low: [f64; 2], high: [f64; 2]) -> Vec<(String, Curve)> {
    let inside =
        |p: &DVec3| (low[0] - 1e-9..=high[0] + 1e-9).contains(&p.x) && (low[1] - 1e-9..=high[1] + 1e-9).contains(&p.y);
    let of = |(name, k, curve): (String, FacetCurveKind, Curve)| {
        (k == kind && curve.points().iter().all(inside)).then_some((name, curve))
    };
    curves(window).into_iter().filter_map(of).collect()
}

fn distance(curve: &Curve, p: DVec3) -> f64 {
    let to = |pair: &[DVec3]| {
        let along = pair[1] - pair[0];
        let t = ((p - pair[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(pair[0] + along * t)
    };
    curve.points().windows(2).map(to).fold(f64::INFINITY, f64::min)
}

/// Picks four curves of the only mesh or block as sides; where they run past one another they are trimmed.
fn pick_sides(window: &mut Window, sides: &[String], trim: bool) {
    let entity = window.state().editor.document().entities()[0].name.clone();
    key(window, NONE, Key::P);
    for side in sides {
        pick(window, &entity, side);
        key(window, NONE, Key::Enter);
    }
    if trim {
        assert!(prompt(window).contains("C trims at crossings"), "{}", prompt(window));
        key(window, NONE, Key::C);
    }
}

/// What a heal came to.
struct Healed {
    patch: Arc<Patch>,
    /// The error that was asked for.
    tol: f64,
    /// The largest deviation of the map.
    deviation: f64,
    /// How many of the map's vertices have one.
    measured: usize,
    vertices: usize,
}

/// Heals between the sides that are picked.
fn heal(window: &mut Window, name: &str) -> Healed {
    assert!(prompt(window).starts_with("Patch · Four sides"), "{}", prompt(window));
    picture(window, &format!("{name}_picked"));
    key(window, NONE, Key::Enter);
    picture(window, &format!("{name}_healed"));
    let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
    let shown = session.shown.as_ref().unwrap_or_else(|| panic!("{}", prompt(window)));
    let vertices = shown.mesh.points.len();
    assert_eq!(shown.deviation.values.len(), vertices, "the map has a value for every vertex");
    assert!(shown.patch.report.reached && shown.complete, "{:?}", shown.patch.report);
    Healed {
        patch: Arc::clone(&shown.patch),
        tol: session.tool.options().tol,
        deviation: shown.deviation.max,
        measured: shown.deviation.measured,
        vertices,
    }
}

/// A patch on a body that is everywhere under it, within the error that was asked for of its sides, of the body, and (but for the
/// flatness of the cells) of the surface that the body was made from.
fn lies_on_it(name: &str, healed: &Healed, sides: &[Curve], flatness: f64, truth: impl Fn(DVec3) -> f64) {
    let report = &healed.patch.report;
    let (at_sides, at_truth) = (off_the_sides(&healed.patch, sides), off_the_truth(&healed.patch, truth));
    println!(
        "{name}: error {:.1e}, map {:.1e}, sides {at_sides:.1e}, truth {at_truth:.1e} of {:.1e}",
        report.max_error, healed.deviation, healed.tol
    );
    assert_eq!((report.artificial, report.kept, report.skipped), (0, 0, 0), "{report:?}");
    assert_eq!(healed.measured, healed.vertices, "the map has data everywhere");
    assert!(report.max_error <= healed.tol && healed.deviation <= healed.tol && at_sides <= healed.tol);
    assert!(at_truth <= healed.tol + flatness, "{at_truth}");
}

/// One of 201 points along a curve.
fn along(c: &Curve, k: usize) -> DVec3 {
    let [a, b] = c.domain();
    c.eval(a + (b - a) * k as f64 / 200.0)
}

/// How far the patch's borders leave the curves that were picked: each border follows one of them, and each of them
/// has a border.
fn off_the_sides(patch: &Patch, curves: &[Curve]) -> f64 {
    let borders = Side::ALL.map(|side| patch.surface.border(side).unwrap());
    let off = |b: &Curve, c: &Curve| (0..=200).map(|k| distance(c, along(b, k))).fold(0.0, f64::max);
    let of_border = |b: &Curve| curves.iter().map(|c| off(b, c)).fold(f64::INFINITY, f64::min);
    let of_curve = |c: &Curve| borders.iter().map(|b| off(b, c)).fold(f64::INFINITY, f64::min);
    borders.iter().map(of_border).chain(curves.iter().map(of_curve)).fold(0.0, f64::max)
}

/// The largest distance of the patch from the surface in closed form.
fn off_the_truth(patch: &Patch, truth: impl Fn(DVec3) -> f64) -> f64 {
    let [u, v] = patch.surface.domain();
    let at = |k: usize, d: [f64; 2]| d[0] + (d[1] - d[0]) * k as f64 / 60.0;
    (0..61 * 61).map(|k| truth(patch.surface.eval(DVec2::new(at(k % 61, u), at(k / 61, v)))).abs()).fold(0.0, f64::max)
}

/// Accepts the patch, undoes and redoes it.
fn accepted_and_undone(window: &mut Window) {
    let patches = |window: &Window| window.state().editor.document().patches().count();
    key(window, NONE, Key::Enter);
    assert_eq!(patches(window), 1, "{}", prompt(window));
    for _ in 0..2 {
        key(window, NONE, Key::Escape);
    }
    key(window, Modifiers::COMMAND, Key::Z);
    assert_eq!(patches(window), 0);
    key(window, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(patches(window), 1);
}

/// A paraboloid with a rectangular hole: Coons' patch over its rim is the paraboloid, and over the hole there is nothing to
/// project on or to deviate from.
#[test]
fn a_hole_of_a_mesh_is_closed_by_its_rim() {
    let f = |x: f64, y: f64| 0.4 * x * x + 0.25 * y * y - 0.1 * x;
    let hole = |i: usize, j: usize| (27..53).contains(&i) && (25..62).contains(&j);
    let mut window = shown(sheet([[-1.0, 1.0], [-1.0, 1.0]], [80, 80], f, hole));
    let rim = within(&window, FacetCurveKind::Border, [-0.325, -0.375], [0.325, 0.55]);
    assert_eq!(rim.len(), 4, "the rim is cut at its corners");
    let (names, rim): (Vec<_>, Vec<_>) = rim.into_iter().unzip();
    pick_sides(&mut window, &names, false);
    let healed = heal(&mut window, "mesh_hole");
    let report = &healed.patch.report;
    let (n, m) = (report.resolution[0], report.resolution[1]);
    assert_eq!((report.projected, report.artificial), (2 * (n + m), (n - 1) * (m - 1)), "{report:?}");
    assert!(healed.measured > 0 && healed.measured < healed.vertices / 4, "the map has data at the rim only");
    assert!(healed.deviation <= healed.tol && off_the_sides(&healed.patch, &rim) <= healed.tol);
    // The cells are 1/40 wide.
    let flatness = 0.8 / 8.0 / 1600.0;
    let off = off_the_truth(&healed.patch, |p| p.z - f(p.x, p.y));
    println!("hole: error {:.1e}, truth {off:.1e}", report.max_error);
    assert!(off <= healed.tol + flatness, "{off}");
    accepted_and_undone(&mut window);
}

/// Flat up to x = 1, where it rises by 40 degrees: the crease is one side, the end of the sheet the one across; the
/// others run past the crease and are cut there. Coons' patch alone would be 0.05 off.
#[test]
fn a_feature_edge_of_a_mesh_is_a_side() {
    let f = |x: f64, y: f64| {
        let t = (x - 1.0).max(0.0);
        0.84 * t - 0.3 * t * t + 0.8 * t * t * y * (1.0 - y)
    };
    let mut window = shown(sheet([[0.0, 2.0], [0.0, 1.0]], [96, 48], f, |_, _| false));
    let crease = within(&window, FacetCurveKind::Feature, [1.0, 0.0], [1.0, 1.0]);
    let end = within(&window, FacetCurveKind::Border, [2.0, 0.0], [2.0, 1.0]);
    let [low, high] = [0.0, 1.0].map(|y| within(&window, FacetCurveKind::Border, [0.0, y], [2.0, y]));
    assert_eq!([crease.len(), end.len(), low.len(), high.len()], [1; 4]);
    let (names, sides): (Vec<_>, Vec<_>) = [crease, low, end, high].into_iter().flatten().unzip();
    pick_sides(&mut window, &names, true);
    let healed = heal(&mut window, "mesh_crease");
    let flatness = (1.6 + 2.0 * 1.6) / 8.0 / (48.0 * 48.0);
    lies_on_it("crease", &healed, &sides, flatness, |p| p.z - f(p.x, p.y));
    let [u, v] = healed.patch.surface.domain();
    let corners = [(u[0], v[0]), (u[1], v[0]), (u[0], v[1]), (u[1], v[1])]
        .map(|(u, v)| healed.patch.surface.eval(DVec2::new(u, v)));
    assert!(corners.iter().all(|p| p.x > 1.0 - 1e-9), "cut at the crease: {corners:?}");
    accepted_and_undone(&mut window);
}

/// Opens a Plot3D file of one block.
fn opened_block(counts: [usize; 3], at: impl Fn([usize; 3]) -> DVec3) -> Window {
    let [ni, nj, nk] = counts;
    let mut text = format!("1\n{ni} {nj} {nk}\n");
    for d in 0..3 {
        (0..ni * nj * nk).for_each(|k| writeln!(text, "{:.17e}", at([k % ni, k / ni % nj, k / (ni * nj)])[d]).unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("block.xyz");
    std::fs::write(&model, text).unwrap();
    let mut window = window(builder(), Options { files: vec![model], ..Options::default() });
    from_above(&mut window);
    window
}

/// Heals the region between four grid lines.
fn between_lines(window: &mut Window, names: [&str; 4], name: &str, flatness: f64, truth: impl Fn(DVec3) -> f64) {
    let all = curves(window);
    let sides: Vec<Curve> = names
        .iter()
        .map(|n| all.iter().find(|c| c.0 == *n && c.1 == FacetCurveKind::GridLine).unwrap().2.clone())
        .collect();
    pick_sides(window, &names.map(str::to_owned), true);
    let healed = heal(window, name);
    lies_on_it(name, &healed, &sides, flatness, truth);
    accepted_and_undone(window);
}

#[test]
fn a_region_of_a_surface_grid_is_healed_between_grid_lines() {
    let f = |x: f64, y: f64| 0.3 * x * x - 0.2 * y * y + 0.3 * x * x * y * y;
    let mut window = opened_block([49, 49, 1], |[i, j, _]| {
        let [s, t] = [i, j].map(|k| -1.0 + k as f64 / 24.0);
        let (x, y) = (s + 0.1 * t * t, t + 0.1 * s * t);
        DVec3::new(x, y, f(x, y))
    });
    let flatness = 3.0 / 8.0 / 576.0;
    between_lines(&mut window, ["i = 10", "j = 8", "i = 36", "j = 38"], "grid", flatness, |p| p.z - f(p.x, p.y));
}

/// The outer face of a solid block: the inner one is within the box of influence, and farther.
#[test]
fn a_region_of_a_face_of_a_solid_block_is_healed_between_grid_lines() {
    let mut window = opened_block([81, 25, 5], |[i, j, k]| {
        let (a, r) = ((40.0 + 1.25 * i as f64).to_radians(), 0.8 + 0.05 * k as f64);
        DVec3::new(r * a.cos(), j as f64 / 24.0, r * a.sin())
    });
    let names = ["k max, i = 16", "k max, j = 4", "k max, i = 61", "k max, j = 19"];
    let flatness = 1.0 - 0.625_f64.to_radians().cos();
    between_lines(&mut window, names, "solid", flatness, |p| p.x.hypot(p.z) - 1.0);
}

/// A mesh and a spline surface of one cylinder with a gap between: two sides run over both, with a segment across the gap.
#[test]
fn a_gap_between_a_mesh_and_a_surface_is_healed() {
    let f = |x: f64, _: f64| 0.4 * x * x;
    let mut document = Document::new(Unit::Metre);
    let knots = |a, b| Knots::bezier(2, a, b).unwrap();
    let net = (0..9)
        .map(|k| DVec3::new(0.5 * f64::from(k % 3), 1.2 + 0.5 * f64::from(k / 3), [0.0, 0.0, 0.4][k as usize % 3]));
    let surface = Surface::new(knots(0.0, 1.0), knots(1.2, 2.2), net.collect(), None).unwrap();
    document.add("surface", Shape::Surface(Arc::new(surface)), None);
    document.add("mesh", Shape::Mesh(Arc::new(sheet([[0.0, 1.0], [0.0, 1.0]], [48, 48], f, |_, _| false))), None);
    let mut window = opened("surfaces_with_gap.igs");
    window.state_mut().editor.show_document(document, None, "both".to_owned(), true);
    from_above(&mut window);
    let border = |window: &Window, low, high| within(window, FacetCurveKind::Border, low, high)[0].0.clone();
    let [near, left, right] =
        [([0.0; 2], [1.0, 0.0]), ([0.0; 2], [0.0, 1.0]), ([1.0, 0.0], [1.0; 2])].map(|(a, b)| border(&window, a, b));
    key(&mut window, NONE, Key::P);
    pick(&mut window, "mesh", &near);
    key(&mut window, NONE, Key::Enter);
    for (x, mesh, surface) in [(0.0, left, "border u min"), (1.0, right, "border u max")] {
        pick(&mut window, "mesh", &mesh);
        key(&mut window, NONE, Key::L);
        for y in [1.0, 1.2] {
            let at = window.state().editor.viewport.project(DVec3::new(x, y, f(x, y))).unwrap();
            click(&mut window, at);
        }
        pick(&mut window, "surface", surface);
        key(&mut window, NONE, Key::Enter);
    }
    pick(&mut window, "surface", "border v max");
    key(&mut window, NONE, Key::Enter);
    let healed = heal(&mut window, "both");
    // One of eight rows of spans is over the gap: its samples are made up, those at its ends stay on the segments.
    let report = &healed.patch.report;
    assert_eq!((report.projected, report.artificial, report.kept), (72, 7, 2), "{report:?}");
    assert!(healed.measured > healed.vertices * 8 / 10 && healed.measured < healed.vertices, "{}", healed.measured);
    let off = off_the_truth(&healed.patch, |p| p.z - f(p.x, p.y));
    println!(
        "gap: error {:.1e}, map {:.1e}, truth {off:.1e} of {:.1e}",
        report.max_error, healed.deviation, healed.tol
    );
    assert!(healed.deviation <= healed.tol && off <= healed.tol);
    accepted_and_undone(&mut window);
}

/// A round hole in a plane: its rim has no corners and is cut in four where one clicks with Shift.
#[test]
fn a_round_rim_is_split_into_four_sides() {
    const N: usize = 200;
    let at = |r: f64, a: f64| DVec3::new(r * a.cos(), r * a.sin(), 0.3 * r * a.cos());
    let index = |ring: usize, k: usize| (ring * N + k % N) as u32;
    let point = |k: usize| at(0.5 + 0.1 * (k / N) as f64, std::f64::consts::TAU * (k % N) as f64 / N as f64);
    let cells = (0..5 * N).map(|k| (k / N, k % N));
    let triangles = cells.flat_map(|(r, k)| {
        let [a, b, c, d] = [index(r, k), index(r + 1, k), index(r + 1, k + 1), index(r, k + 1)];
        [[a, b, c], [a, c, d]]
    });
    let mesh = TriMesh::new((0..6 * N).map(point).collect(), triangles.collect()).unwrap();
    let mut window = shown(Facets::of_mesh(mesh));
    let rim = within(&window, FacetCurveKind::Border, [-0.5, -0.5], [0.5, 0.5]);
    assert_eq!(rim.len(), 1);
    let on_rim =
        |window: &Window, degrees: f64| window.state().editor.viewport.project(at(0.5, degrees.to_radians())).unwrap();
    let tool = |window: &Window| {
        let Tool::Patch(session) = &window.state().editor.tool else { panic!() };
        let sides: Vec<usize> = session.tool.sides().iter().map(|s| s.pieces.len()).collect();
        (sides, session.tool.notice().map_or(String::new(), |n| n.text.clone()))
    };
    key(&mut window, NONE, Key::P);
    let first = on_rim(&window, 45.0);
    click(&mut window, first);
    let (counts, notice) = tool(&window);
    assert_eq!(counts, [1, 0, 0, 0]);
    assert!(notice.contains("closes on itself"), "{notice}");
    // The first corner is where the mouse is: a second click there meant the mesh behind, and was refused.
    for k in 0..4 {
        let corner = on_rim(&window, 90.0 * k as f64 + 45.0);
        shift_click(&mut window, corner);
        let (counts, notice) = tool(&window);
        assert_eq!(counts[k], 2, "{notice}");
        assert!(notice.contains("Backspace frees the second one"), "{notice}");
        key(&mut window, NONE, Key::Backspace);
        key(&mut window, NONE, Key::Enter);
    }
    // The rest goes to the first side: the rim begins in its middle.
    assert_eq!(tool(&window).0, [1; 4]);
    key(&mut window, NONE, Key::Num1);
    let rest = on_rim(&window, -20.0);
    click(&mut window, rest);
    key(&mut window, NONE, Key::Enter);
    assert_eq!(tool(&window).0, [2, 1, 1, 1]);
    let healed = heal(&mut window, "round");
    assert!(off_the_truth(&healed.patch, |p| p.z - 0.3 * p.x) < 1e-9);
    // All of the rim is used: what is between it and the patch is less than the tolerance all around.
    let rim = &rim[0].1;
    let borders = Side::ALL.map(|side| healed.patch.surface.border(side).unwrap());
    let off = |b: &Curve, k: usize| distance(rim, along(b, k));
    assert!(borders.iter().all(|b| (0..=200).all(|k| off(b, k) <= healed.tol)));
    let length = |c: &Curve| (0..200).map(|k| along(c, k).distance(along(c, k + 1))).sum::<f64>();
    let around = borders.iter().map(length).sum::<f64>();
    assert!((around / length(rim) - 1.0).abs() < 1e-3, "{around}");
    accepted_and_undone(&mut window);
}

fn shift_click(window: &mut Window, at: egui::Pos2) {
    window.event(egui::Event::ModifiersChanged(Modifiers::SHIFT));
    click(window, at);
    window.event(egui::Event::ModifiersChanged(NONE));
    settle(window);
}
