//! Trials in, frequency response with coherences and confidence out.

use super::MethodName;
use super::confidence::{response_with_errors, spectrum};
use super::method::word;
use super::method::{choose, record};
use super::repeat::{between_trials, course, robust};
use crate::error::{StudyError, in_order};
use crate::limits;
use crate::result::estimate as schema;
use crate::result::estimate::EstimateResult;
use crate::result::{VERSION, Warning, number};
use crate::trials::{Trials, require_motion};
use ndof_signal::{Channel, CrossSpectra, Detrend, Recording, Window};
use ndof_sysid::{
    Coherence, Direct, Distortion, EstimateError, Estimates, FrequencyResponse, Labels, Ports, ResponseKind, SpectralMethod, estimate_from_spectra,
    ordered_coherence, robust_spectra,
};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// How to estimate; what is `None` follows from the records.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EstimateSettings {
    /// The spectral method.
    pub method: MethodName,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share; half of a segment.
    pub noverlap: Option<usize>,
    /// Length of the transform; that of a segment.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Window,
    /// Symmetric instead of periodic.
    pub window_symmetric: bool,
    /// What is taken off each segment.
    pub detrend: Detrend,
    /// Half-width of the multitaper's spectral window, in units of 1/T.
    pub time_bandwidth: Option<f64>,
    /// Number of tapers.
    pub tapers: Option<usize>,
    /// Thomson's adaptive weights.
    pub adaptive: bool,
    /// Degree of the local polynomials.
    pub order: Option<usize>,
    /// Degree of the local rational method's denominators.
    pub denominator: Option<usize>,
    /// Lines on each side that the local methods look at.
    pub half_width: Option<usize>,
    /// Choose that number by how well left-out lines are predicted.
    pub leave_one_out: bool,
    /// Leave out segments that a knock or a cough has wrecked (Welch's method).
    pub robust: bool,
    /// Length and step of a window that slides along the trials.
    pub sliding_s: Option<(f64, f64)>,
    /// Period of the excitation; found from the commanded signal where it is not given.
    pub period_s: Option<f64>,
    /// Where the noise of the direct estimate is thought to be.
    pub estimator: Direct,
    /// The physical quantity to report.
    pub response: Option<ResponseKind>,
    /// Cuts the arrays, never the computation.
    pub band_hz: Option<(f64, f64)>,
    /// Add the cross-spectra to the result.
    pub spectra: bool,
}

/// An estimate as values to go on with, and as the result to be written.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Outputs over inputs of the channels as they stand, brought to displacement, on the whole grid.
    pub estimates: Estimates,
    /// The direct response of the kind that is reported, on the whole grid.
    pub direct: FrequencyResponse,
    /// The derived one.
    pub derived: Option<FrequencyResponse>,
    /// The result, cut to the band.
    pub result: EstimateResult,
}

impl Estimated {
    /// The response to build on: derived where there is one, else direct.
    pub fn best(&self) -> &FrequencyResponse {
        self.derived.as_ref().unwrap_or(&self.direct)
    }
}

/// Estimates the response of the outputs to the inputs.
///
/// # Errors
/// [`StudyError`] if a trial is too short, inputs depend on each other, or the kind of response does not exist.
pub fn estimate(trials: &Trials, settings: &EstimateSettings, command: &str) -> Result<Estimated, StudyError> {
    for trial in &trials.trials {
        let range = |channel: &Channel| channel.samples.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)]);
        let ranges: Vec<[f64; 2]> = trial.recording.channels().iter().map(range).collect();
        require_motion(&trial.file, &trials.roles.ports, &trial.recording.names(), &ranges)?;
    }
    let (method, why) = choose(trials, settings)?;
    let ports = &trials.roles.ports;
    let longest = trials.trials.iter().map(|trial| trial.recording.len()).max().unwrap_or(0);
    let used = ports.references.len() + ports.inputs.len() + ports.outputs.len();
    limits::estimate(&method, longest, used).map_err(|what| StudyError::TooLarge { what })?;
    let labels = labels(trials);
    let failed = |error| in_file(error, trials);
    let (estimates, rejected) = match &method {
        SpectralMethod::Welch(welch) if settings.robust => {
            let (spectra, rejected) = robust_spectra(&trials.recordings(), ports, welch).map_err(failed)?;
            let estimates = estimate_from_spectra(spectra, ports, &labels, &method, settings.estimator).map_err(failed)?;
            (estimates, Some(rejected))
        }
        _ => (ndof_sysid::estimate(&trials.recordings(), ports, &labels, &method, settings.estimator).map_err(failed)?, None),
    };
    let mut estimated = conclude(trials, settings, command, estimates, why)?;
    let Estimated { estimates, result, .. } = &mut estimated;
    result.robust = rejected.map(|rejected| robust(estimates, &rejected));
    let kind = settings.response.unwrap_or_else(|| trials.roles.default_kind());
    result.trial_spread = between_trials(trials, settings, &method, kind);
    result.course = settings.sliding_s.map(|window| course(trials, settings, window, kind)).transpose()?;
    result.warnings.extend(super::repeat::warnings(result, estimates));
    Ok(estimated)
}

