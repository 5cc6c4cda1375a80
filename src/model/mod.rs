//! What a user has: documents, the commands that change them, and undo.

pub mod command;
pub mod defects;
pub mod document;
pub mod examples;
pub mod healing;
pub mod history;
pub mod replay;
pub mod resolve;
pub mod selection;
pub mod shell;
pub mod spec;
pub mod topology;
pub mod traces;
