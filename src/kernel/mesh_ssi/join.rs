//! Joining: curves that run on across the shared edge of neighbouring patches, or across the seam of a closed
//! surface, are one curve.

use crate::kernel::ssi::result::{CurveEnd, IntersectionCurve};

/// Joins curves of one kind at border ends that lie within `tol` of one another, where exactly two meet. The
/// shared point stays twice, once with each patch's number and parameters. A curve whose own ends meet so
/// becomes closed, its last point repeating the first.
pub fn join(mut curves: Vec<IntersectionCurve>, tol: f64) -> Vec<IntersectionCurve> {
    loop {
        let ends: Vec<(usize, usize)> = (0..curves.len())
            .flat_map(|c| [(c, 0), (c, 1)])
            .filter(|&(c, e)| curves[c].ends[e] == CurveEnd::Boundary && curves[c].points.len() > 1)
            .collect();
        let at = |(c, e): (usize, usize)| {
            let points = &curves[c].points;
            points[if e == 0 { 0 } else { points.len() - 1 }].xyz
        };
        let meeting = |k: usize| {
            let near = ends.iter().enumerate().filter(|&(m, &end)| {
                m != k && curves[end.0].kind == curves[ends[k].0].kind && at(end).distance(at(ends[k])) <= tol
            });
            let near: Vec<usize> = near.map(|(m, _)| m).collect();
            (near.len() == 1).then(|| near[0])
        };
        let pair =
            (0..ends.len()).find_map(|k| meeting(k).filter(|&m| meeting(m) == Some(k)).map(|m| (ends[k], ends[m])));
        let Some(((c, e), (d, f))) = pair else { return curves };
        if c == d {
            let curve = &mut curves[c];
            (curve.closed, curve.ends) = (true, [CurveEnd::Loop; 2]);
            let first = curve.points[0];
            curve.points.push(first);
            continue;
        }
        let (low, high) = (c.min(d), c.max(d));
        let (mut head, mut tail) = (curves[c].clone(), curves[d].clone());
        if e == 0 {
            reverse(&mut head);
        }
        if f == 1 {
            reverse(&mut tail);
        }
        head.points.extend(tail.points);
        head.ends[1] = tail.ends[1];
        head.end_ids[1] = tail.end_ids[1];
        head.error_bound = head.error_bound.max(tail.error_bound);
        curves.remove(high);
        curves[low] = head;
    }
}

fn reverse(curve: &mut IntersectionCurve) {
    curve.points.reverse();
    curve.ends.reverse();
    curve.end_ids.reverse();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::ssi::result::{CurveKind, CurvePoint};
    use glam::{DVec2, DVec3};

    fn line(a: usize, from: f64, to: f64) -> IntersectionCurve {
        let point = |x: f64| CurvePoint { xyz: DVec3::X * x, a, uv: DVec2::ZERO, b: 9, st: DVec2::ZERO };
        IntersectionCurve {
            kind: CurveKind::Transversal,
            closed: false,
            ends: [CurveEnd::Boundary; 2],
            end_ids: [None; 2],
            error_bound: a as f64,
            region: None,
            points: vec![point(from), point(0.5 * (from + to)), point(to)],
        }
    }

    #[test]
    fn three_pieces_in_any_direction_become_one() {
        let joined = join(vec![line(0, 0.0, 1.0), line(2, 3.0, 2.0), line(1, 1.0, 2.0)], 1e-9);
        assert_eq!(joined.len(), 1);
        let mut x: Vec<f64> = joined[0].points.iter().map(|p| p.xyz.x).collect();
        assert_eq!(x.len(), 9);
        if x[0] > 1.0 {
            x.reverse();
        }
        assert_eq!(x, [0.0, 0.5, 1.0, 1.0, 1.5, 2.0, 2.0, 2.5, 3.0]);
        assert_eq!(joined[0].error_bound, 2.0);
    }

    #[test]
    fn three_ends_in_a_point_stay_apart() {
        assert_eq!(join(vec![line(0, 0.0, 1.0), line(1, 1.0, 2.0), line(2, 1.0, 3.0)], 1e-9).len(), 3);
    }

    #[test]
    fn a_ring_closes() {
        let mut ring = line(0, 0.0, 1.0);
        ring.points.push(ring.points[0]);
        let joined = join(vec![ring], 1e-9);
        assert!(joined[0].closed && joined[0].points.len() == 5);
    }
}
