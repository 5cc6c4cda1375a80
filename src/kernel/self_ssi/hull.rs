//! Bounds over a rectangle of the domain: points whose convex hulls contain the surface and its first partial derivatives
//! there. Higher derivatives are in [`super::jets`].
//!
//! Polynomial pieces: the control points of the restricted piece and their scaled differences. Rational pieces:
//! control points of positive weight bound positions; derivatives are in [`super::rational`].
//! Over many pieces the points are replaced by the corners of their box.

use glam::{DVec2, DVec3, DVec4};

use super::net::elevated;
use super::rational::Interval3;
use super::sheet::Sheet;
use crate::kernel::geom::Aabb;

/// Above this number of pieces a hull is a box.
const MANY: usize = 4;

/// A rectangle of the unit domain; in closed directions it may reach beyond [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rect {
    pub low: DVec2,
    pub high: DVec2,
}

impl Rect {
    pub fn new(low: DVec2, high: DVec2) -> Self {
        Self { low, high }
    }

    pub fn size(&self) -> DVec2 {
        self.high - self.low
    }

    pub fn center(&self) -> DVec2 {
        (self.low + self.high) * 0.5
    }

    /// Grown on every side by `factor` times its own size.
    pub fn grown(&self, factor: f64) -> Self {
        let by = self.size() * factor;
        Self { low: self.low - by, high: self.high + by }
    }

    pub fn union(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn shifted(&self, by: DVec2) -> Self {
        Self { low: self.low + by, high: self.high + by }
    }

    pub fn contains(&self, p: DVec2) -> bool {
        self.low.cmple(p).all() && p.cmple(self.high).all()
    }
}

/// Points around the surface and its first derivatives over a rectangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hull {
    pub pos: Vec<DVec3>,
    pub du: Vec<DVec3>,
    pub dv: Vec<DVec3>,
}

/// Bounds beside a pole. See [`Sheet::polar`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Polar {
    pub t: Vec<DVec3>,
    pub along: Vec<DVec3>,
    pub away: Vec<DVec3>,
}

/// The range of `y . x` over points.
pub(crate) fn range(y: DVec3, points: &[DVec3]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| {
        let value = y.dot(x);
        [low.min(value), high.max(value)]
    })
}

impl Sheet {
    /// The pieces under a rectangle with the part of it on each (moved into [0, 1] across a seam).
    pub fn parts(&self, rect: &Rect) -> Vec<(usize, Rect)> {
        let axis = |d: usize, low: f64, high: f64| -> Vec<(usize, f64, f64)> {
            let last = self.breaks[d].len() - 2;
            let (first_turn, last_turn) = if self.periodic[d] {
                (low.floor() as i64, (high.ceil() as i64 - 1).max(low.floor() as i64))
            } else {
                (0, 0)
            };
            let mut out = Vec::new();
            for turn in first_turn..=last_turn {
                let (a, b) = (low - turn as f64, high - turn as f64);
                for k in 0..=last {
                    // End pieces continue beyond open borders.
                    let start = if k == 0 && !self.periodic[d] { f64::NEG_INFINITY } else { self.breaks[d][k] };
                    let end = if k == last && !self.periodic[d] { f64::INFINITY } else { self.breaks[d][k + 1] };
                    let (from, to) = (a.max(start), b.min(end));
                    if from < to {
                        out.push((k, from, to));
                    }
                }
            }
            // Slivers are the rounding of a border between two pieces.
            let sliver = 1e-6 * (high - low);
            if out.iter().any(|s| s.2 - s.1 > sliver) {
                out.retain(|s| s.2 - s.1 > sliver);
            }
            out
        };
        let us = axis(0, rect.low.x, rect.high.x);
        let vs = axis(1, rect.low.y, rect.high.y);
        let columns = self.columns();
        vs.iter()
            .flat_map(|&(j, v0, v1)| {
                us.iter().map(move |&(i, u0, u1)| (j * columns + i, Rect::new(DVec2::new(u0, v0), DVec2::new(u1, v1))))
            })
            .collect()
    }

