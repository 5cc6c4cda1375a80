//! A surface made ready for self-intersection: Bezier pieces in a domain of [0, 1]^2 and a space of size 1.
//!
//! Moving and scaling the surface first is what makes every tolerance below relative, and keeps coordinates far from
//! the origin from costing digits twice. Closed directions wrap; beyond the border of an open one the end piece
//! continues. Evaluation is direct Bernstein summation: about 50 ns a bicubic point with first derivatives.

use glam::{DVec2, DVec3, DVec4};

use super::hull::Rect;
use crate::kernel::geom::{MAX_DEGREE, Surface};

/// The highest sum of degrees for which pieces are also kept in powers (conditioning gets poor beyond).
const MAX_POWER_DEGREE: usize = 7;

/// One Bezier piece over `low..high` of the unit domain.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub low: DVec2,
    pub high: DVec2,
    /// Homogeneous control points, u fastest.
    pub points: Vec<DVec4>,
    /// Powers of the local coordinates measured from the middle of the piece, u fastest; empty for high degrees.
    pub power: Vec<DVec4>,
}

impl Piece {
    pub fn size(&self) -> DVec2 {
        self.high - self.low
    }
}

/// A point with first and second derivatives, in homogeneous coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct HomogeneousJet {
    pub h: DVec4,
    pub d: [DVec4; 2],
    /// uu, uv, vv.
    pub dd: [DVec4; 3],
}

/// A point with first and second derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Jet {
    pub s: DVec3,
    pub d: [DVec3; 2],
    /// uu, uv, vv.
    pub dd: [DVec3; 3],
}

/// The prepared surface. See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    /// The borders of the pieces, from 0 to 1.
    pub breaks: [Vec<f64>; 2],
    pub degree: [usize; 2],
    pub rational: bool,
    /// Row by row, u fastest.
    pub pieces: Vec<Piece>,
    /// Which directions close on themselves.
    pub periodic: [bool; 2],
    /// Which sides are one point: `poles[d][e]` is the side at e of direction d.
    pub poles: [[bool; 2]; 2],
    /// Space: model = origin + scale * here.
    pub origin: DVec3,
    pub scale: f64,
    /// The domain of the surface, onto which [0, 1]^2 is mapped.
    pub domain: [[f64; 2]; 2],
    /// What rounding leaves of an evaluation, in the space of size 1.
    pub rounding: f64,
}

impl Sheet {
    /// Prepares a surface. `gap` is the distance, in model units, below which opposite sides count as one seam.
    pub fn new(surface: &Surface, gap: f64) -> Self {
        let bounds = surface.bounds();
        let diagonal = bounds.diagonal();
        let scale = if diagonal > 0.0 { diagonal } else { 1.0 };
        let origin = bounds.center();
        let domain = surface.domain();
        let unit = |d: usize, t: f64| (t - domain[d][0]) / (domain[d][1] - domain[d][0]);
        let breaks = [0, 1].map(|d| {
            let mut b: Vec<f64> = surface.knots()[d].breaks().into_iter().map(|t| unit(d, t)).collect();
            if let Some(last) = b.last_mut() {
                *last = 1.0;
            }
            b
        });
        let degree = [0, 1].map(|d| surface.knots()[d].degree());
        let columns = breaks[0].len() - 1;
        let mut pieces: Vec<Piece> = surface
            .bezier_patches()
            .into_iter()
            .enumerate()
            .map(|(at, patch)| {
                let (i, j) = (at % columns, at / columns);
                let points: Vec<DVec4> = patch
                    .points
                    .iter()
                    .map(|h| ((h.truncate() - origin * h.w) / scale).extend(h.w))
                    .map(|h| if patch.rational { h } else { h.truncate().extend(1.0) })
                    .collect();
                let (low, high) =
                    (DVec2::new(breaks[0][i], breaks[1][j]), DVec2::new(breaks[0][i + 1], breaks[1][j + 1]));
                Piece { low, high, points, power: Vec::new() }
            })
            .collect();
        if degree[0] + degree[1] <= MAX_POWER_DEGREE {
            for piece in &mut pieces {
                piece.power = powers(&piece.points, degree);
            }
        }
        let rational = surface.weights().is_some();
        let rounding = 8.0 * f64::EPSILON * (1.0 + bounds.max_abs() / scale);
        let mut sheet = Self {
            breaks,
            degree,
            rational,
            pieces,
            periodic: [false; 2],
            poles: [[false; 2]; 2],
            origin,
            scale,
            domain,
            rounding,
        };
        sheet.periodic = [0, 1].map(|d| sheet.closes(d, (gap / scale).max(1e-12).max(4.0 * rounding)));
        let noise = (gap / scale).max(1e-12).max(4.0 * rounding);
        sheet.poles = [0, 1].map(|d| [0.0, 1.0].map(|end| sheet.is_pole(d, end, noise)));
        sheet
    }

