//! A response to a mechanical model with its covariance.

use super::Estimated;
use super::confidence::finite;
use super::method::word;
use super::named_models::{MODEL, blocks_of, compared_models};
use super::project::project;
use crate::error::StudyError;
use crate::file::KinematicsFile;
use crate::result::fit as schema;
use crate::result::fit::{FitResult, Matrix, Site};
use crate::result::{VERSION, Warning, number};
use crate::roles::axis_of;
use crate::trials::Trials;
use ndarray::{Array2, Array3};
use ndof_models::blocks::{self, BlockCard, Composite};
use ndof_models::{
    Agreement, Axis, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, LoopModel, PaperFit, Parameter, ParametricModel, Smoothing, Symmetry,
    Transducer, WeightedFit, agreement, linear_start, parametric_response,
};
use ndof_signal::Unit;
use ndof_sysid::{Direct, FrequencyResponse, Ports};
use num_complex::Complex64;
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

/// How coherence weighs the paper's measures of agreement and its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VafWeight {
    /// By the partial coherence as it is computed, γ².
    #[default]
    GammaSquared,
    /// By its root γ.
    Gamma,
}

/// How to fit; what is `None` follows from the data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitSettings {
    /// The model's name: `inertia-damping-stiffness`, and any number of the registry's blocks behind a `+`.
    pub model: Option<String>,
    /// The band that is fitted.
    pub band_hz: Option<[f64; 2]>,
    /// What is minimised.
    pub cost: FitCost,
    /// Estimator of the direct estimate, where that is what is fitted.
    pub estimator: Direct,
    /// What is assumed of the matrices.
    pub symmetry: Symmetry,
    /// A known compliance of the transducer.
    pub transducer: Option<Transducer>,
    /// How coherence weighs VAF, R² and the paper's cost.
    pub vaf_weight: VafWeight,
    /// Where the joints are.
    pub kinematics: Option<KinematicsFile>,
    /// Compare with every single block of the registry, not only with the models that are part of this one.
    pub compare: bool,
    /// Allow for what calibration leaves, by the floors of [`FLOORS`] and [`DELAY_FLOOR_S`].
    pub systematic: bool,
}

/// What is added in quadrature to standard errors for systematic errors: 0.5 % of inertia, 1 % of damping and of stiffness.
pub const FLOORS: [(char, f64); 3] = [('M', 0.005), ('B', 0.01), ('K', 0.01)];
/// The same for delays.
pub const DELAY_FLOOR_S: f64 = 1e-4;

/// A fit as values to go on with, and as the result to be written.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Inertia, damping and stiffness with their covariance, whatever else was fitted with them.
    pub fit: Fit,
    /// The baseline whose parameters they are.
    pub model: InertiaDampingStiffnessModel,
    /// The matrices.
    pub matrices: InertiaDampingStiffness,
    /// How the estimate's window and the transducer entered the comparison.
    pub comparison: WeightedFit,
    /// The mean of each effort, which a projection may take off.
    pub mean_effort: Vec<f64>,
    /// The blocks that were fitted with the baseline, by their names in the registry.
    pub extensions: Vec<&'static str>,
    /// Parameters of baseline and blocks.
    pub theta: Vec<f64>,
    /// The result.
    pub result: FitResult,
}

/// How far beyond the fitted band the model is drawn.
const DRAWN_BEYOND: f64 = 2.0;

impl Fitted {
    /// The baseline with its blocks, whose parameters [`Fitted::theta`] are.
    pub fn whole(&self) -> Composite {
        let cards: Vec<&BlockCard> = self.extensions.iter().filter_map(|name| blocks::find(name)).collect();
        Composite::of_cards(&self.model, &cards)
    }

    /// The model as the estimate that it was fitted to would show it, to twice the fitted band's upper end; NaN beyond. It is of
    /// the kind that is reported.
    ///
    /// # Errors
    /// [`StudyError`] if a response of that kind does not exist.
    pub fn seen(&self, estimated: &Estimated) -> Result<FrequencyResponse, StudyError> {
        let estimates = &estimated.estimates;
        let like = estimates.derived.as_ref().map_or(&estimates.direct.response, |d| &d.response);
        let kernel = like.uncertainty.as_ref().map(|u| u.kernel.clone()).unwrap_or_default();
        let drawn = like.frequency_hz.partition_point(|hz| *hz <= DRAWN_BEYOND * self.fit.band_hz[1]);
        let near = self.comparison.seen(&self.whole(), &self.theta, like.kind, &like.frequency_hz[..drawn], &kernel);
        let nowhere = Complex64::new(f64::NAN, f64::NAN);
        let value = Array3::from_shape_fn(like.value.dim(), |(f, i, j)| if f < drawn { near[[f, i, j]] } else { nowhere });
        let seen = FrequencyResponse { value, uncertainty: None, ..like.clone() };
        Ok(seen.to_kind(estimated.best().kind)?)
    }
}

