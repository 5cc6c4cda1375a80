//! Cusp edges: curves along which Su x Sv vanishes, and what is proved about windows that hold one.
//!
//! The edge is followed along the kernel of the miter system, a little beyond the border of the domain. Near it the pairs
//! that coincide are zeros of F(m, k, rho), the mean of D S in the direction e + k x along m +- sqrt(rho) (e + k x), in
//! the frame of the null direction e and x across it, with m given by one coordinate t along the edge and one, n, across.
//!
//! *Cuspidal edge.* F has the derivatives S_en, S_x, S_eee / 6 by (n, k, rho). Where that Jacobian, bounded over the window
//! as in the cross-cap test, is regular, every t has one solution at most. The edge itself is one, with rho = 0: no two
//! points of the window coincide. The third derivative is bounded on pieces, which is enough where they join with two
//! continuous derivatives.
//!
//! *Fold.* Where S_eee has no part of its own and a solution is there for every rho, the surface is folded onto itself: the
//! two derivatives S_en and S_x alone, in the plane of their values at the edge, bound the number of solutions for every
//! (t, rho) by one, and the pairs across the edge are those. That they coincide is measured, not proved.
//!
//! Of rational pieces the derivatives are bounded by intervals of the quotient rule, so that windows must be smaller.
//!
//! How it fails: swallowtail points of an edge, rational folds too strongly weighted, and joints with one continuous
//! derivative prove nothing; the windows stay open and are listed.

use glam::{DMat3, DVec2, DVec3};

use super::chart::near;
use super::hull::Rect;
use super::miter::{at, damped, kernel};
use super::sheet::Sheet;
use super::window::{add, contracts, swept};
use crate::kernel::job::Job;

/// The step along an edge.
const STEP: f64 = 1.0 / 256.0;
/// How many steps an edge is followed beyond the domain.
const BEYOND: usize = 16;

/// A point of a cusp edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CuspNode {
    pub at: DVec2,
    /// The angle of the null direction.
    pub phi: f64,
}

/// A curve along which Su x Sv vanishes.
#[derive(Clone, Debug, Default)]
pub(crate) struct CuspEdge {
    /// The points in the domain lie in `inside`; the others continue the edge beyond its ends.
    all: Vec<CuspNode>,
    inside: std::ops::Range<usize>,
    pub closed: bool,
}

impl CuspEdge {
    /// The points in the domain, in order.
    pub fn nodes(&self) -> &[CuspNode] {
        self.all.get(self.inside.clone()).unwrap_or(&[])
    }

    /// On which side of the edge a point is, as its signed distance.
    pub fn side_of(&self, p: DVec2) -> f64 {
        let nodes = self.nodes();
        let nearest = (0..nodes.len()).min_by(|&a, &b| nodes[a].at.distance(p).total_cmp(&nodes[b].at.distance(p)));
        nearest.map_or(0.0, |k| {
            let along = nodes[(k + 1).min(nodes.len() - 1)].at - nodes[k.saturating_sub(1)].at;
            along.normalize_or_zero().perp_dot(p - nodes[k].at)
        })
    }
}

/// Follows zeros of the miter system along its kernel; `None` when there are none beside the first.
pub(crate) fn follow(sheet: &Sheet, start: [f64; 3], frame: &DMat3, job: &Job) -> Option<CuspEdge> {
    let first = CuspNode { at: DVec2::new(start[0], start[1]), phi: start[2] };
    let (ahead, inside_ahead, closed) = side(sheet, start, kernel(frame), job);
    if closed {
        let mut all = vec![first];
        all.extend(ahead);
        all.push(first);
        let inside = 0..all.len();
        return Some(CuspEdge { all, inside, closed });
    }
    let (back, inside_back, _) = side(sheet, start, -kernel(frame), job);
    let begin = back.len() - inside_back;
    let mut all: Vec<CuspNode> = back.into_iter().rev().collect();
    all.push(first);
    let end = all.len() + inside_ahead;
    all.extend(ahead);
    (end - begin > 4).then_some(CuspEdge { all, inside: begin..end, closed })
}

