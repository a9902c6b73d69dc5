//! The fitted model run over a trial, and what is left of it in time and frequency.

use super::fitted::Fitted;
use super::ticks;
use crate::trials::{Trial, Trials};
use ndarray::Array3;
use ndof_models::{Smoothing, WeightedFit};
use ndof_signal::{Kernel, forward_transform, inverse_transform, signal_by, spectrum_by};
use ndof_sysid::ResponseKind;
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// What a model makes of the recorded inputs of one trial, beside what was recorded: both within the fitted band.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlay {
    /// The trial's file.
    pub file: String,
    /// Rate of both; some samples for the shortest period are enough.
    pub sample_rate_hz: f64,
    /// Time of the first.
    pub start_s: f64,
    /// The band.
    pub band_hz: [f64; 2],
    /// One an output.
    pub outputs: Vec<Run>,
}

/// One output, measured and simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the channel.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// As recorded, within the band.
    pub measured: Vec<f64>,
    /// From the inputs alone.
    pub simulated: Vec<f64>,
}

/// Longest stretch at each end over which a trial is faded in and out, and which is then left out.
const FADE_S: f64 = 2.0;
/// The same as a share of the trial.
const FADE_SHARE: f64 = 0.05;
/// Samples drawn for each period of the band's upper end.
const SAMPLES_A_PERIOD: usize = 10;
/// Lines below which there is no curve to draw.
const FEWEST_LINES: usize = 8;

/// Runs the fitted model over one trial: Ŷ(f) = H(f) U(f) at the lines of the whole trial within the fitted band.
///
/// The trial is faded in and out over its ends, which are then left out, so that what the plant remembers of the time before the
/// recording does not count. `None` where the band holds too few lines.
pub fn overlay(trials: &Trials, trial: &Trial, fitted: &Fitted) -> Option<Overlay> {
    let (recording, roles) = (&trial.recording, &trials.roles);
    let (rate, samples, band_hz) = (recording.sample_rate_hz(), recording.len(), fitted.fit.band_hz);
    let spacing = rate / samples as f64;
    let first = ((band_hz[0] / spacing).ceil() as usize).max(1);
    let last = ((band_hz[1] / spacing).floor() as usize).min(samples.saturating_sub(1) / 2);
    if last < first + FEWEST_LINES {
        return None;
    }
    let fade = ((FADE_S * rate).min(FADE_SHARE * samples as f64) as usize).max(1);
    let spectrum = |channel: usize| lines(&recording.channels()[channel].samples, fade, first, last);
    let spectra = |channels: &[usize]| channels.iter().map(|&c| spectrum(c)).collect::<Option<Vec<_>>>();
    let frequency_hz: Vec<f64> = (first..=last).map(|k| k as f64 * spacing).collect();
    let inputs = efforts(spectra(&roles.ports.inputs)?, fitted);
    let response = response(trials, fitted, &frequency_hz);
    let points = (SAMPLES_A_PERIOD * last).min(samples);
    let cut = (fade * points).div_ceil(samples);
    let outputs = roles.ports.outputs.iter().enumerate().map(|(i, &c)| {
        let simulated: Vec<Complex64> =
            (0..frequency_hz.len()).map(|f| inputs.iter().enumerate().map(|(j, input)| response[[f, i, j]] * input[f]).sum()).collect();
        let shown = |values: &[Complex64]| synthesis(values, first, samples, points).map(|all| all[cut..points - cut].to_vec());
        let channel = &recording.channels()[c];
        Some(Run { name: channel.name.clone(), unit: channel.unit.symbol().to_owned(), measured: shown(&spectrum(c)?)?, simulated: shown(&simulated)? })
    });
    let sample_rate_hz = rate * points as f64 / samples as f64;
    Some(Overlay {
        file: trial.file.clone(),
        sample_rate_hz,
        start_s: recording.start_s() + cut as f64 / sample_rate_hz,
        band_hz,
        outputs: outputs.collect::<Option<_>>()?,
    })
}

/// What drives the axes: the inputs themselves, or their sums with the fitted gains.
fn efforts(inputs: Vec<Vec<Complex64>>, fitted: &Fitted) -> Vec<Vec<Complex64>> {
    let Some(gains) = &fitted.gains else { return inputs };
    let lines = inputs.first().map_or(0, Vec::len);
    let sum = |w: ndarray::ArrayView1<'_, f64>| (0..lines).map(|f| w.iter().zip(&inputs).map(|(gain, input)| *gain * input[f]).sum()).collect();
    gains.outer_iter().map(sum).collect()
}

