//! A chain of the triangulations as curves of the answer (HJR99 4, "Tracing" and "Refinement"): each point is refined on the
//! parametric sides, the chain is broken where it passes a place that is handed over, and its ends are named. A point that
//! cannot be refined is left where the triangles have it and makes the answer incomplete, with the reason.

use glam::DVec2;

use super::MeshIntersection;
use super::engine::Pair;
use super::near::Place;
use super::places::{self, Step};
use super::trace::Chain;
use crate::kernel::ssi::result::{
    CurveEnd, CurveKind, CurvePoint, Intersection, IntersectionCurve, Junction, JunctionKind, Unresolved,
};

impl Pair<'_> {
    /// A chain as a curve of the answer, or as several where it passes places that are handed over: refined, and as dense as
    /// the tolerance asks for. `cuts`: which ends of each curve lie on the border of a place.
    pub(super) fn finish(
        &self,
        found: &MeshIntersection,
        chain: &Chain,
        places: &[Place],
        out: &mut Intersection,
        cuts: &mut Vec<[bool; 2]>,
    ) {
        let starts: Vec<CurvePoint> = (0..chain.points.len()).map(|k| self.start_at(found, chain, k)).collect();
        let uv: Vec<DVec2> = starts.iter().map(|p| p.uv).collect();
        for steps in places::outside(&uv, chain.closed, places) {
            self.stretch(found, chain, &starts, &steps, places, out, cuts);
        }
    }

    /// One stretch of a chain.
    #[expect(clippy::too_many_arguments, reason = "a chain, its stretch, and where both go")]
    fn stretch(
        &self,
        found: &MeshIntersection,
        chain: &Chain,
        starts: &[CurvePoint],
        steps: &[Step],
        places: &[Place],
        out: &mut Intersection,
        cuts: &mut Vec<[bool; 2]>,
    ) {
        let whole = steps.len() == chain.points.len() && steps.iter().all(|s| matches!(s, Step::Node(_)));
        let closed = chain.closed && whole;
        let mut points: Vec<CurvePoint> = Vec::with_capacity(steps.len());
        let mut triangles: Vec<[u32; 2]> = Vec::with_capacity(steps.len());
        let mut failed: Option<(CurvePoint, String)> = None;
        let of_segment = |s: usize| found.topology.segments[chain.segments[s] as usize].triangles;
        for (at, step) in steps.iter().enumerate() {
            let made = match *step {
                Step::Node(k) if closed && at + 1 == steps.len() => Ok((points[0], k - 1)),
                Step::Node(k) => {
                    let point = &found.topology.points[chain.points[k] as usize];
                    let fixed = (point.uses.len() == 1).then(|| self.border(point)).flatten();
                    let own = of_segment(k.min(chain.segments.len() - 1));
                    let refined = self.at_point(starts[k], point, own, fixed).map_err(|reason| (starts[k], reason));
                    // What moves into a place when it is refined is the other engine's.
                    if refined.as_ref().is_ok_and(|p| places.iter().any(|place| place.contains(p.uv))) {
                        continue;
                    }
                    refined.map(|p| (p, k.saturating_sub(1)))
                }
                Step::Cut { segment, t, fixed, value } => {
                    let (p, q) = (starts[segment], starts[segment + 1]);
                    let mut start =
                        CurvePoint { xyz: p.xyz.lerp(q.xyz, t), uv: p.uv.lerp(q.uv, t), st: p.st.lerp(q.st, t), ..p };
                    start.uv[fixed] = value;
                    let cut = self.refined(start, of_segment(segment), Some((0, fixed)));
                    cut.map(|p| (p, segment)).map_err(|reason| (start, reason))
                }
            };
            // The triangles of the chord that ends here; a chord over several segments takes the last one's.
            let (point, segment) = made.unwrap_or_else(|(start, reason)| {
                failed.get_or_insert((start, reason));
                (start, 0)
            });
            if !points.is_empty() {
                triangles.push(of_segment(segment));
            }
            points.push(point);
        }
        if points.len() < 2 {
            return;
        }
        let (points, error_bound) = self.adapted(points, &triangles, closed);
        let cut = [steps.first(), steps.last()].map(|s| matches!(s, Some(Step::Cut { .. })));
        let end = |e: usize| match steps[if e == 0 { 0 } else { steps.len() - 1 }] {
            Step::Node(k) if found.topology.points[chain.points[k] as usize].uses.len() != 1 => CurveEnd::Junction,
            _ => CurveEnd::Boundary,
        };
        let ends = if closed { [CurveEnd::Loop; 2] } else { [end(0), end(1)] };
        if failed.is_none() && error_bound > self.common.tol {
            let reason = format!("{} points were inserted and {error_bound:.3e} is left", self.common.max_inserted);
            failed = points.first().map(|p| (*p, reason));
        }
        let mut end_ids = [None; 2];
        for (k, id) in end_ids.iter_mut().enumerate().filter(|(k, _)| ends[*k] == CurveEnd::Junction) {
            let at = if k == 0 { points[0] } else { points[points.len() - 1] };
            *id = Some(bifurcation(&at, 1e3 * self.common.floor, &mut out.junctions));
        }
        if let Some((at, reason)) = failed {
            out.unresolved.push(Unresolved {
                a: at.a,
                uv_box: [[at.uv.x; 2], [at.uv.y; 2]],
                b: at.b,
                st_box: [[at.st.x; 2], [at.st.y; 2]],
                reason,
            });
        }
        out.curves.push(IntersectionCurve {
            kind: CurveKind::Transversal,
            closed,
            ends,
            end_ids,
            error_bound,
            region: None,
            points,
        });
        cuts.push(cut);
    }
}

/// The number of the junction at a point in which more than two segments meet, made when it is new.
fn bifurcation(at: &CurvePoint, same: f64, junctions: &mut Vec<Junction>) -> usize {
    junctions.iter().position(|j| j.xyz.distance(at.xyz) <= same).unwrap_or_else(|| {
        let kind = JunctionKind::HigherOrder;
        junctions.push(Junction { xyz: at.xyz, a: at.a, uv: at.uv, b: at.b, st: at.st, gap: 0.0, kind });
        junctions.len() - 1
    })
}
