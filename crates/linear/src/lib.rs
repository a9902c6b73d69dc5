//! Small dense linear algebra: one of each tool.
//!
//! - [`square`]: products, inverses and determinants of n × n matrices in rows of a slice, real or complex, without allocation where it
//!   counts: thousands of matrices of two to twelve rows, one a frequency or one a time step.
//! - [`Cholesky`]: Hermitian positive definite systems of the same kind; it refuses every other matrix.
//! - [`hermitian_eigen`]: eigenvalues and vectors of the same.
//! - [`inverse`], [`eigenvalues`], [`symmetric_eigen`] and [`singular_values`] of matrices of any size, by `faer`; [`independent_columns`].
//! - [`phi_functions`], the first of them the exponential of a matrix.
//!
//! ```
//! use ndarray::array;
//! use ndof_linear::inverse;
//! assert_eq!(inverse(&array![[0.0, 2.0], [4.0, 0.0]]), Some(array![[0.0, 0.25], [0.5, 0.0]]));
//! ```

mod cholesky;
mod dense;
mod exponential;
mod hermitian;
mod scalar;
pub mod square;

pub use cholesky::{Cholesky, SMALLEST_PIVOT, cholesky_in_place, cholesky_solve};
pub use dense::{eigenvalues, independent_columns, singular_values, symmetric_eigen};
pub use exponential::{doubled, phi_functions};
pub use hermitian::hermitian_eigen;
pub use scalar::Scalar;

use ndarray::Array2;

/// A⁻¹; `None` if A is singular, not square or holds what is no number. See [`square::inverse`].
pub fn inverse<T: Scalar>(a: &Array2<T>) -> Option<Array2<T>> {
    let n = a.nrows();
    let rows: Vec<T> = a.iter().copied().collect();
    Array2::from_shape_vec((n, n), square::inverse(&rows, n)?).ok()
}

/// Whether A is symmetric, to 1e-9 of its largest entry, and positive definite: what an inertia has to be.
pub fn is_positive_definite(a: &Array2<f64>) -> bool {
    let scale = a.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    a.is_square() && a.indexed_iter().all(|((i, j), v)| (v - a[[j, i]]).abs() <= 1e-9 * scale) && Cholesky::new(a.nrows()).factor(|i, j| a[[i, j]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn an_inertia_is_symmetric_and_positive_definite() {
        assert!(is_positive_definite(&array![[4.0, 1.0], [1.0, 3.0]]));
        for refused in [array![[1.0, 0.1], [0.2, 1.0]], array![[1.0, 2.0], [2.0, 1.0]], array![[1.0, 0.0]], array![[f64::NAN]]] {
            assert!(!is_positive_definite(&refused), "{refused}");
        }
    }
}
