//! Measuring between two picked places: how far they are apart, how far the first is from what the second lies on, the
//! angle there, and the gap between two curves.
//!
//! The gap of two curves is the least and the largest distance of a point of either from the other. Distances to a
//! curve are global ([`closest_on_curve`]); which point to ask is found on [`SAMPLES`] points of each curve and
//! refined by thirds of the interval around the best, so a place narrower than a sample step can be missed. Cost:
//! some milliseconds. Where a curve or a surface has gone from the scene, that part is left out.

use glam::DVec3;

use super::display::{CurveRef, Geometry};
use super::pick::Target;
use super::scene::Scene;
use crate::kernel::geom::Curve;
use crate::kernel::geom::closest::{closed_directions, closest_from};
use crate::kernel::geom::closest_curve::closest_on_curve;
use crate::model::document::EntityId;

/// Points of each curve that are asked first.
const SAMPLES: usize = 128;
/// Halvings of the interval around the best of them.
const HALVINGS: usize = 40;

/// A picked place: a point, and what it lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where it is.
    pub point: DVec3,
    /// What it was picked on; nothing for a free point.
    pub on: Option<Target>,
}

/// Two points and their distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// From here.
    pub from: DVec3,
    /// To here.
    pub to: DVec3,
}

impl Span {
    /// How far the points are apart.
    pub fn length(&self) -> f64 {
        self.from.distance(self.to)
    }
}

/// What was measured between two places.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The places themselves.
    pub places: Span,
    /// From the first place to the nearest point of the surface that the second lies on, where that is another one.
    pub to_surface: Option<Span>,
    /// The least and the largest distance between the two curves that the places lie on.
    pub gap: Option<[Span; 2]>,
    /// The angle between the normals of the two surfaces, or the tangents of the two curves, at the places: degrees,
    /// 0..=90.
    pub angle: Option<f64>,
}

/// Measures between two places.
pub fn measure(scene: &Scene, first: &Place, second: &Place) -> Measurement {
    let curves = [first, second].map(|place| match place.on {
        Some(Target::Curve { curve, t }) => Some((curve, t)),
        _ => None,
    });
    let surfaces = [first, second].map(|place| match place.on {
        Some(Target::Surface { entity, .. }) => Some(entity),
        _ => None,
    });
    let to_surface = surfaces[1].filter(|of| surfaces[0] != Some(*of)).and_then(|of| {
        let to = nearest_on(scene, of, first.point)?;
        Some(Span { from: first.point, to })
    });
    let gap = match curves {
        [Some((a, _)), Some((b, _))] if a != b => curve(scene, &a).zip(curve(scene, &b)).map(|(a, b)| gap(&a, &b)),
        _ => None,
    };
    let direction = |k: usize, place: &Place| {
        curves[k].and_then(|(curve, t)| Some(scene.curve_item(&curve)?.geometry.curve_jet(&curve, t)?[1])).or_else(
            || {
                let Some(Target::Surface { entity, uv }) = place.on else { return None };
                scene.item(entity)?.geometry.surface()?.jet(uv, 1).normal()
            },
        )
    };
    // A tangent and a normal are no pair.
    let alike = curves.iter().all(Option::is_some) || surfaces.iter().all(Option::is_some);
    let angle = direction(0, first).zip(direction(1, second)).filter(|_| alike).and_then(|(a, b)| {
        let angle = a.cross(b).length().atan2(a.dot(b).abs()).to_degrees();
        (a.length() > 0.0 && b.length() > 0.0).then_some(angle)
    });
    Measurement { places: Span { from: first.point, to: second.point }, to_surface, gap, angle }
}

fn curve(scene: &Scene, curve: &CurveRef) -> Option<Curve> {
    scene.curve_item(curve)?.geometry.curve(curve)
}

/// The point of an entity's surface or mesh nearest to `p`.
fn nearest_on(scene: &Scene, entity: EntityId, p: DVec3) -> Option<DVec3> {
    let item = scene.item(entity)?;
    let display = item.display.as_ref()?;
    let near = display.tree.nearest(p, f64::INFINITY)?;
    let Some(surface) = item.geometry.surface() else { return Some(near.point) };
    let corners = display.mesh.triangles.get(near.triangle as usize)?;
    let start = corners.iter().zip(near.barycentric.to_array()).map(|(&k, w)| display.mesh.uv[k as usize] * w).sum();
    let foot = closest_from(surface, closed_directions(surface), p, start);
    // On a trimmed face the nearest point may be on an edge, which the triangles follow.
    let outside = matches!(&item.geometry, Geometry::Face { face, whole: false } if !face.contains(foot.uv));
    Some(if outside { near.point } else { foot.point })
}

/// The least and the largest distance between two curves.
pub fn gap(a: &Curve, b: &Curve) -> [Span; 2] {
    let [one, other] = [extremes(a, b), extremes(b, a)];
    let turned = other.map(|span| Span { from: span.to, to: span.from });
    [
        if one[0].length() <= turned[0].length() { one[0] } else { turned[0] },
        if one[1].length() >= turned[1].length() { one[1] } else { turned[1] },
    ]
}

