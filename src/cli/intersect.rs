//! `patchwright intersect FILE --a 0-3 --b 4-7`: where two sets of surfaces meet.

use std::path::PathBuf;

use super::{CliError, Common, Exit, ProgressLine, ranges};
use crate::io::{self, SaveOptions};
use crate::kernel::geom::{Curve, Surface};
use crate::kernel::ssi::{Intersection, SsiOptions, intersect};
use crate::model::document::{Document, Shape};

/// Arguments of `intersect`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The surfaces of the first side, counted from 0 in file order: `0-3,5`
    #[arg(long, value_name = "LIST")]
    pub a: String,
    /// The surfaces of the second side
    #[arg(long, value_name = "LIST")]
    pub b: String,
    /// How: on the exact surfaces (bvh) or on triangulations (mesh)
    #[arg(long, value_enum, default_value_t = Engine::Bvh)]
    pub engine: Engine,
    /// How closely curves follow, in model units [default: 1e-6 of the diagonal]
    #[arg(long, value_name = "T")]
    pub tol: Option<f64>,
    /// Write the curves to this file; its extension says the format
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
    if args.engine == Engine::Mesh {
        return Err(CliError::BadArguments("--engine mesh is not there yet; use --engine bvh".into()));
    }
    let numbers = |list: &str| ranges::parse(list).map_err(CliError::BadArguments);
    let (a, b) = (numbers(&args.a)?, numbers(&args.b)?);
    let opened = io::open(&args.file)?;
    let surfaces: Vec<_> = opened.document.surfaces().map(|(_, s)| s).collect();
    let pick = |list: &[usize]| -> Result<Vec<(usize, &Surface)>, CliError> {
        let one = |&n: &usize| match surfaces.get(n) {
            Some(surface) => Ok((n, surface.as_ref())),
            None => Err(CliError::BadArguments(format!(
                "there is no surface {n}: {} has {}, counted from 0",
                args.file.display(),
                surfaces.len()
            ))),
        };
        list.iter().map(one).collect()
    };
    let (side_a, side_b) = (pick(&a)?, pick(&b)?);
    let job = super::job();
    let options = SsiOptions { tol: args.tol, ..SsiOptions::default() };
    let progress = ProgressLine::watch(&job);
    let result = intersect(&side_a, &side_b, &options, &job).map_err(|e| CliError::BadArguments(e.to_string()))?;
    drop(progress);
    for warning in job.warnings() {
        common.warn(warning);
    }
    tell(&result, common);
    if let Some(path) = &args.out {
        let document = curves(&result, &opened.document);
        let saved = io::save(path, &document, &SaveOptions::default())?;
        common.say(format!("{} curves written to {}", saved.entities, path.display()));
    }
    common.json(&result)?;
    Ok(if result.complete { Exit::Done } else { Exit::Incomplete })
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

/// The curves as a document, polylines within the tolerance.
fn curves(result: &Intersection, model: &Document) -> Document {
    let mut document = Document::new(model.unit);
    for (k, curve) in result.curves.iter().enumerate() {
        let points: Vec<_> = curve.points.iter().map(|p| p.xyz).collect();
        if let Ok(line) = Curve::polyline(&points) {
            document.add(format!("intersection {k}"), Shape::Curve(line.into()), None);
        }
    }
    document
}
