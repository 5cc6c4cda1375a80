//! A chain cut at the places that are handed over, and what both engines found put together again.
//!
//! The places ([`super::near`]) are rectangles of the first surface's parameters. Outside them the chains of the
//! triangulations count, inside what the hybrid engine finds on the restricted surface. A chain that passes the border of
//! a place is cut there, at a point that is refined with the border's parameter fixed, so that both halves end in the same
//! point of both surfaces. Every cut must find exactly one end of the other engine and the reverse; where that fails (a
//! curve that grazes a corner of a place, on one side by rounding), the caller hands over the whole pair.

use glam::DVec2;

use super::join::join;
use super::near::Place;
use crate::kernel::geom::Surface;
use crate::kernel::ssi::result::{CurveEnd, CurvePoint, Intersection, IntersectionCurve};

/// How near a parameter is to a border that it is on it, as a fraction of the domain.
const ON_BORDER: f64 = 1e-9;

/// A step along a chain outside the places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A point of the chain, by its place there.
    Node(usize),
    /// Where a segment passes the border of a place: the segment, where on it, and which parameter is fixed to what.
    Cut {
        /// The segment's place in the chain.
        segment: usize,
        /// Its fraction up to the border.
        t: f64,
        /// 0: u is fixed, 1: v.
        fixed: usize,
        /// The value of that parameter.
        value: f64,
    },
}

/// The stretch of a segment inside a place: from where to where, each with the parameter that is fixed there.
fn inside(place: &Place, from: DVec2, to: DVec2) -> Option<[(f64, usize, f64); 2]> {
    let (mut enter, mut leave) = ((0.0, 0, 0.0), (1.0, 0, 0.0));
    for k in 0..2 {
        let step = to[k] - from[k];
        if step == 0.0 {
            if from[k] < place.low[k] || from[k] > place.high[k] {
                return None;
            }
            continue;
        }
        let (near, far) = if step > 0.0 { (place.low[k], place.high[k]) } else { (place.high[k], place.low[k]) };
        let (first, last) = ((near - from[k]) / step, (far - from[k]) / step);
        if first > enter.0 {
            enter = (first, k, near);
        }
        if last < leave.0 {
            leave = (last, k, far);
        }
    }
    (enter.0 < leave.0).then_some([enter, leave])
}

/// The stretches of a chain outside the places, from the parameters of its points (of a closed chain the first one is
/// there again at the end).
pub fn outside(uv: &[DVec2], closed: bool, places: &[Place]) -> Vec<Vec<Step>> {
    let mut pieces: Vec<Vec<Step>> = Vec::new();
    let free = |uv: DVec2| !places.iter().any(|p| p.contains(uv));
    let mut current = free(uv[0]).then(|| vec![Step::Node(0)]);
    let starts_free = current.is_some();
    for (segment, pair) in uv.windows(2).enumerate() {
        let mut stretches: Vec<[(f64, usize, f64); 2]> =
            places.iter().filter_map(|place| inside(place, pair[0], pair[1])).collect();
        stretches.sort_by(|a, b| a[0].0.total_cmp(&b[0].0));
        for [enter, leave] in stretches {
            let cut = |(t, fixed, value): (f64, usize, f64)| Step::Cut { segment, t, fixed, value };
            if let Some(mut piece) = current.take() {
                piece.push(cut(enter));
                pieces.push(piece);
            }
            if leave.0 < 1.0 {
                current = Some(vec![cut(leave)]);
            }
        }
        if let Some(piece) = &mut current {
            piece.push(Step::Node(segment + 1));
        }
    }
    if let Some(mut piece) = current {
        if closed && starts_free && !pieces.is_empty() {
            let first = pieces.remove(0);
            piece.extend(first.into_iter().skip(1));
        }
        pieces.push(piece);
    }
    pieces
}

fn end_of(curve: &IntersectionCurve, end: usize) -> CurvePoint {
    curve.points[if end == 0 { 0 } else { curve.points.len() - 1 }]
}

