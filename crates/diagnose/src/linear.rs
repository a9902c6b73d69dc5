//! Small dense systems: real symmetric ones and complex ones.

use num_complex::Complex64;

/// A symmetric positive definite matrix by rows, and its Cholesky factor once made.
#[derive(Clone, Debug)]
pub(crate) struct Symmetric {
    pub n: usize,
    pub a: Vec<f64>,
}

impl Symmetric {
    pub fn zeros(n: usize) -> Self {
        Symmetric { n, a: vec![0.0; n * n] }
    }

    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.a[i * self.n + j] += value;
        if i != j {
            self.a[j * self.n + i] += value;
        }
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.a[i * self.n + j]
    }

    /// The Cholesky factor of the matrix scaled to unit diagonal, with a ridge of 1e-12; `None` if it is not positive definite.
    pub fn factor(&self) -> Option<Factor> {
        let n = self.n;
        let scale: Vec<f64> = (0..n).map(|i| if self.at(i, i) > 0.0 { 1.0 / self.at(i, i).sqrt() } else { 1.0 }).collect();
        let mut l = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.at(i, j) * scale[i] * scale[j] + if i == j { 1e-12 } else { 0.0 };
                for k in 0..j {
                    sum -= l[i * n + k] * l[j * n + k];
                }
                if i == j {
                    if sum.is_nan() || sum <= 0.0 {
                        return None;
                    }
                    l[i * n + i] = sum.sqrt();
                } else {
                    l[i * n + j] = sum / l[j * n + j];
                }
            }
        }
        Some(Factor { n, l, scale })
    }
}

/// A Cholesky factor.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    n: usize,
    l: Vec<f64>,
    scale: Vec<f64>,
}

impl Factor {
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let n = self.n;
        let mut x: Vec<f64> = b.iter().zip(&self.scale).map(|(b, s)| b * s).collect();
        for i in 0..n {
            for k in 0..i {
                x[i] -= self.l[i * n + k] * x[k];
            }
            x[i] /= self.l[i * n + i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] -= self.l[k * n + i] * x[k];
            }
            x[i] /= self.l[i * n + i];
        }
        x.iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
        x
    }

    pub fn inverse(&self) -> Symmetric {
        let mut out = Symmetric::zeros(self.n);
        for j in 0..self.n {
            let mut unit = vec![0.0; self.n];
            unit[j] = 1.0;
            for (i, value) in self.solve(&unit).into_iter().enumerate() {
                out.a[i * self.n + j] = value;
            }
        }
        out
    }
}

/// ln |det| and the inverse of a complex n × n matrix by rows; `None` where it is singular.
pub(crate) fn inverse(matrix: &[Complex64], n: usize) -> Option<(f64, Vec<Complex64>)> {
    let mut a = matrix.to_vec();
    let mut inv = vec![Complex64::ZERO; n * n];
    invert_into(&mut a, &mut inv, n).map(|log_det| (log_det, inv))
}

/// ln |det| of `a`, which is used up, and its inverse written to `inv`; `None` where it is singular.
pub(crate) fn invert_into(a: &mut [Complex64], inv: &mut [Complex64], n: usize) -> Option<f64> {
    if n == 1 {
        let power = a[0].norm_sqr();
        inv[0] = a[0].conj() / power;
        return (power > 0.0 && power.is_finite()).then(|| 0.5 * power.ln());
    }
    if n == 2 {
        let det = a[0] * a[3] - a[1] * a[2];
        let power = det.norm_sqr();
        let back = det.conj() / power;
        (inv[0], inv[1], inv[2], inv[3]) = (a[3] * back, -a[1] * back, -a[2] * back, a[0] * back);
        return (power > 0.0 && power.is_finite()).then(|| 0.5 * power.ln());
    }
    inv.iter_mut().enumerate().for_each(|(k, v)| *v = if k / n == k % n { Complex64::ONE } else { Complex64::ZERO });
    let mut log_det = 0.0;
    for col in 0..n {
        let pivot = (col..n).max_by(|&i, &j| a[i * n + col].norm_sqr().total_cmp(&a[j * n + col].norm_sqr()))?;
        let power = a[pivot * n + col].norm_sqr();
        if power.is_nan() || power <= 0.0 {
            return None;
        }
        log_det += 0.5 * power.ln();
        if pivot != col {
            for k in 0..n {
                a.swap(pivot * n + k, col * n + k);
                inv.swap(pivot * n + k, col * n + k);
            }
        }
        let scale = a[col * n + col].conj() / power;
        for k in 0..n {
            a[col * n + k] *= scale;
            inv[col * n + k] *= scale;
        }
        for row in 0..n {
            let factor = a[row * n + col];
            if row != col && factor != Complex64::ZERO {
                for k in 0..n {
                    let (u, w) = (a[col * n + k], inv[col * n + k]);
                    a[row * n + k] -= factor * u;
                    inv[row * n + k] -= factor * w;
                }
            }
        }
    }
    Some(log_det)
}

/// Product of two complex n × n matrices by rows.
pub(crate) fn product(a: &[Complex64], b: &[Complex64], n: usize) -> Vec<Complex64> {
    let mut out = vec![Complex64::ZERO; n * n];
    add_product(a, b, n, &mut out);
    out
}

/// Adds the product of two complex n × n matrices by rows.
pub(crate) fn add_product(a: &[Complex64], b: &[Complex64], n: usize, out: &mut [Complex64]) {
    for i in 0..n {
        for k in 0..n {
            let f = a[i * n + k];
            if f != Complex64::ZERO {
                for j in 0..n {
                    out[i * n + j] += f * b[k * n + j];
                }
            }
        }
    }
}

/// Σ a b, in eight lanes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            lanes[k] += x[k] * y[k];
        }
    }
    lanes.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_solves_and_inverts() {
        let mut m = Symmetric::zeros(3);
        for (i, j, v) in [(0, 0, 4.0), (0, 1, 1.0), (1, 1, 3e-6), (1, 2, 1e-4), (2, 2, 2.0)] {
            m.add(i, j, if i == 0 && j == 1 { v * 1e-3 } else { v });
        }
        let x = m.factor().expect("positive definite").solve(&[1.0, 2.0, 3.0]);
        for (i, want) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            let got: f64 = (0..3).map(|j| m.at(i, j) * x[j]).sum();
            assert!((got - want).abs() < 1e-9, "{i}: {got}");
        }
        m.a[0] = -1.0;
        assert!(m.factor().is_none());
    }

    #[test]
    fn a_complex_inverse_times_its_matrix_is_one() {
        let m: Vec<Complex64> = (0..9).map(|k| Complex64::new(f64::from(k * k % 7) + 0.5, f64::from(k % 4) - 1.0)).collect();
        let (log_det, inv) = inverse(&m, 3).expect("regular");
        let one = product(&m, &inv, 3);
        for (k, value) in one.iter().enumerate() {
            let want = if k / 3 == k % 3 { 1.0 } else { 0.0 };
            assert!((value - want).norm() < 1e-12);
        }
        assert!(log_det.is_finite());
    }
}
