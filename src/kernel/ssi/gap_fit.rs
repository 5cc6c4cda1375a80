//! The gap between two nearly parallel surfaces as a polynomial of two variables, fitted.
//!
//! `g(u, v) = (A(u, v) - B(s, t)) . n`, with (s, t) the foot of A(u, v) on B along n, at the Chebyshev nodes of degree 8; the
//! error is measured between them. Feet are found by Newton's method from where those found before predict them, so that
//! most need one evaluation of B. What is done with the fit: [`super::contact`].

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::bernstein::{Poly2, chebyshev_node};
use super::piece::{Patch, Piece};
use super::tree::Node;

/// The degree of the fit in each variable.
pub const DEGREE: usize = 8;
/// How many nodes that takes.
const W: usize = DEGREE + 1;
/// A fitted function.
pub type Fit = Poly2<W>;
/// How far the last coefficient along a line may exceed the error allowed (that of the cell may be larger).
const ROUGH: f64 = 30.0;
/// Rounding of g in the unit frame.
pub const ROUNDING: f64 = 2e-15;

/// The gap function over one node of A against one piece of B.
#[derive(Clone, Debug)]
pub struct Contact {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// Where the cell starts on A.
    pub low: DVec2,
    /// Where it ends.
    pub high: DVec2,
    /// The gap.
    pub g: Fit,
    /// The first parameter of the foot.
    pub s: Fit,
    /// The second parameter of the foot.
    pub t: Fit,
    /// A bound of the error of `g`.
    pub error: f64,
    /// The rectangle on B in which all feet lie.
    pub feet: [DVec2; 2],
}

/// The foot of the point `p` on a piece along `n`, by Newton's method from `start`: parameters and jet.
pub fn foot_along(
    piece: &impl Patch,
    p: DVec3,
    frame: [DVec3; 2],
    start: DVec2,
) -> Option<(DVec2, super::piece::Jet1)> {
    let mut st = start;
    for _ in 0..20 {
        let jet = piece.jet1(st);
        let r = jet.p - p;
        let r = DVec2::new(r.dot(frame[0]), r.dot(frame[1]));
        let m = [jet.u.dot(frame[0]), jet.v.dot(frame[0]), jet.u.dot(frame[1]), jet.v.dot(frame[1])];
        let det = m[0] * m[3] - m[1] * m[2];
        if !(det.abs() > 1e-10 * (jet.u.length() * jet.v.length())) {
            return None;
        }
        let step = DVec2::new((m[3] * r.x - m[1] * r.y) / det, (m[0] * r.y - m[2] * r.x) / det);
        let length = step.length();
        // A last small step is as good as linear: its square is below rounding.
        if length < 3e-8 {
            let p = jet.p - jet.u * step.x - jet.v * step.y;
            return Some((st - step, super::piece::Jet1 { p, ..jet }));
        }
        st -= step * (0.5 / length).min(1.0);
        if st.x.abs() > 8.0 || st.y.abs() > 8.0 {
            return None;
        }
    }
    None
}

/// Two unit vectors across `n`.
pub fn frame_across(n: DVec3) -> [DVec3; 2] {
    let (e1, e2) = n.any_orthonormal_pair();
    [e1, e2]
}

