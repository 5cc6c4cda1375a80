//! What leaves as STEP is what comes back, and what a mesher takes as it is: OpenCASCADE and Gmsh, through Gmsh's Python
//! package (`pip install gmsh`). Those tests are skipped by name where there is none; `PATCHWRIGHT_REQUIRE_GMSH=1` makes
//! that a failure, and `PATCHWRIGHT_PYTHON` names the interpreter that has it.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/mesher.rs"]
mod mesher;

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use glam::DVec3;
use mesher::{conforms, meshed, python};
use patchwright::io::{self, SaveOptions, Severity};
use patchwright::kernel::geom::{Curve, Knots, Surface, sweep};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::area::area;
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::healing;
use patchwright::model::shell::Shells;
use patchwright::model::spec::HealSpec;

/// A wavy bicubic tile over [i, i + 1] x [j, j + 1] of one function, so that neighbours have the same borders.
fn tile(i: usize, j: usize, turned: bool) -> Surface {
    let knots = Knots::clamped(3, &[0.0, 0.4, 1.0], 2).unwrap();
    let at = knots.greville();
    let n = at.len();
    let net = |a: usize, b: usize| {
        let (x, y) = (i as f64 + at[a], j as f64 + at[b]);
        DVec3::new(x, y, 0.3 * (2.0 * x).sin() * (1.5 * y).cos())
    };
    let points = (0..n * n).map(|k| net(k % n, k / n)).collect();
    let surface = Surface::new(knots.clone(), knots, points, None).unwrap();
    if turned { surface.swapped() } else { surface }
}

fn tiles() -> Document {
    let mut out = Document::new(Unit::Inch);
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let surface = Shape::Surface(Arc::new(tile(i, j, i == j)));
        out.add(format!("Fläche {i}'{j}"), surface, Some([0.25 * i as f32, 0.5, 0.75]));
    }
    out
}

fn saved(document: &Document, folder: &Path, name: &str) -> (std::path::PathBuf, io::Saved) {
    let path = folder.join(name);
    let saved = io::save(&path, document, &SaveOptions::default()).unwrap();
    (path, saved)
}

#[test]
fn surfaces_curves_names_colours_and_units_come_back() {
    let folder = tempfile::tempdir().unwrap();
    for unit in [Unit::Millimetre, Unit::Inch, Unit::Foot, Unit::Metre, Unit::Centimetre, Unit::Micrometre, Unit::Mil] {
        let mut document = tiles();
        document.unit = unit;
        let circle = sweep::arc(DVec3::X * 3.0, DVec3::X, DVec3::Y, 0.5, 2.5).unwrap();
        document.add("arc", Shape::Curve(Arc::new(circle)), Some([1.0, 0.0, 0.0]));
        let last = document.entities()[1].id;
        document.edit(last, |e| e.visible = false);
        let (path, saved) = saved(&document, folder.path(), "out.step");
        assert_eq!((saved.entities, saved.notes.len()), (5, 0), "{:?}", saved.notes);
        let opened = io::open(&path).unwrap();
        assert_eq!(opened.report.count(Severity::Skipped), 0, "{:?}", opened.report);
        let back = opened.document;
        assert_eq!((back.unit, back.entities().len()), (unit, 5));
        for (was, is) in document.entities().iter().zip(back.entities()) {
            assert_eq!((&was.name, was.color, was.visible), (&is.name, is.color, is.visible));
            match (was.surface(), is.surface(), was.curve(), is.curve()) {
                (Some(a), Some(b), ..) => assert_eq!((a.knots(), a.points()), (b.knots(), b.points())),
                (.., Some(a), Some(b)) => {
                    assert_eq!((a.knots(), a.points(), a.weights()), (b.knots(), b.points(), b.weights()))
                }
                _ => panic!("{} came back as something else", was.name),
            }
        }
    }
}

#[test]
fn tiles_of_one_function_are_one_shell_without_gaps_or_creases() {
    let folder = tempfile::tempdir().unwrap();
    let (path, saved) = saved(&tiles(), folder.path(), "tiles.stp");
    let seams = saved.export.unwrap();
    assert_eq!((seams.seams, seams.surfaces, seams.notes.len()), (4, 4, 0));
    assert!(seams.largest_gap < 1e-15);
    let text = std::fs::read_to_string(path).unwrap();
    let count = |what: &str| text.matches(what).count();
    assert_eq!(
        (count("OPEN_SHELL("), count("ADVANCED_FACE("), count("EDGE_CURVE("), count("VERTEX_POINT(")),
        (1, 4, 12, 9)
    );
    assert!(text.is_ascii());
}

#[test]
fn a_mesher_takes_tiles_as_one_surface() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = saved(&tiles(), folder.path(), "tiles.step");
    conforms(&path, 4, 12, 8);
}

