//! Reading and writing models: the largest IGES files at hand and a made one of 4 MB, against 0.5 s; and what a file of 300
//! trimmed faces needs until its first picture, against 1.5 s and 30 times its size.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken file")]

#[path = "../support/iges_text.rs"]
mod iges_text;
#[path = "../support/memory.rs"]
mod memory;

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use glam::DVec3;
use memory::memory;
use patchwright::io::iges::{self, IgesOptions};
use patchwright::io::project;
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::view::camera::Camera;
use patchwright::view::scene::Scene;
use patchwright::view::viewport::{View, Viewport};

/// 300 trimmed bicubic patches, each with a wavy outline and a round hole, as curves in space.
fn trimmed_faces() -> String {
    let mut file = iges_text::File::default();
    let status = Some("00010000");
    let mut part = |kind: i64, parameters: String| {
        file.add_entity(iges_text::Entity { kind, status, parameters, ..iges_text::Entity::default() })
    };
    let knots = "0.,0.,0.,0.,1.,2.,3.,4.,5.,6.,7.,8.,8.,8.,8.";
    for k in 0..300 {
        let (x0, y0) = (f64::from(k % 20), f64::from(k / 20));
        // A plane with uneven parameters, so that curves in space are exact on it and parameter curves are not lines.
        let even = |i: i32| f64::from(i) / 10.0;
        let points: Vec<String> = (0..11)
            .flat_map(|j| (0..11).map(move |i| (even(i), even(j))))
            .map(|(u, v)| format!("{:?},{:?},{:?}", x0 + u, y0 + v, 0.3 * x0 + 0.2 * y0 + 0.3 * u + 0.2 * v))
            .collect();
        let weights = vec!["1."; 121].join(",");
        let surface =
            part(128, format!("10,10,3,3,0,0,1,0,0,{knots},{knots},{weights},{},0.,8.,0.,8.", points.join(",")));
        let at = |u: f64, v: f64| [x0 + u, y0 + v, 0.3 * x0 + 0.2 * y0 + 0.3 * u + 0.2 * v];
        let spline = |p: [[f64; 3]; 4]| {
            let all: Vec<String> = p.as_flattened().iter().map(|c| format!("{c:?}")).collect();
            format!("3,3,0,0,1,0,0.,0.,0.,0.,1.,1.,1.,1.,1.,1.,1.,1.,{},0.,1.,0.,0.,0.", all.join(","))
        };
        let ring = |part: &mut dyn FnMut(i64, String) -> usize, corners: [[f64; 2]; 4], bulge: f64| {
            let members: Vec<String> = (0..4)
                .map(|e| {
                    let ([a, b], [c, d]) = (corners[e], corners[(e + 1) % 4]);
                    let (nu, nv) = (bulge * (d - b), bulge * (a - c));
                    let third = |s: f64| at(a + (c - a) * s + nu, b + (d - b) * s + nv);
                    part(126, spline([at(a, b), third(1.0 / 3.0), third(2.0 / 3.0), at(c, d)])).to_string()
                })
                .collect();
            let composite = part(102, format!("4,{}", members.join(",")));
            part(142, format!("0,{surface},0,{composite},2"))
        };
        let outer = ring(&mut part, [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]], 0.1);
        let hole = ring(&mut part, [[0.3, 0.5], [0.5, 0.3], [0.7, 0.5], [0.5, 0.7]], 0.3);
        let face = format!("{surface},1,1,{outer},{hole}");
        part(144, face);
    }
    file.text()
}

/// Reading and the first picture's triangles.
fn first_picture(name: &str, bytes: &[u8]) {
    let start = Instant::now();
    let (opened, peak, kept) = memory(|| iges::read(bytes).unwrap());
    let read = start.elapsed();
    let mut scene = Scene::default();
    scene.sync(&opened.document);
    let viewport = Viewport::new(1600.0, 1000.0);
    let mut camera = Camera::default();
    camera.frame(&scene.bounds(), viewport);
    scene.refine(&View::new(&camera, viewport, &scene.bounds()));
    let all = start.elapsed();
    let size = bytes.len() as f64;
    println!(
        "{name}: {} faces, {:.2} MB, read {read:.2?}, first picture {all:.2?} (target 1.5 s for 300), {} triangles, memory {:.1} x \
         the file while reading, {:.1} x kept (target 30 x)",
        opened.document.faces().count(),
        size / 1e6,
        scene.counts().0,
        peak / size,
        kept / size
    );
}

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
    first_picture("made, 300 trimmed faces", trimmed_faces().as_bytes());
    if let Ok(bytes) =
        std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/models/hyrban_headlamp_L.igs"))
    {
        first_picture("hyrban_headlamp_L.igs", &bytes);
    }
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
