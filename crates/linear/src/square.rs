//! n × n matrices in rows of a slice: the inner loop of every fit.

use crate::Scalar;

/// The identity.
pub fn identity<T: Scalar>(n: usize) -> Vec<T> {
    let mut out = vec![T::default(); n * n];
    out.iter_mut().step_by(n + 1).for_each(|v| *v = T::ONE);
    out
}

/// Aᴴ, the conjugate transpose.
pub fn adjoint<T: Scalar>(a: &[T], n: usize) -> Vec<T> {
    (0..n * n).map(|i| a[(i % n) * n + i / n].conj()).collect()
}

/// A B.
pub fn product<T: Scalar>(a: &[T], b: &[T], n: usize) -> Vec<T> {
    let mut out = vec![T::default(); n * n];
    add_product(a, b, n, &mut out);
    out
}

/// Adds A B to `out`.
#[inline]
pub fn add_product<T: Scalar>(a: &[T], b: &[T], n: usize, out: &mut [T]) {
    add_rectangular(a, b, [n, n], out);
}

/// A B of an A with `inner` columns and a B with `columns`.
pub fn rectangular_product<T: Scalar>(a: &[T], b: &[T], [inner, columns]: [usize; 2]) -> Vec<T> {
    let mut out = vec![T::default(); a.len() / inner * columns];
    add_rectangular(a, b, [inner, columns], &mut out);
    out
}

#[inline]
fn add_rectangular<T: Scalar>(a: &[T], b: &[T], [inner, columns]: [usize; 2], out: &mut [T]) {
    match columns {
        2 => add_rows::<T, 2>(a, b, inner, out),
        3 => add_rows::<T, 3>(a, b, inner, out),
        4 => add_rows::<T, 4>(a, b, inner, out),
        6 => add_rows::<T, 6>(a, b, inner, out),
        _ => {
            for (row, out) in a.chunks_exact(inner).zip(out.chunks_exact_mut(columns)) {
                for (factor, b) in row.iter().zip(b.chunks_exact(columns)) {
                    out.iter_mut().zip(b).for_each(|(o, b)| *o += *factor * *b);
                }
            }
        }
    }
}

/// The same sums in the same order, of rows whose length the compiler knows.
#[inline]
fn add_rows<T: Scalar, const COLUMNS: usize>(a: &[T], b: &[T], inner: usize, out: &mut [T]) {
    let (b, _) = b.as_chunks::<COLUMNS>();
    for (row, out) in a.chunks_exact(inner).zip(out.as_chunks_mut::<COLUMNS>().0) {
        let mut sums = *out;
        for (factor, b) in row.iter().zip(b) {
            for k in 0..COLUMNS {
                sums[k] += *factor * b[k];
            }
        }
        *out = sums;
    }
}

/// A D B, for a D that is mostly nought: what derivatives of models are.
pub fn sandwich<T: Scalar>(a: &[T], d: &[T], b: &[T], n: usize) -> Vec<T> {
    let mut out = vec![T::default(); n * n];
    add_sandwich(T::ONE, [a, d, b], n, &mut out);
    out
}

/// Adds w A D B to `out`, as [`sandwich`] makes it.
pub fn add_sandwich<T: Scalar>(weight: T, [a, d, b]: [&[T]; 3], n: usize, out: &mut [T]) {
    let nought = T::default();
    if d.iter().filter(|v| **v != nought).count() > 2 * n {
        out.iter_mut().zip(product(&product(a, d, n), b, n)).for_each(|(o, v)| *o += weight * v);
        return;
    }
    match n {
        2 => add_sparse_sandwich(weight, [a, d, b], 2, out),
        6 => add_sparse_sandwich(weight, [a, d, b], 6, out),
        _ => add_sparse_sandwich(weight, [a, d, b], n, out),
    }
}

#[inline(always)]
fn add_sparse_sandwich<T: Scalar>(weight: T, [a, d, b]: [&[T]; 3], n: usize, out: &mut [T]) {
    let nought = T::default();
    for (column, of_row) in d.chunks_exact(n).enumerate() {
        for (v, row) in of_row.iter().zip(b.chunks_exact(n)).filter(|(v, _)| **v != nought) {
            for (left, out) in a.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
                let factor = weight * left[column] * *v;
                out.iter_mut().zip(row).for_each(|(o, r)| *o += factor * *r);
            }
        }
    }
}

/// A⁻¹; `None` if A is singular or holds what is no number.
pub fn inverse<T: Scalar>(a: &[T], n: usize) -> Option<Vec<T>> {
    let (mut work, mut out) = (a.to_vec(), vec![T::default(); n * n]);
    invert_into(&mut work, &mut out, n).map(|_| out)
}

/// Writes A⁻¹ to `out`, uses `a` up and gives ln |det A|; `None` if A is singular to working precision or holds what is no number.
///
/// In closed form up to two rows, else by Gauss-Jordan elimination with row pivoting; a pivot that is round-off of its column's largest entry
/// counts as nought.
#[inline]
pub fn invert_into<T: Scalar>(a: &mut [T], out: &mut [T], n: usize) -> Option<f64> {
    match n {
        1 => {
            let power = a[0].norm_sqr();
            out[0] = a[0].conj() / power;
            (power > 0.0 && power.is_finite()).then(|| 0.5 * power.ln())
        }
        2 => {
            let (main, side) = (a[0] * a[3], a[1] * a[2]);
            let determinant = main - side;
            let power = determinant.norm_sqr();
            let back = determinant.conj() / power;
            (out[0], out[1], out[2], out[3]) = (a[3] * back, -a[1] * back, -a[2] * back, a[0] * back);
            let smallest = f64::EPSILON * f64::EPSILON * main.norm_sqr().max(side.norm_sqr());
            (power > smallest && power.is_finite()).then(|| 0.5 * power.ln())
        }
        _ => eliminate(a, out, n),
    }
}

