//! What holds of everything that a reader lets through, whatever the file was. The fuzz targets ask the same.

#![allow(dead_code, reason = "each test binary uses a part of it")]
#![allow(clippy::expect_used, reason = "a test helper may stop the test")]

use std::path::Path;

use glam::DVec2;
use patchwright::io::{self, Format, Opened};
use patchwright::kernel::geom::trim::Sheet;
use patchwright::model::spec::HealSpec;

/// Every entity is finite, and evaluating it is too.
pub fn checked(opened: &Opened) {
    for entity in opened.document.entities() {
        assert!(entity.bounds().max_abs().is_finite(), "{}: {:?}", entity.name, entity.bounds());
        if let Some(curve) = entity.curve() {
            assert!(curve.ends().iter().all(|p| p.is_finite()), "{}", entity.name);
        }
    }
    for (_, sheet) in opened.document.sheets() {
        let [u, v] = sheet.surface().domain();
        assert!(sheet.surface().eval(DVec2::new(u[0], v[1])).is_finite());
        if let Sheet::Trimmed(face) = &sheet {
            for edge in face.rings().iter().flat_map(|r| &r.edges) {
                assert!(edge.curve.ends().iter().all(|p| p.is_finite()));
                assert!(edge.ends().iter().all(|uv| uv.is_finite()));
            }
        }
    }
}

/// Reads bytes as a format: an error that says something, or a sound document.
pub fn read(bytes: &[u8], format: Format) {
    match io::read(Path::new("fuzz"), bytes, Some(format)) {
        Ok(opened) => checked(&opened),
        Err(error) => assert!(error.to_string().len() > 20, "{error}"),
    }
}

/// Reads bytes as a patch specification; what is read is written and read back the same.
pub fn read_spec(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match HealSpec::from_ron(text) {
        Err(error) => assert!(error.to_string().len() > 10, "{error}"),
        Ok(spec) => {
            let written = spec.to_ron().expect("what was read can be written");
            // NaN is unequal to itself, so texts are compared.
            let again = HealSpec::from_ron(&written).expect("what was written can be read");
            assert_eq!(again.to_ron().expect("and written"), written);
        }
    }
}
