//! Healing against the figures of the field: `heal_wavy` (a leading kernel's energy-minimising fill, fed 448 points,
//! follows the originals to 4e-3 in 0.2 s and misses its boundary curves by 2e-4), a smooth shape (there it reaches
//! 6e-5), the preview of the editor (50 ms), and the crossing region of `pocc_surf114.igs`.

#![allow(clippy::unwrap_used, missing_docs, reason = "a benchmark may stop at a broken file")]

#[path = "../support/clock.rs"]
mod clock;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use clock::{median, on_one_thread, together};
use glam::{DVec2, DVec3};
use patchwright::io;
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::heal::preview::{PreviewOptions, preview};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::surface_set::{Scratch, SurfaceSet};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::healing::{self, Healing};
use patchwright::model::resolve::resolve;
use patchwright::model::spec::{HealSpec, IsoAt, PatchSpec, Piece};

/// The pieces of the first four surfaces that an iso-line of the parent runs through.
fn iso(document: &Document, at: IsoAt, from: f64, to: f64) -> Vec<Piece> {
    let (mut pieces, mut done) = (Vec::new(), from);
    while done < to {
        let (surface, end) = document
            .surfaces()
            .take(4)
            .enumerate()
            .find_map(|(k, (_, s))| {
                let [u, v] = s.domain();
                let (c, across, along) = match at {
                    IsoAt::U(c) => (c, u, v),
                    IsoAt::V(c) => (c, v, u),
                };
                let holds = across[0] <= c && c <= across[1] && along[0] <= done && done < along[1];
                holds.then(|| (k, along[1].min(to)))
            })
            .unwrap();
        pieces.push(Piece::Iso { surface, at, from: done, to: end });
        done = end;
    }
    pieces
}

fn rectangle(document: &Document, u: [f64; 2], v: [f64; 2], tol: f64) -> HealSpec {
    let sides = [
        iso(document, IsoAt::V(v[0]), u[0], u[1]),
        iso(document, IsoAt::U(u[1]), v[0], v[1]),
        iso(document, IsoAt::V(v[1]), u[0], u[1]),
        iso(document, IsoAt::U(u[0]), v[0], v[1]),
    ];
    let mut spec = HealSpec::from_ron("(patches: [])").unwrap();
    (spec.tol, spec.onto) = (Some(tol), Some(vec![0, 1, 2, 3]));
    spec.patches = vec![PatchSpec { name: "patch".into(), sides, ..PatchSpec::default() }];
    spec
}

