//! Lazily subdivided nodes over the pieces, and what a pair of nodes can prove.
//!
//! A node is its affine part c + au x + av y over [-1, 1]^2 and bounds of the remainder and of its derivatives, by
//! their components along au, av and the normal: 300-500 bytes of working data. Components and not lengths, so that a
//! node may be as thin and slanting as nodes are where the edge of a patch collapses: what a pair proves then does not
//! depend on their shape. For a pair the linear system
//! A - B = 0 is solved for the tube that contains every solution:
//!
//! ```text
//! x = tau w + x0 - K R(x),   K the pseudo-inverse of J = [au av -bu -bv],  |K R| bounded per coordinate
//! ```
//!
//! When the tube misses the box the pair is empty. When K times the derivative of R is a contraction, every
//! solution is unique for its w: one arc, no loop, no singular point (an interval Newton argument, which replaces
//! the thesis's "Gauss maps disjoint, so at most one branch"; that is false). Rational pieces are bounded by
//! interpolating polynomials whose measured error, with a safety factor, pads all bounds.
//!
//! Why not the nodes of [`crate::kernel::bvh`]: those are for display, distance and repeated queries. They round a
//! rectangle and a cone of normals outwards to `f32`, which costs 80 bytes and proves emptiness, but the arc test needs
//! the affine part and bounds of the remainder's derivatives in `f64`, or near tangency (angles of 1e-7) no pair is
//! ever decided. A query here builds a hundredth of the nodes of a full hierarchy and keeps none.
//! Where a rational node becomes as small as the error of its interpolant, the piece is interpolated anew.

use glam::{DVec2, DVec3};

use super::piece::Piece;
use super::side::Side;
use crate::kernel::geom::Aabb;

/// Three columns whose triple product is smaller than this, against the product of their lengths, span space by rounding
/// only: what is computed with them proves nothing.
const LEAST_SPAN: f64 = 1e-11;

/// The share of a rational node's size from which on the error of its interpolant is made smaller.
const REFIT: f64 = 1e-4;

/// A node over a rectangle of a piece's local domain.
#[derive(Clone, Debug)]
pub struct Node {
    /// Which piece.
    pub piece: usize,
    /// Where the rectangle starts.
    pub low: DVec2,
    /// Where it ends.
    pub high: DVec2,
    /// The node that this is half of.
    pub parent: Option<usize>,
    /// A box around it.
    pub bounds: Aabb,
    /// The middle of the affine part.
    pub c: DVec3,
    /// The slope of the affine part by x in [-1, 1].
    pub au: DVec3,
    /// The slope of the affine part by y in [-1, 1].
    pub av: DVec3,
    /// The unit normal of the affine part, zero where degenerate.
    pub n: DVec3,
    /// How far the normal may turn, roughly, in radians (infinite where degenerate).
    pub tilt: f64,
    /// Bounds of the remainder: its components along `au`, `av` and `n`.
    r: [f64; 3],
    /// Bounds of its derivatives by x, likewise.
    pub dx: [f64; 3],
    /// Bounds of its derivatives by y, likewise.
    pub dy: [f64; 3],
    degree: [usize; 2],
    net: Vec<DVec3>,
    pad: f64,
    children: Option<[usize; 2]>,
}

