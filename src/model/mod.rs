//! What a user has: documents, the commands that change them, and undo.

pub mod document;
pub mod spec;
