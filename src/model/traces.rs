//! Intersection curves as entities of a document: free B-spline curves, and the curves on surfaces that belong to them.

use std::collections::BTreeSet;

use super::document::{Document, EntityId, Shape};
use crate::kernel::geom::{Curve, Surface};
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

/// Fits cubic B-splines to all curves of an intersection of surfaces of `model`, numbered in their order there. `tol`
/// is in model units.
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
