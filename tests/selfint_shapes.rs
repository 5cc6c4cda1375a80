//! Self-intersections of surfaces with known answers: closed forms of double curves, miter points close together,
//! closed and rational surfaces, surfaces without any, and bad input.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/shapes.rs"]
mod shapes;

use std::time::Instant;

use glam::{DAffine3, DQuat, DVec2, DVec3};
use patchwright::kernel::geom::sweep::revolved;
use patchwright::kernel::geom::{Direction, Knots, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::self_ssi::{SelfIntersectOptions, SelfIntersection, self_intersect};
use patchwright::kernel::ssi::result::{CurveEnd, CurveKind, IntersectionCurve, JunctionKind};
use shapes::{curve_through, interpolate, ridge, sextic, spans, spun, square, turned};

fn solve(name: &str, surface: &Surface) -> SelfIntersection {
    let started = Instant::now();
    let found = self_intersect(surface, 0, &SelfIntersectOptions::default(), &Job::new()).unwrap();
    let r = &found.result;
    println!(
        "{name}: {:.1} ms, complete {}, {} curves, {} miters, {} unresolved {:?}, {:?}",
        started.elapsed().as_secs_f64() * 1e3,
        r.complete,
        r.curves.len(),
        r.miters.len(),
        r.unresolved.len(),
        r.unresolved.first(),
        found.evidence
    );
    for c in r.curves.iter().take(4) {
        println!("   {:?} {:?} {} points, bound {:.1e}", c.kind, c.ends, c.points.len(), c.error_bound);
    }
    for curve in &r.curves {
        for p in &curve.points {
            let gap = surface.eval(p.uv).distance(surface.eval(p.st));
            assert!(gap <= 1e-11 * surface.bounds().diagonal(), "{name}: {gap}");
        }
    }
    found
}

fn curves(found: &SelfIntersection) -> Vec<&IntersectionCurve> {
    found.result.curves.iter().filter(|c| c.kind == CurveKind::SelfIntersection).collect()
}

#[test]
fn pairs_of_miter_points_however_close() {
    for a in [0.6, 0.05, 0.005] {
        // Between the two, an arc whose preimages are two half circles.
        let arc = ridge(move |x| x * x - a * a);
        for (name, surface) in [
            ("arc", interpolate(&square(), &square(), &arc)),
            (
                "arc, turned domain",
                interpolate(&sextic(), &sextic(), |u, v| {
                    let p = spun(u, v);
                    arc(p.x, p.y)
                }),
            ),
        ] {
            let found = solve(&format!("{name} {a}"), &surface);
            assert!(found.result.complete);
            assert_eq!((curves(&found).len(), found.result.miters.len()), (1, 2));
            assert_eq!(curves(&found)[0].ends, [CurveEnd::Miter; 2]);
            if name == "arc" {
                for p in &curves(&found)[0].points {
                    assert!((p.uv.length() - a).abs() < 1e-9 && (p.uv.y + p.st.y).abs() < 1e-9, "{:?}", p);
                }
            }
        }
        // Away from the two, a branch on either side.
        let open = ridge(move |x| a * a - x * x);
        let found = solve(&format!("open {a}"), &interpolate(&square(), &square(), &open));
        assert!(found.result.complete);
        assert_eq!((curves(&found).len(), found.result.miters.len()), (2, 2));
        for c in curves(&found) {
            assert!(c.ends.contains(&CurveEnd::Miter) && c.ends.contains(&CurveEnd::Boundary));
            for p in &c.points {
                assert!((p.uv.x * p.uv.x - p.uv.y * p.uv.y - a * a).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn three_miter_points() {
    let surface = interpolate(&square(), &square(), ridge(|x| x * (x * x - 0.3)));
    let found = solve("three", &surface);
    assert!(found.result.complete);
    assert_eq!((curves(&found).len(), found.result.miters.len()), (2, 3));
    // The same over many patches, where it is no longer a polynomial of the pieces' degree.
    let surface = interpolate(&spans(7), &spans(5), |u, v| {
        let p = spun(u, v);
        ridge(|x| x * (x * x - 0.3))(p.x, p.y)
    });
    let found = solve("three over 35 patches", &surface);
    assert!(found.result.complete);
    assert_eq!((curves(&found).len(), found.result.miters.len()), (2, 3));
}

#[test]
fn a_global_double_curve_is_found_whatever_its_shape() {
    // Straight in the domain, and with the domain turned so that nothing runs along u or v.
    let fold =
        |u: f64, v: f64| turned(DVec3::new(v * v + 0.1 * u, v * (v * v - 0.49) * (1.0 + 0.2 * u), u + 0.1 * v * v));
    let k = |d| Knots::bezier(d, -1.0, 1.0).unwrap();
    let straight = solve("fold", &interpolate(&k(4), &k(4), fold));
    let oblique = solve(
        "fold, turned domain",
        &interpolate(&k(6), &k(6), |u, v| {
            let p = DVec2::from_angle(0.3).rotate(DVec2::new(u, v)) * 0.95;
            fold(p.x, p.y)
        }),
    );
    for found in [&straight, &oblique] {
        assert!(found.result.complete);
        assert_eq!((curves(found).len(), found.result.miters.len()), (1, 0));
        assert_eq!(curves(found)[0].ends, [CurveEnd::Boundary; 2]);
    }
    // Double points are (u, +-0.7).
    for p in &curves(&straight)[0].points {
        assert!(
            (p.uv.y.abs() - 0.7).abs() < 1e-10 && (p.uv.y + p.st.y).abs() < 1e-10 && (p.uv.x - p.st.x).abs() < 1e-10
        );
    }
}

#[test]
fn surfaces_without_self_intersection_are_proved_free() {
    let wavy = interpolate(&spans(12), &spans(9), |u, v| DVec3::new(u, v, 0.3 * (5.0 * u).sin() * (4.0 * v).cos()));
    let k = Knots::clamped(2, &[0.0, 0.25, 0.5, 0.75, 1.0], 2).unwrap();
    let circle: Vec<(f64, f64, f64)> = {
        let w = std::f64::consts::FRAC_1_SQRT_2;
        vec![
            (1.0, 0.0, 1.0),
            (1.0, 1.0, w),
            (0.0, 1.0, 1.0),
            (-1.0, 1.0, w),
            (-1.0, 0.0, 1.0),
            (-1.0, -1.0, w),
            (0.0, -1.0, 1.0),
            (1.0, -1.0, w),
            (1.0, 0.0, 1.0),
        ]
    };
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for &(a, b, w) in &circle {
        for &(x, y, wu) in &circle {
            let radius = 2.0 + 0.6 * a;
            points.push(DVec3::new(x * radius, y * radius, 0.6 * b));
            weights.push(w * wu);
        }
    }
    let torus = Surface::new(k.clone(), k.clone(), points, Some(weights)).unwrap();
    let line = Knots::bezier(1, 0.0, 1.0).unwrap();
    let ring = [0.0, 3.0].iter().flat_map(|&z| circle.iter().map(move |&(x, y, _)| DVec3::new(x, y, z))).collect();
    let cylinder =
        Surface::new(k.clone(), line, ring, Some(circle.iter().map(|c| c.2).collect::<Vec<_>>().repeat(2))).unwrap();
    // Half circles from pole to pole, turned around: a sphere.
    let half = Knots::clamped(2, &[0.0, 0.5, 1.0], 2).unwrap();
    let profile = &[circle[6], circle[7], circle[8], circle[1], circle[2]];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for &(r, z, w) in profile {
        for &(x, y, wu) in &circle {
            points.push(DVec3::new(x * r, y * r, z));
            weights.push(w * wu);
        }
    }
    let sphere = Surface::new(k.clone(), half, points, Some(weights)).unwrap();
    let cone = interpolate(&square(), &square(), |u, v| DVec3::new((v + 1.0) * u, v + 1.0, (v + 1.0) * u * u));
    for (name, surface) in
        [("wavy", wavy), ("torus", torus), ("cylinder", cylinder), ("sphere", sphere), ("cone", cone)]
    {
        let found = solve(name, &surface);
        assert!(found.result.complete, "{name}");
        assert!(found.result.curves.is_empty() && found.result.miters.is_empty(), "{name}");
    }
}

#[test]
fn a_rational_cross_cap_is_a_cross_cap() {
    // A projective map takes the double line of the Whitney umbrella to a double line.
    let whitney = interpolate(&square(), &square(), |u, v| DVec3::new(u, u * v, v * v));
    let weight = |p: DVec3| 1.0 + 0.2 * p.x - 0.1 * p.y + 0.15 * p.z;
    let weights: Vec<f64> = whitney.points().iter().map(|&p| weight(p)).collect();
    let points = whitney.points().iter().map(|&p| p / weight(p)).collect();
    let [u, v] = whitney.knots().clone();
    let found = solve("rational", &Surface::new(u, v, points, Some(weights)).unwrap());
    assert!(found.result.complete);
    assert_eq!((curves(&found).len(), found.result.miters.len()), (1, 1));
    for p in &curves(&found)[0].points {
        assert!(p.uv.x.abs() < 1e-10 && (p.uv.y + p.st.y).abs() < 1e-10);
    }
}

#[test]
fn bad_input_has_a_defined_answer_in_bounded_time() {
    let k = square();
    let bad: Vec<(&str, Surface)> = vec![
        ("point", interpolate(&k, &k, |_, _| DVec3::ONE)),
        ("line", interpolate(&k, &k, |u, v| DVec3::new(u + v, 2.0 * (u + v), 0.0))),
        ("flat", interpolate(&k, &k, |u, v| DVec3::new(u, v, 0.0))),
        ("cusp edge", interpolate(&k, &k, |u, v| turned(DVec3::new(u * u, u * u * u, v)))),
        ("bent cusp edge", interpolate(&spans(3), &k, |u, v| turned(DVec3::new(u * u, u * u * u + 0.2 * v * v, v)))),
        ("folded onto itself", interpolate(&k, &k, |u, v| turned(DVec3::new(u * u, v, 0.3 * v * v)))),
        ("steep pole", interpolate(&k, &k, |u, v| DVec3::new((v + 1.0) * u, (v + 1.0).powi(2), (v + 1.0) * u * u))),
    ];
    for (name, surface) in &bad {
        let started = Instant::now();
        let found = solve(name, surface);
        for u in &found.result.unresolved {
            println!("   open: {u:?}");
        }
        // Caps bound the work; the time is generous because a test machine may be busy.
        assert!(started.elapsed().as_secs_f64() < 30.0, "{name}");
        assert!(found.result.miters.len() <= 2, "{name}: a cusp edge is no thousand miter points");
        let cusps = found.result.curves.iter().filter(|c| c.kind == CurveKind::CuspEdge).count();
        assert_eq!(cusps, usize::from(name.contains("cusp") || name.contains("folded")), "{name}");
        let collapsed = ["point", "line"].contains(name);
        assert_eq!(found.result.complete, !collapsed && !name.contains("steep"), "{name}");
    }
}

#[test]
fn a_patch_folded_onto_itself_is_one_region() {
    let k = square();
    let found = solve("fold", &interpolate(&k, &k, |u, v| turned(DVec3::new(u * u, v, 0.3 * v * v))));
    let result = &found.result;
    assert_eq!(result.regions.len(), 1);
    assert!(result.complete && result.miters.is_empty());
    assert!(result.regions[0].max_distance < 1e-11);
    // One half of the domain lies on the other, up to the fold, which is a cusp edge.
    let outer = &result.regions[0].boundary[0];
    let area: f64 = outer.windows(2).map(|s| 0.5 * s[0].uv.perp_dot(s[1].uv)).sum();
    assert!((area - 2.0).abs() < 1e-9, "{area}");
    for p in outer {
        assert!((p.uv.x + p.st.x).abs() < 1e-9 && (p.uv.y - p.st.y).abs() < 1e-9, "{} {}", p.uv, p.st);
    }
    assert_eq!(result.curves.iter().filter(|c| c.kind == CurveKind::CuspEdge).count(), 1);
    assert!(curves(&found).is_empty());
}

#[test]
fn cancelling_returns_what_there_is() {
    let job = Job::new();
    job.cancel();
    let k = square();
    let surface = interpolate(&k, &k, ridge(|x| x * x - 0.2));
    let found = self_intersect(&surface, 0, &SelfIntersectOptions::default(), &job).unwrap();
    assert!(!found.result.complete);
}

#[test]
fn tolerances_must_be_positive() {
    let k = square();
    let flat = interpolate(&k, &k, |u, v| DVec3::new(u, v, 0.0));
    for tol in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = SelfIntersectOptions { tol: Some(tol), ..SelfIntersectOptions::default() };
        assert!(self_intersect(&flat, 0, &options, &Job::new()).is_err());
    }
}

/// Where the triangle `t` is pierced by the segment `a`-`b`.
fn pierced(t: [DVec3; 3], a: DVec3, b: DVec3) -> Option<DVec3> {
    let (e, f, d) = (t[1] - t[0], t[2] - t[0], b - a);
    let h = d.cross(f);
    let det = e.dot(h);
    if det.abs() < 1e-14 {
        return None;
    }
    let s = a - t[0];
    let u = s.dot(h) / det;
    let q = s.cross(e);
    let (v, w) = (d.dot(q) / det, f.dot(q) / det);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&w)).then(|| a + d * w)
}

/// Points where a fine triangulation meets itself away from the diagonal: a slow oracle that shares no code with the
/// search.
fn brute_force(surface: &Surface, n: usize, apart: f64) -> Vec<DVec3> {
    let at = |k: usize| -1.0 + 2.0 * k as f64 / n as f64;
    let point = |i: usize, j: usize| surface.eval(DVec2::new(at(i), at(j)));
    let grid: Vec<DVec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| point(i, j)).collect();
    let g = |i: usize, j: usize| grid[j * (n + 1) + i];
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let middle = DVec2::new(at(i) + 1.0 / n as f64, at(j) + 1.0 / n as f64);
            triangles.push((middle, [g(i, j), g(i + 1, j), g(i + 1, j + 1)]));
            triangles.push((middle, [g(i, j), g(i + 1, j + 1), g(i, j + 1)]));
        }
    }
    let mut found = Vec::new();
    for (k, (m, s)) in triangles.iter().enumerate() {
        let (low, high) = (s[0].min(s[1]).min(s[2]), s[0].max(s[1]).max(s[2]));
        for (other, t) in &triangles[k + 1..] {
            let (l, h) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
            if l.cmpgt(high).any() || h.cmplt(low).any() || m.distance(*other) < apart {
                continue;
            }
            for e in 0..3 {
                found.extend(pierced(*s, t[e], t[(e + 1) % 3]));
                found.extend(pierced(*t, s[e], s[(e + 1) % 3]));
            }
        }
    }
    found
}

