//! How far each of several signals can be predicted from the others.

use super::ExcitationError;
use crate::CrossSpectra;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Coherence of signals with each other within a band.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputCoherence {
    /// The largest over frequencies and signals.
    pub max: f64,
    /// The mean over frequencies and signals.
    pub mean: f64,
}

/// Coherence of each channel with all others together, over `band_hz`:
///
/// γ²_{j:others}(f) = 1 − 1 / (S_jj \[S⁻¹\]_jj)
///
/// For two channels that is their ordinary coherence; for one it is 0; where S is singular it is 1.
/// (Bendat & Piersol 2010, *Random Data*, ch. 7.)
///
/// # Errors
/// [`ExcitationError::EmptyBand`] if no bin lies in the band.
///
/// ```
/// use ndof_signal::{Welch, input_coherence};
/// let x: Vec<f64> = (0..4000).map(|k| ((k * k) as f64 * 0.37).sin()).collect();
/// let twice: Vec<f64> = x.iter().map(|v| 2.0 * v).collect();
/// let spectra = Welch::new(256).spectra(100.0, &[&x, &twice])?;
/// assert!(input_coherence(&spectra, (1.0, 40.0))?.mean > 0.999);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn input_coherence(spectra: &CrossSpectra, band_hz: (f64, f64)) -> Result<InputCoherence, ExcitationError> {
    let (low_hz, high_hz) = band_hz;
    let n = spectra.channels();
    let (mut max, mut sum, mut count) = (0.0_f64, 0.0, 0_usize);
    let mut work = vec![Complex64::default(); n * n];
    let mut coherence = vec![0.0; n];
    let mut column = vec![Complex64::default(); n];
    for (f, _) in spectra.frequency_hz().iter().enumerate().filter(|(_, hz)| (low_hz..=high_hz).contains(*hz)) {
        coupling(spectra, f, &mut work, &mut column, &mut coherence);
        for &c in &coherence {
            max = max.max(c);
            sum += c;
            count += 1;
        }
    }
    if count == 0 {
        return Err(ExcitationError::EmptyBand { low_hz, high_hz });
    }
    Ok(InputCoherence { max, mean: sum / count as f64 })
}

/// Coherence of each channel with all others together at frequency index `f`, as [`input_coherence`] has it.
pub fn input_coherence_at(spectra: &CrossSpectra, f: usize) -> Vec<f64> {
    let n = spectra.channels();
    let mut coherence = vec![0.0; n];
    coupling(spectra, f, &mut vec![Complex64::default(); n * n], &mut vec![Complex64::default(); n], &mut coherence);
    coherence
}

/// 1 − 1 / (S_jj [S⁻¹]_jj) for every j, through the Cholesky factor L of the matrix scaled to unit diagonal:
/// [S⁻¹]_jj = Σ_i |[L⁻¹]_ij|².
fn coupling(spectra: &CrossSpectra, f: usize, l: &mut [Complex64], column: &mut [Complex64], coherence: &mut [f64]) {
    let n = coherence.len();
    let unit = |a: usize, b: usize| spectra.at(f, a, b) / (spectra.power(f, a) * spectra.power(f, b)).sqrt();
    for a in 0..n {
        for b in 0..=a {
            let mut s = if a == b { Complex64::new(1.0, 0.0) } else { unit(a, b) };
            for k in 0..b {
                s -= l[a * n + k] * l[b * n + k].conj();
            }
            // Below n machine epsilons the pivot is round-off: one signal follows from the others.
            if a == b && (s.re.is_nan() || s.re <= n as f64 * f64::EPSILON) {
                return coherence.fill(1.0);
            }
            l[a * n + b] = if a == b { Complex64::new(s.re.sqrt(), 0.0) } else { s / l[b * n + b].re };
        }
    }
    for (j, c) in coherence.iter_mut().enumerate() {
        let mut inverse = 0.0;
        for i in j..n {
            let mut x = Complex64::new(if i == j { 1.0 } else { 0.0 }, 0.0);
            for k in j..i {
                x -= l[i * n + k] * column[k];
            }
            column[i] = x / l[i * n + i].re;
            inverse += column[i].norm_sqr();
        }
        *c = (1.0 - 1.0 / inverse).clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Welch;
    use crate::shared_tests::noise;

    #[test]
    fn two_signals_have_their_ordinary_coherence() {
        let (x, y) = (noise(7, 0, 4000), noise(7, 1, 4000));
        let mixed: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x + 2.0 * y).collect();
        let s = Welch::new(200).spectra(100.0, &[&x, &mixed]).expect("valid");
        let found = input_coherence(&s, (10.0, 10.0)).expect("a bin");
        let f = 20;
        let expected = s.at(f, 0, 1).norm_sqr() / (s.power(f, 0) * s.power(f, 1));
        assert!((found.max - expected).abs() < 1e-12 && (found.mean - expected).abs() < 1e-12);
        let at = input_coherence_at(&s, f);
        assert!(at.len() == 2 && at.iter().all(|c| (c - expected).abs() < 1e-12));
    }

    #[test]
    fn a_sum_of_the_others_is_wholly_predicted() {
        let (x, y) = (noise(7, 0, 4000), noise(7, 1, 4000));
        let sum: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x - y).collect();
        let s = Welch::new(200).spectra(100.0, &[&x, &y, &sum]).expect("valid");
        assert!(input_coherence(&s, (1.0, 40.0)).expect("bins").mean > 1.0 - 1e-9);
        assert!(matches!(input_coherence(&s, (60.0, 70.0)), Err(ExcitationError::EmptyBand { .. })));
    }

    #[test]
    fn units_do_not_matter() {
        let (x, y, z) = (noise(7, 0, 4000), noise(7, 1, 4000), noise(7, 2, 4000));
        let big: Vec<f64> = x.iter().map(|v| v * 1e6).collect();
        let of = |channels: &[&[f64]]| input_coherence(&Welch::new(200).spectra(100.0, channels).expect("valid"), (1.0, 40.0)).expect("bins");
        let (plain, scaled) = (of(&[&x, &y, &z]), of(&[&big, &y, &z]));
        assert!((plain.max - scaled.max).abs() < 1e-12 && (plain.mean - scaled.mean).abs() < 1e-12);
    }

    #[test]
    fn of_three_signals_each_is_as_far_foretold_as_the_determinants_say() {
        let [x, y, z] = [0, 1, 2].map(|stream| noise(7, stream, 4000));
        let mix = |a: f64, b: f64| -> Vec<f64> { (0..4000).map(|k| a * x[k] + b * y[k] + if k > 2 { z[k - 3] } else { 0.0 }).collect() };
        let s = Welch::new(200).spectra(100.0, &[&x, &mix(0.5, 1.0), &mix(-1.0, 0.7)]).expect("valid");
        let at = |a, b| s.at(20, a, b);
        let minor = |a: usize, b: usize| (at(a, a) * at(b, b) - at(a, b) * at(b, a)).re;
        let whole =
            (at(0, 0) * minor(1, 2) - at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0)) + at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0))).re;
        for (j, (a, b)) in [(1, 2), (0, 2), (0, 1)].into_iter().enumerate() {
            let expected = 1.0 - whole / (s.power(20, j) * minor(a, b));
            assert!((input_coherence_at(&s, 20)[j] - expected).abs() < 1e-12 && expected > 0.1, "{j}: {expected}");
        }
    }
}