/// The largest distance of the patch's sides from its picked curves at its samples.
fn boundary(healing: &Healing) -> f64 {
    let (patch, sides) = (&healing.healed.patches[0], &healing.healed.loops[0].sides);
    let at = |uv: DVec2| patch.surface.eval(uv);
    let mut worst = 0.0_f64;
    for (spans, pair) in [(patch.samples.m(), [0, 2]), (patch.samples.n(), [1, 3])] {
        for k in 0..=spans {
            let f = k as f64 / spans as f64;
            for s in pair {
                let uv =
                    [DVec2::new(f, 0.0), DVec2::new(1.0, f), DVec2::new(1.0 - f, 1.0), DVec2::new(0.0, 1.0 - f)][s];
                worst = worst.max(at(uv).distance(sides[s].point(f)));
            }
        }
    }
    worst
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

fn row(name: &str, ours: String, reference: &str) {
    println!("{name:46} {ours:>24}   {reference}");
}

fn wavy(document: &Document) {
    let diagonal = document.bounds().diagonal();
    for (name, tol) in [("region, 4e-4 wanted", 4e-4), ("region, 1e-4 wanted", 1e-4)] {
        let spec = rectangle(document, [1.0, 7.0], [1.0, 7.0], tol);
        let healing = healing::run(document, &spec, &Job::new()).unwrap();
        let r = &healing.patches[0].1.report;
        let time = median(5, || healing::run(document, &spec, &Job::new()).unwrap());
        let size = format!("{}x{}", r.resolution[0], r.resolution[1]);
        row(&format!("heal_wavy {name}: error, {size}"), format!("{:.2e}", r.max_error), "4e-3 (other), 4e-4 (target)");
        row("  time", format!("{:.1} ms", milliseconds(time)), "200 ms (other), 100 ms (target)");
        row("  samples on / artificial", format!("{} / {}", r.projected, r.artificial), "448 points (other)");
        row(
            "  boundary / diagonal",
            format!("{:.1e}", boundary(&healing) / diagonal),
            "2e-4 / 10 (other), 1e-12 (target)",
        );
    }
    let spec = rectangle(document, [3.0, 5.0], [2.0, 6.0], 4e-4);
    let healing = healing::run(document, &spec, &Job::new()).unwrap();
    let truth = Arc::clone(document.surfaces().nth(4).unwrap().1);
    let set = SurfaceSet::new(vec![(0, truth)], 1e-3, &Job::new());
    let mut scratch = Scratch::default();
    let patch = &healing.patches[0].1.surface;
    let worst = (0..=80 * 81)
        .map(|k| patch.eval(DVec2::new(f64::from(k % 81), f64::from(k / 81)) / 80.0))
        .map(|p| set.closest(p, f64::INFINITY, &mut scratch).unwrap().distance)
        .fold(0.0, f64::max);
    row("heal_wavy hole: distance from the truth", format!("{worst:.3e}"), "1.5e-1 (a plain Coons fill)");

    let resolved = resolve(&rectangle(document, [1.0, 7.0], [1.0, 7.0], 4e-4), document, &Job::new()).unwrap();
    let set = SurfaceSet::new(resolved.surfaces.clone(), resolved.options.chord_tol, &Job::new());
    let sides = resolved.patches[0].sides.to_vec();
    let time = median(9, || preview(&sides, Some(&set), &PreviewOptions::default(), &Job::new()).unwrap());
    row("preview, 12 x 12 projected", format!("{:.2} ms", milliseconds(time)), "50 ms (target)");
    let time = median(3, || SurfaceSet::new(resolved.surfaces.clone(), resolved.options.chord_tol, &Job::new()));
    row("  tessellation and tree for it (once)", format!("{:.1} ms", milliseconds(time)), "");
}

/// The same task on a smooth shape: a gentle graph over [0, 8]^2 cut into four around a hole.
fn smooth() -> Document {
    let breaks: Vec<f64> = (0..=8).map(f64::from).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let g = knots.greville();
    let f = |x: f64, y: f64| DVec3::new(x, y, 0.6 * (0.5 * x).sin() * (0.4 * y).cos() + 0.02 * x * y);
    let points = g.iter().flat_map(|&y| g.iter().map(move |&x| f(x, y))).collect();
    let parent = Surface::new(knots.clone(), knots, points, None).unwrap();
    let mut document = Document::new(Unit::Millimetre);
    for (u, v) in
        [([0.0, 3.0], [0.0, 8.0]), ([5.0, 8.0], [0.0, 8.0]), ([3.0, 5.0], [0.0, 2.0]), ([3.0, 5.0], [6.0, 8.0])]
    {
        document.add("part", Shape::Surface(Arc::new(parent.restricted(u, v).unwrap())), None);
    }
    document.add("parent", Shape::Surface(Arc::new(parent)), None);
    document
}

fn main() {
    on_one_thread(measure).unwrap();
}

fn measure() {
    row("CPU time of one thread, medians", "ours".into(), "reference");
    let data = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let case = data.join("cases/heal_wavy.igs");
    if case.exists() {
        wavy(&io::open(&case).unwrap().document);
    } else {
        println!("heal_wavy skipped: no shared data");
    }
    let document = smooth();
    let spec = rectangle(&document, [1.0, 7.0], [1.0, 7.0], 1e-5);
    let healing = healing::run(&document, &spec, &Job::new()).unwrap();
    let time = median(5, || healing::run(&document, &spec, &Job::new()).unwrap());
    let r = &healing.patches[0].1.report;
    let size = format!("{}x{}", r.resolution[0], r.resolution[1]);
    row(&format!("smooth region: error, {size}"), format!("{:.2e}", r.max_error), "6e-5 (other)");
    row("  time", format!("{:.1} ms", milliseconds(time)), "");
    let model = data.join("models/pocc_surf114.igs");
    if model.exists() {
        let document = io::open(&model).unwrap().document;
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/pocc_crossing.heal.ron"));
        let spec = HealSpec::from_ron(&std::fs::read_to_string(path).unwrap()).unwrap();
        let time = median(3, || healing::run(&document, &spec, &Job::new()).unwrap());
        for (name, patch) in healing::run(&document, &spec, &Job::new()).unwrap().patches {
            let r = patch.report;
            let ours = format!("{:.2e} on {}", r.max_error, r.projected);
            row(&format!("pocc_surf114 {name}: error, samples"), ours, "4e-4 wanted (inches)");
        }
        row("  time, all patches", format!("{:.1} ms", milliseconds(time)), "");
    }
    rays();
}

/// A ray against a million triangles, and a closest point on the surface behind them.
fn rays() {
    let breaks: Vec<f64> = (0..=40).map(f64::from).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let g = knots.greville();
    let f = |x: f64, y: f64| DVec3::new(x, y, (1.3 * x).sin() * (1.1 * y).cos());
    let points = g.iter().flat_map(|&y| g.iter().map(move |&x| f(x, y))).collect();
    let surface = Arc::new(Surface::new(knots.clone(), knots, points, None).unwrap());
    let mut made = None;
    let time = together(1, || made = Some(SurfaceSet::new(vec![(0, Arc::clone(&surface))], 2e-3, &Job::new())));
    let set = made.unwrap();
    let count = set.tree().len();
    row(&format!("tree over {count} triangles"), format!("{:.0} ms", milliseconds(time)), "");
    let mut seed = 1_u64;
    let mut next = move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let rays: Vec<(DVec3, DVec3)> = (0..20_000)
        .map(|_| {
            let target = DVec3::new(40.0 * next(), 40.0 * next(), 0.0);
            let eye = DVec3::new(20.0 + 30.0 * next(), -40.0 * next(), 60.0);
            (eye, target - eye)
        })
        .collect();
    let time = median(3, || rays.iter().filter(|r| set.tree().first_hit(r.0, r.1, f64::INFINITY).is_some()).count());
    row("  a random ray", format!("{:.2} us", time.as_secs_f64() * 1e6 / rays.len() as f64), "1 us (target)");
    let mut scratch = Scratch::default();
    let near: Vec<DVec3> = rays.iter().map(|(o, d)| *o + *d * 0.99).collect();
    let time =
        median(3, || near.iter().map(|p| set.closest(*p, f64::INFINITY, &mut scratch).unwrap().distance).sum::<f64>());
    row("  a true closest point", format!("{:.2} us", time.as_secs_f64() * 1e6 / near.len() as f64), "");
}
