//! Resampling blocks of data: the check of every closed formula for an error.

use crate::response::FrequencyResponse;
use ndarray::Array3;
use ndof_signal::CrossSpectra;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Standard deviation √(E|δH|²) of each entry of a response, `[f][p][q]`, over `resamples` draws with replacement of as many
/// blocks as there are.
///
/// A block is the spectra of a trial, or of a stretch long enough for its neighbours to be independent. Each resample has
/// a random stream of its own, so that the number of threads does not matter. A resample for which `estimate` gives
/// `None` is left out; `None` if fewer than two remain.
///
/// Efron & Tibshirani, An Introduction to the Bootstrap, 1993.
pub fn bootstrap_std(
    blocks: &[CrossSpectra],
    resamples: usize,
    seed: u64,
    estimate: impl Fn(&CrossSpectra) -> Option<FrequencyResponse> + Sync,
) -> Option<Array3<f64>> {
    if blocks.is_empty() {
        return None;
    }
    let draws: Vec<Array3<Complex64>> = (0..resamples)
        .into_par_iter()
        .filter_map(|k| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(k as u64);
            let drawn: Vec<CrossSpectra> = (0..blocks.len()).map(|_| blocks[rng.random_range(0..blocks.len())].clone()).collect();
            estimate(&CrossSpectra::pool(&drawn).ok()?).map(|r| r.value)
        })
        .collect();
    let shape = draws.first()?.dim();
    if draws.len() < 2 {
        return None;
    }
    let n = draws.len() as f64;
    let mut mean = Array3::<Complex64>::zeros(shape);
    draws.iter().for_each(|d| mean += d);
    mean /= Complex64::from(n);
    let mut variance = Array3::zeros(shape);
    for draw in &draws {
        variance.zip_mut_with(&(draw - &mean), |v: &mut f64, d| *v += d.norm_sqr() / (n - 1.0));
    }
    // Drawing from B blocks shrinks the variance by (B − 1)/B.
    let correction = if blocks.len() > 1 { blocks.len() as f64 / (blocks.len() - 1) as f64 } else { f64::NAN };
    Some(variance.mapv(|v: f64| (v * correction).sqrt()))
}
