//! HJR99 Fig. 12: a car-body section in millimetres. Left half: hood, fender with its wheel arch, two doors, side
//! glass and roof, with shut-line gaps, a door that stands 1.5 mm proud, doors that overlap, and a missing fuel
//! flap.

use glam::DVec3;

use super::{Builder, Example, Settings, edge, iso_u, iso_v, line, patch, sheet, shifted};
use crate::kernel::geom::Side::{UMax, UMin, VMax, VMin};
use crate::model::document::Unit;

/// Half the width of the body at the widest line.
fn half_width(x: f64) -> f64 {
    875.0 - 190.0 * (1.0 - (x - 150.0) / 1850.0).max(0.0).powi(3)
}

/// The height of the shoulder.
fn shoulder(x: f64) -> f64 {
    720.0 + 235.0 * (1.0 - (-(x - 150.0) / 1100.0).exp())
}

/// The body side from the sill (t = 0) over the barrel-shaped door to the rolled shoulder (t = 1).
fn side(x: f64, t: f64) -> DVec3 {
    let roll = ((t - 0.72) / 0.28).max(0.0).powi(3);
    let bell = |x: f64| (-x * x).exp();
    let flare = 38.0 * bell((x - 800.0) / 300.0) * bell((t - 0.42) / 0.28);
    let y = half_width(x) - 50.0 * (2.0 * t - 1.05).powi(2) - 120.0 * roll + flare;
    DVec3::new(x, y, 230.0 + (shoulder(x) - 230.0) * t)
}

/// The lower end of the fender: the wheel arch.
fn arch(x: f64) -> f64 {
    0.05 + 0.40 * (-((x - 800.0) / 300.0).powi(2)).exp()
}

fn roof(x: f64, y: f64) -> DVec3 {
    let along = (x - 2400.0) / 800.0;
    DVec3::new(x, y, 1395.0 - 62.0 * along * along - 40.0 * (y / 530.0).powi(2) - 18.0 * (y / 530.0).powi(6))
}

/// The side glass from the shoulder (s = 0) to the roof rail (s = 1), outside bulge included.
fn glass(x: f64, s: f64) -> DVec3 {
    let low = side(x, 1.0) + DVec3::new(0.0, -3.0, 3.0);
    let high = roof(x, 530.0) + DVec3::new(0.0, 3.0, -3.0);
    low.lerp(high, s) + DVec3::new(0.0, 0.85, 0.5) * (42.0 * (std::f64::consts::PI * s).sin())
}

