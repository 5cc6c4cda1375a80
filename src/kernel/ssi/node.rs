//! A point of a traced curve, and the cubic between two of them.

use glam::{DVec2, DVec3};

use super::contact::SLACK;
use super::correct::PointPair;
use super::piece::Jet1;

/// A traced point.
#[derive(Clone, Copy, Debug)]
pub struct TraceNode {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// The parameters.
    pub at: PointPair,
    /// The point midway between the surfaces.
    pub p: DVec3,
    /// The unit tangent in the sense of the travel.
    pub tangent: DVec3,
    /// How fast the four parameters change with arc length.
    pub rates: [f64; 4],
    /// The sine of the angle between the surfaces, at least [`LEAST_SINE`].
    pub sine: f64,
    /// The sign of the tangent against N_A x N_B; 0 on tangential curves.
    pub sense: f64,
    /// How far `p` is from the points of both surfaces at the parameters.
    pub off: f64,
}

/// The smallest sine of an angle that is told from 0.
pub const LEAST_SINE: f64 = 1e-11;

impl TraceNode {
    /// The same point travelled the other way.
    #[must_use]
    pub fn reversed(self) -> Self {
        Self { tangent: -self.tangent, rates: self.rates.map(|r| -r), sense: -self.sense, ..self }
    }

    /// The same curve point seen with the sides exchanged.
    pub fn same_pair(&self, other: &Self) -> bool {
        self.pa == other.pa && self.pb == other.pb
    }
}

/// Whether a point lies on the border of its piece on either side.
pub fn on_border(node: &TraceNode) -> bool {
    node.at.to_array().iter().any(|x| !(2.0 * SLACK..=1.0 - 2.0 * SLACK).contains(x))
}

/// The length of the chords through points, up to each of them.
pub fn lengths(nodes: &[TraceNode]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = nodes.windows(2).map(|w| w[0].p.distance(w[1].p));
    let after = steps.map(|step| {
        sum += step;
        sum
    });
    std::iter::once(0.0).chain(after).collect()
}

/// The weights of both points, and of their derivatives by arc length.
fn hermite_weights(a: &TraceNode, b: &TraceNode, f: f64) -> [f64; 4] {
    let (h, g) = (a.p.distance(b.p), 1.0 - f);
    [g * g * (1.0 + 2.0 * f), f * f * (3.0 - 2.0 * f), g * g * f * h, -f * f * g * h]
}

/// The point at a fraction between two points of the same pair of pieces.
pub fn along(a: &TraceNode, b: &TraceNode, f: f64) -> DVec3 {
    let [wa, wb, ta, tb] = hermite_weights(a, b, f);
    a.p * wa + b.p * wb + a.tangent * ta + b.tangent * tb
}

/// The parameters at a fraction between two points of the same pair of pieces.
pub fn hermite(a: &TraceNode, b: &TraceNode, f: f64) -> PointPair {
    let (x, y) = (a.at.to_array(), b.at.to_array());
    let weights = hermite_weights(a, b, f);
    let mut out = [0.0; 4];
    for (k, out) in out.iter_mut().enumerate() {
        *out = weights[0] * x[k] + weights[1] * y[k] + weights[2] * a.rates[k] + weights[3] * b.rates[k];
    }
    PointPair::from_array(out)
}

fn rates_of(u: DVec3, v: DVec3, t: DVec3) -> Option<DVec2> {
    let (e, f, g) = (u.length_squared(), u.dot(v), v.length_squared());
    let det = e * g - f * f;
    if !(det > 1e-20 * e * g) {
        return None;
    }
    let (a, b) = (u.dot(t), v.dot(t));
    Some(DVec2::new((g * a - f * b) / det, (e * b - f * a) / det))
}

/// How fast the four parameters change along a unit tangent.
pub fn rates(a: &Jet1, b: &Jet1, tangent: DVec3) -> Option<[f64; 4]> {
    let (ra, rb) = (rates_of(a.u, a.v, tangent)?, rates_of(b.u, b.v, tangent)?);
    Some([ra.x, ra.y, rb.x, rb.y])
}
