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

/// Eigenvalues of any square matrix and its eigenvectors as columns; `None` for what holds no numbers.
pub fn eigen(a: &Array2<f64>) -> Option<(Vec<Complex64>, Array2<Complex64>)> {
    let found = a.iter().all(|v| v.is_finite()).then(|| of(a).eigen().ok())??;
    let (n, number) = (a.nrows(), |z: faer::c64| Complex64::new(z.re, z.im));
    Some(((0..n).map(|k| number(found.S()[k])).collect(), Array2::from_shape_fn((n, n), |(i, k)| number(found.U()[(i, k)]))))
}

/// Singular values, largest first; `None` for what holds no numbers.
pub fn singular_values(a: &Array2<f64>) -> Option<Vec<f64>> {
    of(a).singular_values().ok()
}

/// What a linear least-squares problem says.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The x that minimises ‖A x − b‖; directions that A leaves open stay at nought, each column measured in its own norm.
    pub solution: Vec<f64>,
    /// (AᵀA)⁻¹ over the directions that A determines; times the variance of b it is the covariance of x.
    pub covariance: Array2<f64>,
    /// Number of those directions.
    pub rank: usize,
    /// ‖A x − b‖².
    pub residual: f64,
    /// Largest over smallest singular value of A with columns of unit norm.
    pub condition: f64,
}

/// A singular value below this share of the largest is an open direction.
const OPEN: f64 = 1e-10;
/// Share of the largest column that sums of a thousand products leave where the truth is nought.
const ROUND_OFF: f64 = 1e-13;

/// Minimises ‖A x − b‖ by the singular value decomposition of A with its columns scaled to unit norm, so that the units of x do not matter.
/// `None` if lengths differ or a number is not finite.
pub fn least_squares(a: &Array2<f64>, b: &[f64]) -> Option<Solution> {
    let (rows, columns) = a.dim();
    if b.len() != rows || !a.iter().chain(b).all(|v| v.is_finite()) {
        return None;
    }
    let norms: Vec<f64> = a.columns().into_iter().map(|c| c.dot(&c).sqrt()).map(|norm| if norm > 0.0 { norm } else { f64::INFINITY }).collect();
    let svd = Mat::from_fn(rows, columns, |i, j| a[[i, j]] / norms[j]).thin_svd().ok()?;
    let (values, u, v) = (svd.S(), svd.U(), svd.V());
    let used: Vec<usize> = (0..rows.min(columns)).filter(|&k| values[k] > OPEN * values[0]).collect();
    let mut solution = vec![0.0; columns];
    let mut covariance = Array2::zeros((columns, columns));
    for &k in &used {
        let part = (0..rows).map(|i| u[(i, k)] * b[i]).sum::<f64>() / values[k];
        for r in 0..columns {
            solution[r] += v[(r, k)] * part / norms[r];
            for c in 0..columns {
                covariance[[r, c]] += v[(r, k)] * v[(c, k)] / (values[k] * values[k] * norms[r] * norms[c]);
            }
        }
    }
    let residual = a.outer_iter().zip(b).map(|(row, b)| (row.iter().zip(&solution).map(|(a, x)| a * x).sum::<f64>() - b).powi(2)).sum();
    let condition = if used.len() == columns { values[0] / values[columns - 1] } else { f64::INFINITY };
    Some(Solution { solution, covariance, rank: used.len(), residual, condition })
}

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
    fn eigenvectors_of_a_turn_are_turned_by_its_angle() {
        let turn = array![[0.6, -0.8], [0.8, 0.6]];
        let (values, vectors) = eigen(&turn).expect("finite");
        for (k, value) in values.iter().enumerate() {
            assert!((value.re - 0.6).abs() < 1e-15 && (value.im.abs() - 0.8).abs() < 1e-15);
            for i in 0..2 {
                let product: Complex64 = (0..2).map(|j| vectors[[j, k]] * turn[[i, j]]).sum();
                assert!((product - vectors[[i, k]] * value).norm() < 1e-15);
            }
        }
        assert!(eigen(&array![[f64::NAN]]).is_none());
    }

    #[test]
    fn least_squares_solve_the_normal_equations_in_any_unit() {
        let a = array![[1.0, 2e-6, 0.0], [1.0, -1e-6, 3.0], [1.0, 5e-6, 1.0], [1.0, 0.0, -2.0], [1.0, 1e-6, 0.5]];
        let b = [1.0, -2.0, 0.3, 4.0, 1.5];
        let found = least_squares(&a, &b).expect("finite");
        let rest: Vec<f64> = a.outer_iter().zip(b).map(|(row, b)| row.dot(&array![found.solution[0], found.solution[1], found.solution[2]]) - b).collect();
        for column in a.columns() {
            assert!(column.iter().zip(&rest).map(|(a, r)| a * r).sum::<f64>().abs() < 1e-13 * column.dot(&column).sqrt());
        }
        assert!((found.residual - rest.iter().map(|r| r * r).sum::<f64>()).abs() < 1e-14 && found.rank == 3);
        let one = a.t().dot(&a).dot(&found.covariance);
        // The condition of the unscaled normal equations is 1e12.
        assert!(one.indexed_iter().all(|((i, j), v)| i != j || (v - 1.0).abs() < 1e-9), "{one}");
    }

    #[test]
    fn an_open_direction_stays_at_nought_and_is_counted() {
        let found = least_squares(&array![[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.0]], &[2.0, 4.0, 1.0]).expect("finite");
        assert!((found.solution[0] - 1.0).abs() < 1e-14 && (found.solution[1] - 1.0).abs() < 1e-14 && found.solution[2] == 0.0);
        assert_eq!((found.rank, found.condition), (1, f64::INFINITY));
        assert!((found.residual - 1.0).abs() < 1e-14);
        assert!(least_squares(&array![[f64::NAN]], &[1.0]).is_none() && least_squares(&array![[1.0]], &[]).is_none());
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
