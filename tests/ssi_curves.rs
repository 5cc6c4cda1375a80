//! Intersection curves as polylines, cubic B-splines and biarcs: their error bounds, measured independently; all pairs
//! of a model; what is written and what another reader sees.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/forms.rs"]
mod forms;
#[path = "support/measure.rs"]
mod measure;

use std::path::Path;
use std::process::{Command, Output};

use forms::{cylinder, graph, rectangle, sphere, torus};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use measure::distance;
use patchwright::io;
use patchwright::kernel::geom::{Curve, Direction, Knots, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::ssi::result::{CurveEnd, CurveKind};
use patchwright::kernel::ssi::{
    FitError, Intersection, SsiOptions, fit_biarcs, fit_splines, intersect, intersect_all, tangency,
};
use patchwright::model::document::{Document, Shape, Unit};
use patchwright::model::traces::traces_of;

fn turn(s: &Surface, axis: DVec3, angle: f64) -> Surface {
    s.transformed(&DAffine3::from_axis_angle(axis, angle))
}

fn pose() -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -0.8, 0.5).normalize(), 1.1);
    DAffine3::from_mat3_translation(DMat3::from_quat(turn), DVec3::new(0.4, -0.3, 0.7))
}

/// A bicubic spline graph over [-1, 1]^2.
fn wavy(n: usize, phase: f64) -> Surface {
    let breaks: Vec<f64> = (0..=n).map(|k| -1.0 + 2.0 * k as f64 / n as f64).collect();
    let knots = Knots::clamped(3, &breaks, 1).unwrap();
    let at = knots.greville();
    let points = at
        .iter()
        .flat_map(|&y| at.iter().map(move |&x| DVec3::new(x, y, 0.3 * (5.0 * x + phase).sin() * (4.0 * y).cos())))
        .collect();
    Surface::new(knots.clone(), knots, points, None).unwrap()
}

/// Named pairs with curves of every kind: loops, seams, junctions, tangential circles, many patches, regions.
fn pairs() -> Vec<(&'static str, Surface, Surface)> {
    let moved = |s: Surface| s.transformed(&pose());
    let half = std::f64::consts::FRAC_PI_2;
    let bowl = graph(3, |x, y| x * x + 2.0 * y * y + 0.3 * x * x * y - 0.2);
    let whole = graph(3, |x, y| 0.4 * x * x * y - 0.3 * y * y + 0.2 * x);
    let parts = [whole.restricted([-1.0, 0.4], [-1.0, 0.3]), whole.restricted([-0.3, 1.0], [-0.6, 1.0])];
    let [a, b] = parts.map(Result::unwrap);
    // Flat for x < 0 and a parabola for x > 0: a curve that weaves over the knot line between them.
    let kinked = {
        let (u, v) = (Knots::clamped(2, &[-1.0, 0.0, 1.0], 1).unwrap(), Knots::bezier(1, -1.0, 1.0).unwrap());
        let row = |y: f64| [(-1.0, 0.0), (-0.5, 0.0), (0.5, 0.0), (1.0, 3.0)].map(|(x, z)| DVec3::new(x, y, z));
        Surface::new(u, v, [row(-1.0), row(1.0)].concat(), None).unwrap()
    };
    let wall = turn(&graph(9, |_, y| 0.02 * (5.0 * y).sin() + 0.3 * y * y * y * y - 0.05), DVec3::Y, half);
    vec![
        ("weaving over a knot line", moved(kinked), moved(wall)),
        ("loop", bowl, turn(&rectangle(2.0, 2.0, 0.0), DVec3::Z, 0.3)),
        ("unequal cylinders", moved(cylinder(1.0, -2.0, 2.0)), moved(turn(&cylinder(0.7, -2.0, 2.0), DVec3::X, half))),
        ("cylinders at 0.5 degrees", cylinder(1.0, -2.0, 2.0), turn(&cylinder(1.0, -2.0, 2.0), DVec3::X, 0.00873)),
        ("figure of eight", moved(torus(3.0, 1.0)), moved(turn(&rectangle(5.0, 5.0, 2.0), DVec3::Y, half))),
        ("tangent circle", moved(torus(3.0, 1.0)), moved(rectangle(5.0, 5.0, 1.0))),
        ("spline graphs", moved(wavy(5, 0.0)), moved(wavy(4, 1.0))),
        (
            "small circle",
            sphere(1.0),
            turn(&sphere(1.0), DVec3::X, 0.4).transformed(&DAffine3::from_translation(DVec3::new(1.2, 1.0, 1.2455))),
        ),
        ("overlap", a, b),
    ]
}

