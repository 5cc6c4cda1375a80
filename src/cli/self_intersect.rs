//! `patchwright self-intersect FILE [--surface N]`: where surfaces meet themselves, with their miter points.

use std::path::PathBuf;
use std::sync::Arc;

use super::{CliError, Common, Exit, ProgressLine};
use crate::kernel::geom::trim::Sheet;
use crate::kernel::self_ssi::SelfIntersectOptions;
use crate::kernel::self_ssi::model::{merged, self_intersect_all};
use crate::kernel::ssi::clip::clip;
use crate::kernel::ssi::result::{CurveEnd, CurveKind, Intersection};

/// Arguments of `self-intersect`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file
    pub file: PathBuf,
    /// Only this surface, counted from 0 in the order of the file [default: all of them, each against itself]
    #[arg(long, value_name = "N")]
    pub surface: Option<usize>,
    /// How closely curves follow, in model units [default: 1e-6 of each surface's diagonal]
    #[arg(long, value_name = "T")]
    pub tol: Option<f64>,
}

/// Runs `self-intersect`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = crate::io::open(&args.file)?;
    let surfaces: Vec<_> = opened.document.surfaces().map(|(_, surface)| surface.clone()).collect();
    let sheets: Vec<Sheet> = opened.document.sheets().map(|(_, sheet)| sheet).collect();
    let numbers = match args.surface {
        Some(n) if n < surfaces.len() => n..n + 1,
        Some(n) => {
            let count = surfaces.len();
            return Err(CliError::BadArguments(format!(
                "--surface {n}: the file has {count} surfaces, counted from 0"
            )));
        }
        None => 0..surfaces.len(),
    };
    if let Some(tol) = args.tol.filter(|t| !(t.is_finite() && *t > 0.0)) {
        return Err(CliError::BadArguments(format!("--tol {tol}: it must be positive and finite")));
    }
    let job = super::job();
    let progress = ProgressLine::watch(&job);
    let options = SelfIntersectOptions { tol: args.tol, ..SelfIntersectOptions::default() };
    let chosen: Vec<_> = numbers.filter_map(|n| surfaces.get(n).map(|s| (n, s))).collect();
    let mut all = merged(self_intersect_all(&chosen, &options, &job)?.into_iter().map(|found| found.result));
    clip(&mut all, &|number| match sheets.get(number) {
        Some(Sheet::Trimmed(face)) => Some(Arc::clone(face)),
        _ => None,
    });
    drop(progress);
    for warning in job.warnings() {
        common.warn(warning);
    }
    tell(&all, common);
    common.json(&all)?;
    Ok(if job.is_cancelled() {
        Exit::Cancelled
    } else if all.complete {
        Exit::Done
    } else {
        Exit::Incomplete
    })
}

fn tell(all: &Intersection, common: &Common) {
    common.say(format!(
        "{} self-intersection curves, {} miter points, {} triple points, {} coincident regions, {} unresolved",
        all.curves.iter().filter(|c| c.kind == CurveKind::SelfIntersection).count(),
        all.miters.len(),
        all.junctions.len(),
        all.regions.len(),
        all.unresolved.len()
    ));
    for curve in &all.curves {
        let name = |end: CurveEnd| format!("{end:?}").to_lowercase();
        let kind = match curve.kind {
            CurveKind::CuspEdge => "cusp edge, ",
            CurveKind::CoincidentBoundary => "border of a coincident region, ",
            _ => "",
        };
        let surface = curve.points.first().map_or(0, |p| p.a);
        common.say(format!(
            "  surface {surface}: {kind}{} points, {} to {}, within {:.1e}",
            curve.points.len(),
            name(curve.ends[0]),
            name(curve.ends[1]),
            curve.error_bound
        ));
    }
    for miter in &all.miters {
        let isolated = if miter.isolated { ", isolated" } else { "" };
        common.say(format!("  surface {}: miter point at {}, parameters {}{isolated}", miter.a, miter.xyz, miter.uv));
    }
    for junction in &all.junctions {
        common.say(format!("  surface {}: triple point at {}", junction.a, junction.xyz));
    }
    for place in &all.unresolved {
        common.warn(format!(
            "unresolved: surface {} over {:?} with itself over {:?}: {}",
            place.a, place.uv_box, place.st_box, place.reason
        ));
    }
}
