//! Welch's method: one pass, each channel transformed once per segment.

use crate::cross_spectra::{CrossSpectra, Kernel};
use crate::segments::{self, Detrend, effective_averages};
use crate::window::Window;
use num_complex::Complex64;
use rayon::prelude::*;
use realfft::{RealFftPlanner, RealToComplex};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

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
    /// Symmetric instead of periodic window.
    pub window_symmetric: bool,
    /// What is taken off each segment.
    pub detrend: Detrend,
}

/// Why Welch's method cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WelchError {
    /// A segment has no samples.
    #[error("nperseg is 0; a segment needs samples")]
    EmptySegment,
    /// The overlap leaves no step.
    #[error("noverlap {noverlap} is not below nperseg {nperseg}; take for example {}", nperseg / 2)]
    Overlap {
        /// Samples in a segment.
        nperseg: usize,
        /// Samples that neighbours share.
        noverlap: usize,
    },
    /// The transform is shorter than a segment.
    #[error("nfft {nfft} is below nperseg {nperseg}; a shorter transform would throw samples away")]
    ShortTransform {
        /// Samples in a segment.
        nperseg: usize,
        /// Length of the transform.
        nfft: usize,
    },
    /// The record is shorter than a segment.
    #[error("the recording has {len} samples, a segment needs {nperseg}; lower nperseg to {} or record longer", (len / 2).max(1))]
    TooShort {
        /// Samples in the recording.
        len: usize,
        /// Samples in a segment.
        nperseg: usize,
    },
    /// A channel differs in length.
    #[error("channel {channel} has {found} samples, the first has {expected}")]
    Length {
        /// Index of the channel.
        channel: usize,
        /// Samples in the first.
        expected: usize,
        /// Samples in this one.
        found: usize,
    },
    /// A sample is not a number.
    #[error("channel {channel} is not a finite number at sample {sample}; cut that stretch out or repair it")]
    NotFinite {
        /// Index of the channel.
        channel: usize,
        /// Index of the sample.
        sample: usize,
    },
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
        for (channel, samples) in channels.iter().enumerate() {
            if samples.len() != len {
                return Err(WelchError::Length { channel, expected: len, found: samples.len() });
            }
            if let Some(sample) = samples.iter().position(|s| !s.is_finite()) {
                return Err(WelchError::NotFinite { channel, sample });
            }
        }
        let segments = segments::count(len, self.nperseg, self.hop());
        if segments == 0 {
            return Err(WelchError::TooShort { len, nperseg: self.nperseg });
        }
        let plan = Plan::new(self);
        let blocks = segments.div_ceil(BLOCK);
        let wave = rayon::current_num_threads().max(1);
        let mut total = vec![Complex64::default(); pairs(channels.len()) * plan.bins];
        let mut first = 0;
        while first < blocks {
            let sums: Vec<Vec<Complex64>> = (first..blocks.min(first + wave))
                .into_par_iter()
                .map(|block| {
                    let mut sum = Sum::new(&plan, channels.len());
                    for k in block * BLOCK..segments.min((block + 1) * BLOCK) {
                        let at = k * self.hop();
                        sum.add(&plan, channels.iter().map(|c| &c[at..at + self.nperseg]));
                    }
                    sum.lower
                })
                .collect();
            for sum in &sums {
                total.iter_mut().zip(sum).for_each(|(t, s)| *t += s);
            }
            first += wave;
        }
        Ok(self.finish(&plan, sample_rate_hz, channels.len(), segments, total))
    }

    /// An estimator that takes samples as they come, with memory for one segment only.
    ///
    /// # Errors
    /// [`WelchError`] if the settings contradict each other.
    pub fn stream(&self, sample_rate_hz: f64, channels: usize) -> Result<WelchStream, WelchError> {
        self.validate()?;
        let plan = Plan::new(self);
        Ok(WelchStream {
            sum: Sum::new(&plan, channels),
            total: vec![Complex64::default(); pairs(channels) * plan.bins],
            waiting: vec![Vec::with_capacity(2 * self.nperseg); channels],
            settings: self.clone(),
            plan,
            sample_rate_hz,
            segments: 0,
            seen: 0,
        })
    }

    fn finish(&self, plan: &Plan, sample_rate_hz: f64, channels: usize, segments: usize, mut lower: Vec<Complex64>) -> CrossSpectra {
        let power: f64 = plan.window.iter().map(|w| w * w).sum();
        let scale = 1.0 / (segments as f64 * sample_rate_hz * power);
        let bins = plan.bins;
        for (i, s) in lower.iter_mut().enumerate() {
            let f = i % bins;
            let one_sided = if f == 0 || (f == bins - 1 && self.nfft.is_multiple_of(2)) { 1.0 } else { 2.0 };
            *s *= scale * one_sided;
        }
        let fourth: f64 = plan.window.iter().map(|w| w.powi(4)).sum();
        CrossSpectra {
            channels,
            sample_rate_hz,
            frequency_hz: (0..bins).map(|f| f as f64 * sample_rate_hz / self.nfft as f64).collect(),
            lower,
            effective_averages: effective_averages(&plan.window, self.hop(), segments),
            segments,
            trials: 1,
            independent_spacing_hz: sample_rate_hz * fourth / (power * power),
            kernel: kernel(&plan.window, sample_rate_hz),
            mean_removed: self.detrend != Detrend::None,
        }
    }
}

