//! The command line: one file per subcommand, each with its `Args` and its `run`.
//!
//! `run(&Args, &Common)` returns the exit code of a run that worked, or a [`CliError`]. Results go out through
//! [`Common`].

use std::path::PathBuf;

use clap::{Parser, Subcommand};

pub mod bvh;
pub mod convert;
mod error;
pub mod examples;
mod exit;
pub mod export_args;
pub mod heal;
pub mod info;
mod interrupt;
pub mod intersect;
mod output;
pub mod ranges;
#[cfg(feature = "editor")]
pub mod render;
pub mod self_intersect;

pub use error::CliError;
pub use exit::Exit;
pub use interrupt::job;
pub use output::{Common, ProgressLine};

/// Heals broken CAD surface models and shows where surfaces truly intersect.
///
/// Without a subcommand the editor opens, with the files given or the bundled example.
#[derive(Debug, Parser)]
#[command(name = "patchwright", version, args_conflicts_with_subcommands = true)]
#[command(after_help = "Exit codes: 0 done, 1 failed, 2 bad arguments, 3 done but incomplete, 4 cancelled.")]
pub struct Arguments {
    /// Files to open in the editor
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// What to do instead
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Options of every subcommand.
    #[command(flatten)]
    pub common: Common,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Tell what a file contains: entities, bounding box, units
    Info(info::Args),
    /// Convert a file into another format
    Convert(convert::Args),
    /// Build the hierarchy of a surface: sizes, build and traversal times, pair counts
    Bvh(bvh::Args),
    /// Intersect two sets of surfaces
    Intersect(intersect::Args),
    /// Make a picture of a model
    #[cfg(feature = "editor")]
    Render(render::Args),
    /// Find where surfaces meet themselves, with their miter points
    SelfIntersect(self_intersect::Args),
    /// Lay B-spline patches over the broken parts of a model
    Heal(heal::Args),
    /// Write the bundled example models
    #[command(hide = true)]
    Examples(examples::Args),
}

/// Runs a subcommand and says on standard error why it failed, if it did.
pub fn run(command: &Command, common: &Common) -> Exit {
    if let Some(threads) = common.threads {
        // Only fails when the pool exists already, which is only so when somebody called this twice.
        if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global() {
            common.warn(format!("--threads {threads} has no effect: {error}"));
        }
    }
    let result = match command {
        Command::Info(args) => info::run(args, common),
        Command::Convert(args) => convert::run(args, common),
        Command::Bvh(args) => bvh::run(args, common),
        Command::Intersect(args) => intersect::run(args, common),
        #[cfg(feature = "editor")]
        Command::Render(args) => render::run(args, common),
        Command::Heal(args) => heal::run(args, common),
        Command::Examples(args) => examples::run(args, common),
        Command::SelfIntersect(args) => self_intersect::run(args, common),
    };
    let exit = result.unwrap_or_else(|error| {
        common.warn(format!("error: {}", error.message()));
        error.exit()
    });
    if interrupt::stopped() { Exit::Cancelled } else { exit }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn files_and_subcommands_are_told_apart() {
        let parse = |line: &str| Arguments::try_parse_from(line.split(' '));
        let files = parse("patchwright a.igs b.igs").unwrap();
        assert!(files.command.is_none() && files.files.len() == 2);
        let info = parse("patchwright info a.igs --json - --threads 2").unwrap();
        assert!(matches!(info.command, Some(Command::Info(_))));
        assert_eq!(info.common.threads, Some(2));
        assert!(parse("patchwright info").is_err());
        assert!(parse("patchwright info a.igs --threads 0").is_err());
    }
}
