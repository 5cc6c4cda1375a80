//! Healing as a whole: sets of patches, bad input, cancelling, thread counts, and a real broken model.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops at what it did not expect")]

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use patchwright::io;
use patchwright::kernel::geom::{Knots, Side, Surface};
use patchwright::kernel::heal::boundary_loop::LoopError;
use patchwright::kernel::heal::connect::ConnectError;
use patchwright::kernel::heal::preview::{PreviewOptions, preview};
use patchwright::kernel::heal::{HealError, SharedBoundary};
use patchwright::kernel::job::Job;
use patchwright::kernel::mesh::surface_set::SurfaceSet;
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::healing::{self, HealingError};
use patchwright::model::resolve::{PieceError, ResolveError, resolve};
use patchwright::model::spec::{BoundaryMode, HealSpec, IsoAt, PatchSpec, Piece};

/// A C2 graph over [0, 4] x [0, 2].
fn hills() -> Surface {
    let ku = Knots::clamped(3, &[0.0, 1.0, 2.0, 3.0, 4.0], 1).unwrap();
    let kv = Knots::clamped(3, &[0.0, 1.0, 2.0], 1).unwrap();
    let (gu, gv) = (ku.greville(), kv.greville());
    let f = |x: f64, y: f64| DVec3::new(x, y, 0.3 * (1.3 * x).sin() + 0.2 * (1.7 * y).cos());
    let points = gv.iter().flat_map(|&y| gu.iter().map(move |&x| f(x, y))).collect();
    Surface::new(ku, kv, points, None).unwrap()
}

fn model(map: &DAffine3) -> Document {
    let mut document = Document::new(Unit::Millimetre);
    document.add("hills", Shape::Surface(Arc::new(hills().transformed(map))), None);
    document
}

fn iso(at: IsoAt, from: f64, to: f64) -> Vec<Piece> {
    vec![Piece::Iso { surface: 0, at, from, to }]
}

fn rectangle(name: &str, u: [f64; 2], v: [f64; 2]) -> PatchSpec {
    let sides = [
        iso(IsoAt::V(v[0]), u[0], u[1]),
        iso(IsoAt::U(u[1]), v[0], v[1]),
        iso(IsoAt::V(v[1]), u[0], u[1]),
        iso(IsoAt::U(u[0]), v[0], v[1]),
    ];
    PatchSpec { name: name.into(), sides, ..PatchSpec::default() }
}

fn spec(patches: Vec<PatchSpec>) -> HealSpec {
    HealSpec { patches, ..HealSpec::from_ron("(patches: [])").unwrap() }
}

fn line(a: (f64, f64, f64), b: (f64, f64, f64)) -> Vec<Piece> {
    vec![Piece::Line(a, b)]
}

fn error(spec: &HealSpec) -> HealingError {
    healing::run(&model(&DAffine3::IDENTITY), spec, &Job::new()).unwrap_err()
}

#[test]
fn neighbours_agree_bit_for_bit_and_are_nearly_tangent() {
    let mut patches = vec![rectangle("left", [0.3, 1.7], [0.2, 1.8]), rectangle("right", [1.7, 3.8], [0.2, 1.8])];
    // The neighbour runs its sides the other way and starts elsewhere.
    patches[1].sides.rotate_left(1);
    patches[1].sides[2] = iso(IsoAt::U(1.7), 1.8, 0.2);
    for mode in [BoundaryMode::Keep, BoundaryMode::Project] {
        patches.iter_mut().for_each(|p| p.boundary = [mode; 4]);
        let healing = healing::run(&model(&DAffine3::IDENTITY), &spec(patches.clone()), &Job::new()).unwrap();
        let [SharedBoundary { patches: pair, slots, max_gap, max_normal_angle_deg }] = healing.healed.shared[..] else {
            panic!("{:?}", healing.healed.shared)
        };
        assert_eq!((pair, max_gap), ([0, 1], 0.0));
        assert!(max_normal_angle_deg < 0.5, "{max_normal_angle_deg}");
        let row = |p: usize, slot: usize| {
            let s = &healing.patches[p].1.surface;
            let [nu, nv] = s.counts();
            let points = s.points();
            let mut row: Vec<DVec3> = match slot {
                0 => points[..nu].to_vec(),
                2 => points[(nv - 1) * nu..].to_vec(),
                1 => (0..nv).map(|j| points[j * nu + nu - 1]).collect(),
                _ => (0..nv).map(|j| points[j * nu]).collect(),
            };
            if row[0].y > row[row.len() - 1].y {
                row.reverse();
            }
            row
        };
        assert_eq!(row(0, slots[0]), row(1, slots[1]));
        assert!(healing.patches.iter().all(|p| p.1.report.reached));
    }
}

