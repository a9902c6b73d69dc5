//! Hermitian positive definite systems of any size, without allocation after the workspace is made.

use crate::Scalar;

/// A pivot below this share of its own diagonal entry is round-off: the rows before it explain everything.
pub const SMALLEST_PIVOT: f64 = 1e-14;

/// Replaces the lower triangle of the Hermitian A (n × n, row by row) by L of A = L Lᴴ; false, with `a` spoilt, if A is not positive definite.
#[inline]
pub fn cholesky_in_place<T: Scalar>(a: &mut [T], n: usize) -> bool {
    for j in 0..n {
        let diagonal = a[j * n + j].re();
        let pivot = diagonal - a[j * n..j * n + j].iter().map(|v| v.norm_sqr()).sum::<f64>();
        if !(pivot > SMALLEST_PIVOT * diagonal && pivot.is_finite()) {
            return false;
        }
        let root = pivot.sqrt();
        a[j * n + j] = T::from(root);
        for i in j + 1..n {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k].conj();
            }
            a[i * n + j] = sum / root;
        }
    }
    true
}

/// Turns b into x of A x = b, `factor` being what [`cholesky_in_place`] made of A.
#[inline]
pub fn cholesky_solve<T: Scalar>(factor: &[T], n: usize, b: &mut [T]) {
    for i in 0..n {
        let mut sum = b[i];
        for k in 0..i {
            sum -= factor[i * n + k] * b[k];
        }
        b[i] = sum / factor[i * n + i].re();
    }
    for i in (0..n).rev() {
        let mut sum = b[i];
        for k in i + 1..n {
            sum -= factor[k * n + i].conj() * b[k];
        }
        b[i] = sum / factor[i * n + i].re();
    }
}

/// S = L Lᴴ, with L lower triangular. Reused from one frequency to the next.
///
/// ```
/// let mut system = ndof_linear::Cholesky::new(2);
/// assert!(system.factor(|i, j| [[4.0, 1.0], [1.0, 3.0]][i][j]));
/// let mut x = [1.0, 2.0];
/// system.solve(&mut x);
/// assert!((4.0 * x[0] + x[1] - 1.0_f64).abs() < 1e-15);
/// assert!(!system.factor(|i, j| [[1.0, 2.0], [2.0, 1.0]][i][j]), "indefinite");
/// ```
#[derive(Clone, Debug)]
pub struct Cholesky<T> {
    n: usize,
    lower: Vec<T>,
}

impl<T: Scalar> Cholesky<T> {
    /// A workspace for `n` × `n` systems.
    pub fn new(n: usize) -> Self {
        Cholesky { n, lower: vec![T::default(); n * n] }
    }

    /// The factor of S, row by row; `None` if it is not positive definite.
    pub fn of(s: &[T], n: usize) -> Option<Self> {
        let mut cholesky = Cholesky::new(n);
        cholesky.factor(|i, j| s[i * n + j]).then_some(cholesky)
    }

    /// Factors the matrix whose lower triangle is `entry(i, j ≤ i)`; false if it is not positive definite.
    #[inline]
    pub fn factor(&mut self, entry: impl Fn(usize, usize) -> T) -> bool {
        let n = self.n;
        for i in 0..n {
            (0..=i).for_each(|j| self.lower[i * n + j] = entry(i, j));
        }
        cholesky_in_place(&mut self.lower, n)
    }

    /// L, row by row; what stands above its diagonal is nought.
    pub fn lower(&self) -> &[T] {
        &self.lower
    }

    /// Turns b into S⁻¹ b.
    pub fn solve(&self, b: &mut [T]) {
        cholesky_solve(&self.lower, self.n, b);
    }

