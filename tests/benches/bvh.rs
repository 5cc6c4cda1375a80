//! The table of the hybrid hierarchy: storage, build, traversal and pair counts, beside the targets and the figures
//! of the thesis (Tables 8.1-8.4, one core of an i9-9900KF). All on one thread, medians.
//!
//! `cargo bench --bench bvh`; with the argument `build`, `lazy` or `traverse` it runs only that, once, for a profiler.

#[path = "../support/clock.rs"]
mod clock;

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use clock::{on_one_thread, together};
use glam::DVec3;
use patchwright::kernel::bvh::{
    BvhOptions, Instructions, Overlap, SurfaceTree, TraverseOptions, Verdict, VolumeKind, VolumeTree, early_exit,
    traverse,
};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::job::Job;

/// A generic bicubic patch: two principal curvatures that change sign.
fn patch() -> Result<Surface, Box<dyn Error>> {
    let heights = [0.0, 0.4, -0.3, 0.2, 0.3, 0.5, 0.1, -0.2, -0.1, 0.2, 0.6, 0.3, 0.1, -0.3, 0.2, 0.4];
    let point = |i: usize| DVec3::new((i % 4) as f64, (i / 4) as f64 + 0.1 * heights[i * 7 % 16], heights[i]);
    let points = (0..16).map(point).collect();
    Ok(Surface::new(Knots::bezier(3, 0.0, 1.0)?, Knots::bezier(3, 0.0, 1.0)?, points, None)?)
}

/// Two B-spline graphs of 17 x 17 bicubic patches that cross in 18 branches.
fn graphs() -> Result<Option<[Arc<Surface>; 2]>, Box<dyn Error>> {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases/graph_17x17_s11.igs"));
    if !file.exists() {
        println!("skipped: no shared data");
        return Ok(None);
    }
    let opened = patchwright::io::open(file)?;
    let surfaces: Vec<_> = opened.document.surfaces().map(|(_, s)| s.clone()).collect();
    Ok(<[_; 2]>::try_from(surfaces).ok())
}

/// Seconds of one run, after a preparation that is not counted.
fn seconds<T>(mut prepare: impl FnMut() -> T, mut run: impl FnMut(&T)) -> f64 {
    let prepared = prepare();
    let start = Instant::now();
    run(&prepared);
    let repeat = (0.08 / start.elapsed().as_secs_f64()).clamp(1.0, 64.0) as usize;
    drop(prepared);
    let prepared: Vec<T> = (0..repeat).map(|_| prepare()).collect();
    let mut left = prepared.iter();
    together(repeat, || left.by_ref().take(1).for_each(&mut run)).as_secs_f64() / repeat as f64
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn runs(count: usize, mut run: impl FnMut() -> f64) -> f64 {
    median((0..count).map(|_| run()).collect())
}

fn milliseconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.2} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}

struct Table(Vec<[String; 4]>);

impl Table {
    fn row(&mut self, what: &str, thesis: &str, target: &str, ours: impl Into<String>) {
        self.0.push([what, thesis, target, &ours.into()].map(str::to_owned));
    }
}

const SETS: [(Instructions, &str); 3] =
    [(Instructions::Plain, "plain"), (Instructions::Narrow, "2 lanes"), (Instructions::Best, "4 lanes, AVX2")];

fn options(height: u32, instructions: Instructions) -> BvhOptions {
    BvhOptions { height, instructions, ..BvhOptions::default() }
}

fn trees(surfaces: &[&Surface], options: &BvhOptions) -> Vec<SurfaceTree> {
    surfaces.iter().filter_map(|s| SurfaceTree::new(s, options).ok()).collect()
}

fn build(trees: &[SurfaceTree], tori: bool) {
    for tree in trees {
        let _ = black_box(tree.build_all(tori, &Job::new()));
    }
}

fn walk(a: &SurfaceTree, b: &SurfaceTree, level: Option<u32>, early: bool) -> Overlap {
    let options = TraverseOptions { parallel: false, level, ..TraverseOptions::default() };
    if early {
        traverse(a, b, &options, |pair| early_exit(a, b, pair), &Job::new())
    } else {
        traverse(a, b, &options, |_| Verdict::Descend, &Job::new())
    }
}

