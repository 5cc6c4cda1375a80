//! Meshes and structured blocks through the whole program: opened, healed, intersected and exported.

#![allow(clippy::panic, clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::path::Path;
use std::process::{Command, Output};
use std::slice::from_ref;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use patchwright::io::{self, ImportReport, plot3d, stl};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::intersect::{Engine, IntersectError, intersect_with};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::body::Body;
use patchwright::kernel::mesh::facets::{FacetCurveKind, Facets};
use patchwright::kernel::mesh::grid::Grid;
use patchwright::kernel::mesh::tri_mesh::TriMesh;
use patchwright::kernel::ssi::result::JunctionKind;
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::healing;
use patchwright::model::spec::{HealSpec, PatchSpec, Piece};

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)))
}

fn hill(p: DVec2) -> DVec3 {
    p.extend(0.3 * (1.3 * p.x).sin() + 0.2 * (1.7 * p.y).cos())
}

/// The hill over [0, 4] x [0, 2] as 2 (2 n) n triangles without those over the open rectangle `hole`.
fn hilly(n: usize, hole: [DVec2; 2]) -> TriMesh {
    let at = |i: usize, j: usize| DVec2::new(2.0 * i as f64 / n as f64, 2.0 * j as f64 / n as f64);
    let index = |i: usize, j: usize| (j * (2 * n + 1) + i) as u32;
    let points = (0..(2 * n + 1) * (n + 1)).map(|k| hill(at(k % (2 * n + 1), k / (2 * n + 1)))).collect();
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..2 * n {
            let middle = 0.5 * (at(i, j) + at(i + 1, j + 1));
            if !(middle.cmpgt(hole[0]).all() && middle.cmplt(hole[1]).all()) {
                let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    TriMesh::new(points, triangles).unwrap()
}

const HOLE: [DVec2; 2] = [DVec2::new(1.5, 0.75), DVec2::new(2.5, 1.25)];

fn document(shape: Shape) -> Document {
    let mut document = Document::new(Unit::Millimetre);
    document.add("part", shape, None);
    document
}

fn chains(of: impl IntoIterator<Item = usize>) -> [Vec<Piece>; 4] {
    let pieces: Vec<Vec<Piece>> =
        of.into_iter().map(|chain| vec![Piece::Chain { mesh: 0, chain, from: 0.0, to: 1.0 }]).collect();
    pieces.try_into().unwrap()
}

fn spec(sides: [Vec<Piece>; 4], tol: f64) -> HealSpec {
    let patch = PatchSpec { name: "fill".into(), sides, ..PatchSpec::default() };
    HealSpec { tol: Some(tol), patches: vec![patch], ..HealSpec::from_ron("(patches: [])").unwrap() }
}

#[test]
fn the_hole_of_a_mesh_is_filled_between_its_four_rims() {
    let facets = Arc::new(Facets::of_mesh(hilly(40, HOLE)));
    let rims: Vec<usize> = facets
        .curves()
        .iter()
        .enumerate()
        .filter(|(_, c)| {
            c.kind == FacetCurveKind::Border
                && c.curve.points().iter().all(|p| {
                    let p = p.truncate();
                    p.cmpge(HOLE[0] - 1e-9).all() && p.cmple(HOLE[1] + 1e-9).all()
                })
        })
        .map(|(k, _)| k)
        .collect();
    assert_eq!(rims.len(), 4);
    let healing = healing::run(&document(Shape::Mesh(facets)), &spec(chains(rims), 1e-3), &Job::new());
    // Inside the hole there is nothing to project on: that is said, not guessed.
    match healing {
        Ok(healing) => {
            let surface = &healing.patches[0].1.surface;
            for k in 0..81 {
                let p = surface.eval(DVec2::new(f64::from(k % 9), f64::from(k / 9)) / 8.0);
                assert!((p.z - hill(p.truncate()).z).abs() < 0.02, "{p}");
            }
        }
        Err(error) => assert!(error.to_string().contains("projection"), "{error}"),
    }
}

#[test]
fn a_patch_over_a_mesh_with_a_hole_lies_on_its_triangles_and_bridges_the_hole() {
    let mesh = hilly(60, HOLE);
    let facets = Arc::new(Facets::of_mesh(mesh));
    let outer: Vec<usize> = facets
        .curves()
        .iter()
        .enumerate()
        .filter(|(_, c)| c.curve.points().iter().any(|p| p.x == 0.0 || p.x == 4.0 || p.y == 0.0 || p.y == 2.0))
        .map(|(k, _)| k)
        .collect();
    assert_eq!(outer.len(), 4);
    let healing = healing::run(&document(Shape::Mesh(facets)), &spec(chains(outer), 2e-3), &Job::new()).unwrap();
    let patch = &healing.patches[0].1;
    assert!(patch.report.reached && patch.report.projected > 100 && patch.report.artificial > 0, "{:?}", patch.report);
    let mut worst = 0.0_f64;
    for k in 0..41 * 41 {
        let p = patch.surface.eval(DVec2::new(f64::from(k % 41), f64::from(k / 41)) / 40.0);
        let inside = p.truncate().cmpgt(HOLE[0] - 0.1).all() && p.truncate().cmplt(HOLE[1] + 0.1).all();
        if !inside {
            worst = worst.max((p.z - hill(p.truncate()).z).abs());
        }
    }
    assert!(worst < 4e-3, "{worst}");
}

#[test]
fn a_plane_mesh_gives_a_plane_and_grid_lines_of_a_block_are_sides() {
    let flat = |k: usize| DVec3::new((k % 11) as f64 * 0.4, (k / 11) as f64 * 0.25, 1.0);
    let grid = Grid::new([11, 9, 1], (0..99).map(flat).collect(), None).unwrap();
    let facets = Arc::new(Facets::of_block(grid).unwrap());
    // j = 2, j = 7, i = 1, i = 8: grid lines inside; pieces of them between the crossings.
    let piece = |chain: usize, from: f64, to: f64| vec![Piece::Chain { mesh: 0, chain, from, to }];
    let sides = [piece(2, 0.1, 0.8), piece(9 + 8, 0.25, 0.875), piece(7, 0.8, 0.1), piece(9 + 1, 0.25, 0.875)];
    let healing = healing::run(&document(Shape::Block(facets)), &spec(sides, 1e-6), &Job::new()).unwrap();
    let patch = &healing.patches[0].1;
    assert!(patch.report.max_error < 1e-12 && patch.report.artificial == 0);
    assert!(patch.surface.points().iter().all(|p| (p.z - 1.0).abs() < 1e-12));
    let bounds = patch.surface.bounds();
    assert!(
        bounds.min.distance(DVec3::new(0.4, 0.5, 1.0)) < 1e-12
            && bounds.max.distance(DVec3::new(3.2, 1.75, 1.0)) < 1e-12
    );
}

fn bowl() -> Arc<Surface> {
    // z = 1 - x^2 - y^2 over [-1, 1]^2, parameters (x, y).
    let knots = || Knots::bezier(2, -1.0, 1.0).unwrap();
    let (x, square) = ([-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]);
    let points = (0..9).map(|k| (k % 3, k / 3)).map(|(i, j)| DVec3::new(x[i], x[j], 1.0 - square[i] - square[j]));
    Arc::new(Surface::new(knots(), knots(), points.collect(), None).unwrap())
}

fn plane(z: f64) -> TriMesh {
    let corner = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| DVec3::new(x, y, z + 0.1 * x));
    TriMesh::new(corner.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn a_surface_meets_a_mesh_in_the_exact_curve_of_its_triangles() {
    let bodies = [(3, Body::from(bowl())), (7, Body::from(Arc::new(Facets::of_mesh(plane(0.4)))))];
    let [a, b] = bodies;
    let found = intersect_with(Engine::Mesh, from_ref(&a), from_ref(&b), Some(1e-6), &Job::new()).unwrap();
    assert!(found.complete);
    let [curve] = &found.curves[..] else { panic!("{} curves", found.curves.len()) };
    assert!(curve.closed && curve.error_bound <= 1e-6);
    for pair in curve.points.windows(2) {
        let p = pair[0];
        assert_eq!((p.a, p.b), (3, 7));
        assert!((p.xyz.z - (0.4 + 0.1 * p.xyz.x)).abs() < 1e-12, "on the plane of the mesh");
        assert!(p.xyz.distance(p.uv.extend(1.0 - p.uv.length_squared())) < 1e-10, "on the surface");
        let middle = 0.5 * (pair[0].xyz + pair[1].xyz);
        let height = 1.0 - middle.truncate().length_squared() - middle.z;
        assert!(height.abs() < 4e-6, "the chord is near: {height}");
    }
    assert!(matches!(
        intersect_with(Engine::Bvh, &[a], &[b], None, &Job::new()),
        Err(IntersectError::NotParametric { number: 7 })
    ));
}

#[test]
fn near_tangency_is_handed_to_the_hybrid_engine_and_both_engines_agree() {
    let flat = |z: f64| {
        let c = [(-2.0, -2.0), (2.0, -2.0), (-2.0, 2.0), (2.0, 2.0)].map(|(x, y)| DVec3::new(x, y, z));
        Body::from(Arc::new(Surface::bilinear(c).unwrap()))
    };
    // A loop of radius 0.003 at the top of the bowl: far smaller than the triangles.
    let (a, b) = ([(0, Body::from(bowl()))], [(1, flat(1.0 - 9e-6))]);
    let job = Job::new();
    let mesh = intersect_with(Engine::Mesh, &a, &b, None, &job).unwrap();
    let exact = intersect_with(Engine::Bvh, &a, &b, None, &Job::new()).unwrap();
    assert_eq!((mesh.curves.len(), mesh.curves[0].closed), (1, true));
    assert_eq!(mesh.curves.len(), exact.curves.len());
    assert!(job.warnings().iter().any(|w| w.contains("handed over")), "{:?}", job.warnings());
    // Away from it the triangles decide alone.
    let job = Job::new();
    let far = intersect_with(Engine::Mesh, &a, &[(1, flat(0.3))], None, &job).unwrap();
    assert_eq!((far.curves.len(), job.warnings().len()), (1, 0));
    let radius = 0.7_f64.sqrt();
    assert!(far.curves[0].points.iter().all(|p| (p.xyz.truncate().length() - radius).abs() < 1e-9));
}

#[test]
fn three_bodies_meet_in_points() {
    let wall = |direction: DVec3| {
        [(-2.0, -1.0), (2.0, -1.0), (-2.0, 2.0), (2.0, 2.0)].map(|(s, z)| direction * s + DVec3::Z * z)
    };
    let spline = Body::from(Arc::new(Surface::bilinear(wall(DVec3::new(1.0, 1.0, 0.0))).unwrap()));
    let [p, q, r, s] = wall(DVec3::new(1.0, -0.5, 0.0));
    let mesh = TriMesh::new(vec![p, q, s, r], vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let b = [(1, spline), (2, Body::from(Arc::new(Facets::of_mesh(mesh))))];
    let found = intersect_with(Engine::Mesh, &[(0, Body::from(bowl()))], &b, None, &Job::new()).unwrap();
    // The two walls cross the bowl's top, and each of the two curves is cut there.
    assert_eq!(found.curves.len(), 4);
    assert!(found.curves.iter().all(|c| c.end_ids.iter().flatten().count() == 1));
    let points: Vec<_> = found.junctions.iter().filter(|j| j.kind == JunctionKind::ThreeSurfaces).collect();
    assert_eq!(points.len(), 2, "{points:?}");
    for j in points {
        assert!(j.xyz.distance(DVec3::Z) < 1e-10 && j.uv.length() < 1e-10, "{j:?}");
    }
}

fn write_models(folder: &Path) {
    let mut mesh = hilly(10, HOLE);
    mesh.set_groups(vec![("low".into(), 0, 100), ("high".into(), 100, mesh.triangles().len())]);
    std::fs::write(folder.join("hill.stl"), stl::write_ascii(&mesh)).unwrap();
    let mut document = Document::new(Unit::Millimetre);
    document.add("bowl", Shape::Surface(bowl()), None);
    document.add("cut", Shape::Mesh(Arc::new(Facets::of_mesh(plane(0.4)))), None);
    io::save(&folder.join("mixed.patchwright.ron"), &document, &io::SaveOptions::default()).unwrap();
}

#[test]
fn the_command_line_opens_converts_and_intersects_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_models(folder);
    let info = json(&patchwright(folder, &["info", "hill.stl", "--all", "--json", "-"]));
    assert_eq!((&info["meshes"], &info["entities"][1]["name"]), (&2.into(), &"high".into()));
    assert_eq!(info["entities"][0]["facets"]["triangles"], 100);
    assert!(!info["entities"][1]["facets"]["curves"][0]["name"].as_str().unwrap().is_empty());
    // STL -> OBJ -> project -> binary STL keeps triangles and names.
    for (from, to) in
        [("hill.stl", "hill.obj"), ("hill.obj", "hill.patchwright.ron"), ("hill.patchwright.ron", "back.stl")]
    {
        let output = patchwright(folder, &["convert", from, to]);
        assert_eq!(output.status.code(), Some(0), "{to}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let opened = io::open(&folder.join("hill.patchwright.ron")).unwrap();
    assert_eq!(opened.document.entities()[0].name, "low");
    let back = stl::read(&std::fs::read(folder.join("back.stl")).unwrap(), &mut ImportReport::default());
    assert_eq!(back.triangles().len(), hilly(10, HOLE).triangles().len());
    // Mixed: the engine is chosen by what takes part.
    let arguments = ["intersect", "mixed.patchwright.ron", "--a", "0", "--b", "1", "--json", "-"];
    let output = patchwright(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let result = json(&output);
    assert_eq!((&result["curves"][0]["closed"], &result["complete"]), (&true.into(), &true.into()));
    let refused = patchwright(folder, &[&arguments[..], &["--engine", "bvh"]].concat());
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn exports_have_identical_shared_edges_and_say_the_largest_gap() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut document = Document::new(Unit::Millimetre);
    let whole = bowl();
    document.add("left", Shape::Surface(Arc::new(whole.restricted([-1.0, 0.25], [-1.0, 1.0]).unwrap())), None);
    document.add("right", Shape::Surface(Arc::new(whole.restricted([0.25, 1.0], [-1.0, 1.0]).unwrap())), None);
    io::save(&folder.join("two.patchwright.ron"), &document, &io::SaveOptions::default()).unwrap();
    let arguments =
        "convert two.patchwright.ron two.xyz --points 17 --spacing tanh --stretch 2 --cluster 0:umax --json -";
    let output = patchwright(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said = json(&output);
    assert_eq!((&said["export"]["seams"], &said["export"]["cells"]), (&1.into(), &512.into()));
    assert!(said["export"]["largest_gap"].as_f64().unwrap() < 1e-12);
    let bytes = std::fs::read(folder.join("two.xyz")).unwrap();
    let (layout, grids) = plot3d::read(&bytes, &mut ImportReport::default()).unwrap();
    assert_eq!((grids.len(), layout.multi_block), (2, true));
    for j in 0..17 {
        assert_eq!(grids[0].points()[j * 17 + 16], grids[1].points()[j * 17], "point for point");
    }
    let step = |i: usize| grids[0].points()[i].distance(grids[0].points()[i + 1]);
    assert!(step(15) < 0.5 * step(0), "lines gather at u max: {} {}", step(0), step(15));
    // As triangles: one closed seam, no border edge inside.
    let output = patchwright(folder, &["convert", "two.patchwright.ron", "two.obj", "--chord", "1e-3"]);
    assert_eq!(output.status.code(), Some(0));
    let opened = io::open(&folder.join("two.obj")).unwrap().document;
    assert_eq!(opened.entities().len(), 2);
    let mesh = io::obj::read(&std::fs::read(folder.join("two.obj")).unwrap(), &mut ImportReport::default());
    assert_eq!(mesh.border_loops().len(), 1);
    for bad in [
        &["--points", "1"][..],
        &["--chord", "-1"],
        &["--cluster", "0:umin"],
        &["--spacing", "tanh", "--cluster", "9:umin"],
    ] {
        let output = patchwright(folder, &[&["convert", "two.patchwright.ron", "bad.xyz"], bad].concat());
        assert_ne!(output.status.code(), Some(0), "{bad:?}");
        assert!(!folder.join("bad.xyz").exists());
    }
}

#[test]
fn all_pairs_of_surfaces_and_a_mesh_are_intersected_and_written() {
    let wall = |a: [f64; 2], b: [f64; 2]| {
        let at = |p: [f64; 2], z: f64| DVec3::new(p[0], p[1], z);
        Shape::Surface(Arc::new(Surface::bilinear([at(a, -1.0), at(b, -1.0), at(a, 1.5), at(b, 1.5)]).unwrap()))
    };
    let mut model = document(wall([1.1, -1.0], [1.1, 3.0]));
    model.add("other", wall([-1.0, 0.9], [5.0, 0.9]), None);
    model.add("hill", Shape::Mesh(Arc::new(Facets::of_mesh(hilly(20, [DVec2::splat(9.0); 2])))), None);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    io::save(&folder.join("model.patchwright.ron"), &model, &io::SaveOptions::default()).unwrap();
    // A mesh is among them, so that the engine is chosen; and asked for by name.
    let run = |more: &[&str]| {
        let output = patchwright(folder, &[&["intersect", "model.patchwright.ron", "--json", "-"], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        json(&output)
    };
    let chosen = run(&[]);
    let named = run(&["--engine", "mesh", "--out", "curves.igs"]);
    assert_eq!(chosen["curves"], named["curves"]);
    let curves = named["curves"].as_array().unwrap();
    let pairs: Vec<_> = curves.iter().map(|c| (c["points"][0]["a"].clone(), c["points"][0]["b"].clone())).collect();
    // The three branches meet in one point, over (1.1, 0.9), and are cut there; each pair of bodies has it.
    let twice = |a: i32, b: i32| [(a.into(), b.into()), (a.into(), b.into())];
    assert_eq!(pairs, [twice(0, 1), twice(0, 2), twice(1, 2)].concat());
    let junctions = named["junctions"].as_array().unwrap();
    assert_eq!(junctions.len(), 3);
    for junction in junctions {
        assert!((junction["xyz"][0].as_f64().unwrap() - 1.1).abs() < 1e-9);
        assert!((junction["xyz"][1].as_f64().unwrap() - 0.9).abs() < 1e-9);
    }
    let written = io::open(&folder.join("curves.igs")).unwrap().document;
    assert_eq!((written.curves().count(), written.surfaces().count()), (6, 2));
    let degrees: Vec<usize> = written.curves().map(|(_, c)| c.knots().degree()).collect();
    assert_eq!(degrees, [3, 3, 1, 1, 1, 1], "splines between surfaces, polylines on the mesh");
    for (_, curve) in written.curves() {
        for k in 0..=64 {
            let [from, to] = curve.domain();
            let p = curve.eval(from + (to - from) * f64::from(k) / 64.0);
            assert!((p.x - 1.1).abs().min((p.y - 0.9).abs()) < 1e-6, "{p}");
        }
    }
    // Curves on surfaces, of two directory lines each: both sides of the first two, one of each of the others.
    let text = std::fs::read_to_string(folder.join("curves.igs")).unwrap();
    let on_surfaces = text.lines().filter(|l| l.as_bytes()[72] == b'D' && l.trim_start().starts_with("142 ")).count();
    assert_eq!(on_surfaces, 2 * 8);
    // The exact engine says why it cannot.
    let output = patchwright(folder, &["intersect", "model.patchwright.ron", "--engine", "bvh"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("use the mesh engine"));
}
