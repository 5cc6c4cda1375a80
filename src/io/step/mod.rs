//! STEP files (ISO 10303, AP203, AP214, AP242): faces, shells, solids and bare geometry as surfaces and curves.
//!
//! Trimmed faces open as their untrimmed surfaces for now, and the report says so. Assemblies are placed, units
//! taken over. Nothing is dropped silently: what the walk from the representations meets becomes geometry or a
//! line of the report, and geometry that no representation reaches is counted there.

mod access;
pub mod part21;
mod shapes;
mod structure;

pub use structure::read;

/// Reads the bytes of a file. Bytes that are not UTF-8 only spoil the strings in which they stand.
pub fn open(bytes: &[u8]) -> crate::io::Opened {
    let mut report = crate::io::ImportReport::default();
    let document = read(&String::from_utf8_lossy(bytes), &mut report);
    crate::io::Opened { document, report }
}
