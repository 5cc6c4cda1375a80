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
    for (severity, entity, reason, count) in opened.report.grouped() {
        common.say(format!("  {} {entity} x {count}: {reason}", severity.name()));
    }
    Ok(Exit::Done)
}
