//! Self-intersections judged against the shared cases: every arc once, both preimages matched, miter points exact.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

use std::path::PathBuf;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use patchwright::kernel::geom::{Direction, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::self_ssi::{SelfIntersectOptions, self_intersect};
use patchwright::kernel::ssi::result::{CurveEnd, CurveKind, Intersection, IntersectionCurve};
use serde_json::Value;

fn cases() -> Option<PathBuf> {
    Some(PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/cases"))).filter(|p| p.is_dir())
}

struct Case {
    name: String,
    surface: Surface,
    oracle: Value,
}

fn selfint_cases() -> Vec<Case> {
    let Some(folder) = cases() else {
        println!("skipped: no shared data");
        return Vec::new();
    };
    let mut names: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.to_string_lossy().ends_with(".oracle.json"))
        .collect();
    names.sort();
    names
        .into_iter()
        .filter_map(|path| {
            let oracle: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
            if oracle["problem"] != "selfint" {
                return None;
            }
            let igs = path.to_string_lossy().replace(".oracle.json", ".igs");
            let opened = patchwright::io::open(std::path::Path::new(&igs)).unwrap();
            let surface = opened.document.surfaces().next().unwrap().1.as_ref().clone();
            Some(Case { name: oracle["name"].as_str().unwrap().to_owned(), surface, oracle: oracle["oracle"].clone() })
        })
        .collect()
}

fn solve(surface: &Surface) -> Intersection {
    let found = self_intersect(surface, 0, &SelfIntersectOptions::default(), &Job::new()).unwrap();
    println!("   {:?}", found.evidence);
    found.result
}

fn points3(value: &Value) -> Vec<DVec3> {
    value.as_array().map_or_else(Vec::new, |list| {
        list.iter()
            .map(|p| DVec3::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap(), p[2].as_f64().unwrap()))
            .collect()
    })
}

fn points2(value: &Value) -> Vec<DVec2> {
    value.as_array().map_or_else(Vec::new, |list| {
        list.iter().map(|p| DVec2::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap())).collect()
    })
}

