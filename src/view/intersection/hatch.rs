//! Hatching of coincident regions: lines at 45 degrees in the domain of the first surface, clipped to the region's loops.
//!
//! Where a region runs over several patches of a side, its outline lies in no single domain. There the lines of every patch
//! are cut where they leave the other side: a place belongs to the region when the other side passes within the
//! region's distance of it ([`over_patches`]). Cost: one closest point for each of some thousand samples, on a worker.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Found;
use crate::kernel::geom::{Aabb, Surface};
use crate::kernel::job::Job;
use crate::kernel::mesh::surface_set::{Scratch, SurfaceSet};
use crate::kernel::ssi::result::CurvePoint;
use crate::view::uv::hatching;

/// Hatch lines across a region.
const LINES: f64 = 24.0;
/// Parts of one hatch line, so that it follows the surface.
const PARTS: usize = 12;

/// Samples of one line of a patch; where the region ends between two of them is found by halving.
const SAMPLES: usize = 48;
const HALVINGS: usize = 10;

/// The hatch lines of a region on one patch, where its side has several.
#[derive(Clone, Debug, PartialEq)]
pub struct Hatch {
    /// The number of the patch.
    pub number: usize,
    /// Whether it is of the first side (0) or of the second (1).
    pub side: usize,
    /// Lines in its parameters.
    pub lines: Vec<Vec<DVec2>>,
}

/// The hatch lines of a coincident region on its first side.
pub fn region(found: &Found, number: usize) -> Vec<Vec<DVec3>> {
    let first = found.result.regions.get(number).and_then(|r| r.boundary.first()?.first());
    let Some(surface) = first.map(|p| p.a) else { return Vec::new() };
    let (Some(loops), Some(surface)) = (loops_on(found, number, surface, 0), found.surface(surface)) else {
        let patches = found.hatches.get(number).into_iter().flatten().filter(|h| h.side == 0);
        let lines = patches.filter_map(|h| Some((found.surface(h.number)?, &h.lines)));
        return lines.flat_map(|(s, lines)| lines.iter().map(|l| l.iter().map(|&uv| s.eval(uv)).collect())).collect();
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

/// The hatch lines of a region on all patches of the sides that it has several of; `sides` are the bodies that took part.
pub fn over_patches(found: &Found, number: usize, sides: [&[usize]; 2], job: &Job) -> Vec<Hatch> {
    let Some(of) = found.result.regions.get(number) else { return Vec::new() };
    let Some(first) = of.boundary.first().and_then(|l| l.first()) else { return Vec::new() };
    let around = Aabb::of(of.boundary.iter().flatten().map(|p| p.xyz)).grown(of.max_distance + found.result.tol);
    let limit = of.max_distance + found.result.tol;
    let near = |side: usize| -> Vec<(usize, &Arc<Surface>)> {
        let all = sides[side].iter().filter_map(|&n| Some((n, found.surface(n)?)));
        all.filter(|(_, s)| s.bounds().overlaps(&around)).collect()
    };
    let mut out = Vec::new();
    for side in 0..2 {
        let one = if side == 0 { first.a } else { first.b };
        if loops_on(found, number, one, side).is_some() {
            // One patch: the loops themselves are hatched.
            continue;
        }
        let sets: Vec<(usize, SurfaceSet)> = near(1 - side)
            .into_iter()
            .map(|(n, s)| (n, SurfaceSet::new(vec![(n, Arc::clone(s))], 1e-3 * s.bounds().diagonal(), job)))
            .collect();
        let mut scratch = Scratch::default();
        for (patch, surface) in near(side) {
            if job.is_cancelled() {
                return out;
            }
            let mut inside = |uv: DVec2| {
                let p = surface.eval(uv);
                let others = sets.iter().filter(|(n, _)| *n != patch);
                around.contains(p) && others.into_iter().any(|(_, set)| set.closest(p, limit, &mut scratch).is_some())
            };
            let share = surface.bounds().diagonal() / around.diagonal();
            let lines = patch_lines(surface, (LINES * share).clamp(4.0, LINES), &mut inside);
            if !lines.is_empty() {
                out.push(Hatch { number: patch, side, lines });
            }
        }
    }
    out
}

/// The parts of about `count` lines over a whole domain that lie inside.
fn patch_lines(surface: &Surface, count: f64, inside: &mut impl FnMut(DVec2) -> bool) -> Vec<Vec<DVec2>> {
    let [u, v] = surface.domain();
    let (low, high) = (DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
    let square = vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y, DVec2::ZERO];
    let mut out = Vec::new();
    for [a, b] in hatching(&[square], std::f64::consts::SQRT_2 / count) {
        let at = |f: f64| surface.clamped(low + a.lerp(b, f) * (high - low));
        // Half a step inside, so that neighbours which only share the border do not count.
        let place = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
        let mut run: Vec<DVec2> = Vec::new();
        let mut was = false;
        for k in 0..SAMPLES {
            let is = inside(at(place(k)));
            if is != was && k > 0 {
                let (mut from, mut to) = (place(k - 1), place(k));
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (from + to);
                    if inside(at(middle)) == was { from = middle } else { to = middle }
                }
                run.push(at(0.5 * (from + to)));
            } else if is && k == 0 {
                run.push(at(0.0));
            }
            if is {
                run.push(at(place(k)));
            } else if was {
                out.push(std::mem::take(&mut run));
            }
            was = is;
        }
        if was {
            run.push(at(1.0));
            out.push(run);
        }
    }
    out
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
    use crate::view::intersection::{Picks, Request, compute};

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

    /// A square of four patches under a shifted square of one: the hatch covers the same area as if it were one patch.
    #[test]
    fn a_region_over_four_patches_is_hatched_on_all_of_them() {
        let quarter = |x: f64, y: f64| square(DVec3::new(x, y, 0.0), DVec3::X * 0.5, DVec3::Y * 0.5);
        let four = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|(x, y)| quarter(x, y));
        let whole = square(DVec3::new(0.6, 0.6, 0.0), DVec3::X, DVec3::Y);
        let model = document(four.into_iter().chain([whole]));
        let ids: Vec<_> = model.entities().iter().map(|e| e.id).collect();
        let picks = Picks { sides: [ids[..4].to_vec(), ids[4..].to_vec()], ..Picks::default() };
        let found = compute(&Request::new(&picks, &model).unwrap(), &Job::new()).unwrap();
        assert!(found.result.complete && found.result.regions.len() == 1);
        // They share the square from -0.4 to 1, part of every quarter.
        let mut patches: Vec<usize> = found.hatches[0].iter().filter(|h| h.side == 0).map(|h| h.number).collect();
        patches.sort_unstable();
        assert_eq!(patches, [0, 1, 2, 3]);
        let lines = region(&found, 0);
        let inside = |p: &DVec3| p.min_element() > -0.41 && p.max_element() < 1.0 + 1e-6;
        assert!(lines.iter().flatten().all(|p| inside(&DVec3::new(p.x, p.y, 0.0))), "{lines:?}");
        for [x, y] in [[-0.3, -0.3], [0.9, 0.9], [-0.3, 0.9], [0.5, 0.5]] {
            let near = lines.iter().flatten().map(|p| p.distance(DVec3::new(x, y, 0.0)));
            assert!(near.fold(f64::INFINITY, f64::min) < 0.15, "{x} {y}");
        }
    }
}
