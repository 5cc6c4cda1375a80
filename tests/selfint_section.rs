//! A plane swept through a miter point: the three types of thesis Fig. 8.8 against their closed forms, and what the
//! search records for display.

#![allow(clippy::unwrap_used, reason = "a test helper may stop the test")]

#[path = "support/shapes.rs"]
mod shapes;

use glam::{DVec2, DVec3};
use patchwright::kernel::geom::Surface;
use patchwright::kernel::job::Job;
use patchwright::kernel::self_ssi::record::NodeState;
use patchwright::kernel::self_ssi::section::{MiterSection, SectionEnd, SectionOptions, SectionType, miter_section};
use patchwright::kernel::self_ssi::{SelfIntersectError, SelfIntersectOptions, self_intersect};
use shapes::{interpolate, ridge, sextic, spun, square, turned};

/// (x, x y, y^2 + f(x)) with the domain and space turned: a miter point in 0 with tangent x, double line (0, 0, y^2).
fn umbrella(f: impl Fn(f64) -> f64) -> Surface {
    interpolate(&sextic(), &sextic(), |u, v| {
        let p = spun(u, v);
        turned(DVec3::new(p.x, p.x * p.y, p.y * p.y + f(p.x)))
    })
}

/// The domain's point with spun(p) = 0.
fn center() -> DVec2 {
    DVec2::from_angle(-0.4).rotate(DVec2::new(-0.03, 0.05))
}

fn cut(surface: &Surface, tilt: f64, offset: f64) -> MiterSection {
    let options = SectionOptions { tilt, offset, reach: 0.25, ..SectionOptions::default() };
    let section = miter_section(surface, 0, center(), &options, &Job::new()).unwrap();
    assert!(section.complete, "{tilt} {offset}");
    assert!(section.uv.distance(center()) < 1e-9);
    section
}

/// Curves by their ends: (border to border, closed, border to miter).
fn count(section: &MiterSection) -> (usize, usize, usize) {
    let of = |ends: [SectionEnd; 2]| {
        section.curves.iter().filter(|c| c.ends == ends || c.ends == [ends[1], ends[0]]).count()
    };
    (of([SectionEnd::Border; 2]), of([SectionEnd::Loop; 2]), of([SectionEnd::Border, SectionEnd::Miter]))
}

/// Every point of a section satisfies f(x, y) = h in the turned domain.
fn lies_on(section: &MiterSection, f: impl Fn(f64, f64) -> f64, h: f64) {
    for p in section.curves.iter().flat_map(|c| &c.uv) {
        let q = spun(p.x, p.y);
        assert!((f(q.x, q.y) - h).abs() < 1e-9, "{q}: {}", f(q.x, q.y) - h);
    }
}

#[test]
fn an_elliptic_section_is_a_figure_eight_then_the_point_then_nothing() {
    let surface = umbrella(|x| 0.7 * x * x);
    for h in [0.04, 1e-4, 1e-8] {
        let section = cut(&surface, 0.0, h);
        assert_eq!(section.kind, SectionType::Elliptic);
        assert_eq!((count(&section), section.curves.len(), section.crossings.len()), ((0, 1, 0), 1, 1), "{h}");
        lies_on(&section, |x, y| y * y + 0.7 * x * x, h);
        // The figure-8 crosses itself in (0, +-sqrt(h)).
        let [p, q] = [section.crossings[0].uv, section.crossings[0].st].map(|p| spun(p.x, p.y));
        assert!(p.x.abs() < 1e-9 && (p.y.abs() - h.sqrt()).abs() < 1e-9 && (p + q).length() < 1e-9);
    }
    for h in [0.0, -1e-8, -0.04] {
        let section = cut(&surface, 0.0, h);
        assert!(section.curves.is_empty() && section.crossings.is_empty(), "{h}");
    }
}