fn to_polyline(p: DVec3, line: &[DVec3]) -> f64 {
    line.windows(2)
        .map(|s| {
            let d = s[1] - s[0];
            let t = if d == DVec3::ZERO { 0.0 } else { ((p - s[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            p.distance(s[0] + d * t)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The distance of a pair of parameter points to a curve's chords in the four parameters.
fn pair_distance(curve: &IntersectionCurve, a: DVec2, b: DVec2) -> f64 {
    curve
        .points
        .windows(2)
        .map(|s| {
            let (du, dt) = (s[1].uv - s[0].uv, s[1].st - s[0].st);
            let squared = du.length_squared() + dt.length_squared();
            let at = (a - s[0].uv).dot(du) + (b - s[0].st).dot(dt);
            let t = if squared == 0.0 { 0.0 } else { (at / squared).clamp(0.0, 1.0) };
            (s[0].uv + du * t).distance(a) + (s[0].st + dt * t).distance(b)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The largest distance between two polylines, both ways.
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    let one = |a: &[DVec3], b: &[DVec3]| a.iter().map(|&p| to_polyline(p, b)).fold(0.0, f64::max);
    one(a, b).max(one(b, a))
}

fn line(curve: &IntersectionCurve) -> Vec<DVec3> {
    curve.points.iter().map(|p| p.xyz).collect()
}

fn self_curves(result: &Intersection) -> Vec<&IntersectionCurve> {
    result.curves.iter().filter(|c| c.kind == CurveKind::SelfIntersection).collect()
}

/// Everything that must be true of a result, whatever the surface: points lie on it twice, ends are what they say.
fn check_consistent(name: &str, surface: &Surface, result: &Intersection) {
    let diagonal = surface.bounds().diagonal();
    for curve in &result.curves {
        assert!(curve.error_bound <= 1.5e-6 * diagonal, "{name}: bound {}", curve.error_bound / diagonal);
        for p in &curve.points {
            let gap = surface.eval(p.uv).distance(p.xyz).max(surface.eval(p.st).distance(p.xyz));
            assert!(gap <= 1e-11 * diagonal, "{name}: {gap} off at {:?}", p.uv);
        }
        for k in 0..2 {
            let end = if k == 0 { curve.points.first() } else { curve.points.last() }.unwrap();
            if curve.ends[k] == CurveEnd::Miter {
                let miter = &result.miters[curve.end_ids[k].unwrap()];
                assert!(end.uv.distance(miter.uv) < 1e-9 && end.st.distance(miter.uv) < 1e-9, "{name}");
            }
        }
    }
    for miter in &result.miters {
        for corner in miter.quad {
            assert!(surface.eval(corner).distance(miter.xyz) <= miter.radius * (1.0 + 1e-9), "{name}");
        }
    }
    assert_eq!(result.complete, result.unresolved.is_empty(), "{name}: {:?}", result.unresolved);
}

#[test]
fn every_case_is_right() {
    for case in selfint_cases() {
        let (name, oracle) = (&case.name, &case.oracle);
        let started = std::time::Instant::now();
        let result = solve(&case.surface);
        println!("{name}: {:.1} ms, {:?} {:?}", started.elapsed().as_secs_f64() * 1e3, result.counts, result.time_ms);
        for curve in &result.curves {
            let ends = [curve.points.first().unwrap(), curve.points.last().unwrap()].map(|p| (p.uv, p.st));
            println!(
                "   {:?} {:?} {} points, {ends:?}, bound {:.1e}",
                curve.kind,
                curve.ends,
                curve.points.len(),
                curve.error_bound
            );
        }
        assert!(result.complete, "{name}: {:?}", result.unresolved.first());
        check_consistent(name, &case.surface, &result);
        let diagonal = case.surface.bounds().diagonal();
        let curves = self_curves(&result);
        let arcs = oracle["arcs"].as_array().unwrap();
        assert_eq!(curves.len(), arcs.len(), "{name}");
        for arc in arcs {
            let truth = points3(&arc["pts"]);
            let tol = arc["tol"].as_f64().unwrap();
            let curve =
                curves.iter().min_by(|a, b| apart(&line(a), &truth).total_cmp(&apart(&line(b), &truth))).unwrap();
            let distance = apart(&line(curve), &truth);
            assert!(distance <= tol, "{name}: an arc is {distance} away");
            assert_eq!(curve.closed, arc["closed"].as_bool().unwrap(), "{name}");
            if let Some(ends) = arc["ends"].as_array() {
                let mut expected: Vec<&str> = ends.iter().map(|e| e.as_str().unwrap()).collect();
                let mut got: Vec<&str> = curve
                    .ends
                    .iter()
                    .map(|e| match e {
                        CurveEnd::Miter => "miter",
                        CurveEnd::Boundary => "boundary",
                        CurveEnd::Loop => "loop",
                        _ => "other",
                    })
                    .collect();
                expected.sort_unstable();
                got.sort_unstable();
                assert_eq!(expected, got, "{name}");
            }
            let (uv, st) = (points2(&arc["uv"]), points2(&arc["st"]));
            for (a, b) in uv.iter().zip(&st) {
                let nearest = pair_distance(curve, *a, *b).min(pair_distance(curve, *b, *a));
                assert!(nearest < 4.0 * tol, "{name}: the pair {a} {b} is {nearest} away");
            }
        }
        let (miters, miter_uv) = (points3(&oracle["miters"]), points2(&oracle["miter_uv"]));
        assert_eq!(result.miters.len(), miters.len(), "{name}");
        for (xyz, uv) in miters.iter().zip(&miter_uv) {
            let near = result.miters.iter().map(|m| m.xyz.distance(*xyz)).fold(f64::INFINITY, f64::min);
            assert!(near <= 1e-9 * diagonal, "{name}: miter point {near} away");
            let near = result.miters.iter().map(|m| m.uv.distance(*uv)).fold(f64::INFINITY, f64::min);
            assert!(near <= 1e-8, "{name}: miter parameters {near} away");
        }
        assert!(result.junctions.is_empty() && result.regions.is_empty(), "{name}");
    }
}

/// What must not change when the surface is moved, scaled, or written down differently.
fn shape(result: &Intersection) -> (bool, usize, usize, Vec<[CurveEnd; 2]>) {
    let mut ends: Vec<[CurveEnd; 2]> = self_curves(result).iter().map(|c| c.ends).collect();
    for e in &mut ends {
        e.sort_by_key(|k| *k as u8);
    }
    ends.sort_by_key(|e| e.map(|k| k as u8));
    (result.complete, self_curves(result).len(), result.miters.len(), ends)
}

#[test]
fn moving_and_rewriting_change_nothing() {
    for case in selfint_cases() {
        let reference = solve(&case.surface);
        let diagonal = case.surface.bounds().diagonal();
        let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8));
        let far = DVec3::new(1.0, -2.0, 0.5).normalize() * 1e4 * diagonal;
        let maps = [
            DAffine3::from_scale(DVec3::splat(1e-3)),
            DAffine3::from_scale(DVec3::splat(1e3)),
            DAffine3::from_mat3_translation(turn, DVec3::new(0.3, 0.1, -0.7) * diagonal),
            DAffine3::from_translation(far),
        ];
        for (k, map) in maps.iter().enumerate() {
            let moved = solve(&case.surface.transformed(map));
            assert_eq!(shape(&moved), shape(&reference), "{} map {k}: {:?}", case.name, moved.unresolved.first());
            for curve in self_curves(&reference) {
                let expected: Vec<DVec3> = line(curve).iter().map(|&p| map.transform_point3(p)).collect();
                let size = case.surface.transformed(map).bounds().diagonal();
                let near = self_curves(&moved).iter().map(|c| apart(&line(c), &expected)).fold(f64::INFINITY, f64::min);
                assert!(near <= 1e-5 * size, "{} map {k}: {near}", case.name);
            }
        }
        let rewritten = [
            case.surface.swapped(),
            case.surface.reversed(Direction::U),
            case.surface.reversed(Direction::V),
            case.surface.elevated(Direction::U).unwrap(),
            {
                let [u, _] = case.surface.domain();
                case.surface.knot_inserted(Direction::U, u[0] + 0.37 * (u[1] - u[0]), 1).unwrap()
            },
        ];
        for (k, surface) in rewritten.iter().enumerate() {
            let other = solve(surface);
            assert_eq!(shape(&other), shape(&reference), "{} writing {k}: {:?}", case.name, other.unresolved.first());
        }
    }
}
