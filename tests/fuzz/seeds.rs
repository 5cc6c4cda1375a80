//! Writes small files of every format into `corpus/`, with the program's own writers. It is a fuzz target that does so before
//! its first input and ends, because whatever is built here is instrumented and wants libFuzzer.

#![no_main]

#[path = "../support/iges_text.rs"]
mod iges_text;

use std::path::{Path, PathBuf};

use patchwright::io::export::ExportOptions;
use patchwright::io::{self, Format, SaveOptions};
use patchwright::kernel::mesh::structured::Counts;
use patchwright::model::document::Document;
use patchwright::model::examples;

type Anything = Result<(), Box<dyn std::error::Error>>;

fn folder(name: &str) -> Result<PathBuf, std::io::Error> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
    std::fs::create_dir_all(&path)?;
    Ok(path)
}

fn save(document: &Document, name: &str, format: Format, to: &str, export: ExportOptions) -> Anything {
    let options = SaveOptions { format: Some(format), export };
    io::save(&folder(to)?.join(name), document, &options)?;
    Ok(())
}

fn write() -> Anything {
    let every_entity = iges_text::one_of_each().text();
    std::fs::write(folder("iges")?.join("one_of_each"), &every_entity)?;
    let trimmed = io::read(Path::new("one_of_each"), every_entity.as_bytes(), Some(Format::Iges))?.document;
    let mut documents: Vec<(&str, Document)> =
        examples::all().into_iter().map(|e| (e.name, e.document)).filter(|(_, d)| d.entities().len() < 12).collect();
    documents.push(("trimmed", trimmed));
    for (name, document) in &documents {
        let usual = ExportOptions::default;
        save(document, name, Format::Iges, "iges", usual())?;
        save(document, name, Format::Step, "step", usual())?;
        save(document, name, Format::Project, "project", usual())?;
    }
    // Meshes and grids of the simplest one; the readers see only numbers.
    let Some((name, simple)) = documents.first() else { return Ok(()) };
    let coarse = || ExportOptions { counts: Some(Counts::Points(4)), ..ExportOptions::default() };
    save(simple, name, Format::Obj, "obj", coarse())?;
    for ascii in [true, false] {
        save(simple, &format!("ascii_{ascii}"), Format::Stl, "stl", ExportOptions { ascii, ..coarse() })?;
    }
    for k in 0..16 {
        let bit = |b: u32| k >> b & 1 == 1;
        let export =
            ExportOptions { ascii: bit(0), records: bit(1), big_endian: bit(2), single: bit(3), ..coarse() };
        save(simple, &format!("encoding_{k}"), Format::Plot3d, "plot3d", export)?;
    }
    for example in examples::all() {
        std::fs::write(folder("spec")?.join(example.name), example.spec.to_ron()?)?;
    }
    Ok(())
}

/// Writes them and ends.
fn run() {
    let code = match write() {
        Ok(()) => 0,
        Err(error) => {
            eprintln!("{error}");
            1
        }
    };
    std::process::exit(code)
}

libfuzzer_sys::fuzz_target!(init: run(), |_bytes: &[u8]| {});
