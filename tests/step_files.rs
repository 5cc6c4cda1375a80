//! Real STEP files.

use patchwright::io::{ImportReport, Opened, Severity, step};
use patchwright::model::document::{Document, Unit};

fn read(name: &str) -> Option<(Document, ImportReport)> {
    let path = format!(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/models/{}"), name);
    let Ok(bytes) = std::fs::read(path) else {
        println!("skipped: no shared data ({name})");
        return None;
    };
    let Opened { document, report } = step::open(&bytes);
    println!("{name}: {:?}, {:?}", document.bounds(), report.lines);
    Some((document, report))
}

#[test]
fn every_face_of_the_shared_files_becomes_a_surface() {
    // Counted in the files themselves.
    for (name, surfaces, unit) in [
        ("afem_777.stp", 113, Unit::Foot),
        ("tigl_nacelle.stp", 6, Unit::Millimetre),
        ("pygem_pipe.step", 6, Unit::Millimetre),
    ] {
        let Some((document, report)) = read(name) else { continue };
        assert_eq!(document.surfaces().count(), surfaces, "{name}");
        assert_eq!(report.count(Severity::Skipped), 0, "{name}");
        assert_eq!(document.unit, unit, "{name}");
    }
}
