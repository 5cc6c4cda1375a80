//! Where two surfaces run nearly parallel: the gap between them as one function of two variables.
//!
//! When both nodes are graphs over a common plane, `g(u, v) = (A(u, v) - B(s, t)) . n`, with (s, t) the foot of
//! A(u, v) on B along n, has the intersection as its zero set and the collinear-normal points of contacts as its
//! critical points. What cancels between the surfaces cancels once, when g is fitted
//! ([`super::gap_fit`]); after that everything is about a bivariate polynomial, whatever the angle between
//! the surfaces: cylinders at 1e-5 degrees are as easy as at 10. Thesis 5.3 looks at binormals of osculating tori
//! instead; the fit sees more than second order, so that loops and pairings need no second look.
//!
//! Cells of g are proved free of zeros (sign of the coefficients), free of critical points (a direction in which
//! all gradients point), or to hold at most one (determinant of the interval Hessian); else they are split. In every
//! cell without an unknown critical point each arc of the zero set ends on the cell's border or circles the one
//! extremum, so the roots on the border, and one ray from the extremum, are seeds of everything.

use glam::DVec2;

use super::bernstein::{chebyshev_node, roots};
use super::correct::PointPair;
use super::critical::Critic;
use super::gap_fit::{Contact, DEGREE, Fit, ROUNDING};

/// Cells smaller than this fraction of the fitted one are given up.
const SMALLEST: f64 = 1.0 / 16384.0;
/// Down to this fraction of the fitted one coincident cells are split whose middle and corners lie off the other piece.
const ACROSS: f64 = 1.0 / 32.0;
/// What reaches over a border of the other piece by less than this, in its parameters, only touches the border.
const SLIVER: f64 = 1e-6;
/// How often a cell is halved to tell apart where the zero set crosses a border of the other piece.
const RIM_DEPTH: usize = 12;
/// More cells than this and the fit is given up (the node is split and fitted again).
const MOST_CELLS: usize = 3000;

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

/// A cell during the analysis.
pub(super) struct Sub {
    pub g: Fit,
    pub low: DVec2,
    pub size: DVec2,
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

/// How many decimal places beyond a piece's border still belong to it (parameters near tangency are no sharper).
pub const SLACK: f64 = 1e-7;

impl Contact {
    pub(super) fn pair(&self, xy: DVec2) -> PointPair {
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
                if outside(SLIVER) {
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
                if !reaches && self.only_touches(&sub) {
                    continue;
                }
                if size < ACROSS || reaches {
                    found.coincident.push(self.cell(&sub));
                    continue;
                }
            }
            if size < SMALLEST {
                // Nor is it more than a border that is touched.
                if outside(SLIVER) || self.only_touches(&sub) {
                    continue;
                }
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

    /// Whether the feet over a cell lie outside of the other piece or reach over its border by no more than [`SLIVER`]: by
    /// the coefficients of the feet over the cell alone, which bounds of the whole fit cannot tell beside a pole.
    fn only_touches(&self, sub: &Sub) -> bool {
        let at = |k: usize| chebyshev_node(DEGREE, k);
        [&self.s, &self.t].into_iter().any(|foot| {
            let value = |i: usize, j: usize| foot.value(sub.low.x + sub.size.x * at(i), sub.low.y + sub.size.y * at(j));
            let own = Fit::fit(&std::array::from_fn(|j| std::array::from_fn(|i| value(i, j))));
            let [low, high] = own.range();
            low > 1.0 - SLIVER || high < SLIVER
        })
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

    pub(super) fn border_seeds(&self, sub: &Sub, found: &mut Findings) {
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

    pub(super) fn seed(&self, xy: DVec2, found: &mut Findings) {
        let at = self.pair(xy);
        if at.st.min_element() >= -1e-3 && at.st.max_element() <= 1.0 + 1e-3 {
            found.seeds.push(Seed { pa: self.pa, pb: self.pb, at });
        }
    }
}