impl Node {
    fn new(
        piece: usize,
        rect: [DVec2; 2],
        parent: Option<usize>,
        degree: [usize; 2],
        net: Vec<DVec3>,
        pad: f64,
    ) -> Self {
        let [p, q] = degree;
        let width = p + 1;
        let at = |i: usize, j: usize| net[j * width + i];
        let c = net.iter().copied().sum::<DVec3>() / net.len() as f64;
        let au = (0..=q).map(|j| at(p, j) - at(0, j)).sum::<DVec3>() * (0.5 / (q + 1) as f64);
        let av = (0..=p).map(|i| at(i, q) - at(i, 0)).sum::<DVec3>() * (0.5 / (p + 1) as f64);
        let cross = au.cross(av);
        let (lu, lv, area) = (au.length(), av.length(), cross.length());
        let flat = area > 1e-9 * lu * lv && area > 0.0;
        let n = if flat { cross / area } else { DVec3::ZERO };
        // The components of a vector along au, av and n; without a normal its length stands for all three.
        let dual = if flat { [av.cross(n) / area, n.cross(au) / area, n] } else { [DVec3::ZERO; 3] };
        let components = |v: DVec3| DVec3::new(v.dot(dual[0]), v.dot(dual[1]), v.dot(dual[2]));
        // Taken of the points once: all that follows is linear.
        let (points, slopes): (Vec<DVec3>, _) = if flat {
            (net.iter().map(|&p| components(p - c)).collect(), [DVec3::X, DVec3::Y])
        } else {
            (net.iter().map(|&p| p - c).collect(), [au, av])
        };
        let raise = |most: &mut DVec3, v: DVec3| {
            *most = most.max(if flat { v.abs() } else { DVec3::new(0.0, 0.0, v.length()) });
        };
        let (mut r, mut dx, mut dy) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let (fp, fq) = (p as f64, q as f64);
        for (j, row) in points.chunks_exact(width).enumerate() {
            let along_v = slopes[1] * (2.0 * j as f64 / fq - 1.0);
            for (i, &point) in row.iter().enumerate() {
                raise(&mut r, point - along_v - slopes[0] * (2.0 * i as f64 / fp - 1.0));
            }
            for w in row.windows(2) {
                raise(&mut dx, (w[1] - w[0]) * (0.5 * fp) - slopes[0]);
            }
        }
        for (below, above) in points.iter().zip(points.iter().skip(width)) {
            raise(&mut dy, (*above - *below) * (0.5 * fq) - slopes[1]);
        }
        let (mut r, mut dx, mut dy) = (r.to_array(), dx.to_array(), dy.to_array());
        let noise = [pad, pad * (p * p) as f64, pad * (q * q) as f64];
        for (bound, noise) in [&mut r, &mut dx, &mut dy].into_iter().zip(noise) {
            let rounding = 1e-15 * (lu + lv) + noise;
            for (most, d) in bound.iter_mut().zip(dual).take(2) {
                *most += d.length() * rounding;
            }
            bound[2] += noise;
        }
        let tilt = if flat {
            let turn = (dx[2] * lv + dy[2] * lu) / area;
            let stretch = dx[0] + dy[1] + dx[1] * dy[0];
            if stretch < 0.8 { turn / (1.0 - stretch) } else { f64::INFINITY }
        } else {
            f64::INFINITY
        };
        let bounds = Aabb::of(net.iter().copied()).grown(pad);
        Self {
            piece,
            low: rect[0],
            high: rect[1],
            parent,
            bounds,
            c,
            au,
            av,
            n,
            tilt,
            r,
            dx,
            dy,
            degree,
            net,
            pad,
            children: None,
        }
    }

    /// The local parameters of (x, y) in [-1, 1]^2.
    pub fn local(&self, xy: DVec2) -> DVec2 {
        0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * xy
    }

    /// A length that says how large the node is.
    pub fn size(&self) -> f64 {
        self.au.length() + self.av.length() + self.length(self.r)
    }

    /// A bound of the length of a vector whose components are within these bounds.
    fn length(&self, bound: [f64; 3]) -> f64 {
        bound[0] * self.au.length() + bound[1] * self.av.length() + bound[2]
    }

    /// What a covector makes of the vectors along which components are taken: the products with a remainder's bounds
    /// bound its action.
    pub fn split(&self, k: DVec3) -> [f64; 3] {
        if self.n == DVec3::ZERO {
            return [0.0, 0.0, k.length()];
        }
        [k.dot(self.au).abs(), k.dot(self.av).abs(), k.dot(self.n).abs()]
    }
}

/// A bound of what a covector, split, makes of a vector within bounds.
pub fn reach(k: [f64; 3], bound: [f64; 3]) -> f64 {
    k[0] * bound[0] + k[1] * bound[1] + k[2] * bound[2]
}

