//! Bounds over a rectangle of the domain: points whose convex hulls contain the surface, its first and its second
//! partial derivatives there.
//!
//! Polynomial pieces: the control points of the restricted piece and their scaled differences. Rational pieces:
//! control points of positive weight bound positions; derivatives are in [`super::rational`].
//! Over many pieces the points are replaced by the corners of their box.

use glam::{DVec2, DVec3, DVec4};

use super::rational::{Interval3, Quotient};
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

/// Bounds of Su, Sv, Suu, Suv, Svv together.
#[derive(Clone, Debug)]
pub(crate) enum Jets {
    /// The five derivatives at each point lie in the convex hull of these five-tuples.
    Joint(Vec<[DVec3; 5]>),
    /// Each derivative lies in the convex hull of its own points.
    Apart([Vec<DVec3>; 5]),
}

impl Jets {
    /// The range of `y . (c0 Su + c1 Sv + c2 Suu + c3 Suv + c4 Svv)`.
    pub fn range(&self, y: DVec3, c: [f64; 5]) -> [f64; 2] {
        match self {
            Self::Joint(points) => points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| {
                let value = (0..5).map(|k| c[k] * y.dot(d[k])).sum::<f64>();
                [low.min(value), high.max(value)]
            }),
            Self::Apart(points) => (0..5).filter(|&k| c[k] != 0.0).fold([0.0; 2], |[low, high], k| {
                let [a, b] = range(y, &points[k]);
                let (a, b) = if c[k] >= 0.0 { (a * c[k], b * c[k]) } else { (b * c[k], a * c[k]) };
                [low + a, high + b]
            }),
        }
    }
}

/// Points around the second derivatives: uu, uv, vv.
#[derive(Clone, Debug, Default)]
pub(crate) struct SecondHull(pub [Vec<DVec3>; 3]);

/// The range of `y . x` over points.
pub(crate) fn range(y: DVec3, points: &[DVec3]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| {
        let value = y.dot(x);
        [low.min(value), high.max(value)]
    })
}