    /// The piece on which a rectangle of [0, 1]^2 lies entirely.
    pub fn single_piece(&self, rect: &Rect) -> Option<usize> {
        let at = self.piece_at(rect.center());
        let piece = &self.pieces[at];
        let slack = DVec2::splat(1e-14);
        (piece.low.cmple(rect.low + slack).all() && rect.high.cmple(piece.high + slack).all()).then_some(at)
    }

    /// Bounds over a rectangle of the surface.
    pub fn hull(&self, rect: &Rect) -> Hull {
        let parts = self.parts(rect);
        if let [(piece, part)] = parts[..] {
            return self.hull_on(piece, &part);
        }
        let mut all = Hull::default();
        for (piece, part) in &parts {
            let mut one = self.hull_on(*piece, part);
            if parts.len() > MANY {
                one = Hull { pos: corners(&one.pos), du: corners(&one.du), dv: corners(&one.dv) };
            }
            all.pos.extend(one.pos);
            all.du.extend(one.du);
            all.dv.extend(one.dv);
        }
        if parts.len() > MANY {
            all = Hull { pos: corners(&all.pos), du: corners(&all.du), dv: corners(&all.dv) };
        }
        all
    }

    /// Bounds over a rectangle on one piece, continued where the rectangle leaves it.
    pub fn hull_on(&self, piece: usize, rect: &Rect) -> Hull {
        self.hull_of(&self.net(piece, rect), rect.size())
    }

    fn hull_of(&self, net: &[DVec4], size: DVec2) -> Hull {
        if !self.rational {
            let pos: Vec<DVec3> = net.iter().map(|h| h.truncate()).collect();
            let (du, dv) = (self.differences(&pos, 0, size.x), self.differences(&pos, 1, size.y));
            return Hull { pos, du, dv };
        }
        let Some(frames) = self.rational_frames(net, size) else { return Hull::everything() };
        Hull {
            pos: net.iter().map(|h| h.truncate() / h.w).collect(),
            du: frames.iter().map(|f| f[0]).collect(),
            dv: frames.iter().map(|f| f[1]).collect(),
        }
    }

    /// Bounds over a rectangle that touches the pole at `end` of direction `d`, with the distance t from that side
    /// divided out: of T = (S - pole) / t, of its derivative along the pole (which is S's, divided by t), and of S's
    /// derivative away from the pole.
    pub fn polar(&self, rect: &Rect, (d, end): (usize, usize)) -> Polar {
        let mut out = Polar::default();
        for (piece, part) in self.parts(rect) {
            let net = self.net(piece, &part);
            let size = part.size();
            let hull = self.hull_of(&net, size);
            let (along, away) = if d == 1 { (&hull.du, &hull.dv) } else { (&hull.dv, &hull.du) };
            out.away.extend(away);
            let (near, far) =
                if end == 0 { (part.low[d], part.high[d]) } else { (1.0 - part.high[d], 1.0 - part.low[d]) };
            if near > 0.0 {
                let pole = self.point(if end == 0 { DVec2::ZERO } else { DVec2::ONE });
                for t in [near, far] {
                    out.t.extend(hull.pos.iter().map(|&p| (p - pole) / t));
                    out.along.extend(along.iter().map(|&x| x / t));
                }
                continue;
            }
            let t = self.hull_of(&self.divided(&net, d, end, far), size);
            out.along.extend(if d == 1 { &t.du } else { &t.dv });
            out.t.extend(t.pos);
        }
        out
    }