fn eliminate<T: Scalar>(a: &mut [T], out: &mut [T], n: usize) -> Option<f64> {
    let smallest = |column: usize, a: &[T]| f64::EPSILON.powi(2) * (0..n).map(|i| a[i * n + column].norm_sqr()).fold(0.0, f64::max);
    let limits: Vec<f64> = (0..n).map(|column| smallest(column, a)).collect();
    out.iter_mut().enumerate().for_each(|(k, v)| *v = if k / n == k % n { T::ONE } else { T::default() });
    let mut log_determinant = 0.0;
    for column in 0..n {
        let pivot = (column..n).max_by(|&i, &j| a[i * n + column].norm_sqr().total_cmp(&a[j * n + column].norm_sqr()))?;
        let power = a[pivot * n + column].norm_sqr();
        if !(power.is_finite() && power > limits[column]) {
            return None;
        }
        log_determinant += 0.5 * power.ln();
        let factor = a[pivot * n + column].conj() / power;
        for k in 0..n {
            a.swap(column * n + k, pivot * n + k);
            out.swap(column * n + k, pivot * n + k);
            a[column * n + k] *= factor;
            out[column * n + k] *= factor;
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = a[row * n + column];
            if factor == T::default() {
                continue;
            }
            for k in 0..n {
                let (left, right) = (a[column * n + k] * factor, out[column * n + k] * factor);
                a[row * n + k] -= left;
                out[row * n + k] -= right;
            }
        }
    }
    Some(log_determinant)
}

/// y = A x, for A of any number of rows.
pub fn multiply(a: &[f64], x: &[f64], y: &mut [f64]) {
    for (row, y) in a.chunks_exact(x.len()).zip(y) {
        *y = row.iter().zip(x).map(|(a, x)| a * x).sum();
    }
}

/// y += factor · Aᵀ x, for A of any number of rows.
#[inline(always)]
pub fn add_transposed(a: &[f64], x: &[f64], factor: f64, y: &mut [f64]) {
    for (row, x) in a.chunks_exact(y.len()).zip(x) {
        y.iter_mut().zip(row).for_each(|(y, a)| *y += factor * a * x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    fn entry(k: usize) -> Complex64 {
        Complex64::new((1.7 * k as f64).sin(), (2.0 * k as f64).cos())
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        for n in 1..=7 {
            let a: Vec<Complex64> = (0..n * n).map(|k| entry(k * k + 3)).collect();
            let one = product(&a, &inverse(&a, n).expect("regular"), n);
            assert!(one.iter().zip(identity::<Complex64>(n)).all(|(o, i)| (o - i).norm() < 1e-12), "n = {n}");
        }
    }

    #[test]
    fn the_logarithm_of_the_determinant_is_that_of_the_product_of_a_triangle() {
        for n in 1..=5 {
            let a: Vec<f64> = (0..n * n).map(|k| if k % n > k / n { 0.0 } else { 1.5 + (k % n) as f64 }).collect();
            let want: f64 = (0..n).map(|i| a[i * n + i].ln()).sum();
            let found = invert_into(&mut a.clone(), &mut vec![0.0; n * n], n).expect("regular");
            assert!((found - want).abs() < 1e-13, "n = {n}");
        }
    }

    #[test]
    fn what_is_singular_or_no_number_has_no_inverse_whatever_its_unit() {
        for unit in [1e-9, 1.0, 1e9] {
            for a in [vec![0.0], vec![1.0, 2.0, 2.0, 4.0], vec![0.0; 4], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]] {
                let n = a.len().isqrt();
                assert_eq!(inverse(&a.iter().map(|v| v * unit).collect::<Vec<f64>>(), n), None, "{a:?}");
            }
            assert!(inverse(&[unit, 0.0, 0.0, 1.0 / unit], 2).is_some());
        }
        for broken in [f64::NAN, f64::INFINITY] {
            assert_eq!(inverse(&[broken], 1), None);
            assert_eq!(inverse(&[1.0, 0.0, broken, 1.0], 2).filter(|a| a.iter().all(|v| v.is_finite())), None);
            assert_eq!(inverse(&[1.0, 0.0, 0.0, broken, 1.0, 0.0, 0.0, 0.0, 1.0], 3), None);
        }
    }

    #[test]
    fn a_sandwich_of_few_entries_is_that_of_all() {
        let (a, b): (Vec<_>, Vec<_>) = (0..9).map(|k| (entry(k), entry(k + 20))).unzip();
        for few in [1, 2, 9] {
            let d: Vec<Complex64> = (0..9).map(|k| if k % 4 < few { entry(k + 50) } else { Complex64::default() }).collect();
            let dense = product(&product(&a, &d, 3), &b, 3);
            assert!(sandwich(&a, &d, &b, 3).iter().zip(&dense).all(|(a, b)| (a - b).norm() < 1e-14));
        }
        assert!(adjoint(&a, 3).iter().enumerate().all(|(k, v)| *v == a[(k % 3) * 3 + k / 3].conj()));
    }

    #[test]
    fn products_with_vectors_are_sums_along_rows_and_columns() {
        let (a, mut y, mut z) = ([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [0.0; 2], [1.0; 3]);
        multiply(&a, &[1.0, 0.0, -1.0], &mut y);
        add_transposed(&a, &[1.0, -1.0], 2.0, &mut z);
        assert_eq!((y, z), ([-2.0, -2.0], [-5.0, -5.0, -5.0]));
    }
}
