//! The two ways in which a subcommand fails.

use std::error::Error;

use super::Exit;

/// Why a subcommand stopped. It is no [`Error`] itself, so that `?` takes every error there is.
#[derive(Debug)]
pub enum CliError {
    /// What was asked for makes no sense.
    BadArguments(String),
    /// It made sense and did not work.
    Failed(Box<dyn Error>),
}

impl CliError {
    /// A failure that is only a message.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::Failed(message.into().into())
    }

    /// The exit code it leads to.
    pub fn exit(&self) -> Exit {
        match self {
            Self::BadArguments(_) => Exit::BadArguments,
            Self::Failed(_) => Exit::Failed,
        }
    }

    /// What happened, for people.
    pub fn message(&self) -> String {
        match self {
            Self::BadArguments(message) => message.clone(),
            Self::Failed(error) => error.to_string(),
        }
    }
}

impl<E: Error + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error))
    }
}
