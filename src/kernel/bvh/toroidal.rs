//! Trimmed tori: a bound of their Hausdorff distance to the subpatch, and subdivision until it is small enough.
//!
//! Thesis 4.1.3: the torus is trimmed by the quadrangle of the projected corners, reparametrized bilinearly, and
//! |S(u, v) - T(u, v)| with matching parameters bounds the Hausdorff distance both ways. Here that is split in the
//! distance to the torus (third order, stored) and the way along it: how far a coordinate is from its bilinear
//! interpolant, bounded on the control net, and how far half-angle parameters are from coordinates. The second part is
//! of order two wherever the parameters of the surface accelerate, and it is usually the larger.

use glam::DVec3;

use super::patch_tree::PatchTree;
use super::tree::{NodeId, SurfaceTree};
use crate::kernel::job::Job;

/// A surface as trimmed tori.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToroidalCover {
    /// Nodes whose trimmed tori are within the tolerance.
    pub tori: Vec<NodeId>,
    /// Leaves of the hierarchy where it was not reached.
    pub missed: Vec<NodeId>,
    /// The largest bound of a Hausdorff distance among all of them.
    pub largest: f64,
    /// False when it was cancelled.
    pub complete: bool,
}

impl PatchTree {
    /// An upper bound of the Hausdorff distance between the subpatch of a node and its trimmed torus; infinite where
    /// none is known, `None` for nodes without a torus.
    pub fn hausdorff(&self, index: u32) -> Option<f64> {
        let torus = self.osculating_torus(index)?;
        let [p, q] = self.degree();
        let net = self.subnet(index);
        let n = (p + 1) * (q + 1);
        let weight = |i: usize| if self.is_rational() { net[3 * n + i] } else { 1.0 };
        let local: Vec<DVec3> = (0..n)
            .map(|i| torus.local(DVec3::new(net[i], net[n + i], net[2 * n + i]) / weight(i) + self.origin()))
            .collect();
        let reach = local.iter().fold(DVec3::ZERO, |reach, p| reach.max(p.abs()));
        let [k1, k2] = torus.k.map(f64::abs);
        // |c| <= |N|, and half-angle parameters are coordinates times 1 / (1 - eta).
        let w = bound(reach.y, reach.z, k2);
        let d = bound(reach.x, w, k1);
        let stretch = |coordinate: f64, eta: f64| {
            if eta < 1.0 { coordinate * eta / (1.0 - eta) } else { f64::INFINITY }
        };
        let off_1 = stretch(reach.x, 0.5 * k1 * (w + d));
        let off_2 = stretch(reach.y, 0.5 * k2 * (reach.z + w));
        let weights: Vec<f64> = (0..n).map(weight).collect();
        let [bent_x, bent_y] =
            [0, 1].map(|k| bilinear_excess(&local.iter().map(|p| p[k]).collect::<Vec<_>>(), &weights, [p, q]));
        // The corners as stored are rounded to f32.
        let rounding = 1.2e-7 * (torus.half[0] + torus.half[1]);
        let along = DVec3::new(bent_x + 2.0 * off_1, (bent_y + 2.0 * off_2) * (1.0 + k2 * w), 0.0).length();
        Some(torus.deviation + along + rounding)
    }
}

/// A bound of |c(y, z, k)|.
fn bound(y: f64, z: f64, k: f64) -> f64 {
    let n = 2.0 * z + k * (y * y + z * z);
    n / (1.0 + (1.0 - k * n).max(0.0).sqrt())
}

/// The largest difference between a coordinate and the bilinear interpolant of its corners, on the control net of
/// coordinate * w - bilinear * w, which has one degree more, over the least weight.
fn bilinear_excess(x: &[f64], w: &[f64], [p, q]: [usize; 2]) -> f64 {
    let at = |i: usize, j: usize| j * (p + 1) + i;
    let corners = [x[at(0, 0)], x[at(p, 0)], x[at(0, q)], x[at(p, q)]];
    let mut largest = 0.0_f64;
    for l in 0..=q + 1 {
        for k in 0..=p + 1 {
            // The product of the net with each of the four bilinear basis functions, and with 1 their sum.
            let mut difference = 0.0;
            for b in 0..2 {
                for a in 0..2 {
                    let share = |index: usize, upper: usize, degree: usize| {
                        let part = if upper == 1 { index } else { degree + 1 - index };
                        part as f64 / (degree + 1) as f64
                    };
                    if k >= a && k - a <= p && l >= b && l - b <= q {
                        let i = at(k - a, l - b);
                        difference += share(k, a, p) * share(l, b, q) * w[i] * (x[i] - corners[2 * b + a]);
                    }
                }
            }
            largest = largest.max(difference.abs());
        }
    }
    largest / w.iter().copied().fold(f64::INFINITY, f64::min)
}

impl SurfaceTree {
    /// Splits every Bezier patch until the trimmed torus of each piece is within `eps` of it, or the height is
    /// reached.
    pub fn toroidal_cover(&self, eps: f64, job: &Job) -> ToroidalCover {
        let mut cover = ToroidalCover { complete: true, ..ToroidalCover::default() };
        let count = self.patches().len().max(1) as f64;
        for (at, patch) in (0_u32..).zip(self.patches()) {
            let mut stack: Vec<u32> = if patch.height() == 0 { Vec::new() } else { vec![7, 6, 5, 4] };
            while let Some(index) = stack.pop() {
                if job.is_cancelled() {
                    cover.complete = false;
                    return cover;
                }
                let bound = patch.hausdorff(index).unwrap_or(f64::INFINITY);
                let node = NodeId { patch: at, index };
                if bound <= eps {
                    cover.tori.push(node);
                } else if index < patch.first_leaf() {
                    stack.extend([3, 2, 1, 0].map(|k| 4 * index + k));
                    continue;
                } else {
                    cover.missed.push(node);
                }
                cover.largest = cover.largest.max(bound);
            }
            job.progress(f64::from(at + 1) / count);
        }
        cover
    }
}