#[test]
fn a_hyperbolic_section_is_two_branches_then_an_x_then_two_branches() {
    let surface = umbrella(|x| -0.7 * x * x);
    for h in [0.04, 1e-4, 1e-8, -1e-8, -1e-4, -0.04] {
        let section = cut(&surface, 0.0, h);
        assert_eq!(section.kind, SectionType::Hyperbolic);
        // On the branch's side the two cross in space, each through one sheet.
        assert_eq!((count(&section), section.crossings.len()), ((2, 0, 0), usize::from(h > 0.0)), "{h}");
        assert_eq!(section.curves.len(), 2);
        lies_on(&section, |x, y| y * y - 0.7 * x * x, h);
    }
    let section = cut(&surface, 0.0, 0.0);
    assert_eq!((count(&section), section.curves.len(), section.crossings.len()), ((0, 0, 4), 4, 0));
    lies_on(&section, |x, y| y * y - 0.7 * x * x, 0.0);
}

#[test]
fn a_parabolic_section_is_a_loop_with_a_tail() {
    let surface = umbrella(|x| 0.7 * x * x * x);
    for h in [0.01, 1e-4] {
        let section = cut(&surface, 0.0, h);
        assert_eq!(section.kind, SectionType::Parabolic);
        assert_eq!((count(&section), section.crossings.len()), ((1, 0, 0), 1), "{h}: one curve, crossing itself once");
        assert_eq!(section.curves.len(), 1);
        lies_on(&section, |x, y| y * y + 0.7 * x * x * x, h);
    }
    let section = cut(&surface, 0.0, 0.0);
    assert_eq!((count(&section), section.curves.len(), section.crossings.len()), ((0, 0, 2), 2, 0), "a cusp");
    for h in [-1e-4, -0.01] {
        let section = cut(&surface, 0.0, h);
        assert_eq!((count(&section), section.curves.len(), section.crossings.len()), ((1, 0, 0), 1, 0), "{h}");
    }
}

#[test]
fn the_type_changes_at_the_parabolic_tilts() {
    let surface = umbrella(|x| 0.25 * x * x);
    // With n = (0, sin, cos) the form is cos (y^2 + x^2 / 4) + sin x y: parabolic at tan = +-1.
    let tilts = cut(&surface, 0.0, 0.0).parabolic_tilts;
    assert_eq!(tilts.len(), 2);
    for (t, expected) in tilts.iter().zip([-1.0, 1.0]) {
        assert!((t - expected * std::f64::consts::FRAC_PI_4).abs() < 1e-9, "{t}");
    }
    // On that plane itself the section is a double line: look beside it.
    assert_eq!(cut(&surface, tilts[0], 0.01).kind, SectionType::Parabolic);
    assert_eq!(cut(&surface, tilts[1] - 0.1, 0.0).kind, SectionType::Elliptic);
    assert_eq!(cut(&surface, tilts[1] + 0.1, 0.0).kind, SectionType::Hyperbolic);
    assert_eq!(count(&cut(&surface, tilts[1] + 0.1, 0.0)), (0, 0, 4));
    assert!(cut(&umbrella(|x| -0.25 * x * x), 0.0, 0.0).parabolic_tilts.is_empty());
}

#[test]
fn a_plane_across_the_tangent_cuts_one_curve() {
    let surface = umbrella(|x| 0.25 * x * x);
    let normal = turned(DVec3::new(1.0, 0.0, 1.0)) - turned(DVec3::ZERO);
    for offset in [-0.02, 0.0, 0.02] {
        let options = SectionOptions { normal: Some(normal), offset, reach: 0.2, ..SectionOptions::default() };
        let section = miter_section(&surface, 0, center(), &options, &Job::new()).unwrap();
        assert!(section.complete);
        assert_eq!(section.kind, SectionType::Transversal);
        assert_eq!((count(&section), section.curves.len()), ((1, 0, 0), 1));
        assert_eq!(section.crossings.len(), usize::from(offset > 0.0), "the branch is on the positive side");
        lies_on(&section, |x, y| x + y * y + 0.25 * x * x, offset * 2.0_f64.sqrt());
    }
}

