//! Where two surfaces run nearly parallel: the gap between them as one function of two variables.
//!
//! When both nodes are graphs over a common plane, `g(u, v) = (A(u, v) - B(s, t)) . n`, with (s, t) the foot of
//! A(u, v) on B along n, has the intersection as its zero set and the collinear-normal points of contacts as its
//! critical points. What cancels between the surfaces cancels once, when g is fitted (degree 8, Chebyshev nodes,
//! error measured between them); after that everything is about a bivariate polynomial, whatever the angle between
//! the surfaces: cylinders at 1e-5 degrees are as easy as at 10. Thesis 5.3 looks at binormals of osculating tori
//! instead; the fit sees more than second order, so that loops and pairings need no second look.
//!
//! Cells of g are proved free of zeros (sign of the coefficients), free of critical points (a direction in which
//! all gradients point), or to hold at most one (determinant of the interval Hessian); else they are split. In every
//! cell without an unknown critical point each arc of the zero set ends on the cell's border or circles the one
//! extremum, so the roots on the border, and one ray from the extremum, are seeds of everything.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::bernstein::{Poly2, chebyshev_node, roots};
use super::correct::PointPair;
use super::piece::{Patch, Piece};
use super::tree::Node;

/// The degree of the fit in each variable.
const DEGREE: usize = 8;
/// How many nodes that takes.
const W: usize = DEGREE + 1;
/// A fitted function.
type Fit = Poly2<W>;
/// How far the last coefficient along a line may exceed the error allowed (that of the cell may be larger).
const ROUGH: f64 = 30.0;
/// Rounding of g in the unit frame.
pub const ROUNDING: f64 = 2e-15;
/// Cells smaller than this fraction of the fitted one are given up.
const SMALLEST: f64 = 1.0 / 16384.0;
/// Down to this fraction of the fitted one coincident cells are split whose middle and corners lie off the other piece.
const ACROSS: f64 = 1.0 / 32.0;
/// How often a cell is halved to tell apart where the zero set crosses a border of the other piece.
const RIM_DEPTH: usize = 12;
/// More cells than this and the fit is given up (the node is split and fitted again).
const MOST_CELLS: usize = 3000;

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
    g: Fit,
    s: Fit,
    t: Fit,
    /// A bound of the error of `g`.
    error: f64,
    /// The rectangle on B in which all feet lie.
    pub feet: [DVec2; 2],
}

/// A critical point of the gap.
#[derive(Clone, Copy, Debug)]
pub struct Critical {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// Where.
    pub at: PointPair,
    /// Whether the gap has an extremum there (else a saddle).
    pub extremum: bool,
}

/// A rectangle of A over which something holds.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// Where it starts on A.
    pub low: DVec2,
    /// Where it ends.
    pub high: DVec2,
    /// Its middle on A and the foot of that on B.
    pub middle: PointPair,
    /// A bound of the gap over it.
    pub gap: f64,
}

/// A place from which a curve can be traced.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// The piece of A.
    pub pa: usize,
    /// The piece of B.
    pub pb: usize,
    /// Where.
    pub at: PointPair,
}

/// Everything that was found.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Points on the zero set.
    pub seeds: Vec<Seed>,
    /// Critical points with a gap small enough to matter.
    pub criticals: Vec<Critical>,
    /// Points of tangential curves.
    pub ridges: Vec<Seed>,
    /// Cells in which the gap vanishes.
    pub coincident: Vec<Cell>,
    /// Cells in which nothing was decided.
    pub undecided: Vec<Cell>,
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
    if k % 2 == 0 { DEGREE / 2 + k / 2 } else { DEGREE / 2 - k.div_ceil(2) }
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

/// A cell during the analysis.
struct Sub {
    g: Fit,
    low: DVec2,
    size: DVec2,
}

/// A variable's affine part and remainder over the fitted cell.
struct Affine {
    c: f64,
    d: DVec2,
    r: f64,
    /// Bounds of the second derivatives xx, xy, yy.
    h: [f64; 3],
}

impl Affine {
    fn of(p: &Fit) -> Self {
        let n = DEGREE;
        let at = |i: usize, j: usize| p.c[j][i];
        let (c00, c10, c01, c11) = (at(0, 0), at(n, 0), at(0, n), at(n, n));
        let d = DVec2::new(0.5 * (c10 + c11 - c00 - c01), 0.5 * (c01 + c11 - c00 - c10));
        let c = 0.25 * (c00 + c10 + c01 + c11) - 0.5 * (d.x + d.y);
        let mut r: f64 = 0.0;
        for j in 0..=n {
            for i in 0..=n {
                r = r.max((at(i, j) - c - (d.x * i as f64 + d.y * j as f64) / n as f64).abs());
            }
        }
        let h = p.hessian_range().map(|r| r[0].abs().max(r[1].abs()));
        Self { c, d, r, h }
    }

