//! How strongly the references move the inputs.

use ndof_linear::{Cholesky, hermitian_eigen};
use num_complex::Complex64;

/// Below this strength of the instrument the estimate is biased towards the direct one, and its intervals are too
/// narrow.
pub const WEAK_INSTRUMENT: f64 = 10.0;

/// The largest eigenvalue of S⁻¹N for S = L Lᴴ already factored, that is of L⁻¹ N L⁻ᴴ. N may be singular. `a`, `b`,
/// `row` and `values` are workspace of q², q², q and q.
pub(crate) fn largest_ratio(
    factor: &Cholesky<Complex64>,
    n: impl Fn(usize, usize) -> Complex64,
    a: &mut [Complex64],
    b: &mut [Complex64],
    row: &mut [Complex64],
    values: &mut [f64],
) -> f64 {
    let q = values.len();
    for i in 0..q {
        (0..q).for_each(|j| row[j] = n(i, j));
        factor.whiten(&mut row[..q]);
        a[i * q..(i + 1) * q].copy_from_slice(&row[..q]);
    }
    for j in 0..q {
        (0..q).for_each(|i| row[i] = a[i * q + j].conj());
        factor.whiten(&mut row[..q]);
        b[j * q..(j + 1) * q].copy_from_slice(&row[..q]);
    }
    hermitian_eigen(b, values, None);
    values.iter().fold(0.0_f64, |a, &b| a.max(b))
}
