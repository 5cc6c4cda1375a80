//! STEP files (ISO 10303, AP203, AP214, AP242): faces, shells, solids and bare geometry as surfaces and curves.
//!
//! Faces are trimmed and share their edges. Assemblies are placed; units, colours and names taken over. Nothing is dropped
//! silently: what the walk from the representations meets becomes geometry or a line of the report, and geometry that
//! no representation reaches is counted there. [`write`] writes AP242.

mod access;
mod assembly;
mod curves;
mod faces;
pub mod part21;
mod structure;
mod style;
mod surfaces;
mod units;
mod write;

pub use structure::read;
pub use write::{StepOptions, write};

/// Reads the bytes of a file. Bytes that are not UTF-8 only spoil the strings in which they stand.
pub fn open(bytes: &[u8]) -> crate::io::Opened {
    let mut report = crate::io::ImportReport::default();
    let document = read(&String::from_utf8_lossy(bytes), &mut report);
    crate::io::Opened { document, report }
}
