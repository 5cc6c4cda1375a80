//! Insertion and deletion of points so that a polyline meets the tolerance with few of them (HJR99 4): a chord whose middle
//! is off is halved, a point whose neighbours' chord passes near enough is dropped. The bound that comes of it is measured
//! at chord middles, with half of that added.

use glam::DVec3;

use super::engine::Pair;
use crate::kernel::ssi::result::CurvePoint;

impl Pair<'_> {
    /// Inserts points where the middle of a chord is off by more than the tolerance, then drops points that are
    /// not needed. `triangles`: those of each chord. Returns the points and a bound of the distance of the polyline,
    /// from what is measured at chord middles.
    pub(super) fn adapted(
        &self,
        points: Vec<CurvePoint>,
        triangles: &[[u32; 2]],
        closed: bool,
    ) -> (Vec<CurvePoint>, f64) {
        if self.sheets.iter().all(|s| s.surface().is_none()) {
            // The segments of two meshes are the truth.
            return (points, self.common.floor);
        }
        let middle = |p: &CurvePoint, q: &CurvePoint, triangles: [u32; 2]| {
            let start =
                CurvePoint { xyz: 0.5 * (p.xyz + q.xyz), uv: 0.5 * (p.uv + q.uv), st: 0.5 * (p.st + q.st), ..*p };
            self.refined(start, triangles, None).ok().map(|m| (m, distance_to_chord(m.xyz, p.xyz, q.xyz)))
        };
        let mut dense = vec![points[0]];
        let mut worst = 0.0_f64;
        for (pair, &triangles) in points.windows(2).zip(triangles) {
            let mut stack = vec![pair[1]];
            let mut inserted = 0;
            while let (Some(&from), Some(&to)) = (dense.last(), stack.last()) {
                match middle(&from, &to, triangles) {
                    Some((m, off)) if off > 0.25 * self.common.tol && inserted < self.common.max_inserted => {
                        inserted += 1;
                        stack.push(m);
                    }
                    measured => {
                        worst = worst.max(measured.map_or(0.0, |(_, off)| off));
                        dense.push(to);
                        stack.pop();
                    }
                }
            }
        }
        let mut kept = vec![dense[0]];
        let mut dropped = 0.0_f64;
        let mut at = 0;
        while at + 1 < dense.len() {
            let mut next = at + 1;
            // A closed curve keeps at least three chords.
            let limit = if closed { dense.len() / 3 } else { dense.len() };
            while next + 1 < dense.len() && next + 1 - at <= limit.max(1) {
                let off = (at + 1..=next)
                    .map(|k| distance_to_chord(dense[k].xyz, dense[at].xyz, dense[next + 1].xyz))
                    .fold(0.0, f64::max);
                if off > 0.25 * self.common.tol {
                    break;
                }
                dropped = dropped.max(off);
                next += 1;
            }
            kept.push(dense[next]);
            at = next;
        }
        (kept, 1.5 * worst + dropped + self.common.floor)
    }
}

fn distance_to_chord(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let chord = b - a;
    let t = ((p - a).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
    p.distance(a + chord * if t.is_finite() { t } else { 0.0 })
}
