//! Decompositions of matrices of any size, by `faer`.

use faer::{Mat, Side};
use ndarray::{Array1, Array2};
use num_complex::Complex64;

fn of(a: &Array2<f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[[i, j]])
}

/// Eigenvalues λ of a symmetric matrix in ascending order, and its eigenvectors as columns of U, A = U diag(λ) Uᵀ; the lower triangle is
/// read. `None` for what holds no numbers.
pub fn symmetric_eigen(a: &Array2<f64>) -> Option<(Vec<f64>, Array2<f64>)> {
    let eigen = of(a).self_adjoint_eigen(Side::Lower).ok()?;
    let n = a.nrows();
    Some(((0..n).map(|i| eigen.S()[i]).collect(), Array2::from_shape_fn((n, n), |(i, j)| eigen.U()[(i, j)])))
}

/// Eigenvalues of a square matrix, in no order; `None` for what holds no numbers.
///
/// ```
/// use ndarray::array;
/// let mut found = ndof_linear::eigenvalues(&array![[0.0, 1.0], [-25.0, -6.0]]).ok_or("no numbers")?;
/// found.sort_by(|a, b| a.im.total_cmp(&b.im));
/// assert!((found[1] - num_complex::Complex64::new(-3.0, 4.0)).norm() < 1e-13);
/// # Ok::<(), &str>(())
/// ```
pub fn eigenvalues(a: &Array2<f64>) -> Option<Vec<Complex64>> {
    of(a).eigenvalues().ok()
}

/// Singular values, largest first; `None` for what holds no numbers.
pub fn singular_values(a: &Array2<f64>) -> Option<Vec<f64>> {
    of(a).singular_values().ok()
}

/// Share of the largest column that sums of a thousand products leave where the truth is nought.
const ROUND_OFF: f64 = 1e-13;

/// The columns of A that are no combination of those before them, and how every column follows from them: A = A[:, kept] · shares, kept ×
/// columns. A column counts as a combination where less than `tolerance` of its norm is left beside the columns before it, and as nought where
/// its norm is round-off of the largest.
///
/// By Gram-Schmidt orthogonalisation, twice (Golub & Van Loan, Matrix Computations, 4th ed., section 5.2.9).
pub fn independent_columns(a: &Array2<f64>, tolerance: f64) -> (Vec<usize>, Array2<f64>) {
    let n = a.ncols();
    let norms: Vec<f64> = a.columns().into_iter().map(|c| c.dot(&c).sqrt()).collect();
    let nought = ROUND_OFF * norms.iter().fold(0.0, |s: f64, v| s.max(*v));
    let (mut kept, mut basis) = (Vec::new(), Vec::<Array1<f64>>::new());
    // Column by column: its components along the basis, the last one along its own rest.
    let mut components: Vec<Vec<f64>> = Vec::new();
    for (j, column) in a.columns().into_iter().enumerate() {
        let mut rest = column.to_owned();
        let mut along = vec![0.0; basis.len()];
        for _ in 0..2 {
            for (sum, direction) in along.iter_mut().zip(&basis) {
                let part = direction.dot(&rest);
                *sum += part;
                rest.scaled_add(-part, direction);
            }
        }
        let left = rest.dot(&rest).sqrt();
        if norms[j] > nought && left > tolerance * norms[j] {
            kept.push(j);
            along.push(left);
            basis.push(rest / left);
        }
        components.push(along);
    }
    let mut shares = Array2::zeros((kept.len(), n));
    for (j, along) in components.iter().enumerate() {
        // The triangle of the kept columns, solved from below.
        for i in (0..along.len()).rev() {
            let known: f64 = (i + 1..along.len()).map(|k| components[kept[k]][i] * shares[[k, j]]).sum();
            shares[[i, j]] = (along[i] - known) / components[kept[i]][i];
        }
    }
    (kept, shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn a_spectrum_puts_its_matrix_together_again() {
        let a = array![[4.0, 1.0, -2.0], [1.0, 3.0, 0.5], [-2.0, 0.5, 1.0]];
        let (values, vectors) = symmetric_eigen(&a).expect("finite");
        assert!((vectors.dot(&Array2::from_diag(&Array1::from(values.clone()))).dot(&vectors.t()) - &a).iter().all(|v| v.abs() < 1e-14));
        assert!(values.windows(2).all(|v| v[0] <= v[1]));
        let values = singular_values(&array![[3.0, 0.0], [0.0, -4.0], [0.0, 0.0]]).expect("finite");
        assert!((values[0] - 4.0).abs() < 1e-14 && (values[1] - 3.0).abs() < 1e-14);
    }

    #[test]
    fn kept_columns_make_all_others() {
        let a = Array2::from_shape_fn((6, 5), |(i, j)| match j {
            3 => 2.0 * ((i * i) as f64).sin() - ((i + 7) as f64).cos(),
            4 => 0.0,
            0 => ((i * i) as f64).sin(),
            1 => ((i + 7) as f64).cos(),
            _ => 1.0 + i as f64,
        });
        let (kept, shares) = independent_columns(&a, 1e-12);
        assert_eq!(kept, [0, 1, 2]);
        let chosen = Array2::from_shape_fn((6, 3), |(i, k)| a[[i, kept[k]]]);
        assert!((chosen.dot(&shares) - &a).iter().all(|v| v.abs() < 1e-13));
    }
}
