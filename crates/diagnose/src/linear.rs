//! Normal equations of least squares.

use ndof_linear::Cholesky;
use num_complex::Complex64;

/// A symmetric positive definite matrix by rows, and its Cholesky factor once made.
#[derive(Clone, Debug)]
pub(crate) struct Symmetric {
    n: usize,
    pub a: Vec<f64>,
}

impl Symmetric {
    pub fn zeros(n: usize) -> Self {
        Symmetric { n, a: vec![0.0; n * n] }
    }

    /// Of the entries on the diagonal and below it.
    pub fn of(n: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut out = Symmetric::zeros(n);
        (0..n).for_each(|i| (0..=i).for_each(|j| out.add(i, j, entry(i, j))));
        out
    }

    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.a[i * self.n + j] += value;
        if i != j {
            self.a[j * self.n + i] += value;
        }
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.a[i * self.n + j]
    }

    /// The Cholesky factor of the matrix scaled to unit diagonal, with a ridge of 1e-12; `None` if it is not positive definite.
    pub fn factor(&self) -> Option<Factor> {
        let scale: Vec<f64> = (0..self.n).map(|i| if self.at(i, i) > 0.0 { 1.0 / self.at(i, i).sqrt() } else { 1.0 }).collect();
        let mut scaled = Cholesky::new(self.n);
        let regular = scaled.factor(|i, j| self.at(i, j) * scale[i] * scale[j] + if i == j { 1e-12 } else { 0.0 });
        regular.then_some(Factor { scaled, scale })
    }
}

/// A Cholesky factor.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    scaled: Cholesky<f64>,
    scale: Vec<f64>,
}

impl Factor {
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = b.iter().zip(&self.scale).map(|(b, s)| b * s).collect();
        self.scaled.solve(&mut x);
        x.iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
        x
    }

    pub fn inverse(&self) -> Symmetric {
        let n = self.scale.len();
        // Column after column is row after row: the inverse is symmetric.
        let a = (0..n).flat_map(|j| self.solve(&(0..n).map(|i| f64::from(i == j)).collect::<Vec<_>>())).collect();
        Symmetric { n, a }
    }
}

/// Re Σ a b*.
pub(crate) fn inner(a: &[Complex64], b: &[Complex64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.re * b.re + a.im * b.im).sum()
}

/// Σ a b, in eight lanes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            lanes[k] += x[k] * y[k];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_solves_and_inverts() {
        let mut m = Symmetric::zeros(3);
        for (i, j, v) in [(0, 0, 4.0), (0, 1, 1.0), (1, 1, 3e-6), (1, 2, 1e-4), (2, 2, 2.0)] {
            m.add(i, j, if i == 0 && j == 1 { v * 1e-3 } else { v });
        }
        let x = m.factor().expect("positive definite").solve(&[1.0, 2.0, 3.0]);
        for (i, want) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            let got: f64 = (0..3).map(|j| m.at(i, j) * x[j]).sum();
            assert!((got - want).abs() < 1e-9, "{i}: {got}");
        }
        m.a[0] = -1.0;
        assert!(m.factor().is_none());
    }
}
