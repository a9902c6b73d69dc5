//! What repetition tells: segments that stand out, trials beside each other, a response that changes with time.

use super::measured::{in_file, labels, to_displacement};
use super::method::choose;
use super::result::{self as schema, EstimateResult};
use super::settings::Estimate;
use crate::error::AnalysisError;
use crate::result::{Warning, number};
use crate::trials::{Trial, Trials};
use ndof_signal::Recording;
use ndof_sysid::{Estimates, FrequencyResponse, RejectedSegment, ResponseKind, SpectralMethod, estimate_from_spectra, robust_spectra};
use rayon::prelude::*;

/// Standard errors by which the spread between trials exceeds that within before it is worth a warning, and the excess.
const BEYOND_CHANCE: f64 = 4.0;
const NOTABLE: f64 = 1.2;

/// Errors by which a response must exceed its smallest singular value for its inverse to be trusted.
const INVERTIBLE: f64 = 3.0;

/// What was left out, and of how much.
pub(super) fn robust(estimates: &Estimates, rejected: &[RejectedSegment]) -> schema::Robust {
    let kept = estimates.spectra.as_ref().map_or(0, |s| s.segments());
    schema::Robust {
        segments: kept + rejected.len(),
        rejected: rejected
            .iter()
            .map(|r| schema::RejectedSegment { trial: r.trial, start_s: r.start_s, end_s: r.end_s, residual: number(r.residual), leverage: number(r.leverage) })
            .collect(),
    }
}

/// The response to build on, of the kind that is reported.
fn reported(estimates: Estimates, trials: &Trials, kind: ResponseKind) -> Option<FrequencyResponse> {
    let mut response = estimates.derived.map_or(estimates.direct.response, |d| d.response);
    to_displacement(&mut response, trials);
    response.to_kind(kind).ok()
}

/// Each trial estimated alone; nothing for one trial, or where a trial alone has no estimate.
pub(super) fn between_trials(trials: &Trials, settings: &Estimate, method: &SpectralMethod, kind: ResponseKind) -> Option<schema::TrialSpread> {
    // One trial of a multisine is one column of the experiment, not a repetition.
    if trials.trials.len() < 2 || matches!(method, SpectralMethod::Periodic(_)) {
        return None;
    }
    let (ports, labels) = (&trials.roles.ports, labels(trials));
    let alone = |recording: &Recording| {
        let estimates = match method {
            SpectralMethod::Welch(welch) if settings.robust => {
                let (spectra, _) = robust_spectra(&[recording], ports, welch).ok()?;
                estimate_from_spectra(spectra, ports, &labels, method, settings.estimator)
            }
            _ => ndof_sysid::estimate(&[recording], ports, &labels, method, settings.estimator),
        };
        reported(estimates.ok()?, trials, kind)
    };
    let responses: Option<Vec<FrequencyResponse>> = trials.recordings().into_par_iter().map(alone).collect();
    let [low_hz, high_hz] = settings.reported_hz();
    let responses: Vec<FrequencyResponse> = responses?.iter().map(|r| r.band(low_hz, high_hz)).collect();
    let spread = ndof_sysid::spread(&responses, low_hz, high_hz)?;
    let all: Vec<usize> = (0..spread.between.dim().0).collect();
    Some(schema::TrialSpread {
        between: schema::spectrum(&spread.between, &all),
        within: schema::spectrum(&spread.within, &all),
        ratio: number(spread.ratio),
        ratio_std_error: number(spread.ratio_std_error),
    })
}

/// Windows that a course over time has at most.
const MOST_WINDOWS: f64 = 10_000.0;

