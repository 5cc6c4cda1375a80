//! Intersection of triangulations, and large STL files.
//!
//! With `PATCHWRIGHT_DUMP=FOLDER` the balls are written there as raw numbers (`.f64` points, `.u32` triangles), and
//! `python3 tests/benches/manifold.py FOLDER` times the triangle-boolean library manifold on the same triangles.
//!
//! `cargo bench --no-default-features --bench mesh [N]`: N x N million triangles (default 1), and rows with a quarter and
//! a sixteenth of them for the growth. Targets: both trees within 1.5 s, the query on one thread within 0.3 s; a 200 MB
//! STL within 1.5 s to the first picture and four times its size in memory (here with pipelines that
//! are ready; `RUST_LOG=patchwright=info patchwright FILE.stl` says the same of the window, from the start of the program).

#![allow(clippy::unwrap_used, reason = "a benchmark may stop")]

#[path = "../support/memory.rs"]
mod memory;

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, DVec3};
use memory::memory;
use patchwright::io::stl;
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::tri_mesh::TriMesh;
use patchwright::kernel::mesh::tri_tree::TriTree;
use patchwright::kernel::mesh_ssi::intersect;
use patchwright::kernel::mesh_ssi::refine::{Sheet, refine};
use patchwright::kernel::mesh_ssi::topology::Triangles;
#[cfg(feature = "editor")]
use patchwright::render::{Emphasis, Gpu, Look, Offscreen, Prepared, Stage};
use patchwright::view::camera::Camera;
use patchwright::view::scene::{Made, Request, Scene};
use patchwright::view::viewport::{View, Viewport};

