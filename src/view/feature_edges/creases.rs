//! Creases inside a surface.

use glam::DVec2;

use super::super::display::CurveRef;
use super::{EdgeKind, EdgeOptions, EdgePiece};
use crate::kernel::geom::Direction;
use crate::kernel::geom::trim::Sheet;
use crate::model::document::EntityId;

/// Knots of full multiplicity at which the normal turns by more than the feature angle.
pub(super) fn creases(id: EntityId, sheet: &Sheet, options: &EdgeOptions, out: &mut Vec<EdgePiece>) {
    let surface = sheet.surface();
    // The seam that a face was moved to is such a knot without being a crease; normals tell.
    for (k, fixed) in [Direction::U, Direction::V].into_iter().enumerate() {
        let knots = &surface.knots()[k];
        let [start, end] = knots.domain();
        let along = surface.domain()[1 - k];
        for (t, multiplicity) in knots.multiplicities() {
            if multiplicity < knots.degree() || t <= start || t >= end {
                continue;
            }
            let step = 1e-7 * (end - start);
            let place = |t: f64, s: f64| {
                let s = along[0] + (along[1] - along[0]) * s;
                if k == 0 { DVec2::new(t, s) } else { DVec2::new(s, t) }
            };
            let normal = |t: f64, s: f64| surface.jet(place(t, s), 1).normal();
            let turns = (0..17).filter_map(|i| {
                let s = (f64::from(i) + 0.5) / 17.0;
                let (a, b) = (normal(t - step, s)?, normal(t + step, s)?);
                Some(a.dot(b).clamp(-1.0, 1.0).acos().to_degrees())
            });
            let turn = turns.fold(0.0, f64::max);
            if turn > options.feature_angle {
                let stretches = sheet.face().map_or_else(|| vec![along], |face| face.stretches(k, t));
                out.extend(stretches.into_iter().map(|range| EdgePiece {
                    curve: CurveRef::Iso(id, fixed, t),
                    range,
                    kind: EdgeKind::Feature,
                    neighbours: vec![id],
                    max_gap: 0.0,
                    max_angle: turn,
                }));
            }
        }
    }
}
