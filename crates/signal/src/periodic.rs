//! Averaging over the periods of a periodic excitation.

use crate::segments::{SamplesError, require_finite};
use crate::transform::{RealToComplex, forward_transform, inverse_transform, spectrum_by};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How a periodic recording is cut.
///
/// ```
/// use ndof_signal::Periodic;
/// let x: Vec<f64> = (0..500).map(|k| (std::f64::consts::TAU * 3.0 * k as f64 / 100.0).cos()).collect();
/// let periods = Periodic { period: 100, discard: 1 }.spectra(50.0, &[&x])?;
/// assert_eq!(periods.periods(), 4);
/// assert!((periods.mean(3, 0).re - 1.0).abs() < 1e-12);
/// # Ok::<(), ndof_signal::PeriodicError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Periodic {
    /// Samples in a period; [`detect_period`] finds it from the commanded signal.
    pub period: usize,
    /// Periods at the beginning that are left out, until transients have died.
    pub discard: usize,
}

/// Why a recording cannot be averaged over periods.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum PeriodicError {
    /// A period has no samples.
    #[error("a period of 0 samples; give the period of the excitation")]
    EmptyPeriod,
    /// No whole period is left.
    #[error("{len} samples hold {whole} periods of {period}, {discard} of them discarded; two must remain to tell noise from response")]
    TooShort { len: usize, whole: usize, period: usize, discard: usize },
    /// Channels that cannot be analysed together.
    #[error(transparent)]
    Samples(#[from] SamplesError),
}

impl Periodic {
    /// The spectrum of every channel in every period.
    ///
    /// # Errors
    /// [`PeriodicError`] if fewer than two periods remain, or the record is ragged or holds a NaN.
    pub fn spectra(&self, sample_rate_hz: f64, channels: &[&[f64]]) -> Result<PeriodSpectra, PeriodicError> {
        if self.period == 0 {
            return Err(PeriodicError::EmptyPeriod);
        }
        let len = channels.first().map_or(0, |c| c.len());
        require_finite(channels, len, 0)?;
        let whole = len / self.period;
        if whole < self.discard + 2 {
            return Err(PeriodicError::TooShort { len, whole, period: self.period, discard: self.discard });
        }
        let fft = forward_transform(self.period);
        let lines = (self.discard..whole)
            .map(|p| {
                let at = p * self.period..(p + 1) * self.period;
                channels.iter().flat_map(|c| amplitudes(&fft, &c[at.clone()])).collect()
            })
            .collect();
        let bins = self.period / 2 + 1;
        let frequency_hz = (0..bins).map(|f| f as f64 * sample_rate_hz / self.period as f64).collect();
        Ok(PeriodSpectra { frequency_hz, lines })
    }
}

/// Complex amplitudes: x(t) = Re Σ_f X_f e^{j2πft}.
pub(crate) fn amplitudes(fft: &Arc<dyn RealToComplex<f64>>, samples: &[f64]) -> Vec<Complex64> {
    let n = samples.len();
    let mut output = spectrum_by(fft.as_ref(), &mut samples.to_vec());
    output.iter_mut().enumerate().for_each(|(f, x)| *x *= if f == 0 || 2 * f == n { 1.0 } else { 2.0 } / n as f64);
    output
}

/// The lines of every channel in every period: their mean is the response to the excitation, their scatter the noise.
///
/// Amplitudes are those of the cosines, x(t) = Re Σ_f X_f e^{j2πft}, in the unit of the channel.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodSpectra {
    frequency_hz: Vec<f64>,
    /// `[period][channel * bins + f]`.
    lines: Vec<Vec<Complex64>>,
}

impl PeriodSpectra {
    /// The lines' frequencies, multiples of fs/period from 0 to Nyquist.
    pub fn frequency_hz(&self) -> &[f64] {
        &self.frequency_hz
    }

    /// Number of periods P.
    pub fn periods(&self) -> usize {
        self.lines.len()
    }

    /// The amplitude of line `f` of `channel` in period `p`.
    pub fn at(&self, p: usize, f: usize, channel: usize) -> Complex64 {
        self.lines[p][channel * self.frequency_hz.len() + f]
    }

