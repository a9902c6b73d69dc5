//! How much of what a baseline leaves a cause explains: held-out errors weighed by the noise that the best model has at each frequency.

use crate::judge::{Errors, Floor, explained};
use crate::layout::{Layout, filter};
use ndof_signal::forward_transform;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Resolution of the noise's spectrum, for a band to 12 Hz.
const RESOLUTION_HZ: f64 = 0.5;

/// The measure of held-out errors.
///
/// A force of the limb's own moves it most at its resonance, and hides there what a model gains elsewhere. Errors e of every model are therefore
/// whitened by the spectrum S of what the best one leaves, E(f) / √S(f) within the band: their power is then minus twice the log-likelihood of
/// the held-out part, but for a constant.
pub(crate) struct Measure {
    /// S of each output, from 0 Hz by `spacing_hz`; nothing where the plant's windows leave no spectrum.
    spectra: Option<Vec<Vec<f64>>>,
    spacing_hz: f64,
    top_hz: f64,
    rate_hz: f64,
    /// What the best model leaves, in this measure, and the share of it that no model predicts.
    best: Errors,
    floor: f64,
    /// Length of the blocks that are drawn anew, and of the held-out part.
    block_s: f64,
    duration_s: f64,
    resamples: usize,
    seed: u64,
}

impl Measure {
    /// By what the best model leaves; `floor` is the share of the outputs' power that no model predicts.
    pub fn new(best: &Errors, floor: f64, layout: &Layout, duration_s: f64, (resamples, seed): (usize, u64)) -> Self {
        let rate_hz = best.rate_hz.unwrap_or(f64::NAN);
        let per = best.signed.first().map_or(0, Vec::len) / best.trials.max(1);
        let top_hz = layout.frequency_hz[layout.lines() - 1];
        let spacing_hz = rate_hz / per.max(1) as f64;
        let reach = (0.5 * RESOLUTION_HZ / layout.time_s / spacing_hz).ceil();
        let finite = best.signed.iter().flatten().all(|e| e.is_finite());
        let spectra = (reach.is_finite() && finite && per > 1).then(|| best.signed.iter().map(|e| smoothed(e, per, reach as usize)).collect());
        let least = best.mean().filter(|mean| *mean > 0.0).map_or(1.0, |mean| (floor / mean).min(1.0));
        let block_s = (2.0 * layout.time_s).max(0.2);
        let measure = Measure { spectra, spacing_hz, top_hz, rate_hz, best: best.clone(), floor: least, block_s, duration_s, resamples, seed };
        Measure { best: measure.weighed(best), ..measure }
    }

    /// The errors in this measure.
    fn weighed(&self, errors: &Errors) -> Errors {
        let Some(spectra) = &self.spectra else { return errors.clone() };
        let per = (errors.signed.first().map_or(0, Vec::len) / errors.trials.max(1)).max(1);
        let whitened = |(signed, spectrum): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            let weight = |s: Complex64| {
                let hz = s.im / TAU;
                let at = ((hz / self.spacing_hz).round() as usize).min(spectrum.len() - 1);
                Complex64::from(if hz > self.top_hz { 0.0 } else { 1.0 / spectrum[at].sqrt() })
            };
            signed.chunks_exact(per).flat_map(|trial| filter(trial, self.rate_hz, weight)).collect()
        };
        errors.with(errors.signed.iter().zip(spectra).map(whitened).collect())
    }

    /// Mean square of the errors in this measure.
    pub fn size(&self, errors: &Errors) -> f64 {
        self.weighed(errors).mean().unwrap_or(f64::INFINITY)
    }

    /// Share of what the baseline leaves above the floor that the step from `before` to `after` removes, with its 95 % interval.
    pub fn share(&self, [baseline, before, after]: [&Errors; 3]) -> (Option<f64>, Option<[f64; 2]>) {
        let [baseline, before, after] = [baseline, before, after].map(|errors| self.weighed(errors));
        explained([&baseline, &before, &after], Floor { best: &self.best, share: self.floor }, self.block_s, self.duration_s, self.resamples, self.seed)
    }
}

/// The power spectrum of an error, the mean over its trials and over `reach` frequencies to each side.
fn smoothed(error: &[f64], per: usize, reach: usize) -> Vec<f64> {
    let forward = forward_transform(per);
    let mut power = vec![0.0; per / 2 + 1];
    for trial in error.chunks_exact(per) {
        let (mut buffer, mut spectrum) = (trial.to_vec(), forward.make_output_vec());
        if forward.process(&mut buffer, &mut spectrum).is_ok() {
            power.iter_mut().zip(&spectrum).for_each(|(p, s)| *p += s.norm_sqr());
        }
    }
    (0..power.len())
        .map(|k| {
            let near = &power[k.saturating_sub(reach)..(k + reach + 1).min(power.len())];
            (near.iter().sum::<f64>() / near.len() as f64).max(f64::MIN_POSITIVE)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// What is gained below a strong low noise: the error of the plain power says nothing of it.
    #[test]
    fn noise_of_one_frequency_does_not_hide_what_is_gained_at_another() {
        let (rate_hz, samples) = (168.0, 4032);
        let tone = |hz: f64, phase: f64| move |k: usize| (2.0 * PI * hz * k as f64 / rate_hz + phase).sin();
        let ragged = |k: usize| ((k * 7919 + k * k * 31) % 1009) as f64 / 1009.0 - 0.5;
        // A force of the limb's own near 2 Hz, whose size changes; what is missing lies near 8 Hz and is 30 times smaller.
        let own: Vec<f64> = (0..samples).map(|k| tone(2.0, 0.0)(k) * (1.0 + tone(0.17, 1.0)(k)) + 0.01 * ragged(k)).collect();
        let missing: Vec<f64> = (0..samples).map(|k| 0.03 * (tone(7.9, 0.3)(k) + tone(8.2, 2.0)(k))).collect();
        let pairs = |error: &dyn Fn(usize) -> f64| vec![(0..samples).map(|k| (tone(1.0, 0.0)(k) + error(k), tone(1.0, 0.0)(k))).collect::<Vec<_>>()];
        let errors = |error: &dyn Fn(usize) -> f64| Errors { rate_hz: Some(rate_hz), ..Errors::new(&pairs(error), 1, false) };
        // The model that lacks nothing has lost a little of the own force's power by chance.
        let (before, after) = (errors(&|k| own[k] * 0.999 + missing[k]), errors(&|k| own[k]));
        assert!(before.mean() < after.mean());
        let layout = Layout::new(1, 1, samples, rate_hz, (0.0, 12.0));
        let measure = Measure::new(&after, after.mean().expect("finite"), &layout, samples as f64 / rate_hz, (200, 1));
        // A cause that leaves a fifth of what is missing, a twenty-fifth of its power.
        let (share, interval) = measure.share([&before, &before, &errors(&|k| own[k] + 0.2 * missing[k])]);
        assert!(share.is_some_and(|share| share > 0.9) && interval.is_some_and(|[low, _]| low > 0.5), "{share:?} {interval:?}");
        assert!(measure.size(&before) > 2.0 * measure.size(&after));
    }
}
