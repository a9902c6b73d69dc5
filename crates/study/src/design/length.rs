//! How long to measure for intervals of a wanted width.

use super::between::Lens;
use super::result::{LengthPlan, WantedInterval};
use super::specification::Specification;
use super::target::What;
use super::theory::Theory;
use crate::error::{StudyError, meaning};
use ndof_analysis::AnalysisError;
use ndof_analysis::result::number;
use ndof_devices::{Experiment, linearise};
use ndof_signal::{CrossSpectra, ExcitationError, Welch, effective_averages};
use ndof_sysid::averages_for_interval;

/// The plan for the intervals that are wanted.
///
/// Signal: the spectrum of the commands through the linear model, S^c = T S_rr Tᴴ. Noise: the limb's own force, that of the
/// transducer and the encoders' steps, S_εε = C (S_ww + S_nn) Cᴴ + S_dd. From both the covariance of the derived estimate for
/// n_e effective averages of the paper's second setting, Cov(vec C) = (S^c)⁻ᵀ ⊗ S_εε / (n_e − q), on which the fit of M, B and K
/// is run as it is run on data. Dry friction of the robot is left out.
pub(super) fn plan(asked: &Specification, experiment: &Experiment, commanded: &[Vec<Vec<f64>>]) -> Result<LengthPlan, StudyError> {
    let linear = linearise(experiment)?;
    let fs = asked.sample_rate_hz;
    let samples = commanded.first().and_then(|trial| trial.first()).map_or(0, Vec::len);
    let Lens::Welch(welch) = Lens::welch(samples) else { return Err(ExcitationError::NoCandidates.into()) };
    let spectra = commanded
        .iter()
        .map(|trial| welch.spectra(fs, &trial.iter().map(Vec::as_slice).collect::<Vec<_>>()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(ExcitationError::from)?;
    let pooled = CrossSpectra::pool(&spectra).map_err(|error| AnalysisError::Estimate { file: "the design".to_owned(), source: error.into() })?;
    let here = pooled.effective_averages();
    let theory = Theory::new(asked, experiment, linear, pooled)?;
    let known = theory.parameters();
    if let Some(What::Entry(name)) = asked.targets.iter().map(|t| &t.what).find(|what| matches!(what, What::Entry(name) if !known.contains(name))) {
        let what = format!("no parameter \"{name}\"; there are M, B, K, {}, and gain@HZ", known.join(", "));
        return Err(meaning("`target_ci`", what));
    }
    let q = asked.axes.len();
    let trials = asked.trials.max(1) as f64;
    let wanted: Vec<WantedInterval> = asked
        .targets
        .iter()
        .map(|target| {
            let averages = match target.what {
                What::Gain(hz) => Some(averages_for_interval(theory.coherence(hz), q, target.half_width, 0.95)),
                _ => theory.averages(target),
            };
            let averages = averages.and_then(number);
            let duration_s = averages.and_then(|averages| record_s(&welch, fs, averages / trials));
            WantedInterval { what: target.name(), half_width: target.half_width, effective_averages: averages, duration_s }
        })
        .collect();
    let longest = |value: fn(&WantedInterval) -> Option<f64>| wanted.iter().map(value).try_fold(0.0_f64, |most, value| Some(most.max(value?)));
    let gains = asked.targets.iter().filter_map(|target| if let What::Gain(hz) = target.what { Some((target.name(), hz)) } else { None });
    let mut predicted = theory.predicted(here).unwrap_or_default();
    predicted.extend(gains.map(|(name, hz)| theory.gain(name, hz, here)));
    Ok(LengthPlan {
        band_hz: asked.fit_band_hz,
        trials: asked.trials,
        duration_s: longest(|w| w.duration_s),
        trials_of_this_length: longest(|w| w.effective_averages).map(|averages| (averages * trials / here).ceil() as usize),
        predicted,
        wanted,
    })
}

/// Longest record that is worth planning (s): a day.
const LONGEST_S: f64 = 86_400.0;

/// The shortest record with so many effective averages.
fn record_s(welch: &Welch, sample_rate_hz: f64, averages: f64) -> Option<f64> {
    let window = welch.window.samples(welch.nperseg, welch.window_symmetric);
    let hop = welch.nperseg - welch.noverlap;
    let most = (LONGEST_S * sample_rate_hz / hop as f64) as usize;
    let enough = |segments: usize| effective_averages(&window, hop, segments) >= averages;
    // Averages grow with the number of segments.
    let (mut low, mut high) = (0, most);
    if !enough(most) {
        return None;
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if enough(middle) { high = middle } else { low = middle }
    }
    Some((welch.nperseg + (high - 1) * hop) as f64 / sample_rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_record_has_just_enough_averages() {
        let welch = Welch::smooth();
        let window = welch.window.samples(2048, false);
        // The paper's 45 segments: 23.65 effective averages in 24 576 samples.
        let seconds = record_s(&welch, 500.0, effective_averages(&window, 512, 45)).expect("within a day");
        assert_eq!(seconds, (2048 + 44 * 512) as f64 / 500.0);
        assert!(record_s(&welch, 500.0, 1e9).is_none());
    }
}
