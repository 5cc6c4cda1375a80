//! `patchwright convert IN OUT`: from one format into another.

use std::path::PathBuf;

use serde::Serialize;

use super::export_args::{self, ExportArgs};
use super::{CliError, Common, Exit, info};
use crate::io::export::ExportSummary;
use crate::io::{self, ImportReport, SaveOptions, Severity};

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write; its extension says the format: .igs, .step, .stl, .obj, .xyz (Plot3D) or .patchwright.ron
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs, reason = "a text here would become the command's own help")]
    pub export: ExportArgs,
}

#[derive(Serialize)]
struct Converted {
    entities: usize,
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    export: Option<ExportSummary>,
    import: ImportReport,
}

/// Runs `convert`. What could not be read makes the result incomplete.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let options = SaveOptions { export: args.export.options()?, ..SaveOptions::default() };
    let opened = io::open(&args.input)?;
    info::say_report(&opened.report, Severity::Warning, common);
    let saved = io::save(&args.output, &opened.document, &options)?;
    saved.notes.iter().for_each(|note| common.say(format!("  note: {note}")));
    export_args::tell(&saved, common);
    common.say(format!("{} entities written to {}", saved.entities, args.output.display()));
    let lost = opened.report.count(Severity::Skipped);
    common.json(&Converted {
        entities: saved.entities,
        notes: saved.notes,
        export: saved.export,
        import: opened.report,
    })?;
    if lost > 0 {
        common.warn(format!("{lost} entities of {} could not be read; see the lines above", args.input.display()));
        return Ok(Exit::Incomplete);
    }
    Ok(Exit::Done)
}
