//! Cutting a curve of a result at points on it.

use super::result::{CurveEnd, CurvePoint, IntersectionCurve};

/// A place at which a curve is cut: its ends there, each with the number of its junction. Where one is missing the curve
/// ends in its own last point.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Points count from 0; between two of them the fraction of the chord is added.
    pub at: f64,
    /// The end of what comes before.
    pub before: Option<(usize, CurvePoint)>,
    /// The start of what comes after.
    pub after: Option<(usize, CurvePoint)>,
}

/// The pieces of a curve between cuts, which are in ascending order. What is shorter than `same` is no piece.
///
/// A piece keeps the bound of the whole: its chords are those of the curve or parts of them, and a part of a chord
/// between points on both surfaces bends away from them by less than the whole does.
pub fn split(curve: IntersectionCurve, cuts: &[Cut], same: f64) -> Vec<IntersectionCurve> {
    let Some(first) = cuts.first() else { return vec![curve] };
    let n = curve.points.len();
    let period = (n - 1) as f64;
    // From where to where each piece runs.
    let mut runs: Vec<(Option<&Cut>, Option<&Cut>)> = cuts.windows(2).map(|w| (Some(&w[0]), Some(&w[1]))).collect();
    if curve.closed {
        runs.push((cuts.last(), Some(first)));
    } else {
        runs.insert(0, (None, Some(first)));
        runs.push((cuts.last(), None));
    }
    let mut out = Vec::new();
    for (from, to) in runs {
        let low = from.map_or(-1.0, |c| c.at);
        let mut high = to.map_or(n as f64, |c| c.at);
        if curve.closed && high <= low {
            high += period;
        }
        let inner = (low.floor() as i64 + 1..).take_while(|k| (*k as f64) < high);
        let index = |k: i64| if curve.closed { k.rem_euclid(n as i64 - 1) as usize } else { k as usize };
        let mut points: Vec<CurvePoint> = inner.filter_map(|k| curve.points.get(index(k)).copied()).collect();
        let mut piece = IntersectionCurve { closed: false, points: Vec::new(), ..curve.clone() };
        let (start, end) = (from.map(|c| c.after), to.map(|c| c.before));
        for (k, cut) in [start, end].into_iter().enumerate() {
            match cut {
                Some(Some((id, at))) => {
                    (piece.ends[k], piece.end_ids[k]) = (CurveEnd::Junction, Some(id));
                    let near = |p: Option<&CurvePoint>| p.is_some_and(|p| p.xyz.distance(at.xyz) <= same);
                    if k == 0 {
                        let beside = points.iter().take_while(|p| near(Some(p))).count();
                        points.drain(..beside);
                        points.insert(0, at);
                    } else {
                        while points.len() > 1 && near(points.last()) {
                            points.pop();
                        }
                        points.push(at);
                    }
                }
                Some(None) => (piece.ends[k], piece.end_ids[k]) = (CurveEnd::Boundary, None),
                None => {}
            }
        }
        let long = points.windows(2).any(|w| w[0].xyz.distance(w[1].xyz) > same);
        if points.len() > 1 && long {
            out.push(IntersectionCurve { points, ..piece });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::super::result::CurveKind;
    use super::*;

    fn line(closed: bool) -> IntersectionCurve {
        let at = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        let point = |(x, y)| CurvePoint { xyz: DVec3::new(x, y, 0.0), a: 0, uv: DVec2::ZERO, b: 1, st: DVec2::ZERO };
        IntersectionCurve {
            kind: CurveKind::Transversal,
            closed,
            ends: [if closed { CurveEnd::Loop } else { CurveEnd::Boundary }; 2],
            end_ids: [None; 2],
            error_bound: 0.0,
            region: None,
            points: at[..if closed { 5 } else { 4 }].iter().copied().map(point).collect(),
        }
    }

    fn cut(at: f64, x: f64, y: f64) -> Cut {
        let point = CurvePoint { xyz: DVec3::new(x, y, 0.0), a: 0, uv: DVec2::ZERO, b: 1, st: DVec2::ZERO };
        Cut { at, before: Some((7, point)), after: Some((7, point)) }
    }

    fn length(c: &IntersectionCurve) -> f64 {
        c.points.windows(2).map(|w| w[0].xyz.distance(w[1].xyz)).sum()
    }

    #[test]
    fn pieces_have_the_length_of_the_whole_and_the_ends_of_the_cuts() {
        for closed in [false, true] {
            for cuts in [vec![cut(0.25, 0.25, 0.0)], vec![cut(0.5, 0.5, 0.0), cut(2.0, 1.0, 1.0), cut(2.5, 0.5, 1.0)]] {
                let whole = line(closed);
                let pieces = split(whole.clone(), &cuts, 1e-9);
                assert_eq!(pieces.len(), cuts.len() + usize::from(!closed));
                assert!((pieces.iter().map(length).sum::<f64>() - length(&whole)).abs() < 1e-12);
                let ends = pieces.iter().flat_map(|p| p.ends.iter().zip(&p.end_ids));
                let junctions = ends.filter(|(e, id)| **e == CurveEnd::Junction && **id == Some(7)).count();
                assert_eq!(junctions, 2 * cuts.len());
                assert!(pieces.iter().all(|p| !p.closed));
            }
        }
        // A ring with one cut runs from it to itself.
        let ring = split(line(true), &[cut(3.0, 0.0, 1.0)], 1e-9);
        assert_eq!(ring[0].points.first().map(|p| p.xyz), ring[0].points.last().map(|p| p.xyz));
        // A cut in the last point only names the end.
        let end = split(line(false), &[cut(3.0, 0.0, 1.0)], 1e-9);
        assert_eq!((end.len(), end[0].points.len(), end[0].end_ids), (1, 4, [None, Some(7)]));
    }
}
