//! `patchwright bvh FILE --surface N --height H`: what the hierarchy of a surface takes, and what it finds with
//! another.

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use super::{CliError, Common, Exit, ProgressLine};
use crate::kernel::bvh::{
    BvhOptions, MAX_HEIGHT, Memory, Overlap, Summary, SurfaceTree, TraverseOptions, Verdict, VolumeKind, VolumeTree,
    early_exit, traverse,
};
use crate::kernel::geom::Surface;
use crate::model::document::Document;

/// Arguments of `bvh`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The file
    pub file: PathBuf,
    /// Number of the surface, in the order of the file, from 0
    #[arg(long, value_name = "N")]
    pub surface: usize,
    /// Quadtree levels: every Bezier patch has 2^H x 2^H leaves
    #[arg(long, value_name = "H", default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_HEIGHT)))]
    pub height: u32,
    /// Bounding volumes
    #[arg(long, value_enum, default_value_t = Volume::Rss)]
    pub volume: Volume,
    /// Leave nodes whole that are flatter than this, in model units (rss only)
    #[arg(long, value_name = "RADIUS", allow_negative_numbers = true)]
    pub flatness: Option<f64>,
    /// Number of a second surface to traverse it with
    #[arg(long, value_name = "M")]
    pub with: Option<usize>,
}

/// Bounding volumes as the command line names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Volume {
    /// Rectangle-swept spheres with osculating tori
    Rss,
    /// Axis-aligned boxes
    Aabb,
    /// Convex hulls of the control points
    Hull,
}

impl Volume {
    fn kind(self) -> VolumeKind {
        match self {
            Self::Rss => VolumeKind::Rss,
            Self::Aabb => VolumeKind::Aabb,
            Self::Hull => VolumeKind::Hull,
        }
    }
}

/// The JSON.
#[derive(Debug, Serialize)]
struct Output {
    volume: VolumeKind,
    height: u32,
    trees: Vec<Tree>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pair: Option<Pair>,
}

#[derive(Debug, Serialize)]
struct Tree {
    surface: usize,
    patches: [usize; 2],
    build_ms: f64,
    bytes: usize,
    parts: Parts,
}

/// Storage by part; the levels of rectangle-swept spheres.
#[derive(Debug, Serialize)]
struct Parts {
    nodes: usize,
    node_bytes: usize,
    tori: usize,
    torus_bytes: usize,
    other_bytes: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    levels: Vec<Summary>,
}

impl Parts {
    fn new(memory: &Memory, levels: Vec<Summary>) -> Self {
        Self {
            nodes: memory.nodes,
            node_bytes: memory.node_bytes,
            tori: memory.tori,
            torus_bytes: memory.torus_bytes,
            other_bytes: memory.other_bytes,
            levels,
        }
    }
}

#[derive(Debug, Serialize)]
struct Pair {
    with: usize,
    leaf_pairs: usize,
    tests: u64,
    traverse_ms: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    early_exit: Option<EarlyExit>,
}

/// The traversal that stops where the normal cones are apart.
#[derive(Debug, Serialize)]
struct EarlyExit {
    pairs: usize,
    leaf_pairs: usize,
    tests: u64,
    traverse_ms: f64,
}

fn milliseconds(start: Instant) -> f64 {
    1e3 * start.elapsed().as_secs_f64()
}