#[test]
fn a_triangulation_finds_nothing_that_is_missing() {
    let mut state = 88_172_645_463_325_252_u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut met = 0;
    for trial in 0..10 {
        let points: Vec<DVec3> = (0..16)
            .map(|k| {
                DVec3::new(f64::from(k % 4), f64::from(k / 4), 0.0) + DVec3::new(random(), random(), random()) * 2.2
            })
            .collect();
        let surface = Surface::new(square(), square(), points, None).unwrap();
        let found = solve(&format!("random {trial}"), &surface);
        assert!(found.result.complete, "{trial}");
        let n = 40;
        // Chords of the grid are this far from the surface at most, in order of magnitude.
        let slack = 0.02 * surface.bounds().diagonal();
        for x in brute_force(&surface, n, 6.0 / n as f64) {
            met += 1;
            let near =
                curves(&found).iter().flat_map(|c| &c.points).map(|p| p.xyz.distance(x)).fold(f64::INFINITY, f64::min);
            assert!(near < slack, "{trial}: nothing within {near} of {x}");
        }
    }
    assert!(met > 100, "the trials hardly meet themselves: {met}");
}

/// The Steiner surface (Y Z, X Z, X Y) for three lines X, Y, Z of the domain: its double curve is the three lines, the
/// triple point is in the corners of their triangle, and each line has a miter point halfway between two corners.
fn steiner(corners: [DVec2; 3], degree: usize) -> Surface {
    let line = |a: DVec2, b: DVec2, c: DVec2, p: DVec2| (b - a).perp_dot(p - a) / (b - a).perp_dot(c - a);
    let [a, b, c] = corners;
    let k = Knots::bezier(degree, -1.0, 1.0).unwrap();
    interpolate(&k, &k, |u, v| {
        let p = DVec2::new(u, v);
        let (x, y, z) = (line(a, b, c, p), line(b, c, a, p), line(c, a, b, p));
        turned(DVec3::new(y * z, x * z, x * y))
    })
}

