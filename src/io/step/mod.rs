//! STEP files (ISO 10303, AP203, AP214, AP242).

pub mod part21;