/// A closed lumpy ball of 4 n (n - 1) triangles, one vertex at each pole.
fn ball(n: usize, center: DVec3, phase: f64) -> TriMesh {
    let around = 2 * n;
    let at = |i: usize, j: usize| {
        let (theta, phi) = (std::f64::consts::PI * j as f64 / n as f64, std::f64::consts::PI * i as f64 / n as f64);
        let r = 1.0 + 0.1 * (9.0 * theta).sin() * (8.0 * phi + phase).sin() * theta.sin();
        center + r * DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    };
    let mut points = vec![at(0, 0)];
    points.extend((1..n).flat_map(|j| (0..around).map(move |i| (i, j))).map(|(i, j)| at(i, j)));
    points.push(at(0, n));
    let (last, index) = (points.len() as u32 - 1, |i: usize, j: usize| (1 + (j - 1) * around + i % around) as u32);
    let mut triangles = Vec::with_capacity(2 * around * (n - 1));
    for i in 0..around {
        triangles.push([0, index(i, 1), index(i + 1, 1)]);
        for j in 1..n - 1 {
            let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([last, index(i + 1, n - 1), index(i, n - 1)]);
    }
    TriMesh::new(points, triangles).unwrap()
}

/// Writes a mesh as raw numbers, for another program to be timed on the same triangles.
fn dump(folder: &str, name: &str, mesh: &TriMesh) {
    let points: Vec<u8> = mesh.points().iter().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect();
    let triangles: Vec<u8> = mesh.triangles().iter().flatten().flat_map(|k| k.to_le_bytes()).collect();
    std::fs::write(format!("{folder}/{name}.f64"), points).unwrap();
    std::fs::write(format!("{folder}/{name}.u32"), triangles).unwrap();
}

fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn query(n: usize, one: &rayon::ThreadPool) {
    let (a, b) = (ball(n, DVec3::ZERO, 0.0), ball(n, DVec3::new(0.11, 0.07, 0.05), 1.3));
    if let Ok(folder) = std::env::var("PATCHWRIGHT_DUMP") {
        dump(&folder, &format!("a{n}"), &a);
        dump(&folder, &format!("b{n}"), &b);
    }
    let start = Instant::now();
    let trees = [&a, &b].map(|m| TriTree::new(m.points().to_vec(), m.triangles()));
    let build = ms(start);
    let build_one = one.install(|| {
        let start = Instant::now();
        let _trees = [&a, &b].map(|m| TriTree::new(m.points().to_vec(), m.triangles()));
        ms(start)
    });
    let view = |m: &'static TriMesh| Triangles { points: m.points(), triangles: m.triangles() };
    let (a, b): (&'static TriMesh, &'static TriMesh) = (Box::leak(Box::new(a)), Box::leak(Box::new(b)));
    let (times, found): (Vec<f64>, Vec<_>) = one.install(|| {
        (0..5)
            .map(|_| {
                let start = Instant::now();
                let found = intersect(view(a), &trees[0], view(b), &trees[1], &Job::new());
                (ms(start), found)
            })
            .unzip()
    });
    println!(
        "{:>9} x {:<9} {:>7} segments, {:>3} curves: trees {build:7.0} ms on all threads, {build_one:7.0} ms on one; query \
         {:7.1} ms on one",
        a.triangles().len(),
        b.triangles().len(),
        found[0].topology.segments.len(),
        found[0].chains.len(),
        median(times)
    );
}

fn refinement() {
    let knots = || Knots::bezier(2, -1.0, 1.0).unwrap();
    let [x, square] = [[-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]];
    let at = |h: f64| {
        let points =
            (0..9).map(|k| (k % 3, k / 3)).map(|(i, j)| DVec3::new(x[i], x[j], 0.3 * square[i] - 0.2 * square[j] + h));
        Surface::new(knots(), knots(), points.collect(), None).unwrap()
    };
    let s = at(0.05);
    let corners = [[0.0, -1.0, -0.9], [0.1, 1.0, -1.0], [0.0, -1.0, 1.0], [-0.1, 1.0, 1.1]].map(DVec3::from_array);
    let r = Surface::bilinear(corners).unwrap();
    let diagonal = s.bounds().union(&r.bounds()).diagonal();
    let (mut worst, mut total, count) = (0, 0, 2000);
    let start = Instant::now();
    for k in 0..count {
        let y = -0.9 + 1.8 * f64::from(k) / f64::from(count);
        let from = Sheet::Surface(&s, DVec2::new(0.05, y));
        let refined = refine(from, Sheet::Surface(&r, DVec2::new(0.5 + 0.5 * y, 0.47)), 1e-10 * diagonal).unwrap();
        worst = worst.max(refined.iterations);
        total += refined.iterations;
    }
    println!(
        "refinement to 1e-10 of the diagonal: {:.2} iterations a point, at most {worst} (target 5), {:.2} us a point",
        f64::from(total as u32) / f64::from(count),
        ms(start) * 1e3 / f64::from(count)
    );
}

/// A binary STL file of 200 MB as the window opens it: read and welded, its first triangles made, and dressed for the
/// graphics card; then, while the picture is there, what picking needs.
fn large_stl() {
    let folder = tempfile::tempdir().unwrap();
    for (order, shuffled) in [("in order", false), ("in random order", true)] {
        let path = folder.path().join("large.stl");
        let size = write_large(&path, shuffled);
        let rounds: Vec<[f64; 10]> = (0..5).map(|_| first_picture(&path, size)).collect();
        let all: [f64; 10] = std::array::from_fn(|k| median(rounds.iter().map(|r| r[k]).collect()));
        let names = ["read and welded", "shaded", "dressed", "drawn"];
        let phases: Vec<String> = (0..4)
            .filter(|&k| all[2 * k] > 0.0)
            .map(|k| format!("{} {:.0} ms ({:.0} of CPU)", names[k], all[2 * k], all[2 * k + 1]))
            .collect();
        println!(
            "{:.0} MB of binary STL, triangles {order}: {}: {:.0} ms ({:.0} of CPU) to the first picture (target 1500), \
             {:.2} x the file in memory until then (target 4), {:.2} x until all can be picked",
            size / 1e6,
            phases.join(", "),
            all[0] + all[2] + all[4] + all[6],
            all[1] + all[3] + all[5] + all[7],
            all[8],
            all[9]
        );
    }
}

/// CPU time of all threads in ms, which other programs do not lengthen; 0 where the system does not say.
fn cpu() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanos = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    nanos.sum::<f64>() * 1e-6
}

/// Measures phases: pairs of wall and CPU time.
struct Laps {
    start: Instant,
    cpu: f64,
    times: Vec<f64>,
}

