//! Several `f64` computations in lockstep: a register of lanes with the arithmetic of one number.
//!
//! Code written over [`F`] runs with as many lanes as the processor has (pulp picks at run time) and gives the same
//! bits in each of them as the plain build: every operation here is one IEEE operation, there is no fused
//! multiply-add, and minimum and maximum are comparisons, so that signed zeros agree too.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use pulp::Simd;

/// One `f64` per lane.
pub struct F<S: Simd> {
    simd: S,
    v: S::f64s,
}

impl<S: Simd> Clone for F<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for F<S> {}

impl<S: Simd> F<S> {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Self { simd, v: simd.splat_f64s(value) }
    }

    /// The first [`Simd::F64_LANES`] numbers of a slice; missing ones are 0.
    #[inline(always)]
    pub fn load(simd: S, values: &[f64]) -> Self {
        // A partial load goes through a table of jumps.
        let v = match S::as_simd_f64s(values).0 {
            [whole, ..] => *whole,
            [] => simd.partial_load_f64s(values),
        };
        Self { simd, v }
    }

    /// The same number in every lane, with the lanes of `self`.
    #[inline(always)]
    pub fn with(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// The numbers, one a lane.
    #[inline(always)]
    pub fn lanes(&self) -> &[f64] {
        pulp::bytemuck::cast_slice(std::slice::from_ref(&self.v))
    }

    /// The square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { v: self.simd.sqrt_f64s(self.v), ..self }
    }

    /// The absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        // With one lane pulp's masks go through integer registers; the plain operation is the same bit for bit.
        match self.one() {
            Some(x) => self.with(x.abs()),
            None => Self { v: self.simd.abs_f64s(self.v), ..self },
        }
    }

    /// `yes` where `self < other`, `no` elsewhere.
    #[inline(always)]
    pub fn less(self, other: Self, yes: Self, no: Self) -> Self {
        if let (Some(a), Some(b)) = (self.one(), other.one()) {
            return if a < b { yes } else { no };
        }
        let mask = self.simd.less_than_f64s(self.v, other.v);
        Self { v: self.simd.select_f64s(mask, yes.v, no.v), ..self }
    }

    /// The smaller; `other` where they are equal or either is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        if cfg!(target_arch = "x86_64") && S::F64_LANES > 1 {
            // minpd is that comparison.
            return Self { v: self.simd.min_f64s(self.v, other.v), ..self };
        }
        self.less(other, self, other)
    }

    /// The larger; `other` where they are equal or either is not a number.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        if cfg!(target_arch = "x86_64") && S::F64_LANES > 1 {
            return Self { v: self.simd.max_f64s(self.v, other.v), ..self };
        }
        other.less(self, self, other)
    }

    /// The number of the only lane, where there is one.
    #[inline(always)]
    fn one(self) -> Option<f64> {
        if S::F64_LANES == 1 { Some(self.lanes()[0]) } else { None }
    }

    /// Rounded to the 24 bits of an `f32` (Veltkamp's splitting), so that the cast is exact.
    #[inline(always)]
    pub fn rounded(self) -> Self {
        let c = self * self.with(536_870_913.0);
        c - (c - self)
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $op:ident) => {
        impl<S: Simd> $trait for F<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { v: self.simd.$op(self.v, other.v), ..self }
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Mul<f64> for F<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self * self.with(other)
    }
}

impl<S: Simd> Add<f64> for F<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: f64) -> Self {
        self + self.with(other)
    }
}

impl<S: Simd> Neg for F<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        match self.one() {
            Some(x) => self.with(-x),
            None => Self { v: self.simd.neg_f64s(self.v), ..self },
        }
    }
}

impl<S: Simd> AddAssign for F<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// A vector in space, one per lane.
pub struct F3<S: Simd> {
    /// First coordinate.
    pub x: F<S>,
    /// Second coordinate.
    pub y: F<S>,
    /// Third coordinate.
    pub z: F<S>,
}

impl<S: Simd> Clone for F3<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for F3<S> {}

impl<S: Simd> F3<S> {
    /// From coordinates.
    #[inline(always)]
    pub fn new(x: F<S>, y: F<S>, z: F<S>) -> Self {
        Self { x, y, z }
    }

    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> F<S> {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }

    /// `yes` where `a < b`, `no` elsewhere.
    #[inline(always)]
    pub fn less(a: F<S>, b: F<S>, yes: Self, no: Self) -> Self {
        Self::new(a.less(b, yes.x, no.x), a.less(b, yes.y, no.y), a.less(b, yes.z, no.z))
    }

    /// The sum of the absolute coordinates, never below the length.
    #[inline(always)]
    pub fn taxicab(self) -> F<S> {
        self.x.abs() + self.y.abs() + self.z.abs()
    }

    /// Each coordinate rounded to an `f32`.
    #[inline(always)]
    pub fn rounded(self) -> Self {
        Self::new(self.x.rounded(), self.y.rounded(), self.z.rounded())
    }
}

impl<S: Simd> Add for F3<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<S: Simd> Sub for F3<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<S: Simd> Mul<F<S>> for F3<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, s: F<S>) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Scalar, Scalar256b};

    use super::*;

    #[test]
    fn rounding_is_that_of_the_cast() {
        let mut x: f64 = 0.123_456_789;
        for _ in 0..10_000 {
            x = (x * 1.618_033_988_7 + 0.577).fract() * 3.0 - 1.0;
            let rounded = F::splat(Scalar::new(), x).rounded().lanes()[0];
            assert_eq!(f64::from(rounded as f32), rounded);
            assert!((rounded - x).abs() <= x.abs() * 2.0_f64.powi(-24));
        }
    }

    #[test]
    fn four_lanes_compute_what_one_does() {
        let values = [1.5, -0.5, 0.3, 1e30];
        let other = [0.0, 0.25, -0.7, 2.0];
        let simd = Scalar256b;
        let (a, b) = (F::load(simd, &values), F::load(simd, &other));
        let wide = [(a + b), (a - b), (a * b), (a / b), a.min(b), a.max(b), a.abs().sqrt(), -a];
        for lane in 0..4 {
            let (a, b) = (F::splat(Scalar::new(), values[lane]), F::splat(Scalar::new(), other[lane]));
            let plain = [(a + b), (a - b), (a * b), (a / b), a.min(b), a.max(b), a.abs().sqrt(), -a];
            for (wide, plain) in wide.iter().zip(plain) {
                assert_eq!(wide.lanes()[lane].to_bits(), plain.lanes()[0].to_bits());
            }
        }
    }
}
