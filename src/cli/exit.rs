//! Exit codes, a stable contract with scripts.

use std::process::ExitCode;

/// How a run of the program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Everything asked for was done.
    Done = 0,
    /// Nothing useful came out.
    Failed = 1,
    /// The arguments make no sense.
    BadArguments = 2,
    /// Done, but not all of it: unresolved pairs, a tolerance that was not reached.
    Incomplete = 3,
    /// Stopped by the user.
    Cancelled = 4,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
