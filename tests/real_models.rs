//! Real models: every file opens, every face of it is there and trimmed, and their areas are those of another program.
//!
//! The expected figures are those of OpenCASCADE 7.8 as Gmsh 4.15.2 has it, lengths in millimetres:
//! `gmsh.model.occ.importShapes(file, highestDimOnly=False)` and the sum of `gmsh.model.occ.getMass(2, face)`.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use std::path::PathBuf;

use patchwright::io::{self, Severity};
use patchwright::kernel::geom::trim::Sheet;
use patchwright::kernel::mesh::area::area;
use patchwright::model::document::{Document, Unit};

struct Expected {
    file: &'static str,
    /// Faces and surfaces together.
    faces: usize,
    /// Of these, those with loops of their own.
    trimmed: usize,
    /// Square millimetres.
    area: f64,
}

const MODELS: [Expected; 8] = [
    Expected { file: "igesio_input.igs", faces: 7, trimmed: 7, area: 14_581.526_692_474_1 },
    Expected { file: "tigl_D150_wing.igs", faces: 8, trimmed: 8, area: 132_018_428.514_705 },
    Expected { file: "hyrban_headlamp_L.igs", faces: 80, trimmed: 80, area: 58_115.128_465_733 },
    Expected { file: "hyrban_rear_screen.igs", faces: 66, trimmed: 66, area: 733_715.920_091_788 },
    Expected { file: "tigl_nacelle.stp", faces: 6, trimmed: 6, area: 10_923_061.547_578_6 },
    Expected { file: "pygem_pipe.step", faces: 6, trimmed: 6, area: 69_113_881.116_160_3 },
    Expected { file: "afem_777.stp", faces: 113, trimmed: 0, area: 3_466_911_877.184_05 },
    Expected { file: "pocc_surf114.igs", faces: 4, trimmed: 0, area: 23_771.431_986_874_8 },
];

fn folder() -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/models"));
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: no shared data");
    None
}

fn millimetres(unit: Unit) -> f64 {
    match unit {
        Unit::Millimetre => 1.0,
        Unit::Inch => 25.4,
        Unit::Foot => 304.8,
        _ => f64::NAN,
    }
}

fn total(document: &Document) -> f64 {
    let scale = millimetres(document.unit);
    document.sheets().map(|(_, sheet)| area(&sheet)).sum::<f64>() * scale * scale
}

#[test]
fn faces_and_areas_are_those_of_another_program() {
    let Some(folder) = folder() else { return };
    let mut wrong = Vec::new();
    for expected in &MODELS {
        let opened = io::open(&folder.join(expected.file)).unwrap();
        let document = &opened.document;
        let trimmed = document.sheets().filter(|(_, s)| matches!(s, Sheet::Trimmed(_))).count();
        let found = total(document);
        let off = found / expected.area - 1.0;
        println!(
            "{}: {} surfaces, {trimmed} trimmed, area off by {off:.1e}",
            expected.file,
            document.surfaces().count()
        );
        for line in opened.report.lines.iter().filter(|l| l.severity >= Severity::Warning) {
            println!("  {line}");
        }
        if document.surfaces().count() != expected.faces || trimmed != expected.trimmed || off.abs() > 1e-3 {
            wrong.push(expected.file);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