fn one_bezier(table: &mut Table) -> Result<(), Box<dyn Error>> {
    let surface = patch()?;
    let megabytes = |bytes: usize| format!("{:.3} MB", bytes as f64 / 1e6);
    // Table 8.1: convex hulls, boxes, swept spheres, tori.
    for (height, thesis, target) in [
        (4, ["1.599 MB", "0.112 MB", "0.142 MB", "0.157 MB"], ""),
        (5, ["6.374 MB", "0.447 MB", "0.493 MB", "0.605 MB"], ""),
        (6, ["25.414 MB", "1.792 MB", "2.217 MB", "2.334 MB"], "1.2 MB together"),
        (7, ["101.899 MB", "7.137 MB", "9.123 MB", "9.395 MB"], ""),
        (8, ["413.189 MB", "28.724 MB", "36.548 MB", "37.773 MB"], ""),
    ] {
        let options = options(height, Instructions::Best);
        let tree = SurfaceTree::new(&surface, &options)?;
        tree.build_all(true, &Job::new())?;
        let memory = tree.memory();
        let both = format!("{}, together {}", megabytes(memory.node_bytes), megabytes(memory.total()));
        table.row(&format!("storage, one Bezier, H = {height}: RSS"), thesis[2], target, both);
        table.row("  tori", thesis[3], "", megabytes(memory.torus_bytes));
        for (kind, name, thesis) in [(VolumeKind::Aabb, "AABB", thesis[1]), (VolumeKind::Hull, "hulls", thesis[0])] {
            let tree = VolumeTree::build(&surface, &options, kind, &Job::new())?;
            table.row(&format!("  {name}"), thesis, "", megabytes(tree.bytes()));
        }
    }
    for ((set, name), target) in SETS.into_iter().zip(["5 ms", "5 ms", "3 ms"]) {
        let prepare = || trees(&[&surface], &options(6, set));
        let both = runs(7, || seconds(prepare, |trees| build(trees, true)));
        let nodes = runs(7, || seconds(prepare, |trees| build(trees, false)));
        table.row(&format!("build, one Bezier, H = 6: RSS + tori, {name}"), "~300 ms", target, milliseconds(both));
        table.row(&format!("  RSS only, {name}"), "~250 ms", "", milliseconds(nodes));
    }
    for (kind, name, thesis) in [(VolumeKind::Aabb, "AABB", "~100 ms"), (VolumeKind::Hull, "hulls", "~300 ms")] {
        let build = |(): &()| {
            let _ = black_box(VolumeTree::build(&surface, &BvhOptions::default(), kind, &Job::new()));
        };
        table.row(&format!("  {name}"), thesis, "", milliseconds(runs(5, || seconds(|| (), build))));
    }
    for ((set, name), target) in SETS.into_iter().zip(["0.3 s"; 3]) {
        let time = runs(3, || seconds(|| trees(&[&surface], &options(9, set)), |trees| build(trees, true)));
        table.row(&format!("build, one Bezier, H = 9: RSS + tori, {name}"), "< 60 s", target, milliseconds(time));
    }
    Ok(())
}

