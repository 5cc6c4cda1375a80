//! A curve as matched biarcs in both domains (thesis 5.2.1, 5.2.2), on demand: where they join, and what they are worth.

use glam::{DVec2, DVec3};

use super::Found;
use crate::kernel::ssi::biarc::Arc;
use crate::kernel::ssi::fit_biarcs;

/// Points of a drawn arc.
const PARTS: usize = 12;

/// The arcs of one biarc in one domain.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnBiarc {
    /// The surface's number.
    pub number: usize,
    /// 0 for the first domain, 1 for the second.
    pub side: usize,
    /// Both arcs as points.
    pub arcs: [Vec<DVec2>; 2],
}

/// A curve as biarcs.
#[derive(Clone, Debug, PartialEq)]
pub struct Biarcs {
    /// The curve's number.
    pub curve: usize,
    /// The biarcs, one after the other, each in both domains.
    pub drawn: Vec<DrawnBiarc>,
    /// Where biarcs join, in space.
    pub joints: Vec<DVec3>,
    /// How many biarcs there are in each domain.
    pub count: usize,
    /// An upper bound of the distance of either curve on a surface from the other surface, in model units.
    pub bound: f64,
    /// Whether that is within the tolerance of the result.
    pub within: bool,
}

/// Fits biarcs to a curve of a result. An error is one line for people.
pub fn biarcs(found: &Found, curve: usize) -> Result<Biarcs, String> {
    let of = found.result.curves.get(curve).ok_or("the curve is gone")?;
    let fit = fit_biarcs(of, &found.surfaces(), found.result.tol).map_err(|e| e.to_string())?;
    let mut out =
        Biarcs { curve, drawn: Vec::new(), joints: Vec::new(), count: 0, bound: fit.bound, within: fit.within };
    for run in &fit.runs {
        for pair in &run.pairs {
            out.count += 1;
            for (side, (number, arcs)) in [(run.a, &pair.in_a), (run.b, &pair.in_b)].into_iter().enumerate() {
                out.drawn.push(DrawnBiarc { number, side, arcs: arcs.each_ref().map(sampled) });
            }
            if let Some(surface) = found.surface(run.a) {
                out.joints.push(surface.eval(surface.clamped(pair.in_a[0].start)));
            }
        }
        if let (Some(last), Some(surface)) = (run.pairs.last(), found.surface(run.a)) {
            out.joints.push(surface.eval(surface.clamped(last.in_a[1].end())));
        }
    }
    Ok(out)
}

fn sampled(arc: &Arc) -> Vec<DVec2> {
    (0..=PARTS).map(|i| arc.point(arc.length * i as f64 / PARTS as f64)).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::view::intersection::testing::{document, graph, met, square};

    #[test]
    fn the_biarcs_of_a_circle_join_and_keep_their_bound() {
        let floor = square(DVec3::Z * 0.25, DVec3::X * 1.5, DVec3::Y * 1.5);
        let found = met(&document([graph(|x, y| x * x + y * y), floor]));
        let fit = biarcs(&found, 0).unwrap();
        // A circle in both domains: one biarc for each half, as each is monotone in one parameter.
        assert!(fit.within && fit.bound <= found.result.tol, "{}", fit.bound);
        assert!(fit.count >= 2, "{}", fit.count);
        assert_eq!(fit.drawn.len(), 2 * fit.count);
        for joint in &fit.joints {
            assert!((joint.truncate().length() - 0.5).abs() < 10.0 * found.result.tol, "{joint}");
        }
        for side in 0..2 {
            let ends: Vec<_> =
                fit.drawn.iter().filter(|b| b.side == side).map(|b| (b.arcs[0][0], b.arcs[1][PARTS])).collect();
            assert!(ends.windows(2).all(|w| w[0].1.distance(w[1].0) < 1e-9), "one begins where the other ends");
        }
        assert!(biarcs(&found, 9).is_err());
    }
}
