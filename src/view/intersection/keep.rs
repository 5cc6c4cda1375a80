//! Curves of a result as free curves of the document, so that they can be picked as sides of a patch.

use std::sync::Arc;

use glam::DVec3;

use super::Found;
use crate::kernel::geom::Curve;
use crate::kernel::ssi::result::CurveKind;

/// Curves to be added to a document.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// Names and curves.
    pub curves: Vec<(String, Arc<Curve>)>,
    /// What could not be kept; one line each.
    pub notes: Vec<String>,
}

/// Names and curves for `Command::AddCurves`. The curves of a result end at junctions, so that each is one piece between two of them.
pub fn curves(found: &Found, which: impl IntoIterator<Item = usize>) -> Kept {
    let mut kept = Kept::default();
    for k in which {
        let Some(curve) = found.result.curves.get(k) else { continue };
        let mut points: Vec<DVec3> = Vec::with_capacity(curve.points.len());
        for p in &curve.points {
            // A point occurs once for each patch where the curve crosses from one to the next.
            if points.last() != Some(&p.xyz) {
                points.push(p.xyz);
            }
        }
        match Curve::polyline(&points) {
            Ok(made) => kept.curves.push((name(found, k), Arc::new(made))),
            Err(error) => kept.notes.push(format!("curve {} was left out: {error}", k + 1)),
        }
    }
    kept
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
}
