//! Junctions: points where the surfaces touch, and the arms that leave them.
//!
//! Around a contact the gap is sampled on circles in the common tangent plane, on whatever pieces lie there; its sign
//! changes are the arms. That needs no second-order model, counts arms of any junction (none: an isolated contact,
//! four: two branches that cross), works on borders and corners of patches, and bridges the disc in which corrected
//! points are useless: a point at distance rho from the contact, where the surfaces meet at angle theta, is only good
//! to about 3 eps / (theta rho), while the angle of a sign change on a circle is good to eps / (theta rho^2).

use glam::{DVec2, DVec3};

use super::binormal::Binormal;
use super::correct::PointPair;
use super::gap_fit::foot_along;
use super::node::{TraceNode, rates};
use super::piece::Patch;
use super::side::{Place, Side};

/// One arm of a junction, from the junction outwards.
#[derive(Clone, Debug)]
pub struct Arm {
    /// Points from the junction to the circle; the tangents point outwards.
    pub nodes: Vec<TraceNode>,
    /// Whether a curve has been attached.
    pub used: bool,
}

/// A contact with its arms.
#[derive(Clone, Debug)]
pub struct Contacted {
    /// The contact.
    pub binormal: Binormal,
    /// The pieces on which it was found.
    pub pair: [usize; 2],
    /// The radius of the disc.
    pub radius: f64,
    /// The arms.
    pub arms: Vec<Arm>,
}

/// A point of the circle: the gap with the places on both sides.
#[derive(Clone, Copy, Debug)]
struct Sample {
    gap: f64,
    a: Place,
    b: Place,
}

struct Ring<'a> {
    sides: [&'a Side; 2],
    center: DVec3,
    n: DVec3,
    frame: [DVec3; 2],
    places: [Vec<Place>; 2],
}

impl Ring<'_> {
    fn on_side(&self, side: usize, p: DVec3) -> Option<(Place, DVec3)> {
        let mut best: Option<(f64, Place, DVec3)> = None;
        for place in &self.places[side] {
            let piece = &self.sides[side].pieces[place.piece];
            let Some((uv, jet)) = foot_along(piece, p, self.frame, place.uv) else { continue };
            // Another sheet of the side may pass nearby.
            if (jet.p - self.center).dot(self.n).abs() > 0.25 * p.distance(self.center) + 1e-9 {
                continue;
            }
            let out = (-uv).max(uv - 1.0).max_element();
            if best.as_ref().is_none_or(|(o, ..)| out < *o) {
                best = Some((out, Place { piece: place.piece, uv }, jet.p));
            }
            if out <= 0.0 {
                break;
            }
        }
        best.filter(|(out, ..)| *out < 1e-6).map(|(_, place, p)| (place, p))
    }

    fn sample(&self, angle: f64, radius: f64) -> Option<Sample> {
        let d = DVec2::from_angle(angle) * radius;
        let p = self.center + self.frame[0] * d.x + self.frame[1] * d.y;
        let (a, pa) = self.on_side(0, p)?;
        let (b, pb) = self.on_side(1, p)?;
        Some(Sample { gap: (pa - pb).dot(self.n), a, b })
    }

    /// The angles of all sign changes on a circle.
    fn changes(&self, radius: f64, angles: &[f64]) -> Vec<f64> {
        let samples: Vec<Option<Sample>> = angles.iter().map(|&t| self.sample(t, radius)).collect();
        let mut out = Vec::new();
        for k in 0..angles.len() {
            let next = (k + 1) % angles.len();
            let (Some(x), Some(y)) = (&samples[k], &samples[next]) else { continue };
            if (x.gap < 0.0) == (y.gap < 0.0) {
                continue;
            }
            let (mut low, mut high) = (angles[k], angles[next]);
            if high < low {
                high += std::f64::consts::TAU;
            }
            for _ in 0..52 {
                let middle = 0.5 * (low + high);
                match self.sample(middle, radius) {
                    Some(s) if (s.gap < 0.0) == (x.gap < 0.0) => low = middle,
                    Some(_) => high = middle,
                    None => break,
                }
            }
            out.push(0.5 * (low + high));
        }
        out
    }

    /// A node of an arm at an angle of a circle.
    fn node(&self, angle: f64, radius: f64) -> Option<TraceNode> {
        let s = self.sample(angle, radius)?;
        let (ja, jb) = (self.sides[0].pieces[s.a.piece].jet1(s.a.uv), self.sides[1].pieces[s.b.piece].jet1(s.b.uv));
        let p = 0.5 * (ja.p + jb.p);
        Some(TraceNode {
            pa: s.a.piece,
            pb: s.b.piece,
            at: PointPair { uv: s.a.uv, st: s.b.uv },
            p,
            tangent: DVec3::ZERO,
            rates: [0.0; 4],
            sine: 1.0,
            sense: 0.0,
            off: 0.5 * ja.p.distance(jb.p),
        })
    }
}

