//! What is written is what another CAD reader sees: OpenCASCADE, through Gmsh's Python package (`pip install gmsh`).
//! Skipped by name where there is none; `PATCHWRIGHT_PYTHON` names the interpreter that has it.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::process::Command;

use glam::{DVec2, DVec3};
use patchwright::io::{self, SaveOptions};
use patchwright::kernel::geom::{Knots, Surface, sweep};
use patchwright::model::document::{Document, Shape, Unit};

/// Prints, for every face: its type, its name, its parameter bounds, and its points on a grid of parameters.
const SCRIPT: &str = "
import sys, gmsh
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
gmsh.model.occ.importShapes(sys.argv[1], False)
gmsh.model.occ.synchronize()
for d, t in gmsh.model.getEntities(2):
    lo, hi = gmsh.model.getParametrizationBounds(d, t)
    n = 9
    uv = [x for i in range(n) for j in range(n)
          for x in (lo[0] + (hi[0] - lo[0]) * i / (n - 1), lo[1] + (hi[1] - lo[1]) * j / (n - 1))]
    p = gmsh.model.getValue(d, t, uv)
    print('|'.join([gmsh.model.getType(d, t), gmsh.model.getEntityName(d, t),
                    ' '.join(repr(float(x)) for x in uv), ' '.join(repr(float(x)) for x in p)]))
";

#[test]
fn opencascade_reads_the_same_surfaces_at_the_same_parameters() {
    let python = std::env::var("PATCHWRIGHT_PYTHON").unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import gmsh"]).output();
    if !there.is_ok_and(|o| o.status.success()) {
        println!("skipped: no Gmsh for {python}");
        return;
    }
    // Bicubic with double inner knots (as healed patches are), rational with a full turn, and unclamped knots.
    let knots = Knots::clamped(3, &[0.0, 0.25, 1.0, 1.5], 2).unwrap();
    let n = knots.control_count();
    let points =
        (0..n * n).map(|k| DVec3::new((k % n) as f64, (k / n) as f64 * 1.1, ((k * 7) % 5) as f64 / 3.0)).collect();
    let bicubic = Surface::new(knots.clone(), knots, points, None).unwrap();
    let circle = sweep::arc(DVec3::X * 3.0, DVec3::X, DVec3::Z, 0.5, 2.5).unwrap();
    let torus = sweep::revolved(&circle, DVec3::ZERO, DVec3::Z, 0.0, 4.0).unwrap();
    let open = Knots::new(2, vec![-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
    let points = (0..16).map(|i| DVec3::new(f64::from(i % 4), f64::from(i / 4), f64::from(i * i % 7))).collect();
    let unclamped = Surface::new(open.clone(), open, points, None).unwrap();
    let surfaces = [("bicubic", bicubic), ("torus", torus), ("unclamped", unclamped)];
    let mut document = Document::new(Unit::Millimetre);
    for (name, surface) in &surfaces {
        document.add(*name, Shape::Surface(surface.clone().into()), Some([0.2, 0.4, 0.6]));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.igs");
    io::save(&path, &document, &SaveOptions::default()).unwrap();
    let output = Command::new(&python).args(["-c", SCRIPT]).arg(&path).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let faces: Vec<Vec<&str>> =
        text.lines().map(|l| l.split('|').collect()).filter(|l: &Vec<&str>| l.len() == 4).collect();
    assert_eq!(faces.len(), surfaces.len(), "{text} {}", String::from_utf8_lossy(&output.stderr));
    for (face, (name, surface)) in faces.iter().zip(&surfaces) {
        assert_eq!(face[0], "BSpline surface");
        assert!(face[1].ends_with(name), "{}", face[1]);
        let numbers = |text: &str| -> Vec<f64> { text.split(' ').map(|v| v.parse().unwrap()).collect() };
        let (uv, xyz) = (numbers(face[2]), numbers(face[3]));
        assert_eq!((uv.len(), xyz.len()), (162, 243));
        for (uv, p) in uv.chunks(2).zip(xyz.chunks(3)) {
            let ours = surface.eval(surface.clamped(DVec2::new(uv[0], uv[1])));
            let theirs = DVec3::new(p[0], p[1], p[2]);
            assert!(ours.distance(theirs) < 1e-13 * 10.0, "{name} at {uv:?}: {ours} and {theirs}");
        }
    }
}
