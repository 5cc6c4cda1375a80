//! Bezier pieces as the intersector evaluates them: on the stack, in local parameters, in a common local frame.
//!
//! Everything in `ssi` works on [`Piece`]s whose coordinates were moved and scaled (by powers of two) into a frame
//! of about unit size, so that no tolerance depends on the model's units or place. Cost: 30-60 ns for a point with
//! its first derivatives at degree 3.

use glam::{DVec2, DVec3, DVec4};

use crate::kernel::geom::{BezierPatch, MAX_DEGREE, Surface};

/// A point and its first derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet1 {
    /// The point.
    pub p: DVec3,
    /// The derivative by u.
    pub u: DVec3,
    /// The derivative by v.
    pub v: DVec3,
}

/// A point, its first and its second derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet2 {
    /// The point.
    pub p: DVec3,
    /// The derivative by u.
    pub u: DVec3,
    /// The derivative by v.
    pub v: DVec3,
    /// The second derivatives uu, uv, vv.
    pub second: [DVec3; 3],
}

impl Jet1 {
    /// Su x Sv, not normalized.
    pub fn cross(&self) -> DVec3 {
        self.u.cross(self.v)
    }
}

/// Whatever can be evaluated with derivatives: a Bezier piece or a whole surface.
pub trait Patch {
    /// The point and first derivatives.
    fn jet1(&self, uv: DVec2) -> Jet1;
    /// The same with second derivatives.
    fn jet2(&self, uv: DVec2) -> Jet2;
}

impl Patch for Surface {
    fn jet1(&self, uv: DVec2) -> Jet1 {
        let jet = self.jet(uv, 1);
        Jet1 { p: jet.p(), u: jet.u(), v: jet.v() }
    }

    fn jet2(&self, uv: DVec2) -> Jet2 {
        let jet = self.jet(uv, 2);
        Jet2 { p: jet.p(), u: jet.u(), v: jet.v(), second: jet.second() }
    }
}

/// One Bezier piece of one surface, in the common frame, with local parameters in [0, 1]^2.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The number of the surface.
    pub surface: usize,
    /// Which piece of the surface this is: index along u and along v.
    pub index: [usize; 2],
    /// Degrees in u and v.
    pub degree: [usize; 2],
    /// Whether any weight differs from 1.
    pub rational: bool,
    /// Homogeneous control points, u running fastest.
    pub points: Vec<DVec4>,
    /// Where the piece starts in the surface's domain.
    pub low: DVec2,
    /// Where it ends.
    pub high: DVec2,
}

impl Piece {
    /// A piece in a frame with this origin and scale: a model point x becomes (x - origin) scale.
    pub fn new(patch: &BezierPatch, surface: usize, index: [usize; 2], origin: DVec3, scale: f64) -> Self {
        let local = |p: &DVec4| ((p.truncate() - origin * p.w) * scale).extend(p.w);
        Self {
            surface,
            index,
            degree: patch.degree,
            rational: patch.rational,
            points: patch.points.iter().map(local).collect(),
            low: patch.low,
            high: patch.high,
        }
    }

    /// The surface's parameters of local ones.
    pub fn to_surface(&self, local: DVec2) -> DVec2 {
        let side = |x: f64, low: f64, high: f64| match x {
            0.0 => low,
            1.0 => high,
            _ => low + (high - low) * x,
        };
        DVec2::new(side(local.x, self.low.x, self.high.x), side(local.y, self.low.y, self.high.y))
    }

    /// The point.
    pub fn point(&self, uv: DVec2) -> DVec3 {
        self.jet1(uv).p
    }

    /// The points over a grid, first parameter fastest. Cost: a fraction of that of single points, row sums being shared.
    pub fn grid(&self, us: &[f64], vs: &[f64]) -> Vec<DVec3> {
        match self.degree[0].max(self.degree[1]) {
            0..=3 => self.grid_of::<4>(us, vs),
            4..=7 => self.grid_of::<8>(us, vs),
            _ => self.grid_of::<{ MAX_DEGREE + 1 }>(us, vs),
        }
    }

    fn grid_of<const K: usize>(&self, us: &[f64], vs: &[f64]) -> Vec<DVec3> {
        let [p, q] = self.degree;
        let mut out = vec![DVec3::ZERO; us.len() * vs.len()];
        // Bit for bit what single points are, so that equal points of equal surfaces have no gap.
        let is_bicubic = self.bicubic().is_some();
        let values = |degree: usize, t: f64| -> [f64; K] {
            if !is_bicubic {
                return bernstein::<K, 1>(degree, t)[0];
            }
            let [four] = cubic::<1>(t);
            std::array::from_fn(|k| four[k.min(3)])
        };
        let across: Vec<[f64; K]> = vs.iter().map(|&v| values(q, v)).collect();
        for (i, &u) in us.iter().enumerate() {
            let along = values(p, u);
            let mut column = [DVec4::ZERO; K];
            for (point, row) in column.iter_mut().zip(self.points.chunks_exact(p + 1)) {
                *point = row.iter().zip(along).map(|(&h, b)| h * b).sum();
            }
            for (j, b) in across.iter().enumerate() {
                let h: DVec4 = column.iter().zip(b).map(|(&h, b)| h * b).sum();
                out[j * us.len() + i] = if self.rational { h.truncate() * (1.0 / h.w) } else { h.truncate() };
            }
        }
        out
    }

