//! Points in which three surfaces meet: closed forms, an independent solve, invariances, and what is no such point.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/forms.rs"]
mod forms;
#[path = "support/measure.rs"]
mod measure;

use forms::{cylinder, graph, sphere};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3Swizzles as _};
use measure::distance;
use patchwright::kernel::geom::{Aabb, Surface};
use patchwright::kernel::job::Job;
use patchwright::kernel::ssi::result::{CurveEnd, JunctionKind};
use patchwright::kernel::ssi::{Intersection, SsiOptions, intersect, intersect_all};

fn square(center: DVec3, x: DVec3, y: DVec3) -> Surface {
    Surface::bilinear([center - x - y, center + x - y, center - x + y, center + x + y]).unwrap()
}

fn all(surfaces: &[Surface]) -> Intersection {
    let list: Vec<_> = surfaces.iter().enumerate().collect();
    intersect_all(&list, &SsiOptions::default(), &Job::new()).unwrap()
}

fn diagonal(surfaces: &[Surface]) -> f64 {
    surfaces.iter().fold(Aabb::EMPTY, |b, s| b.union(&s.bounds())).diagonal()
}

/// The positions of the points of three, after a look at everything that has to hold for them: each lies on both surfaces
/// it names, every curve end that names one is there and on its surfaces, and curves bend away from their surfaces by no
/// more than they say.
fn points(surfaces: &[Surface], found: &Intersection) -> Vec<DVec3> {
    let size = diagonal(surfaces);
    let far = surfaces.iter().map(|s| s.bounds().max_abs()).fold(0.0, f64::max);
    let exact = 1e-12 * size + 4e-16 * far;
    let mut out: Vec<(DVec3, usize)> = Vec::new();
    for j in found.junctions.iter().filter(|j| j.kind == JunctionKind::ThreeSurfaces) {
        for (n, uv) in [(j.a, j.uv), (j.b, j.st)] {
            assert!(surfaces[n].eval(uv).distance(j.xyz) < exact, "{j:?}");
        }
        match out.iter_mut().find(|(p, _)| p.distance(j.xyz) < 1e-9 * size) {
            Some(known) => known.1 += 1,
            None => out.push((j.xyz, 1)),
        }
    }
    let mut named = vec![0; found.junctions.len()];
    for curve in &found.curves {
        for (e, end) in [&curve.points[0], &curve.points[curve.points.len() - 1]].into_iter().enumerate() {
            let id = curve.end_ids[e];
            assert_eq!(curve.ends[e] == CurveEnd::Junction, id.is_some());
            let Some(j) = id.map(|id| &found.junctions[id]) else { continue };
            named[id.unwrap()] += 1;
            assert_eq!((j.a.min(j.b), j.a.max(j.b)), (end.a.min(end.b), end.a.max(end.b)));
            assert!(j.xyz == end.xyz || j.kind != JunctionKind::ThreeSurfaces);
            for (n, uv) in [(end.a, end.uv), (end.b, end.st)] {
                assert!(surfaces[n].eval(uv).distance(end.xyz) < exact);
            }
        }
        for pair in curve.points.windows(2).filter(|w| (w[0].a, w[0].b) == (w[1].a, w[1].b)) {
            for k in 1..4 {
                let p = pair[0].xyz.lerp(pair[1].xyz, f64::from(k) / 4.0);
                for (n, uv) in [(pair[0].a, pair[0].uv), (pair[0].b, pair[0].st)] {
                    assert!(distance(&surfaces[n], p, uv) <= curve.error_bound + 4e-16 * far);
                }
            }
        }
    }
    assert!(named.iter().all(|n| *n > 0), "a junction without a curve");
    out.sort_by(|(p, _), (q, _)| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)));
    out.into_iter().map(|(p, _)| p).collect()
}

fn pose() -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -0.8, 0.5).normalize(), 1.1);
    DAffine3::from_mat3_translation(DMat3::from_quat(turn), DVec3::new(0.4, -0.3, 0.7))
}

fn posed(surfaces: &[Surface], map: &DAffine3) -> Vec<Surface> {
    surfaces.iter().map(|s| s.transformed(map)).collect()
}

fn planes() -> Vec<Surface> {
    let [x, y, z] = DVec3::AXES;
    let c = DVec3::new(0.1, -0.2, 0.05);
    vec![square(DVec3::Z * c.z, x, y), square(DVec3::X * c.x, y, z), square(DVec3::Y * c.y, z, x)]
}