    /// Whether a side is one point.
    fn is_pole(&self, d: usize, end: f64, gap: f64) -> bool {
        let at = |t: f64| if d == 0 { DVec2::new(end, t) } else { DVec2::new(t, end) };
        let first = self.point(at(0.0));
        self.breaks[1 - d]
            .windows(2)
            .all(|b| (1..=8).all(|k| self.point(at(b[0] + (b[1] - b[0]) * f64::from(k) / 8.0)).distance(first) <= gap))
    }

    /// The pole that a rectangle touches: direction and end. None where it touches more than one.
    pub fn pole_at(&self, rect: &Rect) -> Option<(usize, usize)> {
        let mut touched = (0..2)
            .flat_map(|d| [(d, 0, rect.low[d] <= 0.0), (d, 1, rect.high[d] >= 1.0)].into_iter())
            .filter(|&(d, end, touches)| touches && self.poles[d][end])
            .map(|(d, end, _)| (d, end));
        let first = touched.next();
        if touched.next().is_some() { None } else { first }
    }

    /// Whether the two sides across direction `d` are the same curve, and not both one point.
    fn closes(&self, d: usize, gap: f64) -> bool {
        let (mut apart, mut extent, mut first) = (0.0_f64, 0.0_f64, None);
        for piece_row in self.breaks[1 - d].windows(2) {
            for k in 0..=6 {
                let t = piece_row[0] + (piece_row[1] - piece_row[0]) * f64::from(k) / 6.0;
                let at = |s: f64| if d == 0 { DVec2::new(s, t) } else { DVec2::new(t, s) };
                let (low, high) = (self.point(at(0.0)), self.point(at(1.0)));
                apart = apart.max(low.distance(high));
                extent = extent.max(low.distance(*first.get_or_insert(low)));
            }
        }
        // A direction whose iso-curves are points is collapsed, not closed.
        let middle = |s: f64| if d == 0 { DVec2::new(s, 0.5) } else { DVec2::new(0.5, s) };
        let around = (1..16).map(|k| self.point(middle(f64::from(k) / 16.0)).distance(self.point(middle(0.0))));
        apart <= gap && extent > 1e3 * gap && around.fold(0.0, f64::max) > 1e3 * gap
    }

    pub fn columns(&self) -> usize {
        self.breaks[0].len() - 1
    }

    /// A point of the domain and its copies across seams.
    pub fn images(&self, at: DVec2) -> impl Iterator<Item = DVec2> + use<> {
        let turns = |d: usize| if self.periodic[d] { -1..=1 } else { 0..=0 };
        let (us, vs) = (turns(0), turns(1));
        us.flat_map(move |i| vs.clone().map(move |j| at + DVec2::new(f64::from(i), f64::from(j))))
    }

    /// The parameter brought into [0, 1] where its direction is closed.
    pub fn wrapped(&self, p: DVec2) -> DVec2 {
        let wrap = |d: usize, t: f64| if self.periodic[d] && !(0.0..=1.0).contains(&t) { t - t.floor() } else { t };
        DVec2::new(wrap(0, p.x), wrap(1, p.y))
    }

    /// The column (or row) of pieces that contains a parameter.
    pub fn span(&self, d: usize, t: f64) -> usize {
        let b = &self.breaks[d];
        b.partition_point(|&x| x <= t).clamp(1, b.len() - 1) - 1
    }

    /// The piece that contains a point of [0, 1]^2 (the nearest one for a point outside).
    pub fn piece_at(&self, p: DVec2) -> usize {
        self.span(1, p.y) * self.columns() + self.span(0, p.x)
    }