fn two_surfaces(table: &mut Table, [a, b]: [&Surface; 2]) -> Result<(), Box<dyn Error>> {
    let mut full = [0.0; 3];
    for (k, (set, name)) in SETS.into_iter().enumerate() {
        full[k] = runs(3, || seconds(|| trees(&[a, b], &options(6, set)), |trees| build(trees, true)));
        let target = ["3 s", "3 s", "1.5 s"][k];
        let what = format!("build, 2 x 289 Beziers, H = 6: RSS + tori, {name}");
        table.row(&what, "173.7 s", target, milliseconds(full[k]));
        let nodes = runs(1, || seconds(|| trees(&[a, b], &options(6, set)), |trees| build(trees, false)));
        table.row(&format!("  RSS only, {name}"), "142.3 s", "", milliseconds(nodes));
        table.row(&format!("  tori, the difference, {name}"), "31.4 s", "", milliseconds(full[k] - nodes));
    }
    for (kind, name, thesis) in [(VolumeKind::Aabb, "AABB", "50.9 s"), (VolumeKind::Hull, "hulls", "227.7 s")] {
        let build = |(): &()| {
            for s in [a, b] {
                let _ = black_box(VolumeTree::build(s, &options(6, Instructions::Best), kind, &Job::new()));
            }
        };
        table.row(&format!("  {name}"), thesis, "", milliseconds(runs(1, || seconds(|| (), build))));
    }
    // Both from nothing, one beside the other, what was built kept until the time is taken.
    let mut nodes = 0;
    let from_nothing = |finish: &mut dyn FnMut(&[SurfaceTree])| {
        let mut kept = Vec::new();
        seconds(
            || (),
            |()| {
                let trees = trees(&[a, b], &options(6, Instructions::Best));
                finish(&trees);
                kept.push(trees);
            },
        )
    };
    let (mut first, mut whole) = (Vec::new(), Vec::new());
    for _ in 0..5 {
        whole.push(from_nothing(&mut |trees| build(trees, true)));
        first.push(from_nothing(&mut |trees| {
            if let [ta, tb] = trees {
                black_box(walk(ta, tb, None, true));
                nodes = ta.memory().nodes + tb.memory().nodes;
            }
        }));
    }
    let (first, whole) = (median(first), median(whole));
    let share = format!("{} (1/{:.0} of {}), {nodes} nodes", milliseconds(first), whole / first, milliseconds(whole));
    table.row("first query, nothing built, early exit", "", "1/80 of the build", share);

    let built = trees(&[a, b], &options(6, Instructions::Best));
    build(&built, false);
    let [ta, tb] = &built[..] else { return Ok(()) };
    for (early, what, thesis, target) in
        [(true, "early exit", "", "8 ms"), (false, "to all leaf pairs", "44.35 ms", "40 ms")]
    {
        let mut overlap = Overlap::default();
        let time = runs(7, || seconds(|| (), |()| overlap = walk(ta, tb, None, early)));
        let counts = format!("{}, {} tests, {} pairs", milliseconds(time), overlap.tests, overlap.pairs.len());
        table.row(&format!("traversal, H = 6, prebuilt: {what}"), thesis, target, counts);
    }
    drop(built);
    let volumes = |kind, height| -> Result<[VolumeTree; 2], Box<dyn Error>> {
        let options = options(height, Instructions::Best);
        Ok([VolumeTree::build(a, &options, kind, &Job::new())?, VolumeTree::build(b, &options, kind, &Job::new())?])
    };
    for (kind, name, thesis) in [(VolumeKind::Aabb, "AABB", "39.14 ms"), (VolumeKind::Hull, "hulls", "134.07 ms")] {
        let [ta, tb] = volumes(kind, 6)?;
        let mut overlap = Overlap::default();
        let time = runs(3, || seconds(|| (), |()| overlap = ta.overlap(&tb, None, 0.0, &Job::new())));
        let counts = format!("{}, {} tests, {} pairs", milliseconds(time), overlap.tests, overlap.pairs.len());
        table.row(&format!("  {name}"), thesis, "", counts);
    }
    let built = trees(&[a, b], &options(4, Instructions::Best));
    let [ta, tb] = &built[..] else { return Ok(()) };
    let pairs = walk(ta, tb, None, false).pairs.len();
    table.row("overlapping pairs, H = 4: RSS", "16367 (GK 1)", "", pairs.to_string());
    for (kind, name, thesis) in
        [(VolumeKind::Aabb, "AABB", "71533 (GK 1)"), (VolumeKind::Hull, "hulls", "12008 (GK 1)")]
    {
        let [ta, tb] = volumes(kind, 4)?;
        table.row(&format!("  {name}"), thesis, "", ta.overlap(&tb, None, 0.0, &Job::new()).pairs.len().to_string());
    }
    Ok(())
}

type Pairs = Vec<[Arc<Surface>; 2]>;

/// Two sides of a shared case: all surfaces of a side with all of the other. None without the data.
fn pairs(name: &str) -> Result<Option<Pairs>, Box<dyn Error>> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases"));
    let file = folder.join(format!("{name}.igs"));
    if !file.exists() {
        return Ok(None);
    }
    let opened = patchwright::io::open(&file)?;
    let oracle: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join(format!("{name}.oracle.json")))?)?;
    let first = oracle["n_a"].as_u64().unwrap_or(1) as usize;
    let surfaces: Vec<_> = opened.document.surfaces().map(|(_, s)| s.clone()).collect();
    let (a, b) = surfaces.split_at(first.min(surfaces.len()));
    Ok(Some(a.iter().flat_map(|a| b.iter().map(move |b| [a.clone(), b.clone()])).collect()))
}