/// The fitted model from the recorded inputs to the recorded outputs, whatever derivatives of the motion these are.
fn response(trials: &Trials, fitted: &Fitted, frequency_hz: &[f64]) -> Array3<Complex64> {
    let roles = &trials.roles;
    let driven_by_motion = roles.natural_kind().is_effort_over_motion();
    let kind = if driven_by_motion { ResponseKind::DynamicStiffness } else { ResponseKind::Compliance };
    let exact = WeightedFit { smoothing: Smoothing::None, ..fitted.comparison.clone() };
    let mut response = exact.seen(&fitted.whole(), &fitted.theta, kind, frequency_hz, &Kernel::default());
    if let Some(ticks) = &fitted.ticks {
        ticks::seen(ticks, fitted.sampling, &mut response, frequency_hz);
    }
    for ((f, i, j), value) in response.indexed_iter_mut() {
        let order = if driven_by_motion { roles.input_motion[j].map(|order| -order) } else { roles.output_motion[i] };
        *value *= Complex64::new(0.0, TAU * frequency_hz[f]).powi(order.unwrap_or(0));
    }
    response
}

/// Some lines of the transform of samples less their mean, faded in and out.
fn lines(samples: &[f64], fade: usize, first: usize, last: usize) -> Option<Vec<Complex64>> {
    let count = samples.len();
    let mean = samples.iter().sum::<f64>() / count as f64;
    let mut faded: Vec<f64> = samples
        .iter()
        .enumerate()
        .map(|(k, x)| {
            let inside = k.min(count - 1 - k);
            let weight = if inside < fade { (0.5 * PI * (inside as f64 + 0.5) / fade as f64).sin().powi(2) } else { 1.0 };
            weight * (x - mean)
        })
        .collect();
    Some(spectrum_by(forward_transform(count).as_ref(), &mut faded).get(first..=last)?.to_vec())
}

/// The signal whose transform over `samples` samples has these lines from `first` on, as `points` samples of the same time.
fn synthesis(lines: &[Complex64], first: usize, samples: usize, points: usize) -> Option<Vec<f64>> {
    let backward = inverse_transform(points);
    let mut spectrum = backward.make_input_vec();
    spectrum.get_mut(first..first + lines.len())?.copy_from_slice(lines);
    let mut out = signal_by(backward.as_ref(), &mut spectrum);
    out.iter_mut().for_each(|x| *x /= samples as f64);
    Some(out)
}

/// What a run leaves of an output.
#[derive(Clone, Debug, PartialEq)]
pub struct Leftover {
    /// Measured less simulated.
    pub samples: Vec<f64>,
    /// Where the densities stand.
    pub frequency_hz: Vec<f64>,
    /// Density of the residual.
    pub density: Vec<f64>,
    /// Density of the output.
    pub output_density: Vec<f64>,
    /// Autocorrelation of the residual from lag 0 at the rate that its band allows, as if that began at 0 Hz.
    pub autocorrelation: Vec<f64>,
    /// That rate.
    pub lag_rate_hz: f64,
    /// 95 % of the lags of white noise of this band lie within ± this.
    pub white_95: f64,
    /// 100 (1 − var(y − ŷ)/var(y)).
    pub vaf_percent: f64,
}

/// Lags of an autocorrelation.
const LAGS: usize = 40;
/// Points of a density.
const DENSITY_POINTS: usize = 60;