    /// Whether it is a point or a curve: nowhere on a grid do its derivatives span a plane.
    pub fn has_no_area(&self) -> bool {
        let at = |k: u32| f64::from(k) / 6.0 + 0.01 * f64::from(k % 2);
        (0..49).all(|k| {
            let jet = self.jet1(DVec2::new(at(k % 7), at(k / 7)));
            !(jet.cross().length() > 1e-10 * jet.u.length() * jet.v.length())
        })
    }

    /// Sums of the net against values and derivatives of the Bernstein polynomials; `K` is one more than the
    /// largest degree, `D` one more than the derivative order.
    fn sums<const K: usize, const D: usize>(&self, uv: DVec2) -> [[DVec4; D]; D] {
        let [p, q] = self.degree;
        let bu = bernstein::<K, D>(p, uv.x);
        let bv = bernstein::<K, D>(q, uv.y);
        let mut out = [[DVec4::ZERO; D]; D];
        for (j, row) in self.points.chunks_exact(p + 1).enumerate().take(K) {
            let mut along = [DVec4::ZERO; D];
            for (i, &point) in row.iter().enumerate().take(K) {
                for k in 0..D {
                    along[k] += point * bu[k][i];
                }
            }
            for k in 0..D {
                for l in 0..D - k {
                    out[k][l] += along[k] * bv[l][j];
                }
            }
        }
        out
    }

    /// The net of a bicubic piece, which most are.
    #[inline(always)]
    fn bicubic(&self) -> Option<&[DVec4; 16]> {
        if self.degree == [3, 3] { self.points.as_slice().try_into().ok() } else { None }
    }

    #[inline(never)]
    fn sums_any<const D: usize>(&self, uv: DVec2) -> [[DVec4; D]; D] {
        match self.degree[0].max(self.degree[1]) {
            0..=3 => self.sums::<4, D>(uv),
            4..=7 => self.sums::<8, D>(uv),
            _ => self.sums::<{ MAX_DEGREE + 1 }, D>(uv),
        }
    }
}

impl Patch for Piece {
    #[inline(always)]
    fn jet1(&self, uv: DVec2) -> Jet1 {
        let s = match self.bicubic() {
            Some(net) => bicubic(net, cubic::<2>(uv.x), cubic::<2>(uv.y)),
            None => self.sums_any::<2>(uv),
        };
        if !self.rational {
            return Jet1 { p: s[0][0].truncate(), u: s[1][0].truncate(), v: s[0][1].truncate() };
        }
        let w = 1.0 / s[0][0].w;
        let p = s[0][0].truncate() * w;
        Jet1 { p, u: (s[1][0].truncate() - p * s[1][0].w) * w, v: (s[0][1].truncate() - p * s[0][1].w) * w }
    }

    #[inline(always)]
    fn jet2(&self, uv: DVec2) -> Jet2 {
        let s = match self.bicubic() {
            Some(net) => bicubic(net, cubic::<3>(uv.x), cubic::<3>(uv.y)),
            None => self.sums_any::<3>(uv),
        };
        let t = |k: usize, l: usize| s[k][l].truncate();
        if !self.rational {
            return Jet2 { p: t(0, 0), u: t(1, 0), v: t(0, 1), second: [t(2, 0), t(1, 1), t(0, 2)] };
        }
        let w = 1.0 / s[0][0].w;
        let p = t(0, 0) * w;
        let u = (t(1, 0) - p * s[1][0].w) * w;
        let v = (t(0, 1) - p * s[0][1].w) * w;
        let uu = (t(2, 0) - u * (2.0 * s[1][0].w) - p * s[2][0].w) * w;
        let uv = (t(1, 1) - u * s[0][1].w - v * s[1][0].w - p * s[1][1].w) * w;
        let vv = (t(0, 2) - v * (2.0 * s[0][1].w) - p * s[0][2].w) * w;
        Jet2 { p, u, v, second: [uu, uv, vv] }
    }
}