impl Sheet {
    /// The pieces under a rectangle with the part of it on each (moved into [0, 1] across a seam).
    fn parts(&self, rect: &Rect) -> Vec<(usize, Rect)> {
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

    /// Bounds of the first and second derivatives over a rectangle of the surface.
    pub fn jets(&self, rect: &Rect) -> Jets {
        self.jets_of(&self.parts(rect))
    }

    /// The same on one piece, continued where the rectangle leaves it.
    pub fn jets_on(&self, piece: usize, rect: &Rect) -> Jets {
        self.jets_of(&[(piece, *rect)])
    }

    fn jets_of(&self, parts: &[(usize, Rect)]) -> Jets {
        if self.rational {
            let mut all: [Vec<DVec3>; 5] = Default::default();
            for (piece, part) in parts {
                let hull = self.hull_on(*piece, part);
                all[0].extend(hull.du);
                all[1].extend(hull.dv);
                for (k, points) in self.second_hull_on(*piece, part).0.into_iter().enumerate() {
                    all[2 + k].extend(points);
                }
            }
            return Jets::Apart(all);
        }
        let [p, q] = self.degree;
        let mut all = Vec::new();
        for (piece, part) in parts {
            let part = self.enlarged(*piece, part);
            let size = part.size();
            let pos: Vec<DVec3> = self.net(*piece, &part).iter().map(|h| h.truncate()).collect();
            let (du, dv) = (self.differences(&pos, 0, size.x), self.differences(&pos, 1, size.y));
            let uu = differences(&du, p, q + 1, 0, p - 1, size.x);
            let uv = differences(&du, p, q + 1, 1, q, size.y);
            let vv = differences(&dv, p + 1, q, 1, q - 1, size.y);
            let nets = [
                elevated(&du, [p - 1, q], [p, q]),
                elevated(&dv, [p, q - 1], [p, q]),
                if p > 1 { elevated(&uu, [p - 2, q], [p, q]) } else { vec![DVec3::ZERO; (p + 1) * (q + 1)] },
                elevated(&uv, [p - 1, q - 1], [p, q]),
                if q > 1 { elevated(&vv, [p, q - 2], [p, q]) } else { vec![DVec3::ZERO; (p + 1) * (q + 1)] },
            ];
            all.extend((0..(p + 1) * (q + 1)).map(|k| [0, 1, 2, 3, 4].map(|n: usize| nets[n][k])));
        }
        Jets::Joint(all)
    }

    /// Tiny rectangles enlarged, because second differences of nearly equal control points are rounding.
    fn enlarged(&self, piece: usize, rect: &Rect) -> Rect {
        let half = (rect.size() * 0.5).max(self.pieces[piece].size() * 1e-4);
        Rect::new(rect.center() - half, rect.center() + half)
    }

    /// Bounds of the second derivatives over a rectangle of the surface.
    pub fn second_hull(&self, rect: &Rect) -> SecondHull {
        let mut all = SecondHull::default();
        for (piece, part) in self.parts(rect) {
            for (sum, one) in all.0.iter_mut().zip(self.second_hull_on(piece, &part).0) {
                sum.extend(one);
            }
        }
        all
    }

    /// Bounds of the second derivatives over a rectangle on one piece.
    fn second_hull_on(&self, piece: usize, rect: &Rect) -> SecondHull {
        let rect = &self.enlarged(piece, rect);
        let net = self.net(piece, rect);
        let size = rect.size();
        if !self.rational {
            let pos: Vec<DVec3> = net.iter().map(|h| h.truncate()).collect();
            let (p, q) = (self.degree[0], self.degree[1]);
            let du = self.differences(&pos, 0, size.x);
            let dv = self.differences(&pos, 1, size.y);
            let uu = differences(&du, p, q + 1, 0, p - 1, size.x);
            let uv = differences(&du, p, q + 1, 1, q, size.y);
            let vv = differences(&dv, p + 1, q, 1, q - 1, size.y);
            return SecondHull([uu, uv, vv]);
        }
        match Quotient::new(self, &net, size) {
            Some(q) => {
                SecondHull([q.second(0, 0, 0).corners(), q.second(1, 0, 1).corners(), q.second(2, 1, 1).corners()])
            }
            None => SecondHull([0; 3].map(|_| Hull::everything().du)),
        }
    }

    /// Points around the third derivatives uuu, uuv, uvv, vvv over a rectangle. `None` for rational surfaces and across
    /// borders of pieces without two continuous derivatives.
    pub fn third_hull(&self, rect: &Rect) -> Option<[Vec<DVec3>; 4]> {
        let parts = self.parts(rect);
        if self.rational || (parts.len() > 1 && !self.twice_smooth(rect)) {
            return None;
        }
        let [p, q] = self.degree;
        let mut all: [Vec<DVec3>; 4] = Default::default();
        for (piece, part) in parts {
            let size = part.size();
            let part = self.enlarged(piece, &part);
            debug_assert!(size.x > 0.0 && size.y > 0.0);
            let size = part.size();
            let pos: Vec<DVec3> = self.net(piece, &part).iter().map(|h| h.truncate()).collect();
            for (k, points) in all.iter_mut().enumerate() {
                // k derivatives by v, 3 - k by u.
                let (mut net, mut width, mut height, mut degree) = (pos.clone(), p + 1, q + 1, [p, q]);
                for d in (0..3).map(|i| usize::from(i >= 3 - k)) {
                    if degree[d] == 0 {
                        net = vec![DVec3::ZERO];
                        break;
                    }
                    net = differences(&net, width, height, d, degree[d], size[d]);
                    degree[d] -= 1;
                    if d == 0 { width -= 1 } else { height -= 1 }
                }
                points.extend(net);
            }
        }
        Some(all)
    }

    /// Whether second derivatives are continuous across the borders of pieces inside a rectangle: compared at points.
    fn twice_smooth(&self, rect: &Rect) -> bool {
        let step = 1.0 / 8.0;
        (0..2).all(|d| {
            let turns = rect.low[d].floor() as i64..=rect.high[d].floor() as i64;
            turns.flat_map(|turn| self.breaks[d].iter().map(move |b| b + turn as f64)).all(|line| {
                let open = line <= 0.0 || line >= 1.0;
                if line <= rect.low[d] || line >= rect.high[d] || (open && !self.periodic[d]) {
                    return true;
                }
                (0..=8).all(|k| {
                    let other = rect.low[1 - d] + rect.size()[1 - d] * f64::from(k) * step;
                    let at = |by: f64| {
                        let mut p = DVec2::splat(other);
                        p[d] = line + by;
                        self.wrapped(p)
                    };
                    let [a, b] = [-1e-9, 1e-9].map(|by| self.jet(at(by), 2));
                    let size = a.dd.iter().map(|x| x.length()).fold(0.0, f64::max);
                    a.dd.iter().zip(&b.dd).all(|(x, y)| x.distance(*y) <= 1e-5 * (1.0 + size))
                })
            })
        })
    }

    /// The homogeneous control points of a piece restricted (or continued) to a rectangle.
    fn net(&self, piece: usize, rect: &Rect) -> Vec<DVec4> {
        let piece = &self.pieces[piece];
        let size = piece.size();
        let (a, b) = ((rect.low - piece.low) / size, (rect.high - piece.low) / size);
        let mut net = piece.points.clone();
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        for j in 0..height {
            restrict(&mut net, j * width, 1, width, a.x, b.x);
        }
        for i in 0..width {
            restrict(&mut net, i, width, height, a.y, b.y);
        }
        net
    }

    pub(crate) fn differences(&self, net: &[DVec3], direction: usize, length: f64) -> Vec<DVec3> {
        let (width, height) = (self.degree[0] + 1, self.degree[1] + 1);
        differences(net, width, height, direction, self.degree[direction], length)
    }
}

/// Restricts one line of control points to `a..b` in place.
fn restrict(net: &mut [DVec4], start: usize, stride: usize, count: usize, a: f64, b: f64) {
    let at = |i: usize| start + i * stride;
    let keep_high = |net: &mut [DVec4], t: f64| {
        for level in 1..count {
            for i in 0..count - level {
                net[at(i)] = net[at(i)] + (net[at(i + 1)] - net[at(i)]) * t;
            }
        }
    };
    let keep_low = |net: &mut [DVec4], t: f64| {
        for level in 1..count {
            for i in (level..count).rev() {
                net[at(i)] = net[at(i - 1)] + (net[at(i)] - net[at(i - 1)]) * t;
            }
        }
    };
    // Cut first where more is left, so that the second cut never divides by a small length.
    if b.abs() > (1.0 - a).abs() {
        if b != 1.0 {
            keep_low(net, b);
        }
        if a != 0.0 {
            keep_high(net, a / b);
        }
    } else {
        if a != 0.0 {
            keep_high(net, a);
        }
        if b != 1.0 {
            keep_low(net, (b - a) / (1.0 - a));
        }
    }
}

/// Differences of a `width` x `height` net along a direction, times degree over length: the derivative's net.
pub(crate) fn differences(
    net: &[DVec3],
    width: usize,
    height: usize,
    direction: usize,
    degree: usize,
    length: f64,
) -> Vec<DVec3> {
    if degree == 0 {
        return vec![DVec3::ZERO];
    }
    let factor = degree as f64 / length;
    let (w, h, step) = if direction == 0 { (width - 1, height, 1) } else { (width, height - 1, width) };
    (0..w * h).map(|k| (k / w) * width + k % w).map(|at| (net[at + step] - net[at]) * factor).collect()
}

/// A net of degrees `from` written at the higher degrees `to`.
fn elevated(net: &[DVec3], from: [usize; 2], to: [usize; 2]) -> Vec<DVec3> {
    let mut rows: Vec<Vec<DVec3>> = net.chunks_exact(from[0] + 1).map(<[DVec3]>::to_vec).collect();
    let blend = |a: DVec3, b: DVec3, i: usize, n: usize| a.lerp(b, 1.0 - i as f64 / n as f64);
    for n in from[0] + 1..=to[0] {
        for row in &mut rows {
            let last = row[n - 1];
            row.push(last);
            for i in (1..n).rev() {
                row[i] = blend(row[i - 1], row[i], i, n);
            }
        }
    }
    for n in from[1] + 1..=to[1] {
        rows.push(rows[n - 1].clone());
        for j in (1..n).rev() {
            for i in 0..rows[j].len() {
                rows[j][i] = blend(rows[j - 1][i], rows[j][i], j, n);
            }
        }
    }
    rows.concat()
}

/// The corners of the box around points.
fn corners(points: &[DVec3]) -> Vec<DVec3> {
    let b = Aabb::of(points.iter().copied());
    Interval3 { low: b.min, high: b.max }.corners()
}

impl Hull {
    /// The hull that excludes nothing.
    fn everything() -> Self {
        let huge = Interval3 { low: DVec3::splat(-1e30), high: DVec3::splat(1e30) }.corners();
        Self { pos: huge.clone(), du: huge.clone(), dv: huge }
    }
}