#[test]
fn what_cannot_be_cut_is_said() {
    let surface = umbrella(|x| 0.25 * x * x);
    let flat = interpolate(&square(), &square(), |u, v| DVec3::new(u, v, 0.0));
    let options = SectionOptions::default();
    let none = miter_section(&flat, 0, DVec2::ZERO, &options, &Job::new());
    assert!(matches!(none, Err(SelfIntersectError::NoMiterPoint { .. })));
    for bad in [
        SectionOptions { reach: 0.0, ..options },
        SectionOptions { offset: f64::NAN, ..options },
        SectionOptions { tol: Some(-1.0), ..options },
        SectionOptions { normal: Some(DVec3::ZERO), ..options },
    ] {
        assert!(miter_section(&surface, 0, center(), &bad, &Job::new()).is_err());
    }
}

#[test]
fn the_record_shows_what_was_proved_and_where_the_miter_points_are() {
    let surface = interpolate(&square(), &square(), ridge(|x| x * x - 0.2));
    let options = SelfIntersectOptions { record: true, ..SelfIntersectOptions::default() };
    let found = self_intersect(&surface, 0, &options, &Job::new()).unwrap();
    let plain = self_intersect(&surface, 0, &SelfIntersectOptions::default(), &Job::new()).unwrap();
    assert!(plain.record.is_none());
    assert_eq!(found.result.curves, plain.result.curves, "recording changes nothing");
    let record = found.record.unwrap();
    assert_eq!((record.lines[0].len(), record.lines[1].len()), (129, 129));
    assert!(record.levels() > 2 && record.level(0).count() == 1);
    assert!(record.nodes.iter().any(|n| n.state == NodeState::Injective));
    assert!(record.nodes.iter().any(|n| n.state == NodeState::MiterPoint));
    // The first split: 48 | 48 | 48 of 128 cells, the middle one over both sides.
    let mut widths: Vec<[u32; 2]> = record.level(1).filter_map(|n| n.cells).map(|c| c[0]).collect();
    let mut heights: Vec<[u32; 2]> = record.level(1).filter_map(|n| n.cells).map(|c| c[1]).collect();
    widths.sort_unstable();
    heights.sort_unstable();
    let expected = vec![[0, 48], [40, 88], [80, 128]];
    assert!(widths == expected || heights == expected, "{widths:?} {heights:?}");
    // Windows around the miter points need no proof of their own: their branch is known. None else fails.
    for window in &record.windows {
        assert!(window.size == 2 || window.size == 3);
    }
    assert_eq!(record.leaves.len(), 2);
    for leaf in &record.leaves {
        let miter = &found.result.miters[leaf.miter];
        let within = |b: [[f64; 2]; 2], p: DVec2| (0..2).all(|d| b[d][0] <= p[d] && p[d] <= b[d][1]);
        assert!(within(leaf.middle[1], miter.uv) && within(leaf.cell, miter.uv));
        for corner in miter.quad {
            let b = leaf.middle[1];
            assert!((0..2).all(|d| b[d][0] - 1e-12 <= corner[d] && corner[d] <= b[d][1] + 1e-12));
        }
    }
}

#[test]
fn miter_quadrangles_fit_into_balls_down_to_1e_9() {
    let surface = umbrella(|x| 0.25 * x * x);
    for radius in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
        let options = SelfIntersectOptions { miter_radius: Some(radius), ..SelfIntersectOptions::default() };
        let found = self_intersect(&surface, 0, &options, &Job::new()).unwrap();
        let miter = &found.result.miters[0];
        assert_eq!(miter.radius, radius);
        let area = (miter.quad[1] - miter.quad[0]).perp_dot(miter.quad[2] - miter.quad[1]).abs();
        assert!(area > 0.0);
        let mut farthest = 0.0_f64;
        for i in 0..=10 {
            for j in 0..=10 {
                let (a, b) = (f64::from(i) / 10.0, f64::from(j) / 10.0);
                let p = miter.quad[0].lerp(miter.quad[1], a).lerp(miter.quad[3].lerp(miter.quad[2], a), b);
                farthest = farthest.max(surface.eval(p).distance(miter.xyz));
            }
        }
        assert!(farthest <= radius * (1.0 + 1e-6) && farthest > 0.2 * radius, "{radius}: {farthest}");
    }
}
