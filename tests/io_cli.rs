//! `info` and `convert` as scripts see them: exit codes, JSON, files.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/iges_text.rs"]
mod iges_text;

use std::path::Path;
use std::process::{Command, Output};

use iges_text::{File, square};

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

fn model(folder: &Path, with_unread: bool) {
    let mut file = File::with_unit("1,2HIN", "1.");
    file.add(128, square(0.5));
    file.add(110, "0.,0.,0.,3.,4.,0.");
    if with_unread {
        file.add(154, "1.,2.,0.,0.,0.,0.,0.,1.");
    }
    std::fs::write(folder.join("model.igs"), file.text()).unwrap();
}

#[test]
fn info_tells_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path(), true);
    let output = patchwright(folder.path(), &["info", "model.igs", "--json", "-"]);
    assert_eq!(output.status.code(), Some(0));
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&info["surfaces"], &info["curves"], &info["unit"]), (&1.into(), &1.into(), &"in".into()));
    assert_eq!(info["bounds"]["max"], serde_json::json!([3.0, 4.0, 0.5]));
    assert_eq!(info["entities"][0]["degree"], serde_json::json!([1, 1]));
    assert_eq!(info["import"]["lines"][0]["severity"], "skipped");
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("1 surfaces, 1 curves") && text.contains("solid"), "{text}");
}

#[test]
fn convert_goes_there_and_back_and_says_what_was_lost() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path(), false);
    for (from, to) in
        [("model.igs", "a.patchwright.ron"), ("a.patchwright.ron", "b.igs"), ("b.igs", "c.patchwright.ron")]
    {
        let output = patchwright(folder.path(), &["convert", from, to]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("a.patchwright.ron"), read("c.patchwright.ron"));
    model(folder.path(), true);
    assert_eq!(patchwright(folder.path(), &["convert", "model.igs", "d.igs"]).status.code(), Some(3));
}

#[test]
fn failures_have_their_codes_and_messages() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path(), false);
    for (arguments, code, word) in [
        (vec!["info", "none.igs"], 1, "none.igs"),
        (vec!["info"], 2, "FILE"),
        (vec!["info", "model.igs", "--threads", "0"], 2, "threads"),
        (vec!["convert", "model.igs", "out.abc"], 1, "extension"),
        (vec!["convert", "model.igs", "no/such/folder.igs"], 1, "folder that exists"),
        (vec!["frobnicate", "--hard"], 2, "--hard"),
    ] {
        let output = patchwright(folder.path(), &arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
        assert!(text.contains(word), "{arguments:?}: {text}");
    }
}
