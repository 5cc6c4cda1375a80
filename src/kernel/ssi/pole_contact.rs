//! Poles in which one side touches the other: a ball that rests on a plane on its pole, the tip of a cone on a surface.
//!
//! In a pole (a border of a piece that is one point) a surface has no parameters that a gap could be fitted over, so that
//! neither nodes nor gaps say what is there. Where a pole lies on the other side within the contact distance, and pieces go
//! all around it, the sign of the height over the other side is looked at on circles around the pole. When it is the same
//! on all of them the pole is an isolated contact, and what nothing else decided within the smallest circle belongs to it.
//! Otherwise curves run into the pole, and the tracer follows them.
//!
//! Cost: a box test for each pole, and some thousand evaluations where one touches. A circle smaller than the smallest one
//! is not looked at: a loop inside it is lower than the contact distance.

use glam::{DVec2, DVec3};

use super::binormal::Binormal;
use super::correct::PointPair;
use super::engine::Engine;
use super::gap_fit::frame_across;
use super::junction::Contacted;
use super::piece::Patch;
use super::side::{BorderEdge, Place, Side, closest};

/// The radii of the circles, in the unit frame.
const CIRCLES: [f64; 5] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2];
/// How many points are looked at on each piece of a circle.
const SAMPLES: usize = 8;

/// The degenerate borders of a side in a point, each piece once.
fn fan(side: &Side, p: DVec3, joining: f64) -> Vec<&BorderEdge> {
    let near = (0..side.pieces.len()).filter(|&k| side.bounds[k].grown(joining).contains(p));
    let borders = near.flat_map(|k| side.borders_of(k));
    borders.filter(|e| e.is_pole(joining) && e.bounds.center().distance(p) <= joining).collect()
}

/// The parameters at a fraction along a degenerate border, at a distance from it.
fn beside(edge: &BorderEdge, along: f64, distance: f64) -> DVec2 {
    let mut uv = DVec2::splat(along);
    uv[edge.fixed] = if edge.value > 0.5 { 1.0 - distance } else { distance };
    uv
}

/// Whether pieces go all around a pole: beyond both ends of every degenerate border there is another piece.
fn is_closed(side: &Side, fan: &[&BorderEdge], joining: f64) -> bool {
    !fan.is_empty()
        && fan.iter().all(|edge| {
            [0.0, 1.0].into_iter().all(|end| {
                let place = Place { piece: edge.piece, uv: beside(edge, end, 0.05) };
                let p = side.pieces[edge.piece].point(place.uv);
                !side.across(place, 1 - edge.fixed, p, joining).is_empty()
            })
        })
}

/// Whether a place lies inside a side: on no border, on one that another piece continues, or in a pole with pieces all
/// around.
fn is_inside(side: &Side, place: Place, p: DVec3, joining: f64) -> bool {
    let own = fan(side, p, joining);
    if !own.is_empty() {
        return is_closed(side, &own, joining);
    }
    let mut borders = side.borders_of(place.piece).iter();
    borders.all(|e| {
        (place.uv[e.fixed] - e.value).abs() > 1e-9 || {
            let mut on = place;
            on.uv[e.fixed] = e.value;
            !side.across(on, e.fixed, p, joining).is_empty()
        }
    })
}

/// The normal of a side in a place: in a pole that of the pieces around it together.
fn normal(side: &Side, place: Place, p: DVec3, joining: f64) -> DVec3 {
    let own = fan(side, p, joining);
    if own.is_empty() {
        return side.pieces[place.piece].jet1(place.uv).cross().normalize_or_zero();
    }
    let sides = own.iter().map(|e| side.pieces[e.piece].jet1(beside(e, 0.5, 1e-3)).cross().normalize_or_zero());
    sides.sum::<DVec3>().normalize_or_zero()
}

impl Engine {
    /// Adds the poles of either side that touch the other one in themselves only.
    pub(super) fn find_pole_contacts(&mut self) {
        let joining = self.trace.joining;
        for side in 0..2 {
            let borders = (0..self.sides[side].pieces.len()).flat_map(|k| self.sides[side].borders_of(k));
            let mut poles: Vec<DVec3> = borders.filter(|e| e.is_pole(joining)).map(|e| e.bounds.center()).collect();
            poles.dedup_by(|x, y| x.distance(*y) <= joining);
            for p in poles {
                if self.contacts.iter().any(|c| c.binormal.p.distance(p) <= joining) {
                    continue;
                }
                self.contacts.extend(self.pole_contact(side, p));
            }
        }
    }

    fn pole_contact(&self, side: usize, p: DVec3) -> Option<Contacted> {
        let joining = self.trace.joining;
        let (own, other) = (&self.sides[side], &self.sides[1 - side]);
        let off = |place: &Place| other.pieces[place.piece].point(place.uv).distance(p);
        let places = other.around(p, self.gap);
        let place = *places.iter().min_by(|x, y| off(x).total_cmp(&off(y)))?;
        let fan = fan(own, p, joining);
        if !is_closed(own, &fan, joining) || !is_inside(other, place, p, joining) {
            return None;
        }
        let n = normal(other, place, p, joining);
        let (mut sign, mut smallest) = (0.0, f64::INFINITY);
        for radius in CIRCLES {
            for edge in &fan {
                let piece = &own.pieces[edge.piece];
                let jet = piece.jet1(beside(edge, 0.5, 0.0));
                let speed = if edge.fixed == 0 { jet.u } else { jet.v }.length();
                let distance = if speed > 0.0 { (radius / speed).min(0.5) } else { 0.01 };
                for k in 0..SAMPLES {
                    let along = (k as f64 + 0.5) / SAMPLES as f64;
                    let x = piece.point(beside(edge, along, distance));
                    let near = (0..other.pieces.len()).filter(|&k| other.bounds[k].grown(2.0 * radius).contains(x));
                    let feet = near.filter_map(|k| Some((k, closest(&other.pieces[k], x)?)));
                    let (piece, (foot, far)) = feet.min_by(|x, y| x.1.1.total_cmp(&y.1.1))?;
                    let height = (x - other.pieces[piece].point(foot)).dot(n);
                    if far <= self.gap || height * sign < 0.0 {
                        return None;
                    }
                    sign = height.signum();
                    smallest = smallest.min(x.distance(p));
                }
            }
        }
        let foot = other.pieces[place.piece].point(place.uv);
        let (a, b) = if side == 0 { (p, foot) } else { (foot, p) };
        let pole = Place { piece: fan[0].piece, uv: beside(fan[0], 0.5, 0.0) };
        let (on_a, on_b) = if side == 0 { (pole, place) } else { (place, pole) };
        // Gaps are measured along the normal of A.
        let n = if normal(&self.sides[0], on_a, p, joining).dot(n) < 0.0 { -n } else { n };
        let binormal = Binormal {
            at: PointPair { uv: on_a.uv, st: on_b.uv },
            p: 0.5 * (a + b),
            n,
            frame: frame_across(n),
            gap: (a - b).dot(n),
            gradient: DVec2::ZERO,
            form: [0.0; 3],
        };
        Some(Contacted { binormal, pair: [on_a.piece, on_b.piece], radius: smallest, arms: Vec::new() })
    }
}