/// From the estimates of the channels as they stand to the response that is asked for.
pub(super) fn conclude(trials: &Trials, settings: &EstimateSettings, command: &str, mut estimates: Estimates, why: String) -> Result<Estimated, StudyError> {
    to_displacement(&mut estimates.direct.response, trials);
    if let Some(derived) = &mut estimates.derived {
        to_displacement(&mut derived.response, trials);
    }
    let kind = settings.response.unwrap_or_else(|| trials.roles.default_kind());
    let direct = estimates.direct.response.to_kind(kind)?;
    let derived = estimates.derived.as_ref().map(|d| d.response.to_kind(kind)).transpose()?;
    let result = result(trials, settings, command, &estimates, &direct, derived.as_ref(), why)?;
    Ok(Estimated { estimates, direct, derived, result })
}

/// The response that a fit uses, once for each trial with that trial left out: how much they differ is how much the
/// trials disagree. Empty where that cannot be known.
pub(super) fn without_each(trials: &Trials, estimated: &Estimated, estimator: Direct) -> Result<Vec<FrequencyResponse>, StudyError> {
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
            .map(|left_out| response_of(&robust_spectra(&without(left_out), ports, welch).map_err(failed)?.0, trials, estimated, estimator))
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
    let spectra = trials.recordings().par_iter().enumerate().filter_map(|(k, recording)| transform(k, recording)).collect();
    let spectra: Vec<CrossSpectra> = in_order(spectra)?;
    let responses = (0..spectra.len())
        .into_par_iter()
        .map(|left_out| {
            let kept: Vec<CrossSpectra> = spectra.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, s)| s.clone()).collect();
            let pooled = CrossSpectra::pool(&kept).map_err(|error| failed(error.into()))?;
            response_of(&pooled, trials, estimated, estimator)
        })
        .collect();
    in_order(responses)
}

/// The response of the kind that a fit uses, from spectra.
fn response_of(spectra: &CrossSpectra, trials: &Trials, estimated: &Estimated, estimator: Direct) -> Result<FrequencyResponse, StudyError> {
    let (ports, labels) = (&trials.roles.ports, labels(trials));
    let failed = |error: EstimateError| in_file(error, trials);
    let mut response = match &estimated.estimates.derived {
        Some(_) => ndof_sysid::derived(spectra, ports, &labels).map_err(failed)?.response,
        None => ndof_sysid::direct(spectra, ports, &labels, estimator).map_err(failed)?.response,
    };
    to_displacement(&mut response, trials);
    Ok(response)
}

pub(super) fn labels(trials: &Trials) -> Labels {
    let ports = &trials.roles.ports;
    Labels {
        references: trials.names(&ports.references),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        kind: trials.roles.natural_kind(),
    }
}

/// Names the file of the trial that an error is about.
pub(super) fn in_file(error: EstimateError, trials: &Trials) -> StudyError {
    let file = match &error {
        EstimateError::Welch { trial, .. }
        | EstimateError::Multitaper { trial, .. }
        | EstimateError::Periodic { trial, .. }
        | EstimateError::NotFinite { trial, .. } => trials.trials.get(trial - 1).map(|t| t.file.clone()),
        _ => None,
    };
    let all = || match trials.trials.as_slice() {
        [one] => one.file.clone(),
        several => format!("{} trials", several.len()),
    };
    StudyError::Estimate { file: file.unwrap_or_else(all), source: error }
}

/// Divides by s for each time that an output is the derivative of a displacement, and multiplies for an input.
pub(super) fn to_displacement(response: &mut FrequencyResponse, trials: &Trials) {
    if response.kind == ResponseKind::Transfer {
        return;
    }
    let power = |order: &Option<i32>| order.unwrap_or(0);
    let rows: Vec<i32> = trials.roles.output_motion.iter().map(|order| -power(order)).collect();
    let columns: Vec<i32> = trials.roles.input_motion.iter().map(power).collect();
    if rows.iter().chain(&columns).all(|power| *power == 0) {
        return;
    }
    for f in 0..response.len() {
        let s = Complex64::new(0.0, TAU * response.frequency_hz[f]);
        let factor = |power: i32| if power == 0 { Complex64::new(1.0, 0.0) } else { s.powi(power) };
        for (i, &row) in rows.iter().enumerate() {
            for (j, &column) in columns.iter().enumerate() {
                response.value[[f, i, j]] *= factor(row) * factor(column);
            }
        }
        if let Some(u) = &mut response.uncertainty {
            for (i, &a) in rows.iter().enumerate() {
                for (k, &b) in rows.iter().enumerate() {
                    u.noise[[f, i, k]] *= factor(a) * factor(b).conj();
                }
            }
            for (l, &b) in columns.iter().enumerate() {
                for (j, &a) in columns.iter().enumerate() {
                    u.input_inverse[[f, l, j]] *= factor(b).conj() * factor(a);
                }
            }
        }
    }
}

