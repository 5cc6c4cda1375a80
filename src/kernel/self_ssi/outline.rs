//! The exact outline of a coincident region.
//!
//! The surface is piecewise analytic, so that it stops lying on itself only where one of the two sides leaves the
//! domain, or where both meet in a fold. Every open border of the domain is sampled; the stretches on which a partner lies
//! in the domain, with their ends bisected, are chained with the fold edges into loops. Each point carries its partner, which is
//! found by Gauss-Newton on F = [S(p) - S(q)] / |p - q|, so that near a fold the trivial solution q = p is no attraction.

use glam::DVec2;

use super::chart::near;
use super::coincidence::Coincidence;
use super::cusp::{CuspEdge, CuspNode};
use super::hull::Rect;
use super::march::turns;
use super::sheet::Sheet;

/// Samples of one border of the domain.
const SAMPLES: usize = 512;
/// Ends closer than this are one.
const JOINED: f64 = 1e-6;

/// Points of the two sides that coincide.
pub(crate) type Pair = [DVec2; 2];

/// The loops around the region of these cells and folds; empty where they do not close.
pub(crate) fn loops(
    sheet: &Sheet,
    cells: &[Coincidence],
    folds: &[(usize, Rect)],
    edges: &[CuspEdge],
) -> Vec<Vec<Pair>> {
    let first_side = edges
        .iter()
        .map(|edge| {
            let sides = cells.iter().map(|c| edge.side_of(c.a.center()));
            sides.min_by(|a, b| a.abs().total_cmp(&b.abs())).map(|side| side > 0.0)
        })
        .collect();
    let finder = Finder { sheet, cells, folds, edges, first_side, gap: 1e-11_f64.max(8.0 * sheet.rounding) };
    let mut pieces = Vec::new();
    for d in 0..2 {
        for (side, end) in [0.0, 1.0].into_iter().enumerate() {
            if !sheet.periodic[d] && !sheet.poles[d][side] {
                pieces.extend(finder.border(d, end));
            }
        }
        if sheet.periodic[d] {
            pieces.extend(finder.seam(d));
        }
    }
    let mut kept: Vec<Vec<Pair>> = Vec::new();
    for piece in pieces {
        // Where both sides are on a border the same pairs were met from either.
        let Some(&[a, b]) = piece.get(piece.len() / 2) else { continue };
        let on = |line: &Vec<Pair>| {
            line.windows(2).any(|s| {
                let d = s[1][0] - s[0][0];
                let at = ((a - s[0][0]).dot(d) / d.length_squared().max(1e-300)).clamp(0.0, 1.0);
                let other = s[0][1] + (s[1][1] - s[0][1]) * at;
                (s[0][0] + d * at).distance(a) < 1e-5 + 0.1 * d.length() && other.distance(b) < 1e-5 + 0.1 * d.length()
            })
        };
        if !kept.iter().any(on) {
            kept.push(piece);
        }
    }
    let mut met: Vec<usize> = folds.iter().map(|f| f.0).collect();
    met.sort_unstable();
    met.dedup();
    for edge in met.into_iter().filter_map(|k| edges.get(k)) {
        let line: Vec<Pair> = edge.nodes().iter().map(|n| [n.at; 2]).collect();
        if line.len() > 1 {
            kept.push(line);
        }
    }
    chain(sheet, kept)
}

struct Finder<'a> {
    sheet: &'a Sheet,
    cells: &'a [Coincidence],
    folds: &'a [(usize, Rect)],
    edges: &'a [CuspEdge],
    /// For each edge, whether the first sides of the cells are on its positive side.
    first_side: Vec<Option<bool>>,
    gap: f64,
}

/// A partner, and whether the point itself is on the first side.
type Partner = (DVec2, bool);