/// What `simulated` leaves of `measured`, judged within a band; `None` where it holds too few lines or a number is missing.
pub fn leftover(measured: &[f64], simulated: &[f64], sample_rate_hz: f64, band_hz: [f64; 2]) -> Option<Leftover> {
    let count = measured.len();
    let samples: Vec<f64> = measured.iter().zip(simulated).map(|(m, s)| m - s).collect();
    if samples.len() != count || !samples.iter().all(|x| x.is_finite()) {
        return None;
    }
    let spacing = sample_rate_hz / count as f64;
    let first = ((band_hz[0] / spacing).ceil() as usize).max(1);
    let last = ((band_hz[1] / spacing).floor() as usize).min(count.saturating_sub(1) / 2);
    if last < first + FEWEST_LINES {
        return None;
    }
    let fade = ((FADE_SHARE * count as f64) as usize).max(1);
    let (residual, output) = (lines(&samples, fade, first, last)?, lines(measured, fade, first, last)?);
    // The fade keeps 3/8 of the power of what it covers.
    let power = sample_rate_hz * (count as f64 - 2.0 * fade as f64 * (1.0 - 0.375));
    let group = residual.len().div_ceil(DENSITY_POINTS);
    let density = |lines: &[Complex64]| -> Vec<f64> {
        lines.chunks(group).map(|run| run.iter().map(|v| 2.0 * v.norm_sqr() / power).sum::<f64>() / run.len() as f64).collect()
    };
    let centres = (first..=last).collect::<Vec<usize>>();
    let frequency_hz = centres.chunks(group).map(|run| spacing * run.iter().sum::<usize>() as f64 / run.len() as f64).collect();
    // r(lag) = Σ P cos(π (k + ½) lag/L)/Σ P over the L lines of the band, as if it began at 0 Hz: white noise of the band is white.
    let own: f64 = residual.iter().map(Complex64::norm_sqr).sum();
    let angle = |k: usize, lag: usize| PI * (k as f64 + 0.5) * lag as f64 / residual.len() as f64;
    let autocorrelation =
        (0..=LAGS.min(residual.len() / 2)).map(|lag| residual.iter().enumerate().map(|(k, v)| v.norm_sqr() * angle(k, lag).cos()).sum::<f64>() / own).collect();
    let variance = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        x.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
    };
    Some(Leftover {
        vaf_percent: 100.0 * (1.0 - variance(&samples) / variance(measured)),
        frequency_hz,
        density: density(&residual),
        output_density: density(&output),
        autocorrelation,
        lag_rate_hz: 2.0 * residual.len() as f64 * spacing,
        white_95: 1.96 / (2.0 * residual.len() as f64).sqrt(),
        samples,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Estimate;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    /// 60 s of a force of 32 Hz white noise on 2 kg, 30 N s/m, 300 N/m, exact at 500 Hz by small steps.
    fn spring() -> Trials {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let (rate, steps) = (500.0, 20);
        let (mut x, mut v, mut f) = (0.0, 0.0, 0.0);
        let (mut force, mut position) = (Vec::new(), Vec::new());
        for _ in 0..30_000 {
            f += 0.2 * (8.0 * rng.sample::<f64, _>(StandardNormal) - f);
            force.push(f);
            position.push(x);
            for _ in 0..steps {
                let h = 1.0 / (rate * f64::from(steps));
                v += h * (f - 30.0 * v - 300.0 * x) / 2.0;
                x += h * v;
            }
        }
        // Force is held from each sample on: half a sample late, which the shift of the position takes off.
        let middle: Vec<f64> = position.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        force.pop();
        let trial = Trial::new(rate).effort("x", force).displacement("x", middle).expect("a trial");
        Trials::of([&trial]).expect("roles")
    }

    #[test]
    fn a_spring_s_fitted_model_runs_along_its_recording() {
        let trials = spring();
        let estimated = crate::estimate::estimate(&trials, &Estimate::welch(2048)).expect("an estimate");
        let fitted = estimated.fit(0.5..8.0).expect("a fit");
        let overlay = overlay(&trials, &trials.trials[0], &fitted).expect("an overlay");
        let run = &overlay.outputs[0];
        let left = leftover(&run.measured, &run.simulated, overlay.sample_rate_hz, overlay.band_hz).expect("a residual");
        // One sample of misalignment would be 2π 8/500 of the amplitude at 8 Hz, a hundredth of the power.
        assert!(left.vaf_percent > 99.0, "{}", left.vaf_percent);
        assert!((left.autocorrelation[0] - 1.0).abs() < 1e-12);
        assert!(overlay.start_s > 1.9 && run.measured.len() == run.simulated.len());
        let seen = fitted.seen(&estimated).expect("the model");
        assert!(seen.frequency_hz.iter().zip(seen.value.iter()).filter(|(hz, _)| **hz > 0.6 && **hz < 8.0).all(|(_, v)| v.is_finite()));
    }

    #[test]
    fn the_residual_of_white_noise_is_white_and_its_density_flat() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let noise: Vec<f64> = (0..20_000).map(|_| rng.sample(StandardNormal)).collect();
        let left = leftover(&noise, &vec![0.0; noise.len()], 100.0, [1.0, 40.0]).expect("a residual");
        // One-sided: variance 1 over 50 Hz; some 260 lines a point scatter by 1/√260.
        let bound = 4.0 / (left.samples.len() as f64 * 39.0 / 100.0 / DENSITY_POINTS as f64).sqrt();
        assert!(left.density.iter().all(|d| (d * 50.0 - 1.0).abs() < bound), "{:?}", left.density);
        let beyond = left.autocorrelation[1..].iter().filter(|r| r.abs() > left.white_95).count();
        // 5 % of 40 lags with four binomial standard deviations.
        assert!(beyond <= 7, "{beyond} of {LAGS} lags");
        assert!(leftover(&noise, &noise[1..], 100.0, [1.0, 40.0]).is_none());
    }
}
