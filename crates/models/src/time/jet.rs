//! Numbers that carry their derivatives, so that an equation is written once.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number, with or without derivatives.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self> {
    /// A constant.
    fn of(value: f64) -> Self;

    /// The number without its derivatives.
    fn value(self) -> f64;

    /// g(self), given g and its slope there.
    fn chain(self, value: f64, slope: f64) -> Self;

    /// e^x.
    fn exp(self) -> Self {
        let e = self.value().exp();
        self.chain(e, e)
    }

    /// The hyperbolic tangent.
    fn tanh(self) -> Self {
        let t = self.value().tanh();
        self.chain(t, 1.0 - t * t)
    }

    /// |x|, with the slope of its side.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// The larger of two.
    fn max(self, other: Self) -> Self {
        if self.value() < other.value() { other } else { self }
    }

    /// The number within −limit … limit.
    fn clip(self, limit: Self) -> Self {
        if self.value() > limit.value() {
            limit
        } else if self.value() < -limit.value() {
            -limit
        } else {
            self
        }
    }

    /// A multiple.
    fn times(self, factor: f64) -> Self {
        self.chain(self.value() * factor, factor)
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn chain(self, value: f64, _slope: f64) -> Self {
        value
    }
}

/// A number with its derivatives in N variables (forward differentiation).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet<const N: usize> {
    value: f64,
    pub(crate) slope: [f64; N],
}

impl<const N: usize> Jet<N> {
    /// The `index`-th variable; a constant beyond the last.
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut slope = [0.0; N];
        if let Some(own) = slope.get_mut(index) {
            *own = 1.0;
        }
        Jet { value, slope }
    }

    fn combine(self, other: Self, value: f64, left: f64, right: f64) -> Self {
        let mut slope = self.slope;
        slope.iter_mut().zip(other.slope).for_each(|(a, b)| *a = *a * left + b * right);
        Jet { value, slope }
    }
}

impl<const N: usize> Real for Jet<N> {
    fn of(value: f64) -> Self {
        Jet { value, slope: [0.0; N] }
    }

    fn value(self) -> f64 {
        self.value
    }

    fn chain(self, value: f64, slope: f64) -> Self {
        Jet { value, slope: self.slope.map(|s| s * slope) }
    }
}

impl<const N: usize> Add for Jet<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.combine(other, self.value + other.value, 1.0, 1.0)
    }
}

impl<const N: usize> Sub for Jet<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.combine(other, self.value - other.value, 1.0, -1.0)
    }
}

impl<const N: usize> Mul for Jet<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.combine(other, self.value * other.value, other.value, self.value)
    }
}

impl<const N: usize> Div for Jet<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let ratio = self.value / other.value;
        self.combine(other, ratio, 1.0 / other.value, -ratio / other.value)
    }
}

impl<const N: usize> Neg for Jet<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formula<R: Real>(x: R, y: R) -> R {
        (x * y).tanh() / (y - x.exp()) + (-x).abs().clip(y) * x.max(y).times(0.3) - R::of(2.0)
    }

    #[test]
    fn slopes_of_a_formula_are_its_differences() {
        for (x, y) in [(0.3, 2.0), (-0.7, 0.4), (1.9, -0.5)] {
            let exact = formula(Jet::<2>::variable(x, 0), Jet::variable(y, 1));
            let h = 1e-6;
            let differences = [(formula(x + h, y) - formula(x - h, y)) / (2.0 * h), (formula(x, y + h) - formula(x, y - h)) / (2.0 * h)];
            assert_eq!(exact.value(), formula(x, y));
            assert!(exact.slope.iter().zip(differences).all(|(a, b)| (a - b).abs() < 1e-8 * (1.0 + a.abs())), "{exact:?} {differences:?}");
        }
    }
}