/// Fits the gap over a node of A against the piece of a node of B. `None` when a foot is missing, leaves the piece by
/// more than its own size, stands too steep, or the fit is poor: then the node is split.
pub fn fit(a: &Piece, node: &Node, b: &Piece, other: &Node) -> Option<Contact> {
    let sign = if node.n.dot(other.n) < 0.0 { -1.0 } else { 1.0 };
    let n = (node.n + other.n * sign).normalize_or_zero();
    if n == DVec3::ZERO {
        return None;
    }
    let frame = frame_across(n);
    // A's normals over the node are near n: both nodes are flat, and n is halfway between them.
    let foot = |p: DVec3, start: DVec2| -> Option<(f64, DVec2)> {
        let (st, jb) = foot_along(b, p, frame, start)?;
        let cross = jb.cross();
        let steep = cross.dot(n).abs() < 0.3 * cross.length();
        if steep || st.min_element() < -1.0 || st.max_element() > 2.0 {
            return None;
        }
        Some(((p - jb.p).dot(n), st))
    };
    let nodes: [f64; W] = std::array::from_fn(|i| chebyshev_node(DEGREE, i));
    let along = |k: usize| nodes.map(|x| node.low[k] + (node.high[k] - node.low[k]) * x);
    let points = a.grid(&along(0), &along(1));
    let sample = |i: usize, j: usize, start: DVec2| foot(points[j * W + i], start);
    // The foot of the middle, then outwards from there, each predicted from those that are known.
    let (_, center) = sample(DEGREE / 2, DEGREE / 2, other.local(DVec2::ZERO))?;
    const M: usize = DEGREE / 2;
    let mut g = [[0.0; W]; W];
    let mut feet = [[DVec2::ZERO; W]; W];
    // The middle column and the middle row first: where they need a higher degree, so does the rest.
    for j in outwards() {
        let start = if j == M { center } else { extrapolated(j, |j| feet[j][M]) };
        (g[j][M], feet[j][M]) = sample(M, j, start)?;
    }
    if rough(|j| g[j][M]) {
        return None;
    }
    // How far feet extrapolated along their row were off: extrapolated across the rows that corrects the next, so
    // that one evaluation is enough for most.
    let mut missed = [[DVec2::ZERO; W]; W];
    for j in outwards() {
        for i in outwards().skip(1) {
            let along = extrapolated(i, |i| feet[j][i]);
            let across = if j == M { DVec2::ZERO } else { extrapolated(j, |j| missed[j][i]) };
            (g[j][i], feet[j][i]) = sample(i, j, along - across)?;
            missed[j][i] = along - feet[j][i];
        }
        if j == M && rough(|i| g[M][i]) {
            return None;
        }
    }
    let g = Fit::fit(&g);
    let [min, max] = g.range();
    let allowed = (1e-5 * min.abs().max(max.abs())).max(8.0 * ROUNDING);
    // Measured between the nodes, each foot predicted from the nearest node.
    let mut error = ROUNDING;
    for (x, y) in [(0.02, 0.5), (0.98, 0.41), (0.31, 0.02), (0.62, 0.98), (0.31, 0.69), (0.69, 0.12)] {
        let near = |x: f64| (0..W).min_by(|&i, &k| (nodes[i] - x).abs().total_cmp(&(nodes[k] - x).abs())).unwrap_or(M);
        let p = a.point(node.low + (node.high - node.low) * DVec2::new(x, y));
        let (gap, _) = foot(p, feet[near(y)][near(x)])?;
        error = f64::max(error, 4.0 * (gap - g.value(x, y)).abs() + ROUNDING);
        if error > allowed {
            return None;
        }
    }
    let by = |k: usize| Fit::fit(&feet.map(|row| row.map(|f| f[k])));
    let (s, t) = (by(0), by(1));
    let ([s0, s1], [t0, t1]) = (s.range(), t.range());
    let feet = [DVec2::new(s0, t0), DVec2::new(s1, t1)];
    Some(Contact { pa: node.piece, pb: other.piece, low: node.low, high: node.high, g, s, t, error, feet })
}

/// Whether values at the nodes of a line are so far from a polynomial that a fit over the whole cell would fail too:
/// their last Chebyshev coefficient against what an error may be.
fn rough(value: impl Fn(usize) -> f64) -> bool {
    let (mut last, mut most) = (0.0, 0.0);
    for i in 0..=DEGREE {
        let share = if i == 0 || i == DEGREE { 0.5 } else { 1.0 } / DEGREE as f64;
        last += if i % 2 == 0 { share * value(i) } else { -share * value(i) };
        most = f64::max(most, value(i).abs());
    }
    last.abs() > ROUGH * (1e-5 * most).max(8.0 * ROUNDING)
}

/// The Chebyshev nodes of a line in the order in which their feet are found: the middle one, then to both sides in turn.
fn outwards() -> impl Iterator<Item = usize> {
    (0..=DEGREE).map(nth)
}

/// The node that comes after `k` others.
fn nth(k: usize) -> usize {
    if k.is_multiple_of(2) { DEGREE / 2 + k / 2 } else { DEGREE / 2 - k.div_ceil(2) }
}

/// What is known at nodes further inwards, extrapolated to node `i`, which is not the middle one: by the polynomial through
/// the last few that came before it.
fn extrapolated(i: usize, known: impl Fn(usize) -> DVec2) -> DVec2 {
    /// The most nodes that are used.
    const MOST: usize = 6;
    static WEIGHTS: LazyLock<[[f64; MOST]; DEGREE + 1]> = LazyLock::new(|| {
        let at = |k: usize| chebyshev_node(DEGREE, nth(k));
        std::array::from_fn(|n| {
            let used = n.saturating_sub(MOST)..n;
            std::array::from_fn(|k| {
                let k = used.start + k;
                if k >= n {
                    return 0.0;
                }
                used.clone().filter(|&l| l != k).map(|l| (at(n) - at(l)) / (at(k) - at(l))).product()
            })
        })
    });
    const M: usize = DEGREE / 2;
    let n = if i >= M { 2 * (i - M) } else { 2 * (M - i) - 1 };
    (n.saturating_sub(MOST)..n).zip(WEIGHTS[n]).map(|(k, w)| known(nth(k)) * w).sum()
}