/// One way along an edge: its points, how many of them lie in the domain, and whether it closed.
fn side(sheet: &Sheet, start: [f64; 3], along: DVec3, job: &Job) -> (Vec<CuspNode>, usize, bool) {
    let mut nodes: Vec<CuspNode> = Vec::new();
    let mut inside = None;
    let mut y = DVec3::from(start);
    let mut n = along;
    while nodes.len() < 4096 && !job.is_cancelled() {
        if n.truncate().length() < 1e-6 {
            break;
        }
        let Some(z) = next(sheet, y, n, STEP) else { break };
        let m = z.truncate();
        let out = |d: usize| !sheet.periodic[d] && !(0.0..=1.0).contains(&m[d]);
        if inside.is_none() && (out(0) || out(1)) {
            let border = on_border(sheet, y, n, z);
            if nodes.last().is_some_and(|l| l.at.distance(border.truncate()) < 0.1 * STEP) {
                nodes.pop();
            }
            nodes.push(CuspNode { at: border.truncate().clamp(DVec2::ZERO, DVec2::ONE), phi: border.z });
            inside = Some(nodes.len());
        }
        if inside.is_some_and(|count| nodes.len() >= count + BEYOND) {
            break;
        }
        if inside.is_none() && nodes.len() > 8 && m.distance(DVec2::new(start[0], start[1])) < 0.7 * STEP {
            return (nodes.clone(), nodes.len(), true);
        }
        if nodes.last().is_none_or(|l| l.at.distance(m) > 0.1 * STEP) {
            nodes.push(CuspNode { at: m, phi: z.z });
        }
        let value = at(sheet, z.into());
        let new = kernel(&DMat3::from_cols(value.j[0], value.j[1], value.j[2]));
        n = if new.dot(n) < 0.0 { -new } else { new };
        y = z;
    }
    let count = inside.unwrap_or(nodes.len());
    (nodes, count, false)
}

/// The zero one step further.
fn next(sheet: &Sheet, y: DVec3, n: DVec3, step: f64) -> Option<DVec3> {
    let mut z = y + n * (step / n.truncate().length());
    let mut value = at(sheet, z.into());
    for _ in 0..20 {
        let frame = DMat3::from_cols(value.j[0], value.j[1], value.j[2]);
        let Some(mut d) = damped(&frame, value.f) else { break };
        d -= n * n.dot(d);
        z -= d;
        value = at(sheet, z.into());
        if d.length() < 1e-12 {
            break;
        }
    }
    let speed = value.j[2].length() + value.j[0].length();
    (value.f.length() <= 1e-9 * speed && z.distance(y) <= 4.0 * step.max(1e-9)).then_some(z)
}

/// Where a step leaves the domain.
fn on_border(sheet: &Sheet, y: DVec3, n: DVec3, z: DVec3) -> DVec3 {
    let over = |m: DVec2| {
        (0..2).filter(|&d| !sheet.periodic[d]).map(|d| (-m[d]).max(m[d] - 1.0)).fold(f64::NEG_INFINITY, f64::max)
    };
    let (mut low, mut high, mut best) = (0.0, STEP, z);
    for _ in 0..60 {
        let (a, b) = (over(if low == 0.0 { y.truncate() } else { best.truncate() }), over(z.truncate()));
        if high - low < 1e-15 || !a.is_finite() || !b.is_finite() {
            break;
        }
        let middle = 0.5 * (low + high);
        let Some(here) = next(sheet, y, n, middle) else { break };
        if over(here.truncate()) > 0.0 {
            (high, best) = (middle, here);
        } else {
            low = middle;
        }
    }
    best
}