    /// Whether the values over a rectangle lie outside [0, 1] or only touch its ends: what lies on a border belongs
    /// to what is inside of it.
    fn outside(&self, p: &Fit, low: DVec2, size: DVec2, touch: f64) -> bool {
        let beyond = |middle: f64, half: f64| middle - half > 1.0 - touch || middle + half < touch;
        let at = low + 0.5 * size;
        let (middle, half) = (self.c + self.d.dot(at), 0.5 * self.d.abs().dot(size));
        if beyond(middle, half + self.r) {
            return true;
        }
        if !beyond(middle, half - self.r) {
            return false;
        }
        // Close to an end: second order, with bounds of the second derivatives.
        let v = p.eval(at.x, at.y);
        let h = 0.5 * size;
        let bend = 0.5 * (self.h[0] * h.x * h.x + 2.0 * self.h[1] * h.x * h.y + self.h[2] * h.y * h.y);
        beyond(v.f, v.d[0].abs() * h.x + v.d[1].abs() * h.y + bend)
    }
}

/// What was found out about the critical points of a cell.
enum Critic {
    /// Everything.
    Said,
    /// Nothing.
    Unknown,
    /// The fit is not good enough to tell.
    TooCoarse,
}

/// How many decimal places beyond a piece's border still belong to it (parameters near tangency are no sharper).
pub const SLACK: f64 = 1e-7;

impl Contact {
    fn pair(&self, xy: DVec2) -> PointPair {
        PointPair {
            uv: self.low + (self.high - self.low) * xy,
            st: DVec2::new(self.s.value(xy.x, xy.y), self.t.value(xy.x, xy.y)),
        }
    }

