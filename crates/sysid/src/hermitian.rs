//! Small Hermitian positive definite systems of any size, without allocation after the workspace is made.

use num_complex::Complex64;

/// A pivot below this share of its own diagonal entry is round-off: the rows before it explain everything.
pub(crate) const SMALLEST_PIVOT: f64 = 1e-14;

/// S = L Lᴴ, with L lower triangular. Reused from one frequency to the next.
#[derive(Clone, Debug)]
pub(crate) struct Cholesky {
    n: usize,
    lower: Vec<Complex64>,
}

impl Cholesky {
    /// A workspace for `n` × `n` systems.
    pub(crate) fn new(n: usize) -> Self {
        Cholesky { n, lower: vec![Complex64::default(); n * n] }
    }

    /// Factors the matrix whose lower triangle is `entry(i, j ≤ i)`; false if it is not positive definite.
    pub(crate) fn factor(&mut self, entry: impl Fn(usize, usize) -> Complex64) -> bool {
        let n = self.n;
        for j in 0..n {
            let diagonal = entry(j, j).re;
            let pivot = diagonal - self.lower[j * n..j * n + j].iter().map(|v| v.norm_sqr()).sum::<f64>();
            if !(pivot > SMALLEST_PIVOT * diagonal && pivot.is_finite()) {
                return false;
            }
            let root = pivot.sqrt();
            self.lower[j * n + j] = Complex64::new(root, 0.0);
            for i in j + 1..n {
                let mut sum = entry(i, j);
                for k in 0..j {
                    sum -= self.lower[i * n + k] * self.lower[j * n + k].conj();
                }
                self.lower[i * n + j] = sum / root;
            }
        }
        true
    }

    /// Turns the row b into b L⁻ᴴ, so that ‖b L⁻ᴴ‖² = b S⁻¹ bᴴ.
    pub(crate) fn whiten(&self, row: &mut [Complex64]) {
        let n = self.n;
        for j in 0..n {
            let (known, rest) = row.split_at_mut(j);
            let sum = known.iter().zip(&self.lower[j * n..]).fold(rest[0], |sum, (r, l)| sum - r * l.conj());
            rest[0] = sum / self.lower[j * n + j].re;
        }
    }

    /// Turns the row w into w L⁻¹; after [`whiten`](Self::whiten) this gives b S⁻¹.
    pub(crate) fn unwhiten(&self, row: &mut [Complex64]) {
        let n = self.n;
        for j in (0..n).rev() {
            let (rest, known) = row.split_at_mut(j + 1);
            let column = self.lower[j * n + j..].iter().step_by(n);
            let sum = known.iter().zip(column.skip(1)).fold(rest[j], |sum, (r, l)| sum - r * l);
            rest[j] = sum / self.lower[j * n + j].re;
        }
    }

    /// Writes S⁻¹, row by row, to `inverse` (n² entries).
    pub(crate) fn inverse(&self, inverse: &mut [Complex64]) {
        inverse.fill(Complex64::default());
        for (i, row) in inverse.chunks_exact_mut(self.n).enumerate() {
            row[i] = Complex64::new(1.0, 0.0);
            self.whiten(row);
            self.unwhiten(row);
        }
    }
}

