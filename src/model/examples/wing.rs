//! HJR99 Fig. 13: a wing-body section in metres. Right half of a fuselage in three panels with a gap, an overlap
//! with a step and a missing hatch, and a swept wing that runs through its side, its upper skin in two panels.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::{Builder, Example, Settings, edge, iso_u, iso_v, line, patch, polyline, sheet};
use crate::kernel::geom::Side::{UMax, UMin, VMax};
use crate::model::document::Unit;

/// Radius and height of the fuselage's axis.
fn fuselage_section(x: f64) -> (f64, f64) {
    let nose = ((6.0 - x) / 6.4).max(0.0);
    let tail = ((x - 17.0) / 9.0).max(0.0);
    (1.9 * (1.0 - nose * nose).sqrt() - 0.85 * tail * tail, 0.55 * tail * tail)
}

/// The fuselage at station x, from the keel (v = 0) to the crown (v = 1), its radius scaled.
fn fuselage(x: f64, v: f64, scale: f64) -> DVec3 {
    let (r, z) = fuselage_section(x);
    let angle = PI * v - FRAC_PI_2;
    DVec3::new(x, r * scale * angle.cos(), z + r * scale * angle.sin())
}

/// The wing's skin at span station y, from the leading edge (u = 0) to the trailing edge (u = 1).
fn wing(u: f64, y: f64, upper: bool) -> DVec3 {
    let chord = 6.2 - 0.30 * y;
    let x = 0.5 * (1.0 - (PI * u).cos());
    let half = 0.6 * (0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
    let camber = 0.08 * x * (1.0 - x);
    let z = camber + if upper { half } else { -half };
    DVec3::new(9.8 + 0.47 * y + chord * x, y, -0.95 + 0.09 * y + chord * z)
}

/// Where the wing leaves the fuselage: the span station, by bisection.
fn junction(u: f64, upper: bool) -> f64 {
    let outside = |y: f64| {
        let p = wing(u, y, upper);
        let (r, z) = fuselage_section(p.x);
        p.y.hypot(p.z - z) - r
    };
    let (mut low, mut high) = (0.6, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if outside(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

pub(super) fn wing_body() -> Example {
    let mut model = Builder::new(Unit::Metre);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    // A gap of 1 cm before the centre panel, an overlap of 3 cm with a step of 4 mm behind it.
    let (start, forward_end, centre_start, centre_end, aft_start, end) = (2.0, 9.4, 9.41, 17.5, 17.47, 26.0);
    let forward = model.sheet("forward fuselage", [12, 12], |u, v| fuselage(mix(start, forward_end, u), v, 1.0));
    let centre = model.sheet("centre fuselage", [12, 12], |u, v| fuselage(mix(centre_start, centre_end, u), v, 1.0));
    let aft = sheet([12, 12], |u, v| fuselage(mix(aft_start, end, u), v, 1.002));
    let [aft_low, aft_top, _, aft_behind] = model.with_hole("aft fuselage", &aft, [0.35, 0.6], [0.72, 0.88]);
    let (root, break_in, break_out, tip) = (0.6, 6.3, 6.33, 14.0);
    let inner = model.sheet("inner upper skin", [16, 8], |u, v| wing(u, mix(root, break_in, v), true));
    let outer =
        model.sheet("outer upper skin", [16, 8], |u, v| wing(u, mix(break_out, tip, v), true) + DVec3::Z * 0.004);
    let lower = model.sheet("lower skin", [16, 12], |u, v| wing(u, mix(root, tip, v), false));

    let at = |s: usize, u: f64, v: f64| model.eval(s, u, v);
    let height = |p: DVec3| {
        let (_, z) = fuselage_section(p.x);
        ((p.z - z).atan2(p.y) + FRAC_PI_2) / PI
    };
    let junction_line = |upper: bool| -> Vec<DVec3> {
        (0..=64).map(|k| f64::from(k) / 64.0).map(|u| wing(u, junction(u, upper), upper)).collect()
    };
    let (upper_root, lower_root) = (junction_line(true), junction_line(false));
    let (nose, tail) = (upper_root[0], upper_root[64]);
    let (nose_v, tail_v) = (height(nose), height(tail));
    let in_centre = |x: f64| (x - centre_start) / (centre_end - centre_start);
    let in_aft = |x: f64| (x - aft_start) / (end - aft_start);
    let (nose_u, tail_u) = (in_centre(nose.x), in_centre(tail.x));
    let over = 0.5 * (centre_end + aft_start);

    // Along the fuselage: before the wing, and behind it across the step.
    let before = |v: f64| {
        vec![iso_v(forward, v, 0.0, 1.0), line(at(forward, 1.0, v), at(centre, 0.0, v)), iso_v(centre, v, 0.0, nose_u)]
    };
    let behind = |v: f64, aft: usize| vec![iso_v(centre, v, tail_u, in_centre(over)), iso_v(aft, v, in_aft(over), 1.0)];
    let (water_before, water_behind) = (before(nose_v), behind(tail_v, aft_low));
    let ring = |u: f64, v: [f64; 2]| vec![iso_u(centre, u, v[0], v[1])];
    let (nose_up, nose_down) = (ring(nose_u, [nose_v, 1.0]), ring(nose_u, [0.0, nose_v]));
    let (tail_up, tail_down) = (ring(tail_u, [tail_v, 1.0]), ring(tail_u, [0.0, tail_v]));
    let edge_of_wing = |u: f64, from: f64| {
        vec![
            iso_u(inner, u, (from - root) / (break_in - root), 1.0),
            line(at(inner, u, 1.0), at(outer, u, 0.0)),
            edge(outer, if u < 0.5 { UMin } else { UMax }),
        ]
    };
    let (leading, trailing) = (edge_of_wing(0.0, nose.y), edge_of_wing(1.0, tail.y));

    let patches = vec![
        patch(
            "upper nose",
            [water_before.clone(), nose_up.clone(), before(1.0), vec![iso_u(forward, 0.0, nose_v, 1.0)]],
        ),
        patch(
            "over the wing",
            [vec![polyline(&upper_root)], tail_up.clone(), vec![iso_v(centre, 1.0, nose_u, tail_u)], nose_up],
        ),
        patch(
            "upper tail",
            [
                water_behind.clone(),
                vec![iso_u(aft_low, 1.0, tail_v, 0.72), edge(aft_behind, UMax), edge(aft_top, UMax)],
                behind(1.0, aft_top),
                tail_up,
            ],
        ),
        patch("lower nose", [before(0.0), nose_down.clone(), water_before, vec![iso_u(forward, 0.0, 0.0, nose_v)]]),
        patch(
            "under the wing",
            [vec![iso_v(centre, 0.0, nose_u, tail_u)], tail_down.clone(), vec![polyline(&lower_root)], nose_down],
        ),
        patch("lower tail", [behind(0.0, aft_low), vec![iso_u(aft_low, 1.0, 0.0, tail_v)], water_behind, tail_down]),
        patch("wing upper", [vec![polyline(&upper_root)], trailing.clone(), vec![edge(outer, VMax)], leading.clone()]),
        patch("wing lower", [vec![polyline(&lower_root)], leading, vec![edge(lower, VMax)], trailing]),
    ];
    let settings = Settings { joining_tol: 0.01, tol: 0.01, slab: Some(0.4) };
    model.finish("wing_body", "HJR99 Fig. 13: a wing-body section, metres", settings, patches)
}
