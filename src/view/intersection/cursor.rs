//! The cursor on a curve: one place that is a point in space and a point in two domains at once.

use glam::{DVec2, DVec3};

use super::{Found, Item, place};
use crate::kernel::ssi::result::CurvePoint;
use crate::view::viewport::View;

/// A place on a curve of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnCurve {
    /// The curve's number.
    pub curve: usize,
    /// The number of the point before, plus the fraction of the way to the next.
    pub at: f64,
}

impl OnCurve {
    /// The point there: between two points that lie on the same two surfaces, linear in all coordinates; where the curve
    /// changes patches or crosses a seam, the nearer of the two.
    pub fn point(&self, found: &Found) -> Option<CurvePoint> {
        let points = &found.result.curves.get(self.curve)?.points;
        let k = (self.at.max(0.0) as usize).min(points.len().checked_sub(1)?);
        let here = points[k];
        let (Some(next), f) = (points.get(k + 1), self.at - k as f64) else { return Some(here) };
        if !(found.joined(&here, next, 0) && found.joined(&here, next, 1)) {
            return Some(if f < 0.5 { here } else { *next });
        }
        let (uv, st) = (here.uv.lerp(next.uv, f), here.st.lerp(next.st, f));
        Some(CurvePoint { xyz: here.xyz.lerp(next.xyz, f), uv, st, ..here })
    }

    /// The unit direction of the curve there.
    pub fn direction(&self, found: &Found) -> Option<DVec3> {
        let points = &found.result.curves.get(self.curve)?.points;
        let k = (self.at.max(0.0) as usize).min(points.len().checked_sub(2)?);
        // Points repeat where patches meet: the next that differs.
        let next = points[k + 1..].iter().find(|p| p.xyz != points[k].xyz)?;
        (next.xyz - points[k].xyz).try_normalize()
    }

    /// The place at a fraction (0 to 1) of the length of a curve.
    pub fn at_fraction(found: &Found, curve: usize, fraction: f64) -> Option<Self> {
        let points = &found.result.curves.get(curve)?.points;
        let steps: Vec<f64> = points.windows(2).map(|p| p[0].xyz.distance(p[1].xyz)).collect();
        let total: f64 = steps.iter().sum();
        let mut left = fraction.clamp(0.0, 1.0) * total;
        for (k, step) in steps.iter().enumerate() {
            if left <= *step && *step > 0.0 {
                return Some(Self { curve, at: k as f64 + left / step });
            }
            left -= step;
        }
        Some(Self { curve, at: points.len().checked_sub(1)? as f64 })
    }

    /// The fraction of the length of its curve.
    pub fn fraction(&self, found: &Found) -> f64 {
        let Some(curve) = found.result.curves.get(self.curve) else { return 0.0 };
        let (mut before, mut total) = (0.0, 0.0);
        for (k, p) in curve.points.windows(2).enumerate() {
            let step = p[0].xyz.distance(p[1].xyz);
            total += step;
            before += step * (self.at - k as f64).clamp(0.0, 1.0);
        }
        if total > 0.0 { before / total } else { 0.0 }
    }
}

/// What of a result is under a pixel, within `radius` pixels: points first, then curves; and where on the curve.
pub fn under(found: &Found, view: &View, pixel: DVec2, radius: f64) -> Option<(Item, Option<OnCurve>)> {
    let r = &found.result;
    let points = (place::distinct(&r.junctions).map(|(k, j)| (Item::Junction(k), j.xyz)))
        .chain(r.miters.iter().enumerate().map(|(k, m)| (Item::Miter(k), m.xyz)));
    let near = points
        .filter_map(|(item, p)| Some((view.project(p)?.pixel.distance(pixel), item)))
        .filter(|(d, _)| *d <= radius)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, item)) = near {
        return Some((item, None));
    }
    let curve = nearest(found, pixel, |p| view.project(p.xyz).map(|at| at.pixel));
    if let Some((_, on)) = curve.filter(|(d, _)| *d <= radius) {
        return Some((Item::Curve(on.curve), Some(on)));
    }
    let open = (0..r.unresolved.len()).map(Item::Unresolved).filter_map(|item| {
        let seen: Vec<DVec2> = found.points(item).iter().filter_map(|p| Some(view.project(*p)?.pixel)).collect();
        let d = seen.windows(2).map(|s| to_segment(pixel, s[0], s[1]).0).fold(f64::INFINITY, f64::min);
        (d <= radius).then_some((d, item))
    });
    open.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, item)| (item, None))
}

