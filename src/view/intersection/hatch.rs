//! Hatching of coincident regions: lines at 45 degrees in the domain of the first surface, clipped to the region's loops.

use glam::{DVec2, DVec3};

use super::Found;
use crate::kernel::ssi::result::CurvePoint;
use crate::view::uv::hatching;

/// Hatch lines across a region.
const LINES: f64 = 24.0;
/// Parts of one hatch line, so that it follows the surface.
const PARTS: usize = 12;

/// The hatch lines of a coincident region on its first surface. Empty where the region runs over several patches of the
/// first side: its outline lies in no single domain and only the outline is drawn.
pub fn region(found: &Found, number: usize) -> Vec<Vec<DVec3>> {
    let first = found.result.regions.get(number).and_then(|r| r.boundary.first()?.first());
    let Some(surface) = first.map(|p| p.a) else { return Vec::new() };
    let (Some(loops), Some(surface)) = (loops_on(found, number, surface, 0), found.surface(surface)) else {
        return Vec::new();
    };
    let all = || loops.iter().flatten();
    let low = all().fold(DVec2::INFINITY, |m, &p| m.min(p));
    let size = all().fold(DVec2::NEG_INFINITY, |m, &p| m.max(p)) - low;
    if !(size.min_element() > 0.0 && size.is_finite()) {
        return Vec::new();
    }
    let unit: Vec<Vec<DVec2>> = loops.iter().map(|l| l.iter().map(|p| (p - low) / size).collect()).collect();
    hatching(&unit, std::f64::consts::SQRT_2 / LINES)
        .into_iter()
        .map(|[a, b]| {
            let at = |i: usize| low + a.lerp(b, i as f64 / PARTS as f64) * size;
            (0..=PARTS).map(|i| surface.eval(surface.clamped(at(i)))).collect()
        })
        .collect()
}

/// The loops of a region in the domain of a surface, where all of them lie there; `side` is 0 for the first parameters of
/// their points, 1 for the second.
pub fn loops_on(found: &Found, region: usize, surface: usize, side: usize) -> Option<Vec<Vec<DVec2>>> {
    let region = found.result.regions.get(region)?;
    let one = region.boundary.iter().flatten().all(|p| surface == if side == 0 { p.a } else { p.b });
    let at = |p: &CurvePoint| if side == 0 { p.uv } else { p.st };
    (one && !region.boundary.is_empty()).then(|| region.boundary.iter().map(|l| l.iter().map(at).collect()).collect())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::view::intersection::testing::{document, met, square};

    /// The total length of the hatch is the area over the distance of the lines.
    #[test]
    fn the_hatch_of_overlapping_squares_covers_what_they_share() {
        let a = square(DVec3::ZERO, DVec3::X, DVec3::Y);
        let b = square(DVec3::new(1.0, 1.0, 0.0), DVec3::X, DVec3::Y);
        let found = met(&document([a, b]));
        assert_eq!(found.result.regions.len(), 1);
        let lines = region(&found, 0);
        let length: f64 = lines.iter().map(|l| l[0].distance(l[PARTS])).sum();
        // They share a unit square; lines lie sqrt(2) / 24 apart.
        let expected = LINES / std::f64::consts::SQRT_2;
        assert!((length / expected - 1.0).abs() < 0.1, "{length} {expected}");
        assert!(lines.iter().flatten().all(|p| p.min_element() > -1e-6 && p.max_element() < 1.0 + 1e-6));
        assert!(region(&found, 3).is_empty());
    }
}
