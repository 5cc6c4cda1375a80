//! `patchwright intersect FILE --a 0-3 --b 4-7`: where two sets of bodies meet, or all pairs of a model.

use std::path::{Path, PathBuf};

use super::{CliError, Common, Exit, ProgressLine, ranges};
use crate::io::{self, Format, SaveOptions};
use crate::kernel::intersect::{self, intersect_every_pair, intersect_with};
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::Intersection;
use crate::model::document::Document;
use crate::model::traces::traces_of;

/// Arguments of `intersect`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The bodies of the first side, counted from 0 in file order: `0-3,5`; surfaces first, then meshes and blocks
    /// [default, without --b: all pairs]
    #[arg(long, value_name = "LIST")]
    pub a: Option<String>,
    /// The bodies of the second side [default: all that are not in --a]
    #[arg(long, value_name = "LIST", requires = "a")]
    pub b: Option<String>,
    /// How: on the exact surfaces (bvh) or on triangulations (mesh)
    /// [default: bvh; mesh where a mesh or block takes part]
    #[arg(long, value_enum)]
    pub engine: Option<Engine>,
    /// How closely curves follow, in model units [default: 1e-6 of the diagonal]
    #[arg(long, value_name = "T")]
    pub tol: Option<f64>,
    /// Write the curves to this file as cubic B-splines (those on meshes and blocks as the polylines that they are), with
    /// the surfaces that they run on; IGES also holds the curves on these surfaces
    #[arg(long, value_name = "CURVES")]
    pub out: Option<PathBuf>,
}

/// The two engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Engine {
    /// Exact surfaces with a certificate.
    Bvh,
    /// Triangulations.
    Mesh,
}

/// Runs `intersect`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = io::open(&args.file)?;
    let bodies: Vec<(usize, Body)> = opened.document.bodies().map(|(_, body)| body).enumerate().collect();
    let pick = |list: &str| -> Result<Vec<(usize, Body)>, CliError> {
        let one = |n: usize| match bodies.get(n) {
            Some(body) => Ok(body.clone()),
            None => Err(CliError::BadArguments(format!(
                "there is no surface {n}: {} has {}, counted from 0",
                args.file.display(),
                bodies.len()
            ))),
        };
        ranges::parse(list).map_err(CliError::BadArguments)?.into_iter().map(one).collect()
    };
    let sides = match (&args.a, &args.b) {
        (Some(a), Some(b)) => Some((pick(a)?, pick(b)?)),
        (Some(a), None) => {
            let a = pick(a)?;
            let rest = bodies.iter().filter(|(n, _)| a.iter().all(|(m, _)| m != n)).cloned().collect();
            Some((a, rest))
        }
        (None, _) => None,
    };
    let engine = match args.engine {
        Some(Engine::Bvh) => intersect::Engine::Bvh,
        Some(Engine::Mesh) => intersect::Engine::Mesh,
        None => match &sides {
            Some((a, b)) => intersect::Engine::for_bodies(a.iter().chain(b).map(|(_, body)| body)),
            None => intersect::Engine::for_bodies(bodies.iter().map(|(_, body)| body)),
        },
    };
    let job = super::job();
    let progress = ProgressLine::watch(&job);
    let result = match &sides {
        Some((a, b)) => intersect_with(engine, a, b, args.tol, &job),
        None => intersect_every_pair(engine, &bodies, args.tol, &job),
    };
    let result = result.map_err(|e| CliError::BadArguments(e.to_string()))?;
    drop(progress);
    for warning in job.warnings() {
        common.warn(warning);
    }
    tell(&result, common);
    if let Some(path) = &args.out {
        write(path, &result, &opened.document, common)?;
    }
    common.json(&result)?;
    Ok(if result.complete { Exit::Done } else { Exit::Incomplete })
}

/// Writes the curves as B-splines within the tolerance, in space and on the surfaces.
fn write(path: &Path, result: &Intersection, model: &Document, common: &Common) -> Result<(), CliError> {
    let fitted = traces_of(result, model, result.tol);
    for note in &fitted.notes {
        common.warn(note.clone());
    }
    let saved = match Format::of_name(path) {
        Some(Format::Iges) => io::save_iges(path, &fitted.document, &fitted.traces)?,
        _ => io::save(path, &fitted.document, &SaveOptions::default())?,
    };
    common.say(format!(
        "{} curves written to {} ({} entities), within {:.1e} of both surfaces",
        fitted.curves.len(),
        path.display(),
        saved.entities,
        fitted.bound
    ));
    Ok(())
}

fn tell(result: &Intersection, common: &Common) {
    let loops = result.curves.iter().filter(|c| c.closed).count();
    common.say(format!(
        "{} curves ({loops} closed), {} points of contact, {} coincident regions",
        result.curves.len(),
        result.junctions.len(),
        result.regions.len()
    ));
    for (k, curve) in result.curves.iter().enumerate() {
        common.say(format!(
            "  curve {k}: {:?}, {:?} to {:?}, {} points, within {:.1e} of both surfaces",
            curve.kind,
            curve.ends[0],
            curve.ends[1],
            curve.points.len(),
            curve.error_bound
        ));
    }
    for junction in &result.junctions {
        common.say(format!("  {:?} contact at {}, gap {:.1e}", junction.kind, junction.xyz, junction.gap));
    }
    for place in &result.unresolved {
        common.warn(format!(
            "unresolved: surface {} over {:?} with surface {} over {:?}: {}",
            place.a, place.uv_box, place.b, place.st_box, place.reason
        ));
    }
}
