//! Trials in, frequency response with coherences and confidence out.

mod course;
mod course_result;
mod estimated;
pub(crate) mod instrument;
mod left_out;
mod limits;
mod measured;
mod method;
mod repeat;
mod rest;
pub mod result;
mod settings;
mod streamed;
mod summed;

pub use estimated::Estimated;
pub(crate) use left_out::without_each;
pub(crate) use measured::to_displacement;
pub use settings::{Estimate, MethodName};
pub use streamed::Streamed;
pub(crate) use summed::{Summed, segment};

use crate::error::AnalysisError;
use crate::trials::{Trial, Trials, require_motion};
use measured::{in_file, labels};
use ndof_signal::Channel;
use ndof_sysid::{SpectralMethod, estimate_from_spectra, robust_spectra};
use std::borrow::Cow;

/// Estimates the response of the outputs to the inputs.
///
/// # Errors
/// [`AnalysisError`] if a trial is too short, inputs depend on each other, or the kind of response does not exist.
pub fn estimate(trials: &Trials, settings: &Estimate) -> Result<Estimated, AnalysisError> {
    let trials = &*if settings.method == MethodName::Auto { rest::without_rest(trials)? } else { Cow::Borrowed(trials) };
    for trial in &*trials.trials {
        let range = |channel: &Channel| channel.samples.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)]);
        let ranges: Vec<[f64; 2]> = trial.recording.channels().iter().map(range).collect();
        require_motion(&trial.file, &trials.roles.ports, &trial.recording.names(), &ranges)?;
    }
    let (method, why) = method::choose(trials, settings)?;
    let ports = &trials.roles.ports;
    let longest = trials.trials.iter().map(|trial| trial.recording.len()).max().unwrap_or(0);
    limits::estimate(&method, longest, trials.roles.used().len()).map_err(|what| AnalysisError::TooLarge { what })?;
    let labels = labels(trials);
    let failed = |error| in_file(error, trials);
    let (estimates, rejected) = match &method {
        SpectralMethod::Welch(welch) if settings.robust => {
            let (spectra, rejected) = robust_spectra(&trials.recordings(), ports, welch).map_err(failed)?;
            (estimate_from_spectra(spectra, ports, &labels, &method, settings.estimator).map_err(failed)?, Some(rejected))
        }
        _ => (ndof_sysid::estimate(&trials.recordings(), ports, &labels, &method, settings.estimator).map_err(failed)?, None),
    };
    let mut estimated = Estimated::new(trials, settings, estimates, why)?;
    let explained_hz = estimated.explained_to_hz();
    let result = &mut estimated.result;
    result.robust = rejected.map(|rejected| repeat::robust(&estimated.estimates, &rejected));
    result.trial_spread = repeat::between_trials(trials, settings, &method, result.response);
    result.course = course::course(trials, settings, result.response, explained_hz)?;
    result.head.warnings.extend(repeat::warnings(result, &estimated.estimates));
    Ok(estimated)
}

impl Estimate {
    /// Estimates the response from trials, whose channels have their roles by name.
    ///
    /// # Errors
    /// As [`Trials::new`] and [`estimate`].
    pub fn run<'a>(&self, trials: impl IntoIterator<Item = &'a Trial>) -> Result<Estimated, AnalysisError> {
        estimate(&Trials::of(trials)?, self)
    }
}
