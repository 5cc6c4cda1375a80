//! `patchwright heal FILE --patches SPEC.ron --out OUT`: patches over the broken parts of a model.

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use super::export_args::{self, ExportArgs};
use super::{CliError, Common, Exit, ProgressLine};
use crate::io::export::ExportSummary;
use crate::io::{self, SaveOptions};
use crate::model::document::{Document, Shape};
use crate::model::healing::{self, Healing};
use crate::model::spec::{HealSpec, HealStep};

/// Arguments of `heal`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The model
    pub file: PathBuf,
    /// What to heal: four sides for every patch, as the picking tool writes them
    #[arg(long, value_name = "SPEC.ron")]
    pub patches: PathBuf,
    /// The largest error wanted, in model units [default: the specification's, else 1e-4 of the diagonal]
    #[arg(long, value_name = "T")]
    pub tol: Option<f64>,
    /// Where the patches go; the extension says the format
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
    /// Write the original surfaces and curves too
    #[arg(long)]
    pub with_originals: bool,
    #[command(flatten)]
    #[allow(missing_docs, reason = "a text here would become the command's own help")]
    pub export: ExportArgs,
}

#[derive(Serialize)]
struct Output<'a> {
    complete: bool,
    tol: f64,
    diagonal: f64,
    patches: Vec<PatchOutput<'a>>,
    shared: Vec<SharedOutput<'a>>,
    warnings: Vec<String>,
    time_ms: f64,
    /// How patches became triangles or grids, for STL, OBJ and Plot3D files.
    #[serde(skip_serializing_if = "Option::is_none")]
    export: Option<ExportSummary>,
}

#[derive(Serialize)]
struct PatchOutput<'a> {
    name: &'a str,
    reached: bool,
    max_error: f64,
    rms: f64,
    resolution: [usize; 2],
    iterations: usize,
    projected: usize,
    several: usize,
    artificial: usize,
    kept: usize,
    checked: usize,
    skipped: usize,
    slab: f64,
    corner_gaps: [f64; 4],
    history: &'a [HealStep],
}

#[derive(Serialize)]
struct SharedOutput<'a> {
    patches: [&'a str; 2],
    max_gap: f64,
    max_normal_angle_deg: f64,
}

/// Runs `heal`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let save = SaveOptions { export: args.export.options()?, ..SaveOptions::default() };
    let text = std::fs::read_to_string(&args.patches)
        .map_err(|error| CliError::failed(format!("cannot read {}: {error}", args.patches.display())))?;
    let mut spec = HealSpec::from_ron(&text)
        .map_err(|error| CliError::failed(format!("{} is no patch specification: {error}", args.patches.display())))?;
    if let Some(tol) = args.tol {
        if !(tol > 0.0 && tol.is_finite()) {
            return Err(CliError::BadArguments(format!("--tol is {tol}, it must be a positive length")));
        }
        spec.set_tol(tol);
    }
    let document = io::open(&args.file)?.document;
    let job = super::job();
    let start = Instant::now();
    let result = {
        let _progress = ProgressLine::watch(&job);
        healing::run(&document, &spec, &job)
    };
    let time_ms = start.elapsed().as_secs_f64() * 1e3;
    let healing = result?;
    for warning in job.warnings() {
        common.warn(format!("warning: {warning}"));
    }
    if healing.patches.is_empty() {
        return Err(CliError::failed("stopped before the first resolution was finished; nothing was written"));
    }
    tell(&healing, common);
    let saved = io::save(&args.out, &output(&document, &healing, args.with_originals), &save)?;
    saved.notes.iter().for_each(|note| common.say(format!("  note: {note}")));
    export_args::tell(&saved, common);
    common.say(format!("{} entities written to {}", saved.entities, args.out.display()));
    let tol = crate::model::resolve::options(&spec, &document).tol;
    common.json(&Output {
        complete: healing.healed.complete,
        tol,
        diagonal: document.bounds().diagonal(),
        patches: patches(&healing),
        shared: shared(&healing),
        warnings: job.warnings(),
        time_ms,
        export: saved.export,
    })?;
    let reached = healing.patches.iter().all(|(_, p)| p.report.reached);
    if !reached {
        common.warn(format!("the error wanted, {tol:.3e}, was not reached everywhere"));
    }
    Ok(if reached && healing.healed.complete { Exit::Done } else { Exit::Incomplete })
}

/// The document that is written: the patches, after the originals where these are wanted.
fn output(document: &Document, healing: &Healing, with_originals: bool) -> Document {
    let mut out = document.clone();
    if !with_originals {
        out.retain(|_| false);
    }
    for (name, patch) in &healing.patches {
        out.add(name, Shape::Patch(std::sync::Arc::new(patch.clone())), None);
    }
    out
}

fn patches(healing: &Healing) -> Vec<PatchOutput<'_>> {
    let mut out = Vec::new();
    for (patch, closed) in healing.healed.patches.iter().zip(&healing.healed.loops) {
        let r = &patch.report;
        out.push(PatchOutput {
            name: &patch.name,
            reached: r.reached,
            max_error: r.max_error,
            rms: r.rms,
            resolution: r.resolution,
            iterations: r.iterations,
            projected: r.projected,
            several: r.several,
            artificial: r.artificial,
            kept: r.kept,
            checked: r.checked,
            skipped: r.skipped,
            slab: patch.slab,
            corner_gaps: closed.gaps,
            history: &r.history,
        });
    }
    out
}

fn shared(healing: &Healing) -> Vec<SharedOutput<'_>> {
    let name = |p: usize| healing.healed.patches.get(p).map_or("", |p| p.name.as_str());
    let all = healing.healed.shared.iter();
    all.map(|s| SharedOutput {
        patches: s.patches.map(name),
        max_gap: s.max_gap,
        max_normal_angle_deg: s.max_normal_angle_deg,
    })
    .collect()
}

/// A table for people.
fn tell(healing: &Healing, common: &Common) {
    let width = healing.patches.iter().map(|p| p.0.chars().count()).max().unwrap_or(0).max(5);
    common.say(format!(
        "{:width$}  {:>9}  {:>9}  {:>7}  {:>9}  {:>10}  {:>7}",
        "patch", "max error", "rms", "spans", "projected", "artificial", "skipped"
    ));
    for (name, patch) in &healing.patches {
        let r = &patch.report;
        common.say(format!(
            "{name:width$}  {:>9.2e}  {:>9.2e}  {:>7}  {:>9}  {:>10}  {:>7}{}",
            r.max_error,
            r.rms,
            format!("{}x{}", r.resolution[0], r.resolution[1]),
            r.projected,
            r.artificial + r.kept,
            r.skipped,
            if r.reached { "" } else { "  not reached" }
        ));
    }
    for s in &healing.healed.shared {
        let [a, b] = s.patches.map(|p| &healing.healed.patches[p].name);
        common.say(format!("{a} | {b}: gap {:.1e}, normals within {:.2} deg", s.max_gap, s.max_normal_angle_deg));
    }
}
