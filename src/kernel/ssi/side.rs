//! One side of an intersection: its surfaces as Bezier pieces in the common frame, and which piece comes next.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::piece::{Patch, Piece};
use crate::kernel::geom::{Aabb, Surface};

/// The frame in which the intersector works: a model point x becomes (x - origin) scale, with `scale` a power of
/// two, so that the model's size lies between 1 and 2 and scaling loses no digit.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// What is subtracted; zero unless the model is far away from the origin.
    pub origin: DVec3,
    /// What multiplies.
    pub scale: f64,
}

impl Frame {
    /// The frame of a model with this bounding box.
    pub fn of(bounds: &Aabb) -> Self {
        let diagonal = bounds.diagonal();
        let diagonal = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
        let scale = (-diagonal.log2().floor()).clamp(-1000.0, 1000.0).exp2();
        // Near the origin subtracting would only round.
        let center = bounds.center();
        let origin = if center.length() > 2.0 * diagonal { center } else { DVec3::ZERO };
        Self { origin, scale }
    }

    /// A point of the frame in the model.
    pub fn to_model(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.origin
    }
}

/// A border of a piece at which its surface ends.
#[derive(Clone, Debug)]
pub struct BorderEdge {
    /// Which piece.
    pub piece: usize,
    /// 0: u is fixed, 1: v is fixed.
    pub fixed: usize,
    /// At what value, 0 or 1.
    pub value: f64,
    /// A box around it.
    pub bounds: Aabb,
}

impl BorderEdge {
    /// Whether it is one point, to within `joining`: a pole.
    pub fn is_pole(&self, joining: f64) -> bool {
        self.bounds.diagonal() <= joining
    }
}

/// A place on a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Which piece.
    pub piece: usize,
    /// Its local parameters.
    pub uv: DVec2,
}

/// The pieces of one side.
#[derive(Clone, Debug, Default)]
pub struct Side {
    /// All pieces, surface after surface, v-rows one after the other.
    pub pieces: Vec<Piece>,
    /// A box around each piece.
    pub bounds: Vec<Aabb>,
    grids: HashMap<usize, (usize, [usize; 2])>,
    borders: Vec<BorderEdge>,
}

impl Side {
    /// The pieces of numbered surfaces.
    pub fn new(surfaces: &[(usize, &Surface)], frame: &Frame) -> Self {
        let mut side = Self::default();
        for &(number, surface) in surfaces {
            let counts = [surface.knots()[0].breaks().len() - 1, surface.knots()[1].breaks().len() - 1];
            side.grids.insert(number, (side.pieces.len(), counts));
            for (k, patch) in surface.bezier_patches().iter().enumerate() {
                let index = [k % counts[0], k / counts[0]];
                let piece = Piece::new(patch, number, index, frame.origin, frame.scale);
                side.bounds.push(Aabb::of(piece.points.iter().map(|p| p.truncate() / p.w)));
                for fixed in 0..2 {
                    for (value, at_end) in [(0.0, index[fixed] == 0), (1.0, index[fixed] + 1 == counts[fixed])] {
                        if at_end {
                            let bounds = edge_bounds(&piece, fixed, value);
                            side.borders.push(BorderEdge { piece: side.pieces.len(), fixed, value, bounds });
                        }
                    }
                }
                side.pieces.push(piece);
            }
        }
        side
    }

    /// The borders of a piece at which its surface ends.
    pub fn borders_of(&self, piece: usize) -> &[BorderEdge] {
        let first = self.borders.partition_point(|e| e.piece < piece);
        let count = self.borders[first..].partition_point(|e| e.piece == piece);
        &self.borders[first..first + count]
    }

    /// The piece beyond a border of a piece within the same surface.
    pub fn neighbour(&self, piece: usize, fixed: usize, value: f64) -> Option<usize> {
        let p = &self.pieces[piece];
        let (first, counts) = *self.grids.get(&p.surface)?;
        let mut index = p.index;
        if value > 0.5 {
            index[fixed] += 1;
            if index[fixed] >= counts[fixed] {
                return None;
            }
        } else {
            index[fixed] = index[fixed].checked_sub(1)?;
        }
        Some(first + index[1] * counts[0] + index[0])
    }

    /// Where the point `p`, which lies on a border (`fixed` parameter 0 or 1) of a piece, lies on the pieces beyond:
    /// with the parameter that is fixed there: the neighbour of the same surface, or every border of another piece (or the opposite seam) within `joining`.
    pub fn across(&self, place: Place, fixed: usize, p: DVec3, joining: f64) -> Vec<(Place, usize)> {
        let value = if place.uv[fixed] > 0.5 { 1.0 } else { 0.0 };
        if let Some(piece) = self.neighbour(place.piece, fixed, value) {
            let mut uv = place.uv;
            uv[fixed] = 1.0 - value;
            return vec![(Place { piece, uv }, fixed)];
        }
        let mut out = Vec::new();
        let along = |piece: &Piece, fixed: usize, uv: DVec2| {
            let jet = piece.jet1(uv);
            if fixed == 0 { jet.v } else { jet.u }.normalize_or_zero()
        };
        let own = along(&self.pieces[place.piece], fixed, place.uv);
        for edge in &self.borders {
            if edge.piece == place.piece && edge.fixed == fixed && edge.value == value {
                continue;
            }
            if !edge.bounds.grown(joining).contains(p) {
                continue;
            }
            if let Some((uv, distance)) = self.onto_edge(edge, p)
                && distance <= joining
            {
                // Borders that cross are near each other in one point only: nothing goes on there.
                let other = along(&self.pieces[edge.piece], edge.fixed, uv);
                if own == DVec3::ZERO || other == DVec3::ZERO || own.dot(other).abs() > 0.9 {
                    out.push((Place { piece: edge.piece, uv }, edge.fixed));
                }
            }
        }
        out
    }

