//! Self-intersection from the surface to the finished result, preparation included, beside the best peer's and the
//! thesis's figures and the targets. Look-alikes of the eight surfaces of Table 8.5 are B-splines with the same kind
//! of features: the thesis prints neither their control points nor their patch counts.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken surface")]

#[path = "../support/shapes.rs"]
mod shapes;

use std::time::Instant;

use glam::DVec3;
use patchwright::kernel::geom::Surface;
use patchwright::kernel::job::Job;
use patchwright::kernel::self_ssi::{SelfIntersectOptions, self_intersect};
use shapes::{interpolate, ridge, spans, spun};

/// The same over a domain turned by 0.4: miter points in general position.
fn oblique(c: impl Fn(f64) -> f64) -> impl Fn(f64, f64) -> DVec3 {
    let ridge = ridge(c);
    move |u, v| {
        let p = spun(u, v);
        ridge(p.x, p.y)
    }
}

fn main() {
    let one = spans(1);
    let tau = std::f64::consts::TAU;
    let cases: Vec<(&str, &str, f64, Surface)> = vec![
        ("one cross-cap", "148-258 ms", 5.0, interpolate(&one, &one, |u, v| DVec3::new(u, u * v, v * v))),
        ("two miters, arc", "0.9-3.5 s", 20.0, interpolate(&one, &one, ridge(|x| x * x - 0.36))),
        ("two miters, open", "0.9-3.5 s", 20.0, interpolate(&one, &one, ridge(|x| 0.25 - x * x))),
        ("two miters 0.1 apart", "0.9-3.5 s", 20.0, interpolate(&one, &one, ridge(|x| x * x - 0.0025))),
        ("two miters 0.01 apart", "0.9-3.5 s", 20.0, interpolate(&one, &one, ridge(|x| x * x - 0.000025))),
        ("three miters", "0.9-3.5 s", 20.0, interpolate(&one, &one, ridge(|x| x * (x * x - 0.3)))),
        (
            "global fold",
            "30-209 ms",
            12.0,
            interpolate(&one, &one, |u, v| DVec3::new(v * v + 0.1 * u, v * (v * v - 0.49), u)),
        ),
        (
            "(A) spiral strip",
            "5.1 s",
            300.0,
            interpolate(&spans(20), &spans(8), |u, v| {
                let (a, h) = (tau * 0.62 * (u + 1.0), 1.0 + 0.1 * u);
                DVec3::new(h * a.cos(), h * a.sin() + 0.2 * v * u, 0.6 * v + 0.1 * u)
            }),
        ),
        (
            "(B) two waves",
            "3.3 s",
            300.0,
            interpolate(&spans(12), &spans(12), |u, v| {
                DVec3::new(u + 0.45 * (tau * v).sin(), 1.2 * v * v + 0.1 * u, v * (v * v - 0.5) + 0.1 * (3.0 * u).cos())
            }),
        ),
        (
            "(C) figure-8 tube",
            "3.4 s",
            300.0,
            interpolate(&spans(24), &spans(4), |u, v| {
                let a = 0.5 * tau * u;
                DVec3::new(a.sin() * (1.0 + 0.2 * v), (2.0 * a).sin() * 0.6, v + 0.2 * a.sin().powi(2))
            }),
        ),
        (
            "(D) long folded sheet",
            "19.2 s",
            300.0,
            interpolate(&spans(32), &spans(16), |u, v| {
                let y = v * (v * v - 0.49);
                DVec3::new(v * v + 0.1 * (7.0 * u).sin(), y + 0.05 * (9.0 * u).cos() * v, 2.5 * u)
            }),
        ),
        (
            "(E) coiled tube",
            "17.4 s",
            300.0,
            interpolate(&spans(32), &spans(16), |u, v| {
                let (a, b) = (0.75 * tau * u, 0.45 * tau * v);
                let r = 1.0 + 0.45 * b.cos();
                DVec3::new(r * a.cos() + 0.15 * u, r * a.sin(), 0.45 * b.sin() + 0.35 * u)
            }),
        ),
        ("(Miter-A) three", "49.7 s", 500.0, interpolate(&spans(20), &spans(8), oblique(|x| x * (x * x - 0.3)))),
        ("(Miter-B) one", "13.6 s", 500.0, interpolate(&spans(12), &spans(12), oblique(|x| x + 0.2 * (3.0 * x).sin()))),
        ("(Miter-C) two, arc", "30.6 s", 500.0, interpolate(&spans(12), &spans(12), oblique(|x| x * x - 0.2))),
    ];
    println!(
        "one thread          patches | curves miters complete |  pairs windows | ours: median      best | target | peer, thesis"
    );
    for (name, peer, target, surface) in &cases {
        let patches = surface.bezier_patches().len();
        let run = || {
            let started = Instant::now();
            let found = self_intersect(surface, 0, &SelfIntersectOptions::default(), &Job::new()).unwrap();
            (started.elapsed().as_secs_f64() * 1e3, found)
        };
        let (first, found) = run();
        let rounds = ((600.0 / first) as usize).clamp(3, 41);
        let mut times: Vec<f64> = (0..rounds).map(|_| run().0).collect();
        times.sort_by(f64::total_cmp);
        let (r, e) = (&found.result, &found.evidence);
        println!(
            "{name:22} {patches:4} | {:6} {:6} {:8} | {:6} {:7} | {:9.2} {:9.2} ms | {target:3} ms | {peer}",
            r.curves.len(),
            r.miters.len(),
            r.complete,
            e.pairs,
            e.windows,
            times[rounds / 2],
            times[0],
        );
    }
}
