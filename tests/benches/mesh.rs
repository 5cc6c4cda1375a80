//! Intersection of triangulations, and large STL files.
//!
//! With `PATCHWRIGHT_DUMP=FOLDER` the balls are written there as raw numbers (`.f64` points, `.u32` triangles), so that a
//! triangle-boolean library can be timed on the same triangles.
//!
//! `cargo bench --no-default-features --bench mesh [N]`: N x N million triangles (default 1), and rows with a quarter and
//! a sixteenth of them for the growth. Targets: both trees within 1.5 s, the query on one thread within 0.3 s; a 200 MB
//! STL within 1.5 s to the first picture and four times its size in memory (here: up to the shaded triangles; the
//! picture is measured by `patchwright render`).

#![allow(clippy::unwrap_used, reason = "a benchmark may stop")]

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, DVec3};
use patchwright::io::{ImportReport, stl};
use patchwright::kernel::geom::{Knots, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::tri_mesh::TriMesh;
use patchwright::kernel::mesh::tri_tree::TriTree;
use patchwright::kernel::mesh_ssi::intersect;
use patchwright::kernel::mesh_ssi::refine::{Sheet, refine};
use patchwright::kernel::mesh_ssi::topology::Triangles;

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

fn large_stl() {
    let mesh = ball(1001, DVec3::ZERO, 0.0);
    let bytes = stl::write_binary(&mesh);
    drop(mesh);
    let times: Vec<f64> = (0..3)
        .map(|_| {
            let start = Instant::now();
            let read = stl::read(&bytes, &mut ImportReport::default());
            assert!(read.triangles().len() > 3_900_000);
            ms(start)
        })
        .collect();
    println!("{:.0} MB of binary STL in memory: read and welded in {:.0} ms", bytes.len() as f64 / 1e6, median(times));
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
