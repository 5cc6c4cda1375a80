//! The house rules: arrows between layers point one way, and only the top layers know a window.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// What each layer may name besides itself.
const MAY_USE: [(&str, &[&str]); 8] = [
    ("kernel", &[]),
    ("model", &["kernel"]),
    ("io", &["kernel", "model"]),
    ("view", &["kernel", "model", "io"]),
    ("render", &["kernel", "model", "io", "view"]),
    ("work", &["kernel", "model", "io", "view"]),
    ("cli", &["kernel", "model", "io", "view", "render", "work"]),
    ("ui", &["kernel", "model", "io", "view", "render", "work", "cli"]),
];

/// Crates that only the top layers may name.
const WINDOW_CRATES: [&str; 6] = ["egui", "eframe", "egui_wgpu", "wgpu", "rfd", "winit"];
const WINDOW_FREE: [&str; 5] = ["kernel", "model", "io", "view", "work"];

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// The code lines of a file, comments left out.
fn code(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split("//").next().unwrap_or("").to_owned()).collect()
}

/// Whether `line` names `crate_name` as a path root (`egui::`, `use egui;`).
fn names_crate(line: &str, crate_name: &str) -> bool {
    line.match_indices(crate_name).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = &line[at + crate_name.len()..];
        !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') && after.starts_with("::")
    })
}

#[test]
fn arrows_between_layers_point_one_way() {
    let mut violations = Vec::new();
    let mut seen = 0;
    for (layer, allowed) in MAY_USE {
        let mut files = Vec::new();
        rust_files(&Path::new(ROOT).join("src").join(layer), &mut files);
        seen += files.len();
        for file in files {
            for (number, line) in code(&file).iter().enumerate() {
                for (other, _) in MAY_USE {
                    let named =
                        line.contains(&format!("crate::{other}")) || line.contains(&format!("patchwright::{other}"));
                    if named && other != layer && !allowed.contains(&other) {
                        violations.push(format!("{}:{}: {layer} names {other}", file.display(), number + 1));
                    }
                }
                for window in WINDOW_CRATES {
                    if WINDOW_FREE.contains(&layer) && names_crate(line, window) {
                        violations.push(format!("{}:{}: {layer} names {window}", file.display(), number + 1));
                    }
                }
            }
        }
    }
    assert!(seen > 10, "the layers were not found under {ROOT}/src");
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn the_check_itself_recognises_a_violation() {
    assert!(names_crate("use egui::Ui;", "egui"));
    assert!(names_crate("    wgpu::Device", "wgpu"));
    assert!(!names_crate("let egui_like = 3;", "egui"));
    assert!(!names_crate("my::egui::thing", "egui"));
}
