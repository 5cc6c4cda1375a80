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

use glam::{DVec2, DVec3};

use super::bernstein::{Poly2, chebyshev_node, roots};
use super::correct::PointPair;
use super::piece::{Patch, Piece};
use super::tree::Node;

/// The degree of the fit in each variable.
const DEGREE: usize = 8;
/// Rounding of g in the unit frame.
pub const ROUNDING: f64 = 2e-15;
/// Cells smaller than this fraction of the fitted one are given up.
const SMALLEST: f64 = 1.0 / 16384.0;
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
    g: Poly2,
    s: Poly2,
    t: Poly2,
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
pub fn foot_along(piece: &Piece, p: DVec3, frame: [DVec3; 2], start: DVec2) -> Option<(DVec2, super::piece::Jet1)> {
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
        if length < 1e-8 {
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
    let at = |x: f64, y: f64| node.low + (node.high - node.low) * DVec2::new(x, y);
    let sample = |x: f64, y: f64, start: DVec2| -> Option<(f64, DVec2)> {
        let ja = a.jet1(at(x, y));
        let (st, jb) = foot_along(b, ja.p, frame, start)?;
        let steep = |jet: &super::piece::Jet1| {
            let cross = jet.cross();
            cross.dot(n).abs() < 0.3 * cross.length()
        };
        if steep(&ja) || steep(&jb) || st.min_element() < -1.0 || st.max_element() > 2.0 {
            return None;
        }
        Some(((ja.p - jb.p).dot(n), st))
    };
    // The foot of the middle, then serpentine from there.
    let (_, center) = sample(0.5, 0.5, other.local(DVec2::ZERO))?;
    let nodes: [f64; DEGREE + 1] = std::array::from_fn(|i| chebyshev_node(DEGREE, i));
    let w = DEGREE + 1;
    let (mut g, mut s, mut t) = (vec![0.0; w * w], vec![0.0; w * w], vec![0.0; w * w]);
    let mut row_start = center;
    for j in (0..=DEGREE / 2).rev().chain(DEGREE / 2 + 1..w) {
        if j == DEGREE / 2 + 1 {
            let k = (DEGREE / 2) * w + DEGREE / 2;
            row_start = DVec2::new(s[k], t[k]);
        }
        let mut start = row_start;
        for i in (0..=DEGREE / 2).rev().chain(DEGREE / 2 + 1..w) {
            if i == DEGREE / 2 + 1 {
                start = row_start;
            }
            let k = j * w + i;
            // Predict from the two before in the row.
            let back = if i > DEGREE / 2 { [i - 1, i.saturating_sub(2)] } else { [i + 1, i + 2] };
            if i + 2 <= DEGREE / 2 || i > DEGREE / 2 {
                let x = |i: usize| nodes[i];
                let known = |i: usize| DVec2::new(s[j * w + i], t[j * w + i]);
                let f = (x(i) - x(back[0])) / (x(back[0]) - x(back[1]));
                start = known(back[0]) + (known(back[0]) - known(back[1])) * f;
            }
            let (gap, st) = sample(nodes[i], nodes[j], start)?;
            (g[k], s[k], t[k]) = (gap, st.x, st.y);
            start = st;
            if i == DEGREE / 2 {
                row_start = st;
            }
        }
    }
    let (g, s, t) = (Poly2::fit(DEGREE, &g), Poly2::fit(DEGREE, &s), Poly2::fit(DEGREE, &t));
    let mut error: f64 = 0.0;
    for (x, y) in [(0.02, 0.5), (0.98, 0.41), (0.31, 0.02), (0.62, 0.98), (0.31, 0.69), (0.69, 0.12)] {
        let (gap, _) = sample(x, y, DVec2::new(s.eval(x, y).f, t.eval(x, y).f))?;
        error = error.max((gap - g.eval(x, y).f).abs());
    }
    let [min, max] = g.range();
    let error = 4.0 * error + ROUNDING;
    if error > (1e-5 * min.abs().max(max.abs())).max(8.0 * ROUNDING) {
        return None;
    }
    let ([s0, s1], [t0, t1]) = (s.range(), t.range());
    let feet = [DVec2::new(s0, t0), DVec2::new(s1, t1)];
    Some(Contact { pa: node.piece, pb: other.piece, low: node.low, high: node.high, g, s, t, error, feet })
}

/// A cell during the analysis.
struct Sub {
    g: Poly2,
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
    fn of(p: &Poly2) -> Self {
        let n = p.n;
        let at = |i: usize, j: usize| p.c[j * (n + 1) + i];
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
    fn outside(&self, p: &Poly2, low: DVec2, size: DVec2, touch: f64) -> bool {
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
            st: DVec2::new(self.s.eval(xy.x, xy.y).f, self.t.eval(xy.x, xy.y).f),
        }
    }

    /// Analyses the zero set. `contact` is the gap that counts as none. False when the cells ran out: then only a
    /// finer fit helps, and `out` is as it was.
    pub fn analyse(&self, contact: f64, out: &mut Findings) -> bool {
        let mut found = Findings::default();
        let (s, t) = (Affine::of(&self.s), Affine::of(&self.t));
        let mut stack = vec![Sub { g: self.g.clone(), low: DVec2::ZERO, size: DVec2::ONE }];
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
                continue;
            }
            let size = sub.size.max_element();
            match self.one_critical(&sub, contact, &mut found) {
                Critic::Said => continue,
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
                found.coincident.push(self.cell(&sub));
                continue;
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
            gap: sub.g.c.iter().fold(0.0, |m: f64, c| m.max(c.abs())) + self.error,
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
        let gap = sub.g.eval(p.x, p.y).f;
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
                    sub.g.eval(q.x, q.y).f * sign
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
                values.push(sub.g.eval(p.x, p.y).f * upward);
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
            let middle = inside[inside.len() / 2];
            let at = self.pair(sub.low + sub.size * middle);
            if at.st.min_element() >= -SLACK && at.st.max_element() <= 1.0 + SLACK {
                found.ridges.push(Seed { pa: self.pa, pb: self.pb, at });
            }
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
