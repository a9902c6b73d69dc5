//! The response that a fit uses, from all trials but one.

use super::estimated::Estimated;
use super::measured::{in_file, labels, to_displacement};
use crate::error::{AnalysisError, in_order};
use ndof_signal::{CrossSpectra, Recording};
use ndof_sysid::{EstimateError, FrequencyResponse, SpectralMethod, robust_spectra};
use rayon::prelude::*;

/// The response that a fit uses, once for each trial with that trial left out: how much they differ is how much the
/// trials disagree. Empty where that cannot be known.
pub(crate) fn without_each(estimated: &Estimated, highest_hz: f64) -> Result<Vec<FrequencyResponse>, AnalysisError> {
    let trials = &estimated.trials;
    if trials.trials.len() < 3 {
        return Ok(Vec::new());
    }
    let failed = |error: EstimateError| in_file(error, trials);
    let ports = &trials.roles.ports;
    if let (SpectralMethod::Welch(welch), Some(_)) = (&estimated.estimates.method, &estimated.result.robust) {
        let recordings = trials.recordings();
        let without = |left_out: usize| -> Vec<&Recording> { recordings.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, r)| *r).collect() };
        let responses = (0..recordings.len())
            .into_par_iter()
            .map(|left_out| response_of(&robust_spectra(&without(left_out), ports, welch).map_err(failed)?.0, estimated))
            .collect();
        return in_order(responses);
    }
    let transform = |k: usize, recording: &Recording| {
        let columns: Vec<usize> = (0..recording.channels().len()).collect();
        let (rate, columns, trial) = (recording.sample_rate_hz(), recording.columns(&columns), k + 1);
        match &estimated.estimates.method {
            SpectralMethod::Welch(welch) => Some(welch.spectra(rate, &columns).map_err(|source| failed(EstimateError::Welch { trial, source }))),
            SpectralMethod::Multitaper(multitaper) => {
                Some(multitaper.spectra(rate, &columns).map_err(|source| failed(EstimateError::Multitaper { trial, source })))
            }
            _ => None,
        }
    };
    let below = |(k, recording): (usize, &&Recording)| transform(k, recording).map(|spectra| spectra.map(|spectra| spectra.up_to(highest_hz)));
    let spectra = trials.recordings().par_iter().enumerate().filter_map(below).collect();
    let spectra: Vec<CrossSpectra> = in_order(spectra)?;
    let responses = (0..spectra.len())
        .into_par_iter()
        .map(|left_out| {
            let kept: Vec<CrossSpectra> = spectra.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, s)| s.clone()).collect();
            let pooled = CrossSpectra::pool(&kept).map_err(|error| failed(error.into()))?;
            response_of(&pooled, estimated)
        })
        .collect();
    in_order(responses)
}

/// The response of the kind that a fit uses, from spectra.
fn response_of(spectra: &CrossSpectra, estimated: &Estimated) -> Result<FrequencyResponse, AnalysisError> {
    let trials = &estimated.trials;
    let (ports, labels) = (&trials.roles.ports, labels(trials));
    let failed = |error: EstimateError| in_file(error, trials);
    let mut response = match &estimated.estimates.derived {
        Some(_) => ndof_sysid::derived(spectra, ports, &labels).map_err(failed)?.response,
        None => ndof_sysid::direct(spectra, ports, &labels, estimated.result.settings.estimator).map_err(failed)?.response,
    };
    to_displacement(&mut response, trials);
    Ok(response)
}
