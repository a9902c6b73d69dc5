//! Complex Gaussian draws and the spectra that they make: an experiment at one frequency, without any time series.

use ndarray::Array2;
use ndof_signal::{CrossSpectra, Kernel};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

pub fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A matrix of independent circular complex Gaussian numbers of unit variance.
pub fn normal(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> Array2<Complex64> {
    let mut draw = || -> f64 { rng.sample(StandardNormal) };
    Array2::from_shape_fn((rows, columns), |_| Complex64::new(draw(), draw()) * 0.5_f64.sqrt())
}

/// A matrix of uniform numbers in the unit square.
pub fn uniform(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> Array2<Complex64> {
    Array2::from_shape_fn((rows, columns), |_| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)))
}

pub fn hermitian(a: &Array2<Complex64>) -> Array2<Complex64> {
    a.t().mapv(|v| v.conj())
}

/// Spectra over `bins` frequencies from `draw(bin)`, which gives channels × averages. Bin 0 is thrown away by every
/// estimator, as after mean removal.
pub fn spectra(bins: usize, mut draw: impl FnMut(usize) -> Array2<Complex64>) -> CrossSpectra {
    let mut lower = Vec::new();
    let (mut channels, mut averages) = (0, 0);
    for f in 0..bins {
        let z = draw(f);
        (channels, averages) = z.dim();
        lower.resize(channels * (channels + 1) / 2 * bins, Complex64::default());
        for a in 0..channels {
            for b in 0..=a {
                let sum: Complex64 = z.row(a).iter().zip(z.row(b)).map(|(x, y)| x * y.conj()).sum();
                lower[(a * (a + 1) / 2 + b) * bins + f] = sum / averages as f64;
            }
        }
    }
    let frequency_hz = (0..bins).map(|f| f as f64).collect();
    CrossSpectra::from_parts(channels, 2.0 * bins as f64, frequency_hz, lower, averages as f64, averages, 1.0, Kernel::default())
}

/// Rows of several matrices under each other.
pub fn stack(parts: &[&Array2<Complex64>]) -> Array2<Complex64> {
    let columns = parts[0].ncols();
    let flat: Vec<Complex64> = parts.iter().flat_map(|p| p.iter().copied()).collect();
    Array2::from_shape_vec((flat.len() / columns, columns), flat).expect("equal columns")
}