/// Welch's method on samples that arrive piece by piece.
///
/// ```
/// use ndof_signal::Welch;
/// let x: Vec<f64> = (0..5000).map(|k| (k as f64).sin()).collect();
/// let welch = Welch::new(256);
/// let mut stream = welch.stream(100.0, 1)?;
/// for piece in x.chunks(77) {
///     stream.push(&[piece])?;
/// }
/// assert_eq!(stream.spectra()?, welch.spectra(100.0, &[&x])?);
/// # Ok::<(), ndof_signal::WelchError>(())
/// ```
#[derive(Clone)]
pub struct WelchStream {
    settings: Welch,
    plan: Plan,
    sum: Sum,
    total: Vec<Complex64>,
    waiting: Vec<Vec<f64>>,
    sample_rate_hz: f64,
    segments: usize,
    seen: usize,
}

impl WelchStream {
    /// Takes the next samples of every channel.
    ///
    /// # Errors
    /// [`WelchError`] if the pieces differ in length or hold a NaN; nothing is taken then.
    pub fn push(&mut self, channels: &[&[f64]]) -> Result<(), WelchError> {
        let expected = channels.first().map_or(0, |c| c.len());
        for (channel, samples) in channels.iter().enumerate() {
            if samples.len() != expected || channels.len() != self.waiting.len() {
                return Err(WelchError::Length { channel, expected, found: samples.len() });
            }
            if let Some(sample) = samples.iter().position(|s| !s.is_finite()) {
                return Err(WelchError::NotFinite { channel, sample: self.seen + sample });
            }
        }
        self.seen += expected;
        for (waiting, samples) in self.waiting.iter_mut().zip(channels) {
            waiting.extend_from_slice(samples);
        }
        let (nperseg, hop) = (self.settings.nperseg, self.settings.hop());
        let mut at = 0;
        while self.waiting.first().is_some_and(|w| w.len() >= at + nperseg) {
            self.sum.add(&self.plan, self.waiting.iter().map(|c| &c[at..at + nperseg]));
            self.segments += 1;
            at += hop;
            if self.segments.is_multiple_of(BLOCK) {
                self.total.iter_mut().zip(&mut self.sum.lower).for_each(|(t, s)| *t += std::mem::take(s));
            }
        }
        self.waiting.iter_mut().for_each(|w| drop(w.drain(..at)));
        Ok(())
    }

    /// Segments complete so far.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// The spectra of all samples so far; the stream goes on.
    ///
    /// # Errors
    /// [`WelchError::TooShort`] while there is no whole segment.
    pub fn spectra(&self) -> Result<CrossSpectra, WelchError> {
        if self.segments == 0 {
            return Err(WelchError::TooShort { len: self.seen, nperseg: self.settings.nperseg });
        }
        let mut lower = self.total.clone();
        if !self.segments.is_multiple_of(BLOCK) {
            lower.iter_mut().zip(&self.sum.lower).for_each(|(t, s)| *t += s);
        }
        Ok(self.settings.finish(&self.plan, self.sample_rate_hz, self.waiting.len(), self.segments, lower))
    }
}

fn pairs(channels: usize) -> usize {
    channels * (channels + 1) / 2
}

#[derive(Clone)]
struct Plan {
    window: Vec<f64>,
    detrend: Detrend,
    bins: usize,
    fft: Arc<dyn RealToComplex<f64>>,
}

impl Plan {
    fn new(settings: &Welch) -> Self {
        Plan {
            window: settings.window.samples(settings.nperseg, settings.window_symmetric),
            detrend: settings.detrend,
            bins: settings.nfft / 2 + 1,
            fft: RealFftPlanner::new().plan_fft_forward(settings.nfft),
        }
    }
}

/// A running sum of the lower triangle, with the buffers of one segment.
#[derive(Clone)]
struct Sum {
    lower: Vec<Complex64>,
    input: Vec<f64>,
    scratch: Vec<Complex64>,
    spectra: Vec<Vec<Complex64>>,
}

impl Sum {
    fn new(plan: &Plan, channels: usize) -> Self {
        Sum {
            lower: vec![Complex64::default(); pairs(channels) * plan.bins],
            input: plan.fft.make_input_vec(),
            scratch: plan.fft.make_scratch_vec(),
            spectra: vec![plan.fft.make_output_vec(); channels],
        }
    }