#[test]
fn three_sheets_meet_in_a_triple_point() {
    for corners in [
        [DVec2::new(-0.5, -0.4), DVec2::new(0.6, -0.3), DVec2::new(0.1, 0.5)],
        [DVec2::new(-0.71, 0.3), DVec2::new(-0.2, -0.63), DVec2::new(0.43, 0.21)],
    ] {
        for degree in [2, 3] {
            let surface = steiner(corners, degree);
            let found = solve("Steiner", &surface);
            let r = &found.result;
            assert!(r.complete);
            assert_eq!((r.miters.len(), r.junctions.len(), found.triple_points.len()), (3, 1, 1));
            for corner in corners {
                let near = found.triple_points[0].iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
                assert!(near < 1e-9, "{corner}: {near}");
            }
            assert!(r.junctions[0].xyz.distance(turned(DVec3::ZERO)) < 1e-12);
            // Each of the three branches is cut there: miter point to triple point, triple point to border.
            let mut ends: Vec<[CurveEnd; 2]> = curves(&found).iter().map(|c| c.ends).collect();
            for e in &mut ends {
                e.sort_by_key(|k| *k as u8);
            }
            let count = |e: [CurveEnd; 2]| ends.iter().filter(|x| **x == e).count();
            assert_eq!(count([CurveEnd::Junction, CurveEnd::Miter]), 3);
            assert_eq!(count([CurveEnd::Boundary, CurveEnd::Junction]), 3);
            assert_eq!(ends.len(), 6);
            for c in curves(&found) {
                for p in &c.points {
                    let on = |k: usize, p: DVec2| {
                        let (a, b) = (corners[k], corners[(k + 1) % 3]);
                        ((b - a).perp_dot(p - a) / (b - a).length()).abs() < 1e-9
                    };
                    assert!((0..3).any(|k| on(k, p.uv) && on(k, p.st)), "{} {}", p.uv, p.st);
                }
                for (end, id) in [(c.points.first(), 0), (c.points.last(), 1)] {
                    if c.ends[id] == CurveEnd::Junction {
                        assert!(end.unwrap().xyz.distance(r.junctions[0].xyz) < 1e-12 && c.end_ids[id] == Some(0));
                    }
                }
            }
        }
    }
}