/// Puts together what was found outside the places and inside them. `cut`: which ends of the curves of `outer` are cuts.
/// `None` when cuts and ends do not match one to one within `reach`, or a curve ends where no surface does.
pub fn together(
    mut outer: Intersection,
    cut: &[[bool; 2]],
    inner: Vec<Intersection>,
    surfaces: [&Surface; 2],
    reach: f64,
    joining: f64,
) -> Option<Intersection> {
    let on_border = |p: &CurvePoint| {
        [(surfaces[0], p.uv), (surfaces[1], p.st)].iter().any(|(surface, uv)| {
            let domain = surface.domain();
            (0..2).any(|k| {
                let near = ON_BORDER * (domain[k][1] - domain[k][0]);
                domain[k].iter().any(|b| (uv[k] - b).abs() <= near)
            })
        })
    };
    let mut all = Intersection { complete: true, ..Intersection::default() };
    inner.into_iter().for_each(|part| all.append(part));
    let open = |c: &IntersectionCurve, e: usize| c.ends[e] == CurveEnd::Boundary && !c.points.is_empty();
    let mut ends: Vec<CurvePoint> = all
        .curves
        .iter()
        .flat_map(|c| [0, 1].into_iter().filter(|&e| open(c, e)).map(|e| end_of(c, e)).collect::<Vec<_>>())
        .filter(|p| !on_border(p))
        .collect();
    for (curve, cut) in outer.curves.iter_mut().zip(cut) {
        for e in (0..2).filter(|&e| cut[e]) {
            let at = end_of(curve, e);
            let distance = |p: &CurvePoint| p.xyz.distance(at.xyz);
            let nearest = (0..ends.len()).min_by(|&p, &q| distance(&ends[p]).total_cmp(&distance(&ends[q])))?;
            if distance(&ends[nearest]) > reach {
                return None;
            }
            // The same point for both, so that the curves join exactly.
            let k = if e == 0 { 0 } else { curve.points.len() - 1 };
            curve.points[k] = ends.swap_remove(nearest);
        }
    }
    if !ends.is_empty() {
        return None;
    }
    outer.append(all);
    outer.curves = join(std::mem::take(&mut outer.curves), joining);
    for curve in &mut outer.curves {
        curve.points.dedup();
        if (0..2).any(|e| open(curve, e) && !on_border(&end_of(curve, e))) {
            return None;
        }
    }
    Some(outer)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Place = Place { low: DVec2::new(1.0, -1.0), high: DVec2::new(2.0, 1.0) };

    fn kinds(pieces: &[Vec<Step>]) -> Vec<String> {
        let letter = |s: &Step| if matches!(s, Step::Node(_)) { 'n' } else { 'c' };
        pieces.iter().map(|p| p.iter().map(letter).collect()).collect()
    }

    #[test]
    fn an_open_chain_is_cut_where_it_enters_and_leaves() {
        let line = |xs: &[f64]| xs.iter().map(|&x| DVec2::new(x, 0.25)).collect::<Vec<_>>();
        let pieces = outside(&line(&[0.0, 0.5, 1.5, 2.5]), false, &[PLACE]);
        assert_eq!(kinds(&pieces), ["nnc", "cn"]);
        assert_eq!(pieces[0][2], Step::Cut { segment: 1, t: 0.5, fixed: 0, value: 1.0 });
        assert_eq!(pieces[1][0], Step::Cut { segment: 2, t: 0.5, fixed: 0, value: 2.0 });
        // One segment across the whole place, a chain that begins inside, and one that is inside.
        assert_eq!(kinds(&outside(&line(&[0.0, 3.0]), false, &[PLACE])), ["nc", "cn"]);
        assert_eq!(kinds(&outside(&line(&[1.5, 1.7, 3.0]), false, &[PLACE])), ["cn"]);
        assert!(outside(&line(&[1.5, 1.7]), false, &[PLACE]).is_empty());
        assert_eq!(kinds(&outside(&line(&[0.0, 0.5]), false, &[PLACE])), ["nn"]);
    }

    #[test]
    fn a_closed_chain_is_cut_open_at_the_place() {
        let square = [[0.0, 0.0], [1.5, 0.0], [1.5, 3.0], [0.0, 3.0], [0.0, 0.0]].map(DVec2::from_array);
        let pieces = outside(&square, true, &[PLACE]);
        assert_eq!(kinds(&pieces), ["cnnnc"]);
        let inside_first: Vec<DVec2> = [1, 2, 3, 4, 1].map(|k| square[k]).to_vec();
        assert_eq!(kinds(&outside(&inside_first, true, &[PLACE])), ["cnnnc"]);
    }
}
