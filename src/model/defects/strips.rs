//! Crossings near the edges of faces, where triangles cannot tell a crossing from two neighbours that meet.
//!
//! From places along every edge of one face that are near another face, a line runs into the face, square to the edge.
//! Where its signed distance from the other surface, along that surface's normal, goes through zero the surfaces cross;
//! Newton brings the place to rounding. It counts when it is inside both faces and further from the edges of both than the
//! tolerance, and than the edges themselves are off their surfaces. Neighbours that merely meet do not count: their surfaces meet at the edge, or beyond that of the other.
//!
//! Cost: [`PLACES`] places an edge that is near, [`QUARTERINGS`] feet each, some hundred microseconds an edge. A crossing
//! shorter than the distance of two places may be missed.

use glam::{DVec2, DVec3};

use super::crossings::Part;
use crate::kernel::geom::trim::{EdgeRole, FaceEdge, Sheet};
use crate::kernel::geom::{Curve, Side, Surface};
use crate::kernel::job::Job;

/// Places along an edge, at equal distances.
const PLACES: usize = 48;
/// Distances from the edge that are looked at: each a quarter of the one before, the first being the margin.
const QUARTERINGS: usize = 7;
/// Steps of Newton's method.
const STEPS: usize = 20;
/// The sine of the least angle at which surfaces cross.
pub(super) const LEAST_SINE: f64 = 1e-4;

/// An edge of a sheet as it is walked along.
pub(super) struct Border {
    /// The edge in space.
    pub(super) curve: Curve,
    /// Whether the sheet is on the right of the curve, seen from the tip of the normal.
    reversed: bool,
    on: On,
}

/// Where the edge runs on the surface.
enum On {
    Side(Side),
    Edge(Box<FaceEdge>),
}

impl Border {
    /// The surface parameters at a parameter of the curve.
    fn uv(&self, surface: &Surface, t: f64) -> DVec2 {
        let [u, v] = surface.domain();
        match &self.on {
            On::Side(Side::VMin) => DVec2::new(t, v[0]),
            On::Side(Side::UMax) => DVec2::new(u[1], t),
            On::Side(Side::VMax) => DVec2::new(t, v[1]),
            On::Side(Side::UMin) => DVec2::new(u[0], t),
            On::Edge(edge) => edge.uv(t),
        }
    }

    /// The largest distance between the curve and the place of the surface with its parameters.
    pub(super) fn off(&self, surface: &Surface) -> f64 {
        let apart = |(t, p): (f64, DVec3)| surface.eval(surface.clamped(self.uv(surface, t))).distance(p);
        self.curve.sampled(4).into_iter().map(apart).fold(0.0, f64::max)
    }

    /// Parameters at equal distances along the curve, its ends among them, and the distance.
    fn places(&self) -> (Vec<f64>, f64) {
        let samples = self.curve.sampled(8);
        let mut along = vec![0.0];
        for pair in samples.windows(2) {
            along.push(along[along.len() - 1] + pair[0].1.distance(pair[1].1));
        }
        let total = along[along.len() - 1];
        let step = total / (PLACES - 1) as f64;
        let at = |k: usize| {
            let want = step * k as f64;
            let i = along.partition_point(|&s| s < want).clamp(1, samples.len() - 1);
            let share = (want - along[i - 1]) / (along[i] - along[i - 1]);
            let (a, b) = (samples[i - 1].0, samples[i].0);
            if share.is_finite() { a + (b - a) * share.clamp(0.0, 1.0) } else { b }
        };
        ((0..PLACES).map(at).collect(), step)
    }
}

/// The edges of a sheet.
pub(super) fn borders(sheet: &Sheet) -> Vec<Border> {
    match sheet.face() {
        None => {
            // Fails on no valid surface.
            let border = |(slot, side): (usize, Side)| {
                let curve = sheet.surface().border(side).ok()?;
                Some(Border { curve, reversed: slot >= 2, on: On::Side(side) })
            };
            Side::ALL.into_iter().enumerate().filter_map(border).collect()
        }
        Some(face) => {
            let edges = face.rings().iter().flat_map(|r| &r.edges).filter(|e| e.role != EdgeRole::Cut);
            let border = |e: &FaceEdge| Border {
                curve: e.curve.as_ref().clone(),
                reversed: e.reversed,
                on: On::Edge(Box::new(e.clone())),
            };
            edges.map(border).collect()
        }
    }
}

/// A crossing near edges.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Its deepest place.
    pub(super) at: DVec3,
    /// How far that is from the edges of both faces.
    pub(super) depth: f64,
    /// The length of the edges along which it was met.
    pub(super) length: f64,
    /// All places.
    pub(super) places: Vec<DVec3>,
}

