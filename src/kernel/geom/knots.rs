//! Knot vectors and B-spline basis functions with their derivatives.
//!
//! The basis follows Piegl and Tiller, *The NURBS Book* (1997), A2.1 and A2.3, on the stack; the cubic is written
//! out. Cost: O(p^2) a value, O(p^2 k) with k derivatives.

/// The largest degree that is accepted. Files of the field reach 22.
pub const MAX_DEGREE: usize = 31;
/// The highest derivative that [`Knots::basis`] computes.
pub const MAX_DERIVATIVE: usize = 3;

/// Why a sequence of numbers is no knot vector.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnotError {
    /// The degree is 0 or above [`MAX_DEGREE`].
    #[error("degree {degree} is outside 1..={MAX_DEGREE}")]
    Degree {
        /// The degree asked for.
        degree: usize,
    },
    /// There are too few knots for one span.
    #[error("{got} knots for degree {degree}, at least {expected} are needed")]
    TooFew {
        /// The degree asked for.
        degree: usize,
        /// The number of knots given.
        got: usize,
        /// The smallest number that works.
        expected: usize,
    },
    /// A knot is NaN or infinite.
    #[error("knot {index} is {value}, which is not a finite number")]
    NotFinite {
        /// Which knot.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A knot is smaller than the one before it.
    #[error("knot {index} is {value}, less than the knot before it ({previous})")]
    Decreasing {
        /// Which knot.
        index: usize,
        /// Its value.
        value: f64,
        /// The value before it.
        previous: f64,
    },
    /// An interior knot occurs more often than the degree, or an end knot more than degree + 1 times.
    #[error("knot {value} occurs {got} times, at most {limit} are allowed for degree {degree}")]
    Multiplicity {
        /// The knot.
        value: f64,
        /// How often it occurs.
        got: usize,
        /// How often it may.
        limit: usize,
        /// The degree.
        degree: usize,
    },
    /// The domain has no length.
    #[error("the domain {start}..{end} has no length")]
    EmptyDomain {
        /// Where it starts.
        start: f64,
        /// Where it ends.
        end: f64,
    },
}

/// A knot vector with its degree p: `n + p + 1` non-decreasing finite values for n control points. Clamped
/// ends are not required; the domain is `values[p]..=values[n]`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "RawKnots")]
pub struct Knots {
    degree: usize,
    values: Vec<f64>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RawKnots {
    degree: usize,
    values: Vec<f64>,
}

impl TryFrom<RawKnots> for Knots {
    type Error = KnotError;

    fn try_from(raw: RawKnots) -> Result<Self, KnotError> {
        Self::new(raw.degree, raw.values)
    }
}

/// Basis values at a parameter: `d[k][i]` is the k-th derivative of the basis function of control point
/// `first + i`, for `i <= degree`. N is above the degree; the default holds any.
#[derive(Clone, Copy, Debug)]
pub struct Basis<const N: usize = { MAX_DEGREE + 1 }> {
    /// The first control point with a non-zero basis function.
    pub first: usize,
    /// Values and derivatives.
    pub d: [[f64; N]; MAX_DERIVATIVE + 1],
}

impl Knots {
    /// Checks and keeps a knot vector.
    pub fn new(degree: usize, values: Vec<f64>) -> Result<Self, KnotError> {
        if degree == 0 || degree > MAX_DEGREE {
            return Err(KnotError::Degree { degree });
        }
        let expected = 2 * degree + 2;
        if values.len() < expected {
            return Err(KnotError::TooFew { degree, got: values.len(), expected });
        }
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(KnotError::NotFinite { index, value: values[index] });
        }
        if let Some(index) = (1..values.len()).find(|&i| values[i] < values[i - 1]) {
            return Err(KnotError::Decreasing { index, value: values[index], previous: values[index - 1] });
        }
        let knots = Self { degree, values };
        let [start, end] = knots.domain();
        if start >= end || !(end - start).is_finite() {
            return Err(KnotError::EmptyDomain { start, end });
        }
        for (value, got) in knots.multiplicities() {
            let limit = if start < value && value < end { degree } else { degree + 1 };
            if got > limit {
                return Err(KnotError::Multiplicity { value, got, limit, degree });
            }
        }
        Ok(knots)
    }