#[test]
fn the_continuation_of_a_neighbouring_piece_is_no_coincident_region() {
    // Split at a knot without changing the surface, a piece continues as its neighbour: exactly, but as the same points.
    let surface = interpolate(&square(), &square(), ridge(|x| 0.0025 - x * x));
    for (u, v) in [(0.004, 0.027), (-0.038, -0.003), (0.02, -0.02), (-0.014, 0.09)] {
        let split = surface.knot_inserted(Direction::U, u, 1).unwrap().knot_inserted(Direction::V, v, 1).unwrap();
        let found = solve("split", &split);
        assert!(found.result.complete && found.result.regions.is_empty(), "{u} {v}");
        assert_eq!((curves(&found).len(), found.result.miters.len()), (2, 2));
    }
}

#[test]
fn degenerate_miter_points_are_isolated_or_have_their_branches() {
    for at in [0.0, 0.13] {
        // y^2 = -c(x) with a double zero of c: the point alone, or the two lines y = +-(x - at).
        let isolated = solve("isolated", &interpolate(&square(), &square(), ridge(move |x| (x - at) * (x - at))));
        assert!(isolated.result.complete && curves(&isolated).is_empty());
        assert!(isolated.result.miters.len() == 1 && isolated.result.miters[0].isolated);
        assert!(isolated.result.miters[0].uv.distance(DVec2::new(at, 0.0)) < 1e-9);
        let double = solve("two branches", &interpolate(&square(), &square(), ridge(move |x| -(x - at) * (x - at))));
        assert!(double.result.complete && double.result.miters.len() == 1 && !double.result.miters[0].isolated);
        assert_eq!(curves(&double).len(), 2);
        for c in curves(&double) {
            assert_eq!(c.ends, [CurveEnd::Miter, CurveEnd::Boundary]);
            for p in &c.points {
                assert!(((p.uv.x - at).abs() - p.uv.y.abs()).abs() < 1e-9 && (p.uv.y + p.st.y).abs() < 1e-9);
            }
        }
    }
}

