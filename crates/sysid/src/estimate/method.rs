//! One call for every spectral method: trials in, estimates out.

use super::{DerivedEstimate, Direct, DirectEstimate, EstimateError, derived, direct};
use crate::labels::Labels;
use crate::ports::Ports;
use crate::warning::Warning;
use ndof_signal::{CrossSpectra, Recording, Welch};
use serde::{Deserialize, Serialize};

/// How spectra are made from recordings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SpectralMethod {
    /// Averages over windowed, overlapping segments.
    Welch(Welch),
}

impl SpectralMethod {
    /// The word that asks for it on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            SpectralMethod::Welch(_) => "welch",
        }
    }
}

/// Everything that one estimation gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimates {
    /// Outputs over measured inputs.
    pub direct: DirectEstimate,
    /// Outputs over inputs by way of the references, where there are at least as many as inputs.
    pub derived: Option<DerivedEstimate>,
    /// Cross-spectra of all channels of the recordings, pooled over trials, for methods that have them.
    pub spectra: Option<CrossSpectra>,
    /// How it was done.
    pub method: SpectralMethod,
    /// Effective averages over all trials.
    pub effective_averages: f64,
    /// What to know before using it.
    pub warnings: Vec<Warning>,
}

/// Estimates the response of the outputs to the inputs from repeated trials of one experiment.
///
/// Spectra are pooled over trials before any inversion. References add the derived estimate.
///
/// # Errors
/// [`EstimateError`] if there is no trial, a trial cannot be transformed, trials differ, or the estimate does not exist.
///
/// ```
/// use ndof_signal::{Channel, Quantity, Recording, Unit, Welch};
/// use ndof_sysid::{Direct, Labels, Ports, SpectralMethod, estimate};
/// let force: Vec<f64> = (0..4000_u32).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 16) - 32768.0).collect();
/// let angle = force.iter().map(|f| 0.5 * f).collect();
/// let channel = |name: &str, quantity, samples| Channel::new(name, Unit::si(quantity, true), samples);
/// let trial = Recording::new(100.0, vec![channel("torque", Quantity::Effort, force), channel("angle", Quantity::Displacement, angle)])?;
/// let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
/// let found = estimate(&[&trial], &ports, &Labels::of(&trial, &ports), &SpectralMethod::Welch(Welch::new(256)), Direct::H1)?;
/// assert!((found.direct.response.value[[10, 0, 0]].re - 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn estimate(trials: &[&Recording], ports: &Ports, labels: &Labels, method: &SpectralMethod, estimator: Direct) -> Result<Estimates, EstimateError> {
    let spectra = match method {
        SpectralMethod::Welch(welch) => pooled(trials, |recording, trial| {
            let all: Vec<usize> = (0..recording.channels().len()).collect();
            welch.spectra(recording.sample_rate_hz(), &recording.columns(&all)).map_err(|source| EstimateError::Welch { trial, source })
        })?,
    };
    let direct = direct(&spectra, ports, labels, estimator)?;
    let derived = if ports.references.len() >= ports.inputs.len() { Some(derived(&spectra, ports, labels)?) } else { None };
    let warnings = warnings(&direct, derived.as_ref(), ports);
    Ok(Estimates { effective_averages: spectra.effective_averages(), direct, derived, spectra: Some(spectra), method: method.clone(), warnings })
}

fn pooled(trials: &[&Recording], transform: impl Fn(&Recording, usize) -> Result<CrossSpectra, EstimateError>) -> Result<CrossSpectra, EstimateError> {
    let mut spectra = Vec::with_capacity(trials.len());
    for (k, recording) in trials.iter().enumerate() {
        spectra.push(transform(recording, k + 1)?);
    }
    match spectra.len() {
        0 => Err(EstimateError::NoTrial),
        1 => Ok(spectra.remove(0)),
        _ => Ok(CrossSpectra::pool(&spectra)?),
    }
}

fn warnings(direct: &DirectEstimate, derived: Option<&DerivedEstimate>, ports: &Ports) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let frequencies = |bins: &[usize]| -> String {
        let hz = |f: usize| direct.response.frequency_hz[f];
        match bins {
            [one] => format!("{:.3} Hz", hz(*one)),
            [first, .., last] => format!("{} frequencies between {:.3} and {:.3} Hz", bins.len(), hz(*first), hz(*last)),
            [] => String::new(),
        }
    };
    if !direct.singular_bins.is_empty() {
        warnings.push(Warning::new(
            "singular-inputs",
            format!("inputs depend on each other, or are silent, at {}; there is no estimate there", frequencies(&direct.singular_bins)),
            "excite those frequencies with independent signals, or leave them out with --band",
        ));
    }
    if ports.references.is_empty() {
        warnings.push(Warning::new(
            "no-reference",
            "no reference channel: if a controller feeds the motion back to the force, the direct estimate is biased towards the controller",
            "record the commanded perturbation and name it with --reference",
        ));
    } else if derived.is_none() {
        warnings.push(Warning::new(
            "too-few-references",
            format!("{} reference(s) for {} inputs: there is no derived estimate", ports.references.len(), ports.inputs.len()),
            "name as many commanded channels as inputs with --reference",
        ));
    }
    if let Some(derived) = derived {
        let weak: Vec<usize> = (0..derived.weak_instrument.len()).filter(|&f| derived.weak_instrument[f]).collect();
        if !weak.is_empty() {
            warnings.push(Warning::new(
                "weak-instrument",
                format!("the references hardly reach the inputs at {}; the derived estimate is uncertain and biased there", frequencies(&weak)),
                "perturb more strongly there, add trials, or leave those frequencies out with --band",
            ));
        }
    }
    warnings
}
