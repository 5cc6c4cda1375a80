//! How long a computation goes on after it has been told to stop: from the input to the acknowledged cancel at most
//! 100 ms. Each is cancelled at eleven moments between its beginning and its end, from another thread as the window does.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken scene")]

#[path = "../support/shapes.rs"]
mod shapes;

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use patchwright::kernel::geom::Surface;
use patchwright::kernel::intersect::{Engine, intersect_with};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::body::Body;
use patchwright::kernel::self_ssi::{SelfIntersectOptions, self_intersect};
use patchwright::kernel::ssi::{SsiOptions, intersect};
use patchwright::model::defects::{self, DefectOptions};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::healing;
use patchwright::model::spec::{HealSpec, PatchSpec, Piece};
use patchwright::view::inspect::Hierarchy;
use shapes::{interpolate, ridge, spans};

/// Moments at which each is cancelled.
const MOMENTS: u32 = 11;

/// Runs `work` to its end, then cancels it early, in between and late.
fn row(name: &str, work: impl Fn(&Job) + Sync) {
    let begun = Instant::now();
    work(&Job::new());
    let whole = begun.elapsed();
    let mut late: Vec<(Duration, String)> = (0..MOMENTS)
        .filter_map(|k| {
            let job = Job::new();
            let watched = job.clone();
            let wait = whole * (2 * k + 1) / (2 * MOMENTS);
            std::thread::scope(|scope| {
                let killer = scope.spawn(move || {
                    std::thread::sleep(wait);
                    let phase = watched.current_phase();
                    watched.cancel();
                    (Instant::now(), phase)
                });
                work(&job);
                let ended = Instant::now();
                // It may have come to its end before.
                killer.join().ok().map(|(asked, phase)| (ended.saturating_duration_since(asked), phase))
            })
        })
        .collect();
    late.sort();
    let ms = |d: Duration| d.as_secs_f64() * 1e3;
    let (worst, phase) = late.last().map_or((f64::NAN, ""), |(d, phase)| (ms(*d), phase.as_str()));
    println!(
        "{name:44} {:>10.1} {:>10.2} {worst:>10.2}   {} (in {phase})",
        ms(whole),
        late.get(late.len() / 2).map_or(f64::NAN, |(d, _)| ms(*d)),
        if worst < 100.0 { "met" } else { "missed" }
    );
}

/// Hills over [0, 10]^2.
fn hill(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, 0.2 * (3.0 * x).sin() * (2.0 * y).cos() + 0.05 * (17.0 * x + 11.0 * y).sin())
}

/// `n` x `n` patches of hills.
fn hills(n: usize, spans_of_each: usize) -> Document {
    let mut document = Document::new(Unit::Metre);
    let step = 10.0 / n as f64;
    let s = spans(spans_of_each);
    for k in 0..n * n {
        let (a, b) = ((k % n) as f64 + 0.5, (k / n) as f64 + 0.5);
        let f = |u: f64, v: f64| hill(step * (a + 0.5 * u), step * (b + 0.5 * v));
        document.add(format!("hill {k}"), Shape::Surface(Arc::new(interpolate(&s, &s, f))), None);
    }
    document
}

fn main() {
    println!("{:44} {:>10} {:>10} {:>10}   target: stopped within 100 ms", "ms", "whole", "median", "worst");
    let s40 = spans(40);
    let big = Arc::new(interpolate(&s40, &s40, |u, v| hill(5.0 + 5.0 * u, 5.0 + 5.0 * v)));
    let other: Surface = interpolate(&s40, &s40, |u, v| {
        let p = hill(5.0 + 5.0 * u, 5.0 + 5.0 * v);
        DVec3::new(p.x, p.y, 0.1 * (5.0 * p.x).cos() * (4.0 * p.y).sin())
    });

    row("intersection, 40 x 40 spans each", |job| {
        drop(intersect(&[(0, &big)], &[(1, &other)], &SsiOptions::default(), job));
    });
    row("coincident surfaces, 40 x 40 spans each", |job| {
        drop(intersect(&[(0, &big)], &[(1, &big)], &SsiOptions::default(), job));
    });
    let folded = interpolate(&spans(64), &spans(32), ridge(|x| x * (x * x - 0.3)));
    row("self-intersection, 64 x 32 spans", |job| {
        drop(self_intersect(&folded, 0, &SelfIntersectOptions::default(), job));
    });
    let document = hills(1, 40);
    let (id, surface) = document.surfaces().next().map(|(id, s)| (id, Arc::clone(s))).unwrap();
    row("hierarchy, 9 levels", |job| drop(Hierarchy::build(id, Arc::clone(&surface), 9, job)));

    let edge = |edge| vec![Piece::Edge { face: 0, ring: 0, edge, from: 0.0, to: 1.0 }];
    let sides = [edge(0), edge(1), edge(2), edge(3)];
    let mut spec = HealSpec::from_ron("(patches: [])").unwrap();
    spec.tol = Some(1e-7);
    spec.patches = vec![PatchSpec { name: "patch".into(), sides, ..PatchSpec::default() }];
    row("heal 40 x 40 spans to 1e-8 of the size", |job| drop(healing::run(&document, &spec, job)));

    let many = hills(20, 8);
    row("defects of 400 surfaces", |job| drop(defects::find(&many, &DefectOptions::of(&many), job)));
    row("the same with self-intersections", |job| {
        let options = DefectOptions { self_intersections: true, ..DefectOptions::of(&many) };
        drop(defects::find(&many, &options, job));
    });
    let surfaces: Vec<(usize, Body)> =
        many.bodies().take(40).enumerate().map(|(k, (_, body))| (k, body.clone())).collect();
    let plane =
        Surface::bilinear([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0], [10.0, 10.0]].map(|[x, y]| DVec3::new(x, y, 0.01)));
    let plane = [(40, Body::Surface(Arc::new(plane.unwrap())))];
    row("triangulated: 40 surfaces with a plane", |job| {
        drop(intersect_with(Engine::Mesh, &surfaces, &plane, Some(1e-6), job));
    });
}
