//! Where a click near a curve means more than the nearest point: ends, corners, middles, knots.
//!
//! The curves within the radius are asked for their particular points; a corner is where two of them come
//! within the joining tolerance (Newton from the places under the cursor, on the exact curves). The most particular
//! kind wins, the nearest in pixels among equals: corner, end, middle, knot, and the curve itself last. What a surface
//! hides is no snap. Cost: tens of microseconds.

use glam::{DVec2, DVec3};

use super::display::CurveRef;
use super::pick::{Cover, PickHit, PickOptions, RADIUS, Target, curve_candidates};
use super::scene::Scene;
use super::segment_tree::Pyramid;
use super::viewport::View;
use crate::kernel::geom::arc_length::ArcLength;

/// How many of the nearest curves are asked.
const CURVES: usize = 6;

/// What a point on a curve is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SnapKind {
    /// Two curves meet or cross there.
    Corner,
    /// A curve ends there.
    End,
    /// Half the length of a curve is on either side.
    Middle,
    /// Two pieces of a curve join there.
    Knot,
    /// The nearest point of a curve.
    OnCurve,
}

impl SnapKind {
    /// All kinds, the most particular first.
    pub const ALL: [Self; 5] = [Self::Corner, Self::End, Self::Middle, Self::Knot, Self::OnCurve];

    /// The label at the cursor and in the snap menu.
    pub fn label(self) -> &'static str {
        match self {
            Self::Corner => "Corner",
            Self::End => "End",
            Self::Middle => "Middle",
            Self::Knot => "Knot",
            Self::OnCurve => "On curve",
        }
    }
}

/// How to snap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnapOptions {
    /// Which kinds are on, in the order of [`SnapKind::ALL`].
    pub on: [bool; 5],
    /// How far two curves may miss each other and still make a corner, in model units.
    pub joining_tol: f64,
    /// How near the cursor must be, in pixels.
    pub radius: f64,
}

impl SnapOptions {
    /// All kinds within the pick radius.
    pub fn new(joining_tol: f64) -> Self {
        Self { on: [true; 5], joining_tol, radius: RADIUS }
    }

    /// Whether a kind is on.
    pub fn allows(&self, kind: SnapKind) -> bool {
        self.on[kind as usize]
    }
}

/// A particular point under the cursor.
#[derive(Clone, Debug, PartialEq)]
pub struct Snap {
    /// What it is.
    pub kind: SnapKind,
    /// Where it is: on the first curve.
    pub point: DVec3,
    /// Its pixel.
    pub pixel: DVec2,
    /// How far that is from the cursor.
    pub distance: f64,
    /// The curve and the parameter there; for a corner, both.
    pub on: Vec<(CurveRef, f64)>,
    /// For a corner, how far the curves miss each other there.
    pub gap: f64,
}