/// Eigenvalues of a small Hermitian matrix, in `values` unordered, by cyclic Jacobi rotations of `matrix` (n², row by
/// row, destroyed). With `vectors` (n²) its columns become the eigenvectors.
///
/// Golub & Van Loan, Matrix Computations, 4th ed., section 8.5.
pub(crate) fn eigen(matrix: &mut [Complex64], values: &mut [f64], mut vectors: Option<&mut [Complex64]>) {
    let n = values.len();
    if let Some(v) = vectors.as_deref_mut() {
        v.fill(Complex64::default());
        (0..n).for_each(|i| v[i * n + i] = Complex64::new(1.0, 0.0));
    }
    let size: f64 = matrix.iter().map(|v| v.norm_sqr()).sum();
    for _ in 0..30 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| matrix[i * n + j].norm_sqr()).sum();
        if off.is_nan() || off <= size * 1e-30 {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let a = matrix[p * n + q];
                let r = a.norm();
                if r == 0.0 {
                    continue;
                }
                let phase = a / r;
                let theta = (matrix[q * n + q].re - matrix[p * n + p].re) / (2.0 * r);
                let t = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = phase * (t * c);
                let rotate_columns = |m: &mut [Complex64]| {
                    for k in 0..n {
                        let (x, y) = (m[k * n + p], m[k * n + q]);
                        m[k * n + p] = x * c - y * s.conj();
                        m[k * n + q] = x * s + y * c;
                    }
                };
                rotate_columns(matrix);
                for k in 0..n {
                    let (x, y) = (matrix[p * n + k], matrix[q * n + k]);
                    matrix[p * n + k] = x * c - y * s;
                    matrix[q * n + k] = x * s.conj() + y * c;
                }
                if let Some(v) = vectors.as_deref_mut() {
                    rotate_columns(v);
                }
            }
        }
    }
    (0..n).for_each(|i| values[i] = matrix[i * n + i].re);
}

/// 1-norm condition number of S scaled to a unit diagonal, from S and S⁻¹ (n², row by row); see
/// [`lanes::condition`](crate::lanes::condition).
pub(crate) fn scaled_condition(n: usize, entry: impl Fn(usize, usize) -> Complex64, inverse: &[Complex64]) -> f64 {
    let largest = |size: &dyn Fn(usize, usize) -> f64| (0..n).map(|j| (0..n).map(|i| size(i, j)).sum::<f64>()).fold(0.0_f64, f64::max);
    let scale = |i: usize, j: usize| (entry(i, i).re * entry(j, j).re).sqrt();
    largest(&|i, j| entry(i, j).norm() / scale(i, j)) * largest(&|i, j| inverse[i * n + j].norm() * scale(i, j))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// n draws of a random n-vector plus a little identity: positive definite, of moderate condition.
    fn random_positive(n: usize, rng: &mut ChaCha8Rng) -> Vec<Complex64> {
        let x: Vec<Complex64> = (0..2 * n * n).map(|_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))).collect();
        (0..n * n).map(|ij| (0..2 * n).map(|k| x[(ij / n) * 2 * n + k] * x[(ij % n) * 2 * n + k].conj()).sum()).collect()
    }

    #[test]
    fn solving_and_inverting_agree_with_the_definition() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in 1..=12 {
            let s = random_positive(n, &mut rng);
            let mut cholesky = Cholesky::new(n);
            assert!(cholesky.factor(|i, j| s[i * n + j]));
            let mut inverse = vec![Complex64::default(); n * n];
            cholesky.inverse(&mut inverse);
            for i in 0..n {
                for j in 0..n {
                    let product: Complex64 = (0..n).map(|k| inverse[i * n + k] * s[k * n + j]).sum();
                    assert!((product - f64::from(u8::from(i == j))).norm() < 1e-11, "n = {n}: {product}");
                }
            }
        }
    }

    #[test]
    fn an_indefinite_or_singular_matrix_is_refused() {
        let real = |v: [f64; 4]| move |i: usize, j: usize| Complex64::new(v[2 * i + j], 0.0);
        assert!(!Cholesky::new(2).factor(real([1.0, 2.0, 2.0, 1.0])));
        assert!(!Cholesky::new(2).factor(real([1.0, 1.0, 1.0, 1.0])));
        assert!(!Cholesky::new(2).factor(real([-4.0, 0.0, 0.0, -4.0])));
        assert!(!Cholesky::new(2).factor(real([f64::NAN, 0.0, 0.0, 1.0])));
    }

    #[test]
    fn eigenvectors_diagonalise() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for n in 1..=9 {
            let s = random_positive(n, &mut rng);
            let (mut work, mut values, mut vectors) = (s.clone(), vec![0.0; n], vec![Complex64::default(); n * n]);
            eigen(&mut work, &mut values, Some(&mut vectors));
            for k in 0..n {
                for i in 0..n {
                    let product: Complex64 = (0..n).map(|j| s[i * n + j] * vectors[j * n + k]).sum();
                    assert!((product - vectors[i * n + k] * values[k]).norm() < 1e-11, "n = {n}");
                }
            }
        }
    }
}