fn met(a: &Surface, b: &Surface) -> Intersection {
    intersect(&[(0, a)], &[(1, b)], &SsiOptions::default(), &Job::new()).unwrap()
}

fn flat(c: &Curve, t: f64) -> DVec2 {
    c.eval(t).truncate()
}

#[test]
fn the_bound_of_a_polyline_holds_everywhere() {
    for (name, a, b) in pairs() {
        let result = met(&a, &b);
        assert!(result.complete && !result.curves.is_empty(), "{name}");
        for (k, curve) in result.curves.iter().enumerate() {
            assert!(curve.error_bound <= result.tol, "{name} {k}: {:e} over {:e}", curve.error_bound, result.tol);
            let mut worst: f64 = 0.0;
            for w in curve.points.windows(2) {
                let (p, q) = (&w[0], &w[1]);
                if p.xyz.distance(q.xyz) < 1e-9 {
                    continue; // across a seam the parameters jump
                }
                for f in [0.21, 0.5, 0.77] {
                    let x = p.xyz.lerp(q.xyz, f);
                    worst = worst.max(distance(&a, x, p.uv.lerp(q.uv, f))).max(distance(&b, x, p.st.lerp(q.st, f)));
                }
            }
            assert!(worst <= curve.error_bound, "{name} {k}: {worst:e} over {:e}", curve.error_bound);
            // Along a contact the chords leave their curve, hardly the surfaces.
            let sharp = curve.kind == CurveKind::Transversal && curve.error_bound > 0.05 * result.tol;
            assert!(!sharp || worst > 0.02 * curve.error_bound, "{name} {k}: the bound is poor");
        }
    }
}

#[test]
fn splines_follow_within_their_bound_in_space_and_in_both_domains() {
    for (name, a, b) in pairs() {
        let surfaces = [(0, &a), (1, &b)];
        let result = met(&a, &b);
        for (k, curve) in result.curves.iter().enumerate() {
            let fit = fit_splines(curve, &surfaces, result.tol).unwrap();
            assert!(fit.within, "{name} {k}: {:e} over {:e}", fit.bound, result.tol);
            let (points, controls) = (curve.points.len(), fit.space.points().len());
            let mut worst: f64 = 0.0;
            let mut end: Option<f64> = None;
            for run in &fit.runs {
                let [t0, t1] = run.space.domain();
                assert_eq!(run.space.domain(), run.in_a.domain());
                assert_eq!(run.space.domain(), run.in_b.domain());
                assert!(end.is_none_or(|t| (t - t0).abs() < 1e-9));
                end = Some(t1);
                for i in 0..=400 {
                    let t = t0 + (t1 - t0) * f64::from(i) / 400.0;
                    let (x, uv, st) = (run.space.eval(t), flat(&run.in_a, t), flat(&run.in_b, t));
                    assert!(x.distance(fit.space.eval(t)) < 1e-9, "{name} {k}");
                    worst = worst.max(distance(&a, x, uv)).max(distance(&b, x, st));
                    worst = worst.max(a.eval(a.clamped(uv)).distance(x)).max(b.eval(b.clamped(st)).distance(x));
                }
            }
            println!("{name} {k}: {points} points, {controls} control points, {worst:.1e} of {:.1e}", fit.bound);
            assert!(worst <= fit.bound + 1e-13, "{name} {k}: {worst:e} over {:e}", fit.bound);
            assert!(controls < points.max(40), "{name} {k}: {controls} control points for {points} points");
            let [p, q] = fit.space.ends();
            assert!(p.distance(curve.points[0].xyz) < 1e-12 && q.distance(curve.points[points - 1].xyz) < 1e-12);
        }
    }
}