/// The sums of a bicubic net, with lengths that the compiler knows and in plain arrays of four, which it turns into
/// vector instructions.
#[inline(always)]
fn bicubic<const D: usize>(net: &[DVec4; 16], bu: [[f64; 4]; D], bv: [[f64; 4]; D]) -> [[DVec4; D]; D] {
    let mut out = [[[0.0; 4]; D]; D];
    for j in 0..4 {
        let mut along = [[0.0; 4]; D];
        for i in 0..4 {
            let point = net[4 * j + i].to_array();
            for k in 0..D {
                for c in 0..4 {
                    along[k][c] += point[c] * bu[k][i];
                }
            }
        }
        for k in 0..D {
            for l in 0..D - k {
                for c in 0..4 {
                    out[k][l][c] += along[k][c] * bv[l][j];
                }
            }
        }
    }
    out.map(|row| row.map(DVec4::from_array))
}

/// Values and up to two derivatives of the cubic Bernstein polynomials.
#[inline(always)]
fn cubic<const D: usize>(t: f64) -> [[f64; 4]; D] {
    let s = 1.0 - t;
    let (ss, st, tt) = (s * s, s * t, t * t);
    let all = [
        [s * ss, 3.0 * ss * t, 3.0 * s * tt, t * tt],
        [-3.0 * ss, 3.0 * (ss - 2.0 * st), 3.0 * (2.0 * st - tt), 3.0 * tt],
        [6.0 * s, 6.0 * (t - 2.0 * s), 6.0 * (s - 2.0 * t), 6.0 * t],
    ];
    std::array::from_fn(|k| all[k.min(2)])
}

/// Values and derivatives of the Bernstein polynomials of degree `n < K`, by the triangular recurrence: stable on
/// [0, 1] and usable a little outside.
fn bernstein<const K: usize, const D: usize>(n: usize, t: f64) -> [[f64; K]; D] {
    let s = 1.0 - t;
    let mut out = [[0.0; K]; D];
    let mut b = [0.0; K];
    b[0] = 1.0;
    // Derivative k of degree n is n (n-1) .. (n-k+1) times the k-th difference of the values of degree n - k.
    for degree in 0..=n {
        let order = n - degree;
        if order < D {
            out[order] = b;
        }
        if degree == n {
            break;
        }
        let mut carry = 0.0;
        for value in b.iter_mut().take(degree + 2) {
            let old = *value;
            *value = old * s + carry;
            carry = old * t;
        }
    }
    for order in 1..D {
        let mut factor = 1.0;
        for k in 0..order {
            factor *= n.saturating_sub(k) as f64;
        }
        if order > n {
            out[order] = [0.0; K];
            continue;
        }
        for _ in 0..order {
            let mut before = 0.0;
            for value in out[order].iter_mut().take(n + 1) {
                let old = *value;
                *value = before - old;
                before = old;
            }
        }
        for value in out[order].iter_mut().take(n + 1) {
            *value *= factor;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::geom::Knots;

    #[test]
    fn a_piece_is_the_surface_over_its_span() {
        for (p, q) in [(1, 3), (3, 3), (5, 2), (9, 1)] {
            let u = Knots::clamped(p, &[0.0, 1.0, 2.5], 1).unwrap();
            let v = Knots::clamped(q, &[-1.0, 1.0], 1).unwrap();
            let (nu, nv) = (u.control_count(), v.control_count());
            let points: Vec<DVec3> = (0..nu * nv)
                .map(|k| DVec3::new((k % nu) as f64, (k / nu) as f64, ((k * 7) % 5) as f64 - 2.0))
                .collect();
            let weights = (0..nu * nv).map(|k| 0.5 + (k % 3) as f64).collect();
            for weights in [None, Some(weights)] {
                let s = Surface::new(u.clone(), v.clone(), points.clone(), weights).unwrap();
                for patch in s.bezier_patches() {
                    let piece = Piece::new(&patch, 0, [0, 0], DVec3::ZERO, 1.0);
                    let size = piece.high - piece.low;
                    for local in [DVec2::new(0.0, 0.0), DVec2::new(0.3, 0.8), DVec2::new(1.0, 0.5)] {
                        let inside = local * 0.999;
                        let [on_grid] = piece.grid(&[inside.x], &[inside.y])[..] else { unreachable!() };
                        assert_eq!(on_grid, piece.point(inside));
                        let (a, b) = (piece.jet2(inside), s.jet(piece.to_surface(inside), 2));
                        assert!(a.p.distance(b.p()) < 1e-12);
                        assert!((a.u / size.x).distance(b.u()) < 1e-11 * (1.0 + b.u().length()));
                        assert!((a.v / size.y).distance(b.v()) < 1e-11 * (1.0 + b.v().length()));
                        let scale = [size.x * size.x, size.x * size.y, size.y * size.y];
                        for k in 0..3 {
                            let d = b.second()[k];
                            assert!((a.second[k] / scale[k]).distance(d) < 1e-10 * (1.0 + d.length()), "{p} {q} {k}");
                        }
                    }
                }
            }
        }
    }
}