/// Above this reduced χ² the model is wrong by more than the covariance's own uncertainty.
const MISFIT: f64 = 2.0;

/// Fits inertia, damping and stiffness to an estimate: to the derived one where there is one.
///
/// # Errors
/// [`StudyError`] if the response is not square or not mechanical, or the band holds too little.
///
/// ```
/// use ndof_study::file::{ExperimentFile, parse};
/// use ndof_study::{EstimateSettings, FitSettings, RoleNames, Trial, Trials, Trim, estimate, fit, simulate};
///
/// let experiment: ExperimentFile = parse(r#"
///     duration_s = 20.0
///     [device.robot]
///     schema = "ndof/robot/1"
///     name = "slide"
///     axes = ["x"]
///     joints = [{ name = "carriage", kind = "prismatic", axis = [1.0, 0.0, 0.0], mass_kg = 1.0, gear_ratio = 10.0 }]
///     [limb]
///     name = "endpoint-linear"
///     M = [[2.0]]
///     B = [[12.0]]
///     K = [[300.0]]
/// "#, "slide.toml")?;
/// let recording = simulate(&experiment, &|_, _, _| ())?.recordings.remove(0);
/// let trial = Trial { file: "slide".to_owned(), recording, warnings: Vec::new() };
/// let trials = Trials::new(vec![trial], &RoleNames::default(), &Trim::default())?;
/// let estimated = estimate(&trials, &EstimateSettings { nperseg: Some(1024), ..EstimateSettings::default() }, "example")?;
/// let fitted = fit(&trials, &estimated, &FitSettings { band_hz: Some([0.5, 10.0]), ..FitSettings::default() }, "example")?;
/// assert!((fitted.matrices.stiffness[[0, 0]] - 300.0).abs() < 15.0); // N/m
/// # Ok::<(), ndof_study::StudyError>(())
/// ```
pub fn fit(trials: &Trials, estimated: &Estimated, settings: &FitSettings, command: &str) -> Result<Fitted, StudyError> {
    let cards = blocks_of(settings.model.as_deref().unwrap_or(MODEL))?;
    let derived = estimated.estimates.derived.as_ref();
    let response = derived.map_or(&estimated.estimates.direct.response, |d| &d.response);
    let ports = &trials.roles.ports;
    let motion = if response.kind.is_effort_over_motion() { &ports.inputs } else { &ports.outputs };
    let axes: Vec<Axis> = trials.channels(motion).iter().map(|channel| axis(&channel.name, &channel.unit)).collect();
    let model = InertiaDampingStiffnessModel::new(axes, settings.symmetry);
    let band_hz = settings.band_hz.unwrap_or_else(|| excited_band(estimated, ports));
    let start = linear_start(&model, &response.band(band_hz[0], band_hz[1]))?;
    let without = super::estimate::without_each(trials, estimated, settings.estimator)?;
    let comparison = WeightedFit { band_hz, smoothing: smoothing(estimated, band_hz), transducer: settings.transducer, ..WeightedFit::default() };
    let composite = Composite::of_cards(&model, &cards);
    let begin = comparison.fit_from(&composite, response, &composite.starts(&start))?.theta;
    let compared = compared_models(&comparison, &model, response, &cards, &start, settings.compare);
    let weighted = comparison.fit_trials(&composite, response, &without, &begin)?;
    let partial = derived.map_or(&estimated.estimates.direct.coherence.partial, |d| &d.coherence_paper.partial);
    let weight = &match settings.vaf_weight {
        VafWeight::GammaSquared => partial.clone(),
        VafWeight::Gamma => partial.mapv(f64::sqrt),
    };
    let paper = PaperFit { band_hz }.fit_trials(&composite, response, &without, weight, &weighted.theta)?;
    let (mut fit, mut other) = match settings.cost {
        FitCost::Weighted => (weighted, paper),
        FitCost::Paper => (paper, weighted),
    };
    if settings.systematic {
        add_floors(&mut fit);
        add_floors(&mut other);
    }
    let base = model.parameters().len();
    let baseline = fit.marginal(base);
    let matrices = model.matrices(&baseline.theta);
    let efforts = if trials.roles.natural_kind().is_effort_over_motion() { &ports.outputs } else { &ports.inputs };
    let mean_effort: Vec<f64> = efforts.iter().map(|&index| trials.mean(index)).collect();
    let joint = settings.kinematics.as_ref().map(|file| project(file, &model, &baseline, &mean_effort)).transpose()?;
    let agree = |fit: &Fit| agreement(response, &composite_response(&composite, &fit.theta, response), weight, band_hz);
    let other = schema::OtherFit {
        cost: word(&if settings.cost == FitCost::Weighted { FitCost::Paper } else { FitCost::Weighted }),
        parameters: parameters(&other, base, &cards),
        matrices: with_errors(&model, &other.marginal(base), &other),
        vaf: vaf(&agree(&other)?),
        r2: agree(&other)?.r2,
    };
    let agreement = agree(&fit)?;
    let result = FitResult {
        schema: schema::SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings: warnings(estimated, &fit, &matrices),
        model: composite.name().to_owned(),
        cost: word(&settings.cost),
        estimate: if derived.is_some() { "derived" } else { "direct" }.to_owned(),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        band_hz: fit.band_hz,
        frequencies: fit.bins,
        chi2_reduced: number(fit.chi2_reduced),
        parameters: parameters(&fit, base, &cards),
        matrices: with_errors(&model, &baseline, &fit),
        vaf: vaf(&agreement),
        r2: agreement.r2,
        joint: joint.as_ref().map(|(_, joint)| joint.clone()),
        other_cost: Some(other),
        comparison: compared,
    };
    let extensions = cards.iter().map(|card| card.name()).collect();
    Ok(Fitted { fit: baseline, model, matrices, comparison, mean_effort, extensions, theta: fit.theta, result })
}