impl Finder<'_> {
    /// The partners of a point that the cells and folds know of.
    fn partners(&self, p: DVec2) -> Vec<Partner> {
        let mut out: Vec<Partner> = Vec::new();
        let add = |out: &mut Vec<Partner>, found: Option<DVec2>, first: bool| {
            if let Some(q) = found
                && !out.iter().any(|(k, f)| *f == first && k.distance(q) < 1e-7)
            {
                out.push((q, first));
            }
        };
        if let Some((number, _)) = self.folds.iter().find(|f| f.1.grown(0.25).contains(p))
            && let Some((node, r)) = self.across(*number, p)
        {
            let found = self.partner(p, p - DVec2::from_angle(node.phi) * (2.0 * r));
            add(&mut out, found, self.is_first(p).unwrap_or(true));
        }
        for c in self.cells {
            for (own, other, first) in [(&c.a, &c.b, true), (&c.b, &c.a, false)] {
                let known = |out: &[Partner]| out.iter().any(|(q, f)| *f == first && other.grown(1.0).contains(*q));
                if own.grown(0.1).contains(p) && !known(&out) {
                    add(&mut out, self.partner(p, other.center()), first);
                }
            }
        }
        out
    }

    /// The node of an edge nearest to a point, and how far along its null direction the point is from the edge.
    fn across(&self, number: usize, p: DVec2) -> Option<(CuspNode, f64)> {
        let nodes = self.edges.get(number)?.nodes();
        let at = (0..nodes.len()).min_by(|&a, &b| nodes[a].at.distance(p).total_cmp(&nodes[b].at.distance(p)))?;
        let along = nodes[(at + 1).min(nodes.len() - 1)].at - nodes[at.saturating_sub(1)].at;
        let across = along.perp().try_normalize()?;
        let r = (p - nodes[at].at).dot(across) / DVec2::from_angle(nodes[at].phi).dot(across);
        r.is_finite().then_some((nodes[at], r))
    }

    /// Whether a point is on the first side, as far as a fold beside it tells.
    fn is_first(&self, p: DVec2) -> Option<bool> {
        let (number, _) = self.folds.iter().find(|f| f.1.grown(0.25).contains(p))?;
        Some((*self.first_side.get(*number)?)? == (self.edges.get(*number)?.side_of(p) > 0.0))
    }

    /// The partner of a point close to a guess, if it lies in the domain.
    fn partner(&self, p: DVec2, guess: DVec2) -> Option<DVec2> {
        let sheet = self.sheet;
        let mut q = guess;
        for _ in 0..25 {
            // Across a seam the direct form: the surface may have a kink there.
            let d = p - q;
            let step = if d.length() < 0.2 && d.length() > 0.0 {
                // F(m, phi, r) with p = m + r e held.
                let (r, phi) = (0.5 * d.length(), d.to_angle());
                let e = DVec2::from_angle(phi);
                let value = near(sheet, p - e * r, phi, r);
                let by_r = value.j[3] - value.j[0] * e.x - value.j[1] * e.y;
                let f = e.perp() * r;
                let by_phi = value.j[2] - value.j[0] * f.x - value.j[1] * f.y;
                let d = least_squares(by_r, by_phi, -value.f)?;
                // q = p - 2 r e.
                (e * d.x + e.perp() * (r * d.y)) * -2.0
            } else {
                let jet = sheet.jet(q, 1);
                least_squares(jet.d[0], jet.d[1], sheet.point(p) - jet.s)?
            };
            q += step;
            if !q.is_finite() || q.distance(guess) > 0.5 {
                return None;
            }
            if step.length() < 1e-14 {
                break;
            }
        }
        let inside = (0..2).all(|d| sheet.periodic[d] || (-1e-10..=1.0 + 1e-10).contains(&q[d]));
        let apart = sheet.point(p).distance(sheet.point(q));
        (inside && apart <= self.gap && p.distance(q) > 1e-12).then_some(q)
    }

    /// The stretches of a seam at which the surface is folded: both sides of it coincide, and are one point on it.
    fn seam(&self, d: usize) -> Vec<Vec<Pair>> {
        const BESIDE: f64 = 1e-3;
        let at = |s: f64, t: f64| {
            let mut p = DVec2::splat(s);
            p[1 - d] = t;
            p
        };
        let folded = |t: f64| {
            let found = self.partner(at(1.0 - BESIDE, t), at(BESIDE, t));
            found.is_some_and(|q| q[d] > 0.0 && q[d] < 20.0 * BESIDE)
        };
        // The first side is where the cells beside the seam say.
        let first_high = self.cells.iter().any(|c| c.a.high[d] > 1.0 - 1e-9 && c.b.low[d] < 1e-9);
        let pair = |t: f64| if first_high { [at(1.0, t), at(0.0, t)] } else { [at(0.0, t), at(1.0, t)] };
        let edge = |mut inside: f64, mut outside: f64| {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                if folded(middle) { inside = middle } else { outside = middle }
            }
            pair(inside)
        };
        let mut out: Vec<Vec<Pair>> = Vec::new();
        let mut line: Vec<Pair> = Vec::new();
        let step = 1.0 / SAMPLES as f64;
        for k in 0..=SAMPLES {
            let t = k as f64 * step;
            if folded(t) {
                if line.is_empty() && k > 0 {
                    line.push(edge(t, t - step));
                }
                line.push(pair(t));
            } else if !line.is_empty() {
                line.push(edge(t - step, t));
                out.push(std::mem::take(&mut line));
            }
        }
        out.push(line);
        out.retain(|l| l.len() > 1);
        out
    }

    /// The stretches of one border on which the surface lies on itself.
    fn border(&self, d: usize, end: f64) -> Vec<Vec<Pair>> {
        let at = |t: f64| {
            let mut p = DVec2::splat(end);
            p[1 - d] = t;
            p
        };
        // Follows a partner on, on the same side.
        let follow = |t: f64, (guess, first): Partner| -> Option<Partner> {
            let p = at(t);
            let q = self.partner(p, guess)?;
            (self.is_first(p).is_none_or(|s| s == first) && q.distance(guess) < 0.1).then_some((q, first))
        };
        let pair = |t: f64, (q, first): Partner| if first { [at(t), q] } else { [q, at(t)] };
        let edge = |mut inside: f64, mut outside: f64, mut known: Partner| {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                match follow(middle, known) {
                    Some(found) => (inside, known) = (middle, found),
                    None => outside = middle,
                }
            }
            pair(inside, known)
        };
        let mut out: Vec<Vec<Pair>> = Vec::new();
        let mut open: Vec<(Vec<Pair>, Partner)> = Vec::new();
        let mut before = 0.0;
        for k in 0..=SAMPLES {
            let t = k as f64 / SAMPLES as f64;
            let mut found = self.partners(at(t));
            let mut still = Vec::new();
            for (mut line, last) in open.drain(..) {
                match follow(t, last) {
                    Some(next) => {
                        found.retain(|f| f.1 != next.1 || f.0.distance(next.0) > 1e-6);
                        line.push(pair(t, next));
                        still.push((line, next));
                    }
                    None => {
                        line.push(edge(before, t, last));
                        out.push(line);
                    }
                }
            }
            for new in found {
                let mut line = Vec::new();
                if k > 0 {
                    line.push(edge(t, before, new));
                }
                line.push(pair(t, new));
                still.push((line, new));
            }
            open = still;
            before = t;
        }
        out.extend(open.into_iter().map(|o| o.0));
        out.retain(|line| line.windows(2).map(|s| s[0][0].distance(s[1][0])).sum::<f64>() > 1e-6);
        out
    }
}

