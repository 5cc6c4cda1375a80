//! Surface-surface intersection against the targets of its issue: one thread, building included. Then how time grows
//! with the number of patches, and the pair counts of thesis Table 8.4. An argument picks `growth`, `table`, or the
//! cases whose names contain it.

#[path = "../support/cases.rs"]
mod cases;
#[path = "../support/graphs.rs"]
mod graphs;

use std::hint::black_box;
use std::time::Instant;

use graphs::spline_graph;
use patchwright::kernel::bvh::{self, BvhOptions, SurfaceTree, TraverseOptions, traverse};
use patchwright::kernel::geom::Surface;
use patchwright::kernel::job::Job;
use patchwright::kernel::ssi::{Intersection, SsiOptions, intersect};

/// Case, best correct peer in ms (none: nobody was correct), target in ms.
const ROWS: [(&str, &str, f64); 24] = [
    ("graph_1x1_loop_r0.2", "54-84", 2.0),
    ("graph_1x1_loop_r0.001", "54-84", 2.0),
    ("saddle_touch", "16-18", 2.0),
    ("saddle_miss_-1e-03", "16-18", 2.0),
    ("saddle_miss_-1e-05", "16-18", 2.0),
    ("saddle_miss_-1e-07", "16-18", 2.0),
    ("graph_8x8_s5", "70", 12.0),
    ("graph_8x8_s21_tiny0.01", "70", 12.0),
    ("graph_17x17_s11", "222-370", 40.0),
    ("graph_17x17_s25_tiny0.01", "222-370", 40.0),
    ("cyl_bez_10deg", "500-6000", 100.0),
    ("cyl_bez_1deg", "500-6000", 100.0),
    ("cyl_bez_0.1deg", "500-6000", 100.0),
    ("cyl_bez_0.01deg", "500-6000", 100.0),
    ("cyl_bez_2e-05deg", "nobody", 100.0),
    ("cyl_bez_1e-05deg", "nobody", 100.0),
    ("cyl_b48_0.01deg", "nobody", 100.0),
    ("cyl_rat_0.001deg", "nobody", 100.0),
    ("cyl_rat_0.0001deg", "nobody", 100.0),
    ("almost_overlap_scale0.0001", "250", 30.0),
    ("sphere_sphere_gap1e-06", "-", f64::NAN),
    ("torus_plane_fig8", "-", f64::NAN),
    ("villarceau", "-", f64::NAN),
    ("overlap_subpatch", "-", f64::NAN),
];

/// Milliseconds that this thread has spent on a processor (Linux), else the wall clock: other programs may run.
fn clock(start: &Instant) -> f64 {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let spent = spent.and_then(|s| s.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()));
    spent.map_or_else(|| start.elapsed().as_secs_f64() * 1e3, |ns| ns * 1e-6)
}

/// Four times as many patches: how much longer.
fn growth(start: &Instant) {
    println!("\npatch count x 4 (target: at most x 5), mean of 5 seeds, ours ms");
    let mut last: Option<f64> = None;
    for n in [4, 8, 16, 32] {
        let pairs: Vec<(Surface, Surface)> =
            (1..=5).filter_map(|s| Some((spline_graph(n, 2 * s, 0.0)?, spline_graph(n, 2 * s + 1, 0.37)?))).collect();
        let before = clock(start);
        let mut runs = 0;
        while runs < 2 || (clock(start) - before < 200.0 && runs < 40) {
            for (a, b) in &pairs {
                let _ = black_box(intersect(&[(0, a)], &[(1, b)], &SsiOptions::default(), &Job::new()));
            }
            runs += 1;
        }
        let ms = (clock(start) - before) / (runs * pairs.len()) as f64;
        let factor = last.map_or(String::new(), |l| format!("x {:.2}", ms / l));
        println!("{n:2} x {n:<2} spans {ms:>10.2} {factor}");
        last = Some(ms);
    }
    println!("\nthe same for a surface with itself: one region");
    let mut last: Option<f64> = None;
    for n in [5, 10, 20, 40] {
        let Some(surface) = spline_graph(n, 1, 0.0) else { continue };
        let before = clock(start);
        let _ = black_box(intersect(&[(0, &surface)], &[(1, &surface)], &SsiOptions::default(), &Job::new()));
        let ms = clock(start) - before;
        let factor = last.map_or(String::new(), |l| format!("x {:.2}", ms / l));
        println!("{n:2} x {n:<2} spans {ms:>10.2} {factor}");
        last = Some(ms);
    }
}

/// Table 8.4 of the thesis: overlapping leaves of two cylinders at H = 9. Its cylinders' length is not given, so that
/// only the trend compares; here they are four bicubic Bezier patches each, radius 1, length 4.
fn table() {
    println!("\noverlapping leaf pairs of two cylinders, H = 9   (thesis: AABB, RSS; its length unknown)");
    let options = BvhOptions { height: 9, ..BvhOptions::default() };
    for (name, thesis) in [
        ("cyl_bez_0.01deg", [2_667_043, 35_572]),
        ("cyl_bez_2e-05deg", [4_376_814, 5_483_794]),
        ("cyl_bez_1e-05deg", [5_807_194, 5_510_081]),
    ] {
        let Some(case) = cases::Case::load(name) else { continue };
        let (mut ours, mut tests) = (0, 0);
        let n = case.n_a();
        let trees: Vec<_> = case.surfaces.iter().filter_map(|s| SurfaceTree::new(s, &options).ok()).collect();
        for a in &trees[..n] {
            for b in &trees[n..] {
                let found = traverse(a, b, &TraverseOptions::default(), |_| bvh::Verdict::Descend, &Job::new());
                ours += found.pairs.len();
                tests += found.tests;
            }
        }
        println!("{name:20} RSS {ours:>10}, {tests} tests   ({}, {})", thesis[0], thesis[1]);
    }
}

fn main() {
    let start = Instant::now();
    let only = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    match only.as_deref() {
        Some("growth") => return growth(&start),
        Some("table") => return table(),
        _ => {}
    }
    println!(
        "{:30} {:>9} {:>9} {:>8} | {:>7} {:>8} {:>7} {:>7} {:>7} {:>6}",
        "case", "peer ms", "target", "ours ms", "build", "traverse", "curves", "pairs", "nodes", "points"
    );
    for (name, peer, target) in ROWS {
        if only.as_ref().is_some_and(|o| !name.contains(o.as_str())) {
            continue;
        }
        let Some(case) = cases::Case::load(name) else { continue };
        let [a, b] = case.sides();
        // The clock of a thread ticks coarsely: many runs, and their mean.
        const RUNS: usize = 20;
        let before = clock(&start);
        let mut last: Option<Intersection> = None;
        for _ in 0..RUNS {
            last = intersect(&a, &b, &SsiOptions::default(), &Job::new()).ok();
        }
        let ms = (clock(&start) - before) / RUNS as f64;
        let Some(result) = last else { continue };
        let points: usize = result.curves.iter().map(|c| c.points.len()).sum();
        let t = result.time_ms;
        println!(
            "{name:30} {peer:>9} {target:>9} {ms:>8.2} | {:>7.2} {:>8.2} {:>7.2} {:>7} {:>7} {points:>6}",
            t.build, t.traverse, t.curves, result.counts.leaf_pairs, result.counts.nodes_built
        );
    }
    if only.is_none() {
        growth(&start);
        table();
    }
}