/// All nodes of one side that were built so far.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// Those that have no parent.
    pub roots: Vec<usize>,
}

impl Tree {
    /// The roots over every piece: one for a polynomial piece, a few for a rational one.
    pub fn new(side: &Side) -> Self {
        let mut tree = Self::default();
        for (k, piece) in side.pieces.iter().enumerate() {
            if !piece.rational {
                let net = piece.points.iter().map(|p| p.truncate()).collect();
                tree.root(Node::new(k, [DVec2::ZERO, DVec2::ONE], None, piece.degree, net, 0.0));
                continue;
            }
            let mut stack = vec![([DVec2::ZERO, DVec2::ONE], 0)];
            while let Some((rect, depth)) = stack.pop() {
                let (degree, net, error) = interpolated(piece, rect);
                let size = Aabb::of(net.iter().copied()).diagonal();
                if error <= 1e-6 * size || depth >= 8 {
                    tree.root(Node::new(k, rect, None, degree, net, 4.0 * error));
                    continue;
                }
                let middle = 0.5 * (rect[0] + rect[1]);
                if depth % 2 == 0 {
                    stack.push(([DVec2::new(middle.x, rect[0].y), rect[1]], depth + 1));
                    stack.push(([rect[0], DVec2::new(middle.x, rect[1].y)], depth + 1));
                } else {
                    stack.push(([DVec2::new(rect[0].x, middle.y), rect[1]], depth + 1));
                    stack.push(([rect[0], DVec2::new(rect[1].x, middle.y)], depth + 1));
                }
            }
        }
        tree
    }

    fn root(&mut self, node: Node) {
        self.roots.push(self.nodes.len());
        self.nodes.push(node);
    }

    /// The two halves of a node of these pieces, built on first use.
    pub fn children(&mut self, index: usize, pieces: &[Piece]) -> [usize; 2] {
        if let Some(children) = self.nodes[index].children {
            return children;
        }
        let node = &self.nodes[index];
        let [p, q] = node.degree;
        // Along the direction in which it is longer or bends more.
        let score = |a: DVec3, d: [f64; 3], n: usize| {
            a.length() + 4.0 * (node.length(d) - 3.0 * node.pad * (n * n) as f64).max(0.0)
        };
        let along = if score(node.au, node.dx, p) >= score(node.av, node.dy, q) { 0 } else { 1 };
        let (mut first, mut second) = (node.net.clone(), node.net.clone());
        let width = p + 1;
        let (count, length, stride, step) =
            if along == 0 { (q + 1, p + 1, 1, width) } else { (p + 1, q + 1, width, 1) };
        for line in 0..count {
            let at = |i: usize| line * step + i * stride;
            for level in 1..length {
                for i in 0..length - level {
                    second[at(i)] = (second[at(i)] + second[at(i + 1)]) * 0.5;
                }
                first[at(level)] = second[at(0)];
            }
        }
        let middle = 0.5 * (node.low + node.high);
        let (mut end, mut start) = (node.high, node.low);
        end[along] = middle[along];
        start[along] = middle[along];
        let (piece, degree, pad, low, high) = (node.piece, node.degree, node.pad, node.low, node.high);
        // Below some size the error of the interpolant is all that is left of a rational node: fit it anew.
        let refit = pad > REFIT * node.size();
        let make = |rect: [DVec2; 2], net: Vec<DVec3>| {
            if refit {
                let (degree, net, error) = interpolated(&pieces[piece], rect);
                return Node::new(piece, rect, Some(index), degree, net, (4.0 * error).min(pad));
            }
            Node::new(piece, rect, Some(index), degree, net, pad)
        };
        let (a, b) = (make([low, end], first), make([start, high], second));
        let children = [self.nodes.len(), self.nodes.len() + 1];
        self.nodes.push(a);
        self.nodes.push(b);
        self.nodes[index].children = Some(children);
        children
    }
}