    /// Analyses the zero set. `contact` is the gap that counts as none. False when the cells ran out: then only a
    /// finer fit helps, and `out` is as it was.
    pub fn analyse(&self, contact: f64, out: &mut Findings) -> bool {
        let [min, max] = self.g.range();
        if min > contact + self.error || max < -contact - self.error {
            return true;
        }
        let mut found = Findings::default();
        let (s, t) = (Affine::of(&self.s), Affine::of(&self.t));
        let mut stack = vec![Sub { g: self.g, low: DVec2::ZERO, size: DVec2::ONE }];
        let mut count = 0;
        while let Some(sub) = stack.pop() {
            count += 1;
            if count > MOST_CELLS {
                return false;
            }
            let outside = |touch: f64| {
                s.outside(&self.s, sub.low, sub.size, touch) || t.outside(&self.t, sub.low, sub.size, touch)
            };
            if outside(1e-9) {
                continue;
            }
            let [min, max] = sub.g.range();
            if min > contact + self.error || max < -contact - self.error {
                continue;
            }
            if self.regular(&sub) {
                self.border_seeds(&sub, &mut found);
                self.rim_seeds(&sub, [&s, &t], &mut found);
                continue;
            }
            let size = sub.size.max_element();
            match self.one_critical(&sub, contact, &mut found) {
                Critic::Said => {
                    self.rim_seeds(&sub, [&s, &t], &mut found);
                    continue;
                }
                Critic::TooCoarse => return false,
                Critic::Unknown => {}
            }
            if self.ridge(&sub, contact, &mut found) {
                continue;
            }
            // Only what no derivative tells apart is coincident.
            if min >= -contact - self.error && max <= contact + self.error {
                // A sliver along the border is no area.
                if outside(1e-6) {
                    continue;
                }
                // A gap that drowns in the error of the fit is not known to vanish.
                if self.error > (0.5 * contact).max(8.0 * ROUNDING) {
                    return false;
                }
                // Of a cell across the border only the part on this side counts, if there is any.
                let inside = |x: f64| (1e-6..=1.0 - 1e-6).contains(&x);
                let reaches = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].iter().any(|&(x, y)| {
                    let at = sub.low + sub.size * DVec2::new(x, y);
                    inside(self.s.value(at.x, at.y)) && inside(self.t.value(at.x, at.y))
                });
                if size < ACROSS || reaches {
                    found.coincident.push(self.cell(&sub));
                    continue;
                }
            }
            if size < SMALLEST {
                if self.error > 8.0 * ROUNDING {
                    return false;
                }
                found.undecided.push(self.cell(&sub));
                continue;
            }
            let [[xl, xh], [yl, yh]] = sub.g.gradient_range();
            let along = if (xh - xl) >= (yh - yl) { 0 } else { 1 };
            let along = if sub.size[along] < 0.05 * sub.size[1 - along] { 1 - along } else { along };
            let [first, second] = sub.g.split(along);
            let mut half = sub.size;
            half[along] *= 0.5;
            let mut middle = sub.low;
            middle[along] += half[along];
            stack.push(Sub { g: second, low: middle, size: half });
            stack.push(Sub { g: first, low: sub.low, size: half });
        }
        out.seeds.append(&mut found.seeds);
        out.criticals.append(&mut found.criticals);
        out.ridges.append(&mut found.ridges);
        out.coincident.append(&mut found.coincident);
        out.undecided.append(&mut found.undecided);
        true
    }

    fn cell(&self, sub: &Sub) -> Cell {
        let size = self.high - self.low;
        let low = self.low + size * sub.low;
        Cell {
            pa: self.pa,
            pb: self.pb,
            low,
            high: low + size * sub.size,
            middle: self.pair(sub.low + 0.5 * sub.size),
            gap: sub.g.c.as_flattened().iter().fold(0.0, |m: f64, c| m.max(c.abs())) + self.error,
        }
    }

    /// Whether all gradients of the cell point into one open half-plane: no critical point, no loop.
    fn regular(&self, sub: &Sub) -> bool {
        let [x, y] = sub.g.gradient_range();
        let slack = 2.0 * (DEGREE * DEGREE) as f64 * self.error;
        let e = DVec2::new(x[0] + x[1], y[0] + y[1]).normalize_or_zero();
        let least = |r: [f64; 2], e: f64| if e >= 0.0 { r[0] * e } else { r[1] * e };
        least(x, e.x) + least(y, e.y) > slack * e.abs().dot(sub.size)
    }

    fn border_seeds(&self, sub: &Sub, found: &mut Findings) {
        for fixed in 0..2 {
            for at_end in [false, true] {
                for root in roots(&sub.g.edge(fixed, at_end), 0.0) {
                    let mut xy = DVec2::splat(root);
                    xy[fixed] = if at_end { 1.0 } else { 0.0 };
                    self.seed(sub.low + sub.size * xy, found);
                }
            }
        }
    }

    /// Seeds where the zero set crosses the borders of B's piece within a cell: an arc may have both its ends there,
    /// and the parts of it on the cell's border outside of B. In each part of the cell where the gradients of the gap
    /// and of the foot's parameter keep turning the same way there is at most one crossing.
    fn rim_seeds(&self, sub: &Sub, feet: [&Affine; 2], found: &mut Findings) {
        for (affine, poly) in feet.into_iter().zip([&self.s, &self.t]) {
            for bound in [0.0, 1.0] {
                // Most cells lie clear of the border.
                let clear = |low: DVec2, size: DVec2| {
                    let reach = 0.5 * affine.d.abs().dot(size) + affine.r;
                    (affine.c + affine.d.dot(low + 0.5 * size) - bound).abs() > reach
                };
                if clear(sub.low, sub.size) {
                    continue;
                }
                let mut stack = vec![(sub.g, sub.low, sub.size, 0)];
                while let Some((g, low, size, depth)) = stack.pop() {
                    let [min, max] = g.range();
                    if min > self.error || max < -self.error {
                        continue;
                    }
                    let at = low + 0.5 * size;
                    if clear(low, size) {
                        continue;
                    }
                    let v = poly.eval(at.x, at.y);
                    let half = 0.5 * size;
                    let sway = DVec2::new(
                        affine.h[0] * half.x + affine.h[1] * half.y,
                        affine.h[1] * half.x + affine.h[2] * half.y,
                    ) * size;
                    let slope = DVec2::from(v.d) * size;
                    if (v.f - bound).abs() > 0.5 * (slope.abs() + sway).element_sum() {
                        continue;
                    }
                    let [gx, gy] = g.gradient_range();
                    let times = |r: [f64; 2], k: f64, spread: f64| {
                        let ends = [r[0] * (k - spread), r[0] * (k + spread), r[1] * (k - spread), r[1] * (k + spread)];
                        ends.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |a, x| [a[0].min(x), a[1].max(x)])
                    };
                    let (p, q) = (times(gx, slope.y, sway.y), times(gy, slope.x, sway.x));
                    let turns = p[0] - q[1] > 0.0 || p[1] - q[0] < 0.0;
                    if turns || depth >= RIM_DEPTH {
                        if let Some(xy) = self.crossing(poly, bound, at) {
                            let inside = ((xy - at).abs() - half).max_element() < 1e-6;
                            if inside {
                                self.seed(xy, found);
                            }
                        }
                        continue;
                    }
                    let along = usize::from(size.y > size.x);
                    let [first, second] = g.split(along);
                    let mut part = size;
                    part[along] *= 0.5;
                    let mut middle = low;
                    middle[along] += part[along];
                    stack.push((second, middle, part, depth + 1));
                    stack.push((first, low, part, depth + 1));
                }
            }
        }
    }

    /// Where the gap is zero and a parameter of the foot has a value, by Newton's method.
    fn crossing(&self, foot: &Fit, value: f64, start: DVec2) -> Option<DVec2> {
        let mut xy = start;
        for _ in 0..20 {
            let (g, s) = (self.g.eval(xy.x, xy.y), foot.eval(xy.x, xy.y));
            let m = glam::DMat2::from_cols_array(&[g.d[0], s.d[0], g.d[1], s.d[1]]);
            let step = m.inverse() * DVec2::new(g.f, s.f - value);
            if !step.is_finite() {
                return None;
            }
            xy -= step * (0.5 / step.length()).min(1.0);
            if (xy - 0.5).abs().max_element() > 1.0 {
                return None;
            }
            if step.length() < 1e-12 {
                return Some(xy);
            }
        }
        None
    }

    fn seed(&self, xy: DVec2, found: &mut Findings) {
        let at = self.pair(xy);
        if at.st.min_element() >= -1e-3 && at.st.max_element() <= 1.0 + 1e-3 {
            found.seeds.push(Seed { pa: self.pa, pb: self.pb, at });
        }
    }

    /// Says everything about a cell that holds at most one critical point.
    fn one_critical(&self, sub: &Sub, contact: f64, found: &mut Findings) -> Critic {
        let [xx, xy, yy] = sub.g.hessian_range();
        let slack = 6000.0 * self.error;
        let grown = |r: [f64; 2], w: f64| [r[0] - slack * w, r[1] + slack * w];
        let xx = grown(xx, sub.size.x * sub.size.x);
        let xy = grown(xy, sub.size.x * sub.size.y);
        let yy = grown(yy, sub.size.y * sub.size.y);
        let products = [xx[0] * yy[0], xx[0] * yy[1], xx[1] * yy[0], xx[1] * yy[1]];
        let (least, most) = products.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let square_most = xy[0].abs().max(xy[1].abs()).powi(2);
        let cross = [xy[0] * xy[0], xy[0] * xy[1], xy[1] * xy[1]];
        let square_least = cross.iter().copied().fold(f64::INFINITY, f64::min);
        let extremum = least > square_most;
        let saddle = most < square_least;
        if !extremum && !saddle {
            return Critic::Unknown;
        }
        // Newton from the middle; the Hessian is regular everywhere.
        let mut p = DVec2::splat(0.5);
        let mut steps = 0;
        let critical = loop {
            let v = sub.g.eval(p.x, p.y);
            let det = v.h[0] * v.h[2] - v.h[1] * v.h[1];
            let step = DVec2::new(v.h[2] * v.d[0] - v.h[1] * v.d[1], v.h[0] * v.d[1] - v.h[1] * v.d[0]) / det;
            p -= step * (0.5 / step.length()).min(1.0);
            steps += 1;
            if step.length() < 1e-9 {
                break Some(p);
            }
            if (p - 0.5).abs().max_element() > 1.5 {
                break None;
            }
            if steps > 40 || !p.is_finite() {
                return Critic::Unknown;
            }
        };
        // Accept a little outside: the neighbour may see the same point from its own side of the border.
        let margin = 0.01;
        let Some(p) = critical.filter(|p| p.min_element() > -margin && p.max_element() < 1.0 + margin) else {
            self.border_seeds(sub, found);
            return Critic::Said;
        };
        let gap = sub.g.value(p.x, p.y);
        let place = sub.low + sub.size * p;
        let upward = xx[0] > 0.0;
        if extremum && ((gap > contact + self.error && upward) || (gap < -contact - self.error && !upward)) {
            return Critic::Said; // the bowl does not reach the other surface
        }
        // A bowl shallower than the fit is good decides about a whole loop.
        if extremum && gap.abs() <= 2.0 * self.error && self.error > 0.25 * contact {
            return Critic::TooCoarse;
        }
        let near = gap.abs() <= (4.0 * (contact + self.error)).max(1e-9);
        if near {
            found.criticals.push(Critical { pa: self.pa, pb: self.pb, at: self.pair(place), extremum });
        }
        let before = found.seeds.len();
        self.border_seeds(sub, found);
        if extremum && found.seeds.len() == before && gap.abs() > self.error {
            // A loop inside the cell: along a ray from the extremum the gap changes sign exactly once.
            let sign = gap.signum();
            for direction in [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y] {
                let value = |t: f64| {
                    let q = p + direction * t;
                    sub.g.value(q.x, q.y) * sign
                };
                let reach =
                    if direction.x + direction.y > 0.0 { (DVec2::ONE - p).dot(direction) } else { p.dot(-direction) };
                if !(reach > 0.0) || value(reach) >= 0.0 {
                    continue;
                }
                let (mut low, mut high) = (0.0, reach);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if value(middle) > 0.0 { low = middle } else { high = middle }
                }
                self.seed(sub.low + sub.size * (p + direction * high), found);
                break;
            }
        }
        Critic::Said
    }

    /// Whether the cell is a valley (or crest) whose floor decides: the second derivative across it keeps its sign.
    fn ridge(&self, sub: &Sub, contact: f64, found: &mut Findings) -> bool {
        let v = sub.g.eval(0.5, 0.5);
        let angle = 0.5 * (2.0 * v.h[1]).atan2(v.h[0] - v.h[2]);
        let mut e = DVec2::from_angle(angle);
        let curvature = |e: DVec2, h: [f64; 3]| e.x * e.x * h[0] + 2.0 * e.x * e.y * h[1] + e.y * e.y * h[2];
        if curvature(e.perp(), v.h).abs() > curvature(e, v.h).abs() {
            e = e.perp();
        }
        let [xx, xy, yy] = sub.g.hessian_range();
        let (cx, cy, cxy) = (e.x * e.x, e.y * e.y, 2.0 * e.x * e.y);
        let pick = |r: [f64; 2], c: f64| if c >= 0.0 { [r[0] * c, r[1] * c] } else { [r[1] * c, r[0] * c] };
        let parts = [pick(xx, cx), pick(xy, cxy), pick(yy, cy)];
        let slack = 6000.0 * self.error * sub.size.max_element().powi(2);
        let least = parts.iter().map(|r| r[0]).sum::<f64>() - slack;
        let most = parts.iter().map(|r| r[1]).sum::<f64>() + slack;
        if !(least > 0.0 || most < 0.0) {
            return false;
        }
        let upward = if least > 0.0 { 1.0 } else { -1.0 };
        let (mut inside, mut values) = (Vec::new(), Vec::new());
        for k in -6..=6 {
            let mut p = DVec2::splat(0.5) + e.perp() * (f64::from(k) * 0.12);
            let mut settled = false;
            for _ in 0..12 {
                let v = sub.g.eval(p.x, p.y);
                let step = (v.d[0] * e.x + v.d[1] * e.y) / curvature(e, v.h);
                p -= e * step.clamp(-0.5, 0.5);
                if (p - 0.5).abs().max_element() > 1.5 {
                    break;
                }
                if step.abs() < 1e-9 {
                    settled = true;
                    break;
                }
            }
            if settled && p.min_element() > -0.05 && p.max_element() < 1.05 {
                inside.push(p);
                values.push(sub.g.value(p.x, p.y) * upward);
            }
        }
        let limit = contact + self.error;
        let (min, max) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        let small = sub.size.max_element() < 1.0 / 64.0;
        if values.is_empty() {
            // No floor inside: the zero set is a graph across e, but a sample may have missed the floor.
            if !small {
                return false;
            }
            self.border_seeds(sub, found);
            return true;
        }
        if min >= -limit && max <= limit {
            // From the middle outwards, the first place that lies on B.
            let mut order: Vec<usize> = (0..inside.len()).collect();
            order.sort_by_key(|&k| k.abs_diff(inside.len() / 2));
            let places = order.into_iter().map(|k| self.pair(sub.low + sub.size * inside[k]));
            let on_b = |at: &PointPair| at.st.min_element() >= -SLACK && at.st.max_element() <= 1.0 + SLACK;
            found.ridges.extend(places.into_iter().find(on_b).map(|at| Seed { pa: self.pa, pb: self.pb, at }));
            return true;
        }
        if min > limit && min > 0.5 * max {
            return true;
        }
        if max < -limit && max < 0.5 * min {
            self.border_seeds(sub, found);
            return true;
        }
        false
    }
}