    fn add<'a>(&mut self, plan: &Plan, segment: impl Iterator<Item = &'a [f64]>) {
        let n = plan.window.len();
        for (spectrum, samples) in self.spectra.iter_mut().zip(segment) {
            self.input[..n].copy_from_slice(samples);
            plan.detrend.apply(&mut self.input[..n]);
            self.input[..n].iter_mut().zip(&plan.window).for_each(|(x, w)| *x *= w);
            self.input[n..].fill(0.0);
            // Lengths are those of the plan, so the transform cannot refuse.
            let done = plan.fft.process_with_scratch(&mut self.input, spectrum, &mut self.scratch);
            debug_assert!(done.is_ok());
        }
        let bins = plan.bins;
        for a in 0..self.spectra.len() {
            for b in 0..=a {
                let pair = a * (a + 1) / 2 + b;
                let sum = &mut self.lower[pair * bins..(pair + 1) * bins];
                for ((s, x), y) in sum.iter_mut().zip(&self.spectra[a]).zip(&self.spectra[b]) {
                    s.re += x.re * y.re + x.im * y.im;
                    s.im += x.im * y.re - x.re * y.im;
                }
            }
        }
    }
}

/// |W(ν)|² on a grid of a sixteenth of a bin, out to eight bins (for Hann, all but 1e-7 of the power).
fn kernel(window: &[f64], sample_rate_hz: f64) -> Kernel {
    const FINENESS: usize = 16;
    const REACH_BINS: usize = 8;
    let n = window.len();
    let step_hz = sample_rate_hz / (n * FINENESS) as f64;
    let half: Vec<f64> = (0..=(REACH_BINS * FINENESS).min(n * FINENESS / 2))
        .map(|m| {
            let turn = std::f64::consts::TAU * m as f64 / (n * FINENESS) as f64;
            window.iter().enumerate().map(|(k, w)| Complex64::cis(-turn * k as f64) * w).sum::<Complex64>().norm_sqr()
        })
        .collect();
    let total = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    let reach = half.len() as isize - 1;
    let (offset_hz, weight) = (-reach..=reach).map(|m| (m as f64 * step_hz, half[m.unsigned_abs()] / total)).unzip();
    Kernel { offset_hz, weight }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64, n: usize) -> Vec<f64> {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn a_pure_delay_turns_the_phase_down() {
        let x = noise(1, 20_000);
        let late: Vec<f64> = std::iter::repeat_n(0.0, 3).chain(x.iter().copied()).take(x.len()).collect();
        let s = Welch::new(512).spectra(100.0, &[&x, &late]).expect("valid");
        let f = 20;
        let h = s.at(f, 1, 0) / s.at(f, 0, 0);
        let expected = -std::f64::consts::TAU * s.frequency_hz()[f] * 0.03;
        assert!((h.arg() - expected).abs() < 0.02, "{} against {expected}", h.arg());
    }

    #[test]
    fn the_power_of_white_noise_is_its_variance() {
        let x = noise(2, 200_000);
        let s = Welch::new(256).spectra(50.0, &[&x]).expect("valid");
        let total: f64 = (0..s.frequency_hz().len()).map(|f| s.power(f, 0)).sum::<f64>() * 50.0 / 256.0;
        let variance = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        // Each segment loses its mean: 1/256 of the power, and Hann spreads that over three bins.
        assert!((total / variance - 1.0).abs() < 0.01, "{}", total / variance);
    }

    #[test]
    fn stream_and_threads_give_the_same_bytes() {
        let (x, y) = (noise(3, 30_000), noise(4, 30_000));
        let welch = Welch { noverlap: 96, ..Welch::new(128) };
        let all = welch.spectra(10.0, &[&x, &y]).expect("valid");
        let mut stream = welch.stream(10.0, 2).expect("valid");
        for (a, b) in x.chunks(1009).zip(y.chunks(1009)) {
            stream.push(&[a, b]).expect("valid");
        }
        assert_eq!(stream.spectra().expect("segments"), all);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool").install(|| welch.spectra(10.0, &[&x, &y]));
        assert_eq!(one.expect("valid"), all);
    }

    #[test]
    fn the_kernel_of_hann_has_the_variance_of_theory() {
        let s = Welch::new(256).spectra(256.0, &[&noise(5, 1024)]).expect("valid");
        let k = s.kernel();
        assert!((k.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // σ_W² = 1/(3 T²), T = 1 s here.
        let variance: f64 = k.offset_hz.iter().zip(&k.weight).map(|(f, w)| f * f * w).sum();
        assert!((variance - 1.0 / 3.0).abs() < 1e-3, "{variance}");
        assert!((s.independent_spacing_hz() - 35.0 / 18.0).abs() < 1e-9);
    }

    #[test]
    fn contradictions_are_refused_with_a_remedy() {
        let x = [0.0; 100];
        assert!(matches!(Welch::new(200).spectra(1.0, &[&x]), Err(WelchError::TooShort { len: 100, nperseg: 200 })));
        assert!(matches!(Welch { noverlap: 64, ..Welch::new(64) }.spectra(1.0, &[&x]), Err(WelchError::Overlap { .. })));
        assert!(matches!(Welch { nfft: 32, ..Welch::new(64) }.spectra(1.0, &[&x]), Err(WelchError::ShortTransform { .. })));
        let mut y = x;
        y[7] = f64::NAN;
        assert!(matches!(Welch::new(64).spectra(1.0, &[&x, &y]), Err(WelchError::NotFinite { channel: 1, sample: 7 })));
    }
}
