//! The triangulation engine against the transversal cases with oracles.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::path::Path;

use glam::DVec3;
use patchwright::io;
use patchwright::kernel::intersect::{Engine, intersect_with};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::body::Body;
use patchwright::kernel::mesh_ssi::engine::{MeshSsiOptions, intersect_bodies};
use patchwright::kernel::ssi::result::{CurvePoint, Intersection};

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

/// How far the polylines of one result are from those of another at most.
fn apart(a: &Intersection, b: &Intersection) -> f64 {
    let lines: Vec<Vec<DVec3>> = b.curves.iter().map(|c| c.points.iter().map(|p| p.xyz).collect()).collect();
    let off = |p: DVec3| lines.iter().map(|l| distance(p, l)).fold(f64::INFINITY, f64::min);
    // Every eighth point is enough to tell, and the ends.
    let points = a.curves.iter().flat_map(|c| c.points.iter().step_by(8).chain(c.points.last()));
    points.map(|p| off(p.xyz)).fold(0.0, f64::max)
}

#[test]
fn both_engines_agree_on_every_transversal_case() {
    let Ok(folder) = std::fs::read_dir(CASES) else {
        println!("skipped: no shared data");
        return;
    };
    let mut names: Vec<String> =
        folder.filter_map(|e| Some(e.ok()?.file_name().to_str()?.strip_suffix(".oracle.json")?.to_owned())).collect();
    names.sort();
    let mut compared = 0;
    for name in names {
        let oracle: serde_json::Value =
            serde_json::from_slice(&std::fs::read(format!("{CASES}/{name}.oracle.json")).unwrap()).unwrap();
        let empty = |field: &str| oracle["oracle"][field].as_array().is_none_or(Vec::is_empty);
        let transversal = oracle["problem"] == "ssi" && empty("junctions") && empty("isolated");
        if !transversal || oracle["oracle"]["below_tol"] == true {
            continue;
        }
        let document = io::open(Path::new(&format!("{CASES}/{name}.igs"))).unwrap().document;
        let bodies: Vec<(usize, Body)> = document.bodies().map(|(_, body)| body).enumerate().collect();
        let (a, b) = bodies.split_at(oracle["n_a"].as_u64().unwrap() as usize);
        let job = Job::new();
        let mesh = intersect_with(Engine::Mesh, a, b, None, &job).unwrap();
        let exact = intersect_with(Engine::Bvh, a, b, None, &Job::new()).unwrap();
        let loops = |r: &Intersection| r.curves.iter().filter(|c| c.closed).count();
        // Bounds are of the distance to the surfaces; to the curve it is larger by the sine of their angle.
        let steep = |p: &CurvePoint| {
            let normal = |k: usize, uv| bodies[k].1.surface().unwrap().jet(uv, 1).normal().unwrap();
            normal(p.a, p.uv).cross(normal(p.b, p.st)).length()
        };
        let points = exact.curves.iter().flat_map(|c| c.points.iter().step_by(8));
        let tol = (mesh.tol + exact.tol) / points.map(steep).fold(1.0, f64::min);
        let off = [apart(&mesh, &exact), apart(&exact, &mesh)];
        println!(
            "{name}: {} curves, {} loops, {:.1e} and {:.1e} apart ({:.1e} allowed), handed over: {:?}",
            mesh.curves.len(),
            loops(&mesh),
            off[0],
            off[1],
            tol,
            job.warnings()
        );
        // Two surfaces that almost overlap come near everywhere; no other pair goes over as a whole.
        let whole = job.warnings().iter().any(|w| w.contains("as a whole"));
        assert!(!whole || name == "almost_overlap_scale0.0001", "{name}: {:?}", job.warnings());
        assert_eq!((mesh.curves.len(), loops(&mesh)), (exact.curves.len(), loops(&exact)), "{name}");
        assert!(mesh.complete && exact.complete, "{name}: {:?}", mesh.unresolved);
        assert!(off[0] <= tol && off[1] <= tol, "{name}: {off:?}");
        compared += 1;
    }
    assert!(compared >= 13, "{compared} cases");
}
