//! Surface-surface intersection against oracles.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/cases.rs"]
mod cases;
#[path = "support/judge.rs"]
mod judge;

use cases::Case;
use patchwright::kernel::job::Job;
use patchwright::kernel::ssi::{SsiOptions, intersect};

fn check(name: &str) -> Vec<String> {
    let Some(case) = Case::load(name) else { return Vec::new() };
    let [a, b] = case.sides();
    let clock = std::time::Instant::now();
    let result = intersect(&a, &b, &SsiOptions::default(), &Job::new()).unwrap();
    let ms = clock.elapsed().as_secs_f64() * 1e3;
    let faults = judge::faults(&result, case.oracle());
    let points: usize = result.curves.iter().map(|c| c.points.len()).sum();
    println!(
        "{name}: {ms:.1} ms ({:.1} + {:.1} + {:.1}), {} curves, {points} points, {} leaf pairs, {} nodes; {faults:#?}",
        result.time_ms.build,
        result.time_ms.traverse,
        result.time_ms.curves,
        result.curves.len(),
        result.counts.leaf_pairs,
        result.counts.nodes_built
    );
    faults
}

#[test]
fn all() {
    let Some(folder) = cases::folder() else { return };
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|e| e.unwrap().file_name().to_str().and_then(|n| n.strip_suffix(".igs").map(str::to_owned)))
        .collect();
    names.sort();
    let only = std::env::var("CASE").unwrap_or_default();
    let mut bad = 0;
    for name in names {
        let Some(case) = Case::load(&name) else { continue };
        let problem = case.document["problem"].as_str().unwrap_or("");
        if ["ssi", "overlap"].contains(&problem) && name.contains(&only) {
            bad += usize::from(!check(&name).is_empty());
        }
    }
    assert_eq!(bad, 0);
}

#[test]
#[ignore = "prints one case"]
fn show() {
    let Some(case) = Case::load(&std::env::var("CASE").unwrap_or_default()) else { return };
    let [a, b] = case.sides();
    let result = intersect(&a, &b, &SsiOptions::default(), &Job::new()).unwrap();
    println!(
        "{:?} complete {}, {} regions {:?}",
        result.counts,
        result.complete,
        result.regions.len(),
        result
            .regions
            .iter()
            .map(|r| (r.max_distance, r.boundary.iter().map(Vec::len).collect::<Vec<_>>()))
            .collect::<Vec<_>>()
    );
    for j in &result.junctions {
        println!("junction {j:?}");
    }
    for (k, c) in result.curves.iter().enumerate() {
        println!(
            "curve {k}: {:?} {:?} {:?} bound {:.1e}, {} points",
            c.kind,
            c.ends,
            c.end_ids,
            c.error_bound,
            c.points.len()
        );
        let n = c.points.len();
        for i in [0, 1, 2, n / 4, n / 2, 3 * n / 4, n - 3, n - 2, n - 1] {
            if let Some(p) = c.points.get(i) {
                println!("   {i} {:?} a{} {:?} b{} {:?}", p.xyz, p.a, p.uv, p.b, p.st);
            }
        }
    }
    for u in result.unresolved.iter().take(20) {
        println!("{u:?}");
    }
}