    /// The homogeneous jet of a piece (continued where `p` lies outside it), up to `order <= 2`.
    pub fn homogeneous_on(&self, piece: usize, p: DVec2, order: usize) -> HomogeneousJet {
        let piece = &self.pieces[piece];
        let size = piece.size();
        let local = (p - piece.low) / size;
        if self.degree == [3, 3]
            && let Some(jet) = bicubic(&piece.points, local, size, order)
        {
            return jet;
        }
        let mut bu = [[0.0; MAX_DEGREE + 1]; 3];
        let mut bv = [[0.0; MAX_DEGREE + 1]; 3];
        bernstein(self.degree[0], local.x, order, &mut bu);
        bernstein(self.degree[1], local.y, order, &mut bv);
        let mut jet = HomogeneousJet::default();
        let width = self.degree[0] + 1;
        for (j, row) in piece.points.chunks_exact(width).enumerate() {
            let mut r = [DVec4::ZERO; 3];
            for (i, &h) in row.iter().enumerate() {
                r[0] += h * bu[0][i];
                if order > 0 {
                    r[1] += h * bu[1][i];
                }
                if order > 1 {
                    r[2] += h * bu[2][i];
                }
            }
            jet.h += r[0] * bv[0][j];
            if order > 0 {
                jet.d[0] += r[1] * bv[0][j];
                jet.d[1] += r[0] * bv[1][j];
            }
            if order > 1 {
                jet.dd[0] += r[2] * bv[0][j];
                jet.dd[1] += r[1] * bv[1][j];
                jet.dd[2] += r[0] * bv[2][j];
            }
        }
        jet.d[0] /= size.x;
        jet.d[1] /= size.y;
        jet.dd[0] /= size.x * size.x;
        jet.dd[1] /= size.x * size.y;
        jet.dd[2] /= size.y * size.y;
        jet
    }

    /// The jet of a piece (continued where `p` lies outside it).
    pub fn jet_on(&self, piece: usize, p: DVec2, order: usize) -> Jet {
        cartesian(&self.homogeneous_on(piece, p, order), self.rational)
    }

    /// The jet of the surface, wrapped in closed directions and continued beyond open borders.
    pub fn jet(&self, p: DVec2, order: usize) -> Jet {
        let p = self.wrapped(p);
        self.jet_on(self.piece_at(p), p, order)
    }

    /// The homogeneous jet of the surface.
    pub fn homogeneous(&self, p: DVec2, order: usize) -> HomogeneousJet {
        let p = self.wrapped(p);
        self.homogeneous_on(self.piece_at(p), p, order)
    }

    /// The point of the surface.
    pub fn point(&self, p: DVec2) -> DVec3 {
        self.jet(p, 0).s
    }

    /// The parameters of the surface for a point of [0, 1]^2; the ends of the domain are met exactly.
    pub fn to_surface(&self, p: DVec2) -> DVec2 {
        let map = |d: usize, t: f64| {
            let [a, b] = self.domain[d];
            if t == 1.0 { b } else { a + (b - a) * t }
        };
        DVec2::new(map(0, p.x), map(1, p.y))
    }

    /// A rectangle as `[[u0, u1], [v0, v1]]` in the surface's parameters.
    pub fn in_surface(&self, r: &Rect) -> [[f64; 2]; 2] {
        let (low, high) = (self.to_surface(r.low), self.to_surface(r.high));
        [[low.x, high.x], [low.y, high.y]]
    }

    /// The point of [0, 1]^2 for parameters of the surface.
    pub fn in_unit(&self, p: DVec2) -> DVec2 {
        let map = |d: usize, t: f64| (t - self.domain[d][0]) / (self.domain[d][1] - self.domain[d][0]);
        DVec2::new(map(0, p.x), map(1, p.y))
    }

    /// Whether a point lies on a border that is no seam.
    pub fn on_open_border(&self, p: DVec2) -> bool {
        (0..2).any(|d| !self.periodic[d] && (p[d] == 0.0 || p[d] == 1.0))
    }

    /// A point in model space.
    pub fn to_model(&self, x: DVec3) -> DVec3 {
        self.origin + x * self.scale
    }
}