    /// Turns the row b into b L⁻ᴴ, so that ‖b L⁻ᴴ‖² = b S⁻¹ bᴴ.
    #[inline]
    pub fn whiten(&self, row: &mut [T]) {
        let n = self.n;
        for j in 0..n {
            let (known, rest) = row.split_at_mut(j);
            let sum = known.iter().zip(&self.lower[j * n..]).fold(rest[0], |sum, (r, l)| sum - *r * l.conj());
            rest[0] = sum / self.lower[j * n + j].re();
        }
    }

    /// Turns the row w into w L⁻¹; after [`whiten`](Self::whiten) this gives b S⁻¹.
    #[inline]
    pub fn unwhiten(&self, row: &mut [T]) {
        let n = self.n;
        for j in (0..n).rev() {
            let (rest, known) = row.split_at_mut(j + 1);
            let column = self.lower[j * n + j..].iter().step_by(n);
            let sum = known.iter().zip(column.skip(1)).fold(rest[j], |sum, (r, l)| sum - *r * *l);
            rest[j] = sum / self.lower[j * n + j].re();
        }
    }

    /// Writes S⁻¹, row by row, to `inverse` (n² entries).
    pub fn inverse(&self, inverse: &mut [T]) {
        self.each_row(inverse, |row| {
            self.whiten(row);
            self.unwhiten(row);
        });
    }

    /// L⁻¹, row by row: L⁻¹ S L⁻ᴴ = 1.
    pub fn whitener(&self) -> Vec<T> {
        let mut out = vec![T::default(); self.n * self.n];
        self.each_row(&mut out, |row| self.unwhiten(row));
        out
    }

    /// Writes the rows of the identity, each turned by `by`.
    fn each_row(&self, out: &mut [T], by: impl Fn(&mut [T])) {
        out.fill(T::default());
        for (i, row) in out.chunks_exact_mut(self.n).enumerate() {
            row[i] = T::ONE;
            by(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::square::{adjoint, identity, product};
    use num_complex::Complex64;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// 2 n draws of a random n-vector: positive definite, of moderate condition.
    fn random_positive(n: usize, rng: &mut ChaCha8Rng) -> Vec<Complex64> {
        let x: Vec<Complex64> = (0..2 * n * n).map(|_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))).collect();
        (0..n * n).map(|ij| (0..2 * n).map(|k| x[(ij / n) * 2 * n + k] * x[(ij % n) * 2 * n + k].conj()).sum()).collect()
    }

    #[test]
    fn factor_inverse_whitener_and_solution_agree_with_their_definitions() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in 1..=12 {
            let s = random_positive(n, &mut rng);
            let mut cholesky = Cholesky::new(n);
            assert!(cholesky.factor(|i, j| s[i * n + j]));
            let near = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).all(|(a, b)| (a - b).norm() < 1e-11);
            assert!(near(&product(cholesky.lower(), &adjoint(cholesky.lower(), n), n), &s));
            let mut inverse = vec![Complex64::default(); n * n];
            cholesky.inverse(&mut inverse);
            assert!(near(&product(&inverse, &s, n), &identity(n)), "n = {n}");
            let white = cholesky.whitener();
            assert!(near(&product(&product(&white, &s, n), &adjoint(&white, n), n), &identity(n)), "n = {n}");
            let mut column: Vec<Complex64> = (0..n).map(|i| s[i * n]).collect();
            cholesky.solve(&mut column);
            assert!(near(&column, &identity(n)[..n]), "n = {n}");
        }
    }

    #[test]
    fn an_indefinite_or_singular_matrix_is_refused() {
        let real = |v: [f64; 4]| move |i: usize, j: usize| Complex64::new(v[2 * i + j], 0.0);
        for refused in [[1.0, 2.0, 2.0, 1.0], [1.0; 4], [-4.0, 0.0, 0.0, -4.0], [f64::NAN, 0.0, 0.0, 1.0]] {
            assert!(!Cholesky::new(2).factor(real(refused)), "{refused:?}");
            assert!(!cholesky_in_place(&mut refused.clone(), 2), "{refused:?}");
        }
    }
}
