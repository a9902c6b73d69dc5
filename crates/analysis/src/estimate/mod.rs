//! Trials in, frequency response with coherences and confidence out.

mod apart;
mod course;
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

pub use apart::{ApartRecording, estimate_apart};
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
    estimated(trials, settings, true)
}

/// The same to be fitted and not to be shown: the result tells how it was made and what to know of it, at no frequency.
///
/// # Errors
/// As [`estimate`].
///
/// ```
/// use ndof_analysis::{Estimate, Fit, Trial, Trials, estimate, estimate_to_fit};
/// use ndof_signal::FilteredNoise;
///
/// let force = FilteredNoise { axes: 1, samples: 10_000, ..FilteredNoise::default() }.generate(1)?.remove(0);
/// let (mut x, mut v) = (0.0, 0.0);
/// let mut step = |f: &f64| {
///     v += (f - 12.0 * v - 300.0 * x) / 2.0 * 2e-3;
///     x += v * 2e-3;
///     x
/// };
/// let motion: Vec<f64> = force.iter().map(&mut step).collect();
/// let trial = Trial::new(500.0).effort("x", force).displacement("x", motion)?;
/// let (trials, settings) = (Trials::of([&trial])?, Estimate::default());
/// let [whole, bare] = [estimate(&trials, &settings)?, estimate_to_fit(&trials, &settings)?];
/// assert!(bare.result.frequency_hz.is_empty());
/// assert_eq!(Fit::default().run(&bare)?.result, Fit::default().run(&whole)?.result);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn estimate_to_fit(trials: &Trials, settings: &Estimate) -> Result<Estimated, AnalysisError> {
    estimated(trials, settings, false)
}

/// `shown` says whether the result holds what there is at each frequency.
fn estimated(trials: &Trials, settings: &Estimate, shown: bool) -> Result<Estimated, AnalysisError> {
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
    let mut estimated = Estimated::new(trials, settings, estimates, why, shown)?;
    let explained_hz = estimated.explained_to_hz();
    let result = &mut estimated.result;
    result.robust = rejected.map(|rejected| repeat::robust(&estimated.estimates, &rejected));
    result.trial_spread = repeat::between_trials(trials, settings, &method, result.response, shown);
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
