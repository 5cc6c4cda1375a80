//! The bundled examples through the real program: healed to 1e-3 of the diagonal with at least 80 % of the samples
//! projected, and written as IGES that reads as C1.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops at what it did not expect")]

use std::path::{Path, PathBuf};
use std::process::Command;

use patchwright::io;
use patchwright::model::examples;

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets")
}

#[test]
fn the_generator_makes_the_same_bytes_as_the_assets() {
    for example in examples::all() {
        for (name, text) in patchwright::cli::examples::files(&example).unwrap() {
            let kept = std::fs::read_to_string(assets().join(&name)).unwrap();
            assert!(kept == text, "{name} differs; run `cargo run -- examples assets`");
        }
    }
}

#[test]
fn the_program_heals_every_example() {
    let folder = tempfile::tempdir().unwrap();
    for example in examples::all() {
        let name = example.name;
        let out = folder.path().join(format!("{name}.igs"));
        let json = folder.path().join(format!("{name}.json"));
        let output = Command::new(env!("CARGO_BIN_EXE_patchwright"))
            .args(["heal", "--json"])
            .arg(&json)
            .arg(assets().join(format!("{name}.igs")))
            .arg("--patches")
            .arg(assets().join(format!("{name}.heal.ron")))
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        println!("{name}\n{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{name}: {:?}", output.status);
        let result: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
        let diagonal = result["diagonal"].as_f64().unwrap();
        let (mut projected, mut all) = (0, 0);
        for p in result["patches"].as_array().unwrap() {
            assert!(p["max_error"].as_f64().unwrap() <= 1e-3 * diagonal, "{name}: {}", p["name"]);
            let count = |key: &str| p[key].as_u64().unwrap();
            projected += count("projected");
            all += count("projected") + count("artificial") + count("kept");
        }
        println!("{name}: {:.1} % projected", 100.0 * projected as f64 / all as f64);
        assert!(projected * 10 >= all * 8, "{name}: {projected} of {all} samples projected");
        for s in result["shared"].as_array().unwrap() {
            assert!(s["max_gap"].as_f64().unwrap() <= 1e-12 * diagonal, "{name}: {s}");
        }
        assert_eq!(result["patches"].as_array().unwrap().len(), example.spec.patches.len());
        written_surfaces_read_as_c1(&out, example.spec.patches.len());
    }
}

fn written_surfaces_read_as_c1(path: &Path, count: usize) {
    let document = io::open(path).unwrap().document;
    assert_eq!((document.surfaces().count(), document.entities().len()), (count, count));
    for (_, surface) in document.surfaces() {
        assert!(surface.weights().is_none());
        for knots in surface.knots() {
            let all = knots.multiplicities();
            assert!(knots.is_clamped() && knots.degree() == 3);
            assert!(all[1..all.len() - 1].iter().all(|m| m.1 == 2));
        }
    }
}
