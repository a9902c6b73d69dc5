//! The covariance of a frequency response.

use ndarray::{Array2, Array3, ArrayViewMut2, Axis};
use ndof_signal::{CrossSpectra, Kernel};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// What is not known.
pub(crate) const NAN: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// Covariance of a response at each frequency, as a Kronecker product:
///
/// E\[δH_ij δH_kl*\] = `noise[f][i][k] · input_inverse[f][l][j]`
///
/// The form survives inversion and multiplication by known matrices, so that nothing larger is ever stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Output side, Hermitian, `[f][p][p]`; the number of averages is already divided out.
    pub noise: Array3<Complex64>,
    /// Input side, Hermitian, `[f][q][q]`.
    pub input_inverse: Array3<Complex64>,
    /// Complex degrees of freedom ν of the noise estimate (n_e − q for Welch); intervals use t and F with 2ν.
    pub degrees_of_freedom: f64,
    /// Bins closer than this are correlated; a band holds as many independent values as this fits into it.
    pub independent_spacing_hz: f64,
    /// Σ, what references leave unexplained of outputs and then inputs, `[f][p + q][p + q]` in the units of `noise`; `None` where inputs are what they
    /// were measured to be. With it the noise that another H than the estimated one has is known: \[1, −H\] Σ \[1, −H\]ᴴ.
    #[serde(skip)]
    pub unexplained: Option<Array3<Complex64>>,
    /// The window that the response was seen through.
    pub kernel: Kernel,
    /// Whether the value is the matrix inverse of what was estimated, so that its errors are lopsided: intervals are those
    /// of the estimate, inverted.
    #[serde(default)]
    pub inverted: bool,
}

impl Uncertainty {
    /// That of an estimate from spectra.
    pub(crate) fn of_spectra(spectra: &CrossSpectra, noise: Array3<Complex64>, input_inverse: Array3<Complex64>, degrees_of_freedom: f64) -> Self {
        let (independent_spacing_hz, kernel) = (spectra.independent_spacing_hz(), spectra.kernel().clone());
        Uncertainty { noise, input_inverse, degrees_of_freedom, independent_spacing_hz, unexplained: None, kernel, inverted: false }
    }

    /// That at the frequencies of these indices.
    pub(crate) fn select(&self, keep: &[usize]) -> Self {
        Uncertainty {
            noise: chosen(&self.noise, keep),
            input_inverse: chosen(&self.input_inverse, keep),
            unexplained: self.unexplained.as_ref().map(|all| chosen(all, keep)),
            kernel: self.kernel.clone(),
            ..*self
        }
    }

    /// At frequency index `f`, that of outputs times `rows` to inputs times `columns`.
    pub(crate) fn scale(&mut self, f: usize, rows: &[Complex64], columns: &[Complex64]) {
        let conjugate = |of: &[Complex64]| of.iter().map(Complex64::conj).collect::<Vec<_>>();
        let back: Vec<Complex64> = columns.iter().map(|column| column.inv()).collect();
        scale(self.noise.index_axis_mut(Axis(0), f), rows, &conjugate(rows));
        scale(self.input_inverse.index_axis_mut(Axis(0), f), &conjugate(&back), &back);
        if let Some(all) = &mut self.unexplained {
            let both = [rows, columns].concat();
            scale(all.index_axis_mut(Axis(0), f), &both, &conjugate(&both));
        }
    }

    /// What is unexplained of `count` inputs W u; not a number where there is no W.
    pub(crate) fn turn_inputs(&mut self, count: usize, w: impl Fn(usize) -> Option<Array2<Complex64>>) {
        let p = self.noise.dim().1;
        self.unexplained = self.unexplained.take().map(|all| {
            let mut out = Array3::from_elem((all.dim().0, p + count, p + count), NAN);
            for (f, (sigma, mut to)) in all.outer_iter().zip(out.outer_iter_mut()).enumerate() {
                let Some(w) = w(f) else { continue };
                let own = |i: usize, j: usize| if i == j { Complex64::ONE } else { Complex64::ZERO };
                let both = Array2::from_shape_fn((p + count, sigma.nrows()), |(i, j)| if i < p || j < p { own(i, j) } else { w[[i - p, j - p]] });
                to.assign(&both.dot(&sigma).dot(&both.t().mapv(|v| v.conj())));
            }
            out
        });
    }
}

/// The matrices of these indices.
pub(crate) fn chosen(all: &Array3<Complex64>, keep: &[usize]) -> Array3<Complex64> {
    let (_, rows, columns) = all.dim();
    let mut flat = Vec::with_capacity(keep.len() * rows * columns);
    keep.iter().for_each(|&f| flat.extend(all.index_axis(Axis(0), f)));
    // A matrix for each, so the shape always fits.
    Array3::from_shape_vec((keep.len(), rows, columns), flat).unwrap_or_else(|_| all.select(Axis(0), keep))
}

/// Each entry times its row's and its column's factor.
pub(crate) fn scale(mut matrix: ArrayViewMut2<'_, Complex64>, rows: &[Complex64], columns: &[Complex64]) {
    matrix.indexed_iter_mut().for_each(|((i, j), v)| *v *= rows[i] * columns[j]);
}
