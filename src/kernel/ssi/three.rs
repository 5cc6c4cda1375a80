//! The point of three bodies, by the auxiliary-plane method (HJR99 section 4 (18)-(26)) with the third tangent plane in
//! the place of the auxiliary one.
//!
//! The three tangent planes meet in a point x; each parameter pair then moves so that its surface point follows x in its
//! own plane. Converges quadratically where the planes meet at an angle, by halves where they have a line in common in the
//! limit (a curve that touches a surface); there the point along that line is good to the root of what is reached across.
//! One of the three may be a fixed plane, which cuts a curve of the other two. Cost: three evaluations a step, 3-5 steps.
//! Fails (`None`) where a plane is missing (no normal), where the three have no common point within `reach`, and where the
//! points do not come together within the domains.

use std::collections::HashMap;

use glam::{DMat3, DVec2, DVec3};

use crate::kernel::geom::Surface;
use crate::kernel::geom::closest::{Closed, closed_directions, into_domain};

/// The most steps.
const MOST: usize = 40;

/// Where a body is touched: the point, its unit normal, and the partials where it has parameters.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// The point.
    pub point: DVec3,
    /// The unit normal.
    pub normal: DVec3,
    /// The derivatives by both parameters; `None` for a plane.
    pub partials: Option<[DVec3; 2]>,
}

impl Touch {
    /// A surface at parameters; `None` where it has no normal.
    pub fn of(surface: &Surface, uv: DVec2) -> Option<Self> {
        let jet = surface.jet(uv, 1);
        Some(Self { point: jet.p(), normal: jet.normal()?, partials: Some([jet.u(), jet.v()]) })
    }

    /// How the parameters have to move so that the point follows `x` in the tangent plane ((22)-(26)).
    pub fn step_to(&self, x: DVec3) -> Option<DVec2> {
        let [u, v] = self.partials?;
        let delta = x - self.point;
        let (across_u, across_v) = (u.cross(self.normal), v.cross(self.normal));
        let step = DVec2::new(across_v.dot(delta) / across_v.dot(u), across_u.dot(delta) / across_u.dot(v));
        step.is_finite().then_some(step)
    }
}

/// Bodies with numbers.
pub trait Bodies: Sync {
    /// The tangent plane of a body at parameters; of triangles the plane of the one nearest to `near`.
    fn touch(&self, body: usize, uv: DVec2, near: DVec3) -> Option<Touch>;

    /// Parameters brought back into the domain, around where it is closed.
    fn settled(&self, body: usize, uv: DVec2) -> DVec2;

    /// The parameters of a point that was found; those it was found with, except where they only name a triangle.
    fn place(&self, body: usize, uv: DVec2, point: DVec3) -> DVec2 {
        let (_, _) = (body, point);
        uv
    }
}

/// Surfaces by their numbers.
pub struct Surfaces<'a> {
    of: HashMap<usize, (&'a Surface, Closed)>,
}

impl<'a> Surfaces<'a> {
    /// Of a list.
    pub fn new(list: impl IntoIterator<Item = (usize, &'a Surface)>) -> Self {
        Self { of: list.into_iter().map(|(n, s)| (n, (s, closed_directions(s)))).collect() }
    }
}

impl Bodies for Surfaces<'_> {
    fn touch(&self, body: usize, uv: DVec2, _near: DVec3) -> Option<Touch> {
        let (surface, _) = self.of.get(&body)?;
        Touch::of(surface, uv).or_else(|| {
            // At a pole the plane is that a little further in.
            let domain = surface.domain();
            let middle = DVec2::new(0.5 * (domain[0][0] + domain[0][1]), 0.5 * (domain[1][0] + domain[1][1]));
            Touch::of(surface, uv.lerp(middle, 1e-7)).map(|t| Touch { point: surface.eval(uv), ..t })
        })
    }

    fn settled(&self, body: usize, uv: DVec2) -> DVec2 {
        self.of.get(&body).map_or(uv, |(surface, closed)| into_domain(uv, surface.domain(), *closed))
    }
}

