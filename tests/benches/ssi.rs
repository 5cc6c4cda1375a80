//! Surface-surface intersection against the targets of its issue: one thread, building included.

#[path = "../support/cases.rs"]
mod cases;

use std::time::Instant;

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

fn main() {
    let start = Instant::now();
    println!(
        "{:30} {:>9} {:>9} {:>8} | {:>7} {:>8} {:>7} {:>7} {:>7} {:>6}",
        "case", "peer ms", "target", "ours ms", "build", "traverse", "curves", "pairs", "nodes", "points"
    );
    for (name, peer, target) in ROWS {
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
}
