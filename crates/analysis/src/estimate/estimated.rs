//! An estimate as values to go on with, and as the result to be written.

use super::excited::Excited;
use super::measured::to_displacement;
use super::method::record;
use super::result::{self as schema, EstimateResult, spectrum};
use super::settings::Estimate;
use crate::error::AnalysisError;
use crate::result::{Head, Warning, number};
use crate::trials::Trials;
use ndarray::Array3;
use ndof_sysid::{Direct, DirectEstimate, Estimates, FrequencyResponse, Labels, Ports, ResponseKind};

/// A frequency response of trials: as values to go on with, and as the result to be written.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// What it was estimated from.
    pub trials: Trials,
    /// Outputs over inputs of the channels as they stand, brought to displacement, on the whole grid.
    pub estimates: Estimates,
    /// The direct response of the kind that is reported, on the whole grid.
    pub direct: FrequencyResponse,
    /// The derived one.
    pub derived: Option<FrequencyResponse>,
    /// The result, cut to the band.
    pub result: EstimateResult,
    /// The band to fit, where it is known already.
    pub(crate) excited: Option<Excited>,
}

impl Estimated {
    /// The response to build on: derived where there is one, else direct.
    pub fn best(&self) -> &FrequencyResponse {
        self.derived.as_ref().unwrap_or(&self.direct)
    }

    /// The same as the channels stand, brought to displacement: what a model is fitted to.
    pub(crate) fn measured(&self) -> &FrequencyResponse {
        self.estimates.derived.as_ref().map_or(&self.estimates.direct.response, |derived| &derived.response)
    }

    /// From the estimates of the channels as they stand to the response that is asked for; a result that is not `shown` holds no frequency.
    pub(super) fn new(trials: &Trials, settings: &Estimate, mut estimates: Estimates, why: String, shown: bool) -> Result<Self, AnalysisError> {
        to_displacement(&mut estimates.direct.response, trials);
        if let Some(derived) = &mut estimates.derived {
            to_displacement(&mut derived.response, trials);
        }
        let kind = settings.response.unwrap_or_else(|| trials.roles.default_kind());
        let direct = estimates.direct.response.to_kind(kind)?;
        let derived = estimates.derived.as_ref().map(|derived| derived.response.to_kind(kind)).transpose()?;
        let mut keep = settings.reported_of(&direct, trials)?;
        let known = warnings(trials, &estimates, &keep);
        keep.truncate(if shown { keep.len() } else { 0 });
        let mut result = written(trials, settings, &estimates, (&direct, derived.as_ref()), &keep, why);
        result.head.warnings = known;
        Ok(Estimated { trials: trials.clone(), estimates, direct, derived, result, excited: None })
    }
}