/// What a window at a cusp edge is proved to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CuspWindow {
    /// No two points of it coincide.
    Cuspidal,
    /// The points on both sides of the edge with this number coincide, and no others.
    Folded(usize),
}

/// Tests a window for being [`CuspWindow`].
pub(crate) fn cusp_window(sheet: &Sheet, edges: &[CuspEdge], rect: &Rect) -> Option<CuspWindow> {
    let window = rect.grown(0.25);
    for (number, edge) in edges.iter().enumerate() {
        // The nodes of the edge around the window, in one run.
        let around = window.grown(2.0);
        let near_by = (0..edge.all.len()).filter(|&k| window.contains(edge.all[k].at));
        let center = rect.center();
        let by_distance =
            |a: &usize, b: &usize| edge.all[*a].at.distance(center).total_cmp(&edge.all[*b].at.distance(center));
        let Some(middle) = near_by.min_by(by_distance) else { continue };
        let (mut from, mut to) = (middle, middle);
        while from > 0 && around.contains(edge.all[from].at) {
            from -= 1;
        }
        while to + 1 < edge.all.len() && around.contains(edge.all[to].at) {
            to += 1;
        }
        let run = &edge.all[from..=to];
        let Some(found) = proved(sheet, &window, &around, run, edge.all[middle]) else { continue };
        return Some(match found {
            true => CuspWindow::Folded(number),
            false => CuspWindow::Cuspidal,
        });
    }
    None
}

/// The proof for one run of an edge: `Some(folded)`.
fn proved(sheet: &Sheet, window: &Rect, around: &Rect, run: &[CuspNode], node: CuspNode) -> Option<bool> {
    let along = (run.last()?.at - run.first()?.at).try_normalize()?;
    let across = along.perp();
    // The edge runs through the surroundings for every t of the window, once, and stays clear of their border.
    let corners = |r: &Rect| [r.low, DVec2::new(r.high.x, r.low.y), r.high, DVec2::new(r.low.x, r.high.y)];
    let ts = corners(window).map(|c| along.dot(c));
    let (low, high) = ts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &t| (l.min(t), h.max(t)));
    let t = |n: &CuspNode| along.dot(n.at);
    if run.windows(2).any(|s| t(&s[1]) <= t(&s[0])) || t(run.first()?) > low || t(run.last()?) < high {
        return None;
    }
    let clear = window.grown(1.4);
    if run.windows(2).any(|s| t(&s[1]) >= low && t(&s[0]) <= high && !s.iter().all(|n| clear.contains(n.at))) {
        return None;
    }
    match contraction(sheet, window, around, node, across)? {
        Contraction::WithThird => Some(false),
        Contraction::InPlane => folded(sheet, window, run, along).then_some(true),
    }
}

/// Whether every t of a window has at most one solution (n, k, rho): the test of cuspidal edges, about a node.
pub(crate) fn uniquely_solved(sheet: &Sheet, window: &Rect, around: &Rect, node: CuspNode, across: DVec2) -> bool {
    contraction(sheet, window, around, node, across) == Some(Contraction::WithThird)
}

/// What the Jacobian of F contracts with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contraction {
    /// By (n, k, rho).
    WithThird,
    /// By (n, k) in the plane of their derivatives.
    InPlane,
}