/// The curve (t^3 - t, (t^2 - 1)^2 (t + 2)), |t| <= 1.1, meets itself in 0 only, for t = -1 and 1, with the tangent x and the
/// curvatures 6 and 2 there. `lift(t, v)` is added to the height.
fn touching(lift: impl Fn(f64, f64) -> f64) -> Surface {
    let (ku, kv) = (Knots::bezier(5, -1.1, 1.1).unwrap(), Knots::bezier(2, -1.0, 1.0).unwrap());
    interpolate(&ku, &kv, |t, v| {
        let height = (t * t - 1.0).powi(2) * (t + 2.0) + lift(t, v);
        turned(DVec3::new(t.powi(3) - t, v, height))
    })
}

#[test]
fn sheets_that_touch_in_a_point_are_one_isolated_contact() {
    // The heights differ by 2 x^2 + v^2 to leading order: definite.
    let found = solve("touching in a point", &touching(|t, v| 0.5 * t * v * v));
    let r = &found.result;
    assert!(r.complete && r.curves.is_empty() && r.miters.is_empty() && r.regions.is_empty(), "{:?}", r.unresolved);
    assert_eq!(r.junctions.len(), 1);
    let j = &r.junctions[0];
    assert!(j.kind == JunctionKind::Isolated && j.gap.abs() < 1e-9 && j.xyz.distance(turned(DVec3::ZERO)) < 1e-7);
    let ends = [j.uv, j.st].map(|p| p.distance(DVec2::X).min(p.distance(-DVec2::X)));
    assert!(ends[0] < 1e-6 && ends[1] < 1e-6 && (j.uv.x + j.st.x).abs() < 1e-6, "{} {}", j.uv, j.st);
}

