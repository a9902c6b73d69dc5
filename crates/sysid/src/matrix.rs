//! Small complex matrices: the few operations that responses need.

use ndarray::Array2;
use num_complex::Complex64;

/// The inverse by Gauss-Jordan elimination with row pivoting; `None` if singular or not finite.
pub(crate) fn inverse(a: &Array2<Complex64>) -> Option<Array2<Complex64>> {
    let n = a.nrows();
    let mut left = a.clone();
    let mut right = Array2::from_diag_elem(n, Complex64::new(1.0, 0.0));
    let scale = a.iter().map(|v| v.norm()).fold(0.0, f64::max);
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| left[[i, column]].norm().total_cmp(&left[[j, column]].norm()))?;
        let size = left[[pivot, column]].norm();
        if !size.is_finite() || size <= scale * f64::EPSILON {
            return None;
        }
        for k in 0..n {
            left.swap([column, k], [pivot, k]);
            right.swap([column, k], [pivot, k]);
        }
        let factor = left[[column, column]].inv();
        for k in 0..n {
            left[[column, k]] *= factor;
            right[[column, k]] *= factor;
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = left[[row, column]];
            for k in 0..n {
                let (l, r) = (left[[column, k]] * factor, right[[column, k]] * factor);
                left[[row, k]] -= l;
                right[[row, k]] -= r;
            }
        }
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_singular_or_no_number_has_no_inverse() {
        let real = |entries: [f64; 4]| Array2::from_shape_fn((2, 2), |(i, j)| Complex64::from(entries[2 * i + j]));
        for entries in [[1.0, 2.0, 2.0, 4.0], [0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [1.0, 0.0, f64::INFINITY, 1.0]] {
            assert_eq!(inverse(&real(entries)), None, "{entries:?}");
        }
        assert_eq!(inverse(&real([0.0, 2.0, 4.0, 0.0])), Some(real([0.0, 0.25, 0.5, 0.0])));
    }
}