fn result(
    trials: &Trials,
    settings: &EstimateSettings,
    command: &str,
    estimates: &Estimates,
    direct: &FrequencyResponse,
    derived: Option<&FrequencyResponse>,
    why: String,
) -> Result<EstimateResult, StudyError> {
    let all_hz = &direct.frequency_hz;
    let (low_hz, high_hz) = settings.band_hz.unwrap_or((0.0, f64::INFINITY));
    let keep: Vec<usize> = (0..all_hz.len()).filter(|&f| (low_hz..=high_hz).contains(&all_hz[f])).collect();
    if keep.is_empty() {
        return Err(StudyError::EmptyBand { low_hz, high_hz, nyquist_hz: trials.sample_rate_hz() / 2.0 });
    }
    let cut = |response: &FrequencyResponse| response.band(low_hz, high_hz);
    let (p, q) = (trials.roles.ports.outputs.len(), trials.roles.ports.inputs.len());
    let swapped = direct.kind.is_effort_over_motion() != trials.roles.natural_kind().is_effort_over_motion();
    let as_measured = |c: &Coherence, of: &FrequencyResponse, inputs: &FrequencyResponse| coherence(c, of, inputs, &keep);
    let (forward, through) = (&estimates.direct.response, estimates.derived.as_ref().map(|d| &d.response));
    let measured = || as_measured(&estimates.direct.coherence, forward, forward);
    // The paper's assumption keeps the measured inputs, the other takes the part of them that the references cause.
    let paper = || estimates.derived.as_ref().zip(through).map(|(d, c)| as_measured(&d.coherence_paper, c, forward));
    let iv = || estimates.derived.as_ref().zip(through).map(|(d, c)| as_measured(&d.coherence_iv, c, c));
    // Of an inverse only what the data say in that direction: nothing of a derived estimate.
    let backward = if swapped { backward(estimates, trials) } else { None };
    let direct_coherence = match (&backward, swapped) {
        (Some(backward), _) => coherence(&backward.coherence, &backward.response, &backward.response, &keep),
        (None, true) => unknown(keep.len(), q, p),
        (None, false) => measured(),
    };
    let own = |known: Option<schema::Coherence>| known.filter(|_| !swapped).unwrap_or_else(|| unknown(keep.len(), p, q));
    let d = &estimates.direct;
    let ports = &trials.roles.ports;
    let (inputs, outputs) = if swapped { (&ports.outputs, &ports.inputs) } else { (&ports.inputs, &ports.outputs) };
    let mut warnings: Vec<Warning> = trials.warnings.clone();
    let in_band = |bins: &dyn Fn(usize) -> bool| keep.iter().any(|&f| bins(f));
    let concerns = |code: &str| match code {
        "weak-instrument" => estimates.derived.as_ref().is_some_and(|derived| in_band(&|f| derived.weak_instrument.get(f) == Some(&true))),
        "singular-inputs" => in_band(&|f| d.singular_bins.contains(&f)),
        _ => true,
    };
    warnings.extend(estimates.warnings.iter().filter(|w| concerns(&w.code)).cloned().map(Warning::from));
    Ok(EstimateResult {
        schema: schema::SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings,
        sample_rate_hz: trials.sample_rate_hz(),
        trials: trials.trials.len(),
        inputs: trials.names(inputs),
        outputs: trials.names(outputs),
        references: trials.names(&ports.references),
        units: schema::Units { inputs: trials.units(inputs), outputs: trials.units(outputs), references: trials.units(&ports.references) },
        method: record(estimates, settings, direct, why),
        response: word(&direct.kind),
        frequency_hz: keep.iter().map(|&f| all_hz[f]).collect(),
        direct: schema::Direct { response: response_with_errors(&cut(direct)), coherence: direct_coherence },
        derived: derived.map(|response| schema::Derived {
            response: response_with_errors(&cut(response)),
            coherence_paper: own(paper()),
            coherence_iv: own(iv()),
        }),
        measured_direction: swapped.then(|| schema::MeasuredDirection {
            inputs: trials.names(&ports.inputs),
            outputs: trials.names(&ports.outputs),
            direct: measured(),
            derived_paper: paper(),
            derived_iv: iv(),
        }),
        significance_95: schema::Significance {
            ordinary: number(d.significance_95.ordinary),
            partial: number(d.significance_95.partial),
            multiple: number(d.significance_95.multiple),
        },
        input_coherence: spectrum(keep.len(), q, q, |f, i, j| number(d.input_coherence[[keep[f], i, j]])),
        input_condition_number: keep.iter().map(|&f| number(d.input_condition_number[f])).collect(),
        distortion: estimates.distortion.as_ref().map(|d| distortion(d, &keep, p, q)),
        robust: None,
        trial_spread: None,
        course: None,
        spectra: settings.spectra.then(|| spectra(trials, estimates, &keep)).flatten(),
    })
}

