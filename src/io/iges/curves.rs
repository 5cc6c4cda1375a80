//! Lines (110), circular arcs (100) and composites (102).

use std::f64::consts::TAU;

use glam::DVec3;

use super::params::Params;
use crate::kernel::geom::chain::concatenated;
use crate::kernel::geom::{Curve, sweep};

/// What ends of members may be apart and still be joined, as a fraction of the composite's size; the resolution
/// that the file claims counts as well, up to [`LOOSEST`].
const JOIN: f64 = 1e-9;
const LOOSEST: f64 = 1e-4;

/// The segment of a line record.
pub(super) fn line(params: &mut Params<'_>) -> Result<Curve, String> {
    let mut point = || -> Result<DVec3, String> {
        let mut p = DVec3::ZERO;
        for axis in 0..3 {
            p[axis] = params.real_or(0.0, "a coordinate").map_err(|e| e.to_string())?;
        }
        Ok(p)
    };
    let (a, b) = (point()?, point()?);
    if a == b {
        return Err("it has no length".into());
    }
    Curve::segment(a, b).map_err(|e| e.to_string())
}

/// The arc of a record: counter-clockwise from start to end around the centre in a plane of constant z, a full
/// circle where they are one. Exact: rational quadratics of at most 90 degrees, parametrized over the angle at
/// their joints.
pub(super) fn arc(params: &mut Params<'_>) -> Result<Curve, String> {
    let mut value = || params.real_or(0.0, "a coordinate").map_err(|e| e.to_string());
    let z = value()?;
    let mut point = || -> Result<DVec3, String> { Ok(DVec3::new(value()?, value()?, z)) };
    let (center, start, end) = (point()?, point()?, point()?);
    circular_arc(center, start, end)
}

fn circular_arc(center: DVec3, start: DVec3, end: DVec3) -> Result<Curve, String> {
    let (a, b) = (start - center, end - center);
    let radius = a.length();
    if !(radius > 0.0 && radius.is_finite() && b.is_finite()) {
        return Err("its radius is zero or not finite".into());
    }
    let from = a.y.atan2(a.x);
    let mut turn = if start == end { TAU } else { (b.y.atan2(b.x) - from).rem_euclid(TAU) };
    if turn == 0.0 {
        turn = TAU;
    }
    let arc = sweep::arc(center, DVec3::X * radius, DVec3::Y * radius, from, from + turn).map_err(|e| e.to_string())?;
    let mut points = arc.points().to_vec();
    let last = points.len() - 1;
    (points[0], points[last]) = (start, end); // as the file has them, not as they round
    Curve::new(arc.knots().clone(), points, arc.weights().map(<[f64]>::to_vec)).map_err(|e| e.to_string())
}

/// The members joined into as few curves as can be, in order; members that run against the others are turned
/// round. Degrees are raised to the largest, weights scaled to agree at the joints, inner joints are C0.
pub(super) fn join(members: Vec<Curve>, resolution: f64, notes: &mut Vec<String>) -> Vec<Curve> {
    let size = members.iter().map(|c| c.bounds().diagonal()).fold(0.0, f64::max);
    let close = (JOIN * size).max(resolution.min(LOOSEST * size));
    let mut chains: Vec<Vec<Curve>> = Vec::new();
    let mut gap = 0.0f64;
    for member in members {
        let [start, end] = member.ends();
        if let Some(chain) = chains.last_mut() {
            let first_only = chain.len() == 1;
            if let Some(last) = chain.last_mut() {
                let [head, tail] = last.ends();
                if tail.distance(start) <= close {
                    gap = gap.max(tail.distance(start));
                    chain.push(member);
                    continue;
                }
                if tail.distance(end) <= close {
                    gap = gap.max(tail.distance(end));
                    chain.push(member.reversed());
                    continue;
                }
                if first_only && head.distance(start).min(head.distance(end)) <= close {
                    *last = last.reversed();
                    let forward = head.distance(start) <= close;
                    gap = gap.max(head.distance(if forward { start } else { end }));
                    chain.push(if forward { member } else { member.reversed() });
                    continue;
                }
            }
        }
        chains.push(vec![member]);
    }
    if chains.len() > 1 {
        notes.push(format!("its members form {} chains that do not meet", chains.len()));
    }
    if gap > JOIN * size {
        notes.push(format!("its members miss each other by up to {gap:.3e}; the ends were moved together"));
    }
    let mut joined = Vec::new();
    for chain in chains {
        match concatenated(&chain) {
            Ok(curve) => joined.push(curve),
            Err(reason) => {
                notes.push(format!("its members were kept apart: {reason}"));
                joined.extend(chain);
            }
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 2.0)
    }

    #[test]
    fn arcs_are_round_and_run_counter_clockwise() {
        let r = 2.5;
        let at =
            |degrees: f64| v(1.0, -1.0) + r * DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        for (from, sweep) in [(0.0, 90.0), (10.0, 350.0), (-170.0, 30.0), (30.0, 180.0), (77.0, 360.0), (5.0, 1e-3)] {
            let end = if sweep == 360.0 { at(from) } else { at(from + sweep) };
            let arc = circular_arc(v(1.0, -1.0), at(from), end).unwrap();
            let [a, b] = arc.domain();
            assert!((b - a - f64::to_radians(sweep)).abs() < 1e-12);
            for i in 0..=40 {
                let p = arc.eval(a + (b - a) * f64::from(i) / 40.0);
                assert!((p.distance(v(1.0, -1.0)) - r).abs() < 1e-14);
            }
            let middle = arc.eval(0.5 * (a + b));
            assert!(middle.distance(at(from + 0.5 * sweep)) < 1e-9, "{from} {sweep}");
        }
        assert!(circular_arc(v(0.0, 0.0), v(0.0, 0.0), v(1.0, 0.0)).is_err());
    }

    #[test]
    fn composites_of_lines_and_arcs_become_one_curve() {
        let line = |a, b| Curve::segment(a, b).unwrap();
        let arc = circular_arc(v(1.0, 1.0), v(1.0, 0.0), v(2.0, 1.0)).unwrap();
        // The last member is against the run of the others, as files have it.
        let members = vec![line(v(0.0, 0.0), v(1.0, 0.0)), arc, line(v(2.0, 3.0), v(2.0, 1.0))];
        let mut notes = Vec::new();
        let joined = join(members, 0.0, &mut notes);
        assert_eq!((joined.len(), notes.len()), (1, 0), "{notes:?}");
        let curve = &joined[0];
        assert_eq!(curve.knots().degree(), 2);
        assert_eq!(curve.ends(), [v(0.0, 0.0), v(2.0, 3.0)]);
        let [a, b] = curve.domain();
        for i in 0..=200 {
            let p = curve.eval(a + (b - a) * f64::from(i) / 200.0);
            let on_line = (p.y.abs() < 1e-12 && p.x <= 1.0) || ((p.x - 2.0).abs() < 1e-12 && p.y >= 1.0);
            assert!(on_line || (p.distance(v(1.0, 1.0)) - 1.0).abs() < 1e-12, "{p}");
        }
    }

    #[test]
    fn members_that_do_not_meet_stay_apart_and_are_named() {
        let line = |a, b| Curve::segment(a, b).unwrap();
        let mut notes = Vec::new();
        let members = vec![line(v(0.0, 0.0), v(1.0, 0.0)), line(v(1.1, 0.0), v(2.0, 0.0))];
        assert_eq!(join(members, 0.01, &mut notes).len(), 2);
        assert_eq!(notes.len(), 1);
    }
}