/// Looks within `margin` of the edges of both faces for places where they cross deeper than `least`.
pub(super) fn find(p: &Part<'_>, q: &Part<'_>, margin: f64, least: f64, job: &Job) -> Option<Found> {
    let mut found = Found { at: DVec3::ZERO, depth: 0.0, length: 0.0, places: Vec::new() };
    for (own, other) in [(p, q), (q, p)] {
        for border in &own.borders {
            if job.is_cancelled() {
                return None;
            }
            let (places, step) = border.places();
            if !(step > 0.0) {
                continue;
            }
            for t in places {
                if let Some((x, depth)) = inwards(own, border, t, other, margin, least) {
                    if depth > found.depth {
                        (found.at, found.depth) = (x, depth);
                    }
                    found.length += step;
                    found.places.push(x);
                }
            }
        }
    }
    (!found.places.is_empty()).then_some(found)
}

/// The deepest crossing with the other face on the line that runs inwards from a place of an edge.
fn inwards(own: &Part<'_>, border: &Border, t: f64, other: &Part<'_>, margin: f64, least: f64) -> Option<(DVec3, f64)> {
    let x = border.curve.eval(t);
    if !other.bounds.grown(2.0 * margin).contains(x) {
        return None;
    }
    let near = other.tree.nearest(x, 2.0 * margin)?;
    let surface = own.sheet.surface();
    let from = surface.clamped(border.uv(surface, t));
    let jet = surface.jet(from, 1);
    let normal = jet.normal()?;
    let along = border.curve.derivatives(t, 1)[1].try_normalize()? * if border.reversed { -1.0 } else { 1.0 };
    let line = normal.cross(along);
    // The parameters of a step of length 1 along the line.
    let (e, f, g) = (jet.u().length_squared(), jet.u().dot(jet.v()), jet.v().length_squared());
    let (a, b) = (jet.u().dot(line), jet.v().dot(line));
    let step = DVec2::new(a * g - b * f, b * e - a * f) / (e * g - f * f);
    if !step.is_finite() {
        return None;
    }
    let mut best: Option<(DVec3, f64)> = None;
    let mut st = other.uv(near.triangle);
    for k in 0..QUARTERINGS {
        let s = margin * 0.25_f64.powi(k as i32);
        if s < 0.5 * least {
            break;
        }
        let Some((distance, slope, foot)) = distance(own, from + step * s, step, other, st) else { continue };
        st = foot;
        // Only what the line's direction here promises between the neighbouring places.
        let root = s - distance / slope;
        if !(root > 0.2 * s && root < 5.0 * s) {
            continue;
        }
        let Some((x, depth)) = settled(own, from, step, root, other, st) else { continue };
        if depth > least && best.is_none_or(|(_, deepest)| depth > deepest) {
            best = Some((x, depth));
        }
    }
    best
}

/// The signed distance of a place from the other surface, its change for a step, and the foot there. Not where the foot is
/// at the border of the surface.
fn distance(own: &Part<'_>, uv: DVec2, step: DVec2, other: &Part<'_>, start: DVec2) -> Option<(f64, f64, DVec2)> {
    let surface = own.sheet.surface();
    if surface.clamped(uv) != uv {
        return None;
    }
    let jet = surface.jet(uv, 1);
    let foot = other.foot(jet.p(), start);
    let normal = other.sheet.surface().jet(foot.uv, 1).normal()?;
    let off = jet.p() - foot.point;
    let distance = off.dot(normal);
    // At a border the foot is not below the place.
    let square = (off - normal * distance).length() <= 1e-3 * distance.abs() + 1e-12 * jet.p().length();
    square.then(|| (distance, (jet.u() * step.x + jet.v() * step.y).dot(normal), foot.uv))
}

/// The crossing brought to rounding, and its distance from the edges of both faces.
fn settled(
    own: &Part<'_>,
    from: DVec2,
    step: DVec2,
    start: f64,
    other: &Part<'_>,
    mut st: DVec2,
) -> Option<(DVec3, f64)> {
    let close = 1e-10 * (own.bounds.diagonal() + other.bounds.diagonal());
    let mut s = start;
    for _ in 0..STEPS {
        let (distance, slope, foot) = distance(own, from + step * s, step, other, st)?;
        st = foot;
        if distance.abs() <= close {
            let uv = from + step * s;
            let normals = [(own, uv), (other, st)].map(|(part, at)| part.sheet.surface().jet(at, 1).normal());
            let [Some(m), Some(n)] = normals else { return None };
            let inside = own.sheet.reaches(uv, 0.0) && other.sheet.reaches(st, 0.0);
            let x = own.sheet.surface().eval(uv);
            return (inside && m.cross(n).length() > LEAST_SINE).then(|| (x, own.depth(x).min(other.depth(x))));
        }
        let next = s - distance / slope;
        if !(next > 0.1 * start && next < 10.0 * start) {
            return None;
        }
        s = next;
    }
    None
}
