//! HJR99 Figs 8 to 11: part of a single patch, surfaces with a gap, intersecting and oscillating surfaces.

use glam::DVec3;

use super::{BoundaryMode, Builder, Example, Settings, edge, iso_u, iso_v, line, patch, rounded, sheet, tuple};
use crate::kernel::geom::Side;
use crate::model::document::Unit;
use crate::model::spec::Piece;

/// Fig. 8: a patch over part of one surface, inside an iso-curve, two curves drawn on it and a straight segment that
/// is projected onto it.
pub(super) fn part_of_a_patch() -> Example {
    let mut model = Builder::new(Unit::Metre);
    let s = model.sheet("dome", [14, 10], |u, v| {
        let (x, y) = (2.2 * u, 1.5 * v);
        DVec3::new(x, y, 0.28 * (std::f64::consts::PI * u).sin() + 0.12 * (4.2 * v + 1.5 * u).sin())
    });
    let at = |u: f64, v: f64| model.eval(s, u, v);
    let drawn = |points: &[(f64, f64)]| Piece::Drawn(points.iter().map(|&(u, v)| tuple(at(u, v))).collect());
    let mut p = patch(
        "dome part",
        [
            vec![iso_v(s, 0.15, 0.1, 0.9)],
            vec![drawn(&[(0.9, 0.15), (0.95, 0.3), (0.96, 0.5), (0.92, 0.7), (0.85, 0.85)])],
            vec![drawn(&[(0.85, 0.85), (0.6, 0.92), (0.35, 0.92), (0.12, 0.82)])],
            vec![line(at(0.12, 0.82), at(0.1, 0.15))],
        ],
    );
    p.boundary[3] = BoundaryMode::Project;
    let settings = Settings { joining_tol: 1e-3, tol: 5e-4, slab: None };
    model.finish("part_of_a_patch", "HJR99 Fig. 8: part of a single patch", settings, vec![p])
}

/// A gently curved panel over (x, y).
fn panel(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, 0.25 * (1.4 * x).sin() + 0.15 * (1.8 * y).cos())
}

/// Fig. 9: two panels with a gap that widens from 2 to 10 cm.
pub(super) fn surfaces_with_gap() -> Example {
    let mut model = Builder::new(Unit::Metre);
    let gap = |y: f64| 0.02 + 0.08 * y / 1.3;
    let y = |v: f64| 1.3 * v;
    let a = model.sheet("left panel", [10, 10], |u, v| panel(u * (1.0 - 0.5 * gap(y(v))), y(v)));
    let b = model.sheet("right panel", [10, 10], |u, v| {
        let start = 1.0 + 0.5 * gap(y(v));
        panel(start + u * (2.1 - start), y(v))
    });
    let bridge = |v: f64| line(model.eval(a, 1.0, v), model.eval(b, 0.0, v));
    let p = patch(
        "across the gap",
        [
            vec![edge(a, Side::UMin)],
            vec![edge(b, Side::VMin), edge(a, Side::VMin), bridge(0.0)],
            vec![edge(b, Side::UMax)],
            vec![edge(a, Side::VMax), bridge(1.0), edge(b, Side::VMax)],
        ],
    );
    let settings = Settings { joining_tol: 1e-3, tol: 3e-4, slab: None };
    model.finish("surfaces_with_gap", "HJR99 Fig. 9: surfaces with a gap", settings, vec![p])
}

/// Fig. 10: two panels that run through each other along a wavy line.
pub(super) fn intersecting_surfaces() -> Example {
    let mut model = Builder::new(Unit::Metre);
    let y = |v: f64| 1.3 * v;
    let crossing = |y: f64| 1.0 + 0.05 * (2.4 * y).sin();
    let end = 1.15;
    let a = model.sheet("left panel", [10, 10], |u, v| panel(u * end, y(v)));
    let b = model.sheet("right panel", [10, 10], |u, v| {
        let (x, y) = (0.85 + u * 1.25, y(v));
        panel(x, y) + DVec3::Z * (0.1 * (x - crossing(y)))
    });
    // The sides change over where the panels cross.
    let side = |v: f64| {
        let x = crossing(y(v));
        vec![iso_v(a, v, 0.0, x / end), iso_v(b, v, (x - 0.85) / 1.25, 1.0)]
    };
    let p = patch("over the crossing", [side(0.0), side(1.0), vec![edge(a, Side::UMin)], vec![edge(b, Side::UMax)]]);
    let settings = Settings { joining_tol: 1e-3, tol: 1.5e-3, slab: Some(0.2) };
    model.finish("intersecting_surfaces", "HJR99 Fig. 10: intersecting surfaces", settings, vec![p])
}

/// Fig. 11: two pieces of a highly oscillating surface that overlap a little.
pub(super) fn oscillating_surfaces() -> Example {
    let mut model = Builder::new(Unit::Metre);
    let whole = sheet([48, 36], |u, v| {
        let (x, y) = (2.0 * u, 1.5 * v);
        DVec3::new(x, y, 0.05 * (11.0 * x).sin() * (9.0 * y).cos() + 0.15 * (1.2 * x).sin())
    });
    let part = |u: [f64; 2]| whole.restricted(u, [0.0, 1.0]).unwrap_or_else(|_| whole.clone());
    let a = model.add("left waves", part([0.0, 0.52]));
    let b = model.add("right waves", part([0.48, 1.0]));
    let across = |v: f64| vec![iso_v(a, v, 0.08, 0.5), iso_v(b, v, 0.5, rounded(0.92))];
    let p = patch("waves", [across(0.1), vec![iso_u(b, 0.92, 0.1, 0.9)], across(0.9), vec![iso_u(a, 0.08, 0.1, 0.9)]]);
    let settings = Settings { joining_tol: 1e-3, tol: 5e-4, slab: Some(0.25) };
    model.finish("oscillating_surfaces", "HJR99 Fig. 11: highly oscillating surfaces", settings, vec![p])
}
