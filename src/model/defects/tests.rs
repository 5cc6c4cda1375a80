use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::*;
use crate::kernel::geom::{Knots, Surface, sweep};
use crate::model::document::{Shape, Unit};

fn quad(corners: [[f64; 3]; 4]) -> Surface {
    Surface::bilinear(corners.map(DVec3::from_array)).unwrap()
}

fn tile(x: f64, y: f64, z: f64) -> Surface {
    quad([[x, y, z], [x + 1.0, y, z], [x, y + 1.0, z], [x + 1.0, y + 1.0, z]])
}

fn document(surfaces: Vec<Surface>) -> Document {
    let mut out = Document::new(Unit::Millimetre);
    for (k, surface) in surfaces.into_iter().enumerate() {
        out.add(format!("s{k}"), Shape::Surface(Arc::new(surface)), None);
    }
    out
}

fn found(document: &Document) -> Defects {
    find(document, &DefectOptions::of(document), &Job::new())
}

fn count(defects: &Defects, kind: DefectKind) -> usize {
    defects.of(kind).count()
}

#[test]
fn two_tiles_that_fit_have_free_edges_around_them_and_nothing_else() {
    let defects = found(&document(vec![tile(0.0, 0.0, 0.0), tile(1.0, 0.0, 0.0)]));
    assert_eq!(count(&defects, DefectKind::FreeEdge), 6);
    assert_eq!(defects.list.len(), 6, "{:?}", defects.list);
    assert!(defects.complete && defects.list.iter().all(|d| (d.size - 1.0).abs() < 1e-12));
}

#[test]
fn a_gap_is_listed_once_with_its_width() {
    for scale in [1e-3, 1.0, 1e3] {
        let model = [tile(0.0, 0.0, 0.0), tile(1.0, 0.0, 5e-4)];
        let model = model.map(|s| s.transformed(&DAffine3::from_scale(DVec3::splat(scale))));
        let defects = found(&document(model.to_vec()));
        let gaps: Vec<&Defect> = defects.of(DefectKind::Gap).collect();
        assert_eq!(gaps.len(), 1, "{:?}", defects.list);
        assert!((gaps[0].size / scale - 5e-4).abs() < 1e-12);
        assert_eq!(gaps[0].faces, [0, 1]);
        assert_eq!(count(&defects, DefectKind::FreeEdge), 6);
    }
}

