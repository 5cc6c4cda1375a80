//! Curves of a result as free curves of the document, so that they can be picked as sides of a patch, and as a document of
//! their own with their curves on surfaces, to be written to a file.

use std::sync::Arc;

use super::Found;
use crate::kernel::geom::Curve;
use crate::kernel::intersect::Engine;
use crate::kernel::mesh::body::Body;
use crate::kernel::ssi::fit_splines;
use crate::kernel::ssi::result::CurveKind;
use crate::model::document::{Document, Shape, Unit};
use crate::model::traces::{Traces, traces_of};

/// Curves to be added to a document.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// Names and curves.
    pub curves: Vec<(String, Arc<Curve>)>,
    /// What could not be kept, or not within the tolerance; one line each.
    pub notes: Vec<String>,
}

/// Cubic B-splines through the curves with these numbers; of triangulations the polylines are the curves. The curves of a result end at junctions, so that each is one
/// piece between two of them.
pub fn curves(found: &Found, which: impl IntoIterator<Item = usize>) -> Kept {
    let surfaces = found.surfaces();
    let mut kept = Kept::default();
    for k in which {
        let Some(curve) = found.result.curves.get(k) else { continue };
        if found.engine == Engine::Mesh {
            let points: Vec<_> = curve.points.iter().map(|p| p.xyz).collect();
            match Curve::polyline(&points) {
                Ok(line) => kept.curves.push((name(found, k), Arc::new(line))),
                Err(error) => kept.notes.push(format!("curve {} was left out: {error}", k + 1)),
            }
            continue;
        }
        match fit_splines(curve, &surfaces, found.result.tol) {
            Ok(fit) => {
                if !fit.within {
                    kept.notes.push(format!("curve {} follows within {:.1e} only", k + 1, fit.bound));
                }
                kept.curves.push((name(found, k), Arc::new(fit.space)));
            }
            Err(error) => kept.notes.push(format!("curve {} was left out: {error}", k + 1)),
        }
    }
    kept
}

/// All curves with their surfaces and the curves on them.
pub fn traces(found: &Found, unit: Unit) -> Traces {
    let mut model = Document::new(unit);
    // The numbers of the result are the places of the surfaces in their document.
    for subject in &found.subjects {
        match (&subject.body, subject.surface()) {
            (Body::Facets(facets), _) => model.add(subject.name.clone(), Shape::Mesh(Arc::clone(facets)), None),
            (_, Some(surface)) => model.add(subject.name.clone(), Shape::Surface(Arc::clone(surface)), None),
            (_, None) => continue,
        };
    }
    if found.engine == Engine::Mesh {
        return polylines(found, &model);
    }
    traces_of(&found.result, &model, found.result.tol)
}

/// The curves as polylines, without curves on surfaces.
fn polylines(found: &Found, model: &Document) -> Traces {
    let mut document = Document::new(model.unit);
    let kept = curves(found, 0..found.result.curves.len());
    let curves = kept.curves.into_iter().map(|(name, c)| document.add(name, Shape::Curve(c), None)).collect();
    let bound = found.result.curves.iter().map(|c| c.error_bound).fold(0.0, f64::max);
    Traces { document, curves, traces: Vec::new(), bound, notes: kept.notes }
}

fn name(found: &Found, k: usize) -> String {
    let Some(curve) = found.result.curves.get(k) else { return String::new() };
    let Some(p) = curve.points.first() else { return format!("intersection {}", k + 1) };
    let (a, b) = (found.name(p.a), found.name(p.b));
    match curve.kind {
        CurveKind::SelfIntersection => format!("self-intersection {} of {a}", k + 1),
        CurveKind::CuspEdge => format!("cusp edge {} of {a}", k + 1),
        _ => format!("intersection {} of {a} and {b}", k + 1),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::view::intersection::testing::{document, graph, met, square};

    #[test]
    fn the_four_branches_of_a_saddle_are_four_curves_that_meet_in_one_point() {
        let floor = square(DVec3::ZERO, DVec3::X * 1.5, DVec3::Y * 1.5);
        let found = met(&document([graph(|x, y| x * x - y * y), floor]));
        let kept = curves(&found, 0..found.result.curves.len());
        assert_eq!((kept.curves.len(), kept.notes.as_slice()), (4, [].as_slice()));
        for (name, curve) in &kept.curves {
            assert!(name.contains("surface 0 and surface 1"));
            let ends = curve.ends();
            let (near, far) = if ends[0].length() < ends[1].length() { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
            assert!(near.length() < 1e-6 && (far.truncate().length() - 2f64.sqrt()).abs() < 1e-6);
        }
    }

    #[test]
    fn written_curves_have_one_curve_on_each_surface() {
        let floor = square(DVec3::Z * 0.25, DVec3::X * 1.5, DVec3::Y * 1.5);
        let found = met(&document([graph(|x, y| x * x + y * y), floor]));
        let traces = traces(&found, Unit::Millimetre);
        assert_eq!((traces.curves.len(), traces.traces.len()), (1, 2));
        assert_eq!(traces.document.surfaces().count(), 2);
        assert!(traces.bound <= found.result.tol, "{}", traces.bound);
    }
}