fn distortion(d: &Distortion, keep: &[usize], p: usize, q: usize) -> schema::Distortion {
    let kept = |values: &ndarray::Array3<f64>| spectrum(keep.len(), p, q, |f, i, j| number(values[[keep[f], i, j]]));
    schema::Distortion {
        noise_std: kept(&d.noise_std),
        nonlinear_std: kept(&d.nonlinear_std),
        even_std: kept(&d.even_std),
        odd_std: kept(&d.odd_std),
        detection: d.detection.iter().map(detection).collect(),
    }
}

fn detection(d: &ndof_sysid::Detection) -> schema::Detection {
    schema::Detection {
        even: d.even,
        lines: d.lines,
        level_db: d.level_db.iter().map(|v| number(*v)).collect(),
        noise_db: d.noise_db.iter().map(|v| number(*v)).collect(),
        probability: number(d.probability),
        lambda_limb: number(d.lambda_limb),
        lambda_robot: number(d.lambda_robot),
    }
}

/// The direct estimate from the outputs to the inputs, for methods that keep the spectra.
fn backward(estimates: &Estimates, trials: &Trials) -> Option<ndof_sysid::DirectEstimate> {
    let ports = &trials.roles.ports;
    let turned = Ports { references: Vec::new(), inputs: ports.outputs.clone(), outputs: ports.inputs.clone() };
    let labels = Labels { references: Vec::new(), inputs: trials.names(&ports.outputs), outputs: trials.names(&ports.inputs), kind: ResponseKind::Transfer };
    ndof_sysid::direct(estimates.spectra.as_ref()?, &turned, &labels, Direct::H1).ok()
}

/// Coherences that do not exist.
fn unknown(frequencies: usize, p: usize, q: usize) -> schema::Coherence {
    schema::Coherence {
        ordinary: spectrum(frequencies, p, q, |_, _, _| None),
        partial: spectrum(frequencies, p, q, |_, _, _| None),
        ordered: spectrum(frequencies, p, q, |_, _, _| None),
        multiple: vec![vec![None; frequencies]; p],
    }
}

/// Coherences `[output][input][frequency]` of the response `of`, with the inputs that the covariance of `inputs` knows.
fn coherence(c: &Coherence, of: &FrequencyResponse, inputs: &FrequencyResponse, keep: &[usize]) -> schema::Coherence {
    let (p, q) = of.shape();
    let pairs = |values: &ndarray::Array3<f64>| spectrum(keep.len(), p, q, |f, i, j| number(values[[keep[f], i, j]]));
    let ordered = inputs.uncertainty.as_ref().map(|u| ordered_coherence(of, &u.input_inverse, &c.multiple));
    schema::Coherence {
        ordinary: pairs(&c.ordinary),
        partial: pairs(&c.partial),
        ordered: ordered.map_or_else(|| unknown(keep.len(), p, q).ordered, |ordered| pairs(&ordered)),
        multiple: (0..p).map(|i| keep.iter().map(|&f| number(c.multiple[[f, i]])).collect()).collect(),
    }
}

fn spectra(trials: &Trials, estimates: &Estimates, keep: &[usize]) -> Option<schema::Spectra> {
    let cross = estimates.spectra.as_ref()?;
    let ports = &trials.roles.ports;
    let used: Vec<usize> = ports.references.iter().chain(&ports.inputs).chain(&ports.outputs).copied().collect();
    let n = used.len();
    Some(schema::Spectra {
        channels: trials.names(&used),
        re: spectrum(keep.len(), n, n, |f, a, b| number(cross.at(keep[f], used[a], used[b]).re)),
        im: spectrum(keep.len(), n, n, |f, a, b| number(cross.at(keep[f], used[a], used[b]).im)),
    })
}