/// Finds the arms of a contact. `radius` is the largest disc wanted; it shrinks until the circles agree.
/// `None` when they never do.
pub fn arms_of(
    sides: [&Side; 2],
    binormal: Binormal,
    pair: [usize; 2],
    mut radius: f64,
    joining: f64,
) -> Option<Contacted> {
    let ring = ring_around(sides, &binormal, pair, joining);
    let wide = ring_around(sides, &binormal, pair, joining.max(radius));
    // Evenly spread angles, and the middles of the lobes that the second-order form predicts.
    let mut angles: Vec<f64> = (0..64).map(|k| f64::from(k) * std::f64::consts::TAU / 64.0 + 0.003).collect();
    let (_, e, _) = binormal.principal();
    for k in 0..4 {
        let t = e.to_angle() + f64::from(k) * std::f64::consts::FRAC_PI_2;
        angles.push(t.rem_euclid(std::f64::consts::TAU));
    }
    angles.sort_by(f64::total_cmp);
    for _ in 0..14 {
        let circles = [1.0, 0.5, 0.25].map(|f| ring.changes(f * radius, &angles));
        let count = circles[0].len();
        let matched = circles[1].len() == count && circles[2].len() == count;
        let near = |x: f64, y: f64| {
            let d = (x - y).rem_euclid(std::f64::consts::TAU);
            d.min(std::f64::consts::TAU - d)
        };
        let spread = |t: f64, list: &[f64]| list.iter().map(|&s| near(s, t)).fold(f64::INFINITY, f64::min);
        let agree = matched
            && circles[0].iter().all(|&t| spread(t, &circles[1]) < 0.2 && spread(t, &circles[2]) < 0.3)
            && (count == 0 || count >= 2 || !closed(&ring, radius))
            && stays(&ring, &wide, radius);
        if agree {
            let arms = circles[0].iter().filter_map(|&t| {
                let pick = |list: &[f64]| list.iter().copied().min_by(|&x, &y| near(x, t).total_cmp(&near(y, t)));
                arm(&ring, radius, [pick(&circles[2])?, pick(&circles[1])?, t])
            });
            let arms: Vec<Arm> = arms.collect();
            if arms.len() == count {
                return Some(Contacted { binormal, pair, radius, arms });
            }
        }
        radius *= 0.5;
    }
    None
}

/// Whether the gap is clearly open on nearly all of a circle: what is closed inside it is a point contact.
pub fn is_point(sides: [&Side; 2], binormal: &Binormal, pair: [usize; 2], radius: f64, joining: f64, gap: f64) -> bool {
    let ring = ring_around(sides, binormal, pair, joining.max(radius));
    let open = (0..32).filter(|&k| {
        let s = ring.sample(f64::from(k) * std::f64::consts::TAU / 32.0 + 0.01, radius);
        s.is_some_and(|s| s.gap.abs() > 4.0 * gap)
    });
    open.count() >= 24
}

