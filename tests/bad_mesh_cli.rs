//! Bad STL and Plot3D files through the command line: each is opened, and what is wrong with it is said and counted.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/bad_bodies.rs"]
mod bad_bodies;

use std::path::Path;
use std::process::{Command, Output};

use bad_bodies::{Bad, bad_bodies};
use serde_json::Value;

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

/// What the import report says beside how a grid was read: severities and reasons.
fn lines(import: &Value) -> Vec<(String, String)> {
    let text = |line: &Value, of: &str| line[of].as_str().unwrap().to_owned();
    let lines = import["lines"].as_array().unwrap().iter().map(|line| (text(line, "severity"), text(line, "reason")));
    lines.filter(|(_, reason)| !reason.starts_with("read as")).collect()
}

fn check(bad: &Bad, lines: &[(String, String)]) {
    let reasons: Vec<&str> = lines.iter().map(|(_, reason)| reason.as_str()).collect();
    assert_eq!(reasons, bad.said, "{}", bad.name);
    assert_eq!(lines.iter().any(|(severity, _)| severity == "skipped"), bad.skipped, "{}", bad.name);
}

#[test]
fn info_and_convert_say_what_is_wrong_with_a_file() {
    let folder = tempfile::tempdir().unwrap();
    for bad in bad_bodies() {
        std::fs::write(folder.path().join(bad.name), &bad.bytes).unwrap();
        let output = patchwright(folder.path(), &["info", bad.name, "--json", "-", "--all"]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{}: {said}", bad.name);
        let info: Value = serde_json::from_slice(&output.stdout).unwrap();
        check(&bad, &lines(&info["import"]));
        assert!(bad.said.iter().all(|reason| said.contains(reason)), "{}: {said}", bad.name);
        let facets = &info["entities"][0]["facets"];
        let count = |of: &str| facets[of].as_u64().unwrap() as usize;
        assert_eq!(count("triangles"), bad.triangles, "{}", bad.name);
        assert_eq!([count("border_edges"), count("non_manifold_edges")], bad.edges, "{}", bad.name);

        let output = patchwright(folder.path(), &["convert", bad.name, "out.obj", "--json", "-"]);
        let said = String::from_utf8(output.stderr).unwrap();
        // What was left out makes the result incomplete.
        assert_eq!(output.status.code(), Some(if bad.skipped { 3 } else { 0 }), "{}: {said}", bad.name);
        check(&bad, &lines(&serde_json::from_slice::<Value>(&output.stdout).unwrap()["import"]));
        let written = std::fs::read_to_string(folder.path().join("out.obj")).unwrap();
        assert_eq!(written.lines().filter(|l| l.starts_with("f ")).count(), bad.triangles, "{}", bad.name);
    }
}

/// A wedge whose edges and corners lie on edges and corners of a box.
#[test]
fn edges_through_corners_are_met_once() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, triangles: &[[[f32; 3]; 3]]| {
        let corners = triangles.iter().flatten().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
        let faces = (0..triangles.len()).map(|t| format!("f {} {} {}\n", 3 * t + 1, 3 * t + 2, 3 * t + 3));
        std::fs::write(folder.path().join(name), corners.chain(faces).collect::<String>()).unwrap();
    };
    // The square [-1, 1]^2 in four triangles around its middle, and an upright sheet through two of its corners and that middle.
    let around: [[f32; 3]; 4] = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let floor: Vec<[[f32; 3]; 3]> = (0..4).map(|k| [[0.0; 3], around[k], around[(k + 1) % 4]]).collect();
    write("floor.obj", &floor);
    let [a, b] = [[-1.0, -1.0], [1.0, 1.0]].map(|[x, y]: [f32; 2]| [[x, y, -1.0], [x, y, 1.0]]);
    write("wall.obj", &[[a[0], b[0], b[1]], [a[0], b[1], a[1]]]);
    let both = ["floor.obj", "wall.obj"].map(|name| std::fs::read_to_string(folder.path().join(name)).unwrap());
    let shifted = both[1].replace("f 1 2 3", "f 13 14 15").replace("f 4 5 6", "f 16 17 18");
    std::fs::write(folder.path().join("both.obj"), format!("g floor\n{}g wall\n{shifted}", both[0])).unwrap();
    let output = patchwright(
        folder.path(),
        &["intersect", "both.obj", "--a", "0", "--b", "1", "--engine", "mesh", "--json", "-"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let xyz = |p: &Value| [0, 1].map(|k| p["xyz"][k].as_f64().unwrap());
    let curves = found["curves"].as_array().unwrap();
    let length = |c: &Value| {
        let points: Vec<[f64; 2]> = c["points"].as_array().unwrap().iter().map(xyz).collect();
        points.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum::<f64>()
    };
    let total: f64 = curves.iter().map(length).sum();
    assert!((total - 8.0_f64.sqrt()).abs() < 1e-12 && found["complete"] == true, "{total} in {} curves", curves.len());
}