/// The snap at a pixel. `None` when nothing is near, or while `suspended` (Ctrl is held).
pub fn snap(
    scene: &Scene,
    view: &View,
    pixel: DVec2,
    pick: &PickOptions,
    options: &SnapOptions,
    suspended: bool,
) -> Option<Snap> {
    if suspended {
        return None;
    }
    let mut pyramid = Pyramid::new(view, pixel, options.radius, pick.section.as_ref());
    let hits = curve_candidates(scene, &mut pyramid, pick, CURVES);
    let mut found: Vec<Snap> = Vec::new();
    let mut offer = |kind: SnapKind, point: DVec3, on: Vec<(CurveRef, f64)>, gap: f64| {
        let Some(at) = view.project(point) else { return };
        let distance = at.pixel.distance(pixel);
        let cut = pick.section.is_some_and(|s| s.height(point) > 0.0);
        if options.allows(kind) && distance <= options.radius && !cut {
            found.push(Snap { kind, point, pixel: at.pixel, distance, on, gap });
        }
    };
    for (k, hit) in hits.iter().enumerate() {
        let Target::Curve { curve, t } = hit.target else { continue };
        let Some(geometry) = scene.curve_item(&curve).map(|item| &item.geometry) else { continue };
        let Some([start, end]) = geometry.curve_domain(&curve) else { continue };
        let at = |t: f64| geometry.curve_jet(&curve, t).map(|jet| jet[0]);
        for t in [start, end] {
            if let Some(p) = at(t) {
                offer(SnapKind::End, p, vec![(curve, t)], 0.0);
            }
        }
        for t in geometry.curve_knots(&curve) {
            if let Some(p) = at(t) {
                offer(SnapKind::Knot, p, vec![(curve, t)], 0.0);
            }
        }
        if options.allows(SnapKind::Middle)
            && let Some(exact) = geometry.curve(&curve)
        {
            let arc = ArcLength::new(&exact);
            let t = arc.parameter_at(&exact, 0.5 * arc.length());
            offer(SnapKind::Middle, exact.eval(t), vec![(curve, t)], 0.0);
        }
        offer(SnapKind::OnCurve, hit.point, vec![(curve, t)], 0.0);
        for other in &hits[k + 1..] {
            if let Some((p, on, gap)) = corner(scene, hit, other, options.joining_tol) {
                offer(SnapKind::Corner, p, on, gap);
            }
        }
    }
    found.sort_by(|a, b| a.kind.cmp(&b.kind).then(a.distance.total_cmp(&b.distance)));
    let cover = Cover::new(scene, &pyramid, pick);
    found.into_iter().find(|s| !cover.hides(s.point))
}

type Corner = (DVec3, Vec<(CurveRef, f64)>, f64);

/// Where two curves come nearest to each other near the places of two hits, when that is within the tolerance.
fn corner(scene: &Scene, a: &PickHit, b: &PickHit, tol: f64) -> Option<Corner> {
    let (Target::Curve { curve: ca, t: ta }, Target::Curve { curve: cb, t: tb }) = (a.target, b.target) else {
        return None;
    };
    let ga = &scene.curve_item(&ca)?.geometry;
    let gb = &scene.curve_item(&cb)?.geometry;
    let [da, db] = [ga.curve_domain(&ca)?, gb.curve_domain(&cb)?];
    let [ta, tb] = nearest_places(|t| ga.curve_jet(&ca, t), |t| gb.curve_jet(&cb, t), [da, db], [ta, tb])?;
    let (pa, pb) = (ga.curve_jet(&ca, ta)?[0], gb.curve_jet(&cb, tb)?[0]);
    let gap = pa.distance(pb);
    // Curves that run beside each other have a nearest place everywhere: no corner unless one of them ends there.
    let [va, vb] = [ga.curve_jet(&ca, ta)?[1], gb.curve_jet(&cb, tb)?[1]];
    let crossing = va.cross(vb).length() > 0.1 * va.length() * vb.length();
    let ends = (da.contains(&ta) || db.contains(&tb)) && !(va == DVec3::ZERO || vb == DVec3::ZERO);
    (gap <= tol && (crossing || ends)).then(|| (pa, vec![(ca, ta), (cb, tb)], gap))
}

