//! Results of many frequencies, written from lanes: `[f][rows][columns]`, a batch of frequencies at a time.

use crate::lanes::{LANES, Lanes, Reals};
use ndarray::Array3;
use num_complex::Complex64;

/// A result `[f][rows][columns]` that is filled a batch of frequencies at a time.
pub(crate) struct Filling<T> {
    flat: Vec<T>,
    /// How much of it has been given out.
    filled: usize,
    rows: usize,
    columns: usize,
    blank: T,
}

impl<T: Copy> Filling<T> {
    /// Room for `bins` matrices; what is not written is `blank`.
    // By itself: within a larger function the fill is not always made of whole vectors.
    #[inline(never)]
    pub(crate) fn new(bins: usize, rows: usize, columns: usize, blank: T) -> Self {
        Filling { flat: vec![blank; bins * rows * columns], filled: 0, rows, columns, blank }
    }

    /// The next `count` frequencies.
    #[inline(always)]
    pub(crate) fn batch(&mut self, count: usize) -> &mut [T] {
        let start = self.filled;
        self.filled += count * self.rows * self.columns;
        &mut self.flat[start..self.filled]
    }

    /// Blanks the matrix at frequency `f`.
    pub(crate) fn erase(&mut self, f: usize) {
        let size = self.rows * self.columns;
        self.flat[f * size..(f + 1) * size].fill(self.blank);
    }

    /// The frequencies of another, behind these.
    pub(crate) fn append(&mut self, other: Filling<T>) {
        self.flat.extend(other.flat);
        self.filled += other.filled;
    }

    pub(crate) fn finish(self) -> Array3<T> {
        let shape = (self.flat.len() / (self.rows * self.columns).max(1), self.rows, self.columns);
        // The length is a multiple of rows × columns by construction, so the shape always fits.
        Array3::from_shape_vec(shape, self.flat).unwrap_or_else(|_| Array3::from_elem(shape, self.blank))
    }
}

impl Filling<Complex64> {
    /// Whether there is not one number.
    pub(crate) fn is_nan(&self) -> bool {
        self.flat.iter().all(|v| v.is_nan())
    }
}

/// Writes entry `at` of `size` of each of `count` frequencies.
#[inline(always)]
pub(crate) fn scatter(to: &mut [Complex64], size: usize, at: usize, from: &Lanes) {
    write(to, size, at, |l| Complex64::new(from.re[l], from.im[l]));
}

/// The same for real numbers.
#[inline(always)]
pub(crate) fn scatter_real(to: &mut [f64], size: usize, at: usize, from: &Reals) {
    write(to, size, at, |l| from[l]);
}

#[inline(always)]
fn write<T>(to: &mut [T], size: usize, at: usize, value: impl Fn(usize) -> T) {
    if to.len() == LANES * size {
        for l in 0..LANES {
            to[l * size + at] = value(l);
        }
        return;
    }
    // Plain steps: the division in `chunks_exact` would cost as much as the algebra.
    let mut k = at;
    for l in 0..LANES {
        let Some(entry) = to.get_mut(k) else { return };
        *entry = value(l);
        k += size;
    }
}

/// Writes a Hermitian matrix from its lower triangle.
#[inline(always)]
pub(crate) fn scatter_hermitian(to: &mut [Complex64], n: usize, triangle: impl Fn(usize, usize) -> Lanes) {
    for i in 0..n {
        for j in 0..i {
            let entry = triangle(i, j);
            scatter(to, n * n, i * n + j, &entry);
            scatter(to, n * n, j * n + i, &entry.conj());
        }
        scatter(to, n * n, i * n + i, &triangle(i, i));
    }
}
