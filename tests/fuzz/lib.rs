//! What the fuzz targets ask of every reader: that of the tests.

#[path = "../support/fuzzed.rs"]
mod fuzzed;

pub use fuzzed::{read, read_spec};