#[test]
fn scaled_and_moved_models_heal_the_same() {
    let base = spec(vec![rectangle("a", [0.3, 3.7], [0.2, 1.8])]);
    let expected = healing::run(&model(&DAffine3::IDENTITY), &base, &Job::new()).unwrap();
    let e = &expected.patches[0].1.report;
    for (scale, shift) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 4e4)] {
        let map =
            DAffine3::from_scale(DVec3::splat(scale)) * DAffine3::from_translation(DVec3::new(shift, -shift, shift));
        let other = healing::run(&model(&map), &base, &Job::new()).unwrap();
        let r = &other.patches[0].1.report;
        assert_eq!((r.resolution, r.projected, r.artificial), (e.resolution, e.projected, e.artificial));
        assert!((r.max_error / scale - e.max_error).abs() < 1e-3 * e.max_error, "{scale} {shift}");
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let base = spec(vec![rectangle("a", [0.3, 1.7], [0.2, 1.8]), rectangle("b", [1.7, 3.7], [0.2, 1.8])]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| healing::run(&model(&DAffine3::IDENTITY), &base, &Job::new()).unwrap())
    };
    let (one, four) = (with(1), with(4));
    for (a, b) in one.patches.iter().zip(&four.patches) {
        assert_eq!(a.1.surface, b.1.surface);
        assert_eq!(a.1.report, b.1.report);
    }
}

#[test]
fn a_cancelled_heal_is_marked_and_keeps_what_was_finished() {
    let job = Job::new();
    job.cancel();
    let base = spec(vec![rectangle("a", [0.3, 3.7], [0.2, 1.8])]);
    let healing = healing::run(&model(&DAffine3::IDENTITY), &base, &job).unwrap();
    assert!(!healing.healed.complete && healing.patches.is_empty());
}

#[test]
fn four_curves_that_are_no_loop_are_named() {
    let corner = |x: f64, y: f64| (x, y, 0.0);
    let (a, b, c, d) = (corner(0.0, 0.0), corner(3.0, 0.0), corner(3.0, 1.0), corner(0.0, 1.0));
    let loop_error = |sides: [Vec<Piece>; 4]| {
        let patch = PatchSpec { name: "bad".into(), sides, ..PatchSpec::default() };
        match error(&spec(vec![patch])) {
            HealingError::Heal(HealError::Loop { patch, source }) => {
                assert_eq!(patch, "bad");
                source
            }
            other => panic!("{other}"),
        }
    };
    let open = loop_error([line(a, b), line(b, c), line(c, d), line(d, corner(0.0, 0.4))]);
    assert!(matches!(open, LoopError::CornerGap { sides: [4, 1], more: 0, .. }), "{open}");
    assert!(open.to_string().contains("4.000e-1 between sides 4 and 1"), "{open}");
    let crossing = loop_error([line(a, c), line(c, b), line(b, d), line(d, a)]);
    assert!(matches!(crossing, LoopError::Cross { sides: [1, 3], .. }), "{crossing}");
    let coincident = loop_error([line(a, b), line(b, c), line(b, a), line(d, a)]);
    assert!(matches!(coincident, LoopError::Coincide { sides: [1, 3], .. }), "{coincident}");
    let short = loop_error([line(a, b), line(b, corner(3.0, 1e-6)), line(c, d), line(d, a)]);
    assert!(matches!(short, LoopError::ZeroLength { side: 2, .. }), "{short}");
}

#[test]
fn pieces_and_patches_that_cannot_be_are_named() {
    let mut zero = rectangle("zero", [0.3, 3.7], [0.2, 1.8]);
    zero.sides[1] = iso(IsoAt::U(3.7), 0.2, 0.2);
    let expected =
        ResolveError::Piece { patch: "zero".into(), side: 2, piece: 1, source: PieceError::ZeroLength { at: 0.2 } };
    assert_eq!(error(&spec(vec![zero])), HealingError::Resolve(expected));

    let mut empty = rectangle("empty", [0.3, 3.7], [0.2, 1.8]);
    empty.sides[3].clear();
    assert!(matches!(error(&spec(vec![empty])), HealingError::Heal(HealError::Side { side: 4, .. })));

    let (a, b, c, d) = ((0.0, 0.0, 9.0), (1.0, 0.0, 9.0), (1.0, 1.0, 9.0), (0.0, 1.0, 9.0));
    let sides = [line(a, b), line(b, c), line(c, d), line(d, a)];
    let far = PatchSpec { name: "far".into(), sides, ..PatchSpec::default() };
    match error(&spec(vec![far])) {
        HealingError::Heal(HealError::NoProjection { patch, samples: 81, .. }) => assert_eq!(patch, "far"),
        other => panic!("{other}"),
    }

    assert_eq!(error(&spec(vec![])), HealingError::Heal(HealError::NoPatch));
    let mut wrong = spec(vec![rectangle("a", [0.3, 3.7], [0.2, 1.8])]);
    wrong.onto = Some(vec![0, 7]);
    assert_eq!(error(&wrong), HealingError::Resolve(ResolveError::Onto { number: 7, count: 1 }));
    wrong.onto = None;
    for tol in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        wrong.tol = Some(tol);
        assert!(matches!(error(&wrong), HealingError::Heal(HealError::Option { name: "tol", .. })));
    }
    let three = vec![
        rectangle("a", [0.3, 1.7], [0.2, 1.8]),
        rectangle("b", [1.7, 3.7], [0.2, 1.8]),
        rectangle("c", [1.7, 3.0], [0.2, 1.8]),
    ];
    assert!(matches!(
        error(&spec(three)),
        HealingError::Heal(HealError::Connect(ConnectError::Bifurcation { .. } | ConnectError::FullFace { .. }))
    ));
}