#[test]
fn a_curve_over_a_seam_that_is_open_by_a_little_is_fitted_on_both_sides_of_it() {
    // The stem of a model of the shared data: its seam does not quite close, and a curve that crosses it is one curve.
    let whole = cylinder(1.0, -2.0, 2.0);
    let [nu, _] = whole.knots().each_ref().map(Knots::control_count);
    let mut points = whole.points().to_vec();
    for row in points.chunks_mut(nu) {
        row[nu - 1].x += 3e-7;
    }
    let [u, v] = whole.knots().clone();
    let open = Surface::new(u, v, points, whole.weights().map(<[f64]>::to_vec)).unwrap();
    let plane = turn(&rectangle(3.0, 3.0, 0.0), DVec3::new(0.6, 1.0, 0.0).normalize(), 0.4);
    let found = met(&open, &plane);
    let jump = |c: &patchwright::kernel::ssi::result::IntersectionCurve| {
        c.points.windows(2).any(|w| w[0].xyz != w[1].xyz && (w[0].uv.x - w[1].uv.x).abs() > 0.5)
    };
    assert!(found.curves.iter().any(jump), "the case is none: no curve crosses the seam");
    for curve in &found.curves {
        let fit = fit_splines(curve, &[(0, &open), (1, &plane)], 1e-5).unwrap();
        assert!(fit.within, "{}", fit.bound);
        let [start, end] = fit.space.domain();
        for k in 0..=400 {
            let p = fit.space.eval(start + (end - start) * f64::from(k) / 400.0);
            let off = (p.truncate().length() - 1.0).abs();
            assert!(off <= 1e-5, "{p} is {off} off the cylinder");
        }
    }
}

#[test]
fn biarcs_are_smooth_monotone_and_within_their_bound() {
    for (name, a, b) in pairs() {
        let surfaces = [(0, &a), (1, &b)];
        let result = met(&a, &b);
        for (k, curve) in result.curves.iter().enumerate().filter(|(_, c)| c.kind != CurveKind::CoincidentBoundary) {
            let biarcs = fit_biarcs(curve, &surfaces, result.tol).unwrap();
            assert!(biarcs.within, "{name} {k}: {:e} over {:e}", biarcs.bound, result.tol);
            let mut worst: f64 = 0.0;
            for run in &biarcs.runs {
                for pair in &run.pairs {
                    for i in 0..=12 {
                        let [uv, st] = pair.at(f64::from(i) / 12.0);
                        let (x, y) = (a.eval(a.clamped(uv)), b.eval(b.clamped(st)));
                        assert!(x.distance(y) <= pair.bound + 1e-13, "{name} {k}");
                        worst = worst.max(distance(&b, x, st)).max(distance(&a, y, uv));
                    }
                    // No arc of a monotone piece turns by half a circle, but for what is shorter than rounding at a border.
                    for arcs in [&pair.in_a, &pair.in_b] {
                        let long = arcs.iter().filter(|x| x.length > 1e-6);
                        let turn = long.map(|x| (x.curvature * x.length).abs()).fold(0.0, f64::max);
                        assert!(turn < std::f64::consts::PI, "{name} {k}");
                    }
                }
                for w in run.pairs.windows(2) {
                    for (x, y) in [(w[0].in_a[1], w[1].in_a[0]), (w[0].in_b[1], w[1].in_b[0])] {
                        assert!(x.end().distance(y.start) < 1e-7, "{name} {k}");
                        // The direction of what is shorter than rounding at a piece's border says nothing.
                        let long = x.length.min(y.length) > 1e-6;
                        assert!(!long || x.tangent(x.length).dot(y.direction) > 1.0 - 1e-7, "{name} {k}: a kink");
                    }
                }
            }
            let count: usize = biarcs.runs.iter().map(|r| r.pairs.len()).sum();
            println!("{name} {k}: {} points, {count} biarcs, {worst:.1e} of {:.1e}", curve.points.len(), biarcs.bound);
            assert!(worst <= biarcs.bound + 1e-13, "{name} {k}: {worst:e} over {:e}", biarcs.bound);
        }
    }
}

#[test]
fn a_fit_says_what_it_lacks() {
    let (_, a, b) = pairs().swap_remove(0);
    let result = met(&a, &b);
    let curve = &result.curves[0];
    assert_eq!(fit_splines(curve, &[(0, &a)], 1e-6).unwrap_err(), FitError::MissingSurface { number: 1 });
    assert!(matches!(fit_biarcs(curve, &[(0, &a), (1, &b)], 0.0), Err(FitError::Tolerance { .. })));
    let mut short = curve.clone();
    short.points.truncate(1);
    assert_eq!(fit_splines(&short, &[(0, &a), (1, &b)], 1e-6).unwrap_err(), FitError::Short { points: 1 });
}

