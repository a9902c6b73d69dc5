//! The grid of samples, blocks and frequencies that a whole diagnosis works on.

use crate::movement::mean_over;
use crate::operators::straight;
use ndof_models::schedule::{MeanOver, Splines};
use ndof_signal::{ComplexToReal, RealToComplex, forward_transform, inverse_transform, mirrored, signal_by, smooth_length, spectrum_by, without_line};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// The frequency to which the analysed band is thought to end when times are compared.
pub(crate) const REFERENCE_BAND_HZ: f64 = 12.0;
/// Samples a second for each hertz of the analysed band.
const RATE_OVER_BAND: f64 = 14.0;
/// Length of a block, for a band to 12 Hz.
const BLOCK_S: f64 = 12.0;
/// Blocks that are compared: of fewer than four the spread of a mean is hardly known (Student's quantile is 3.2 with four, 4.3 with three, 12.7 with two).
pub(crate) const FEWEST_BLOCKS: usize = 4;
/// What is dropped at both ends, for a band to 12 Hz.
const TRIM_S: f64 = 1.25;
/// Share of a block that is tapered.
const TAPER: f64 = 0.2;

/// Transforms and places shared by all trials.
#[derive(Clone)]
pub(crate) struct Layout {
    pub trials: usize,
    pub axes: usize,
    /// Working rate.
    pub rate_hz: f64,
    /// Samples of a trial at the working rate.
    pub samples: usize,
    /// How many samples at the original rate make one.
    pub factor: usize,
    pub time_s: f64,
    /// Time of the first sample since the recording began.
    pub start_s: f64,
    /// Lines that count (a tone may be masked out).
    pub keep: Vec<bool>,
    /// What stiffness and damping may follow, `[trial][time]`; no trial where there is nothing.
    pub schedule: Vec<Vec<f64>>,
    /// The mean movement that is taken out of everything that is balanced.
    pub movement: Option<MeanOver>,
    /// Weights of a trial's samples (a burst may be masked out); empty where all count.
    pub weights: Vec<Vec<f64>>,
    /// Samples before a trial at the working rate, mirrored.
    pub pad: usize,
    /// Length of the mirrored trial at the working rate.
    pub padded: usize,
    /// s = j 2 π f of the mirrored trial.
    pub s: Vec<Complex64>,
    low_pass: Vec<f64>,
    /// Extra low-pass for velocities that enter nonlinear laws.
    pub smooth: Vec<f64>,
    pub block: usize,
    pub starts: Vec<usize>,
    window: Vec<f64>,
    pub bins: Range<usize>,
    pub frequency_hz: Vec<f64>,
    /// s of the analysed bins.
    pub sj: Vec<Complex64>,
    back: Arc<dyn ComplexToReal<f64>>,
    block_forward: Arc<dyn RealToComplex<f64>>,
}

/// One channel of one trial: the spectrum of its mirrored, ramp-free samples and the ramp.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    pub spectrum: Vec<Complex64>,
    pub start: f64,
    pub slope_per_s: f64,
}

/// The track of mirrored samples.
fn tracked(mut y: Vec<f64>, rate_hz: f64) -> Track {
    let n = y.len();
    let (start, slope) = without_line(&mut y);
    let mut spectrum = spectrum_by(forward_transform(n).as_ref(), &mut y);
    spectrum.iter_mut().for_each(|v| *v /= n as f64);
    Track { spectrum, start, slope_per_s: slope * rate_hz }
}

/// Tukey's window, of unit power.
fn taper(block: usize) -> Vec<f64> {
    let at = |k: usize| {
        let u = (k as f64 + 0.5) / block as f64;
        let (edge, near) = (TAPER / 2.0, u.min(1.0 - u));
        if near >= edge { 1.0 } else { 0.5 - 0.5 * (PI * near / edge).cos() }
    };
    let window: Vec<f64> = (0..block).map(at).collect();
    let power = window.iter().map(|w| w * w).sum::<f64>();
    window.iter().map(|w| w / power.sqrt()).collect()
}