#[test]
fn a_mesher_takes_closed_and_rational_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let circle = sweep::arc(DVec3::X * 3.0, DVec3::X, DVec3::Z, 0.0, std::f64::consts::TAU).unwrap();
    let ring = sweep::revolved(&circle, DVec3::ZERO, DVec3::Z, 0.0, 4.0).unwrap();
    let line = Curve::segment(DVec3::new(9.0, 0.0, 0.0), DVec3::new(9.0, 0.0, 2.0)).unwrap();
    let tube = sweep::revolved(&line, DVec3::X * 8.0, DVec3::Z, 0.0, 5.0).unwrap();
    let mut document = Document::new(Unit::Millimetre);
    document.add("ring", Shape::Surface(Arc::new(ring)), None);
    document.add("tube", Shape::Surface(Arc::new(tube)), None);
    let shells = Shells::of(&document, 1e-6);
    assert_eq!((shells.edges.len(), shells.shells.len()), (3 + 4, 2));
    let (path, _) = saved(&document, folder.path(), "closed.step");
    let Some(mesh) = meshed(&path) else { return };
    assert_eq!((mesh["faces"], mesh["curves"]), (2, 7));
    assert_eq!((mesh["crowded"], mesh["twins"]), (0, 0));
}

/// Heals a shared model by a specification and meshes the patches.
fn healed(model: &str, spec: &str) -> Option<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let model = root.join("../shared/data/models").join(model);
    if !model.exists() {
        println!("skipped: no shared data");
        return None;
    }
    let document = io::open(&model).unwrap().document;
    let spec = HealSpec::from_ron(&std::fs::read_to_string(root.join(spec)).unwrap()).unwrap();
    let healing = healing::run(&document, &spec, &Job::new()).unwrap();
    let mut out = Document::new(document.unit);
    for (name, patch) in &healing.patches {
        out.add(name, Shape::Patch(Arc::new(patch.clone())), None);
    }
    let folder = tempfile::tempdir().unwrap();
    let (path, saved) = saved(&out, folder.path(), "healed.step");
    println!("{:?}", saved.export);
    let shells = Shells::of(&out, out.tolerances().joining);
    let mut uses = vec![0; shells.edges.len()];
    shells.faces.iter().flat_map(|f| f.rings.iter().flatten()).for_each(|u| uses[u.edge] += 1);
    let free = uses.iter().filter(|&&n| n == 1).count();
    conforms(&path, shells.faces.len(), shells.edges.len(), free);
    Some(())
}

#[test]
fn the_healed_crossing_of_a_real_model_is_meshed_across_its_patches() {
    healed("pocc_surf114.igs", "tests/data/pocc_crossing.heal.ron");
}

#[test]
fn a_healed_region_of_an_airliner_is_one_shell_and_meshed_across_its_patches() {
    healed("afem_777.stp", "tests/data/afem_fuselage.heal.ron");
}

/// The sum of the areas of the faces of a file, and their number, as OpenCASCADE has them.
const AREA: &str = "
import sys, gmsh
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
gmsh.model.occ.importShapes(sys.argv[1], False)
gmsh.model.occ.synchronize()
faces = gmsh.model.getEntities(2)
print('AREA', len(faces), repr(sum(gmsh.model.occ.getMass(d, t) for d, t in faces)))
";

fn area_elsewhere(path: &Path) -> Option<(usize, f64)> {
    let output = Command::new(python()?).args(["-c", AREA]).arg(path).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = text.lines().find_map(|l| l.strip_prefix("AREA ")).unwrap();
    let (faces, area) = line.split_once(' ').unwrap();
    Some((faces.parse().unwrap(), area.parse().unwrap()))
}

#[test]
fn trimmed_faces_of_real_models_go_out_and_come_back() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/models");
    if !models.is_dir() {
        println!("skipped: no shared data");
        return;
    }
    let total = |document: &Document| document.sheets().map(|(_, sheet)| area(&sheet)).sum::<f64>();
    let folder = tempfile::tempdir().unwrap();
    for name in ["igesio_input.igs", "tigl_D150_wing.igs", "tigl_nacelle.stp", "pygem_pipe.step"] {
        let document = io::open(&models.join(name)).unwrap().document;
        let (faces, size) = (document.faces().count(), total(&document));
        for extension in ["step", "igs"] {
            let (path, written) = saved(&document, folder.path(), &format!("{name}.{extension}"));
            let back = io::open(&path).unwrap();
            let off = total(&back.document) / size - 1.0;
            println!("{name} as {extension}: {faces} faces, area off by {off:.1e}, {:?}", written.notes);
            assert_eq!(back.document.faces().count(), faces, "{name}: {:?}", back.report);
            assert!(off.abs() < 1e-6, "{name} as {extension}: {off}");
            assert_eq!(back.report.count(Severity::Skipped), 0);
            // In millimetres both.
            let scale = match document.unit {
                Unit::Inch => 25.4,
                Unit::Foot => 304.8,
                Unit::Metre => 1000.0,
                _ => 1.0,
            };
            let Some((count, elsewhere)) = area_elsewhere(&path) else { continue };
            let off = elsewhere / (size * scale * scale) - 1.0;
            println!("  elsewhere: {count} faces, area off by {off:.1e}");
            assert_eq!(count, faces, "{name} as {extension}");
            assert!(off.abs() < 1e-3, "{name} as {extension}: {off}");
        }
    }
}