/// Four walls around a box and a wavy floor through them; the floor is cut into two patches.
fn walls() -> Vec<Surface> {
    let wall =
        |p: DVec2, q: DVec2| Surface::bilinear([p.extend(-1.0), q.extend(-1.0), p.extend(1.0), q.extend(1.0)]).unwrap();
    let c = [(-0.7, -0.7), (0.7, -0.7), (0.7, 0.7), (-0.7, 0.7)].map(DVec2::from);
    let floor = graph(3, |x, y| 0.2 * x * y + 0.1 * x * x);
    let mut out: Vec<Surface> = (0..4).map(|k| wall(c[k], c[(k + 1) % 4])).collect();
    out.push(floor.restricted([-1.0, 0.1], [-1.0, 1.0]).unwrap());
    out.push(floor.restricted([0.1, 1.0], [-1.0, 1.0]).unwrap());
    out
}

#[test]
fn all_pairs_of_a_model_meet_in_curves_that_run_over_its_patches() {
    let surfaces = walls();
    let list: Vec<_> = surfaces.iter().enumerate().collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| intersect_all(&list, &SsiOptions::default(), &Job::new()).unwrap())
    };
    let result = run(1);
    assert!(result.complete, "{:?}", result.unresolved.first());
    // The floor meets the walls in a ring that ends where it meets their creases, and cuts these; it runs on where the
    // floor was cut, which is smooth there.
    let height = |p: DVec3| p.z - 0.2 * p.x * p.y - 0.1 * p.x * p.x;
    let (ring, creases): (Vec<_>, Vec<_>) =
        result.curves.iter().partition(|c| c.points.iter().all(|p| height(p.xyz).abs() < 1e-9));
    assert_eq!((ring.len(), creases.len()), (4, 8));
    for curve in ring {
        assert_eq!(curve.ends, [CurveEnd::Junction; 2]);
        for p in &curve.points {
            assert!((p.xyz.x.abs().max(p.xyz.y.abs()) - 0.7).abs() < 1e-9);
            assert!(
                surfaces[p.a].eval(p.uv).distance(p.xyz) < 1e-12 && surfaces[p.b].eval(p.st).distance(p.xyz) < 1e-12
            );
        }
    }
    for curve in creases {
        assert!(curve.ends.contains(&CurveEnd::Boundary));
        let j = curve.end_ids.iter().flatten().map(|&id| result.junctions[id]).next().unwrap();
        assert!((j.xyz.truncate().abs() - 0.7).length() < 1e-12 && height(j.xyz).abs() < 1e-12);
    }
    // Three pairs of surfaces in each of the four corners.
    assert_eq!(result.junctions.len(), 12);
    let mut other = run(3);
    other.time_ms = result.time_ms;
    assert_eq!(other, result, "for any number of threads");
}

#[test]
fn cancelled_pairs_are_listed_and_what_was_done_is_kept() {
    let surfaces = walls();
    let list: Vec<_> = surfaces.iter().enumerate().collect();
    let job = Job::new();
    job.cancel();
    let result = intersect_all(&list, &SsiOptions::default(), &job).unwrap();
    assert!(!result.complete && result.unresolved.len() >= 8);
    let job = Job::new();
    let done = intersect_all(&list, &SsiOptions::default(), &job).unwrap();
    assert!(done.complete);
    assert_eq!(job.done(), 1.0);
}

#[test]
fn the_tangency_of_two_surfaces_is_found_from_their_tori() {
    // Two graphs whose difference is a saddle with a known critical point and gap.
    let shared = |x: f64, y: f64| 0.2 * x * x * y - 0.1 * y * y * y + 0.3 * x;
    for gap in [0.05, 1e-3, 0.0, -1e-3] {
        let a = graph(3, shared);
        let b = graph(3, move |x, y| shared(x, y) - (0.5 * (x - 0.1).powi(2) - 0.7 * (y + 0.2).powi(2) + gap));
        let found = tangency(&a, &b, DVec2::new(0.2, -0.1), DVec2::new(0.2, -0.1)).unwrap();
        assert!(!found.family && (4..=8).contains(&found.binormals.len()));
        let point = found.point.unwrap();
        // The normals are common to first order in the gap.
        assert!(point.uv.distance(DVec2::new(0.1, -0.2)) < 2.0 * f64::abs(gap) + 1e-9, "{point:?}");
        let (n, m) = (a.jet(point.uv, 1).cross().normalize(), b.jet(point.st, 1).cross().normalize());
        assert!(n.cross(m).length() < 1e-9);
        let across = a.eval(point.uv) - b.eval(point.st);
        assert!(across.cross(n).length() < 1e-9 && (across.dot(n) - point.gap).abs() < 1e-12);
        assert!(point.gap * gap >= 0.0 && point.curvatures[0] * point.curvatures[1] < 0.0);
    }
    let plane = rectangle(1.0, 1.0, 0.0);
    let found = tangency(&plane, &rectangle(1.0, 1.0, 0.3), DVec2::ZERO, DVec2::ZERO).unwrap();
    assert!(found.family && found.binormals.is_empty());
}