impl Layout {
    /// A layout for `trials` × `axes` channels of `samples` at `sample_rate_hz`, analysed in `band_hz`.
    pub fn new(trials: usize, axes: usize, samples: usize, sample_rate_hz: f64, band_hz: (f64, f64)) -> Self {
        let time_s = REFERENCE_BAND_HZ / band_hz.1;
        let factor = ((sample_rate_hz / (RATE_OVER_BAND * band_hz.1)).floor() as usize).max(1);
        let rate_hz = sample_rate_hz / factor as f64;
        let kept = samples / factor;
        let pad = ((2.0 * time_s * rate_hz) as usize).clamp(1, (kept / 3).max(1));
        let padded = smooth_length(kept + 2 * pad);
        let s: Vec<Complex64> = (0..=padded / 2).map(|k| Complex64::new(0.0, TAU * k as f64 * rate_hz / padded as f64)).collect();
        let top = 0.42 * rate_hz;
        let low_pass = s
            .iter()
            .map(|s| {
                let f = s.im / TAU;
                let low = 0.8 * top;
                if f <= low {
                    1.0
                } else if f >= top {
                    0.0
                } else {
                    0.5 + 0.5 * (PI * (f - low) / (top - low)).cos()
                }
            })
            .collect();
        let smooth = s.iter().map(|s| (-0.5 * (s.im / TAU / (4.0 * band_hz.1)).powi(4)).exp()).collect();
        let trim = ((TRIM_S * time_s * rate_hz) as usize).min(kept / 12);
        let inner = kept - 2 * trim;
        let wanted = ((BLOCK_S * time_s * rate_hz) as usize).max(16);
        let mut blocks = (inner / wanted).max(1);
        // A trial alone still wants blocks to compare, if they keep 40 bins or more each.
        while trials * blocks < FEWEST_BLOCKS && band_hz.1 * (inner / (blocks + 1)) as f64 / rate_hz >= 60.0 {
            blocks += 1;
        }
        // At most 4 % shorter, for a fast transform.
        let longest = inner / blocks - (inner / blocks) % 2;
        let block = (longest - longest / 25..=longest).rev().find(|n| smooth_length(*n) == *n).unwrap_or(longest);
        let starts = (0..blocks).map(|b| trim + b * block).collect();
        let df = rate_hz / block as f64;
        let first = (band_hz.0 / df).ceil() as usize;
        let last = ((band_hz.1 / df).floor() as usize).max(first + 4).min(block / 2);
        let bins = first.min(last)..last + 1;
        let frequency_hz: Vec<f64> = bins.clone().map(|k| k as f64 * df).collect();
        let sj = frequency_hz.iter().map(|f| Complex64::new(0.0, TAU * f)).collect();
        let keep = vec![true; bins.len()];
        let (back, block_forward) = (inverse_transform(padded), forward_transform(block));
        Layout {
            trials,
            axes,
            rate_hz,
            samples: kept,
            factor,
            time_s,
            start_s: 0.0,
            keep,
            schedule: vec![],
            movement: None,
            weights: vec![],
            pad,
            padded,
            s,
            low_pass,
            smooth,
            block,
            starts,
            window: taper(block),
            bins,
            frequency_hz,
            sj,
            back,
            block_forward,
        }
    }

    /// The same with the schedule of samples at the original rate.
    pub fn following(mut self, schedule: &[Vec<f64>]) -> Self {
        self.schedule = schedule.iter().map(|s| s.iter().step_by(self.factor).take(self.samples).copied().collect()).collect();
        self
    }

    /// The same about the mean movement.
    pub fn about_movement(mut self, splines: Option<Splines>) -> Self {
        let inside = self.starts[0]..self.starts[self.starts.len() - 1] + self.block;
        self.movement = splines.and_then(|splines| mean_over(&self.schedule, splines, &inside));
        self
    }

    /// The schedule of a trial.
    pub fn schedule_of(&self, trial: usize) -> &[f64] {
        self.schedule.get(trial).map_or(&[], Vec::as_slice)
    }

    /// Samples of a run that its initial states are fitted to, and that are not scored: two seconds for a band to 12 Hz.
    pub fn settled(&self) -> usize {
        ((2.0 * self.time_s.max(1.0)).min(0.05 * self.samples as f64 / self.rate_hz) * self.rate_hz) as usize
    }

    /// Blocks of all trials.
    pub fn blocks(&self) -> usize {
        self.trials * self.starts.len()
    }

    /// The trial that a block belongs to.
    pub fn trial_of(&self, block: usize) -> usize {
        block / self.starts.len()
    }

    /// Frequencies in the band.
    pub fn lines(&self) -> usize {
        self.sj.len()
    }

    /// Complex numbers in the spectra of one axis.
    pub fn size(&self) -> usize {
        self.blocks() * self.lines()
    }

    /// What a number of parameters has to gain of log-likelihood (G. Schwarz, Estimating the dimension of a model, Ann. Stat. 6 (1978) 461).
    pub fn price(&self, parameters: usize) -> f64 {
        0.5 * parameters as f64 * (self.size() as f64).ln()
    }

    /// The mirrored spectrum of samples at the original rate.
    pub fn track(&self, samples: &[f64]) -> Track {
        let factor = self.factor;
        let mut track = tracked(mirrored(&samples[..self.samples * factor], self.pad * factor, self.padded * factor), self.rate_hz * factor as f64);
        track.spectrum.truncate(self.padded / 2 + 1);
        track
    }

    /// The same of every channel of every trial.
    pub fn tracks(&self, trials: &[Vec<Vec<f64>>]) -> Vec<Vec<Track>> {
        trials.iter().map(|trial| trial.iter().map(|x| self.track(x)).collect()).collect()
    }

    /// The same of samples at the working rate.
    pub fn track_of(&self, samples: &[f64]) -> Track {
        tracked(mirrored(samples, self.pad, self.padded), self.rate_hz)
    }

