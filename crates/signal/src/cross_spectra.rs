//! The Hermitian matrix of all channels at each frequency.

use ndarray::Array2;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// The power kernel |W(ν)|² of a data window, as nodes of a quadrature whose weights sum to one.
///
/// A spectral estimate at *f* is on average the true spectrum seen through this kernel: E Ŝ(f) = Σ wₖ S(f + νₖ).
/// Fits smooth the model by it, so that the window's finite resolution is not taken for damping.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    /// Distances from the bin.
    pub offset_hz: Vec<f64>,
    /// Weights, one a distance.
    pub weight: Vec<f64>,
}

impl Kernel {
    /// The kernel whose values from the bin on to one side are known, up to a factor.
    pub(crate) fn of_half(half: &[f64], step_hz: f64) -> Self {
        let total = half[0] + 2.0 * half[1..].iter().sum::<f64>();
        let reach = half.len() as isize - 1;
        let (offset_hz, weight) = (-reach..=reach).map(|m| (m as f64 * step_hz, half[m.unsigned_abs()] / total)).unzip();
        Kernel { offset_hz, weight }
    }
}

/// Auto- and cross-spectral densities of all channels, with the number of averages behind them.
///
/// `at(f, a, b) = ⟨A B*⟩`, one-sided, in unit_a · unit_b / Hz. Everything in `ndof-sysid` is algebra on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossSpectra {
    pub(crate) channels: usize,
    pub(crate) sample_rate_hz: f64,
    pub(crate) frequency_hz: Vec<f64>,
    /// Lower triangle, pair by pair: entry (a, b ≤ a) at frequency f is `lower[(a(a+1)/2 + b) * bins + f]`.
    pub(crate) lower: Vec<Complex64>,
    pub(crate) effective_averages: f64,
    pub(crate) segments: usize,
    pub(crate) trials: usize,
    pub(crate) independent_spacing_hz: f64,
    pub(crate) kernel: Kernel,
    pub(crate) mean_removed: bool,
}

/// Why spectra cannot be pooled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum SpectraError {
    /// There is nothing to pool.
    #[error("no spectra to pool; give at least one recording")]
    Empty,
    /// Two sets differ in what must agree.
    #[error("trial {trial} has {found} {what}, the first has {expected}; pool only trials of one experiment, analysed with one setting")]
    Mismatch {
        /// Number of the trial, from 1.
        trial: usize,
        what: &'static str,
        expected: f64,
        found: f64,
    },
}

impl CrossSpectra {
    /// Spectra from their parts, for estimators outside of this crate.
    ///
    /// `lower` holds the lower triangle pair by pair: entry (a, b ≤ a) at frequency f stands at
    /// `(a(a+1)/2 + b) * frequency_hz.len() + f`, each a mean over `segments` segments.
    ///
    /// # Panics
    /// If `lower` does not have `channels (channels + 1) / 2 × frequency_hz.len()` entries.
    #[expect(clippy::too_many_arguments, reason = "every field once, by name at the call")]
    pub fn from_parts(
        channels: usize,
        sample_rate_hz: f64,
        frequency_hz: Vec<f64>,
        lower: Vec<Complex64>,
        effective_averages: f64,
        segments: usize,
        independent_spacing_hz: f64,
        kernel: Kernel,
    ) -> Self {
        assert_eq!(lower.len(), channels * (channels + 1) / 2 * frequency_hz.len(), "lower triangle of {channels} channels");
        CrossSpectra {
            channels,
            sample_rate_hz,
            frequency_hz,
            lower,
            effective_averages,
            segments,
            trials: 1,
            independent_spacing_hz,
            kernel,
            mean_removed: true,
        }
    }

    /// The same without the frequencies above one.
    #[must_use]
    pub fn up_to(&self, highest_hz: f64) -> Self {
        let (bins, kept) = (self.frequency_hz.len(), self.frequency_hz.partition_point(|hz| *hz <= highest_hz));
        let lower = self.lower.chunks_exact(bins).flat_map(|pair| &pair[..kept]).copied().collect();
        CrossSpectra { frequency_hz: self.frequency_hz[..kept].to_vec(), lower, kernel: self.kernel.clone(), ..*self }
    }

    /// ⟨A B*⟩ at frequency index `f`.
    pub fn at(&self, f: usize, a: usize, b: usize) -> Complex64 {
        let bins = self.frequency_hz.len();
        if a >= b { self.lower[(a * (a + 1) / 2 + b) * bins + f] } else { self.lower[(b * (b + 1) / 2 + a) * bins + f].conj() }
    }

    /// ⟨A B*⟩ at every frequency, for a ≥ b (the other half is its conjugate).
    ///
    /// # Panics
    /// If a < b or a is beyond the channels.
    #[inline]
    pub fn pair(&self, a: usize, b: usize) -> &[Complex64] {
        assert!(b <= a && a < self.channels, "pair ({a}, {b}) of {} channels", self.channels);
        let bins = self.frequency_hz.len();
        &self.lower[(a * (a + 1) / 2 + b) * bins..][..bins]
    }

    /// The power density of channel `a` at frequency index `f`.
    pub fn power(&self, f: usize, a: usize) -> f64 {
        self.at(f, a, a).re
    }

    /// The block `rows` × `columns` of the matrix at frequency index `f`.
    pub fn block(&self, f: usize, rows: &[usize], columns: &[usize]) -> Array2<Complex64> {
        Array2::from_shape_fn((rows.len(), columns.len()), |(i, j)| self.at(f, rows[i], columns[j]))
    }