    /// The closest point of a border edge.
    pub fn onto_edge(&self, edge: &BorderEdge, p: DVec3) -> Option<(DVec2, f64)> {
        let piece = &self.pieces[edge.piece];
        let free = 1 - edge.fixed;
        let at = |t: f64| {
            let mut uv = DVec2::splat(edge.value);
            uv[free] = t;
            uv
        };
        let start = (0..=8).map(|k| f64::from(k) / 8.0);
        let mut t = start.min_by(|&x, &y| {
            piece.point(at(x)).distance_squared(p).total_cmp(&piece.point(at(y)).distance_squared(p))
        })?;
        for _ in 0..12 {
            let jet = piece.jet2(at(t));
            let (d1, d2) = if free == 0 { (jet.u, jet.second[0]) } else { (jet.v, jet.second[2]) };
            let slope = d1.dot(jet.p - p);
            let curvature = d1.length_squared() + d2.dot(jet.p - p).max(-0.5 * d1.length_squared());
            if curvature <= 0.0 {
                break;
            }
            let next = (t - slope / curvature).clamp(0.0, 1.0);
            let done = (next - t).abs() < 1e-15;
            t = next;
            if done {
                break;
            }
        }
        Some((at(t), piece.point(at(t)).distance(p)))
    }

    /// Every place of this side within `joining` of the point `p` (a few: pieces meet at borders and corners).
    pub fn around(&self, p: DVec3, joining: f64) -> Vec<Place> {
        let mut out = Vec::new();
        for (piece, bounds) in self.bounds.iter().enumerate() {
            if !bounds.grown(joining).contains(p) {
                continue;
            }
            if let Some((uv, distance)) = closest(&self.pieces[piece], p)
                && distance <= joining
            {
                out.push(Place { piece, uv });
            }
        }
        out
    }
}

/// The closest point of a piece by Gauss-Newton steps, clamped to [0, 1]^2, from the best of a few samples. None of them is on
/// a border: from a pole there is no step.
pub fn closest(piece: &Piece, p: DVec3) -> Option<(DVec2, f64)> {
    let at = |k: i32| (f64::from(k) + 0.5) / 7.0;
    let samples = (0..7).flat_map(|i| (0..7).map(move |j| DVec2::new(at(i), at(j))));
    let start =
        samples.min_by(|&x, &y| piece.point(x).distance_squared(p).total_cmp(&piece.point(y).distance_squared(p)))?;
    Some(closest_from(piece, p, start))
}

/// The same from a start.
pub fn closest_from(piece: &Piece, p: DVec3, start: DVec2) -> (DVec2, f64) {
    let mut uv = start;
    for _ in 0..30 {
        let jet = piece.jet1(uv);
        let r = jet.p - p;
        let (e, f, g) = (jet.u.length_squared(), jet.u.dot(jet.v), jet.v.length_squared());
        let (ru, rv) = (jet.u.dot(r), jet.v.dot(r));
        let det = e * g - f * f;
        if !(det > 1e-24 * e * g) {
            break;
        }
        let step = DVec2::new(-(g * ru - f * rv) / det, -(e * rv - f * ru) / det);
        let mut next = (uv + step).clamp(DVec2::ZERO, DVec2::ONE);
        // With one parameter held at a border the other has its own step.
        if next.x != uv.x + step.x && next.y == uv.y + step.y {
            next.y = (uv.y - (rv + f * (next.x - uv.x)) / g).clamp(0.0, 1.0);
        } else if next.y != uv.y + step.y && next.x == uv.x + step.x {
            next.x = (uv.x - (ru + f * (next.y - uv.y)) / e).clamp(0.0, 1.0);
        }
        let done = next.distance(uv) < 1e-15;
        uv = next;
        if done {
            break;
        }
    }
    (uv, piece.point(uv).distance(p))
}

fn edge_bounds(piece: &Piece, fixed: usize, value: f64) -> Aabb {
    let width = piece.degree[0] + 1;
    let last = piece.degree[fixed];
    let wanted = if value > 0.5 { last } else { 0 };
    let on_edge = piece.points.iter().enumerate().filter(|(k, _)| [k % width, k / width][fixed] == wanted);
    Aabb::of(on_edge.map(|(_, p)| p.truncate() / p.w))
}
