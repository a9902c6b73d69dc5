//! Thomson's multitaper method: the whole record under several orthogonal tapers.

use crate::cache::Cache;
use crate::cross_spectra::{CrossSpectra, Kernel};
use crate::segments::{Detrend, SamplesError, require_finite};
use crate::slepian::{SlepianError, SlepianTapers, slepian_tapers};
use crate::transform::{RealToComplex, forward_transform, spectrum_by};
use num_complex::Complex64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Settings of the multitaper method.
///
/// ```
/// use ndof_signal::Multitaper;
/// let x: Vec<f64> = (0..1000).map(|k| ((k * k) as f64 * 0.1).sin()).collect();
/// let spectra = Multitaper::default().spectra(100.0, &[&x])?;
/// assert_eq!((spectra.segments(), spectra.effective_averages()), (7, 7.0));
/// assert!((spectra.independent_spacing_hz() - 0.8).abs() < 1e-12);
/// # Ok::<(), ndof_signal::MultitaperError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Multitaper {
    /// NW: the half-width of the spectral window in units of 1/T.
    pub time_bandwidth: f64,
    /// Number of tapers; 2 NW − 1 where none is given.
    pub tapers: Option<usize>,
    /// Length of the transform; the record's where none is given. More pads with zeros.
    pub nfft: Option<usize>,
    /// Thomson's adaptive weights, which take leaking tapers out where the spectrum is low.
    pub adaptive: bool,
    /// What is taken off the whole record.
    pub detrend: Detrend,
}

impl Default for Multitaper {
    /// NW = 4, seven tapers of equal weight, mean removed.
    fn default() -> Self {
        Multitaper { time_bandwidth: 4.0, tapers: None, nfft: None, adaptive: false, detrend: Detrend::Constant }
    }
}