    /// The frequency grid, 0 to Nyquist.
    pub fn frequency_hz(&self) -> &[f64] {
        &self.frequency_hz
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Sample rate of the recordings.
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Effective number of independent averages, added over trials.
    pub fn effective_averages(&self) -> f64 {
        self.effective_averages
    }

    /// Number of segments (or tapers, or periods) averaged, added over trials.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// Number of trials pooled.
    pub fn trials(&self) -> usize {
        self.trials
    }

    /// Distance at which two bins are independent: fs Σw⁴ / (Σw²)² for one window (1.944 fs/N for Hann).
    pub fn independent_spacing_hz(&self) -> f64 {
        self.independent_spacing_hz
    }

    /// The power kernel of the window.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Whether each segment lost its mean, so that 0 Hz says nothing.
    pub fn mean_removed(&self) -> bool {
        self.mean_removed
    }

    /// Pools trials: densities averaged with the number of segments as weight, averages added.
    ///
    /// # Errors
    /// [`SpectraError`] if there is none, or they differ in channels, rate or grid.
    pub fn pool(trials: &[CrossSpectra]) -> Result<CrossSpectra, SpectraError> {
        let (first, rest) = trials.split_first().ok_or(SpectraError::Empty)?;
        let mut pooled = first.clone();
        let weight = first.segments as f64;
        pooled.lower.iter_mut().for_each(|s| *s *= weight);
        for (k, other) in rest.iter().enumerate() {
            for (what, expected, found) in [
                ("channels", first.channels as f64, other.channels as f64),
                ("Hz sample rate", first.sample_rate_hz, other.sample_rate_hz),
                ("frequencies", first.frequency_hz.len() as f64, other.frequency_hz.len() as f64),
            ] {
                if expected != found {
                    return Err(SpectraError::Mismatch { trial: k + 2, what, expected, found });
                }
            }
            let weight = other.segments as f64;
            pooled.lower.iter_mut().zip(&other.lower).for_each(|(s, o)| *s += o * weight);
            pooled.effective_averages += other.effective_averages;
            pooled.segments += other.segments;
            pooled.trials += other.trials;
        }
        let scale = 1.0 / pooled.segments as f64;
        pooled.lower.iter_mut().for_each(|s| *s *= scale);
        Ok(pooled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Welch;

    fn trial(from: usize, samples: usize) -> CrossSpectra {
        let wave = |c: usize| (from..from + samples).map(|k| ((k * k) as f64 * 0.013 * (c + 1) as f64).sin()).collect::<Vec<f64>>();
        let channels: Vec<Vec<f64>> = (0..4).map(wave).collect();
        Welch::new(32).spectra(50.0, &channels.iter().map(Vec::as_slice).collect::<Vec<_>>()).expect("long enough")
    }

    #[test]
    fn what_lies_above_a_frequency_is_left_out_and_the_rest_stays() {
        let whole = trial(0, 300);
        let half = whole.up_to(12.5);
        assert_eq!((half.frequency_hz(), half.effective_averages()), (&whole.frequency_hz()[..9], whole.effective_averages()));
        for (a, b) in [(0, 0), (2, 1), (3, 3)] {
            assert_eq!(half.pair(a, b), &whole.pair(a, b)[..9]);
        }
        assert_eq!(whole.up_to(f64::INFINITY), whole);
    }

    #[test]
    fn a_pair_is_the_entry_of_the_matrix_at_every_frequency() {
        let spectra = trial(0, 300);
        assert_eq!((spectra.sample_rate_hz(), spectra.channels()), (50.0, 4));
        for (a, b) in (0..4).flat_map(|a| (0..=a).map(move |b| (a, b))) {
            for (f, value) in spectra.pair(a, b).iter().enumerate() {
                assert_eq!(*value, spectra.at(f, a, b), "({a}, {b}) at {f}");
                assert_eq!(value.conj(), spectra.at(f, b, a), "({b}, {a}) at {f}");
            }
        }
        assert!(spectra.pair(2, 1) != spectra.pair(3, 1) && spectra.pair(3, 0) != spectra.pair(3, 1));
    }

    #[test]
    fn trials_weigh_as_their_segments_and_averages_add() {
        let (one, two) = (trial(0, 300), trial(1000, 700));
        let pooled = CrossSpectra::pool(&[one.clone(), two.clone()]).expect("alike");
        assert_eq!((pooled.segments(), pooled.trials()), (one.segments() + two.segments(), 2));
        assert!((pooled.effective_averages() - one.effective_averages() - two.effective_averages()).abs() < 1e-12);
        let (a, b) = (one.segments() as f64, two.segments() as f64);
        let expected = (one.at(5, 3, 1) * a + two.at(5, 3, 1) * b) / (a + b);
        assert!((pooled.at(5, 3, 1) - expected).norm() <= 4.0 * f64::EPSILON * expected.norm());
        assert!(matches!(CrossSpectra::pool(&[]), Err(SpectraError::Empty)));
        let other = Welch::new(64).spectra(50.0, &[&[0.0; 300][..]; 4]).expect("long enough");
        assert!(matches!(CrossSpectra::pool(&[one, other]), Err(SpectraError::Mismatch { trial: 2, what: "frequencies", .. })));
    }
}
