//! What fitted matrices mean: ellipse and symmetry.

mod ellipse;
mod symmetry;

pub use ellipse::{Ellipse, ellipse, unit_matrices};
pub use symmetry::{Antisymmetric, SymmetryTest, symmetry_test};

use ndarray::Array2;
use serde::{Deserialize, Serialize};

/// A derived number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Derived {
    /// The number.
    pub value: f64,
    /// Its standard error by the delta method.
    pub std_error: f64,
    /// Its 95 % confidence interval.
    pub ci95: [f64; 2],
}

impl Derived {
    /// A function's value with its gradient in the parameters.
    fn new(value: f64, gradient: &[f64], covariance: &Array2<f64>, quantile: f64) -> Self {
        let n = gradient.len();
        let variance: f64 = (0..n * n)
            .filter(|e| gradient[e / n] != 0.0 && gradient[e % n] != 0.0)
            .map(|e| gradient[e / n] * covariance[[e / n, e % n]] * gradient[e % n])
            .sum();
        let std_error = variance.max(0.0).sqrt();
        Derived { value, std_error, ci95: [value - quantile * std_error, value + quantile * std_error] }
    }
}

/// Eigenvalues, ascending, and eigenvectors (columns) of the symmetric part of a matrix.
fn symmetric_eigen(a: &Array2<f64>) -> Option<(Vec<f64>, Array2<f64>)> {
    ndof_linear::symmetric_eigen(&((a + &a.t()) * 0.5))
}