/// Why the multitaper method cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum MultitaperError {
    /// There are no such tapers.
    #[error("making the tapers: {0}")]
    Tapers(#[from] SlepianError),
    /// The transform is shorter than the record.
    #[error("nfft {nfft} is below the {len} samples of the recording; a shorter transform would throw samples away")]
    ShortTransform { len: usize, nfft: usize },
    /// Channels that cannot be analysed together.
    #[error(transparent)]
    Samples(#[from] SamplesError),
}

impl Multitaper {
    /// Cross-spectra of all `channels` of one trial:
    ///
    /// S_ab(f) = c/(K fs) Σ_k A_k(f) B_k(f)*,  A_k(f) = Σ_n v_k(n) a(n) e^{−j2πfn/fs},  c = 2 except at 0 Hz and Nyquist.
    ///
    /// n_e = K, bins are independent 2NW/T apart, the kernel is the mean of the tapers' |V_k|².
    ///
    /// With `adaptive`, taper k weighs b_k² λ_k, b_k = S/(λ_k S + (1−λ_k) σ²/fs) (Thomson 1982, *Proc. IEEE* 70:1055;
    /// Percival & Walden 1993, sec. 7.4). The weights are the least over the channels and common to all of them, so
    /// that a linear relation between channels stays one; n_e is then the mean over the bins of (Σ w)²/Σ w².
    ///
    /// # Errors
    /// [`MultitaperError`] if the settings do not fit the record, or it is ragged, empty or holds a NaN.
    pub fn spectra(&self, sample_rate_hz: f64, channels: &[&[f64]]) -> Result<CrossSpectra, MultitaperError> {
        let len = channels.first().map_or(0, |c| c.len());
        require_finite(channels, len, 0)?;
        let nfft = self.nfft.unwrap_or(len);
        if nfft < len {
            return Err(MultitaperError::ShortTransform { len, nfft });
        }
        let count = self.tapers.unwrap_or_else(|| ((2.0 * self.time_bandwidth - 1.0).round().max(1.0)) as usize);
        let plan = PLANS.get_or_try_make(Key { len, nfft, time_bandwidth: self.time_bandwidth, count }, || Plan::new(len, nfft, self.time_bandwidth, count))?;

        let level: Vec<Vec<f64>> = channels
            .iter()
            .map(|samples| {
                let mut level = samples.to_vec();
                self.detrend.apply(&mut level);
                level
            })
            .collect();
        let mut tapered = plan.transform(&level);
        let mut effective_averages = count as f64;
        let mut scale = 1.0 / (count as f64 * sample_rate_hz);
        if self.adaptive {
            effective_averages = plan.weigh(&mut tapered, &level);
            scale = 1.0 / sample_rate_hz;
        }
        let bins = nfft / 2 + 1;
        let pairs: Vec<(usize, usize)> = (0..channels.len()).flat_map(|a| (0..=a).map(move |b| (a, b))).collect();
        let lower: Vec<Complex64> = pairs
            .par_iter()
            .flat_map_iter(|&(a, b)| {
                let mut sum = vec![Complex64::default(); bins];
                for (x, y) in tapered[a].iter().zip(&tapered[b]) {
                    sum.iter_mut().zip(x.iter().zip(y)).for_each(|(s, (x, y))| *s += x * y.conj());
                }
                sum.iter_mut().enumerate().for_each(|(f, s)| *s *= if f == 0 || 2 * f == nfft { scale } else { 2.0 * scale });
                sum
            })
            .collect();
        Ok(CrossSpectra {
            channels: channels.len(),
            sample_rate_hz,
            frequency_hz: (0..bins).map(|f| f as f64 * sample_rate_hz / nfft as f64).collect(),
            lower,
            effective_averages,
            segments: count,
            trials: 1,
            independent_spacing_hz: 2.0 * self.time_bandwidth * sample_rate_hz / len as f64,
            kernel: plan.kernel(sample_rate_hz),
            mean_removed: self.detrend != Detrend::None,
        })
    }
}

#[derive(PartialEq)]
struct Key {
    len: usize,
    nfft: usize,
    time_bandwidth: f64,
    count: usize,
}

static PLANS: Cache<Key, Plan> = Cache::new();

struct Plan {
    slepian: SlepianTapers,
    fft: Arc<dyn RealToComplex<f64>>,
    nfft: usize,
    /// Mean |V_k|² at multiples of a quarter of 1/T, from 0.
    half_kernel: Vec<f64>,
}

/// Kernel nodes in 1/T: twice as dense as the Nyquist rate of |V|², so that their sum is an integral.
const KERNEL_FINENESS: usize = 4;

impl Plan {
    fn new(len: usize, nfft: usize, time_bandwidth: f64, count: usize) -> Result<Self, SlepianError> {
        let slepian = slepian_tapers(len, time_bandwidth, count)?;
        let fft = forward_transform(nfft);
        let fine = forward_transform(KERNEL_FINENESS * len);
        // Out to four half-widths; beyond lie parts in a thousand of the last taper's energy.
        let reach = ((4.0 * time_bandwidth).ceil() as usize * KERNEL_FINENESS).min(KERNEL_FINENESS * len / 2);
        let mut half_kernel = vec![0.0; reach + 1];
        for taper in &slepian.tapers {
            let spectrum = spectrum(&fine, taper.iter().copied());
            half_kernel.iter_mut().zip(&spectrum).for_each(|(h, s)| *h += s.norm_sqr());
        }
        Ok(Plan { slepian, fft, nfft, half_kernel })
    }

    /// Transforms, `[channel][taper][bin]`.
    fn transform(&self, channels: &[Vec<f64>]) -> Vec<Vec<Vec<Complex64>>> {
        channels
            .par_iter()
            .map(|samples| self.slepian.tapers.par_iter().map(|taper| spectrum(&self.fft, samples.iter().zip(taper).map(|(x, v)| x * v))).collect())
            .collect()
    }

    /// Multiplies the transforms by the roots of the adaptive weights (which sum to one) and returns n_e.
    fn weigh(&self, tapered: &mut [Vec<Vec<Complex64>>], channels: &[Vec<f64>]) -> f64 {
        let concentration = &self.slepian.concentration;
        let mean_square: Vec<f64> = channels.iter().map(|c| c.iter().map(|x| x * x).sum::<f64>() / c.len() as f64).collect();
        let bins = self.nfft / 2 + 1;
        let weights: Vec<Vec<f64>> = (0..bins)
            .into_par_iter()
            .map(|f| {
                let mut least = vec![f64::INFINITY; concentration.len()];
                for (tapers, &white) in tapered.iter().zip(&mean_square) {
                    let power: Vec<f64> = tapers.iter().map(|t| t[f].norm_sqr()).collect();
                    least.iter_mut().zip(adaptive_weights(&power, concentration, white)).for_each(|(l, w)| *l = l.min(w));
                }
                let total: f64 = least.iter().sum();
                least.iter().map(|w| w / total).collect()
            })
            .collect();
        for tapers in tapered.iter_mut() {
            for (k, taper) in tapers.iter_mut().enumerate() {
                taper.iter_mut().zip(&weights).for_each(|(t, w)| *t *= w[k].sqrt());
            }
        }
        weights.iter().map(|w| 1.0 / w.iter().map(|w| w * w).sum::<f64>()).sum::<f64>() / bins as f64
    }

    fn kernel(&self, sample_rate_hz: f64) -> Kernel {
        let step_hz = sample_rate_hz / (KERNEL_FINENESS * self.slepian.tapers[0].len()) as f64;
        Kernel::of_half(&self.half_kernel, step_hz)
    }
}

fn spectrum(fft: &Arc<dyn RealToComplex<f64>>, samples: impl Iterator<Item = f64>) -> Vec<Complex64> {
    let mut input = fft.make_input_vec();
    input.iter_mut().zip(samples).for_each(|(i, x)| *i = x);
    spectrum_by(fft.as_ref(), &mut input)
}

/// Weights b_k² λ_k of one channel at one frequency, summing to one, by fixed-point iteration from the mean of the
/// first two tapers.
fn adaptive_weights(power: &[f64], concentration: &[f64], white: f64) -> Vec<f64> {
    /// A few steps do where little leaks. Where what the last tapers see is leakage, the iteration contracts by a quarter a step.
    const STEPS: usize = 100;
    /// A step that changes the estimate by less than this share is the last.
    const SETTLED: f64 = 1e-10;
    let mut estimate = power.iter().take(2).sum::<f64>() / power.len().min(2) as f64;
    let mut weights = vec![1.0 / power.len() as f64; power.len()];
    for _ in 0..STEPS {
        let raw: Vec<f64> = concentration
            .iter()
            .map(|l| {
                let share = estimate / (l * estimate + (1.0 - l) * white);
                if share.is_finite() { share * share * l } else { 1.0 }
            })
            .collect();
        let total: f64 = raw.iter().sum();
        if total <= 0.0 {
            break;
        }
        weights = raw.iter().map(|w| w / total).collect();
        let next: f64 = weights.iter().zip(power).map(|(w, p)| w * p).sum();
        let change = (next - estimate).abs();
        estimate = next;
        if change <= SETTLED * estimate {
            break;
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::noise;

    #[test]
    fn the_power_of_all_frequencies_is_that_of_the_tapered_samples() {
        // Parseval: exact at 0 Hz and Nyquist too, for even and odd lengths.
        for (n, nfft) in [(400, 400), (401, 401), (400, 421), (401, 640)] {
            let x = noise(11, 4, n);
            let tapers = slepian_tapers(n, 4.0, 7).expect("valid").tapers;
            let expected = tapers.iter().map(|v| v.iter().zip(&x).map(|(v, x)| (v * x).powi(2)).sum::<f64>()).sum::<f64>() / 7.0;
            let s = Multitaper { nfft: Some(nfft), detrend: Detrend::None, ..Multitaper::default() }.spectra(50.0, &[&x]).expect("valid");
            let total = (0..s.frequency_hz().len()).map(|f| s.power(f, 0)).sum::<f64>() * 50.0 / nfft as f64;
            assert!((total / expected - 1.0).abs() < 1e-12, "{n} {nfft}: {total} {expected}");
            let last = (nfft / 2) as f64 * 50.0 / nfft as f64;
            assert!((s.frequency_hz()[nfft / 2] - last).abs() < 1e-12);
        }
    }

    #[test]
    fn the_power_of_white_noise_is_its_variance_by_adaptive_weights_as_well() {
        let x = noise(11, 0, 20_000);
        let s = Multitaper { adaptive: true, ..Multitaper::default() }.spectra(50.0, &[&x]).expect("valid");
        let total: f64 = (0..s.frequency_hz().len()).map(|f| s.power(f, 0)).sum::<f64>() * 50.0 / 20_000.0;
        let variance = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        // The sum of the spectrum has a relative variance of 1/N within a factor of two; four sigma of 2/20 000.
        assert!((total / variance - 1.0).abs() < 0.04, "{}", total / variance);
    }

    #[test]
    fn adaptive_weights_are_settled() {
        let (power, concentration, white): ([f64; 4], [f64; 4], f64) = ([0.02, 0.03, 0.5, 0.9], [0.999_999, 0.99, 0.9, 0.7], 1.0);
        let weights = adaptive_weights(&power, &concentration, white);
        // In whichever unit.
        for unit in [1e-12, 1e12] {
            let other = adaptive_weights(&power.map(|p| p * unit), &concentration, white * unit);
            assert!(other.iter().zip(&weights).all(|(a, b)| (a - b).abs() < 1e-12), "{other:?}");
        }
        let estimate: f64 = weights.iter().zip(&power).map(|(w, p)| w * p).sum();
        let raw: Vec<f64> = concentration.iter().map(|l| l * (estimate / (l * estimate + (1.0 - l) * white)).powi(2)).collect();
        let total: f64 = raw.iter().sum();
        for (w, raw) in weights.iter().zip(&raw) {
            assert!((w - raw / total).abs() < 1e-8, "{weights:?}");
        }
        // Not yet after one step.
        let start: f64 = 0.025;
        assert!((weights[3] / (0.7 * (start / (0.7 * start + 0.3)).powi(2) / total) - 1.0).abs() > 0.01);
    }

    #[test]
    fn weights_that_one_channel_lowers_still_sum_to_one_for_the_other() {
        // Beside a strong tone, which takes the leaking tapers out, noise keeps its power.
        let n = 2000;
        let tone: Vec<f64> = noise(11, 6, n).iter().enumerate().map(|(k, e)| (0.5 * k as f64).sin() + 1e-4 * e).collect();
        let s = Multitaper { tapers: Some(8), adaptive: true, ..Multitaper::default() }.spectra(1.0, &[&tone, &noise(11, 7, n)]).expect("valid");
        let mean = (500..=1000).map(|f| s.power(f, 1) * if f == 1000 { 2.0 } else { 1.0 }).sum::<f64>() / 501.0 / (2.0 / 3.0);
        // As above: one sigma is 6 %.
        assert!((mean - 1.0).abs() < 0.24 && s.effective_averages() < 7.5, "{mean} {}", s.effective_averages());
    }

    #[test]
    fn tapers_that_do_not_leak_count_in_full() {
        // NW = 4, four tapers: 1 − λ is below 1e-4, so the weights are next to equal.
        let x = noise(11, 5, 1000);
        let s = Multitaper { tapers: Some(4), adaptive: true, ..Multitaper::default() }.spectra(50.0, &[&x]).expect("valid");
        assert!((s.effective_averages() - 4.0).abs() < 0.01, "{}", s.effective_averages());
        assert!((s.independent_spacing_hz() - 2.0 * 4.0 * 50.0 / 1000.0).abs() < 1e-12);
        let plain = Multitaper { tapers: Some(4), ..Multitaper::default() }.spectra(50.0, &[&x]).expect("valid");
        assert!((s.power(500, 0) / plain.power(500, 0) - 1.0).abs() < 0.05, "the last bin is weighed too");
    }

    #[test]
    fn whether_the_record_lost_its_mean_is_said() {
        let mean_removed = |detrend| Multitaper { detrend, ..Multitaper::default() }.spectra(1.0, &[&noise(11, 6, 256)]).expect("valid").mean_removed();
        assert!(mean_removed(Detrend::Constant) && mean_removed(Detrend::Linear) && !mean_removed(Detrend::None));
    }

    #[test]
    fn a_linear_relation_between_channels_survives() {
        let x = noise(11, 1, 5000);
        let y: Vec<f64> = x.iter().map(|v| -3.0 * v).collect();
        for adaptive in [false, true] {
            let s = Multitaper { adaptive, ..Multitaper::default() }.spectra(50.0, &[&x, &y]).expect("valid");
            for f in 1..s.frequency_hz().len() {
                assert!((s.at(f, 1, 0) / s.at(f, 0, 0) + 3.0).norm() < 1e-9, "{f}");
            }
        }
    }

    #[test]
    fn adaptive_weights_keep_leakage_out_of_the_low_parts() {
        // A strong tone off the bins in weak noise: far from it the last of eight tapers leaks.
        let n = 2000;
        let x: Vec<f64> = noise(11, 2, n).iter().enumerate().map(|(k, e)| (0.5 * k as f64).sin() + 1e-4 * e).collect();
        let of = |adaptive| Multitaper { tapers: Some(8), adaptive, ..Multitaper::default() }.spectra(1.0, &[&x]).expect("valid");
        let (plain, adaptive) = (of(false), of(true));
        let truth = 2.0 * 1e-8 / 3.0;
        let mean = |s: &CrossSpectra| (500..1000).map(|f| s.power(f, 0)).sum::<f64>() / 500.0 / truth;
        assert!(mean(&plain) > 2.0, "{}", mean(&plain));
        // 500 bins are about 500/8 cells of n_e ≥ 5: one sigma is 6 %.
        assert!((mean(&adaptive) - 1.0).abs() < 0.24, "{}", mean(&adaptive));
        assert!(adaptive.effective_averages() < plain.effective_averages());
    }

    #[test]
    fn the_kernel_holds_the_energy_within_the_half_width() {
        let x = noise(11, 3, 1000);
        let k = Multitaper::default().spectra(100.0, &[&x]).expect("valid").kernel().clone();
        assert!((k.weight.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let width_hz = 4.0 * 100.0 / 1000.0;
        let within: f64 = k.offset_hz.iter().zip(&k.weight).filter(|(f, _)| f.abs() <= width_hz).map(|(_, w)| w).sum();
        let expected = slepian_tapers(1000, 4.0, 7).expect("valid").concentration.iter().sum::<f64>() / 7.0;
        // The trapezoid's end nodes: half a node of the last taper on either side.
        assert!((within - expected).abs() < 0.01, "{within} against {expected}");
    }

    #[test]
    fn settings_that_do_not_fit_are_refused() {
        let x = [0.0; 100];
        let of = |m: Multitaper| m.spectra(1.0, &[&x]).unwrap_err();
        assert!(matches!(of(Multitaper { nfft: Some(64), ..Multitaper::default() }), MultitaperError::ShortTransform { len: 100, nfft: 64 }));
        assert!(matches!(of(Multitaper { time_bandwidth: 80.0, ..Multitaper::default() }), MultitaperError::Tapers(_)));
        assert!(matches!(Multitaper::default().spectra(1.0, &[]), Err(MultitaperError::Tapers(_))));
        let y = [f64::NAN; 100];
        assert!(matches!(Multitaper::default().spectra(1.0, &[&x, &y]), Err(MultitaperError::Samples(SamplesError::NotFinite { channel: 1, sample: 0 }))));
        assert!(matches!(Multitaper::default().spectra(1.0, &[&x, &y[1..]]), Err(MultitaperError::Samples(SamplesError::Length { channel: 1, .. }))));
    }
}