    /// The mean amplitude over the periods.
    pub fn mean(&self, f: usize, channel: usize) -> Complex64 {
        (0..self.periods()).map(|p| self.at(p, f, channel)).sum::<Complex64>() / self.periods() as f64
    }

    /// The noise covariance of the *mean* amplitudes of channels `a` and `b`:
    ///
    /// C_ab = Σ_p (A_p − Ā)(B_p − B̄)* / (P (P−1))
    ///
    /// What does not repeat from period to period is noise; what nonlinearity adds repeats, and is not in it.
    pub fn noise_covariance(&self, f: usize, a: usize, b: usize) -> Complex64 {
        let (mean_a, mean_b) = (self.mean(f, a), self.mean(f, b));
        let n = self.periods() as f64;
        (0..self.periods()).map(|p| (self.at(p, f, a) - mean_a) * (self.at(p, f, b) - mean_b).conj()).sum::<Complex64>() / (n * (n - 1.0))
    }
}

/// A period found in a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectedPeriod {
    /// Samples in a period.
    pub period: usize,
    /// Share of the power that does not repeat: ½ ⟨(x(n) − x(n+L))²⟩ / ⟨x²⟩, 0 for an exact repetition.
    pub mismatch: f64,
}

/// The shortest period of `signal` that repeats at least once and leaves at most a tenth of the power unexplained.
///
/// The signal is compared with itself at every lag L up to half its length, from where it has first lost its likeness
/// to itself; of the lags that repeat about as well as the best one the shortest is taken.
///
/// ```
/// use ndof_signal::detect_period;
/// let x: Vec<f64> = (0..1000).map(|k| ((k % 250) as f64 * 0.3).sin() + ((k % 250) as f64).cos()).collect();
/// assert_eq!(detect_period(&x).map(|d| d.period), Some(250));
/// let growing: Vec<f64> = (0..1000).map(|k| k as f64).collect();
/// assert!(detect_period(&growing).is_none());
/// ```
pub fn detect_period(signal: &[f64]) -> Option<DetectedPeriod> {
    /// A response to a periodic command in noise of a tenth of its power still passes.
    const MOST_MISMATCH: f64 = 0.1;
    let n = signal.len();
    let mean = signal.iter().sum::<f64>() / n.max(1) as f64;
    let level: Vec<f64> = signal.iter().map(|x| x - mean).collect();
    let mut energy = vec![0.0; n + 1];
    for (k, x) in level.iter().enumerate() {
        energy[k + 1] = energy[k] + x * x;
    }
    if n < 4 || !(energy[n] > 0.0 && energy[n].is_finite()) {
        return None;
    }
    let product = autocorrelation(&level, n);
    let mismatch: Vec<f64> = (0..=n / 2)
        .map(|lag| {
            // Two halves at least, which together are all of the signal: never zero.
            let both = energy[n - lag] + energy[n] - energy[lag];
            (1.0 - 2.0 * product[lag] / both).max(0.0)
        })
        .collect();
    let unlike = mismatch.iter().position(|&d| d > 0.5)?;
    let best = mismatch[unlike..].iter().copied().fold(f64::INFINITY, f64::min);
    // The round-off of the transforms, and half as much again for the scatter between multiples of the period.
    let limit = (1.5 * best + 1e-9).min(MOST_MISMATCH);
    let first = unlike + mismatch[unlike..].iter().position(|&d| d <= limit)?;
    let period = (first..mismatch.len()).take_while(|&lag| mismatch[lag] <= limit).reduce(|a, b| if mismatch[b] < mismatch[a] { b } else { a })?;
    Some(DetectedPeriod { period, mismatch: mismatch[period] })
}

