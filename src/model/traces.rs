//! Intersection curves as entities of a document: free B-spline curves, and the curves on surfaces that belong to them.

use std::collections::BTreeSet;

use glam::DVec3;

use super::document::{Document, EntityId, Shape};
use crate::kernel::geom::{Curve, Surface};
use crate::kernel::ssi::result::{CurvePoint, IntersectionCurve};
use crate::kernel::ssi::{Intersection, fit_splines};

/// A curve on a surface: an intersection with another surface, in space and in the parameters.
#[derive(Clone, Debug)]
pub struct SurfaceTrace {
    /// The surface, an entity of the same document.
    pub surface: EntityId,
    /// The curve in the surface's parameters, z = 0, with the parameter of `space`.
    pub in_surface: Curve,
    /// The curve in space.
    pub space: Curve,
}

/// The curves of an intersection, ready to be kept or written.
#[derive(Clone, Debug)]
pub struct Traces {
    /// The surfaces that the curves run on, with the names and ids that they had, and one free curve for each of the
    /// intersection's curves.
    pub document: Document,
    /// The free curves among its entities, in the order of the intersection's curves.
    pub curves: Vec<EntityId>,
    /// The curves on those surfaces.
    pub traces: Vec<SurfaceTrace>,
    /// An upper bound of the distance of all free curves to both of their surfaces.
    pub bound: f64,
    /// What could not be fitted, or not within the tolerance.
    pub notes: Vec<String>,
}

/// Fits cubic B-splines to all curves of an intersection of bodies of `model`, numbered in their order there: surfaces
/// first, then meshes and blocks. A curve on a mesh or block is a polyline, with a corner at every edge of the mesh, and
/// stays one, in space and in the parameters of the surface on the other side. `tol` is in model units.
pub fn traces_of(result: &Intersection, model: &Document, tol: f64) -> Traces {
    let numbered: Vec<(EntityId, &Surface)> = model.surfaces().map(|(id, s)| (id, s.as_ref())).collect();
    let surfaces: Vec<(usize, &Surface)> = numbered.iter().map(|(_, s)| *s).enumerate().collect();
    let used: BTreeSet<EntityId> = result
        .curves
        .iter()
        .flat_map(|c| c.points.iter().flat_map(|p| [p.a, p.b]))
        .filter_map(|n| numbered.get(n).map(|(id, _)| *id))
        .collect();
    let mut document = model.clone();
    document.retain(|e| used.contains(&e.id));
    let (mut curves, mut traces, mut notes, mut bound) = (Vec::new(), Vec::new(), Vec::new(), 0.0_f64);
    for (k, curve) in result.curves.iter().enumerate() {
        if curve.points.iter().any(|p| p.a.max(p.b) >= numbered.len()) {
            let Some(Polyline { space, runs, off }) = polyline(curve, &surfaces) else {
                notes.push(format!("intersection {k} was left out: it has no length"));
                continue;
            };
            let off = off.max(curve.error_bound);
            if off > tol {
                notes.push(format!("intersection {k} follows within {off:.1e} only, not {tol:.1e}"));
            }
            bound = bound.max(off);
            curves.push(document.add(format!("intersection {k}"), Shape::Curve(space.into()), None));
            let on = |(number, in_surface, space): (usize, Curve, Curve)| {
                numbered.get(number).map(|&(surface, _)| SurfaceTrace { surface, in_surface, space })
            };
            traces.extend(runs.into_iter().filter_map(on));
            continue;
        }
        let fit = match fit_splines(curve, &surfaces, tol) {
            Ok(fit) => fit,
            Err(error) => {
                notes.push(format!("intersection {k} was left out: {error}"));
                continue;
            }
        };
        if !fit.within {
            notes.push(format!("intersection {k} follows within {:.1e} only, not {tol:.1e}", fit.bound));
        }
        bound = bound.max(fit.bound);
        curves.push(document.add(format!("intersection {k}"), Shape::Curve(fit.space.into()), None));
        for run in fit.runs {
            for (number, in_surface) in [(run.a, run.in_a), (run.b, run.in_b)] {
                if let Some(&(surface, _)) = numbered.get(number) {
                    traces.push(SurfaceTrace { surface, in_surface, space: run.space.clone() });
                }
            }
        }
    }
    Traces { document, curves, traces, bound, notes }
}

/// A curve as the polyline that it is.
struct Polyline {
    space: Curve,
    /// For every stretch on one surface the number of that surface, the polyline in its parameters, and the stretch in
    /// space with the same parameter.
    runs: Vec<(usize, Curve, Curve)>,
    /// How far the last two are apart at most, at the quarters of the chords.
    off: f64,
}

/// `None` where the curve has no length.
fn polyline(curve: &IntersectionCurve, surfaces: &[(usize, &Surface)]) -> Option<Polyline> {
    let all: Vec<DVec3> = curve.points.iter().map(|p| p.xyz).collect();
    let space = Curve::polyline(&all).ok()?;
    let (mut runs, mut off) = (Vec::new(), 0.0_f64);
    for side in 0..2 {
        let at = |p: &CurvePoint| if side == 0 { (p.a, p.uv) } else { (p.b, p.st) };
        // A stretch ends where the curve passes to another surface, or over a seam: there the point is there twice.
        let goes_on = |p: &CurvePoint, q: &CurvePoint| at(p).0 == at(q).0 && (p.xyz != q.xyz || at(p).1 == at(q).1);
        for run in curve.points.chunk_by(goes_on) {
            let Some(&(number, surface)) = surfaces.get(at(&run[0]).0) else { continue };
            let mut points = run.to_vec();
            points.dedup_by(|q, p| q.xyz == p.xyz);
            let Ok(in_space) = Curve::polyline(&points.iter().map(|p| p.xyz).collect::<Vec<_>>()) else { continue };
            let flat = points.iter().map(|p| at(p).1.extend(0.0)).collect();
            let Ok(in_surface) = Curve::new(in_space.knots().clone(), flat, None) else { continue };
            for pair in points.windows(2) {
                for part in [0.25, 0.5, 0.75] {
                    let uv = at(&pair[0]).1.lerp(at(&pair[1]).1, part);
                    off = off.max(surface.eval(surface.clamped(uv)).distance(pair[0].xyz.lerp(pair[1].xyz, part)));
                }
            }
            runs.push((number, in_surface, in_space));
        }
    }
    Some(Polyline { space, runs, off })
}
