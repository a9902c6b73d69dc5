//! Small dense matrices, row-major in slices: no allocation, sizes known at run time.

use ndarray::Array2;
use num_complex::Complex64;

/// Replaces the symmetric `a` (n × n) by its lower Cholesky factor; false if it is not positive definite.
pub(crate) fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let mut pivot = a[j * n + j];
        for k in 0..j {
            pivot -= a[j * n + k] * a[j * n + k];
        }
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let pivot = pivot.sqrt();
        a[j * n + j] = pivot;
        for i in j + 1..n {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            a[i * n + j] = sum / pivot;
        }
    }
    true
}

/// Solves A x = b in place, `factor` being the Cholesky factor of A.
pub(crate) fn cholesky_solve(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= factor[i * n + k] * b[k];
        }
        b[i] = sum / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= factor[k * n + i] * b[k];
        }
        b[i] = sum / factor[i * n + i];
    }
}

/// A number that a matrix may hold.
pub(crate) trait Scalar:
    Copy + std::ops::Mul<Output = Self> + std::ops::Div<Output = Self> + std::ops::SubAssign + std::ops::DivAssign + ndarray::ScalarOperand
{
    const ZERO: Self;
    const ONE: Self;
    fn size(self) -> f64;
}

impl Scalar for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    fn size(self) -> f64 {
        self.abs()
    }
}

impl Scalar for Complex64 {
    const ZERO: Complex64 = Complex64::new(0.0, 0.0);
    const ONE: Complex64 = Complex64::new(1.0, 0.0);
    fn size(self) -> f64 {
        self.norm()
    }
}

/// The inverse by Gauss-Jordan elimination with row pivoting; `None` if singular.
pub(crate) fn inverse<T: Scalar>(a: &Array2<T>) -> Option<Array2<T>> {
    let n = a.nrows();
    let (mut left, mut right) = (a.clone(), Array2::from_elem((n, n), T::ZERO));
    for i in 0..n {
        right[[i, i]] = T::ONE;
    }
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| left[[i, column]].size().total_cmp(&left[[j, column]].size()))?;
        let size = left[[pivot, column]].size();
        if !(size.is_finite() && size > 0.0) {
            return None;
        }
        for k in 0..n {
            left.swap([column, k], [pivot, k]);
            right.swap([column, k], [pivot, k]);
        }
        let divisor = left[[column, column]];
        for k in 0..n {
            left[[column, k]] /= divisor;
            right[[column, k]] /= divisor;
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = left[[row, column]];
            for k in 0..n {
                let (l, r) = (left[[column, k]], right[[column, k]]);
                left[[row, k]] -= factor * l;
                right[[row, k]] -= factor * r;
            }
        }
    }
    Some(right)
}

/// Whether `a` is symmetric (to round-off) and positive definite.
pub(crate) fn is_inertia(a: &Array2<f64>) -> bool {
    let scale = a.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
    let symmetric = a.indexed_iter().all(|((i, j), v)| (v - a[[j, i]]).abs() <= 1e-9 * scale);
    symmetric && cholesky(&mut a.iter().copied().collect::<Vec<_>>(), a.nrows())
}

/// y = A x for a row-major A.
pub(crate) fn multiply(a: &[f64], x: &[f64], y: &mut [f64]) {
    for (row, y) in a.chunks_exact(x.len()).zip(y) {
        *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
    }
}

/// y += factor · Aᵀ x for a row-major A.
#[inline(always)]
pub(crate) fn add_transposed(a: &[f64], x: &[f64], factor: f64, y: &mut [f64]) {
    for (row, x) in a.chunks_exact(y.len()).zip(x) {
        y.iter_mut().zip(row).for_each(|(y, a)| *y += factor * a * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_inverse_undoes_the_matrix() {
        let a = array![[0.0, 2.0, 1.0], [1.0, -3.0, 0.5], [4.0, 0.0, -1.0]];
        let product = a.dot(&inverse(&a).expect("regular"));
        for ((i, j), v) in product.indexed_iter() {
            assert!((v - f64::from(u8::from(i == j))).abs() < 1e-14);
        }
        assert!(inverse(&array![[1.0, 2.0], [2.0, 4.0]]).is_none());
    }

    #[test]
    fn cholesky_solves_and_refuses_what_is_indefinite() {
        let a = [4.0, 1.0, 1.0, 3.0];
        let mut factor = a;
        assert!(cholesky(&mut factor, 2));
        let mut x = [1.0, 2.0];
        cholesky_solve(&factor, 2, &mut x);
        assert!((4.0 * x[0] + x[1] - 1.0).abs() < 1e-15 && (x[0] + 3.0 * x[1] - 2.0).abs() < 1e-15);
        assert!(!cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2));
        assert!(!is_inertia(&array![[1.0, 0.1], [0.2, 1.0]]));
    }
}