/// Of the distances of points of `a` from `b`, the least and the largest.
fn extremes(a: &Curve, b: &Curve) -> [Span; 2] {
    let [start, end] = a.domain();
    let at = |t: f64| {
        let from = a.eval(t);
        Span { from, to: closest_on_curve(b, from).point }
    };
    let parameter = |k: usize| start + (end - start) * k as f64 / SAMPLES as f64;
    let spans: Vec<Span> = (0..=SAMPLES).map(|k| at(parameter(k))).collect();
    let best = |worth: &dyn Fn(&Span) -> f64| {
        let mut best = 0;
        for k in 1..=SAMPLES {
            if worth(&spans[k]) > worth(&spans[best]) {
                best = k;
            }
        }
        // Golden sections would save evaluations; thirds need no care.
        let (mut low, mut high) = (parameter(best.saturating_sub(1)), parameter((best + 1).min(SAMPLES)));
        let mut found = spans[best];
        for _ in 0..HALVINGS {
            let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            let [l, r] = [at(left), at(right)];
            for span in [l, r] {
                if worth(&span) > worth(&found) {
                    found = span;
                }
            }
            if worth(&l) < worth(&r) { low = left } else { high = right }
        }
        found
    };
    [best(&|s| -s.length()), best(&|s| s.length())]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec2;

    use super::*;
    use crate::kernel::geom::{Side, Surface};
    use crate::model::document::{Document, Shape, Unit};
    use crate::view::camera::Camera;
    use crate::view::viewport::{View, Viewport};

    #[test]
    fn the_gap_of_two_segments_is_that_of_plane_geometry() {
        let a = Curve::segment(DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0)).unwrap();
        // It rises from 1 to 3 above the first and ends above its inside.
        let b = Curve::segment(DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, 3.0, 0.0)).unwrap();
        let [least, largest] = gap(&a, &b);
        assert!((least.length() - 1.0).abs() < 1e-9, "{least:?}");
        // (4, 0) is 2 sqrt 2 from the line and its foot (2, 2) is inside; (3, 3) is 3 above.
        assert!((largest.length() - 3.0).abs() < 1e-9, "{largest:?}");
        assert_eq!(
            gap(&b, &a).map(|s| (s.length() * 1e9).round()),
            [least, largest].map(|s| (s.length() * 1e9).round())
        );
    }

    #[test]
    fn the_widest_place_between_two_samples_is_found() {
        // Widest at a third, which no sample of 128 hits.
        let a = Curve::segment(DVec3::ZERO, DVec3::X).unwrap();
        let b = Curve::polyline(&[DVec3::ZERO, DVec3::new(1.0 / 3.0, 0.01, 0.0), DVec3::X]).unwrap();
        let [least, largest] = gap(&a, &b);
        assert!(least.length() < 1e-12);
        assert!((largest.length() - 0.01).abs() < 1e-9, "{}", largest.length());
    }

    /// Two parallel planes one apart and one that stands at right angles to them.
    fn scene() -> Scene {
        let mut document = Document::new(Unit::Millimetre);
        let plane = |o: DVec3, u: DVec3, v: DVec3| {
            Shape::Surface(Arc::new(Surface::bilinear([o, o + u, o + v, o + u + v]).unwrap()))
        };
        document.add("floor", plane(DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0), None);
        document.add("ceiling", plane(DVec3::new(1.0, 1.0, 1.0), DVec3::X * 2.0, DVec3::Y * 2.0), None);
        document.add("wall", plane(DVec3::new(0.0, 5.0, 0.0), DVec3::X * 4.0, DVec3::Z * 4.0), None);
        let mut scene = Scene::default();
        scene.sync(&document);
        let view = View::new(&Camera::default(), Viewport::new(200.0, 200.0), &scene.bounds());
        scene.refine(&view);
        scene
    }

    #[test]
    fn places_on_surfaces_give_distance_foot_and_angle() {
        let scene = scene();
        let id = |k: usize| scene.items()[k].id();
        let on = |k: usize, uv: DVec2| {
            let point = scene.items()[k].geometry.surface().unwrap().eval(uv);
            Place { point, on: Some(Target::Surface { entity: id(k), uv }) }
        };
        let m = measure(&scene, &on(1, DVec2::new(0.5, 0.5)), &on(0, DVec2::ZERO));
        assert!((m.places.length() - 3.0).abs() < 1e-12, "{m:?}");
        assert!((m.to_surface.unwrap().length() - 1.0).abs() < 1e-12);
        assert!(m.angle.unwrap() < 1e-9 && m.gap.is_none());
        let m = measure(&scene, &on(1, DVec2::new(0.5, 0.5)), &on(2, DVec2::ZERO));
        assert!((m.angle.unwrap() - 90.0).abs() < 1e-9);
        assert!((m.to_surface.unwrap().length() - 3.0).abs() < 1e-12);
        let m = measure(&scene, &on(0, DVec2::ZERO), &on(0, DVec2::ONE));
        assert!(m.to_surface.is_none(), "within one surface there is only the distance: {m:?}");
    }

    #[test]
    fn places_on_borders_give_the_gap_between_them() {
        let scene = scene();
        let on = |k: usize, side: Side, t: f64| {
            let curve = CurveRef::Border(scene.items()[k].id(), side);
            let point = scene.items()[k].geometry.curve_jet(&curve, t).unwrap()[0];
            Place { point, on: Some(Target::Curve { curve, t }) }
        };
        let m = measure(&scene, &on(0, Side::VMax, 0.3), &on(2, Side::VMin, 0.6));
        let [least, largest] = m.gap.unwrap();
        assert!((least.length() - 1.0).abs() < 1e-9 && (largest.length() - 1.0).abs() < 1e-9);
        assert!(m.angle.unwrap() < 1e-9);
    }
}