/// Pairs of overlapping leaves of one volume over all pairs of surfaces, and the time of the traversal at height 6.
fn counted(pairs: &[[Arc<Surface>; 2]], kind: VolumeKind, height: u32) -> Result<(usize, f64), Box<dyn Error>> {
    let (mut count, mut time) = (0, 0.0);
    for [a, b] in pairs {
        let options = options(height, Instructions::Best);
        let mut overlap = Overlap::default();
        let spent = if kind == VolumeKind::Rss {
            let built = trees(&[a, b], &options);
            build(&built, false);
            let [ta, tb] = &built[..] else { continue };
            together(1, || overlap = walk(ta, tb, None, false))
        } else {
            let tree = |s| VolumeTree::build(s, &options, kind, &Job::new());
            let (ta, tb) = (tree(a)?, tree(b)?);
            together(1, || overlap = ta.overlap(&tb, None, 0.0, &Job::new()))
        };
        count += overlap.pairs.len();
        time += spent.as_secs_f64();
    }
    Ok((count, time))
}

/// The rest of Table 8.3, on cases of the same kind, and Table 8.4.
fn cases(table: &mut Table) -> Result<(), Box<dyn Error>> {
    let kinds = [(VolumeKind::Rss, "RSS"), (VolumeKind::Aabb, "AABB"), (VolumeKind::Hull, "hulls")];
    for (what, name, times, counts) in [
        ("Overlap", "almost_overlap_scale1", ["0.80", "0.48", "2.64"], ["572", "1049", "522"]),
        ("Saddle 1", "saddle_touch", ["0.20", "0.07", "0.57"], ["251", "284", "111"]),
        ("Saddle 2", "saddle_miss_-1e-03", ["0.20", "0.08", "0.89"], ["250", "286", "125"]),
    ] {
        let Some(pairs) = pairs(name)? else { continue };
        for (k, (kind, volume)) in kinds.into_iter().enumerate() {
            let (_, time) = counted(&pairs, kind, 6)?;
            let (count, _) = counted(&pairs, kind, 4)?;
            let row = format!("{what} ({name}): traversal H = 6, pairs H = 4, {volume}");
            table.row(&row, &format!("{} ms, {}", times[k], counts[k]), "", format!("{}, {count}", milliseconds(time)));
        }
    }
    // Table 8.4 at H = 9; the thesis could not build hulls there. The smaller angles overlap nearly everywhere.
    for (angle, name, thesis) in
        [("0.01", "cyl_bez_0.01deg", ["35572", "2667043"]), ("0.00001", "cyl_bez_1e-05deg", ["5510081", "5807194"])]
    {
        let Some(pairs) = pairs(name)? else { continue };
        for ((kind, volume), thesis) in kinds.into_iter().take(2).zip(thesis) {
            let (count, time) = counted(&pairs, kind, 9)?;
            let row = format!("cylinders at {angle} deg, pairs H = 9: {volume}");
            table.row(&row, thesis, "", format!("{count} in {}", milliseconds(time)));
        }
    }
    Ok(())
}

fn measure(only: Option<&str>) -> Result<(), Box<dyn Error>> {
    match only {
        Some("build") => {
            let surface = patch()?;
            for (set, _) in SETS {
                build(&trees(&[&surface], &options(6, set)), true);
            }
            return Ok(());
        }
        Some(part @ ("lazy" | "traverse")) => {
            let Some(surfaces) = graphs()? else { return Ok(()) };
            let height = if part == "lazy" { 6 } else { 4 };
            let trees = trees(&surfaces.each_ref().map(|s| &**s), &options(height, Instructions::Best));
            if part == "traverse" {
                build(&trees, false);
            }
            println!("{}", walk(&trees[0], &trees[1], None, part == "lazy").tests);
            return Ok(());
        }
        _ => {}
    }
    let mut table = Table(Vec::new());
    one_bezier(&mut table)?;
    if let Some(surfaces) = graphs()? {
        two_surfaces(&mut table, surfaces.each_ref().map(|s| &**s))?;
    }
    cases(&mut table)?;
    println!("{:<66} {:>14} {:>18}   Patchwright", "", "thesis", "target");
    for [what, thesis, target, ours] in table.0 {
        println!("{what:<66} {thesis:>14} {target:>18}   {ours}");
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let only = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    on_one_thread(|| measure(only.as_deref()).map_err(|error| error.to_string()))??;
    Ok(())
}