/// Bounds the Jacobian of F over a window, preconditioned at the node.
fn contraction(sheet: &Sheet, window: &Rect, around: &Rect, node: CuspNode, across: DVec2) -> Option<Contraction> {
    let e = DVec2::from_angle(node.phi);
    let x = e.perp();
    let jet = sheet.jet(node.at, 2);
    let s_x = jet.d[0] * x.x + jet.d[1] * x.y;
    let pair = |a: DVec2, b: DVec2| [a.x * b.x, a.x * b.y + a.y * b.x, a.y * b.y];
    let mix = |a: DVec2, b: DVec2| {
        let c = pair(a, b);
        jet.dd[0] * c[0] + jet.dd[1] * c[1] + jet.dd[2] * c[2]
    };
    let s_en = mix(e, across);
    let jets = sheet.jets(around);
    // |k| <= slope, from the part of the mean of k S_x + S_e along S_x.
    let a = s_x / s_x.length_squared();
    let forward = jets.range(a, [x.x, x.y, 0.0, 0.0, 0.0]);
    let sideways = jets.range(a, [e.x, e.y, 0.0, 0.0, 0.0]);
    if forward[0].is_nan() || forward[0] <= 0.0 {
        return None;
    }
    let slope = sideways[0].abs().max(sideways[1].abs()) / forward[0];
    let size = window.size();
    let reach = 0.5 * (size.x * e.x.abs() + size.y * e.y.abs());
    // The first two columns of Y J - I for a row y of Y.
    let columns = |y: DVec3, row: usize| {
        let twice = |a: DVec2, b: DVec2| {
            let c = pair(a, b);
            jets.range(y, [0.0, 0.0, c[0], c[1], c[2]])
        };
        let (xx, xe) = (twice(x, x), twice(x, e));
        let tilt = add(swept(xx, slope), xe);
        let bend = reach * 0.25 * (tilt[1] - tilt[0]);
        let both = [
            add(swept(twice(x, across), slope), twice(e, across)),
            add(jets.range(y, [x.x, x.y, 0.0, 0.0, 0.0]), [-bend, bend]),
        ];
        let mut out = [0.0; 2];
        for (j, c) in both.into_iter().enumerate() {
            let unit = if j == row { 1.0 } else { 0.0 };
            out[j] = (c[1] - unit).abs().max((c[0] - unit).abs());
        }
        out
    };
    let cube = |d: &[DVec3; 4], k: f64| {
        let v = e + x * k;
        d[0] * v.x.powi(3) + d[1] * (3.0 * v.x * v.x * v.y) + d[2] * (3.0 * v.x * v.y * v.y) + d[3] * v.y.powi(3)
    };
    if let Some(third) = sheet.third_hull(around) {
        let mean = third.each_ref().map(|points| points.iter().sum::<DVec3>() / points.len().max(1) as f64);
        let frame = DMat3::from_cols(s_en, s_x, cube(&mean, 0.0) / 6.0);
        if well_conditioned(&frame) {
            let inverse = frame.inverse();
            let mut error = [[0.0; 3]; 3];
            for (i, row) in error.iter_mut().enumerate() {
                let y = inverse.row(i);
                (row[0], row[1]) = columns(y, i).into();
                let c = cubic(y, &third, e, x, slope);
                let unit = if i == 2 { 1.0 } else { 0.0 };
                row[2] = (c[1] / 6.0 - unit).abs().max((c[0] / 6.0 - unit).abs());
            }
            if contracts(&error) {
                return Some(Contraction::WithThird);
            }
        }
    }
    let frame = DMat3::from_cols(s_en, s_x, s_en.cross(s_x));
    if !well_conditioned(&frame) {
        return None;
    }
    let inverse = frame.inverse();
    let mut error = [[0.0; 3]; 3];
    for (i, row) in error.iter_mut().take(2).enumerate() {
        (row[0], row[1]) = columns(inverse.row(i), i).into();
    }
    contracts(&error).then_some(Contraction::InPlane)
}

fn well_conditioned(frame: &DMat3) -> bool {
    let volume = frame.x_axis.length() * frame.y_axis.length() * frame.z_axis.length();
    frame.determinant().abs() > 1e-6 * volume && volume > 0.0
}

