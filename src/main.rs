//! Arguments -> editor or subcommand; exit codes; nothing else.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use patchwright::cli::{self, Arguments, Exit};

fn main() -> ExitCode {
    env_logger::init();
    let arguments = Arguments::parse();
    match &arguments.command {
        Some(command) => cli::run(command, &arguments.common).into(),
        None => edit(arguments.files).into(),
    }
}

/// Opens the editor on the files, or on the bundled example when there are none.
#[cfg(feature = "editor")]
fn edit(files: Vec<PathBuf>) -> Exit {
    match patchwright::ui::run(files) {
        Ok(()) => Exit::Done,
        Err(reason) => {
            eprintln!("{reason}");
            Exit::Failed
        }
    }
}

/// Says that there is no window.
#[cfg(not(feature = "editor"))]
fn edit(_files: Vec<PathBuf>) -> Exit {
    eprintln!("This build of patchwright has no window; see `patchwright --help` for its subcommands.");
    Exit::Failed
}