impl Laps {
    fn new() -> Self {
        Self { start: Instant::now(), cpu: cpu(), times: Vec::new() }
    }

    fn lap(&mut self) {
        self.times.extend([ms(self.start), cpu() - self.cpu]);
        (self.start, self.cpu) = (Instant::now(), cpu());
    }
}

fn write_large(path: &std::path::Path, shuffled: bool) -> f64 {
    let mut bytes = stl::write_binary(&ball(1001, DVec3::ZERO, 0.0));
    if shuffled {
        let (count, mut state) = ((bytes.len() - 84) / 50, 1_u64);
        for k in (1..count).rev() {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let (k, other) = (84 + 50 * k, 84 + 50 * ((state >> 33) as usize % k));
            let (head, tail) = bytes.split_at_mut(k);
            head[other..other + 50].swap_with_slice(&mut tail[..50]);
        }
    }
    std::fs::write(path, &bytes).unwrap();
    bytes.len() as f64
}

/// Wall and CPU times of reading, shading, dressing and drawing; the peak until the picture and until all is there as parts
/// of `size`.
fn first_picture(path: &std::path::Path, size: f64) -> [f64; 10] {
    let mut screen = screen();
    let mut laps = Laps::new();
    let ((document, mut scene, view, drawn), peak, kept) = memory(|| {
        let document = patchwright::io::open(path).unwrap().document;
        laps.lap();
        let mut scene = Scene::default();
        scene.sync(&document);
        let viewport = Viewport::new(1600.0, 1000.0);
        let mut camera = Camera::default();
        camera.frame(&scene.bounds(), viewport);
        let view = View::new(&camera, viewport, &scene.bounds());
        let made: Vec<Made> = scene.wanted(&view).into_iter().map(Request::run).collect();
        laps.lap();
        let drawn = draw(&mut screen, &mut scene, made, &view, &mut laps);
        assert!(scene.counts().0 > 3_900_000);
        (document, scene, view, drawn)
    });
    let ((), more, _) = memory(|| scene.refine(&view));
    drop((document, drawn));
    laps.times.resize(8, 0.0);
    let memory = [peak / size, peak.max(kept + more) / size];
    std::array::from_fn(|k| if k < 8 { laps.times[k] } else { memory[k - 8] })
}

/// What draws: pipelines that are ready, as those of a window that is open.
#[cfg(feature = "editor")]
fn screen() -> Option<Offscreen> {
    static GPU: std::sync::OnceLock<Option<Gpu>> = std::sync::OnceLock::new();
    let gpu = GPU.get_or_init(|| {
        let gpu = Gpu::headless().ok();
        println!("drawn by {}", gpu.as_ref().map_or("nothing, there is no adapter", |gpu| &gpu.name));
        gpu
    });
    gpu.clone().map(Offscreen::new)
}

/// Packs the triangles, dresses the scene and draws it.
#[cfg(feature = "editor")]
fn draw(screen: &mut Option<Offscreen>, scene: &mut Scene, made: Vec<Made>, view: &View, laps: &mut Laps) -> Stage {
    let mut stage = Stage::default();
    for made in made {
        stage.accept(Prepared::new(&made));
        scene.accept(made);
    }
    let frame = Arc::new(stage.frame(scene, view, &Look::default(), |_| Emphasis::Normal));
    laps.lap();
    if let Some(screen) = screen {
        screen.render(&frame).unwrap();
        laps.lap();
    }
    stage
}

/// Without the editor's graphics nothing is drawn.
#[cfg(not(feature = "editor"))]
fn screen() {}

#[cfg(not(feature = "editor"))]
fn draw((): &mut (), scene: &mut Scene, made: Vec<Made>, _: &View, _: &mut Laps) {
    made.into_iter().for_each(|made| _ = scene.accept(made));
}

fn main() {
    let millions: f64 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(1.0);
    let one = Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap());
    println!("two lumpy balls, trees and query (targets: trees 1500 ms, query 300 ms on one thread)");
    for part in [16.0, 4.0, 1.0] {
        let n = (millions * 1e6 / part / 4.0).sqrt().round() as usize;
        query(n, &one);
    }
    refinement();
    large_stl();
}