/// What a pair of nodes proves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The nodes do not meet.
    Empty,
    /// What they share is one arc near the line `x0 + tau w`, `w` in `range`, in the nodes' own coordinates x, y of
    /// A and x, y of B.
    Arc {
        /// A point of the line.
        x0: [f64; 4],
        /// Its direction.
        tau: [f64; 4],
        /// Where it is within the (slightly enlarged) box.
        range: [f64; 2],
    },
    /// Neither.
    Unknown,
}

/// Decides about a pair; `gap` is the distance that counts as contact.
pub fn judge(a: &Node, b: &Node, gap: f64) -> Verdict {
    if !a.bounds.grown(gap).overlaps(&b.bounds) {
        return Verdict::Empty;
    }
    let d = a.c - b.c;
    for n in [a.n, b.n] {
        let reach = n.dot(a.au).abs()
            + n.dot(a.av).abs()
            + n.dot(b.au).abs()
            + n.dot(b.av).abs()
            + reach(a.split(n), a.r)
            + reach(b.split(n), b.r);
        if d.dot(n).abs() > reach + gap {
            return Verdict::Empty;
        }
    }
    if a.n == DVec3::ZERO || b.n == DVec3::ZERO {
        return Verdict::Unknown;
    }
    let columns = [a.au, a.av, -b.au, -b.av];
    // The null direction: signed 3 x 3 minors.
    let minor = |i: usize, j: usize, l: usize| columns[i].dot(columns[j].cross(columns[l]));
    let mut tau = [minor(1, 2, 3), -minor(0, 2, 3), minor(0, 1, 3), -minor(0, 1, 2)];
    let Some(k) = pseudo_inverse(&columns, &tau) else { return Verdict::Unknown };
    let length = tau.iter().map(|t| t * t).sum::<f64>().sqrt();
    tau.iter_mut().for_each(|t| *t /= length);
    let splits = k.map(|row| (a.split(row), b.split(row)));
    let rho: [f64; 4] = std::array::from_fn(|j| {
        let (in_a, in_b) = splits[j];
        reach(in_a, a.r) + reach(in_b, b.r) + k[j].length() * gap
    });
    let x0 = k.map(|row| -row.dot(d));
    let mut range = [f64::NEG_INFINITY, f64::INFINITY];
    for j in 0..4 {
        let limit = 1.0 + rho[j];
        if tau[j].abs() < 1e-12 {
            if x0[j].abs() > limit + 1e-9 {
                return Verdict::Empty;
            }
            continue;
        }
        let (s, t) = ((-limit - x0[j]) / tau[j], (limit - x0[j]) / tau[j]);
        range = [range[0].max(s.min(t)), range[1].min(s.max(t))];
    }
    if range[0] > range[1] {
        return Verdict::Empty;
    }
    let row = |(in_a, in_b): ([f64; 3], [f64; 3])| {
        reach(in_a, a.dx) + reach(in_a, a.dy) + reach(in_b, b.dx) + reach(in_b, b.dy)
    };
    let contraction = splits.into_iter().map(row).fold(0.0, f64::max);
    if contraction < 0.8 { Verdict::Arc { x0, tau, range } } else { Verdict::Unknown }
}

/// The rows of the pseudo-inverse of J = [c0 c1 c2 c3], given its signed minors (`minors[l]` without column l).
///
/// With D the three columns of the largest minor and w = D^-1 c the fourth in their terms, J = D [I w] and J+ is
/// [I w]^T (I + w w^T)^-1 D^-1, which is well conditioned however thin and slanting the nodes are; J J^T is not.
/// `None` when no three columns span space.
fn pseudo_inverse(columns: &[DVec3; 4], minors: &[f64; 4]) -> Option<[DVec3; 4]> {
    let left_out = (0..4).max_by(|&i, &j| minors[i].abs().total_cmp(&minors[j].abs()))?;
    let kept = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][left_out];
    let d = kept.map(|k| columns[k]);
    let det = d[0].dot(d[1].cross(d[2]));
    if !(det.abs() > LEAST_SPAN * d[0].length() * d[1].length() * d[2].length()) {
        return None;
    }
    let dual = [d[1].cross(d[2]) / det, d[2].cross(d[0]) / det, d[0].cross(d[1]) / det];
    let w = dual.map(|row| row.dot(columns[left_out]));
    let sum = dual[0] * w[0] + dual[1] * w[1] + dual[2] * w[2];
    let share = sum / (1.0 + w.iter().map(|w| w * w).sum::<f64>());
    let mut out = [share; 4];
    for (place, k) in kept.into_iter().enumerate() {
        out[k] = dual[place] - share * w[place];
    }
    Some(out)
}

