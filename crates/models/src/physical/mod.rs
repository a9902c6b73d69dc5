//! What fitted matrices mean: ellipse, symmetry, and whether a body has them.

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
        let std_error = product(gradient, covariance, gradient).max(0.0).sqrt();
        Derived { value, std_error, ci95: [value - quantile * std_error, value + quantile * std_error] }
    }
}

/// gᵀ C h, of the entries that both have: what is not determined has an infinite variance.
fn product(g: &[f64], covariance: &Array2<f64>, h: &[f64]) -> f64 {
    let used = |e: &usize| g[e / h.len()] != 0.0 && h[e % h.len()] != 0.0;
    (0..g.len() * h.len()).filter(used).map(|e| g[e / h.len()] * covariance[[e / h.len(), e % h.len()]] * h[e % h.len()]).sum()
}

/// Whether no body has an inertia between two axes that lies within this interval, beside inertias along them of at most so much: M_ij² ≤ M_ii M_jj, since a body
/// cannot be moved without work. Where one along an axis is below zero itself, that is what is wrong, and the answer is no.
///
/// ```
/// use ndof_models::physical::is_of_no_body;
///
/// assert!(is_of_no_body([1.9, 2.1], [0.1, 0.1])); // kg: two channels in each other's place
/// assert!(is_of_no_body([-2.1, -1.9], [0.1, 0.1]));
/// assert!(!is_of_no_body([0.9, 1.1], [1.0, 1.0])); // 0.9 < √(1 · 1)
/// assert!(!is_of_no_body([1.9, 2.1], [-0.1, 0.1]));
/// ```
pub fn is_of_no_body(between: [f64; 2], [along, across]: [f64; 2]) -> bool {
    let least = between[0].max(-between[1]);
    along >= 0.0 && across >= 0.0 && least > (along * across).sqrt()
}

/// Eigenvalues, ascending, and eigenvectors (columns) of the symmetric part of a matrix.
fn symmetric_eigen(a: &Array2<f64>) -> Option<(Vec<f64>, Array2<f64>)> {
    ndof_linear::symmetric_eigen(&((a + &a.t()) * 0.5))
}
