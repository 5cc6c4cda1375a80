//! A hover pick in a scene of a million triangles and a hundred thousand line segments, against 0.1 ms.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken scene")]

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, DVec3};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::view::camera::{Axis, Camera};
use patchwright::view::display::Extent;
use patchwright::view::pick::{Filter, PickOptions, pick, pick_all, under_cursor};
use patchwright::view::scene::Scene;
use patchwright::view::viewport::{View, Viewport};

/// One square kilometre of hills, `n` x `n` wavy patches of 12 x 12 spans.
fn hills(n: usize) -> Document {
    let mut document = Document::new(Unit::Metre);
    let spans = 12;
    let breaks: Vec<f64> = (0..=spans).map(|k| k as f64).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let count = knots.control_count();
    for b in 0..n {
        for a in 0..n {
            let points = (0..count * count)
                .map(|k| {
                    let (i, j) = ((k % count) as f64 / (count - 1) as f64, (k / count) as f64 / (count - 1) as f64);
                    let (x, y) = (a as f64 + i, b as f64 + j);
                    DVec3::new(x, y, 0.2 * (3.0 * x).sin() * (2.0 * y).cos() + 0.05 * (17.0 * x + 11.0 * y).sin())
                })
                .collect();
            let surface = Surface::new(knots.clone(), knots.clone(), points, None).unwrap();
            document.add(format!("{a} {b}"), Shape::Surface(Arc::new(surface)), None);
        }
    }
    document
}

fn main() {
    let document = hills(10);
    let mut scene = Scene::default();
    scene.sync(&document);
    let screen = Viewport::new(1920.0, 1080.0);
    let mut camera = Camera::default();
    camera.look_along(Axis::Oblique);
    camera.frame(&scene.bounds(), screen);
    let view = View::new(&camera, screen, &scene.bounds());
    let start = Instant::now();
    for item in scene.items().to_vec() {
        let request = patchwright::view::scene::Request {
            id: item.id(),
            geometry: item.geometry.clone(),
            chord_tol: 1.7e-3,
            extent: Extent::All,
            begun: None,
        };
        scene.accept(request.run());
    }
    let build = start.elapsed();
    let (triangles, segments) = scene.counts();
    println!(
        "scene: {} surfaces, {triangles} triangles, {segments} segments, built in {build:.1?}",
        document.entities().len()
    );
    let pixels: Vec<DVec2> =
        (0..2000).map(|k| DVec2::new(f64::from(k * 7919 % 1920) + 0.5, f64::from(k * 104_729 % 1080) + 0.5)).collect();
    let mut close = camera;
    if let Some(p) = under_cursor(&scene, &view, screen.center(), None) {
        close.zoom(p, 0.05);
    }
    let views = [("whole scene", view), ("20 times closer", View::new(&close, screen, &scene.bounds()))];
    println!("{:<44} {:>10} {:>10} {:>10}   target", "one thread", "median us", "99 % us", "hits %");
    for (name, view) in &views {
        let curves = PickOptions { filter: Filter::CURVES, ..PickOptions::default() };
        let all = PickOptions { filter: Filter::CURVES.or(Filter::ALL), ..PickOptions::default() };
        let surfaces = PickOptions { filter: Filter::SURFACES, ..PickOptions::default() };
        for (kind, options) in [("surfaces", surfaces), ("curves", curves), ("everything", all)] {
            report(&format!("hover, {kind}, {name}"), &pixels, "100", |p| pick(&scene, view, p, &options).is_some());
        }
        report(&format!("list of everything, {name}"), &pixels, "-", |p| !pick_all(&scene, view, p, &all).is_empty());
    }
}

fn report(name: &str, pixels: &[DVec2], target: &str, mut run: impl FnMut(DVec2) -> bool) {
    let mut times = Vec::new();
    let mut hits = 0;
    for &pixel in pixels {
        let start = Instant::now();
        hits += usize::from(run(pixel));
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    times.sort_by(f64::total_cmp);
    let share = 100.0 * hits as f64 / pixels.len() as f64;
    let [median, late] = [times[times.len() / 2], times[times.len() * 99 / 100]];
    println!("{name:<44} {median:>10.1} {late:>10.1} {share:>10.0}   {target} us");
}
