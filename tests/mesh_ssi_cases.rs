//! The triangulation engine against the transversal cases with oracles.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::path::Path;

use glam::DVec3;
use patchwright::io;
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::body::Body;
use patchwright::kernel::mesh_ssi::engine::{MeshSsiOptions, intersect_bodies};

const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases");

/// The distance of a point to a polyline.
fn distance(p: DVec3, line: &[DVec3]) -> f64 {
    let to = |a: DVec3, b: DVec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a + (b - a) * if t.is_finite() { t } else { 0.0 })
    };
    line.windows(2).map(|w| to(w[0], w[1])).fold(f64::INFINITY, f64::min)
}

#[test]
fn transversal_cases_agree_with_their_oracles() {
    if !Path::new(CASES).exists() {
        println!("skipped: no shared data");
        return;
    }
    for name in [
        "graph_1x1_loop_r0.2",
        "graph_4x4_s1",
        "graph_8x8_s5",
        "graph_17x17_s11",
        "sphere_sphere_gap0.01",
        "tube_sheet_s33",
    ] {
        let oracle: serde_json::Value =
            serde_json::from_slice(&std::fs::read(format!("{CASES}/{name}.oracle.json")).unwrap()).unwrap();
        let document = io::open(Path::new(&format!("{CASES}/{name}.igs"))).unwrap().document;
        let n_a = oracle["n_a"].as_u64().unwrap() as usize;
        let bodies: Vec<(usize, Body)> =
            document.surfaces().enumerate().map(|(k, (_, s))| (k, Body::Surface(s.clone()))).collect();
        let (a, b) = bodies.split_at(n_a);
        let diagonal = document.bounds().diagonal();
        let start = std::time::Instant::now();
        let job = Job::new();
        let result = intersect_bodies(a, b, &MeshSsiOptions::default(), &job).unwrap();
        println!(
            "{name}: {} curves in {:.0} ms, {:?}",
            result.curves.len(),
            start.elapsed().as_secs_f64() * 1e3,
            result.unresolved.first()
        );
        let arcs = oracle["oracle"]["arcs"].as_array().unwrap();
        let lines: Vec<(Vec<DVec3>, f64)> = arcs
            .iter()
            .map(|arc| (serde_json::from_value(arc["pts"].clone()).unwrap(), arc["tol"].as_f64().unwrap()))
            .collect();
        assert!(result.complete, "{name}: {:?} {:?}", result.unresolved, job.warnings());
        assert_eq!(result.curves.len(), oracle["oracle"]["n_components"].as_u64().unwrap() as usize, "{name}");
        let loops = result.curves.iter().filter(|c| c.closed).count();
        assert_eq!(loops, oracle["oracle"]["n_loops"].as_u64().unwrap() as usize, "{name}");
        let surfaces: Vec<_> = document.surfaces().map(|(_, s)| s.clone()).collect();
        for curve in &result.curves {
            for p in &curve.points {
                assert!(surfaces[p.a].eval(p.uv).distance(p.xyz) < 1e-10 * diagonal, "{name}");
                assert!(surfaces[p.b].eval(p.st).distance(p.xyz) < 1e-10 * diagonal, "{name}");
                let off = lines.iter().map(|(line, tol)| distance(p.xyz, line) / tol).fold(f64::INFINITY, f64::min);
                // That the point is right is proved above; this tells excess branches. The arcs are polylines
                // whose chords cut corners, next to saddles by several times their tolerance.
                assert!(off < 10.0, "{name}: a point {off} tolerances from every arc");
            }
        }
        for (line, tol) in &lines {
            for p in line {
                let near =
                    result.curves.iter().map(|c| distance(*p, &c.points.iter().map(|p| p.xyz).collect::<Vec<_>>()));
                assert!(
                    near.fold(f64::INFINITY, f64::min) < tol + result.tol,
                    "{name}: a point of an arc is not covered"
                );
            }
        }
    }
}
