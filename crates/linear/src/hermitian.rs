//! Eigenvalues of small Hermitian matrices.

use crate::Scalar;
use num_complex::Complex64;

/// Sweeps after which the rotations end whatever is left: they converge quadratically and need five or six.
const SWEEPS: usize = 30;

/// Eigenvalues of a small Hermitian matrix, in `values` unordered, by cyclic Jacobi rotations of `matrix` (n², row by row, destroyed). With
/// `vectors` (n²) its columns become the eigenvectors.
///
/// Golub & Van Loan, Matrix Computations, 4th ed., section 8.5.
pub fn hermitian_eigen(matrix: &mut [Complex64], values: &mut [f64], mut vectors: Option<&mut [Complex64]>) {
    let n = values.len();
    if let Some(v) = vectors.as_deref_mut() {
        v.fill(Complex64::default());
        v.iter_mut().step_by(n + 1).for_each(|one| *one = Complex64::ONE);
    }
    let size: f64 = matrix.iter().map(|v| v.norm_sqr()).sum();
    for _ in 0..SWEEPS {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| matrix[i * n + j].norm_sqr()).sum();
        if off.is_nan() || off <= size * 1e-30 {
            break;
        }
        for (p, q) in (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))) {
            if let Some(turn) = Rotation::new(matrix, n, p, q) {
                turn.columns(matrix, n);
                turn.rows(matrix, n);
                if let Some(v) = vectors.as_deref_mut() {
                    turn.columns(v, n);
                }
            }
        }
    }
    (0..n).for_each(|i| values[i] = matrix[i * n + i].re);
}

/// The rotation in the plane of two axes that makes their entry nought.
struct Rotation {
    p: usize,
    q: usize,
    cosine: f64,
    sine: Complex64,
}

impl Rotation {
    /// `None` where the entry is nought already.
    fn new(matrix: &[Complex64], n: usize, p: usize, q: usize) -> Option<Self> {
        let entry = matrix[p * n + q];
        let size = entry.norm();
        if size == 0.0 {
            return None;
        }
        let theta = (matrix[q * n + q].re - matrix[p * n + p].re) / (2.0 * size);
        let tangent = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
        let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
        Some(Rotation { p, q, cosine, sine: entry / size * (tangent * cosine) })
    }

    fn columns(&self, matrix: &mut [Complex64], n: usize) {
        for row in matrix.chunks_exact_mut(n) {
            let (x, y) = (row[self.p], row[self.q]);
            row[self.p] = x * self.cosine - y * self.sine.conj();
            row[self.q] = x * self.sine + y * self.cosine;
        }
    }

    fn rows(&self, matrix: &mut [Complex64], n: usize) {
        for k in 0..n {
            let (x, y) = (matrix[self.p * n + k], matrix[self.q * n + k]);
            matrix[self.p * n + k] = x * self.cosine - y * self.sine;
            matrix[self.q * n + k] = x * self.sine.conj() + y * self.cosine;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn eigenvectors_diagonalise() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for n in 1..=9 {
            let x: Vec<Complex64> = (0..n * n).map(|_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))).collect();
            let s: Vec<Complex64> = (0..n * n).map(|e| x[e] + Scalar::conj(x[e % n * n + e / n])).collect();
            let (mut work, mut values, mut vectors) = (s.clone(), vec![0.0; n], vec![Complex64::default(); n * n]);
            hermitian_eigen(&mut work, &mut values, Some(&mut vectors));
            for k in 0..n {
                for i in 0..n {
                    let product: Complex64 = (0..n).map(|j| s[i * n + j] * vectors[j * n + k]).sum();
                    assert!((product - vectors[i * n + k] * values[k]).norm() < 1e-12, "n = {n}");
                }
            }
        }
    }
}
