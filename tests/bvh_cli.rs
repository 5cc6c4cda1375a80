//! `bvh` as scripts see it: storage by part, times and pair counts in text and JSON, exit codes, what is refused.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/iges_text.rs"]
mod iges_text;

use std::path::Path;
use std::process::{Command, Output};

use iges_text::{File, bilinear, square};
use serde_json::Value;

/// Two squares that cross in a line, a third far above them, and a square collapsed to a line.
fn model(folder: &Path) {
    let mut file = File::default();
    file.add(128, square(0.0));
    file.add(128, bilinear([[0.0, 0.0, -0.3], [1.0, 0.0, 0.7], [0.0, 1.0, -0.3], [1.0, 1.0, 0.7]]));
    file.add(128, square(50.0));
    file.add(128, bilinear([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]));
    std::fs::write(folder.join("model.igs"), file.text()).unwrap();
}

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = patchwright(folder, &[&["bvh", "model.igs", "--json", "-"], arguments].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn storage_by_part_adds_up_for_every_volume() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    for volume in ["rss", "aabb", "hull"] {
        let result = json(folder.path(), &["--surface", "1", "--height", "3", "--volume", volume]);
        assert_eq!((&result["volume"], &result["height"]), (&volume.into(), &3.into()));
        let tree = &result["trees"][0];
        assert_eq!((&tree["surface"], &tree["patches"]), (&1.into(), &serde_json::json!([1, 1])));
        assert!(tree["build_ms"].as_f64().unwrap() >= 0.0);
        let part = |name: &str| tree["parts"][name].as_u64().unwrap();
        assert_eq!(tree["bytes"], part("node_bytes") + part("torus_bytes") + part("other_bytes"));
        assert_eq!(part("nodes"), 127);
        assert_eq!(part("tori"), if volume == "rss" { 64 } else { 0 });
        assert!(result.get("pair").is_none());
    }
}

#[test]
fn levels_get_tighter_and_the_flat_one_is_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let result = json(folder.path(), &["--surface", "0", "--height", "2"]);
    let levels = result["trees"][0]["parts"]["levels"].as_array().unwrap().clone();
    assert_eq!(levels.iter().map(|l| l["nodes"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 4, 16]);
    assert!(levels.iter().all(|l| l["largest_radius"].as_f64().unwrap() < 1e-5));
    let result = json(folder.path(), &["--surface", "0", "--height", "2", "--flatness", "1e-3"]);
    assert_eq!(result["trees"][0]["parts"]["levels"][2]["nodes"], 4);
}

#[test]
fn a_pair_is_traversed_and_the_counts_do_not_depend_on_threads() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    for volume in ["rss", "aabb", "hull"] {
        let run = |with: &str, threads: &str| {
            let options = ["--surface", "0", "--height", "4", "--volume", volume, "--with", with, "--threads", threads];
            json(folder.path(), &options)["pair"].clone()
        };
        let (one, two, far) = (run("1", "1"), run("1", "2"), run("2", "1"));
        // The squares cross along x = 0.3, through 16 cells of the first.
        assert_eq!(one["with"], 1);
        assert!(one["leaf_pairs"].as_u64().unwrap() >= 16 && one["traverse_ms"].as_f64().unwrap() >= 0.0);
        assert!(one["tests"].as_u64() > one["leaf_pairs"].as_u64());
        assert_eq!((&one["leaf_pairs"], &one["tests"]), (&two["leaf_pairs"], &two["tests"]));
        assert_eq!((&far["leaf_pairs"], &far["tests"]), (&0.into(), &1.into()));
        // Two planes that cross are told apart by their normals at once.
        if volume == "rss" {
            assert_eq!((&one["early_exit"]["pairs"], &one["early_exit"]["leaf_pairs"]), (&1.into(), &0.into()));
        } else {
            assert!(one.get("early_exit").is_none());
        }
    }
}

#[test]
fn people_get_lines() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let output = patchwright(folder.path(), &["bvh", "model.igs", "--surface", "0", "--height", "2", "--with", "1"]);
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8(output.stdout).unwrap();
    for words in [
        "surface 0: 1 x 1 Bezier patches, height 2",
        "surface 1:",
        "31 nodes",
        "16 tori",
        "level 2: 16 nodes",
        "with surface 1:",
        "overlapping leaf pairs",
        "with early exit: 1 pairs",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn what_is_refused_is_named() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    for (arguments, code, words) in [
        (&["--surface", "4"][..], 2, &["no surface 4", "from 0 to 3"][..]),
        (&["--surface", "0", "--with", "9"], 2, &["no surface 9"]),
        (&["--surface", "0", "--height", "16"], 2, &["16", "15"]),
        (&["--surface", "0", "--volume", "ball"], 2, &["ball", "rss", "aabb", "hull"]),
        (&[], 2, &["--surface"]),
        (&["--surface", "0", "--volume", "aabb", "--flatness", "1"], 2, &["--flatness", "rss"]),
        (&["--surface", "0", "--flatness", "-1"], 2, &["--flatness is -1", "positive"]),
        (&["--surface", "0", "--flatness", "nan"], 2, &["--flatness is NaN", "positive"]),
        (&["--surface", "0", "--height", "15"], 1, &["height 15", "4294967296"]),
        (&["--surface", "0", "--height", "15", "--volume", "hull"], 1, &["height 15", "4294967296"]),
        (&["--surface", "3"], 1, &["area 0"]),
        (&["--surface", "3", "--volume", "aabb"], 1, &["area 0"]),
    ] {
        let output = patchwright(folder.path(), &[&["bvh", "model.igs"], arguments].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
        assert!(words.iter().all(|w| text.contains(w)), "{arguments:?}: {text}");
        assert!(output.stdout.is_empty());
    }
    assert_eq!(patchwright(folder.path(), &["bvh", "none.igs", "--surface", "0"]).status.code(), Some(1));
}