#[test]
fn crossing_planes_cross_along_their_common_line() {
    // An upright square through the middle of a lying one, along half of it.
    let upright = quad([[0.25, 0.5, -0.5], [0.75, 0.5, -0.5], [0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]);
    let defects = found(&document(vec![tile(0.0, 0.0, 0.0), upright]));
    let crossing: Vec<&Defect> = defects.of(DefectKind::Crossing).collect();
    assert_eq!(crossing.len(), 1);
    // Short of the true length by the margin at its two ends.
    assert!(crossing[0].size > 0.45 && crossing[0].size <= 0.5 + 1e-9, "{}", crossing[0].size);
    assert!(crossing[0].at.z.abs() < 1e-9 && (crossing[0].at.y - 0.5).abs() < 1e-9);
    assert_eq!(count(&defects, DefectKind::Overlap), 0);
}

#[test]
fn a_wall_that_ends_on_a_floor_crosses_nothing() {
    let wall = quad([[0.25, 0.5, 0.0], [0.75, 0.5, 0.0], [0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]);
    let defects = found(&document(vec![tile(0.0, 0.0, 0.0), wall]));
    assert_eq!(count(&defects, DefectKind::Crossing), 0, "{:?}", defects.list);
}

#[test]
fn a_wall_that_goes_a_little_through_a_floor_crosses_it_by_that() {
    // Less deep than the joining tolerance, 1e-3 of the diagonal; near its edge triangles of the floor say nothing.
    let wall = |below: f64| quad([[0.25, 0.5, -below], [0.75, 0.5, -below], [0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]);
    for below in [1e-5, 1e-4, 1e-3, 1e-2] {
        let defects = found(&document(vec![tile(0.0, 0.0, 0.0), wall(below)]));
        let crossing: Vec<&Defect> = defects.of(DefectKind::Crossing).collect();
        assert_eq!(crossing.len(), 1, "{below}: {:?}", defects.list);
        let depth = crossing[0].depth.unwrap();
        assert!((depth / below - 1.0).abs() < 1e-6, "{below}: {depth}");
        assert!(crossing[0].at.z.abs() < 1e-9 && crossing[0].size > 0.4 && crossing[0].size < 0.53, "{crossing:?}");
    }
    // At the tolerance itself the wall stands on the floor.
    assert_eq!(count(&found(&document(vec![tile(0.0, 0.0, 0.0), wall(1e-7)])), DefectKind::Crossing), 0);
}

#[test]
fn a_crossing_near_the_edge_of_a_curved_floor_is_found() {
    // The quarter of a cylinder, and a plane that cuts off a strip along its upper border: 2e-3 wide, then 1e-4.
    let arc = sweep::arc(DVec3::ZERO, DVec3::X, DVec3::Z, 0.0, std::f64::consts::FRAC_PI_2).unwrap();
    let floor = sweep::extruded(&arc, DVec3::Y).unwrap();
    for width in [2e-3f64, 1e-4] {
        let x = width.sin();
        let upright = quad([[x, 0.2, 0.5], [x, 0.8, 0.5], [x, 0.2, 1.5], [x, 0.8, 1.5]]);
        let defects = found(&document(vec![floor.clone(), upright]));
        let crossing: Vec<&Defect> = defects.of(DefectKind::Crossing).collect();
        assert_eq!(crossing.len(), 1, "{width}: {:?}", defects.list);
        let depth = crossing[0].depth.unwrap();
        // The chord of the strip: the distance of the crossing from the border.
        assert!((depth / (2.0 * (0.5 * width).sin()) - 1.0).abs() < 1e-6, "{width}: {depth}");
    }
}

#[test]
fn edges_that_weave_by_their_gap_are_a_gap_and_no_crossing() {
    // An upright tile whose lower edge is 4e-4 below the floor at one end and above it at the other, along the floor's edge.
    let upright = quad([[1.0, 0.0, -4e-4], [1.0, 1.0, 4e-4], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]]);
    let defects = found(&document(vec![tile(0.0, 0.0, 0.0), upright.clone()]));
    assert_eq!((count(&defects, DefectKind::Gap), count(&defects, DefectKind::Crossing)), (1, 0), "{:?}", defects.list);
    // A little inside the floor the same edge is a crossing where it goes deeper than the gap.
    let through = upright.transformed(&DAffine3::from_translation(DVec3::new(-0.3, 0.0, -0.01)));
    assert_eq!(count(&found(&document(vec![tile(0.0, 0.0, 0.0), through])), DefectKind::Crossing), 1);
}

#[test]
fn neighbours_that_meet_at_an_edge_cross_nothing_whatever_their_angle() {
    let along = |angle: f64| {
        let (y, z) = (1.0 + angle.cos(), angle.sin());
        quad([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, y, z], [1.0, y, z]])
    };
    for angle in [0.0f64, 0.01, 0.5, 1.5, 2.5, 3.0, -0.5, -2.0] {
        let defects = found(&document(vec![tile(0.0, 0.0, 0.0), along(angle)]));
        assert_eq!(count(&defects, DefectKind::Crossing), 0, "{angle}: {:?}", defects.list);
    }
}

#[test]
fn tiles_that_lie_half_on_one_another_overlap_by_half() {
    let knots = Knots::clamped(1, &(0..=20).map(|k| f64::from(k) / 20.0).collect::<Vec<_>>(), 1).unwrap();
    let fine = |x: f64, z: f64| {
        let at = |k: usize| DVec3::new(x + (k % 21) as f64 / 20.0, (k / 21) as f64 / 20.0, z);
        Surface::new(knots.clone(), knots.clone(), (0..441).map(at).collect(), None).unwrap()
    };
    let defects = found(&document(vec![fine(0.0, 0.0), fine(0.5, 1e-5)]));
    let overlaps: Vec<&Defect> = defects.of(DefectKind::Overlap).collect();
    assert_eq!(overlaps.len(), 1, "{:?}", defects.list);
    assert!((overlaps[0].size - 0.5).abs() < 0.06, "{}", overlaps[0].size);
    let apart = found(&document(vec![fine(0.0, 0.0), fine(0.5, 0.1)]));
    assert_eq!(count(&apart, DefectKind::Overlap), 0);
}

#[test]
fn strips_and_skewed_nets_are_named_with_their_figures() {
    let strip = quad([[0.0, 5.0, 0.0], [10.0, 5.0, 0.0], [0.0, 5.005, 0.0], [10.0, 5.005, 0.0]]);
    let skew = quad([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.08, 0.0], [8.0, 0.08, 0.0]]);
    let defects = found(&document(vec![strip, skew]));
    let slivers: Vec<&Defect> = defects.of(DefectKind::Sliver).collect();
    assert_eq!(slivers.len(), 1, "{:?}", defects.list);
    assert!((slivers[0].size - 0.005).abs() < 1e-5);
    assert_eq!(count(&defects, DefectKind::Gap), 0, "the sides of a strip are no gap");
    let bad: Vec<&Defect> = defects.of(DefectKind::Parametrization).collect();
    assert_eq!((bad.len(), bad[0].faces.as_slice()), (1, &[1][..]));
    assert!((bad[0].size - 0.02_f64.atan().to_degrees()).abs() < 1e-9);
}

#[test]
fn a_surface_that_runs_through_itself_is_found_when_asked_for() {
    // (u, v) -> (u (u^2 - 1), u^2, v) crosses itself at u = 1 and -1 along a line.
    let knots = [Knots::bezier(3, -1.5, 1.5).unwrap(), Knots::bezier(1, 0.0, 1.0).unwrap()];
    let blossom = |f: [f64; 3]| {
        let [a, b, c] = f;
        let (cubic, square, mean) = (a * b * c, (a * b + b * c + c * a) / 3.0, (a + b + c) / 3.0);
        DVec3::new(cubic - mean, square, 0.0)
    };
    let row: Vec<DVec3> = (0..4).map(|k| blossom(std::array::from_fn(|i| if i < k { 1.5 } else { -1.5 }))).collect();
    let points = row.iter().copied().chain(row.iter().map(|&p| p + DVec3::Z)).collect();
    let [ku, kv] = knots;
    let model = document(vec![Surface::new(ku, kv, points, None).unwrap()]);
    let quick = found(&model);
    assert_eq!(count(&quick, DefectKind::SelfIntersection), 0);
    let options = DefectOptions { self_intersections: true, ..DefectOptions::of(&model) };
    let defects = find(&model, &options, &Job::new());
    let own: Vec<&Defect> = defects.of(DefectKind::SelfIntersection).collect();
    assert_eq!(own.len(), 1, "{:?}", defects);
    assert!((own[0].size - 1.0).abs() < 1e-6 && own[0].at.distance(DVec3::new(0.0, 1.0, own[0].at.z)) < 1e-9);
}

#[test]
fn a_cancelled_search_is_incomplete() {
    let job = Job::new();
    job.cancel();
    let model = document(vec![tile(0.0, 0.0, 0.0)]);
    assert!(!find(&model, &DefectOptions::of(&model), &job).complete);
}
