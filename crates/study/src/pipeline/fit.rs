//! A response to a mechanical model with its covariance.

use super::Estimated;
use super::confidence::finite;
use crate::error::StudyError;
use crate::file::KinematicsFile;
use crate::result::fit as schema;
use crate::result::fit::{FitResult, Matrix, Site};
use crate::result::{VERSION, Warning, number};
use crate::roles::axis_of;
use crate::trials::Trials;
use ndarray::Array2;
use ndof_models::{Axis, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, LoopModel, Smoothing, Symmetry, Transducer, WeightedFit, linear_start};
use ndof_signal::Unit;
use ndof_sysid::FrequencyResponse;
use serde::{Deserialize, Serialize};

/// What a fit minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FitCost {
    /// Squared errors weighted by the estimate's covariance.
    #[default]
    Weighted,
    /// Gain in dB and phase in degrees weighted by coherence, as in the paper's appendix.
    Paper,
}

/// How to fit; what is `None` follows from the data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitSettings {
    /// The model's name, `inertia-damping-stiffness`.
    pub model: Option<String>,
    /// The band that is fitted.
    pub band_hz: Option<[f64; 2]>,
    /// What is minimised.
    pub cost: FitCost,
    /// What is assumed of the matrices.
    pub symmetry: Symmetry,
    /// A known compliance of the transducer.
    pub transducer: Option<Transducer>,
    /// Where the joints are.
    pub kinematics: Option<KinematicsFile>,
}

/// A fit as values to go on with, and as the result to be written.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Parameters with their covariance.
    pub fit: Fit,
    /// The matrices.
    pub matrices: InertiaDampingStiffness,
    /// The result.
    pub result: FitResult,
}

/// The name of the model that there is.
pub const MODEL: &str = "inertia-damping-stiffness";

/// Fits inertia, damping and stiffness to an estimate: to the derived one where there is one.
///
/// # Errors
/// [`StudyError`] if the response is not square or not mechanical, or the band holds too little.
pub fn fit(trials: &Trials, estimated: &Estimated, settings: &FitSettings, command: &str) -> Result<Fitted, StudyError> {
    if let Some(name) = settings.model.as_deref().filter(|name| *name != MODEL) {
        return Err(StudyError::UnknownModel { name: name.to_owned(), available: MODEL });
    }
    let derived = estimated.estimates.derived.as_ref();
    let response = derived.map_or(&estimated.estimates.direct.response, |d| &d.response);
    let ports = &trials.roles.ports;
    let motion = if response.kind.is_effort_over_motion() { &ports.inputs } else { &ports.outputs };
    let axes: Vec<Axis> = trials.channels(motion).iter().map(|channel| axis(&channel.name, &channel.unit)).collect();
    let model = InertiaDampingStiffnessModel::new(axes, settings.symmetry);
    let band_hz = settings.band_hz.unwrap_or_else(|| excited_band(estimated));
    let start = linear_start(&model, &response.band(band_hz[0], band_hz[1]))?;
    let smoothing = smoothing(estimated, band_hz);
    let fit = WeightedFit { band_hz, smoothing, transducer: settings.transducer, ..WeightedFit::default() }.fit(&model, response, &start)?;
    let matrices = model.matrices(&fit.theta);
    let result = result(trials, estimated, settings, command, &model, &fit, &matrices);
    Ok(Fitted { fit, matrices, result })
}

fn axis(channel: &str, unit: &Unit) -> Axis {
    Axis { name: axis_of(channel).to_owned(), rotational: unit.is_rotational() || (unit.symbol().is_empty() && Axis::from_channel(channel).rotational) }
}

/// How the window smooths what it sees: through the loop where a commanded force closes it, else as an open system.
fn smoothing(estimated: &Estimated, band_hz: [f64; 2]) -> Smoothing {
    let Some(derived) = &estimated.estimates.derived else { return Smoothing::Open };
    LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz).map_or(Smoothing::Open, Smoothing::Derived)
}

