//! Trials in, frequency response with coherences and confidence out.

mod apart;
mod course;
mod estimated;
mod excited;
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
pub(crate) use excited::{Excited, excited_band};
pub(crate) use left_out::without_each;
pub(crate) use measured::to_displacement;
pub use settings::{Estimate, MethodName};
pub use streamed::Streamed;
pub(crate) use summed::{Summed, segment};

use crate::error::AnalysisError;
use crate::fit::Fit;
use crate::trials::{Trial, Trials, require_motion};
use excited::explained_to_hz;
use measured::{in_file, labels};
use ndof_signal::Channel;
use ndof_sysid::{DirectEstimate, EstimateError, Estimates, Labels, SpectralMethod, estimate_from_spectra, estimate_up_to, robust_spectra};
use std::borrow::Cow;
use std::cell::OnceCell;

/// Estimates the response of the outputs to the inputs.
///
/// # Errors
/// [`AnalysisError`] if a trial is too short, inputs depend on each other, or the kind of response does not exist.
pub fn estimate(trials: &Trials, settings: &Estimate) -> Result<Estimated, AnalysisError> {
    estimated(trials, settings, None)
}

/// The same for `fit` and not to be shown: the result tells how it was made and what to know of it, at no frequency, and a derived response ends with the
/// band that is fitted.
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
/// let (trials, settings, fit) = (Trials::of([&trial])?, Estimate::default(), Fit::default());
/// let [whole, bare] = [estimate(&trials, &settings)?, estimate_to_fit(&trials, &settings, &fit)?];
/// assert!(bare.result.frequency_hz.is_empty());
/// assert_eq!(fit.run(&bare)?.result, fit.run(&whole)?.result);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn estimate_to_fit(trials: &Trials, settings: &Estimate, fit: &Fit) -> Result<Estimated, AnalysisError> {
    estimated(trials, settings, Some(fit))
}

/// For a fit, or to be shown: then the result holds what there is at each frequency.
fn estimated(trials: &Trials, settings: &Estimate, fit: Option<&Fit>) -> Result<Estimated, AnalysisError> {
    let shown = fit.is_none();
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
    let (labels, excited) = (labels(trials), OnceCell::new());
    let failed = |error| in_file(error, trials);
    let (estimates, rejected) = match &method {
        SpectralMethod::Welch(welch) if settings.robust => {
            let (spectra, rejected) = robust_spectra(&trials.recordings(), ports, welch).map_err(failed)?;
            (estimate_from_spectra(spectra, ports, &labels, &method, settings.estimator).map_err(failed)?, Some(rejected))
        }
        _ => (of_method(trials, &labels, (&method, settings), fit, &excited).map_err(failed)?, None),
    };
    let mut estimated = Estimated::new(trials, settings, estimates, why, shown)?;
    estimated.excited = excited.into_inner();
    let explained_hz = explained_to_hz(&estimated.estimates.direct);
    let result = &mut estimated.result;
    result.robust = rejected.map(|rejected| repeat::robust(&estimated.estimates, &rejected));
    result.trial_spread = repeat::between_trials(trials, settings, &method, result.response, shown);
    result.course = course::course(trials, settings, result.response, explained_hz)?;
    result.head.warnings.extend(repeat::warnings(result, &estimated.estimates));
    Ok(estimated)
}

/// The estimates of a method; where a fit needs no more, derived ones up to the end of the band that is asked for, or else `excited`.
fn of_method(
    trials: &Trials,
    labels: &Labels,
    (method, settings): (&SpectralMethod, &Estimate),
    fit: Option<&Fit>,
    excited: &OnceCell<Excited>,
) -> Result<Estimates, EstimateError> {
    let (recordings, ports) = (trials.recordings(), &trials.roles.ports);
    // What is to be said of an inverse is said of all frequencies.
    let Some(fit) = fit.filter(|_| settings.response.is_none()) else {
        return ndof_sysid::estimate(&recordings, ports, labels, method, settings.estimator);
    };
    let excited_hz = |direct: &DirectEstimate| excited.get_or_init(|| excited_band(trials, direct, None, method)).band_hz;
    let highest_hz = |direct: &DirectEstimate| fit.band_hz.unwrap_or_else(|| excited_hz(direct))[1];
    estimate_up_to(&recordings, ports, labels, (method, settings.estimator), &highest_hz)
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