#[test]
fn sheets_that_touch_along_a_curve_have_it_once_from_end_to_end() {
    // Straight, bent in space, and aslant in the domain.
    let bent = |t: f64, v: f64| turned(DVec3::new(t.powi(3) - t, v, (t * t - 1.0).powi(2) * (t + 2.0) + 0.3 * v * v));
    let (ku, kv) = (Knots::bezier(5, -1.05, 1.05).unwrap(), Knots::bezier(5, -1.0, 1.0).unwrap());
    for (name, slope, surface) in [
        ("along a line", 0.0, touching(|_, _| 0.0)),
        ("along a parabola", 0.0, interpolate(&ku, &kv, bent)),
        ("aslant", 0.05, interpolate(&ku, &kv, |u, v| bent(u - 0.05 * v, v))),
    ] {
        let moved = |scale: f64, by: f64| {
            let to = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::splat(by));
            surface.transformed(&to)
        };
        let split = surface.knot_inserted(Direction::U, -0.97, 1).unwrap();
        let split = split.knot_inserted(Direction::V, 0.1, 1).unwrap();
        for (how, surface) in [
            ("as it is", surface.clone()),
            ("small", moved(1e-3, 0.01)),
            ("large and far", moved(1e3, 1e4)),
            ("in patches", split),
        ] {
            let name = format!("{name}, {how}");
            let found = solve(&name, &surface);
            let r = &found.result;
            assert!(r.complete && r.junctions.is_empty() && r.miters.is_empty() && r.regions.is_empty(), "{name}");
            assert_eq!(r.curves.len(), 1, "{name}");
            let curve = &r.curves[0];
            assert_eq!((curve.kind, curve.ends), (CurveKind::Tangential, [CurveEnd::Boundary; 2]), "{name}");
            for p in &curve.points {
                let [t, s] = [p.uv, p.st].map(|p| p.x - slope * p.y);
                let off = (t.abs() - 1.0).abs().max((t + s).abs()).max((p.uv.y - p.st.y).abs());
                assert!(off < 1e-5, "{name}: {off}");
            }
            let ends = [curve.points[0], curve.points[curve.points.len() - 1]].map(|p| p.uv.y);
            assert!((ends[0] + ends[1]).abs() < 1e-9 && (ends[0].abs() - 1.0).abs() < 1e-9, "{name}: {ends:?}");
        }
    }
}

