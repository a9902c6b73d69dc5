//! What repetition tells: segments that stand out, trials beside each other.

use super::measured::{labels, to_displacement};
use super::result::{self as schema, EstimateResult};
use super::settings::Estimate;
use crate::result::{Warning, number};
use crate::trials::Trials;
use ndof_signal::Recording;
use ndof_sysid::{Estimates, FrequencyResponse, Pieces, RejectedSegment, ResponseKind, SpectralMethod, estimate_from_spectra, robust_spectra};
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
pub(super) fn reported(estimates: Estimates, trials: &Trials, kind: ResponseKind) -> Option<FrequencyResponse> {
    in_kind(estimates.derived.map_or(estimates.direct.response, |d| d.response), trials, kind)
}

/// A response of channels as they stand, of the kind that is reported.
pub(super) fn in_kind(mut response: FrequencyResponse, trials: &Trials, kind: ResponseKind) -> Option<FrequencyResponse> {
    to_displacement(&mut response, trials);
    if response.kind == kind { Some(response) } else { response.to_kind(kind).ok() }
}

/// Each trial estimated alone; nothing for one trial, or where a trial alone has no estimate. At no frequency unless it is `shown`.
pub(super) fn between_trials(trials: &Trials, settings: &Estimate, method: &SpectralMethod, kind: ResponseKind, shown: bool) -> Option<schema::TrialSpread> {
    // One trial of a multisine is one column of the experiment, not a repetition.
    if trials.trials.len() < 2 || matches!(method, SpectralMethod::Periodic(_)) {
        return None;
    }
    let (ports, labels) = (&trials.roles.ports, labels(trials));
    let [low_hz, high_hz] = settings.reported_hz();
    let apart_hz = (!shown).then_some([low_hz, high_hz]);
    let alone = |recordings: Vec<&Recording>| match method {
        SpectralMethod::Welch(welch) if settings.robust => {
            let (spectra, _) = robust_spectra(&recordings, ports, welch).ok()?;
            reported(estimate_from_spectra(spectra, ports, &labels, method, settings.estimator).ok()?, trials, kind).map(|r| r.band(low_hz, high_hz))
        }
        _ => in_kind(ndof_sysid::response(&recordings, ports, &labels, (method, settings.estimator), apart_hz).ok()?.band(low_hz, high_hz), trials, kind),
    };
    let recordings = trials.recordings();
    let responses: Option<Vec<FrequencyResponse>> = if matches!(method, SpectralMethod::Welch(_)) {
        recordings.into_par_iter().map(|recording| alone(vec![recording])).collect()
    } else {
        // A grid of lines is that of a piece's length.
        let cut: Vec<Vec<Recording>> = Pieces::new(&recordings)
            .of
            .chunk_by(|a, b| a.0 == b.0)
            .map(|own| own.iter().filter_map(|(t, range)| recordings[*t].slice(range.clone()).ok()).collect())
            .collect();
        cut.par_iter().map(|pieces| alone(pieces.iter().collect())).collect()
    };
    let spread = ndof_sysid::spread(&responses?, low_hz, high_hz)?;
    let all: Vec<usize> = (0..if shown { spread.between.dim().0 } else { 0 }).collect();
    Some(schema::TrialSpread {
        between: schema::spectrum(&spread.between, &all),
        within: schema::spectrum(&spread.within, &all),
        ratio: number(spread.ratio),
        ratio_std_error: number(spread.ratio_std_error),
    })
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
        let [low, high] = result.settings.reported_hz();
        let reported: Vec<(f64, f64)> =
            response.invertibility().into_iter().zip(response.frequency_hz.iter().copied()).filter(|(_, hz)| (low..=high).contains(hz)).collect();
        let weak: Vec<f64> = reported.iter().filter(|(share, _)| *share < INVERTIBLE).map(|(_, hz)| *hz).collect();
        if let (Some(first), Some(last)) = (weak.first(), weak.last()) {
            warnings.push(Warning::new(
                "inverse-not-trusted",
                format!(
                    "at {} of {} frequencies, {first:.2} to {last:.2} Hz, the measured response may be singular within its error, and its inverse is not known",
                    weak.len(),
                    reported.len()
                ),
                "report the measured direction there (`response`), or measure longer",
            ));
        }
    }
    warnings
}