#[test]
fn three_planes_meet_in_one_point_and_their_lines_are_cut_there() {
    for map in [DAffine3::IDENTITY, pose()] {
        let surfaces = posed(&planes(), &map);
        let found = all(&surfaces);
        assert!(found.complete);
        let p = points(&surfaces, &found);
        assert_eq!(p.len(), 1);
        assert!(p[0].distance(map.transform_point3(DVec3::new(0.1, -0.2, 0.05))) < 1e-14);
        assert_eq!((found.curves.len(), found.junctions.len()), (6, 3));
        assert!(
            found.curves.iter().all(|c| c.ends.contains(&CurveEnd::Junction) && c.ends.contains(&CurveEnd::Boundary))
        );
        for k in 0..3 {
            assert_eq!(found.curves.iter().filter(|c| c.end_ids.contains(&Some(k))).count(), 2);
        }
    }
}

/// Unit spheres around the corners of a triangle of side 1 meet in the two points sqrt(2/3) above and below its middle.
fn spheres() -> Vec<Surface> {
    let h = 0.75_f64.sqrt();
    [(0.0, 0.0), (1.0, 0.0), (0.5, h)]
        .map(|(x, y)| sphere(1.0).transformed(&DAffine3::from_translation(DVec3::new(x, y, 0.0))))
        .map(|s| s.transformed(&pose()))
        .into()
}

#[test]
fn three_spheres_meet_in_two_points() {
    let surfaces = spheres();
    let found = all(&surfaces);
    assert!(found.complete);
    let height = (2.0_f64 / 3.0).sqrt();
    let middle = DVec3::new(0.5, 0.75_f64.sqrt() / 3.0, 0.0);
    let p = points(&surfaces, &found);
    assert_eq!(p.len(), 2);
    for z in [-height, height] {
        let known = pose().transform_point3(middle + DVec3::Z * z);
        assert!(p.iter().any(|p| p.distance(known) < 1e-12), "{p:?} {known}");
    }
    // Three circles, each cut in two.
    assert_eq!(found.curves.len(), 6);
    assert!(found.curves.iter().all(|c| c.ends == [CurveEnd::Junction; 2]));
}

#[test]
fn three_orthogonal_cylinders_meet_in_eight_points() {
    // x^2 + y^2 = y^2 + z^2 = z^2 + x^2 = r^2 at (+-1, +-1, +-1) r / sqrt 2.
    let (r, half) = (0.8, std::f64::consts::FRAC_PI_2);
    // Turned about their own axes, so that the seams lie anywhere.
    let tube = |angle: f64| cylinder(r, -1.0, 1.0).transformed(&DAffine3::from_rotation_z(angle));
    let x = tube(0.3).transformed(&DAffine3::from_rotation_y(half));
    let y = tube(0.7).transformed(&DAffine3::from_rotation_x(half));
    let surfaces = vec![x, y, tube(0.1)];
    let found = all(&surfaces);
    assert!(found.complete, "{:?}", found.unresolved.first());
    let p = points(&surfaces, &found);
    assert_eq!(p.len(), 8);
    let c = r / 2.0_f64.sqrt();
    for q in &p {
        assert!((q.abs() - DVec3::splat(c)).length() < 1e-12, "{q}");
    }
    // Each pair of equal cylinders has two X junctions besides.
    assert_eq!(found.junctions.iter().filter(|j| j.kind == JunctionKind::X).count(), 6);
}

fn saddles() -> Vec<Surface> {
    let a = graph(3, |x, y| 0.4 * x * x - 0.3 * y * y + 0.1 * x * x * y + 0.05);
    let b = graph(3, |x, y| 0.3 * x * y + 0.2 * x * y * y - 0.04);
    let c = graph(3, |x, y| 0.35 * y * y - 0.25 * x * x + 0.1 * x);
    let turned = |s: &Surface, axis| s.transformed(&DAffine3::from_axis_angle(axis, 1.3));
    vec![a, turned(&b, DVec3::X), turned(&c, DVec3::Y)]
}