    /// Clamped knots with the given distinct breakpoints, each interior one `multiplicity` times.
    pub fn clamped(degree: usize, breaks: &[f64], multiplicity: usize) -> Result<Self, KnotError> {
        let mut values = Vec::with_capacity(2 * (degree + 1) + breaks.len() * multiplicity);
        for (i, &b) in breaks.iter().enumerate() {
            let end = i == 0 || i + 1 == breaks.len();
            values.extend(std::iter::repeat_n(b, if end { degree + 1 } else { multiplicity }));
        }
        Self::new(degree, values)
    }

    /// The knots of one Bezier segment over `start..=end`.
    pub fn bezier(degree: usize, start: f64, end: f64) -> Result<Self, KnotError> {
        Self::clamped(degree, &[start, end], 1)
    }

    /// The degree p.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The number of control points that these knots go with.
    pub fn control_count(&self) -> usize {
        self.values.len() - self.degree - 1
    }

    /// Where the curve starts and ends.
    pub fn domain(&self) -> [f64; 2] {
        [self.values[self.degree], self.values[self.control_count()]]
    }

    /// The distinct knots of the domain, ends included: the borders of the polynomial pieces.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.values[self.degree..=self.control_count()].to_vec();
        breaks.dedup();
        breaks
    }

    /// Every distinct knot with the number of times it occurs.
    pub fn multiplicities(&self) -> Vec<(f64, usize)> {
        let mut out: Vec<(f64, usize)> = Vec::new();
        for &v in &self.values {
            match out.last_mut() {
                Some((value, count)) if *value == v => *count += 1,
                _ => out.push((v, 1)),
            }
        }
        out
    }

    /// Whether both end knots occur degree + 1 times, so that the end control points lie on the curve.
    pub fn is_clamped(&self) -> bool {
        let (p, n) = (self.degree, self.control_count());
        self.values[0] == self.values[p] && self.values[n] == self.values[n + p]
    }

    /// The index k of the span with `values[k] <= t < values[k + 1]`; the last non-empty span at the end of
    /// the domain. Outside the domain, the first or last non-empty span.
    pub fn span(&self, t: f64) -> usize {
        let (p, n) = (self.degree, self.control_count());
        let upper = self.values[p..n].partition_point(|&v| v <= t) + p;
        let mut k = upper.clamp(p + 1, n) - 1;
        while k > p && self.values[k] >= self.values[k + 1] {
            k -= 1;
        }
        while self.values[k] >= self.values[k + 1] {
            k += 1;
        }
        k
    }

    /// Basis values and their derivatives up to `order <= MAX_DERIVATIVE` at `t`, on the span that contains
    /// `t`. Outside the domain the end piece is continued.
    pub fn basis(&self, t: f64, order: usize) -> Basis {
        self.basis_on(self.span(t), t, order)
    }

    /// The same on the polynomial piece of a given non-empty span, whichever side of it `t` is on.
    pub fn basis_on(&self, span: usize, t: f64, order: usize) -> Basis {
        fn widened<const N: usize>(small: &Basis<N>) -> Basis {
            let mut basis = Basis { first: small.first, d: [[0.0; MAX_DEGREE + 1]; MAX_DERIVATIVE + 1] };
            for (wide, row) in basis.d.iter_mut().zip(&small.d) {
                wide[..N].copy_from_slice(row);
            }
            basis
        }
        match self.degree {
            0..=3 => widened(&self.small_basis::<4>(span, t, order)),
            4..=7 => widened(&self.small_basis::<8>(span, t, order)),
            _ => self.small_basis(span, t, order),
        }
    }

    /// The same in no more room than a degree below `N` needs: clearing that of degree 31 costs more than all of a
    /// cubic. The degree must be below `N`.
    #[inline]
    pub(crate) fn small_basis<const N: usize>(&self, span: usize, t: f64, order: usize) -> Basis<N> {
        if self.degree == 3 { self.cubic(span, t, order) } else { self.general(span, t, order) }
    }

    /// The cubic written out: each derivative is a difference of the basis one degree lower over its knots.
    #[inline]
    fn cubic<const N: usize>(&self, span: usize, t: f64, order: usize) -> Basis<N> {
        let mut basis = Basis { first: span - 3, d: [[0.0; N]; MAX_DERIVATIVE + 1] };
        let &[u1, u2, u3, v1, v2, v3] = &self.values[span - 2..span + 4] else { return basis };
        let [left1, left2, left3] = [t - u3, t - u2, t - u1];
        let [right1, right2, right3] = [v1 - t, v2 - t, v3 - t];
        let step = v1 - u3;
        let one = [right1 / step, left1 / step];
        let below1 = [one[0] / (v1 - u2), one[1] / (v2 - u3)];
        let two = [below1[0] * right1, below1[0] * left2 + below1[1] * right2, below1[1] * left1];
        let below2 = [two[0] / (v1 - u1), two[1] / (v2 - u2), two[2] / (v3 - u3)];
        let d = &mut basis.d;
        d[0][0] = below2[0] * right1;
        d[0][1] = below2[0] * left3 + below2[1] * right2;
        d[0][2] = below2[1] * left2 + below2[2] * right3;
        d[0][3] = below2[2] * left1;
        let differences = |row: &mut [f64; N], [a, b, c]: [f64; 3], factor: f64| {
            (row[0], row[1], row[2], row[3]) = (-factor * a, factor * (a - b), factor * (b - c), factor * c);
        };
        if order >= 1 {
            differences(&mut d[1], below2, 3.0);
        }
        let over = |[a, b, c]: [f64; 3]| [a / (v1 - u1), b / (v2 - u2), c / (v3 - u3)];
        if order >= 2 {
            let [a, b] = below1;
            differences(&mut d[2], over([-a, a - b, b]), 6.0);
        }
        if order >= 3 {
            let (a, b) = (-1.0 / (step * (v1 - u2)), 1.0 / (step * (v2 - u3)));
            differences(&mut d[3], over([-a, a - b, b]), 6.0);
        }
        basis
    }

    fn general<const N: usize>(&self, span: usize, t: f64, order: usize) -> Basis<N> {
        let (p, u) = (self.degree, &self.values);
        let mut ndu = [[0.0; N]; N];
        let (mut left, mut right) = ([0.0; N], [0.0; N]);
        ndu[0][0] = 1.0;
        for j in 1..=p {
            left[j] = t - u[span + 1 - j];
            right[j] = u[span + j] - t;
            let mut saved = 0.0;
            for r in 0..j {
                ndu[j][r] = right[r + 1] + left[j - r];
                let temp = ndu[r][j - 1] / ndu[j][r];
                ndu[r][j] = saved + right[r + 1] * temp;
                saved = left[j - r] * temp;
            }
            ndu[j][j] = saved;
        }
        let mut d = [[0.0; N]; MAX_DERIVATIVE + 1];
        for j in 0..=p {
            d[0][j] = ndu[j][p];
        }
        let order = order.min(MAX_DERIVATIVE);
        for r in 0..=p {
            let mut a = [[0.0; MAX_DERIVATIVE + 1]; 2];
            let (mut s1, mut s2) = (0, 1);
            a[0][0] = 1.0;
            for k in 1..=order.min(p) {
                let mut sum = 0.0;
                let pk = p - k;
                if r >= k {
                    a[s2][0] = a[s1][0] / ndu[pk + 1][r - k];
                    sum = a[s2][0] * ndu[r - k][pk];
                }
                let j1 = if r + 1 >= k { 1 } else { k - r };
                let j2 = if r <= pk + 1 { k - 1 } else { p - r };
                for j in j1..=j2 {
                    a[s2][j] = (a[s1][j] - a[s1][j - 1]) / ndu[pk + 1][r + j - k];
                    sum += a[s2][j] * ndu[r + j - k][pk];
                }
                if r <= pk {
                    a[s2][k] = -a[s1][k - 1] / ndu[pk + 1][r];
                    sum += a[s2][k] * ndu[r][pk];
                }
                d[k][r] = sum;
                std::mem::swap(&mut s1, &mut s2);
            }
        }
        let mut factor = 1.0;
        for k in 1..=order.min(p) {
            factor *= (p + 1 - k) as f64;
            for value in &mut d[k][..=p] {
                *value *= factor;
            }
        }
        Basis { first: span - p, d }
    }

    /// The Greville abscissae: the parameter at which control point i acts most.
    pub fn greville(&self) -> Vec<f64> {
        let p = self.degree;
        (0..self.control_count()).map(|i| self.values[i + 1..=i + p].iter().sum::<f64>() / p as f64).collect()
    }

    /// The same knots run backwards over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let [start, end] = self.domain();
        let values = self.values.iter().rev().map(|v| start + end - v).collect();
        Self { degree: self.degree, values }
    }

    /// The knots mapped affinely onto the domain `start..=end`.
    #[must_use]
    pub fn remapped(&self, start: f64, end: f64) -> Self {
        let [a, b] = self.domain();
        let values = self
            .values
            .iter()
            .map(|&v| {
                if v == a {
                    start
                } else if v == b {
                    end
                } else {
                    start + (v - a) / (b - a) * (end - start)
                }
            })
            .collect();
        Self { degree: self.degree, values }
    }

    /// The clamped knots of the piece over `start..=end`, which must lie in the domain.
    pub fn restricted(&self, start: f64, end: f64) -> Result<Self, KnotError> {
        let p = self.degree;
        let mut values = vec![start; p + 1];
        values.extend(self.values.iter().filter(|&&v| start < v && v < end));
        values.extend(std::iter::repeat_n(end, p + 1));
        Self::new(p, values)
    }

    /// These knots with `t` added `times` more, up to full multiplicity.
    pub fn inserted(&self, t: f64, times: usize) -> Result<Self, KnotError> {
        let at = self.values.partition_point(|&v| v <= t);
        let mut values = self.values.clone();
        values.splice(at..at, std::iter::repeat_n(t, times));
        Self::new(self.degree, values)
    }

    /// The knots of the same spline at `degree + 1`: every distinct knot once more.
    pub fn elevated(&self) -> Result<Self, KnotError> {
        let clamped_ends = self.restricted(self.domain()[0], self.domain()[1])?;
        let values =
            clamped_ends.multiplicities().into_iter().flat_map(|(v, m)| std::iter::repeat_n(v, m + 1)).collect();
        Self::new(self.degree + 1, values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_a_partition_of_unity_and_its_derivatives_sum_to_zero() {
        let knots = Knots::new(3, vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 2.5, 3.0, 3.0, 3.5, 4.0, 4.0]).unwrap();
        let [a, b] = knots.domain();
        for i in 0..=40 {
            let t = a + (b - a) * f64::from(i) / 40.0;
            let basis = knots.basis(t, 3);
            assert!((basis.d[0].iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for k in 1..=3 {
                assert!(basis.d[k].iter().sum::<f64>().abs() < 1e-11, "{k} at {t}");
            }
        }
    }

    #[test]
    fn derivatives_match_the_bernstein_closed_form() {
        let knots = Knots::bezier(2, 0.0, 2.0).unwrap();
        let basis = knots.basis(0.5, 2);
        let s = 0.25;
        let expected =
            [[(1.0f64 - s).powi(2), 2.0 * s * (1.0 - s), s * s], [-(1.0 - s), 1.0 - 2.0 * s, s], [0.5, -1.0, 0.5]];
        for (k, row) in expected.iter().enumerate() {
            for (i, value) in row.iter().enumerate() {
                assert!((basis.d[k][i] - value).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn the_cubic_is_the_general_one() {
        let knots = Knots::new(3, vec![-0.5, 0.0, 0.0, 0.2, 1.0, 1.0, 1.0, 2.5, 2.6, 3.5, 3.5, 4.0]).unwrap();
        let [a, b] = knots.domain();
        for i in 0..=60 {
            let t = a - 0.1 + (b - a + 0.2) * f64::from(i) / 60.0;
            for order in 0..=3 {
                let (fast, slow): (Basis<4>, Basis<4>) =
                    (knots.cubic(knots.span(t), t, order), knots.general(knots.span(t), t, order));
                assert_eq!(fast.first, slow.first);
                for (x, y) in fast.d.as_flattened().iter().zip(slow.d.as_flattened()) {
                    assert!((x - y).abs() <= 1e-13 * (1.0 + y.abs()), "{t} {order}");
                }
            }
        }
    }

    #[test]
    fn spans_at_knots_and_ends_are_never_empty() {
        let knots = Knots::clamped(2, &[0.0, 1.0, 2.0], 2).unwrap();
        for t in [-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0] {
            let k = knots.span(t);
            assert!(knots.values()[k] < knots.values()[k + 1]);
        }
        assert_eq!(knots.span(1.0), 4);
    }

    #[test]
    fn bad_knots_are_named() {
        assert_eq!(Knots::new(0, vec![0.0, 1.0]), Err(KnotError::Degree { degree: 0 }));
        assert!(matches!(Knots::new(1, vec![0.0, 0.0, f64::NAN, 1.0]), Err(KnotError::NotFinite { index: 2, .. })));
        assert!(matches!(Knots::new(1, vec![0.0, 1.0, 0.5, 2.0]), Err(KnotError::Decreasing { index: 2, .. })));
        assert!(matches!(Knots::new(1, vec![1.0; 4]), Err(KnotError::EmptyDomain { .. })));
        assert!(matches!(
            Knots::new(1, vec![0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0]),
            Err(KnotError::Multiplicity { got: 3, limit: 1, .. })
        ));
    }
}