/// From the first frequency that the window resolves to the last at which half of every output is explained.
fn excited_band(estimated: &Estimated) -> [f64; 2] {
    let direct = &estimated.estimates.direct;
    let hz = &direct.response.frequency_hz;
    let spacing = direct.response.uncertainty.as_ref().map_or(0.0, |u| u.independent_spacing_hz);
    let explained = |f: usize| direct.coherence.multiple.row(f).iter().all(|coherence| *coherence >= 0.5);
    let last = (0..hz.len()).rev().find(|&f| explained(f)).map_or(f64::INFINITY, |f| hz[f]);
    [spacing.max(hz.get(1).copied().unwrap_or(0.0)), last]
}

fn result(
    trials: &Trials,
    estimated: &Estimated,
    settings: &FitSettings,
    command: &str,
    model: &InertiaDampingStiffnessModel,
    fit: &Fit,
    matrices: &InertiaDampingStiffness,
) -> FitResult {
    let mut warnings = estimated.result.warnings.clone();
    warnings.extend(force_sign(matrices));
    let unknown: Vec<&str> = fit.parameters.iter().filter(|p| !p.identifiable).map(|p| p.name.as_str()).collect();
    if !unknown.is_empty() {
        warnings.push(Warning::new(
            "not-identifiable",
            format!("the data say next to nothing about {}", unknown.join(", ")),
            "excite the axis more strongly or over a wider band, or fix the parameter",
        ));
    }
    let names = |indices: &[usize]| trials.names(indices);
    FitResult {
        schema: schema::SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings,
        model: MODEL.to_owned(),
        cost: super::estimate::word(&settings.cost),
        estimate: if estimated.derived.is_some() { "derived" } else { "direct" }.to_owned(),
        inputs: names(&trials.roles.ports.inputs),
        outputs: names(&trials.roles.ports.outputs),
        band_hz: fit.band_hz,
        frequencies: fit.bins,
        chi2_reduced: number(fit.chi2_reduced),
        parameters: fit
            .parameters
            .iter()
            .map(|p| schema::Parameter {
                name: p.name.clone(),
                unit: p.unit.clone(),
                site: Site { side: "limb".to_owned(), axis: p.site.clone() },
                value: number(p.value),
                std_error: number(p.std_error),
                ci95: finite(p.ci95),
                identifiable: p.identifiable,
            })
            .collect(),
        matrices: with_errors(model, fit, matrices),
        vaf: Vec::new(),
        r2: None,
        joint: None,
        paper: None,
    }
}

/// Matrices with the standard error of each entry.
fn with_errors(model: &InertiaDampingStiffnessModel, fit: &Fit, matrices: &InertiaDampingStiffness) -> schema::Matrices {
    let errors: Vec<f64> = fit.parameters.iter().map(|p| p.std_error).collect();
    let errors = model.matrices(&errors);
    schema::Matrices {
        M: rows(&matrices.inertia),
        B: rows(&matrices.damping),
        K: rows(&matrices.stiffness),
        std_error: schema::MatrixErrors { M: rows(&errors.inertia), B: rows(&errors.damping), K: rows(&errors.stiffness) },
        delay_s: None,
    }
}

pub(super) fn rows(matrix: &Array2<f64>) -> Matrix {
    matrix.rows().into_iter().map(|row| row.iter().map(|v| number(*v)).collect()).collect()
}

/// A limb with negative inertia is a transducer that reads the reaction.
fn force_sign(matrices: &InertiaDampingStiffness) -> Option<Warning> {
    let negative = matrices.inertia.diag().iter().all(|m| *m < 0.0);
    negative.then(|| {
        Warning::new(
            "force-sign",
            "the fitted inertia is negative definite: the force channels seem to hold the reaction, not the force on the limb",
            "turn them with --negate CHANNEL if that is how they were recorded",
        )
    })
}

/// The response of the fitted model on the grid of `like`, of its kind and with its names.
pub fn model_response(matrices: &InertiaDampingStiffness, like: &FrequencyResponse) -> FrequencyResponse {
    FrequencyResponse { inputs: like.inputs.clone(), outputs: like.outputs.clone(), ..matrices.response(&like.frequency_hz, like.kind) }
}
