//! Welch's method: one pass, each channel transformed once per segment.

mod in_turn;
mod padded;
mod partial;
mod plan;
mod stream;
mod sum;
mod windowed;

use crate::cross_spectra::CrossSpectra;
use crate::segments::{self, Detrend, SamplesError, effective_averages, first_not_finite};
use crate::window::Window;
use in_turn::InTurn;
use num_complex::Complex64;
pub use partial::WelchPartial;
use plan::Plan;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};
pub use stream::WelchStream;
use sum::Sum;

/// Segments summed together before they are added to the total. The order of summation is fixed by it, so that a
/// stream, one thread and many threads give the same bytes.
const BLOCK: usize = 64;

/// Settings of Welch's method, in SciPy's names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Welch {
    /// Samples in a segment.
    pub nperseg: usize,
    /// Samples that neighbours share.
    pub noverlap: usize,
    /// Length of the transform; more than `nperseg` pads with zeros (a finer grid, not a finer resolution).
    pub nfft: usize,
    /// Data window.
    pub window: Window,
    /// Symmetric window in place of the periodic one.
    pub window_symmetric: bool,
    /// What is removed from each segment.
    pub detrend: Detrend,
}

/// Why Welch's method cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum WelchError {
    /// A segment has no samples.
    #[error("nperseg is 0; a segment needs samples")]
    EmptySegment,
    /// The overlap leaves no step.
    #[error("noverlap {noverlap} is not below nperseg {nperseg}; take for example {}", nperseg / 2)]
    Overlap { nperseg: usize, noverlap: usize },
    /// The transform is shorter than a segment.
    #[error("nfft {nfft} is below nperseg {nperseg}; a shorter transform would throw samples away")]
    ShortTransform { nperseg: usize, nfft: usize },
    /// The record is shorter than a segment.
    #[error("the recording has {len} samples, a segment needs {nperseg}; lower nperseg to {} or record longer", (len / 2).max(1))]
    TooShort { len: usize, nperseg: usize },
    /// Channels that cannot be analysed together.
    #[error(transparent)]
    Samples(#[from] SamplesError),
    /// A piece of a stream does not have the stream's channels.
    #[error("a piece has {found} channels, the stream has {expected}")]
    Channels { expected: usize, found: usize },
    /// Partial sums do not make a whole.
    #[error("partial sums do not fit together: {why}; merge each block of one record's one analysis once")]
    Merge { why: &'static str },
}

impl Welch {
    /// Hann segments of `nperseg` samples that overlap by half, each without its mean.
    pub fn new(nperseg: usize) -> Self {
        Welch { nperseg, noverlap: nperseg / 2, nfft: nperseg, window: Window::Hann, window_symmetric: false, detrend: Detrend::Constant }
    }

    /// The paper's first setting: 8192-sample segments that overlap by 4096, fine in frequency (5 segments in 50 s).
    pub fn fine() -> Self {
        Welch::new(8192)
    }

    /// The paper's second setting: 2048-sample segments that overlap by 1536, zero-padded to 8192, low in random
    /// error (45 segments in 50 s, 23.65 of them effective).
    pub fn smooth() -> Self {
        Welch { noverlap: 1536, nfft: 8192, ..Welch::new(2048) }
    }

    fn hop(&self) -> usize {
        self.nperseg - self.noverlap
    }

    fn validate(&self) -> Result<(), WelchError> {
        if self.nperseg == 0 {
            return Err(WelchError::EmptySegment);
        }
        if self.noverlap >= self.nperseg {
            return Err(WelchError::Overlap { nperseg: self.nperseg, noverlap: self.noverlap });
        }
        if self.nfft < self.nperseg {
            return Err(WelchError::ShortTransform { nperseg: self.nperseg, nfft: self.nfft });
        }
        Ok(())
    }

    /// Cross-spectra of all `channels` of one trial.
    ///
    /// S_ab(f) = c / (K fs Σw²) Σ_k A_k(f) B_k(f)*, c = 2 except at 0 Hz and Nyquist.
    ///
    /// Equal to `scipy.signal.csd(channels[b], channels[a], …)` for every pair, in one pass.
    ///
    /// # Errors
    /// [`WelchError`] if the settings contradict each other, or the record is too short, ragged or holds a NaN.
    ///
    /// ```
    /// use ndof_signal::Welch;
    /// let tone: Vec<f64> = (0..1000).map(|k| (k as f64 * 0.2).sin()).collect();
    /// let spectra = Welch::new(200).spectra(100.0, &[&tone])?;
    /// assert_eq!(spectra.segments(), 9);
    /// # Ok::<(), ndof_signal::WelchError>(())
    /// ```
    pub fn spectra(&self, sample_rate_hz: f64, channels: &[&[f64]]) -> Result<CrossSpectra, WelchError> {
        self.validate()?;
        let len = channels.first().map_or(0, |c| c.len());
        if let Some((channel, samples)) = channels.iter().enumerate().find(|(_, samples)| samples.len() != len) {
            return Err(SamplesError::Length { channel, expected: len, found: samples.len() }.into());
        }
        let segments = segments::count(len, self.nperseg, self.hop());
        let summed = if segments == 0 { 0 } else { (segments - 1) * self.hop() + self.nperseg };
        let not_finite_from = |from: usize| {
            let first = |(channel, samples): (usize, &&[f64])| Some(SamplesError::NotFinite { channel, sample: from + first_not_finite(&samples[from..])? });
            channels.iter().enumerate().find_map(first)
        };
        if segments == 0 {
            return Err(not_finite_from(0).map_or(WelchError::TooShort { len, nperseg: self.nperseg }, WelchError::from));
        }
        let plan = Plan::of(self);
        let (densities, finite) = self.densities(&plan, sample_rate_hz, channels, segments);
        // To look at every sample first would be one more pass through memory. A sum of finite samples may be infinite, too.
        if let Some(error) = not_finite_from(if finite { summed } else { 0 }) {
            return Err(error.into());
        }
        Ok(self.finish(&plan, sample_rate_hz, channels.len(), segments, densities))
    }

    /// The products of all segments, scaled, and whether the samples in them are surely finite. Whichever threads sum the blocks, they are added up
    /// in order: a thread that has its block adds it as soon as the one before is in, while the others go on.
    fn densities(&self, plan: &Plan, sample_rate_hz: f64, channels: &[&[f64]], segments: usize) -> (Vec<Complex64>, bool) {
        let scale = plan.scale(sample_rate_hz, segments);
        let blocks = segments.div_ceil(BLOCK);
        let mut sums = plan.take_sums(channels.len(), blocks.min(rayon::current_num_threads()).max(1));
        let next = AtomicUsize::new(0);
        let total = InTurn::new(Vec::new());
        let work = |sum: &mut Sum| {
            let _guard = total.guard();
            loop {
                let block = next.fetch_add(1, Ordering::Relaxed);
                if block >= blocks {
                    return;
                }
                for k in block * BLOCK..segments.min((block + 1) * BLOCK) {
                    let at = k * self.hop();
                    sum.add(&plan.transform, channels.iter().map(|c| &c[at..at + self.nperseg]));
                }
                // While the others may still add theirs.
                sum.flush();
                // The blocks before are being summed by threads that run: each took its block, as this one did, when it began with it.
                total.add(block, |total| sum.drain_into(&plan.transform, if block + 1 == blocks { scale } else { 1.0 }, total));
            }
        };
        match &mut sums[..] {
            [one] => work(one),
            many => rayon::scope(|scope| many.iter_mut().for_each(|sum| scope.spawn(|_| work(sum)))),
        }
        let finite = sums.iter_mut().fold(true, |all, sum| all & sum.take_finite());
        plan.give_back(sums);
        (total.into_inner(), finite)
    }

    /// Spectra from the sums of products times the plan's scale.
    fn finish(&self, plan: &Plan, sample_rate_hz: f64, channels: usize, segments: usize, mut lower: Vec<Complex64>) -> CrossSpectra {
        let bins = plan.transform.bins;
        // What has no mirror image is not twice in the sum of the power.
        for pair in lower.chunks_exact_mut(bins) {
            pair[0] *= 0.5;
            if self.nfft.is_multiple_of(2) {
                pair[bins - 1] *= 0.5;
            }
        }
        CrossSpectra {
            channels,
            sample_rate_hz,
            frequency_hz: (0..bins).map(|f| f as f64 * sample_rate_hz / self.nfft as f64).collect(),
            lower,
            effective_averages: effective_averages(&plan.transform.window, self.hop(), segments),
            segments,
            trials: 1,
            independent_spacing_hz: sample_rate_hz * plan.spacing,
            kernel: plan.kernel(sample_rate_hz),
            mean_removed: self.detrend != Detrend::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::noise;

    #[test]
    fn threads_give_the_same_bytes() {
        let (x, y) = (noise(3, 0, 30_000), noise(4, 0, 30_000));
        let welch = Welch { noverlap: 96, ..Welch::new(128) };
        let all = welch.spectra(10.0, &[&x, &y]).expect("valid");
        for threads in [1, 2, 3, 20] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            assert_eq!(pool.install(|| welch.spectra(10.0, &[&x, &y])).expect("valid"), all, "{threads} threads");
        }
    }

    #[test]
    fn the_kernel_of_hann_has_the_variance_of_theory() {
        let s = Welch::new(256).spectra(256.0, &[&noise(5, 0, 1024)]).expect("valid");
        let k = s.kernel();
        assert!((k.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // σ_W² = 1/(3 T²), T = 1 s here.
        let variance: f64 = k.offset_hz.iter().zip(&k.weight).map(|(f, w)| f * f * w).sum();
        assert!((variance - 1.0 / 3.0).abs() < 1e-3, "{variance}");
        assert!((s.independent_spacing_hz() - 35.0 / 18.0).abs() < 1e-9);
    }

    #[test]
    fn what_segments_lost_is_said() {
        let mean_removed = |detrend| Welch { detrend, ..Welch::new(64) }.spectra(1.0, &[&noise(6, 0, 256)]).expect("valid").mean_removed();
        assert!(mean_removed(Detrend::Constant) && mean_removed(Detrend::Linear) && !mean_removed(Detrend::None));
    }

    #[test]
    fn contradictions_are_refused_with_a_remedy() {
        let x = [0.0; 100];
        assert!(matches!(Welch::new(200).spectra(1.0, &[&x]), Err(WelchError::TooShort { len: 100, nperseg: 200 })));
        assert!(matches!(Welch { noverlap: 64, ..Welch::new(64) }.spectra(1.0, &[&x]), Err(WelchError::Overlap { .. })));
        assert!(matches!(Welch { nfft: 32, ..Welch::new(64) }.spectra(1.0, &[&x]), Err(WelchError::ShortTransform { .. })));
        let mut y = x;
        y[7] = f64::NAN;
        assert!(matches!(Welch::new(64).spectra(1.0, &[&x, &y]), Err(WelchError::Samples(SamplesError::NotFinite { channel: 1, sample: 7 }))));
    }

    #[test]
    fn a_sample_that_is_no_finite_number_is_found_wherever_it_is() {
        let blocks = Welch { noverlap: 16, ..Welch::new(32) };
        // Of the last five samples there is no whole segment.
        let x = noise(7, 0, 3 * BLOCK * 16 + 5);
        let padded = [48, 61, 77, 128].map(|nfft| Welch { nfft, ..blocks.clone() });
        let settings = [blocks.clone(), Welch { detrend: Detrend::None, ..blocks.clone() }].into_iter().chain(padded);
        // Under a window's zero, in the last segment, after it.
        for (welch, at) in settings.flat_map(|welch| [0, 5, 1500, x.len() - 20, x.len() - 1].map(|at| (welch.clone(), at))) {
            for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let (mut y, mut z) = (x.clone(), x.clone());
                y[at] = wrong;
                z[3] = wrong;
                for (second, third) in [(&y, &x), (&y, &z)] {
                    let found = welch.spectra(1.0, &[&x, second, third]);
                    assert!(
                        matches!(found, Err(WelchError::Samples(SamplesError::NotFinite { channel: 1, sample })) if sample == at),
                        "{wrong} at {at}: {found:?}"
                    );
                }
            }
        }
        // What was refused leaves nothing behind.
        assert_eq!(blocks.spectra(1.0, &[&x, &x, &x]).expect("finite").power(3, 2), blocks.spectra(1.0, &[&x]).expect("finite").power(3, 0));
        // A sum beyond all numbers is another matter.
        let large = vec![1e308; 64];
        assert!(Welch { detrend: Detrend::None, ..Welch::new(32) }.spectra(1.0, &[&large]).is_ok());
    }

    #[test]
    fn the_settings_of_the_paper_have_its_segments() {
        let of = |welch: Welch| welch.spectra(500.0, &[&noise(8, 0, 25_000)]).expect("valid");
        for (found, segments, averages) in [(of(Welch::fine()), 5, 4.79), (of(Welch::smooth()), 45, 23.65)] {
            assert_eq!((found.segments(), found.frequency_hz().len(), found.frequency_hz()[4096]), (segments, 4097, 250.0));
            assert!((found.effective_averages() - averages).abs() < 0.005);
        }
    }

    #[test]
    fn one_segment_is_a_periodogram() {
        let x = noise(9, 0, 65);
        let s = Welch { window: Window::Rectangular, detrend: Detrend::None, ..Welch::new(64) }.spectra(64.0, &[&x]).expect("one segment");
        let total: f64 = (0..33).map(|f| s.power(f, 0)).sum();
        assert!((total / (x[..64].iter().map(|x| x * x).sum::<f64>() / 64.0) - 1.0).abs() < 1e-12 && s.segments() == 1);
        assert!(Welch::new(65).spectra(1.0, &[&x]).is_ok() && Welch { noverlap: 63, ..Welch::new(64) }.spectra(1.0, &[&x]).is_ok());
    }

    #[test]
    fn the_kernel_of_a_rectangle_is_fejers_as_far_as_eight_bins_or_nyquist() {
        for (n, reach_hz) in [(1000, 8.0), (9, 4.5), (8, 4.0)] {
            let rectangle = Welch { window: Window::Rectangular, ..Welch::new(n) };
            let s = rectangle.spectra(n as f64, &[&noise(10, 0, n)]).expect("one segment");
            let kernel = s.kernel();
            let middle = kernel.weight.len() / 2;
            assert!((kernel.offset_hz[2 * middle] - reach_hz).abs() < 1e-12 && kernel.offset_hz[middle] == 0.0, "{n}: {:?}", kernel.offset_hz);
            for (hz, weight) in kernel.offset_hz.iter().zip(&kernel.weight).filter(|(hz, _)| **hz != 0.0) {
                let half_turn = std::f64::consts::PI * hz / n as f64;
                let expected = ((n as f64 * half_turn).sin() / (n as f64 * half_turn.sin())).powi(2);
                assert!((weight / kernel.weight[middle] - expected).abs() < 1e-12, "{n} at {hz} Hz");
            }
        }
    }

    #[test]
    fn an_analysis_of_other_channels_leaves_nothing_behind() {
        let (x, y, welch) = (noise(11, 0, 400), noise(12, 0, 400), Welch::new(44));
        let alone = welch.spectra(1.0, &[&x]).expect("valid");
        let both = welch.spectra(1.0, &[&x, &y]).expect("valid");
        assert_eq!(welch.spectra(1.0, &[&x]).expect("valid"), alone);
        assert_eq!(welch.spectra(1.0, &[&x, &y]).expect("valid"), both);
    }
}