/// The result at the bins `keep`.
fn written(
    trials: &Trials,
    settings: &Estimate,
    estimates: &Estimates,
    (direct, derived): (&FrequencyResponse, Option<&FrequencyResponse>),
    keep: &[usize],
    why: String,
) -> EstimateResult {
    let cut = |response: &FrequencyResponse| schema::Response::from(&response.select(keep));
    let (direct_response, derived_response) = rayon::join(|| cut(direct), || derived.map(cut));
    let ports = &trials.roles.ports;
    let swapped = direct.kind.is_effort_over_motion() != trials.roles.natural_kind().is_effort_over_motion();
    let (inputs, outputs) = if swapped { (&ports.outputs, &ports.inputs) } else { (&ports.inputs, &ports.outputs) };
    let (p, q) = (outputs.len(), inputs.len());
    let measured = measured_direction(trials, estimates, keep);
    // Of an inverse only what the data say in that direction: nothing of a derived estimate.
    let backward = if swapped && !keep.is_empty() { backward(estimates, trials) } else { None };
    let direct_coherence = match backward {
        Some(found) => schema::Coherence::new(&found.coherence, &found.response, &found.response, keep),
        None if swapped => schema::Coherence::unknown(p, q, keep.len()),
        None => measured.direct.clone(),
    };
    let own = |known: &Option<schema::Coherence>| known.clone().filter(|_| !swapped).unwrap_or_else(|| schema::Coherence::unknown(p, q, keep.len()));
    let significance = &estimates.direct.significance_95;
    EstimateResult {
        head: Head::new(EstimateResult::SCHEMA, "estimate", Vec::new()),
        sample_rate_hz: trials.sample_rate_hz(),
        trials: trials.trials.len(),
        inputs: trials.names(inputs),
        outputs: trials.names(outputs),
        references: trials.names(&ports.references),
        units: schema::Units { inputs: trials.units(inputs), outputs: trials.units(outputs), references: trials.units(&ports.references) },
        method: record(estimates, settings, direct, why),
        settings: settings.clone(),
        response: direct.kind,
        frequency_hz: keep.iter().map(|&f| direct.frequency_hz[f]).collect(),
        direct: schema::Direct { response: direct_response, coherence: direct_coherence },
        derived: derived_response.map(|response| schema::Derived {
            response,
            coherence_paper: own(&measured.derived_paper),
            coherence_iv: own(&measured.derived_iv),
        }),
        measured_direction: swapped.then_some(measured),
        significance_95: schema::Significance {
            ordinary: number(significance.ordinary),
            partial: number(significance.partial),
            multiple: number(significance.multiple),
        },
        input_coherence: spectrum(&estimates.direct.input_coherence, keep),
        input_condition_number: keep.iter().map(|&f| number(estimates.direct.input_condition_number[f])).collect(),
        distortion: estimates.distortion.as_ref().map(|distortion| schema::Distortion::new(distortion, keep)),
        robust: None,
        trial_spread: None,
        course: None,
        spectra: settings.spectra.then(|| spectra(trials, estimates, keep)).flatten(),
    }
}

/// Coherences of the channels as they stand.
fn measured_direction(trials: &Trials, estimates: &Estimates, keep: &[usize]) -> schema::MeasuredDirection {
    let (ports, direct) = (&trials.roles.ports, &estimates.direct);
    let derived = estimates.derived.as_ref();
    schema::MeasuredDirection {
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        direct: schema::Coherence::new(&direct.coherence, &direct.response, &direct.response, keep),
        // The paper's assumption keeps the measured inputs, the other takes the part of them that the references cause.
        derived_paper: derived.map(|d| schema::Coherence::new(&d.coherence_paper, &d.response, &direct.response, keep)),
        derived_iv: derived.map(|d| schema::Coherence::new(&d.coherence_iv, &d.response, &d.response, keep)),
    }
}

/// What is known of the trials, and what the estimate says about the bins that are reported.
fn warnings(trials: &Trials, estimates: &Estimates, keep: &[usize]) -> Vec<Warning> {
    let concerns = |code: &str| match code {
        "weak-instrument" => estimates.derived.as_ref().is_some_and(|derived| keep.iter().any(|&f| derived.weak_instrument.get(f) == Some(&true))),
        "singular-inputs" => keep.iter().any(|f| estimates.direct.singular_bins.contains(f)),
        _ => true,
    };
    trials.warnings.iter().chain(estimates.warnings.iter().filter(|warning| concerns(&warning.code))).cloned().collect()
}

/// The direct estimate from the outputs to the inputs, for methods that keep the spectra.
fn backward(estimates: &Estimates, trials: &Trials) -> Option<DirectEstimate> {
    let ports = &trials.roles.ports;
    let turned = Ports { references: Vec::new(), inputs: ports.outputs.clone(), outputs: ports.inputs.clone() };
    let labels = Labels { references: Vec::new(), inputs: trials.names(&ports.outputs), outputs: trials.names(&ports.inputs), kind: ResponseKind::Transfer };
    ndof_sysid::direct(estimates.spectra.as_ref()?, &turned, &labels, Direct::H1).ok()
}

fn spectra(trials: &Trials, estimates: &Estimates, keep: &[usize]) -> Option<schema::Spectra> {
    let cross = estimates.spectra.as_ref()?;
    let used = trials.roles.used();
    let part = |of: fn(&num_complex::Complex64) -> f64| {
        Array3::from_shape_fn((used.len(), used.len(), keep.len()), |(a, b, f)| of(&cross.at(keep[f], used[a], used[b]))).into()
    };
    Some(schema::Spectra { channels: trials.names(&used), re: part(|v| v.re), im: part(|v| v.im) })
}