/// Adds the floors of systematic errors to the covariance.
fn add_floors(fit: &mut Fit) {
    for (k, p) in fit.parameters.iter_mut().enumerate() {
        let floor = match FLOORS.iter().find(|(matrix, _)| p.name == matrix.to_string() || p.name.starts_with(&format!("{matrix}_"))) {
            Some((_, share)) => share * p.value.abs(),
            None if p.name.starts_with("delay_s") => DELAY_FLOOR_S,
            None => continue,
        };
        let half = fit.interval_quantile * p.std_error.hypot(floor);
        fit.covariance[[k, k]] += floor * floor;
        p.std_error = p.std_error.hypot(floor);
        p.ci95 = [p.value - half, p.value + half];
    }
}

/// Parameters of the whole model; those of a channel's block belong to the sensor.
fn parameters(fit: &Fit, base: usize, cards: &[&BlockCard]) -> Vec<schema::Parameter> {
    let blocks = cards.iter().flat_map(|card| std::iter::repeat_n(card.is_sensor(), (card.block)().parameters(false).len()));
    let sensor: Vec<bool> = std::iter::repeat_n(false, base).chain(blocks).collect();
    let mut out: Vec<schema::Parameter> = fit.parameters.iter().map(parameter).collect();
    out.iter_mut().zip(sensor).filter(|(_, sensor)| *sensor).for_each(|(p, _)| p.site.side = "sensor".to_owned());
    out
}

fn composite_response(model: &Composite, theta: &[f64], like: &FrequencyResponse) -> FrequencyResponse {
    FrequencyResponse { inputs: like.inputs.clone(), outputs: like.outputs.clone(), ..parametric_response(model, theta, &like.frequency_hz, like.kind) }
}

fn vaf(agreement: &Agreement) -> Matrix {
    agreement.vaf_percent.iter().map(|row| row.iter().map(|v| v.and_then(number)).collect()).collect()
}

/// A parameter as results hold it.
pub(super) fn parameter(p: &Parameter) -> schema::Parameter {
    schema::Parameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        site: Site { side: "limb".to_owned(), axis: p.site.clone() },
        value: number(p.value),
        std_error: number(p.std_error),
        ci95: finite(p.ci95),
        identifiable: p.identifiable,
    }
}

fn axis(channel: &str, unit: &Unit) -> Axis {
    Axis { name: axis_of(channel).to_owned(), rotational: unit.is_rotational() || (unit.symbol().is_empty() && Axis::from_channel(channel).rotational) }
}