/// The same for 4 x 4 control points, with everything on the stack.
fn bicubic(points: &[DVec4], local: DVec2, size: DVec2, order: usize) -> Option<HomogeneousJet> {
    let points: &[DVec4; 16] = points.try_into().ok()?;
    let basis = |t: f64| {
        let s = 1.0 - t;
        let (ss, st, tt) = (s * s, s * t, t * t);
        [
            [ss * s, 3.0 * ss * t, 3.0 * s * tt, tt * t],
            [-3.0 * ss, 3.0 * ss - 6.0 * st, 6.0 * st - 3.0 * tt, 3.0 * tt],
            [6.0 * s, 6.0 * t - 12.0 * s, 6.0 * s - 12.0 * t, 6.0 * t],
        ]
    };
    let (bu, bv) = (basis(local.x), basis(local.y));
    let mut jet = HomogeneousJet::default();
    for j in 0..4 {
        let row = [points[4 * j], points[4 * j + 1], points[4 * j + 2], points[4 * j + 3]];
        let sum = |b: &[f64; 4]| row[0] * b[0] + row[1] * b[1] + row[2] * b[2] + row[3] * b[3];
        let r0 = sum(&bu[0]);
        jet.h += r0 * bv[0][j];
        if order > 0 {
            let r1 = sum(&bu[1]);
            jet.d[0] += r1 * bv[0][j];
            jet.d[1] += r0 * bv[1][j];
            if order > 1 {
                jet.dd[0] += sum(&bu[2]) * bv[0][j];
                jet.dd[1] += r1 * bv[1][j];
                jet.dd[2] += r0 * bv[2][j];
            }
        }
    }
    jet.d = [jet.d[0] / size.x, jet.d[1] / size.y];
    jet.dd = [jet.dd[0] / (size.x * size.x), jet.dd[1] / (size.x * size.y), jet.dd[2] / (size.y * size.y)];
    Some(jet)
}

fn cartesian(h: &HomogeneousJet, rational: bool) -> Jet {
    if !rational {
        return Jet { s: h.h.truncate(), d: h.d.map(DVec4::truncate), dd: h.dd.map(DVec4::truncate) };
    }
    let w = h.h.w;
    let s = h.h.truncate() / w;
    let d = h.d.map(|d| (d.truncate() - s * d.w) / w);
    let second =
        |at: usize, a: usize, b: usize| (h.dd[at].truncate() - d[a] * h.d[b].w - d[b] * h.d[a].w - s * h.dd[at].w) / w;
    Jet { s, d, dd: [second(0, 0, 0), second(1, 0, 1), second(2, 1, 1)] }
}

/// Bernstein polynomials of a degree at `t` and their derivatives up to `order <= 2`.
fn bernstein(degree: usize, t: f64, order: usize, out: &mut [[f64; MAX_DEGREE + 1]; 3]) {
    let s = 1.0 - t;
    let mut b = [0.0; MAX_DEGREE + 1];
    b[0] = 1.0;
    for n in 0..=degree {
        let from = degree - n; // derivative order that the degree-n polynomials serve
        if from <= order && from <= 2 {
            let n1 = degree as f64;
            match from {
                0 => out[0][..=n].copy_from_slice(&b[..=n]),
                1 => {
                    for i in 0..=degree {
                        let low = if i > 0 { b[i - 1] } else { 0.0 };
                        let high = if i < degree { b[i] } else { 0.0 };
                        out[1][i] = n1 * (low - high);
                    }
                }
                _ => {
                    for i in 0..=degree {
                        let at = |k: isize| if k >= 0 && k as usize <= n { b[k as usize] } else { 0.0 };
                        let i = i as isize;
                        out[2][i as usize] = n1 * (n1 - 1.0) * (at(i - 2) - 2.0 * at(i - 1) + at(i));
                    }
                }
            }
        }
        if n < degree {
            for i in (0..=n + 1).rev() {
                let low = if i > 0 { b[i - 1] } else { 0.0 };
                b[i] = s * b[i] + t * low;
            }
        }
    }
}

/// Control points to powers of (t - 1/2) in both directions.
fn powers(points: &[DVec4], degree: [usize; 2]) -> Vec<DVec4> {
    let width = degree[0] + 1;
    let mut out = points.to_vec();
    for row in out.chunks_exact_mut(width) {
        let line = power_line(row);
        row.copy_from_slice(&line);
    }
    for i in 0..width {
        let column: Vec<DVec4> = (0..=degree[1]).map(|j| out[j * width + i]).collect();
        for (j, value) in power_line(&column).into_iter().enumerate() {
            out[j * width + i] = value;
        }
    }
    out
}

/// The Taylor coefficients at 1/2 of one Bezier curve: the derivatives there come from de Casteljau's triangle.
fn power_line(points: &[DVec4]) -> Vec<DVec4> {
    let n = points.len() - 1;
    let mut differences = points.to_vec();
    let mut binomial = 1.0;
    (0..=n)
        .map(|k| {
            if k > 0 {
                for i in 0..=n - k {
                    differences[i] = differences[i + 1] - differences[i];
                }
                binomial *= (n - k + 1) as f64 / k as f64;
            }
            let mut line = differences[..=n - k].to_vec();
            for level in (1..line.len()).rev() {
                for i in 0..level {
                    line[i] = (line[i] + line[i + 1]) * 0.5;
                }
            }
            line[0] * binomial
        })
        .collect()
}