    /// The net of (S - pole) / t, t the distance from the side at `end` of direction `d`, `length` across the net.
    fn divided(&self, net: &[DVec4], d: usize, end: usize, length: f64) -> Vec<DVec4> {
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        let (lines, count, line_step, step) =
            if d == 0 { (height, width, width, 1) } else { (width, height, 1, width) };
        let n = count - 1;
        let at = |line: usize, k: usize| line * line_step + (if end == 0 { k } else { n - k }) * step;
        let mut out = net.to_vec();
        for line in 0..lines {
            let first = net[at(line, 0)];
            let pole = first.truncate() / first.w;
            // Degree n - 1: control point k of S - pole, times n / k, is control point k - 1 of the quotient.
            let low: Vec<DVec3> = (1..count)
                .map(|k| {
                    let h = net[at(line, k)];
                    (h.truncate() - pole * h.w) * (n as f64 / (k as f64 * length))
                })
                .collect();
            for k in 0..count {
                let f = k as f64 / n as f64;
                let before = if k > 0 { low[k - 1] * f } else { DVec3::ZERO };
                let here = if k < n { low[k] * (1.0 - f) } else { DVec3::ZERO };
                out[at(line, k)] = (before + here).extend(net[at(line, k)].w);
            }
        }
        out
    }

    /// What the window test needs over a rectangle: [`Self::frames`], with poles divided out.
    pub fn window_frames(&self, rect: &Rect) -> Vec<[DVec3; 2]> {
        let Some(pole) = self.pole_at(rect) else { return self.frames(rect) };
        let polar = self.polar(rect, pole);
        let pair = |a: DVec3, b: DVec3| if pole.0 == 1 { [a, b] } else { [b, a] };
        let (mut along, mut away) = (polar.along, polar.away);
        if along.len() * away.len() > 400 {
            (along, away) = (corners(&along), corners(&away));
        }
        along.iter().flat_map(|&a| away.iter().map(move |&b| pair(a, b))).collect()
    }

    /// Pairs (Su, Sv) in whose convex hull the pair of derivatives lies at every point of a rectangle.
    pub fn frames(&self, rect: &Rect) -> Vec<[DVec3; 2]> {
        let parts = self.parts(rect);
        if self.rational && parts.len() <= MANY {
            let nets = parts.iter().map(|(piece, part)| self.rational_frames(&self.net(*piece, part), part.size()));
            if let Some(all) = nets.collect::<Option<Vec<_>>>() {
                return all.concat();
            }
        }
        if !self.rational && parts.len() <= 4 * MANY {
            let mut all = Vec::new();
            for (piece, part) in &parts {
                let pos: Vec<DVec3> = self.net(*piece, part).iter().map(|h| h.truncate()).collect();
                let [p, q] = self.degree;
                let du = elevated(&self.differences(&pos, 0, part.size().x), [p - 1, q], [p, q]);
                let dv = elevated(&self.differences(&pos, 1, part.size().y), [p, q - 1], [p, q]);
                all.extend(du.into_iter().zip(dv).map(|(a, b)| [a, b]));
            }
            return all;
        }
        let (mut du, mut dv) = (Vec::new(), Vec::new());
        let mut all = Vec::new();
        for (piece, part) in &parts {
            let hull = self.hull_on(*piece, part);
            if parts.len() <= MANY {
                let (du, dv) = (corners(&hull.du), corners(&hull.dv));
                all.extend(du.iter().flat_map(|&a| dv.iter().map(move |&b| [a, b])));
            } else {
                du.extend(corners(&hull.du));
                dv.extend(corners(&hull.dv));
            }
        }
        if parts.len() > MANY {
            let (du, dv) = (corners(&du), corners(&dv));
            all = du.iter().flat_map(|&a| dv.iter().map(move |&b| [a, b])).collect();
        }
        all
    }
}

/// The corners of the box around points.
fn corners(points: &[DVec3]) -> Vec<DVec3> {
    let b = Aabb::of(points.iter().copied());
    Interval3 { low: b.min, high: b.max }.corners()
}

impl Hull {
    /// The hull that excludes nothing.
    pub fn everything() -> Self {
        let huge = Interval3 { low: DVec3::splat(-1e30), high: DVec3::splat(1e30) }.corners();
        Self { pos: huge.clone(), du: huge.clone(), dv: huge }
    }
}
