//! Worker threads: nothing that takes time runs on the window's thread.
//!
//! [`Jobs`] keeps one queue for heavy jobs, run one at a time in order, and one for previews, so that a preview
//! never waits behind a heavy job. A job that panics is caught and becomes an outcome with its input. A
//! [`Latest`] slot is for results that follow the user's hand: a new request cancels the one before, and the last
//! good value stays until the next is there.

mod jobs;
mod latest;

pub use jobs::{JobId, JobRecord, Jobs, Lane, Outcome, State, Ticket};
pub use latest::Latest;