#[test]
fn previews_come_from_two_sides_on() {
    let document = model(&DAffine3::IDENTITY);
    let resolved = resolve(&spec(vec![rectangle("a", [0.3, 3.7], [0.2, 1.8])]), &document, &Job::new()).unwrap();
    let set = SurfaceSet::new(resolved.surfaces.clone(), 1e-3, &Job::new());
    let sides = resolved.patches[0].sides.to_vec();
    let sketch = |sides: &[Vec<_>]| preview(sides, Some(&set), &PreviewOptions::default(), &Job::new());
    assert!(sketch(&sides[..1]).is_none());
    let ruled = sketch(&[sides[0].clone(), sides[2].clone()]).unwrap();
    assert!(ruled.samples.is_none() && !ruled.folded);
    let u = document.surfaces().next().unwrap().1.eval(DVec2::new(0.3, 0.2));
    assert!(ruled.grid[(0, 0)].distance(u) < 1e-9 || ruled.grid[(0, 12)].distance(u) < 1e-9);
    let three = sketch(&sides[..3]).unwrap();
    assert!(three.corners.len() == 2 && three.corners.iter().all(|c| c.1 < 1e-9));
    let four = sketch(&sides).unwrap();
    assert!(four.corners.len() == 4 && four.choice.is_some());
    let samples = four.samples.unwrap();
    assert!(samples.values().iter().filter(|s| s.is_some()).count() > 160);
}

#[test]
fn the_crossing_region_of_a_real_model_is_healed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = folder.join("../shared/data/models/pocc_surf114.igs");
    if !path.exists() {
        println!("skipped: no shared data");
        return;
    }
    let document = io::open(&path).unwrap().document;
    let text = std::fs::read_to_string(folder.join("tests/data/pocc_crossing.heal.ron")).unwrap();
    let healing = healing::run(&document, &HealSpec::from_ron(&text).unwrap(), &Job::new()).unwrap();
    assert_eq!(healing.patches.len(), 3);
    for (name, patch) in &healing.patches {
        let r = &patch.report;
        println!("{name}: {:.2e}, {} samples, {} artificial", r.max_error, r.projected, r.artificial);
        assert!(r.reached && r.artificial == 0 && r.kept == 0);
    }
    // The leaves now end on the stem instead of inside it.
    let stem = SurfaceSet::new(vec![(1, Arc::clone(document.surfaces().nth(1).unwrap().1))], 1e-4, &Job::new());
    for (_, patch) in &healing.patches[..2] {
        let end = patch.surface.border(Side::VMax).unwrap();
        for (_, p) in end.sampled(2) {
            let foot = stem.closest(p, f64::INFINITY, &mut Default::default()).unwrap();
            assert!(foot.distance < 4e-4, "{}", foot.distance);
        }
    }
}

#[test]
fn the_open_ring_of_a_real_model_is_bridged() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = folder.join("../shared/data/models/pocc_surf114.igs");
    if !path.exists() {
        println!("skipped: no shared data");
        return;
    }
    let document = io::open(&path).unwrap().document;
    let text = std::fs::read_to_string(folder.join("tests/data/pocc_ring.heal.ron")).unwrap();
    let healing = healing::run(&document, &HealSpec::from_ron(&text).unwrap(), &Job::new()).unwrap();
    assert!(healing.patches.iter().all(|(_, patch)| patch.report.reached));
    // Both ways round: two common boundaries, without a gap.
    assert!(healing.healed.shared.len() == 2 && healing.healed.shared.iter().all(|s| s.max_gap == 0.0));
    // The rings missed each other by a millimetre; every point of either now lies on a patch.
    let patches = healing.patches.iter().enumerate().map(|(k, (_, p))| (k, Arc::clone(&p.surface))).collect();
    let patches = SurfaceSet::new(patches, 1e-5, &Job::new());
    for (surface, side) in [(1, Side::VMax), (3, Side::UMin)] {
        let ring = document.surfaces().nth(surface).unwrap().1.border(side).unwrap();
        for (_, p) in ring.sampled(8) {
            let foot = patches.closest(p, f64::INFINITY, &mut Default::default()).unwrap();
            assert!(foot.distance < 1e-4, "{}", foot.distance);
        }
    }
}
