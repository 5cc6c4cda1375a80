//! `patchwright info FILE`: what a file contains.

use std::path::PathBuf;

use super::{CliError, Common, Exit};

/// Arguments of `info`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file
    pub file: PathBuf,
}

/// Runs `info`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = crate::io::open(&args.file)?;
    common.say(format!("{} surfaces, {} curves", opened.report.surfaces, opened.report.curves));
    Ok(Exit::Done)
}