/// All points of three sheets over a fine grid of the first: Newton on the two others' implicit heights, written out.
fn solved(surfaces: &[Surface]) -> Vec<DVec3> {
    let heights: [Box<dyn Fn(DVec3) -> f64>; 3] = [
        Box::new(|p: DVec3| p.z - (0.4 * p.x * p.x - 0.3 * p.y * p.y + 0.1 * p.x * p.x * p.y + 0.05)),
        Box::new(|p: DVec3| {
            let q = DQuat::from_axis_angle(DVec3::X, -1.3) * p;
            q.z - (0.3 * q.x * q.y + 0.2 * q.x * q.y * q.y - 0.04)
        }),
        Box::new(|p: DVec3| {
            let q = DQuat::from_axis_angle(DVec3::Y, -1.3) * p;
            q.z - (0.35 * q.y * q.y - 0.25 * q.x * q.x + 0.1 * q.x)
        }),
    ];
    let value = |p: DVec3| DVec3::new(heights[0](p), heights[1](p), heights[2](p));
    let mut out: Vec<DVec3> = Vec::new();
    for k in 0..41 * 41 {
        let (x, y) = (f64::from(k % 41) / 20.0 - 1.0, f64::from(k / 41) / 20.0 - 1.0);
        let mut p = surfaces[0].eval(DVec2::new(x, y));
        for _ in 0..30 {
            let h = 1e-6;
            let column = |d: DVec3| (value(p + d * h) - value(p - d * h)) / (2.0 * h);
            let m = DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z));
            p -= m.inverse() * value(p);
        }
        let inside = |angle: f64, axis: DVec3| {
            let q = DQuat::from_axis_angle(axis, -angle) * p;
            q.x.abs() <= 1.0 && q.y.abs() <= 1.0
        };
        let on = value(p).length() < 1e-13 && inside(0.0, DVec3::X) && inside(1.3, DVec3::X) && inside(1.3, DVec3::Y);
        if on && out.iter().all(|q| q.distance(p) > 1e-9) {
            out.push(p);
        }
    }
    out.sort_by(|p, q| p.x.total_cmp(&q.x));
    out
}

#[test]
fn three_saddles_meet_where_an_independent_solve_finds_it_in_any_order_size_and_place() {
    let surfaces = saddles();
    let known = solved(&surfaces);
    assert!(!known.is_empty());
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [2, 1, 0]] {
        let turned: Vec<Surface> = order.iter().map(|&k| surfaces[k].clone()).collect();
        let p = points(&turned, &all(&turned));
        assert_eq!(p.len(), known.len());
        assert!(p.iter().zip(&known).all(|(p, q)| p.distance(*q) < 1e-12));
    }
    for (scale, shift) in [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e4), (1e3, 1e7)] {
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            DQuat::IDENTITY,
            DVec3::new(1.0, -0.7, 0.3) * shift,
        );
        let moved = posed(&surfaces, &map);
        let found = all(&moved);
        let p = points(&moved, &found);
        assert_eq!(p.len(), known.len(), "{scale} {shift}");
        let exact = 1e-12 * scale + 1e-15 * shift;
        assert!(p.iter().zip(&known).all(|(p, q)| p.distance(map.transform_point3(*q)) < exact));
        assert_eq!(found.curves.len(), all(&surfaces).curves.len());
    }
}

#[test]
fn sets_are_cut_where_surfaces_of_one_cross_on_the_other() {
    let surfaces = planes();
    let side = |k: &[usize]| k.iter().map(|&k| (k, &surfaces[k])).collect::<Vec<_>>();
    let found = intersect(&side(&[0, 1]), &side(&[2]), &SsiOptions::default(), &Job::new()).unwrap();
    // The line of the planes 0 and 1 is not asked for.
    assert_eq!(points(&surfaces, &found).len(), 1);
    assert_eq!((found.curves.len(), found.junctions.len()), (4, 2));
}

#[test]
fn sheets_through_one_line_have_no_point_of_their_own() {
    // Planes that share the x axis; and spheres that share a circle.
    let [x, y, z] = DVec3::AXES;
    let fan = [0.0_f64, 1.0, 2.1].map(|a| square(DVec3::ZERO, x, y * a.cos() + z * a.sin()));
    let found = all(&fan);
    assert!(found.complete);
    assert_eq!((found.curves.len(), found.junctions.len()), (3, 0));
    let pencil = [-0.4_f64, 0.1, 0.5]
        .map(|h| sphere((0.49 + h * h).sqrt()).transformed(&DAffine3::from_translation(z * h)).transformed(&pose()));
    let found = all(&pencil);
    assert!(found.complete);
    assert_eq!((found.curves.len(), found.junctions.len()), (3, 0));
    assert!(found.curves.iter().all(|c| c.closed));
    // A fourth sheet crosses that line: there all meet.
    let mut four = fan.to_vec();
    four.push(square(x * 0.3, y, z));
    let found = all(&four);
    let p = points(&four, &found);
    assert_eq!(p.len(), 1);
    assert!(p[0].distance(x * 0.3) < 1e-14);
    assert_eq!((found.curves.len(), found.junctions.len()), (12, 6));
}