/// One of the three.
#[derive(Clone, Copy, Debug)]
pub enum On {
    /// A body, and the parameters to start from.
    Body(usize, DVec2),
    /// A fixed plane: a point and the unit normal.
    Plane(DVec3, DVec3),
}

/// A point of three.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// The point.
    pub xyz: DVec3,
    /// The parameters on each; zero for a plane.
    pub uv: [DVec2; 3],
    /// The largest distance of the three bodies' points from it.
    pub gap: f64,
}

/// How near points have to be, in model units.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// What rounding leaves of the distance of points that are one.
    pub rounding: f64,
    /// How far the point may be from where the search starts.
    pub reach: f64,
}

/// The point of three near `start`.
pub fn meet(bodies: &impl Bodies, on: [On; 3], start: DVec3, near: Near) -> Option<Met> {
    let mut uv = on.map(|on| if let On::Body(_, uv) = on { uv } else { DVec2::ZERO });
    let mut best: Option<Met> = None;
    let mut x = start;
    let mut stalled = 0;
    for _ in 0..MOST {
        let touch = |k: usize| match on[k] {
            On::Body(number, _) => bodies.touch(number, uv[k], x),
            On::Plane(point, normal) => Some(Touch { point, normal, partials: None }),
        };
        let touches = [touch(0)?, touch(1)?, touch(2)?];
        // Relative to the first point: far from the origin the planes' own offsets have no digits left.
        let origin = touches[0].point;
        let normals = touches.each_ref().map(|t| t.normal);
        let matrix = DMat3::from_cols(normals[0], normals[1], normals[2]).transpose();
        let own: Vec<DVec3> = touches.iter().filter(|t| t.partials.is_some()).map(|t| t.point).collect();
        let middle = if own.is_empty() { x } else { own.iter().sum::<DVec3>() / own.len() as f64 };
        let off = |t: &Touch| match t.partials {
            Some(_) => t.point.distance(middle),
            None => t.normal.dot(middle - t.point).abs(),
        };
        let gap = touches.iter().map(off).fold(0.0, f64::max);
        if middle.distance(start) > near.reach {
            break;
        }
        let before = best.map_or(f64::INFINITY, |b| b.gap);
        if gap < before {
            best = Some(Met { xyz: middle, uv, gap });
        }
        stalled = if gap < 0.5 * before { 0 } else { stalled + 1 };
        if !(matrix.determinant().abs() > 1e-14) || (gap <= near.rounding && stalled > 0) || stalled > 4 {
            break;
        }
        let offsets = touches.each_ref().map(|t| t.normal.dot(t.point - origin));
        let step = matrix.inverse() * DVec3::from_array(offsets);
        x = origin + step;
        if !(x.distance(start) <= 2.0 * near.reach) {
            break;
        }
        for k in 0..3 {
            if let (On::Body(number, _), Some(step)) = (on[k], touches[k].step_to(x)) {
                uv[k] = bodies.settled(number, uv[k] + step);
            }
        }
    }
    best.filter(|b| b.gap <= near.rounding)
}

/// The height of a point over a body, along its normal at the foot, and the foot's parameters; `None` where the foot leaves
/// the domain or does not settle.
pub fn height(bodies: &impl Bodies, body: usize, start: DVec2, p: DVec3, rounding: f64) -> Option<(f64, DVec2)> {
    let mut uv = bodies.settled(body, start);
    for _ in 0..MOST {
        let touch = bodies.touch(body, uv, p)?;
        let above = (p - touch.point).dot(touch.normal);
        let Some(step) = touch.step_to(p) else { return touch.partials.is_none().then_some((above, uv)) };
        let beside = (p - touch.point - touch.normal * above).length();
        if beside <= rounding {
            return Some((above, uv));
        }
        let next = bodies.settled(body, uv + step);
        if next == uv {
            return (beside <= 16.0 * rounding).then_some((above, uv));
        }
        uv = next;
    }
    None
}
