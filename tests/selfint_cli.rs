//! `self-intersect` as scripts see it: text, JSON, the choice of surfaces, exit codes, and bad input.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/shapes.rs"]
mod shapes;

use std::path::Path;
use std::process::{Command, Output};

use glam::{DVec2, DVec3};
use patchwright::io::{self, SaveOptions};
use patchwright::kernel::geom::Surface;
use patchwright::model::document::{Document, Shape, Unit};
use serde_json::Value;
use shapes::{interpolate, ridge, square};

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

fn write(folder: &Path, name: &str, surfaces: Vec<Surface>) {
    let mut document = Document::new(Unit::default());
    for (k, surface) in surfaces.into_iter().enumerate() {
        document.add(format!("surface {k}"), Shape::Surface(surface.into()), None);
    }
    io::save(&folder.join(name), &document, &SaveOptions::default()).unwrap();
}

fn flat() -> Surface {
    interpolate(&square(), &square(), |u, v| DVec3::new(u, v, 0.0))
}

/// An arc between two miter points in (+-0.6, 0).
fn arc() -> Surface {
    interpolate(&square(), &square(), ridge(|x| x * x - 0.36))
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn all_surfaces_or_one_as_json_and_as_text() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "model.igs", vec![flat(), arc(), arc()]);
    let all = patchwright(folder.path(), &["self-intersect", "model.igs", "--json", "-"]);
    assert_eq!(all.status.code(), Some(0));
    let result = json(&all);
    assert_eq!((result["complete"].as_bool(), result["unresolved"].as_array().unwrap().len()), (Some(true), 0));
    let curves = result["curves"].as_array().unwrap();
    assert_eq!((curves.len(), result["miters"].as_array().unwrap().len()), (2, 4));
    // The second surface's curve ends in its own miter points.
    for (curve, surface) in curves.iter().zip([1, 2]) {
        assert_eq!((&curve["kind"], &curve["closed"]), (&"self".into(), &false.into()));
        assert_eq!(curve["ends"], serde_json::json!(["miter", "miter"]));
        let first = &curve["points"][0];
        let miter = &result["miters"][curve["end_ids"][0].as_u64().unwrap() as usize];
        for number in [&first["a"], &first["b"], &miter["a"]] {
            assert_eq!(number.as_i64(), Some(surface));
        }
        let at = |v: &Value| DVec2::new(v[0].as_f64().unwrap(), v[1].as_f64().unwrap());
        assert!(at(&miter["uv"]).distance(at(&first["uv"])) < 1e-9);
    }
    let one = patchwright(folder.path(), &["self-intersect", "model.igs", "--surface", "2", "--json", "-"]);
    assert_eq!(json(&one)["curves"].as_array().unwrap().len(), 1);
    assert_eq!(json(&one)["curves"][0]["points"], curves[1]["points"]);
    let text = String::from_utf8(one.stderr).unwrap()
        + &String::from_utf8(patchwright(folder.path(), &["self-intersect", "model.igs"]).stdout).unwrap();
    assert!(text.contains("1 self-intersection curves, 2 miter points"), "{text}");
    assert!(text.contains("surface 2: ") && text.contains("miter to miter"), "{text}");
}

#[test]
fn answers_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "model.igs", vec![arc(), flat(), arc()]);
    let run = |threads: &str| {
        let mut result =
            json(&patchwright(folder.path(), &["self-intersect", "model.igs", "--threads", threads, "--json", "-"]));
        result["time_ms"] = Value::Null;
        result
    };
    assert_eq!(run("1"), run("2"));
}

#[test]
fn what_is_not_resolved_is_exit_code_3_and_bad_arguments_are_2() {
    let folder = tempfile::tempdir().unwrap();
    // A surface that is a line has no answer; a cusp edge has one.
    let line = interpolate(&square(), &square(), |u, v| DVec3::new(u + v, 2.0 * (u + v), 0.0));
    let cusp = interpolate(&square(), &square(), |u, v| DVec3::new(u * u, u * u * u, v));
    write(folder.path(), "line.igs", vec![line]);
    write(folder.path(), "cusp.igs", vec![cusp]);
    let line = patchwright(folder.path(), &["self-intersect", "line.igs", "--json", "-"]);
    assert_eq!(line.status.code(), Some(3));
    assert_eq!(json(&line)["complete"], false);
    let text = String::from_utf8(line.stderr).unwrap();
    assert!(text.contains("unresolved: surface 0") && text.contains("collapsed"), "{text}");
    let cusp = patchwright(folder.path(), &["self-intersect", "cusp.igs", "--json", "-"]);
    assert_eq!(cusp.status.code(), Some(0));
    assert_eq!(json(&cusp)["curves"][0]["kind"], "cusp-edge");
    for (arguments, code, word) in [
        (vec!["self-intersect", "cusp.igs", "--surface", "1"], 2, "1 surfaces"),
        (vec!["self-intersect", "cusp.igs", "--tol", "0"], 2, "tol"),
        (vec!["self-intersect", "cusp.igs", "--tol", "nan"], 2, "tol"),
        (vec!["self-intersect"], 2, "FILE"),
        (vec!["self-intersect", "none.igs"], 1, "none.igs"),
    ] {
        let output = patchwright(folder.path(), &arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
        assert!(text.contains(word), "{arguments:?}: {text}");
    }
}

#[test]
fn coordinates_that_are_no_numbers_stop_no_one() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "model.igs", vec![arc()]);
    let text = std::fs::read_to_string(folder.path().join("model.igs")).unwrap();
    for bad in ["NAN", "1.E308", "1.E999"] {
        // The first coordinate of the net that is long enough to be overwritten in place.
        let at = text.match_indices("0.").map(|m| m.0).find(|&at| {
            let field: &str = text[at..].split([',', ';']).next().unwrap();
            field.len() > 12 && !field.contains('\n')
        });
        let Some(at) = at else { return };
        let field = text[at..].split([',', ';']).next().unwrap();
        let broken = format!("{}{bad:>width$}{}", &text[..at], &text[at + field.len()..], width = field.len());
        std::fs::write(folder.path().join("bad.igs"), broken).unwrap();
        let output = patchwright(folder.path(), &["self-intersect", "bad.igs"]);
        assert!(matches!(output.status.code(), Some(0..=3)), "{bad}: {:?}", output.status);
        assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{bad}");
    }
}