/// The range of y . D^3 S in the direction e + k x, |k| <= slope.
fn cubic(y: DVec3, third: &[Vec<DVec3>; 4], e: DVec2, x: DVec2, slope: f64) -> [f64; 2] {
    // Coefficients of uuu, uuv, uvv, vvv for each power of k.
    let product = |a: DVec2, b: DVec2, c: DVec2| {
        [
            a.x * b.x * c.x,
            a.x * b.x * c.y + a.x * b.y * c.x + a.y * b.x * c.x,
            a.x * b.y * c.y + a.y * b.x * c.y + a.y * b.y * c.x,
            a.y * b.y * c.y,
        ]
    };
    let powers =
        [product(e, e, e), product(e, e, x).map(|t| 3.0 * t), product(e, x, x).map(|t| 3.0 * t), product(x, x, x)];
    let mut out = [0.0; 2];
    for (at, weights) in powers.iter().enumerate() {
        let mut one = [0.0; 2];
        for (points, &w) in third.iter().zip(weights) {
            let [a, b] = super::hull::range(y, points);
            one = add(one, if w >= 0.0 { [a * w, b * w] } else { [b * w, a * w] });
        }
        out = add(out, if at == 0 { one } else { swept(one, slope.powi(at as i32)) });
    }
    out
}

/// Whether pairs across an edge coincide: measured at some of its points and several distances.
fn folded(sheet: &Sheet, window: &Rect, run: &[CuspNode], along: DVec2) -> bool {
    let across = along.perp();
    let reach = 0.5 * window.size().min_element();
    let inside: Vec<&CuspNode> = run.iter().filter(|n| window.contains(n.at)).collect();
    let step = (inside.len() / 4).max(1);
    let mut met = 0;
    for node in inside.into_iter().step_by(step) {
        for r in [0.1 * reach, 0.4 * reach, 0.9 * reach] {
            // Newton on (n, phi) with t and r held, in the sense of least squares.
            let (mut m, mut phi) = (node.at, node.phi);
            let mut last = f64::INFINITY;
            for _ in 0..20 {
                let value = near(sheet, m, phi, r);
                let (a, b) = (value.j[0] * across.x + value.j[1] * across.y, value.j[2]);
                let (ee, ef, ff) = (a.dot(a), a.dot(b), b.dot(b));
                let det = ee * ff - ef * ef;
                if det.is_nan() || det <= 1e-14 * ee * ff {
                    return false;
                }
                let (p, q) = (a.dot(value.f), b.dot(value.f));
                let d = DVec2::new(ff * p - ef * q, ee * q - ef * p) / det;
                m -= across * d.x;
                phi -= d.y;
                last = value.f.length() * r;
                if d.length() < 1e-13 {
                    break;
                }
            }
            if last.is_nan() || last > 1e-11_f64.max(4.0 * sheet.rounding) || m.distance(node.at) > reach {
                return false;
            }
            met += 1;
        }
    }
    met > 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::{Knots, Surface};
    use crate::kernel::self_ssi::miter;

    #[test]
    fn a_cusp_edge_is_one_curve_and_no_points() {
        // (u^2, u^3, v) over [-1, 1] x [0, 1].
        let k = Knots::bezier(3, 0.0, 1.0).unwrap();
        // Bezier ordinates over [-1, 1] of u^2 and u^3.
        let (squares, cubes) = ([1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0], [-1.0, 1.0, -1.0, 1.0]);
        let points = (0..16).map(|at| DVec3::new(squares[at % 4], cubes[at % 4], (at / 4) as f64 / 3.0)).collect();
        let surface = Surface::new(k.clone(), k, points, None).unwrap();
        let sheet = Sheet::new(&surface, 1e-11);
        let found = miter::find(&sheet, &Job::new());
        assert_eq!((found.points.len(), found.cusps.len(), found.open.len()), (0, 1, 0), "{} cells", found.cells);
        let edge: Vec<DVec2> = found.cusps[0].nodes().iter().map(|c| c.at).collect();
        assert!(edge.iter().all(|p| (p.x - 0.5).abs() < 1e-9));
        let ends = [edge[0].y, edge[edge.len() - 1].y];
        assert_eq!((ends[0].min(ends[1]), ends[0].max(ends[1])), (0.0, 1.0));
    }
}
