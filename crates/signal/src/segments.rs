//! Cutting a record into segments, and how many independent ones that makes.

use serde::{Deserialize, Serialize};

/// What is removed from each segment before it is windowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detrend {
    /// Nothing.
    None,
    /// Its mean.
    #[default]
    Constant,
    /// Its least-squares line.
    Linear,
}

impl Detrend {
    /// `samples` without their trend, times `window`, into `out`; all three of equal length.
    pub(crate) fn apply_windowed(self, samples: &[f64], window: &[f64], out: &mut [f64]) {
        crate::vectorized(Windowed { detrend: self, samples, window, out });
    }

    /// Takes the trend off `segment`.
    pub fn apply(self, segment: &mut [f64]) {
        let n = segment.len() as f64;
        if segment.is_empty() || self == Detrend::None {
            return;
        }
        let mean = sum(segment) / n;
        segment.iter_mut().for_each(|s| *s -= mean);
        if self == Detrend::Linear && segment.len() > 1 {
            let centre = (n - 1.0) / 2.0;
            let slope = segment.iter().enumerate().map(|(k, s)| (k as f64 - centre) * s).sum::<f64>() / (n * (n * n - 1.0) / 12.0);
            segment.iter_mut().enumerate().for_each(|(k, s)| *s -= slope * (k as f64 - centre));
        }
    }
}

/// [`Detrend::apply_windowed`] as a type, so that it is compiled for the vector unit at hand.
struct Windowed<'a> {
    detrend: Detrend,
    samples: &'a [f64],
    window: &'a [f64],
    out: &'a mut [f64],
}

impl pulp::WithSimd for Windowed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Windowed { detrend, samples, window, out } = self;
        if detrend == Detrend::Linear {
            out.copy_from_slice(samples);
            detrend.apply(out);
            out.iter_mut().zip(window).for_each(|(o, w)| *o *= w);
        } else {
            let mean = if detrend == Detrend::Constant { sum(samples) / samples.len() as f64 } else { 0.0 };
            out.iter_mut().zip(samples).zip(window).for_each(|((o, x), w)| *o = (x - mean) * w);
        }
    }
}

/// Σ x in eight lanes, so that additions do not wait for each other.
#[inline(always)]
fn sum(samples: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let chunks = samples.chunks_exact(8);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        lanes.iter_mut().zip(chunk).for_each(|(lane, x)| *lane += x);
    }
    lanes.iter().sum::<f64>() + rest
}

/// Where the first value stands that is not a number, searched stretch by stretch without a branch a sample.
pub(crate) fn first_not_finite(samples: &[f64]) -> Option<usize> {
    const STRETCH: usize = 256;
    let stretch = samples.chunks(STRETCH).position(|s| !s.iter().fold(true, |all, x| all & x.is_finite()))?;
    samples[stretch * STRETCH..].iter().position(|x| !x.is_finite()).map(|i| stretch * STRETCH + i)
}

/// Why channels cannot be analysed together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum SamplesError {
    /// A channel differs in length.
    #[error("channel {channel} has {found} samples, the first has {expected}")]
    Length { channel: usize, expected: usize, found: usize },
    /// A sample is not a number.
    #[error("channel {channel} is not a finite number at sample {sample}; cut that stretch out or repair it")]
    NotFinite { channel: usize, sample: usize },
}

/// Refuses channels that do not have `expected` finite samples each, of which `start` is the index of the first.
pub(crate) fn require_finite(channels: &[&[f64]], expected: usize, start: usize) -> Result<(), SamplesError> {
    for (channel, samples) in channels.iter().enumerate() {
        if samples.len() != expected {
            return Err(SamplesError::Length { channel, expected, found: samples.len() });
        }
        if let Some(sample) = first_not_finite(samples) {
            return Err(SamplesError::NotFinite { channel, sample: start + sample });
        }
    }
    Ok(())
}

/// The number of whole segments of `nperseg` samples, `hop` apart, in `len` samples.
pub(crate) fn count(len: usize, nperseg: usize, hop: usize) -> usize {
    if len < nperseg { 0 } else { (len - nperseg) / hop + 1 }
}

/// Effective number of independent averages in `segments` overlapping segments:
///
/// n_e = K / (1 + 2 Σ_{m=1}^{K−1} (1 − m/K) ρ_w²(m)),  ρ_w(m) = Σ_n w(n) w(n + m·hop) / Σ w²
///
/// (Welch 1967; Bendat & Piersol 2010, ch. 11.)
///
/// ```
/// use ndof_signal::{Window, effective_averages};
/// let n_e = effective_averages(&Window::Hann.samples(2048, false), 512, 45);
/// assert!((n_e - 23.65).abs() < 0.005);
/// ```
pub fn effective_averages(window: &[f64], hop: usize, segments: usize) -> f64 {
    let k = segments as f64;
    let power: f64 = window.iter().map(|w| w * w).sum();
    let correlated: f64 = (1..segments)
        .take_while(|m| m * hop < window.len())
        .map(|m| {
            let rho = window.iter().zip(&window[m * hop..]).map(|(a, b)| a * b).sum::<f64>() / power;
            (1.0 - m as f64 / k) * rho * rho
        })
        .sum();
    k / (1.0 + 2.0 * correlated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Window;

    /// SCIENCE: 25 000 samples of Hann segments; two decimals are printed there.
    #[test]
    fn effective_averages_of_the_two_settings_of_the_paper() {
        for (nperseg, hop, k, n_e) in [(8192, 4096, 5, 4.79), (4096, 2048, 11, 10.47), (2048, 1024, 23, 21.84), (2048, 512, 45, 23.65)] {
            assert_eq!(count(25_000, nperseg, hop), k);
            let found = effective_averages(&Window::Hann.samples(nperseg, false), hop, k);
            assert!((found - n_e).abs() <= 0.005, "{nperseg}/{hop}: {found}");
        }
    }

    #[test]
    fn a_line_is_removed_whole() {
        let mut line: Vec<f64> = (0..100).map(|k| 3.0 - 0.25 * f64::from(k)).collect();
        Detrend::Linear.apply(&mut line);
        assert!(line.iter().all(|v| v.abs() < 1e-12));
        let mut single = [5.0];
        Detrend::Linear.apply(&mut single);
        assert_eq!(single, [0.0]);
    }

    #[test]
    fn without_its_mean_a_line_is_still_one() {
        let mut line = [1.0, 2.0, 3.0, 4.0, 5.0];
        Detrend::Constant.apply(&mut line);
        assert_eq!(line, [-2.0, -1.0, 0.0, 1.0, 2.0]);
    }

    #[test]
    fn a_record_of_one_segment_has_one() {
        assert_eq!([9, 10, 14, 15].map(|len| count(len, 10, 5)), [0, 1, 1, 2]);
    }
}