#[test]
fn sheets_of_a_surface_of_revolution_touch_along_a_circle() {
    let k = Knots::bezier(5, -1.1, 1.1).unwrap();
    let profile = curve_through(&k, |t| DVec3::new(t.powi(3) - t + 2.0, 0.0, (t * t - 1.0).powi(2) * (t + 2.0)));
    let surface = revolved(&profile, DVec3::ZERO, DVec3::Z, 0.3, 0.3 + std::f64::consts::TAU).unwrap();
    let found = solve("touching along a circle", &surface);
    let r = &found.result;
    assert!(r.complete && r.junctions.is_empty() && r.curves.len() == 1, "{:?}", r.unresolved);
    let circle = &r.curves[0];
    assert!(circle.kind == CurveKind::Tangential && circle.closed);
    for p in &circle.points {
        assert!((p.xyz.truncate().length() - 2.0).abs() < 1e-9 && p.xyz.z.abs() < 1e-9, "{}", p.xyz);
    }
}

#[test]
fn sheets_that_are_tangent_and_cross_have_a_junction_of_four_curves() {
    // The heights differ by 2 x^2 - v^2: two branches cross in the point of contact.
    let found = solve("tangent and crossing", &touching(|t, v| -0.5 * t * v * v));
    let r = &found.result;
    assert!(r.complete && r.miters.is_empty() && r.regions.is_empty(), "{:?}", r.unresolved);
    assert!(r.junctions.len() == 1 && r.junctions[0].kind == JunctionKind::X);
    assert!(r.junctions[0].xyz.distance(turned(DVec3::ZERO)) < 1e-9);
    assert_eq!(curves(&found).len(), 4);
    for c in curves(&found) {
        let mut ends = c.ends;
        ends.sort_by_key(|e| *e == CurveEnd::Junction);
        assert_eq!(ends, [CurveEnd::Boundary, CurveEnd::Junction]);
        let inner = if c.ends[0] == CurveEnd::Junction { c.points.first() } else { c.points.last() };
        assert!(inner.unwrap().xyz.distance(turned(DVec3::ZERO)) < 1e-9);
        // x = t^3 - t on both sheets, so that the branches are where heights and x agree.
        for p in &c.points {
            let x = |t: f64| t.powi(3) - t;
            assert!((x(p.uv.x) - x(p.st.x)).abs() < 1e-9 && (p.uv.y - p.st.y).abs() < 1e-9);
        }
    }
}

/// A projective map takes a cuspidal edge to a cuspidal edge.
#[test]
fn a_rational_cusp_edge_is_a_cusp_edge() {
    let k = |d| Knots::bezier(d, -1.0, 1.0).unwrap();
    let plain = interpolate(&k(3), &k(3), |u, v| {
        let p = DVec2::from_angle(0.3).rotate(DVec2::new(u, v));
        DVec3::new(p.x * p.x, p.x.powi(3), p.y)
    });
    let weight = |p: DVec3| 1.0 + 0.1 * p.x - 0.05 * p.y + 0.12 * p.z;
    let weights: Vec<f64> = plain.points().iter().map(|&p| weight(p)).collect();
    let points = plain.points().iter().map(|&p| turned(p / weight(p))).collect();
    let [u, v] = plain.knots().clone();
    let found = solve("rational cusp", &Surface::new(u, v, points, Some(weights)).unwrap());
    assert!(found.result.complete && found.result.miters.is_empty() && found.result.regions.is_empty());
    let edges = &found.result.curves;
    assert!(edges.len() == 1 && edges[0].kind == CurveKind::CuspEdge && edges[0].ends == [CurveEnd::Boundary; 2]);
    for p in &edges[0].points {
        // The edge is p.x = 0 in the turned domain.
        assert!(DVec2::from_angle(0.3).rotate(p.uv).x.abs() < 1e-9, "{}", p.uv);
    }
}

