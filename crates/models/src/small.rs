//! Small dense complex matrices as row-major slices: the inner loop of every fit.

use num_complex::Complex64;

/// out = a b, for a of n × k and b of k × m.
pub(crate) fn multiply(a: &[Complex64], b: &[Complex64], n: usize, k: usize, m: usize, out: &mut [Complex64]) {
    for i in 0..n {
        for j in 0..m {
            out[i * m + j] = (0..k).map(|l| a[i * k + l] * b[l * m + j]).sum();
        }
    }
}

/// a b of two n × n matrices.
pub(crate) fn product(a: &[Complex64], b: &[Complex64], n: usize) -> Vec<Complex64> {
    let mut out = vec![Complex64::default(); n * n];
    multiply(a, b, n, n, n, &mut out);
    out
}

/// left · d · right of n × n matrices, for a d that is mostly nought: what derivatives of models are.
pub(crate) fn sandwich(left: &[Complex64], d: &[Complex64], right: &[Complex64], n: usize) -> Vec<Complex64> {
    let mut out = vec![Complex64::default(); n * n];
    if d.iter().filter(|v| **v != Complex64::default()).count() > 2 * n {
        return product(&product(left, d, n), right, n);
    }
    for (e, v) in d.iter().enumerate().filter(|(_, v)| **v != Complex64::default()) {
        let row = &right[(e % n) * n..(e % n + 1) * n];
        for i in 0..n {
            let factor = left[i * n + e / n] * v;
            out[i * n..(i + 1) * n].iter_mut().zip(row).for_each(|(o, r)| *o += factor * r);
        }
    }
    out
}

/// The inverse of an n × n matrix by Gauss-Jordan elimination with row pivoting; `None` if singular or not finite.
pub(crate) fn inverse(a: &[Complex64], n: usize) -> Option<Vec<Complex64>> {
    let mut left = a.to_vec();
    let mut right = identity(n);
    let scale = a.iter().map(|v| v.norm()).fold(0.0, f64::max);
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| left[i * n + column].norm_sqr().total_cmp(&left[j * n + column].norm_sqr()))?;
        let size = left[pivot * n + column].norm();
        if !size.is_finite() || size <= scale * f64::EPSILON {
            return None;
        }
        for k in 0..n {
            left.swap(column * n + k, pivot * n + k);
            right.swap(column * n + k, pivot * n + k);
        }
        let factor = left[column * n + column].inv();
        for k in 0..n {
            left[column * n + k] *= factor;
            right[column * n + k] *= factor;
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = left[row * n + column];
            for k in 0..n {
                let (l, r) = (left[column * n + k] * factor, right[column * n + k] * factor);
                left[row * n + k] -= l;
                right[row * n + k] -= r;
            }
        }
    }
    Some(right)
}

/// The identity.
pub(crate) fn identity(n: usize) -> Vec<Complex64> {
    let mut out = vec![Complex64::default(); n * n];
    (0..n).for_each(|i| out[i * n + i] = Complex64::new(1.0, 0.0));
    out
}

/// Conjugate transpose of an n × n matrix.
pub(crate) fn adjoint(a: &[Complex64], n: usize) -> Vec<Complex64> {
    (0..n * n).map(|i| a[(i % n) * n + i / n].conj()).collect()
}

/// L⁻¹ of the Cholesky factor A = L Lᴴ of a Hermitian positive definite matrix; `None` if it is not.
pub(crate) fn inverse_cholesky(a: &[Complex64], n: usize) -> Option<Vec<Complex64>> {
    let mut l = vec![Complex64::default(); n * n];
    for j in 0..n {
        let pivot = a[j * n + j].re - (0..j).map(|k| l[j * n + k].norm_sqr()).sum::<f64>();
        if !(pivot.is_finite() && pivot > a[j * n + j].re * f64::EPSILON * n as f64) {
            return None;
        }
        let root = pivot.sqrt();
        l[j * n + j] = Complex64::new(root, 0.0);
        for i in j + 1..n {
            let sum: Complex64 = (0..j).map(|k| l[i * n + k] * l[j * n + k].conj()).sum();
            l[i * n + j] = (a[i * n + j] - sum) / root;
        }
    }
    inverse(&l, n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sandwich_of_few_entries_is_that_of_all() {
        let entry = |k: usize| Complex64::new((k as f64).sin(), (2.0 * k as f64).cos());
        let (left, right): (Vec<_>, Vec<_>) = (0..9).map(|k| (entry(k), entry(k + 20))).unzip();
        for few in [1, 2, 9] {
            let d: Vec<Complex64> = (0..9).map(|k| if k % 4 < few { entry(k + 50) } else { Complex64::default() }).collect();
            let dense = product(&product(&left, &d, 3), &right, 3);
            assert!(sandwich(&left, &d, &right, 3).iter().zip(&dense).all(|(a, b)| (a - b).norm() < 1e-14));
        }
    }

    #[test]
    fn the_cholesky_factor_whitens() {
        let c = Complex64::new;
        let a = [c(4.0, 0.0), c(1.0, 1.0), c(1.0, -1.0), c(3.0, 0.0)];
        let whitener = inverse_cholesky(&a, 2).expect("positive definite");
        let white = product(&product(&whitener, &a, 2), &adjoint(&whitener, 2), 2);
        assert!(white.iter().zip(identity(2)).all(|(w, i)| (w - i).norm() < 1e-15));
        assert!(inverse_cholesky(&[c(-1.0, 0.0)], 1).is_none());
        assert!(inverse(&[c(1.0, 0.0), c(2.0, 0.0), c(2.0, 0.0), c(4.0, 0.0)], 2).is_none());
    }
}