/// Newton's iteration (Gauss-Newton where the curvature is the wrong way) for the places where two curves are nearest to
/// each other, within their domains.
pub(super) fn nearest_places(
    a: impl Fn(f64) -> Option<[DVec3; 3]>,
    b: impl Fn(f64) -> Option<[DVec3; 3]>,
    domains: [[f64; 2]; 2],
    start: [f64; 2],
) -> Option<[f64; 2]> {
    let [mut s, mut t] = start;
    let clamp = |x: f64, k: usize| x.clamp(domains[k][0], domains[k][1]);
    for _ in 0..30 {
        let ([p, d, dd], [q, e, ee]) = (a(s)?, b(t)?);
        let r = p - q;
        let (gs, gt) = (r.dot(d), -r.dot(e));
        let (mut hss, hst, mut htt) = (d.dot(d) + r.dot(dd), -d.dot(e), e.dot(e) - r.dot(ee));
        if !(hss > 0.0 && htt > 0.0 && hss * htt - hst * hst > 1e-9 * hss * htt) {
            (hss, htt) = (d.dot(d) * (1.0 + 1e-9), e.dot(e) * (1.0 + 1e-9));
        }
        let det = hss * htt - hst * hst;
        if !(det.is_finite() && hss > 0.0 && htt > 0.0) {
            return None;
        }
        // A parameter at its bound stays there while the gradient presses outwards.
        let held = |x: f64, g: f64, k: usize| (x <= domains[k][0] && g > 0.0) || (x >= domains[k][1] && g < 0.0);
        let (ds, dt) = match (held(s, gs, 0), held(t, gt, 1)) {
            (true, true) => break,
            (true, false) => (0.0, -gt / htt),
            (false, true) => (-gs / hss, 0.0),
            (false, false) if det > 1e-12 * hss * htt => ((-gs * htt + gt * hst) / det, (-gt * hss + gs * hst) / det),
            (false, false) => (-gs / hss, 0.0),
        };
        let (next_s, next_t) = (clamp(s + ds, 0), clamp(t + dt, 1));
        let moved =
            (next_s - s).abs() / (domains[0][1] - domains[0][0]) + (next_t - t).abs() / (domains[1][1] - domains[1][0]);
        (s, t) = (next_s, next_t);
        if moved < 1e-15 {
            break;
        }
    }
    Some([s, t])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::geom::{Curve, Knots, Surface};
    use crate::model::document::{Document, EntityId, Shape, Unit};
    use crate::view::camera::{Axis, Camera, Projection};
    use crate::view::viewport::Viewport;

    fn look(curves: Vec<Curve>, cover: Option<f64>) -> (Scene, View) {
        let mut document = Document::new(Unit::Millimetre);
        for curve in curves {
            document.add("c", Shape::Curve(Arc::new(curve)), None);
        }
        if let Some(z) = cover {
            let c = |x: f64, y: f64| DVec3::new(x, y, z);
            let sheet = Surface::bilinear([c(-9.0, -9.0), c(9.0, -9.0), c(-9.0, 9.0), c(9.0, 9.0)]).unwrap();
            document.add("s", Shape::Surface(Arc::new(sheet)), None);
        }
        let mut scene = Scene::default();
        scene.sync(&document);
        let screen = Viewport::new(900.0, 700.0);
        let mut camera = Camera { projection: Projection::Orthographic, distance: 12.0, ..Camera::default() };
        camera.look_along(Axis::Top);
        let view = View::new(&camera, screen, &scene.bounds());
        scene.refine(&view);
        (scene, view)
    }

    fn line(a: [f64; 2], b: [f64; 2]) -> Curve {
        Curve::segment(DVec3::new(a[0], a[1], 0.0), DVec3::new(b[0], b[1], 0.0)).unwrap()
    }

    fn at(scene: &Scene, view: &View, p: DVec3, off: DVec2) -> Option<Snap> {
        let pixel = view.project(p).unwrap().pixel + off;
        snap(scene, view, pixel, &PickOptions::default(), &SnapOptions::new(1e-3), false)
    }

    #[test]
    fn every_kind_is_found_where_it_is() {
        let breaks = [0.0, 1.0, 3.0, 4.0];
        let bent = Curve::new(
            Knots::clamped(1, &breaks, 1).unwrap(),
            vec![
                DVec3::new(-2.0, 1.0, 0.0),
                DVec3::new(-1.0, 1.0, 0.0),
                DVec3::Y * 1.0 + DVec3::X,
                DVec3::new(2.0, 2.0, 0.0),
            ],
            None,
        )
        .unwrap();
        let (scene, view) = look(vec![line([0.0, -2.0], [0.0, 0.7]), bent], None);
        let near = DVec2::new(3.0, 2.0);
        let kind = |p: [f64; 2]| at(&scene, &view, DVec3::new(p[0], p[1], 0.0), near).map(|s| (s.kind, s.point));
        assert_eq!(kind([0.0, 0.7]), Some((SnapKind::End, DVec3::new(0.0, 0.7, 0.0))));
        assert_eq!(kind([-1.0, 1.0]).map(|s| s.0), Some(SnapKind::Knot));
        let (what, p) = kind([0.0, -0.65]).unwrap();
        assert!(what == SnapKind::Middle && p.distance(DVec3::new(0.0, -0.65, 0.0)) < 1e-12);
        let (what, p) = kind([0.0, -1.5]).unwrap();
        assert!(what == SnapKind::OnCurve && p.x == 0.0);
        assert_eq!(kind([5.0, 0.0]), None);
    }

    #[test]
    fn two_curves_that_cross_within_the_tolerance_make_a_corner() {
        let mut across = line([-1.0, 0.25], [2.0, 0.25]);
        let tilted = across.transformed(&glam::DAffine3::from_translation(DVec3::Z * 5e-4));
        across = line([-1.0, 0.25], [2.0, 0.25]).transformed(&glam::DAffine3::from_translation(DVec3::Z * 5e-3));
        for (second, expected) in [(tilted, SnapKind::Corner), (across, SnapKind::OnCurve)] {
            let (scene, view) = look(vec![line([0.0, -1.0], [0.0, 1.6]), second], None);
            let found = at(&scene, &view, DVec3::new(0.0, 0.25, 0.0), DVec2::new(-4.0, 3.0)).unwrap();
            assert_eq!(found.kind, expected);
            if expected == SnapKind::Corner {
                assert!(found.point.truncate().distance(DVec2::new(0.0, 0.25)) < 1e-12);
                assert!((found.gap - 5e-4).abs() < 1e-12 && found.on.len() == 2);
            }
        }
    }

    #[test]
    fn parallel_curves_make_no_corner_but_meeting_ends_do() {
        let (scene, view) = look(vec![line([-2.0, 0.0], [2.0, 0.0]), line([-2.5, 4e-4], [2.5, 4e-4])], None);
        let found = at(&scene, &view, DVec3::new(0.7, 0.0, 0.0), DVec2::new(1.0, 1.0)).unwrap();
        assert_eq!(found.kind, SnapKind::OnCurve);
        let (scene, view) = look(vec![line([-2.0, 0.0], [0.0, 0.0]), line([0.0, 5e-4], [2.0, 0.0])], None);
        let found = at(&scene, &view, DVec3::ZERO, DVec2::new(1.0, 1.0)).unwrap();
        assert_eq!(found.kind, SnapKind::Corner, "two ends meet");
    }

    #[test]
    fn ctrl_suspends_and_kinds_can_be_turned_off() {
        let (scene, view) = look(vec![line([0.0, 0.0], [2.0, 0.0])], None);
        let pixel = view.project(DVec3::ZERO).unwrap().pixel;
        let pick = PickOptions::default();
        let mut options = SnapOptions::new(1e-3);
        assert_eq!(snap(&scene, &view, pixel, &pick, &options, true), None);
        options.on[SnapKind::End as usize] = false;
        assert_eq!(snap(&scene, &view, pixel, &pick, &options, false).map(|s| s.kind), Some(SnapKind::OnCurve));
        options.on = [false; 5];
        assert_eq!(snap(&scene, &view, pixel, &pick, &options, false), None);
    }

    #[test]
    fn what_is_covered_is_no_snap() {
        for (z, expected) in [(0.5, None), (-0.5, Some(EntityId(0)))] {
            let (scene, view) = look(vec![line([0.0, 0.0], [2.0, 0.0])], Some(z));
            let found = at(&scene, &view, DVec3::ZERO, DVec2::ZERO);
            assert_eq!(found.map(|s| s.on[0].0.entity()), expected);
        }
    }
}