/// The kernel of the miter point is the border of the domain: one of the two preimages of the double line is there, and
/// so is the miter point; the branch starts in it, or lies outside and leaves the point alone.
#[test]
fn a_miter_point_on_the_border_of_the_domain() {
    let over = |u: [f64; 2], v: [f64; 2]| {
        let (ku, kv) = (Knots::bezier(2, u[0], u[1]).unwrap(), Knots::bezier(2, v[0], v[1]).unwrap());
        interpolate(&ku, &kv, |x, y| turned(DVec3::new(x, x * y, y * y)))
    };
    // The border crosses the double line's preimages in their middle: the branch runs along it.
    let along = solve("border along the line", &over([0.0, 1.0], [-1.0, 1.0]));
    assert!(along.result.complete, "{:?}", along.result.unresolved);
    assert_eq!((curves(&along).len(), along.result.miters.len()), (1, 1));
    assert!(curves(&along)[0].ends.contains(&CurveEnd::Miter) && !along.result.miters[0].isolated);
    for p in &curves(&along)[0].points {
        assert!(p.uv.x.abs() < 1e-9 && (p.uv.y + p.st.y).abs() < 1e-9);
    }
    // Beyond the border lies one of the two preimages: no pair of the domain coincides.
    let alone = solve("one preimage outside", &over([-1.0, 1.0], [0.0, 1.0]));
    assert!(alone.result.complete && curves(&alone).is_empty(), "{:?}", alone.result.unresolved);
    assert!(alone.result.miters.len() == 1 && alone.result.miters[0].uv.length() < 1e-9);
}

#[test]
fn a_swallowtail_is_open_at_its_tip_and_says_so() {
    // Double points (-2 v^2, +-v), a cusp edge (-6 v^2, v), both through the tip 0.
    let k = |d| Knots::bezier(d, -1.0, 1.0).unwrap();
    let started = Instant::now();
    let surface = interpolate(&k(2), &k(4), |u, v| {
        turned(DVec3::new(3.0 * v.powi(4) + u * v * v, 4.0 * v.powi(3) + 2.0 * u * v, u))
    });
    let found = solve("swallowtail", &surface);
    let r = &found.result;
    assert!(!r.complete && started.elapsed().as_secs_f64() < 120.0);
    assert!(r.unresolved.iter().any(|u| u.reason.contains("swallowtail")), "{:?}", r.unresolved);
    for u in r.unresolved.iter().filter(|u| u.reason.contains("swallowtail")) {
        let reach = u.uv_box.iter().chain(&u.st_box).flatten().map(|x| x.abs()).fold(0.0, f64::max);
        assert!(reach < 0.2, "{u:?}");
    }
    assert_eq!(r.curves.iter().filter(|c| c.kind == CurveKind::CuspEdge).count(), 1);
}

#[test]
fn cusp_edges_and_folds_in_any_direction_are_complete() {
    let k = |d| Knots::bezier(d, -1.0, 1.0).unwrap();
    let curved = |u: f64, v: f64| DVec2::new(u - 0.3 * v * v + 0.1, v);
    let oblique = interpolate(&k(3), &k(3), |u, v| {
        let p = DVec2::from_angle(0.5).rotate(DVec2::new(u, v));
        turned(DVec3::new(p.x * p.x, p.x.powi(3), p.y))
    });
    let bent = interpolate(&k(6), &k(6), |u, v| {
        let p = curved(u, v);
        turned(DVec3::new(p.x * p.x, p.x.powi(3), p.y))
    });
    let fold = interpolate(&k(4), &k(4), |u, v| {
        let p = curved(u, v);
        turned(DVec3::new(p.x * p.x, p.y, 0.2 * p.x * p.x * p.y))
    });
    for (name, surface, regions) in
        [("oblique cusp", &oblique, 0), ("curved cusp", &bent, 0), ("curved fold", &fold, 1)]
    {
        let found = solve(name, surface);
        assert!(found.result.complete && found.result.miters.is_empty(), "{name}");
        let cusps: Vec<_> = found.result.curves.iter().filter(|c| c.kind == CurveKind::CuspEdge).collect();
        assert!(cusps.len() == 1 && cusps[0].ends == [CurveEnd::Boundary; 2], "{name}");
        assert_eq!(found.result.regions.len(), regions, "{name}");
        // Points on both sides of the curved fold: (a, v) and (-a, v).
        for p in found.result.regions.iter().flat_map(|r| &r.boundary[0]) {
            let (a, b) = (curved(p.uv.x, p.uv.y), curved(p.st.x, p.st.y));
            assert!((a.x + b.x).abs() < 1e-8 && (a.y - b.y).abs() < 1e-8, "{a} {b}");
        }
    }
}