/// The place whose preimage on a surface is nearest to a parameter point; `pixels` says how large one unit of u and of v
/// is. Also which of the two preimages it is: 0 for `a`, 1 for `b` (of a self-intersection both are on one surface).
pub fn nearest_uv(found: &Found, number: usize, uv: DVec2, pixels: DVec2) -> Option<(f64, OnCurve, usize)> {
    let of = |side: usize| {
        nearest(found, uv * pixels, |p| {
            let (on, at) = if side == 0 { (p.a, p.uv) } else { (p.b, p.st) };
            (on == number).then_some(at * pixels)
        })
        .map(|(d, on)| (d, on, side))
    };
    [of(0), of(1)].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The place on any curve nearest to `to` in the plane that `map` takes points to.
fn nearest(found: &Found, to: DVec2, map: impl Fn(&CurvePoint) -> Option<DVec2>) -> Option<(f64, OnCurve)> {
    let mut best: Option<(f64, OnCurve)> = None;
    for (curve, c) in found.result.curves.iter().enumerate() {
        let mut last: Option<(DVec2, &CurvePoint)> = None;
        for (k, p) in c.points.iter().enumerate() {
            let here = map(p);
            if let (Some((a, before)), Some(b)) = (last, here)
                && found.joined(before, p, 0)
                && found.joined(before, p, 1)
            {
                let (d, f) = to_segment(to, a, b);
                if best.is_none_or(|(least, _)| d < least) {
                    best = Some((d, OnCurve { curve, at: k as f64 - 1.0 + f }));
                }
            }
            last = here.map(|h| (h, p));
        }
    }
    best
}

/// The distance of a point from a segment, and the fraction at which it is nearest.
fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> (f64, f64) {
    let d = b - a;
    let f = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    (p.distance(a + d * f), f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::camera::Camera;
    use crate::view::intersection::testing::{met, two_planes};
    use crate::view::viewport::Viewport;

    #[test]
    fn half_way_is_the_middle_in_space_and_in_both_domains() {
        let found = met(&two_planes());
        let middle = OnCurve::at_fraction(&found, 0, 0.5).unwrap();
        let p = middle.point(&found).unwrap();
        assert!(p.xyz.length() < 1e-12);
        // Each square's middle is the middle of its domain.
        for (number, at) in [(p.a, p.uv), (p.b, p.st)] {
            let surface = found.surface(number).unwrap();
            assert!(surface.eval(at).distance(p.xyz) < 1e-12);
        }
        assert!((middle.fraction(&found) - 0.5).abs() < 1e-12);
        assert!(middle.direction(&found).unwrap().dot(DVec3::X).abs() > 1.0 - 1e-12);
        assert!(OnCurve { curve: 5, at: 0.0 }.point(&found).is_none());
    }

    #[test]
    fn a_point_on_one_preimage_finds_its_partner() {
        let found = met(&two_planes());
        let truth = OnCurve::at_fraction(&found, 0, 0.3).unwrap().point(&found).unwrap();
        for (number, uv) in [(truth.a, truth.uv), (truth.b, truth.st)] {
            let (d, on, side) = nearest_uv(&found, number, uv, DVec2::splat(300.0)).unwrap();
            let p = on.point(&found).unwrap();
            assert!(d < 1e-9 && p.xyz.distance(truth.xyz) < 1e-9);
            assert_eq!(side, usize::from(number == truth.b));
        }
        assert!(nearest_uv(&found, 9, truth.uv, DVec2::ONE).is_none());
    }

    #[test]
    fn what_is_under_the_pixel_is_the_curve_within_the_radius() {
        let found = met(&two_planes());
        let mut camera = Camera::default();
        let bounds = found.bounds(Item::Curve(0), 4.0).unwrap();
        camera.frame(&bounds, Viewport::new(800.0, 600.0));
        let view = View::new(&camera, Viewport::new(800.0, 600.0), &bounds);
        let at = view.project(DVec3::X * 0.5).unwrap().pixel;
        let (item, on) = under(&found, &view, at + DVec2::splat(2.0), 8.0).unwrap();
        assert_eq!(item, Item::Curve(0));
        assert!(on.unwrap().point(&found).unwrap().xyz.distance(DVec3::X * 0.5) < 0.1);
        assert!(under(&found, &view, at + DVec2::splat(90.0), 8.0).is_none());
    }
}
