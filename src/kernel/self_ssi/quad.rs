//! Miter quadrangles (thesis 4.2.1): a quadrangle in the domain around a miter point whose image lies in a ball of a
//! given radius.
//!
//! Along the null direction the surface moves with the square of the distance, across it linearly: the sides are
//! sqrt(eps) and eps long in order, and shrink until S is proved to stay in the ball by bounds of its second
//! derivatives over the quadrangle. Half of the radius is left for each of the two directions.

use glam::{DVec2, DVec3};

use super::hull::Rect;
use super::miter::MiterPoint;
use super::sheet::Sheet;

/// The corners of a quadrangle around a miter point whose image lies within `radius` of it (in the space of size 1).
/// `None` where rounding forbids so small a ball.
pub(crate) fn quadrangle(sheet: &Sheet, miter: &MiterPoint, radius: f64) -> Option<[DVec2; 4]> {
    if radius <= 4.0 * sheet.rounding {
        return None;
    }
    let (e, x) = (miter.null(), miter.null().perp());
    let s_x = miter.first[0] * x.x + miter.first[1] * x.y;
    let mix =
        |d: &[DVec3; 3], a: DVec2, b: DVec2| d[0] * (a.x * b.x) + d[1] * (a.x * b.y + a.y * b.x) + d[2] * (a.y * b.y);
    let bend = mix(&miter.second, e, e).length();
    let mut long = (radius / bend.max(1e-6)).sqrt().min(0.05);
    let mut short = (0.5 * radius / s_x.length().max(1e-6)).min(0.05);
    for _ in 0..40 {
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
            .map(|[a, b]: [f64; 2]| miter.at + e * (long * a) + x * (short * b));
        let low = corners.iter().fold(DVec2::INFINITY, |m, &c| m.min(c));
        let high = corners.iter().fold(DVec2::NEG_INFINITY, |m, &c| m.max(c));
        let second = sheet.second_hull(&Rect::new(low, high));
        let largest = second.0.map(|points| points.iter().map(|p| p.length()).fold(0.0, f64::max));
        // |D^2 S (h, h)| for h = a e + b x, and the first-order part across (the null direction has none).
        let size = |a: DVec2, b: DVec2| {
            (a.x * b.x).abs() * largest[0] + (a.x * b.y + a.y * b.x).abs() * largest[1] + (a.y * b.y).abs() * largest[2]
        };
        let null = miter.first[0] * e.x + miter.first[1] * e.y;
        let reach = s_x.length() * short
            + null.length() * long
            + 0.5 * (size(e, e) * long * long + 2.0 * size(e, x) * long * short + size(x, x) * short * short);
        if reach <= radius {
            return Some(corners.map(|c| clip(sheet, c)));
        }
        let shrink = (0.9 * radius / reach).clamp(0.3, 0.95);
        long *= shrink.sqrt();
        short *= shrink;
    }
    None
}

/// A corner moved to the nearest point of the domain.
fn clip(sheet: &Sheet, c: DVec2) -> DVec2 {
    let one = |d: usize, t: f64| if sheet.periodic[d] { t } else { t.clamp(0.0, 1.0) };
    DVec2::new(one(0, c.x), one(1, c.y))
}