/// Runs `bvh`.
pub fn run(args: &Args, common: &Common) -> Result<Exit, CliError> {
    let opened = crate::io::open(&args.file)?;
    let first = surface(&opened.document, args.surface)?;
    let second = args.with.map(|n| surface(&opened.document, n)).transpose()?;
    if args.flatness.is_some() && args.volume != Volume::Rss {
        return Err(CliError::BadArguments("--flatness goes with --volume rss only".to_owned()));
    }
    if let Some(flat) = args.flatness.filter(|flat| !(*flat > 0.0)) {
        return Err(CliError::BadArguments(format!("--flatness is {flat}, it must be positive")));
    }
    let options = BvhOptions { height: args.height, flatness: args.flatness, ..BvhOptions::default() };
    let job = super::job();
    let progress = ProgressLine::watch(&job);
    let surfaces = [Some((args.surface, first)), args.with.zip(second)];
    let surfaces = surfaces.into_iter().flatten();
    let mut trees = Vec::new();
    let pair = if args.volume == Volume::Rss {
        let mut built = Vec::new();
        for (number, surface) in surfaces {
            let start = Instant::now();
            let tree = SurfaceTree::new(surface, &options)?;
            tree.build_all(true, &job)?;
            let build_ms = milliseconds(start);
            let memory = tree.memory();
            if job.is_cancelled() {
                return Ok(Exit::Cancelled);
            }
            let parts = Parts::new(&memory, tree.summaries());
            let (patches, bytes) = (tree.grid(), memory.total());
            trees.push(Tree { surface: number, patches, build_ms, bytes, parts });
            built.push(tree);
        }
        match (&built[..], args.with) {
            ([a, b], Some(with)) => {
                let options = TraverseOptions::default();
                let start = Instant::now();
                let all = traverse(a, b, &options, |_| Verdict::Descend, &job);
                let mut pair = pair(with, &all, milliseconds(start));
                let start = Instant::now();
                let early = traverse(a, b, &options, |pair| early_exit(a, b, pair), &job);
                pair.early_exit = Some(EarlyExit {
                    pairs: early.pairs.len(),
                    leaf_pairs: early.leaf_pairs,
                    tests: early.tests,
                    traverse_ms: milliseconds(start),
                });
                Some(pair)
            }
            _ => None,
        }
    } else {
        let mut built = Vec::new();
        for (number, surface) in surfaces {
            let start = Instant::now();
            let tree = VolumeTree::build(surface, &options, args.volume.kind(), &job)?;
            let patches = surface.knots().each_ref().map(|k| k.breaks().len() - 1);
            let (build_ms, memory) = (milliseconds(start), tree.memory());
            let parts = Parts::new(&memory, Vec::new());
            trees.push(Tree { surface: number, patches, build_ms, bytes: memory.total(), parts });
            built.push(tree);
        }
        match (&built[..], args.with) {
            ([a, b], Some(with)) => {
                let start = Instant::now();
                let all = a.overlap(b, None, 0.0, &job);
                Some(pair(with, &all, milliseconds(start)))
            }
            _ => None,
        }
    };
    drop(progress);
    let output = Output { volume: args.volume.kind(), height: args.height, trees, pair };
    say(&output, common);
    common.json(&output)?;
    Ok(if job.is_cancelled() { Exit::Cancelled } else { Exit::Done })
}

fn pair(with: usize, overlap: &Overlap, traverse_ms: f64) -> Pair {
    Pair { with, leaf_pairs: overlap.leaf_pairs, tests: overlap.tests, traverse_ms, early_exit: None }
}

fn surface(document: &Document, number: usize) -> Result<&Surface, CliError> {
    document.surfaces().nth(number).map(|(_, surface)| &**surface).ok_or_else(|| {
        let count = document.surfaces().count();
        CliError::BadArguments(match count {
            0 => format!("there is no surface {number}: the file has none"),
            _ => format!("there is no surface {number}: the file has {count}, numbered from 0 to {}", count - 1),
        })
    })
}

fn say(output: &Output, common: &Common) {
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    for tree in &output.trees {
        common.say(format!(
            "surface {}: {} x {} Bezier patches, height {}: {:.3} MB, built in {:.2} ms",
            tree.surface,
            tree.patches[0],
            tree.patches[1],
            output.height,
            megabytes(tree.bytes),
            tree.build_ms
        ));
        let parts = &tree.parts;
        common.say(format!(
            "  {} nodes {:.3} MB, {} tori {:.3} MB, other {:.3} MB",
            parts.nodes,
            megabytes(parts.node_bytes),
            parts.tori,
            megabytes(parts.torus_bytes),
            megabytes(parts.other_bytes)
        ));
        for level in &parts.levels {
            common.say(format!(
                "  level {}: {} nodes, radius at most {:.3e}, torus deviation at most {}",
                level.level,
                level.nodes,
                level.largest_radius,
                level.largest_deviation.map_or("-".to_owned(), |d| format!("{d:.3e}"))
            ));
        }
    }
    if let Some(pair) = &output.pair {
        common.say(format!(
            "with surface {}: {} overlapping leaf pairs, {} tests, {:.2} ms",
            pair.with, pair.leaf_pairs, pair.tests, pair.traverse_ms
        ));
        if let Some(early) = &pair.early_exit {
            common.say(format!(
                "  with early exit: {} pairs, {} of leaves, {} tests, {:.2} ms",
                early.pairs, early.leaf_pairs, early.tests, early.traverse_ms
            ));
        }
    }
}