pub(super) fn car_body() -> Example {
    let mut model = Builder::new(Unit::Millimetre);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;

    let fender = model.sheet("fender", [16, 12], |u, v| {
        let x = mix(150.0, 1330.0, u);
        side(x, mix(arch(x), 1.0, v))
    });
    let hood = model.sheet("hood", [14, 14], |u, v| {
        let x = mix(150.0, 1330.0, u);
        let edge = side(x, 1.0);
        let crown = 95.0 * (0.45 + 0.55 * u) * (1.0 - (1.0 - v).powi(2));
        let power_dome = 16.0 * (-((v - 0.62) / 0.14).powi(2)).exp();
        DVec3::new(x, (edge.y - 6.0) * (1.0 - v), edge.z + crown + power_dome)
    });
    // Shut lines of 5 mm, the sills in line; the front door stands proud, the rear door reaches 3 mm under it.
    let door = sheet([10, 12], |u, v| side(mix(1335.0, 2330.0, u), mix(arch(1330.0), 1.0, v)));
    let door = model.add("front door", door.transformed(&shifted(0.0, 1.5, 0.0)));
    let rear = sheet([10, 12], |u, v| side(mix(2327.0, 3150.0, u), mix(arch(1330.0), 1.0, v)));
    let [below, above, _, behind] =
        model.with_hole("rear door", &rear.transformed(&shifted(0.0, -1.0, 0.0)), [0.5, 0.75], [0.5, 0.72]);
    let pillar = |s: f64| mix(1342.0, 1905.0, s);
    let front_glass = model.sheet("front glass", [10, 8], |u, v| glass(mix(pillar(v), 2326.0, u), v));
    let rear_glass = model.sheet("rear glass", [8, 8], |u, v| glass(mix(2334.0, 3150.0, u), v));
    let roof = model.sheet("roof", [12, 10], |u, v| roof(mix(1898.0, 3150.0, u), mix(530.0, 0.0, v)));

    let at = |s: usize, u: f64, v: f64| model.eval(s, u, v);
    let b_pillar = (2330.0 - 1898.0) / (3150.0 - 1898.0);

    let shoulder_line = vec![edge(fender, VMax)];
    let fender_rear = vec![edge(fender, UMax)];
    let door_rear = vec![edge(door, UMax)];
    let door_top = vec![line(at(fender, 1.0, 1.0), at(door, 0.0, 1.0)), edge(door, VMax)];
    let rear_top = vec![line(at(door, 1.0, 1.0), at(above, 0.0, 1.0)), edge(above, VMax)];
    let glass_split = vec![
        line(at(door, 1.0, 1.0), at(front_glass, 1.0, 0.0)),
        edge(front_glass, UMax),
        line(at(front_glass, 1.0, 1.0), at(roof, b_pillar, 0.0)),
    ];
    let front_rail = vec![iso_v(roof, 0.0, 0.0, b_pillar)];
    let rear_rail = vec![iso_v(roof, 0.0, b_pillar, 1.0)];
    let roof_split = vec![iso_u(roof, b_pillar, 0.0, 1.0)];

    let patches = vec![
        patch(
            "hood",
            [
                shoulder_line.clone(),
                vec![edge(hood, UMax), line(at(fender, 1.0, 1.0), at(hood, 1.0, 0.0))],
                vec![edge(hood, VMax)],
                vec![line(at(fender, 0.0, 1.0), at(hood, 0.0, 0.0)), edge(hood, UMin)],
            ],
        ),
        patch("fender", [vec![edge(fender, VMin)], fender_rear.clone(), shoulder_line, vec![edge(fender, UMin)]]),
        patch(
            "front door",
            [
                vec![line(at(fender, 1.0, 0.0), at(door, 0.0, 0.0)), edge(door, VMin)],
                door_rear.clone(),
                door_top.clone(),
                fender_rear,
            ],
        ),
        patch(
            "rear door",
            [
                vec![line(at(door, 1.0, 0.0), at(below, 0.0, 0.0)), edge(below, VMin)],
                vec![edge(below, UMax), edge(behind, UMax), edge(above, UMax)],
                rear_top.clone(),
                door_rear,
            ],
        ),
        patch(
            "front glass",
            [
                door_top,
                glass_split.clone(),
                front_rail.clone(),
                vec![
                    line(at(fender, 1.0, 1.0), at(front_glass, 0.0, 0.0)),
                    edge(front_glass, UMin),
                    line(at(front_glass, 0.0, 1.0), at(roof, 0.0, 0.0)),
                ],
            ],
        ),
        patch(
            "rear glass",
            [
                rear_top,
                vec![
                    line(at(above, 1.0, 1.0), at(rear_glass, 1.0, 0.0)),
                    edge(rear_glass, UMax),
                    line(at(rear_glass, 1.0, 1.0), at(roof, 1.0, 0.0)),
                ],
                rear_rail.clone(),
                glass_split,
            ],
        ),
        patch(
            "front roof",
            [front_rail, roof_split.clone(), vec![iso_v(roof, 1.0, 0.0, b_pillar)], vec![edge(roof, UMin)]],
        ),
        patch("rear roof", [rear_rail, vec![edge(roof, UMax)], vec![iso_v(roof, 1.0, b_pillar, 1.0)], roof_split]),
    ];
    let settings = Settings { joining_tol: 0.5, tol: 2.0, slab: Some(60.0) };
    model.finish("car_body", "HJR99 Fig. 12: a car-body section, millimetres", settings, patches)
}
