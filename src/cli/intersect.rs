//! `patchwright intersect FILE --a 0-3 --b 4-7`: where two sets of surfaces meet.

use std::path::PathBuf;

use super::{CliError, Common, Exit, ProgressLine, ranges};
use crate::io::{self, SaveOptions};
use crate::kernel::geom::Curve;
use crate::kernel::intersect::{self, intersect_with};
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::Intersection;
use crate::model::document::{Document, Shape};

/// Arguments of `intersect`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file to read
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The bodies of the first side, counted from 0 in file order: `0-3,5`; surfaces first, then meshes and blocks
    #[arg(long, value_name = "LIST")]
    pub a: String,
    /// The bodies of the second side
    #[arg(long, value_name = "LIST")]
    pub b: String,
    /// How: on the exact surfaces (bvh) or on triangulations (mesh)
    /// [default: bvh; mesh where a mesh or block takes part]
    #[arg(long, value_enum)]
    pub engine: Option<Engine>,
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
    let numbers = |list: &str| ranges::parse(list).map_err(CliError::BadArguments);
    let (a, b) = (numbers(&args.a)?, numbers(&args.b)?);
    let opened = io::open(&args.file)?;
    let bodies: Vec<Body> = opened.document.bodies().map(|(_, body)| body).collect();
    let pick = |list: &[usize]| -> Result<Vec<(usize, Body)>, CliError> {
        let one = |&n: &usize| match bodies.get(n) {
            Some(body) => Ok((n, body.clone())),
            None => Err(CliError::BadArguments(format!(
                "there is no surface {n}: {} has {}, counted from 0",
                args.file.display(),
                bodies.len()
            ))),
        };
        list.iter().map(one).collect()
    };
    let (side_a, side_b) = (pick(&a)?, pick(&b)?);
    let both = || side_a.iter().chain(&side_b).map(|(_, body)| body);
    let engine = match args.engine {
        Some(Engine::Bvh) => intersect::Engine::Bvh,
        Some(Engine::Mesh) => intersect::Engine::Mesh,
        None => intersect::Engine::for_bodies(both()),
    };
    let job = super::job();
    let progress = ProgressLine::watch(&job);
    let result =
        intersect_with(engine, &side_a, &side_b, args.tol, &job).map_err(|e| CliError::BadArguments(e.to_string()))?;
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