#[test]
fn a_sheet_that_nearly_follows_the_curve_of_two_others_crosses_it_in_one_point() {
    let [x, y, z] = DVec3::AXES;
    for slope in [1e-2, 1e-4, 1e-6, 1e-8] {
        let third = square(DVec3::new(0.2, 0.0, 0.0), x + (z - y) * slope, y + z);
        let surfaces = [square(DVec3::ZERO, x, y), square(DVec3::ZERO, x, z), third];
        let found = all(&surfaces);
        let p = points(&surfaces, &found);
        assert_eq!(p.len(), 1, "{slope}");
        // Across the line it is exact, along it as good as rounding over the slope.
        assert!(p[0].distance(x * 0.2) < 1e-15 / slope && p[0].yz().length() < 1e-14, "{slope} {}", p[0]);
        assert_eq!(found.curves.len(), 6);
    }
}

#[test]
fn a_sphere_that_touches_the_line_of_two_planes_meets_it_in_two_points_one_or_none() {
    let [x, y, z] = DVec3::AXES;
    let flat = [square(DVec3::ZERO, x, y), square(DVec3::ZERO, x, z)];
    let near = DVec3::new(0.13, 0.6, 0.8);
    // How rounding falls where they touch depends on how the ball is turned.
    let cases = [1e-2, 1e-5, 1e-8, -1e-8, -1e-5].map(|depth| (depth, 0.7));
    for (depth, turn) in cases.into_iter().chain([0.7, 0.2, 1.1, 2.9, 4.0, 5.5].map(|turn| (0.0, turn))) {
        let radius: f64 = 1.0;
        let ball = sphere(radius)
            .transformed(&DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), turn))
            .transformed(&DAffine3::from_translation(x * near.x + (y * near.y + z * near.z) * (radius - depth)));
        let surfaces = [flat[0].clone(), flat[1].clone(), ball];
        let found = all(&surfaces);
        let p = points(&surfaces, &found);
        let away = (radius * radius - (radius - depth).powi(2)).max(0.0).sqrt();
        let known: &[f64] = match depth {
            d if d > 0.0 => &[near.x - away, near.x + away],
            0.0 => &[near.x],
            _ => &[],
        };
        assert_eq!(p.len(), known.len(), "{depth} {turn}: {p:?}");
        for (p, x) in p.iter().zip(known) {
            assert!((p.x - x).abs() < if depth == 0.0 { 1e-7 } else { 1e-15 / away } + 1e-13, "{depth}: {} {x}", p.x);
            assert!(p.yz().length() < 1e-13);
        }
    }
}

#[test]
fn curves_that_run_on_over_a_shared_edge_have_no_junction_there_and_a_crease_has() {
    let floor = graph(3, |x, y| 0.2 * x * y + 0.1 * x * x);
    let parts =
        [floor.restricted([-1.0, 0.1], [-1.0, 1.0]).unwrap(), floor.restricted([0.1, 1.0], [-1.0, 1.0]).unwrap()];
    let wall = square(DVec3::Y * 0.3, DVec3::X, DVec3::Z);
    let smooth = [parts[0].clone(), parts[1].clone(), wall.clone()];
    let found = all(&smooth);
    assert!(found.complete);
    assert_eq!((found.curves.len(), found.junctions.len()), (1, 0));
    // Two flat sheets with a crease between them: three curves meet in one point on it.
    let roof = |side: f64| {
        let p = |x: f64, y: f64| DVec3::new(x * side, y, -0.3 * x);
        Surface::bilinear([p(0.0, -1.0), p(0.0, 1.0), p(1.0, -1.0), p(1.0, 1.0)]).unwrap()
    };
    let creased = [roof(-1.0), roof(1.0), wall];
    let found = all(&creased);
    let p = points(&creased, &found);
    assert_eq!(p.len(), 1);
    assert!(p[0].distance(DVec3::Y * 0.3) < 1e-14);
    assert_eq!(found.curves.len(), 4);
}
