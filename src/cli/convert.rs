//! `patchwright convert IN OUT`: from one format into another.

use std::path::PathBuf;

use super::{CliError, Common, Exit};
use crate::io::{self, SaveOptions};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write; its extension says the format
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
}

/// Runs `convert`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = io::open(&args.input)?;
    let saved = io::save(&args.output, &opened.document, &SaveOptions::default())?;
    common.say(format!("{} entities written to {}", saved.entities, args.output.display()));
    Ok(Exit::Done)
}