/// The circles around a contact on all pieces within `reach` of it.
fn ring_around<'a>(sides: [&'a Side; 2], binormal: &Binormal, pair: [usize; 2], reach: f64) -> Ring<'a> {
    let places = [sides[0].around(binormal.p, reach), sides[1].around(binormal.p, reach)];
    let own = [Place { piece: pair[0], uv: binormal.at.uv }, Place { piece: pair[1], uv: binormal.at.st }];
    let places = [0, 1].map(|k| {
        let mut list = vec![own[k]];
        list.extend(places[k].iter().filter(|p| p.piece != own[k].piece));
        list
    });
    Ring { sides, center: binormal.p, n: binormal.n, frame: binormal.frame, places }
}

/// Whether a circle leaves the pieces around its middle only where the sides end: arms do not change pieces in it.
fn stays(ring: &Ring<'_>, wide: &Ring<'_>, radius: f64) -> bool {
    let mut angles = (0..32).map(|k| f64::from(k) * std::f64::consts::TAU / 32.0 + 0.01);
    angles.all(|t| ring.sample(t, radius).is_some() || wide.sample(t, radius).is_none())
}

/// Whether the whole circle lies on both sides.
fn closed(ring: &Ring<'_>, radius: f64) -> bool {
    (0..16).all(|k| ring.sample(f64::from(k) * 0.39, radius).is_some())
}

/// The nodes of one arm through its angles on the circles at 1/4, 1/2 and 1 of the radius.
fn arm(ring: &Ring<'_>, radius: f64, angles: [f64; 3]) -> Option<Arm> {
    let outer =
        [ring.node(angles[0], 0.25 * radius)?, ring.node(angles[1], 0.5 * radius)?, ring.node(angles[2], radius)?];
    let pair = [outer[2].pa, outer[2].pb];
    let on_pair = |side: usize, p: DVec3| {
        let start = ring.places[side].iter().find(|q| q.piece == pair[side])?;
        foot_along(&ring.sides[side].pieces[pair[side]], p, ring.frame, start.uv)
    };
    let mut nodes = Vec::new();
    for p in [ring.center, outer[0].p, outer[1].p, outer[2].p] {
        let ((uv, ja), (st, jb)) = (on_pair(0, p)?, on_pair(1, p)?);
        nodes.push(TraceNode {
            pa: pair[0],
            pb: pair[1],
            at: PointPair { uv, st },
            p: 0.5 * (ja.p + jb.p),
            tangent: DVec3::ZERO,
            rates: [0.0; 4],
            sine: 1.0,
            sense: 0.0,
            off: 0.5 * ja.p.distance(jb.p),
        });
    }
    // Tangents from the parabola through the neighbours.
    let at = [0.0, 0.25, 0.5, 1.0];
    let points: Vec<DVec3> = nodes.iter().map(|n| n.p).collect();
    for k in 0..4 {
        let (i, j, l) = if k == 0 {
            (0, 1, 2)
        } else if k == 3 {
            (1, 2, 3)
        } else {
            (k - 1, k, k + 1)
        };
        let t = at[k];
        let slope = points[i] * ((2.0 * t - at[j] - at[l]) / ((at[i] - at[j]) * (at[i] - at[l])))
            + points[j] * ((2.0 * t - at[i] - at[l]) / ((at[j] - at[i]) * (at[j] - at[l])))
            + points[l] * ((2.0 * t - at[i] - at[j]) / ((at[l] - at[i]) * (at[l] - at[j])));
        nodes[k].tangent = slope.normalize_or_zero();
        let (a, b) = (&ring.sides[0].pieces[pair[0]], &ring.sides[1].pieces[pair[1]]);
        nodes[k].rates = rates(&a.jet1(nodes[k].at.uv), &b.jet1(nodes[k].at.st), nodes[k].tangent)?;
    }
    Some(Arm { nodes, used: false })
}