    /// The samples at the working rate of `operator` applied to a track, low-passed well above the band.
    pub fn filtered(&self, track: &Track, operator: impl Fn(Complex64) -> Complex64, extra: Option<&[f64]>) -> Vec<f64> {
        let mut spectrum: Vec<Complex64> =
            self.s.iter().zip(&track.spectrum).zip(&self.low_pass).map(|((&s, x), h)| if *h > 0.0 { x * operator(s) * *h } else { Complex64::ZERO }).collect();
        if let Some(extra) = extra {
            spectrum.iter_mut().zip(extra).for_each(|(x, h)| *x *= *h);
        }
        let mut time = self.in_time(spectrum);
        let (level, rate) = straight(&operator);
        time.drain(..self.pad);
        time.truncate(self.samples);
        let offset = level * track.start + rate * track.slope_per_s;
        let slope = level * track.slope_per_s / self.rate_hz;
        time.iter_mut().enumerate().for_each(|(k, v)| *v += offset + slope * (k + self.pad) as f64);
        time
    }

    fn in_time(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        signal_by(self.back.as_ref(), &mut spectrum)
    }

    /// The track that an operator makes of a track.
    pub fn transformed(&self, track: &Track, operator: impl Fn(Complex64) -> Complex64) -> Track {
        let (level, rate) = straight(&operator);
        Track {
            spectrum: self.s.iter().zip(&track.spectrum).map(|(&s, x)| x * operator(s)).collect(),
            start: level * track.start + rate * track.slope_per_s,
            slope_per_s: level * track.slope_per_s,
        }
    }

    /// The mirrored samples of a track at the working rate, not low-passed.
    pub fn whole(&self, track: &Track) -> Vec<f64> {
        let mut time = self.in_time(track.spectrum.clone());
        time.iter_mut().enumerate().for_each(|(k, v)| *v += track.start + track.slope_per_s * k as f64 / self.rate_hz);
        time
    }

    /// The track of mirrored samples at the working rate.
    pub fn track_of_padded(&self, samples: Vec<f64>) -> Track {
        tracked(samples, self.rate_hz)
    }

    /// The spectra of samples of one trial, in all blocks: nought outside of its own.
    pub fn in_trial(&self, trial: usize, samples: &[f64]) -> Vec<Complex64> {
        let mut own = Vec::new();
        self.blocks_of(trial, samples, &mut own);
        let mut all = vec![Complex64::ZERO; self.size()];
        all[trial * own.len()..(trial + 1) * own.len()].copy_from_slice(&own);
        all
    }

    /// Tapered spectra of one trial's samples, block after block, appended to `out`.
    pub fn blocks_of(&self, trial: usize, samples: &[f64], out: &mut Vec<Complex64>) {
        let weights = self.weights.get(trial);
        let mut buffer = vec![0.0; self.block];
        let mut spectrum = self.block_forward.make_output_vec();
        let mut scratch = self.block_forward.make_scratch_vec();
        for &start in &self.starts {
            for ((b, x), w) in buffer.iter_mut().zip(&samples[start..start + self.block]).zip(&self.window) {
                *b = x * w;
            }
            if let Some(weights) = weights {
                buffer.iter_mut().zip(&weights[start..]).for_each(|(b, w)| *b *= w);
            }
            if self.block_forward.process_with_scratch(&mut buffer, &mut spectrum, &mut scratch).is_err() {
                spectrum.iter_mut().for_each(|v| *v = Complex64::new(f64::NAN, 0.0));
            }
            // The line at 0 Hz is real: it carries half of what a complex one does.
            spectrum[0] *= std::f64::consts::FRAC_1_SQRT_2;
            out.extend(spectrum[self.bins.clone()].iter().zip(&self.keep).map(|(x, keep)| if *keep { *x } else { Complex64::ZERO }));
        }
    }

    /// Share of the power of the first block of a trial that lies behind so many samples.
    pub fn behind(&self, samples: usize) -> f64 {
        self.window.iter().skip(samples.saturating_sub(self.starts[0])).map(|w| w * w).sum()
    }

    /// Spectra of all trials of one axis, about the mean movement.
    pub fn spectra<'a>(&self, trials: impl Iterator<Item = &'a [f64]>) -> Vec<Complex64> {
        let mut out = Vec::with_capacity(self.size());
        match &self.movement {
            None => trials.enumerate().for_each(|(trial, samples)| self.blocks_of(trial, samples, &mut out)),
            Some(movement) => {
                let all: Vec<&[f64]> = trials.collect();
                movement.deviation(&all).iter().enumerate().for_each(|(trial, samples)| self.blocks_of(trial, samples, &mut out));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_derivative_in_the_frequency_domain_is_the_derivative() {
        let fs = 500.0;
        let x: Vec<f64> = (0..25_000).map(|k| (TAU * 1.3 * k as f64 / fs).sin() + 0.2 * k as f64 / fs).collect();
        let layout = Layout::new(1, 1, x.len(), fs, (0.0, 12.0));
        let v = layout.filtered(&layout.track(&x), |s| s, None);
        for k in [2000, 6000, 10_000] {
            let t = k as f64 / layout.rate_hz;
            let want = TAU * 1.3 * (TAU * 1.3 * t).cos() + 0.2;
            assert!((v[k] - want).abs() < 2e-4 * TAU, "{} {want}", v[k]);
        }
    }
}