/// The step (x, y) with a x + b y closest to c.
fn least_squares(a: glam::DVec3, b: glam::DVec3, c: glam::DVec3) -> Option<DVec2> {
    let (e, f, g) = (a.dot(a), a.dot(b), b.dot(b));
    let det = e * g - f * f;
    if det.is_nan() || det <= 1e-14 * e * g {
        return None;
    }
    let (x, y) = (a.dot(c), b.dot(c));
    Some(DVec2::new(g * x - f * y, e * y - f * x) / det)
}

/// Chains stretches with common ends into closed loops, interior on the left; none where one does not close.
fn chain(sheet: &Sheet, mut pieces: Vec<Vec<Pair>>) -> Vec<Vec<Pair>> {
    let apart = |x: Pair, y: Pair| {
        let one = |k: usize| (x[k] - y[k] - turns(sheet, x[k], y[k])).length();
        one(0).max(one(1))
    };
    let mut loops: Vec<Vec<Pair>> = Vec::new();
    while let Some(mut line) = pieces.pop() {
        loop {
            let (Some(&first), Some(&last)) = (line.first(), line.last()) else { return Vec::new() };
            if line.len() > 3 && apart(first, last) < JOINED {
                line.pop();
                line.push(first);
                loops.push(line);
                break;
            }
            let next = pieces.iter().position(|l| {
                l.first().zip(l.last()).is_some_and(|(a, b)| apart(*a, last) < JOINED || apart(*b, last) < JOINED)
            });
            let Some(next) = next else { return Vec::new() };
            let mut more = pieces.swap_remove(next);
            if more.last().is_some_and(|b| apart(*b, last) < JOINED) {
                more.reverse();
            }
            line.extend(more.into_iter().skip(1));
        }
    }
    loops.sort_by(|x, y| area(y).abs().total_cmp(&area(x).abs()));
    let outer = loops.first().cloned().unwrap_or_default();
    for (at, line) in loops.iter_mut().enumerate() {
        let hole = at > 0 && line.first().is_some_and(|p| contains(&outer, p[0]));
        if (area(line) > 0.0) == hole {
            line.reverse();
        }
    }
    loops
}

/// The signed area of a loop on the first side.
pub(crate) fn area(line: &[Pair]) -> f64 {
    line.windows(2).map(|s| 0.5 * s[0][0].perp_dot(s[1][0])).sum()
}

fn contains(line: &[Pair], p: DVec2) -> bool {
    let crossed = line.windows(2).filter(|s| {
        let (x, y) = (s[0][0], s[1][0]);
        (x.y > p.y) != (y.y > p.y) && p.x < x.x + (p.y - x.y) / (y.y - x.y) * (y.x - x.x)
    });
    crossed.count() % 2 == 1
}
