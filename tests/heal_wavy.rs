//! `heal_wavy` of the shared data: four pieces of a wavy surface around a missing rectangle; surface 4 is the
//! whole parent, the truth.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops at what it did not expect")]

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use patchwright::io;
use patchwright::kernel::geom::Surface;
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::surface_set::{Scratch, SurfaceSet};
use patchwright::model::document::Document;
use patchwright::model::healing::{self, Healing};
use patchwright::model::spec::{BoundaryMode, HealSpec, IsoAt, PatchSpec, Piece};

fn model() -> Option<Document> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases/heal_wavy.igs"));
    if !path.exists() {
        println!("skipped: no shared data");
        return None;
    }
    Some(io::open(&path).unwrap().document)
}

/// The iso-line of the parent over part of it, as pieces of the surfaces 0 to 3 that it runs through.
fn iso(document: &Document, at: IsoAt, from: f64, to: f64) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut done = from;
    // Domains of the pieces are those of the parent.
    while done < to {
        let next = document.surfaces().take(4).enumerate().find_map(|(k, (_, s))| {
            let [u, v] = s.domain();
            let (c, across, along) = match at {
                IsoAt::U(c) => (c, u, v),
                IsoAt::V(c) => (c, v, u),
            };
            let holds = across[0] <= c && c <= across[1] && along[0] <= done && done < along[1];
            holds.then(|| (k, along[1].min(to)))
        });
        let (surface, end) = next.expect("the iso-line runs through the model");
        pieces.push(Piece::Iso { surface, at, from: done, to: end });
        done = end;
    }
    pieces
}

fn spec(document: &Document, u: [f64; 2], v: [f64; 2], tol: f64) -> HealSpec {
    // Given out of order and direction on purpose.
    let sides = [
        iso(document, IsoAt::V(v[0]), u[0], u[1]),
        iso(document, IsoAt::V(v[1]), u[0], u[1]),
        iso(document, IsoAt::U(u[1]), v[0], v[1]),
        iso(document, IsoAt::U(u[0]), v[0], v[1]),
    ];
    HealSpec {
        tol: Some(tol),
        onto: Some(vec![0, 1, 2, 3]),
        patches: vec![PatchSpec {
            name: "wavy".into(),
            boundary: [BoundaryMode::Keep; 4],
            sides,
            ..PatchSpec::default()
        }],
        ..HealSpec::default()
    }
}

fn heal(document: &Document, spec: &HealSpec) -> Healing {
    healing::run(document, spec, &Job::new()).unwrap()
}

/// The largest distance of a dense grid of patch points from a surface.
fn distance(patch: &Surface, truth: &Arc<Surface>) -> f64 {
    let set = SurfaceSet::new(vec![(0, Arc::clone(truth))], 1e-3, &Job::new());
    let mut scratch = Scratch::default();
    let mut worst = 0.0_f64;
    for i in 0..=80 {
        for j in 0..=80 {
            let p = patch.eval(DVec2::new(f64::from(i), f64::from(j)) / 80.0);
            worst = worst.max(set.closest(p, f64::INFINITY, &mut scratch).unwrap().distance);
        }
    }
    worst
}

#[test]
fn the_region_follows_the_originals() {
    let Some(document) = model() else { return };
    let healing = heal(&document, &spec(&document, [1.0, 7.0], [1.0, 7.0], 4e-4));
    let report = &healing.patches[0].1.report;
    println!("{report:?}");
    assert!(report.reached && report.max_error <= 4e-4);
    // The error is also what an independent denser sampling finds, away from the hole.
    let patch = &healing.healed.patches[0];
    let truth: Arc<Surface> = Arc::clone(document.surfaces().nth(4).unwrap().1);
    let set = SurfaceSet::new(vec![(0, truth)], 1e-3, &Job::new());
    let mut scratch = Scratch::default();
    for i in 0..=160 {
        for j in 0..=160 {
            let p = patch.surface.eval(DVec2::new(f64::from(i), f64::from(j)) / 160.0);
            let foot = set.closest(p, f64::INFINITY, &mut scratch).unwrap();
            let in_hole = foot.uv.x > 2.7 && foot.uv.x < 5.3 && foot.uv.y > 1.7 && foot.uv.y < 6.3;
            assert!(in_hole || foot.distance <= 4e-4, "{} at {}", foot.distance, foot.uv);
        }
    }
}

#[test]
fn boundary_curves_are_interpolated_to_rounding() {
    let Some(document) = model() else { return };
    let healing = heal(&document, &spec(&document, [1.0, 7.0], [1.0, 7.0], 4e-4));
    let patch = &healing.healed.patches[0];
    let diagonal = document.bounds().diagonal();
    let (m, n) = (patch.samples.m(), patch.samples.n());
    let sides = &healing.healed.loops[0].sides;
    for k in 0..=m {
        let f = k as f64 / m as f64;
        for (side, uv) in [(sides[0].point(f), DVec2::new(f, 0.0)), (sides[2].point(1.0 - f), DVec2::new(f, 1.0))] {
            assert!(patch.surface.eval(uv).distance(side) <= 1e-12 * diagonal);
        }
    }
    for k in 0..=n {
        let f = k as f64 / n as f64;
        for (side, uv) in [(sides[1].point(f), DVec2::new(1.0, f)), (sides[3].point(1.0 - f), DVec2::new(0.0, f))] {
            assert!(patch.surface.eval(uv).distance(side) <= 1e-12 * diagonal);
        }
    }
}

#[test]
fn the_hole_is_filled_as_well_as_a_coons_patch_can() {
    let Some(document) = model() else { return };
    let healing = heal(&document, &spec(&document, [3.0, 5.0], [2.0, 6.0], 4e-4));
    let patch = &healing.healed.patches[0];
    println!("{:?}", patch.report);
    let error = distance(&patch.surface, document.surfaces().nth(4).unwrap().1);
    println!("hole: {error:.3e} from the truth");
    assert!(error <= 1.5e-1);
    assert_eq!(patch.report.artificial, (patch.samples.m() - 1) * (patch.samples.n() - 1));
}

#[test]
fn sides_in_any_order_and_direction_and_open_corners_give_the_same_patch() {
    let Some(document) = model() else { return };
    let base = spec(&document, [1.0, 7.0], [1.0, 7.0], 4e-4);
    let expected = heal(&document, &base);
    let mut shuffled = base.clone();
    shuffled.patches[0].sides.swap(1, 3);
    for side in &mut shuffled.patches[0].sides[1..] {
        side.reverse();
        for piece in side {
            if let Piece::Iso { from, to, .. } = piece {
                std::mem::swap(from, to);
            }
        }
    }
    let other = heal(&document, &shuffled);
    let [a, b] = [&expected, &other].map(|h| &h.healed.patches[0]);
    assert!((a.report.max_error - b.report.max_error).abs() < 1e-9);
    // Corners shortened by less than the joining tolerance are closed.
    let mut open = base.clone();
    if let Piece::Iso { from, .. } = &mut open.patches[0].sides[0][0] {
        *from += 3e-3;
    }
    let closed = heal(&document, &open);
    let gaps = closed.healed.loops[0].gaps;
    let widest = gaps.iter().copied().fold(0.0, f64::max);
    assert!(widest > 1e-4 && widest < document.tolerances().joining, "{gaps:?}");
    let corner: DVec3 = closed.healed.patches[0].surface.eval(DVec2::ZERO);
    assert!(corner.distance(a.surface.eval(DVec2::ZERO)) < widest);
}
