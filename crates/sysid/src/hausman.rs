//! Do the direct and the derived estimate differ by more than chance?

use crate::estimate::{DerivedEstimate, DirectEstimate};
use crate::hermitian::Cholesky;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A test of the hypothesis that nothing feeds back, so that the direct estimate is as good as the derived one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hausman {
    /// Sum over independent bins, χ² under the hypothesis.
    pub statistic: f64,
    /// Its real degrees of freedom, 2 p q for each bin.
    pub degrees_of_freedom: f64,
    /// Probability of as large a value by chance: below 0.01 noise is fed back (or the inputs are noisy), and the direct
    /// estimate is not to be used.
    pub probability: f64,
}

/// Hausman's statistic of two estimates from the same spectra over `low_hz..=high_hz`:
///
/// h = 2 (ν − q − p) Σ_f tr((ν N − E)⁻¹ E), E = δ D⁻¹ δᴴ, δ = C_derived − C_direct, D = (S^c_uu)⁻¹ − S_uu⁻¹,
///
/// with N and ν the direct estimate's noise and its degrees of freedom. δ is a part of the direct residual, so taking E
/// out leaves a noise that is independent of it and unbiased under the hypothesis. `None` if the estimates differ in grid
/// or no bin in the band has both.
///
/// Hausman, Econometrica 46, 1978.
pub fn hausman(direct: &DirectEstimate, derived: &DerivedEstimate, low_hz: f64, high_hz: f64) -> Option<Hausman> {
    let (direct, derived) = (&direct.response, &derived.response);
    let (own, other) = (derived.uncertainty.as_ref()?, direct.uncertainty.as_ref()?);
    if direct.frequency_hz != derived.frequency_hz {
        return None;
    }
    let (p, q) = derived.shape();
    let freedom = other.degrees_of_freedom;
    let left = freedom - (q + p) as f64;
    if left <= 0.0 {
        return None;
    }
    let (mut noise, mut gap) = (Cholesky::new(p), Cholesky::new(q));
    let (mut statistic, mut bins, mut next_hz) = (0.0, 0, low_hz);
    let mut rows = vec![Complex64::default(); p * q];
    let mut column = vec![Complex64::default(); p];
    for f in 0..derived.len() {
        let at_hz = derived.frequency_hz[f];
        let difference = |l: usize, j: usize| own.input_inverse[[f, l, j]] - other.input_inverse[[f, l, j]];
        if at_hz < next_hz || at_hz > high_hz || !gap.factor(difference) {
            continue;
        }
        next_hz = at_hz + own.independent_spacing_hz;
        for (i, row) in rows.chunks_exact_mut(q).enumerate() {
            row.iter_mut().enumerate().for_each(|(j, r)| *r = derived.value[[f, i, j]] - direct.value[[f, i, j]]);
            gap.whiten(row);
        }
        let energy = |i: usize, k: usize| -> Complex64 { (0..q).map(|j| rows[i * q + j] * rows[k * q + j].conj()).sum() };
        if !noise.factor(|i, k| other.noise[[f, i, k]] * freedom - energy(i, k)) {
            continue;
        }
        for j in 0..q {
            (0..p).for_each(|i| column[i] = rows[i * q + j].conj());
            noise.whiten(&mut column);
            statistic += 2.0 * column.iter().map(|v| v.norm_sqr()).sum::<f64>();
        }
        bins += 1;
    }
    if bins == 0 {
        return None;
    }
    let statistic = statistic * left;
    let degrees_of_freedom = (2 * p * q * bins) as f64;
    let probability = ChiSquared::new(degrees_of_freedom).ok()?.sf(statistic);
    Some(Hausman { statistic, degrees_of_freedom, probability })
}
