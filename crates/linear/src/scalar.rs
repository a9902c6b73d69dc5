//! The two kinds of number that a matrix here may hold.

use num_complex::Complex64;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real or a complex number.
pub trait Scalar:
    Copy
    + Default
    + PartialEq
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Sum
{
    /// 1.
    const ONE: Self;
    /// z*.
    fn conj(self) -> Self;
    /// |z|².
    fn norm_sqr(self) -> f64;
    /// Re z.
    fn re(self) -> f64;
}

impl Scalar for f64 {
    const ONE: f64 = 1.0;
    #[inline(always)]
    fn conj(self) -> f64 {
        self
    }
    #[inline(always)]
    fn norm_sqr(self) -> f64 {
        self * self
    }
    #[inline(always)]
    fn re(self) -> f64 {
        self
    }
}

impl Scalar for Complex64 {
    const ONE: Complex64 = Complex64::new(1.0, 0.0);
    #[inline(always)]
    fn conj(self) -> Complex64 {
        Complex64::conj(&self)
    }
    #[inline(always)]
    fn norm_sqr(self) -> f64 {
        Complex64::norm_sqr(&self)
    }
    #[inline(always)]
    fn re(self) -> f64 {
        self.re
    }
}