/// How the window smooths what it sees: through the loop where a commanded force closes it, else as an open system.
fn smoothing(estimated: &Estimated, band_hz: [f64; 2]) -> Smoothing {
    let Some(derived) = &estimated.estimates.derived else { return Smoothing::Open };
    LoopModel::estimate(&derived.to_reference.t, &derived.to_reference.r, band_hz).map_or(Smoothing::Open, Smoothing::Derived)
}

/// From the first frequency that the window resolves to that below which all but a fiftieth of each input's power lies,
/// and where half of every output is explained.
fn excited_band(estimated: &Estimated, ports: &Ports) -> [f64; 2] {
    const BEYOND: f64 = 0.02;
    let direct = &estimated.estimates.direct;
    let hz = &direct.response.frequency_hz;
    let spacing = direct.response.uncertainty.as_ref().map_or(0.0, |u| u.independent_spacing_hz);
    let explained = |f: usize| direct.coherence.multiple.row(f).iter().all(|coherence| *coherence >= 0.5);
    let last = (0..hz.len()).rev().find(|&f| explained(f)).map_or(f64::INFINITY, |f| hz[f]);
    let driven = estimated.estimates.spectra.as_ref().map_or(f64::INFINITY, |spectra| {
        let highest = |input: usize| {
            let total: f64 = (1..hz.len()).map(|f| spectra.power(f, input)).sum();
            let mut beyond = 0.0;
            (1..hz.len()).rev().find(|&f| {
                beyond += spectra.power(f, input);
                beyond > BEYOND * total
            })
        };
        ports.inputs.iter().filter_map(|&input| highest(input)).map(|f| hz[f]).fold(0.0, f64::max)
    });
    [spacing.max(hz.get(1).copied().unwrap_or(0.0)), last.min(driven)]
}

fn warnings(estimated: &Estimated, fit: &Fit, matrices: &InertiaDampingStiffness) -> Vec<Warning> {
    let mut warnings = estimated.result.warnings.clone();
    if !weak_in_band(estimated, fit.band_hz) {
        warnings.retain(|warning| warning.code != "weak-instrument");
    }
    warnings.extend(force_sign(matrices));
    let unknown: Vec<&str> = fit.parameters.iter().filter(|p| !p.identifiable).map(|p| p.name.as_str()).collect();
    if !unknown.is_empty() {
        warnings.push(Warning::new(
            "not-identifiable",
            format!("the data say next to nothing about {}", unknown.join(", ")),
            "record longer or excite the axis more strongly or over a wider band, or fix the parameter",
        ));
    }
    if fit.chi2_reduced > MISFIT {
        warnings.push(Warning::new(
            "model-misfit",
            format!("reduced chi² is {:.1}: the model leaves more than noise, and its intervals are too narrow", fit.chi2_reduced),
            "fit a narrower band with --band, or ask `ndof diagnose` what the model lacks",
        ));
    }
    warnings
}

/// Whether the references hardly reach the inputs at a frequency that was fitted.
fn weak_in_band(estimated: &Estimated, [low_hz, high_hz]: [f64; 2]) -> bool {
    estimated.estimates.derived.as_ref().is_some_and(|derived| {
        let weak = derived.response.frequency_hz.iter().zip(&derived.weak_instrument);
        weak.into_iter().any(|(hz, weak)| *weak && (low_hz..=high_hz).contains(hz))
    })
}

/// Matrices with the standard error of each entry.
fn with_errors(model: &InertiaDampingStiffnessModel, fit: &Fit, whole: &Fit) -> schema::Matrices {
    let matrices = model.matrices(&fit.theta);
    let errors: Vec<f64> = fit.parameters.iter().map(|p| p.std_error).collect();
    schema::Matrices {
        M: rows(&matrices.inertia),
        B: rows(&matrices.damping),
        K: rows(&matrices.stiffness),
        std_error: std_errors(&model.matrices(&errors)),
        delay_s: whole.parameter("delay_s").and_then(|p| number(p.value)),
    }
}

pub(super) fn std_errors(errors: &InertiaDampingStiffness) -> schema::MatrixErrors {
    schema::MatrixErrors { M: rows(&errors.inertia), B: rows(&errors.damping), K: rows(&errors.stiffness) }
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

/// The response of inertia, damping and stiffness on the grid of `like`, of its kind and with its names.
pub fn model_response(matrices: &InertiaDampingStiffness, like: &FrequencyResponse) -> FrequencyResponse {
    FrequencyResponse { inputs: like.inputs.clone(), outputs: like.outputs.clone(), ..matrices.response(&like.frequency_hz, like.kind) }
}