fn patchwright(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_patchwright")).current_dir(folder).args(arguments).output().unwrap()
}

fn model(folder: &Path) {
    let mut document = Document::new(Unit::Millimetre);
    for (k, s) in walls().into_iter().enumerate() {
        document.add(format!("surface {k}"), Shape::Surface(s.into()), None);
    }
    io::save(&folder.join("model.igs"), &document, &io::SaveOptions::default()).unwrap();
}

#[test]
fn intersect_takes_sets_one_set_or_the_whole_model() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let json = |arguments: &[&str]| -> serde_json::Value {
        let mut all = vec!["intersect", "model.igs", "--json", "-"];
        all.extend(arguments);
        let output = patchwright(folder.path(), &all);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let sets = json(&["--a", "0-3", "--b", "4,5"]);
    assert_eq!(sets["curves"].as_array().unwrap().len(), 1);
    assert_eq!(sets["curves"][0]["closed"], true);
    let rest = json(&["--a", "4-5"]);
    assert_eq!(rest["curves"].as_array().unwrap().len(), 1);
    assert_eq!(rest["curves"][0]["closed"], true);
    // All pairs: the creases of the walls are curves, too, and the ring ends where it meets them.
    assert_eq!(json(&[])["curves"].as_array().unwrap().len(), 12);
    for (arguments, code) in [(["--b", "1"], 2), (["--a", "9"], 2), (["--a", "x"], 2)] {
        let mut all = vec!["intersect", "model.igs"];
        all.extend(arguments);
        let output = patchwright(folder.path(), &all);
        assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let tol = patchwright(folder.path(), &["intersect", "model.igs", "--tol", "0"]);
    assert_eq!(tol.status.code(), Some(2));
}

/// Prints the length of every curve, and for every face its number of points on a grid.
const SCRIPT: &str = "
import sys, gmsh
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
gmsh.model.occ.importShapes(sys.argv[1], False)
gmsh.model.occ.synchronize()
faces = set()
for d, t in gmsh.model.getEntities(2):
    faces.update(abs(x[1]) for x in gmsh.model.getBoundary([(d, t)]))
for d, t in gmsh.model.getEntities(1):
    if t not in faces:
        print(repr(float(gmsh.model.occ.getMass(d, t))))
";

#[test]
fn curves_are_written_with_their_surfaces_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    model(folder.path());
    let output =
        patchwright(folder.path(), &["intersect", "model.igs", "--a", "0-3", "--b", "4-5", "--out", "curves.igs"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let path = folder.path().join("curves.igs");
    let opened = io::open(&path).unwrap();
    assert_eq!(opened.document.surfaces().count(), 6);
    let curves: Vec<_> = opened.document.curves().map(|(_, c)| c.clone()).collect();
    assert_eq!(curves.len(), 1, "parts of curves on surfaces are not free curves");
    let text = std::fs::read_to_string(&path).unwrap();
    let kinds: Vec<i64> = text
        .lines()
        .filter(|l| l.as_bytes().get(72) == Some(&b'D'))
        .step_by(2)
        .map(|l| l[..8].trim().parse().unwrap())
        .collect();
    let count = |kind: i64| kinds.iter().filter(|k| **k == kind).count();
    // At least six runs of the ring (four walls, two of them over both patches of the floor; one more where it starts
    // within a run), each on two surfaces, each with a curve in space and one in parameters.
    assert_eq!(count(128), 6);
    assert!(count(142) == 12 || count(142) == 14, "{}", count(142));
    assert_eq!(count(126), 1 + 2 * count(142));
    // The curve in space and the preimage of each part agree at their common parameters.
    let document = io::open(&folder.path().join("model.igs")).unwrap().document;
    let surfaces: Vec<_> = document.surfaces().map(|(_, s)| s.clone()).collect();
    let list: Vec<_> = surfaces.iter().map(|s| s.as_ref()).enumerate().collect();
    let (a, b) = list.split_at(4);
    let result = intersect(a, b, &SsiOptions::default(), &Job::new()).unwrap();
    let traces = traces_of(&result, &document, result.tol);
    assert!(
        traces.notes.is_empty() && traces.bound <= result.tol,
        "{:?} {:e} {:e}",
        traces.notes,
        traces.bound,
        result.tol
    );
    for trace in &traces.traces {
        let surface = document.get(trace.surface).unwrap().surface().unwrap();
        let [t0, t1] = trace.space.domain();
        for i in 0..=50 {
            let t = t0 + (t1 - t0) * f64::from(i) / 50.0;
            assert!(surface.eval(flat(&trace.in_surface, t)).distance(trace.space.eval(t)) <= traces.bound + 1e-13);
        }
    }
    let length: f64 = curves[0].sampled(400).windows(2).map(|w| w[0].1.distance(w[1].1)).sum();
    let python = std::env::var("PATCHWRIGHT_PYTHON").unwrap_or_else(|_| "python3".into());
    if !Command::new(&python).args(["-c", "import gmsh"]).output().is_ok_and(|o| o.status.success()) {
        println!("skipped: no Gmsh for {python}");
        return;
    }
    let output = Command::new(&python).args(["-c", SCRIPT]).arg(&path).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lengths: Vec<f64> = text.lines().filter_map(|l| l.parse().ok()).collect();
    // It cuts a curve at its corners.
    let run = |k: usize| (k..lengths.len()).map(|end| lengths[k..=end].iter().sum::<f64>()).collect::<Vec<_>>();
    let whole = (0..lengths.len()).flat_map(run).any(|l| (l - length).abs() < 1e-5);
    assert!(whole, "{lengths:?}, ours {length}");
    println!("OpenCASCADE sees {} free curves", lengths.len());
}

#[test]
fn bad_input_has_a_defined_answer() {
    let s = graph(3, |x, y| 0.3 * x * y);
    let all = |list: &[&Surface]| {
        let list: Vec<_> = list.iter().copied().enumerate().collect();
        intersect_all(&list, &SsiOptions::default(), &Job::new())
    };
    let none = all(&[]).unwrap();
    assert!(none.complete && none.curves.is_empty());
    assert!(all(&[&s]).unwrap().complete);
    // Twice the same surface: one region.
    let twice = all(&[&s, &s]).unwrap();
    assert!(twice.complete && twice.regions.len() == 1);
    // Points, curves and slivers end in bounded time with an answer.
    let point = Surface::bilinear([DVec3::new(0.1, 0.1, 0.003); 4]).unwrap();
    let line = Surface::bilinear([DVec3::NEG_Z, DVec3::Z, DVec3::NEG_Z, DVec3::Z]).unwrap();
    let sliver = Surface::bilinear([DVec3::NEG_Z, DVec3::Z, DVec3::NEG_Z + DVec3::X * 1e-13, DVec3::Z]).unwrap();
    for other in [&point, &line, &sliver] {
        for pair in [[&s, other], [other, &s], [other, other]] {
            let clock = std::time::Instant::now();
            let _ = all(&pair).unwrap();
            assert!(clock.elapsed().as_secs_f64() < 5.0);
        }
    }
    // No surface can hold what is not a number.
    assert!(Surface::bilinear([DVec3::NAN; 4]).is_err());
    // Tolerances.
    let with = |options: SsiOptions| intersect_all(&[(0, &s), (1, &s)], &options, &Job::new());
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e3] {
        assert!(with(SsiOptions { tol: Some(bad), ..SsiOptions::default() }).is_err());
        assert!(with(SsiOptions { gap_tol: Some(bad), ..SsiOptions::default() }).is_err());
    }
    // A reversed surface is still the same one.
    let region = all(&[&s, &s.reversed(Direction::U).swapped()]).unwrap();
    assert!(region.complete && region.regions.len() == 1);
    assert!(region.curves.iter().all(|c| c.kind == CurveKind::CoincidentBoundary && c.ends == [CurveEnd::Loop; 2]));
}