/// Estimates over a window that slides along all trials at once, by the method that suits its length; nothing unless it is asked for.
pub(super) fn course(trials: &Trials, settings: &Estimate, kind: ResponseKind) -> Result<Option<schema::Course>, AnalysisError> {
    let Some(window_s) = settings.sliding_s else { return Ok(None) };
    let step_s = settings.sliding_step_s.unwrap_or(window_s / 2.0);
    if !(window_s > 0.0 && step_s > 0.0 && window_s.is_finite() && step_s.is_finite()) {
        return Err(AnalysisError::Sliding { window_s, step_s });
    }
    let longest_s = trials.trials.iter().map(|trial| trial.recording.duration_s()).fold(0.0, f64::max);
    if window_s > longest_s {
        return Err(AnalysisError::LongWindow { window_s, longest_s });
    }
    if (longest_s - window_s) / step_s > MOST_WINDOWS {
        let what = format!("windows that slide by {step_s} s over {longest_s} s are more than {MOST_WINDOWS}; give a longer `sliding_step`");
        return Err(AnalysisError::TooLarge { what });
    }
    let samples = (window_s * trials.sample_rate_hz()).round().max(1.0) as usize;
    let cut = |trial: &Trial| {
        let recording = trial.recording.slice(0..samples.min(trial.recording.len()));
        recording.map(|recording| Trial { recording, ..trial.clone() }).map_err(|source| AnalysisError::Recording { file: trial.file.clone(), source })
    };
    let first = Trials { trials: trials.trials.iter().map(cut).collect::<Result<_, _>>()?, ..trials.clone() };
    let (method, _) = choose(&first, settings)?;
    let windows = ndof_sysid::sliding(&trials.recordings(), &trials.roles.ports, &labels(trials), (&method, settings.estimator), window_s, step_s)
        .map_err(|error| in_file(error, trials))?;
    let derived = windows.iter().all(|(_, estimates)| estimates.derived.is_some());
    let estimate = if derived { "derived" } else { "direct" }.to_owned();
    let (mut time_s, mut frequency_hz, mut responses) = (Vec::new(), Vec::new(), Vec::new());
    let [low_hz, high_hz] = settings.reported_hz();
    for (middle_s, estimates) in windows {
        let Some(response) = reported(estimates, trials, kind) else { continue };
        let response = response.band(low_hz, high_hz);
        time_s.push(middle_s);
        responses.push(schema::Response::from(&response));
        frequency_hz = response.frequency_hz;
    }
    Ok(Some(schema::Course { window_s, step_s, estimate, method: method.name().to_owned(), time_s, frequency_hz, response: responses }))
}

/// What repetition and inversion say against the estimate.
pub(super) fn warnings(result: &EstimateResult, estimates: &Estimates) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(spread) = &result.trial_spread
        && let (Some(ratio), Some(error)) = (spread.ratio, spread.ratio_std_error)
        && ratio > NOTABLE
        && ratio > 1.0 + BEYOND_CHANCE * error
    {
        warnings.push(Warning::new(
            "trials-differ",
            format!("the trials spread {ratio:.2} times as far as their own noise explains (1 ± {error:.2} by chance)"),
            "look at the trials one by one; until then take the intervals as too narrow by that factor",
        ));
    }
    if result.measured_direction.is_some() {
        let response = estimates.derived.as_ref().map_or(&estimates.direct.response, |d| &d.response);
        let (low, high) = (result.frequency_hz.first().copied().unwrap_or(0.0), result.frequency_hz.last().copied().unwrap_or(0.0));
        let weak: Vec<f64> = response
            .invertibility()
            .into_iter()
            .zip(&response.frequency_hz)
            .filter(|(share, hz)| *share < INVERTIBLE && (low..=high).contains(*hz))
            .map(|(_, hz)| *hz)
            .collect();
        if let (Some(first), Some(last)) = (weak.first(), weak.last()) {
            warnings.push(Warning::new(
                "inverse-not-trusted",
                format!(
                    "at {} of {} frequencies, {first:.2} to {last:.2} Hz, the measured response may be singular within its error, and its inverse is not known",
                    weak.len(),
                    result.frequency_hz.len()
                ),
                "report the measured direction there (`response`), or measure longer",
            ));
        }
    }
    warnings
}
