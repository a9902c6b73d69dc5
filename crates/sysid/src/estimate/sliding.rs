//! Estimates over a window that slides along the recordings: what changes with time.

use super::{Direct, EstimateError, Estimates, SpectralMethod, estimate};
use crate::labels::Labels;
use crate::ports::Ports;
use ndof_signal::Recording;

/// One estimate for each stretch of `window_s`, `step_s` apart, with the time of its middle since the beginning.
///
/// All trials are cut at the same times, as repetitions of one course of events. A stretch that the recordings do not fill
/// is left out; steps below one sample are one sample.
///
/// # Errors
/// [`EstimateError`] of the first stretch without an estimate; [`EstimateError::NoTrial`] where no stretch fits.
pub fn sliding(
    trials: &[&Recording],
    ports: &Ports,
    labels: &Labels,
    (method, estimator): (&SpectralMethod, Direct),
    window_s: f64,
    step_s: f64,
) -> Result<Vec<(f64, Estimates)>, EstimateError> {
    let rate = trials.first().ok_or(EstimateError::NoTrial)?.sample_rate_hz();
    let len = trials.iter().map(|t| t.len()).min().unwrap_or(0);
    let samples = |seconds: f64| (seconds * rate).round().max(1.0) as usize;
    let (window, step) = (samples(window_s), samples(step_s));
    let mut found = Vec::new();
    for start in (0..(len + 1).saturating_sub(window)).step_by(step) {
        let stretches: Vec<Recording> = trials.iter().filter_map(|t| t.slice(start..start + window).ok()).collect();
        let stretches: Vec<&Recording> = stretches.iter().collect();
        found.push(((start as f64 + window as f64 / 2.0) / rate, estimate(&stretches, ports, labels, method, estimator)?));
    }
    if found.is_empty() { Err(EstimateError::NoTrial) } else { Ok(found) }
}
