//! The refinement that fits of a curve share: one element, a span or a pair of biarcs, over as many of its points as the
//! tolerance allows.
//!
//! An element is tried over a whole stretch of points. Where a point is off by more than is wanted, or the element's bound
//! does not hold, the stretch is cut at the point where it is worst, but not next to an end; between two neighbours a new
//! point is put in the middle. After [`DEEPEST`] of these the element is as good as it gets, and its bound says how good.

use super::strand::{Ground, Knot, Strand};

/// How often a stretch between two points is halved.
const DEEPEST: usize = 12;

/// An element of a fit between two points.
pub(super) trait Element {
    /// How far a point between its ends is off it.
    fn off(&self, knot: &Knot) -> f64;
    /// An upper bound over all of it; a hasty one may be any value above what is wanted as soon as it is known to be.
    fn bound(&self, hasty: bool) -> f64;
}

/// The elements over a stretch of points, in order, each with its end and its bound. `element` makes one between two
/// points; where it cannot, even between the nearest, the stretch is left out.
pub(super) fn refined<'a, E: Element>(
    ground: &'a Ground,
    strand: &'a Strand,
    knots: &[Knot],
    wanted: f64,
    element: impl Fn(&Knot, &Knot) -> Option<E>,
) -> Vec<(E, Knot, f64)> {
    let mut out = Vec::new();
    let mut stack = vec![(knots.to_vec(), 0)];
    while let Some((knots, depth)) = stack.pop() {
        let last = knots.len() - 1;
        let (x, y) = (knots[0], knots[last]);
        let hopeless = last == 1 && depth > DEEPEST;
        let mut worst = None;
        match element(&x, &y) {
            Some(made) => {
                let off = knots[1..last].iter().map(|k| made.off(k)).enumerate();
                worst = off.max_by(|a, b| a.1.total_cmp(&b.1));
                if worst.is_none_or(|(_, off)| off < wanted) {
                    let bound = made.bound(!hopeless);
                    if bound <= wanted || hopeless {
                        out.push((made, y, bound));
                        continue;
                    }
                }
            }
            None if hopeless => continue,
            None => {}
        }
        if last == 1 {
            let middle = ground.between(strand, &x, &y);
            stack.push((vec![middle, y], depth + 1));
            stack.push((vec![x, middle], depth + 1));
        } else {
            let margin = last / 4;
            let cut = worst.map_or(last / 2, |(k, _)| k + 1).clamp(margin.max(1), (last - margin).min(last - 1));
            stack.push((knots[cut..].to_vec(), depth));
            stack.push((knots[..=cut].to_vec(), depth));
        }
    }
    out
}