/// Σ_n x(n) x(n + lag) for lags below `lags`, or to the signal's length.
///
/// In blocks of so many samples, padded with as many zeros, whose transforms are A_b: block b beside what follows it has the transform
/// A_b + (−1)^f A_(b+1), and the sum is the inverse of Σ A_b* (A_b + (−1)^f A_(b+1)).
pub(crate) fn autocorrelation(x: &[f64], lags: usize) -> Vec<f64> {
    let lags = lags.min(x.len());
    let block = lags.next_power_of_two();
    let length = 2 * block;
    let (forward, inverse) = (forward_transform(length), inverse_transform(length));
    let mut series = vec![0.0; length];
    let (mut sum, mut before, mut own) = (forward.make_output_vec(), forward.make_output_vec(), forward.make_output_vec());
    // Lengths are those of the plans, and the sum is real at both of its ends, so the transforms cannot refuse.
    let mut done = true;
    for (b, samples) in x.chunks(block).enumerate() {
        series[..samples.len()].copy_from_slice(samples);
        series[samples.len()..].fill(0.0);
        done &= forward.process(&mut series, &mut own).is_ok();
        for (f, ((sum, before), own)) in sum.iter_mut().zip(&before).zip(&own).enumerate() {
            let sign = if f % 2 == 0 { 1.0 } else { -1.0 };
            let products = if b == 0 { own.norm_sqr().into() } else { before.conj() * own * sign + own.norm_sqr() };
            *sum += products / length as f64;
        }
        std::mem::swap(&mut before, &mut own);
    }
    done &= inverse.process(&mut sum, &mut series).is_ok();
    debug_assert!(done);
    series.truncate(lags);
    series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::noise;

    #[test]
    fn autocorrelation_is_the_sum_of_products_at_every_lag() {
        for (n, lags) in [(1, 1), (7, 7), (100, 200), (100, 3), (1000, 64), (1000, 33), (64, 16)] {
            let x = noise(3, 5, n);
            let found = autocorrelation(&x, lags);
            assert_eq!(found.len(), lags.min(n));
            for (lag, found) in found.iter().enumerate() {
                let expected: f64 = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum();
                assert!((found - expected).abs() < 1e-12 * n as f64, "{n} {lags} {lag}: {found} for {expected}");
            }
        }
    }

    /// Lines 2 and 5 of a 200-sample period, repeated.
    fn multisine(n: usize) -> Vec<f64> {
        (0..n).map(|k| std::f64::consts::TAU * k as f64 / 200.0).map(|x| (2.0 * x).cos() + 0.5 * (5.0 * x + 1.0).cos()).collect()
    }

    #[test]
    fn four_samples_are_enough_for_a_period_and_three_are_not() {
        assert_eq!(detect_period(&[1.0, -1.0, 1.0, -1.0]).map(|d| d.period), Some(2));
        assert_eq!(detect_period(&[1.0, -1.0, 1.0]), None);
        assert_eq!(detect_period(&[]), None);
    }

    #[test]
    fn each_channel_has_its_own_lines() {
        let x = multisine(600);
        let [twice, thrice] = [2.0, 3.0].map(|times| x.iter().map(|x| times * x).collect::<Vec<f64>>());
        let spectra = Periodic { period: 200, discard: 1 }.spectra(100.0, &[&x, &twice, &thrice]).expect("whole periods");
        assert_eq!((spectra.frequency_hz().len(), spectra.frequency_hz()[2], spectra.frequency_hz()[100]), (101, 1.0, 50.0));
        for channel in 0..3 {
            let ratio = spectra.at(0, 2, channel) / spectra.at(0, 2, 0);
            assert!((ratio - (channel + 1) as f64).norm() < 1e-12, "{channel}: {ratio}");
        }
    }

    #[test]
    fn the_mismatch_is_what_its_definition_says_whatever_the_mean() {
        let x: Vec<f64> = multisine(1100).iter().zip(noise(3, 4, 1100)).map(|(a, b)| 3.0 + a + 0.2 * b).collect();
        let found = detect_period(&x).expect("periodic");
        let mean = x.iter().sum::<f64>() / 1100.0;
        let pairs = || x[200..].iter().zip(&x).map(|(late, early)| (late - mean, early - mean));
        let apart: f64 = pairs().map(|(late, early)| (late - early).powi(2)).sum();
        let power: f64 = pairs().map(|(late, early)| late * late + early * early).sum();
        assert_eq!(found.period, 200);
        assert!((found.mismatch - apart / power).abs() < 1e-12, "{found:?}, {}", apart / power);
    }

    #[test]
    fn of_lags_that_repeat_equally_well_the_shortest_is_the_period_and_an_exact_repetition_beats_a_near_one() {
        // 50 samples, the second time with another sign of a small part: 100 is the period, 50 is near it.
        let wave = |k: usize, period: f64| (std::f64::consts::TAU * k as f64 / period).sin();
        let exact: Vec<f64> = (0..1000).map(|k| wave(k, 50.0) + 0.08 * wave(k, 100.0)).collect();
        let near: Vec<f64> = exact.iter().zip(noise(3, 5, 1000)).map(|(a, b)| a + 0.28 * b).collect();
        assert_eq!(detect_period(&exact).map(|d| d.period), Some(100));
        assert_eq!(detect_period(&near).map(|d| d.period), Some(50), "both are within the noise");
    }

    #[test]
    fn lines_and_noise_are_told_apart() {
        let sigma = 0.1;
        let x: Vec<f64> = multisine(200 * 51).iter().zip(noise(3, 0, 200 * 51)).map(|(x, e)| x + sigma * e).collect();
        let s = Periodic { period: 200, discard: 1 }.spectra(100.0, &[&x]).expect("valid");
        // Var of an amplitude 2X/N under white noise of variance v: 4v/N; of the mean over P: / P.
        let expected = 4.0 * sigma * sigma / 3.0 / 200.0 / 50.0;
        let mean: f64 = (1..100).map(|f| s.noise_covariance(f, 0, 0).re).sum::<f64>() / 99.0;
        // 99 lines of 49 degrees each: one sigma is 1/√(99·49) = 1.4 %.
        assert!((mean / expected - 1.0).abs() < 4.0 * 0.0144, "{}", mean / expected);
        assert!((s.mean(5, 0) - Complex64::from_polar(0.5, 1.0)).norm() < 4.0 * expected.sqrt());
    }

    #[test]
    fn a_period_is_found_under_noise_and_not_in_noise() {
        let found = detect_period(&multisine(1100)).expect("periodic");
        assert!(found.period == 200 && found.mismatch < 1e-9, "{found:?}");
        let noisy: Vec<f64> = multisine(1100).iter().zip(noise(3, 1, 1100)).map(|(x, e)| x + 0.2 * e).collect();
        let found = detect_period(&noisy).expect("periodic");
        assert!(found.period.abs_diff(200) <= 1, "{found:?}");
        assert_eq!(detect_period(&noise(3, 2, 1100)), None);
        assert_eq!(detect_period(&[1.0; 50]), None);
    }

    #[test]
    fn too_few_periods_are_refused() {
        let x = multisine(500);
        assert!(matches!(Periodic { period: 200, discard: 1 }.spectra(1.0, &[&x]), Err(PeriodicError::TooShort { whole: 2, .. })));
        assert_eq!(Periodic { period: 0, discard: 1 }.spectra(1.0, &[&x]).unwrap_err(), PeriodicError::EmptyPeriod);
    }

    #[test]
    fn what_two_periods_differ_by_is_the_covariance_of_their_mean() {
        // x ± d and y ± e: their means are x and y, and the covariance of these d e*.
        let wave = |f: usize, re: f64, im: f64| move |k: usize| (Complex64::new(re, im) * Complex64::cis(std::f64::consts::TAU * (f * k) as f64 / 20.0)).re;
        let (x, d, e) = (wave(3, 1.0, 0.5), wave(3, 0.1, 0.3), wave(3, -0.2, 0.4));
        let record = |part: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..40).map(|k| x(k) + if k < 20 { part(k) } else { -part(k) }).collect() };
        let s = Periodic { period: 20, discard: 0 }.spectra(100.0, &[&record(&d), &record(&e)]).expect("two periods");
        let expected = Complex64::new(0.1, 0.3) * Complex64::new(-0.2, 0.4).conj();
        assert!((s.noise_covariance(3, 0, 1) - expected).norm() < 1e-12 && (s.mean(3, 1) - Complex64::new(1.0, 0.5)).norm() < 1e-12);
    }
}
