//! Reading and writing models: the largest IGES files at hand and a made one of 4 MB, against 0.5 s.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken file")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use glam::DVec3;
use patchwright::io::iges::{self, IgesOptions};
use patchwright::io::project;
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};

fn median<T>(runs: usize, mut f: impl FnMut() -> T) -> Duration {
    let mut times: Vec<Duration> = (0..runs)
        .map(|_| {
            let start = Instant::now();
            black_box(f());
            start.elapsed()
        })
        .collect();
    times.sort();
    times[runs / 2]
}

/// Bicubic patches with numbers of full length until their IGES text has 4 MB.
fn four_megabytes() -> String {
    let mut document = Document::new(Unit::Millimetre);
    let breaks: Vec<f64> = (0..=16).map(|k| f64::from(k) / 16.0).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let count = knots.control_count();
    let options = IgesOptions { file_name: "bench.igs".into(), time: SystemTime::UNIX_EPOCH };
    loop {
        for _ in 0..10 {
            let k = document.entities().len() as f64;
            let points = (0..count * count)
                .map(|i| {
                    let (x, y) = (k + (i % count) as f64 / 7.0, (i / count) as f64 / 11.0);
                    DVec3::new(x, y, (3.0 * x).sin() * (2.0 * y).cos())
                })
                .collect();
            let surface = Surface::new(knots.clone(), knots.clone(), points, None).unwrap();
            document.add(format!("patch {k}"), Shape::Surface(Arc::new(surface)), Some([0.5, 0.5, 0.5]));
        }
        let text = iges::write(&document, &options).unwrap().0;
        if text.len() >= 4_000_000 {
            return text;
        }
    }
}

fn main() {
    let mut files = vec![("made, 4 MB".to_owned(), four_megabytes().into_bytes())];
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/models");
    for name in ["hyrban_headlamp_L.igs", "hyrban_rear_screen.igs", "pocc_surf114.igs"] {
        match std::fs::read(format!("{folder}/{name}")) {
            Ok(bytes) => files.push((name.to_owned(), bytes)),
            Err(_) => println!("skipped: no shared data ({name})"),
        }
    }
    println!(
        "{:24} {:>9} {:>9} {:>12} {:>12} {:>12} {:>12}",
        "file", "MB", "surfaces", "read", "target", "write", "project"
    );
    for (name, bytes) in files {
        let opened = iges::read(&bytes).unwrap();
        let options = IgesOptions { file_name: name.clone(), time: SystemTime::UNIX_EPOCH };
        let megabytes = bytes.len() as f64 / 1e6;
        let read = median(9, || iges::read(&bytes).unwrap());
        let write = median(9, || iges::write(&opened.document, &options).unwrap());
        let ron = project::write(&opened.document).unwrap();
        let open_ron = median(5, || project::read(ron.as_bytes()).unwrap());
        // The target is 0.5 s for 4 MB, in proportion for the others.
        let target = Duration::from_secs_f64(0.5 * megabytes / 4.0);
        let surfaces = opened.report.surfaces;
        println!("{name:24} {megabytes:9.2} {surfaces:9} {read:12.2?} {target:12.2?} {write:12.2?} {open_ron:12.2?}");
    }
}