/// A polynomial net over a rectangle of a rational piece, and the error measured between the nodes.
fn interpolated(piece: &Piece, rect: [DVec2; 2]) -> ([usize; 2], Vec<DVec3>, f64) {
    use super::bernstein::{chebyshev_node, to_bernstein};
    let degree = piece.degree.map(|d| (d + 4).min(10));
    let [p, q] = degree;
    let at = |x: f64, y: f64| piece.point(rect[0] + (rect[1] - rect[0]) * DVec2::new(x, y));
    let mut net = Vec::with_capacity((p + 1) * (q + 1));
    for j in 0..=q {
        for i in 0..=p {
            net.push(at(chebyshev_node(p, i), chebyshev_node(q, j)));
        }
    }
    for k in 0..3 {
        let values: Vec<f64> = net.iter().map(|v| v[k]).collect();
        for (v, c) in net.iter_mut().zip(to_bernstein(degree, &values)) {
            v[k] = c;
        }
    }
    let poly = Piece {
        surface: 0,
        index: [0, 0],
        degree,
        rational: false,
        points: net.iter().map(|v| v.extend(1.0)).collect(),
        low: DVec2::ZERO,
        high: DVec2::ONE,
    };
    let mut error: f64 = 0.0;
    for j in 0..=q {
        for i in 0..=p {
            let middle = |n: usize, i: usize| 0.5 * (chebyshev_node(n, i) + chebyshev_node(n, (i + 1).min(n)));
            let (x, y) = (middle(p, i), middle(q, j));
            error = error.max(poly.point(DVec2::new(x, y)).distance(at(x, y)));
        }
    }
    (degree, net, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pseudo_inverse_is_one_however_thin_the_nodes_are() {
        for thin in [1.0, 1e-3, 1e-8] {
            let columns = [
                DVec3::new(0.0, 0.0, thin),
                DVec3::new(thin * thin, 0.0, 0.7 * thin),
                DVec3::new(0.1, -1.0, 0.2),
                DVec3::new(-thin * thin, 0.1 * thin, -thin),
            ];
            let minor = |i: usize, j: usize, l: usize| columns[i].dot(columns[j].cross(columns[l]));
            let minors = [minor(1, 2, 3), -minor(0, 2, 3), minor(0, 1, 3), -minor(0, 1, 2)];
            let k = pseudo_inverse(&columns, &minors).unwrap();
            // K J is the projection onto what is across the null direction.
            let square = minors.iter().map(|m| m * m).sum::<f64>();
            for i in 0..4 {
                for j in 0..4 {
                    let wanted = f64::from(u8::from(i == j)) - minors[i] * minors[j] / square;
                    assert!((k[i].dot(columns[j]) - wanted).abs() < 1e-6, "{thin} {i} {j}");
                }
            }
        }
        let flat = [DVec3::X, DVec3::Y, DVec3::new(0.3, 0.1, 1e-17), DVec3::new(0.1, -0.7, -1e-17)];
        let minor = |i: usize, j: usize, l: usize| flat[i].dot(flat[j].cross(flat[l]));
        let minors = [minor(1, 2, 3), -minor(0, 2, 3), minor(0, 1, 3), -minor(0, 1, 2)];
        assert!(pseudo_inverse(&flat, &minors).is_none(), "parallel planes, but for rounding");
    }
}
