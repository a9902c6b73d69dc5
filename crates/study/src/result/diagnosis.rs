//! `ndof/diagnosis/1`: what the simulation gets wrong, the cause by name, the extended model, the gain.

use super::fit::Site;
use super::{Number, Warning};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The schema's name.
pub const SCHEMA: &str = "ndof/diagnosis/1";

/// What a simulation gets wrong, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DiagnosisResult {
    /// `ndof/diagnosis/1`.
    pub schema: String,
    /// The version that wrote it.
    pub ndof_version: String,
    /// The subcommand.
    pub command: String,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
    /// Inputs of the data.
    pub inputs: Vec<String>,
    /// Outputs of the data.
    pub outputs: Vec<String>,
    /// The diagnosis itself.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
}

/// The diagnosis itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// What was fitted and what was held out.
    pub split: Split,
    /// The model that was judged.
    pub baseline: Model,
    /// What no model can predict.
    pub noise_floor: NoiseFloor,
    /// Where and of what kind the baseline's residual is.
    pub discrepancy: Discrepancy,
    /// `adequate`, `explained`, `partly-explained` or `unexplained`.
    pub verdict: String,
    /// Named causes, strongest first.
    pub causes: Vec<Cause>,
    /// The baseline with its causes.
    pub extended: Extended,
    /// What else was tried.
    pub considered: Vec<Considered>,
    /// What is significant but below the tolerance.
    pub minor: Vec<Minor>,
    /// Causes that this recording cannot tell apart.
    pub confusable: Vec<Confusable>,
}

/// What was fitted and what was held out, in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Split {
    /// What was fitted.
    pub estimation: String,
    /// What was held out.
    pub held_out: String,
    /// Length of the windows of a plant without a restoring force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub windows_s: Option<f64>,
}

/// How well held-out outputs are predicted by free run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Score {
    /// rms(y − ŷ)/std(y) of each output.
    pub nrmse: Vec<Number>,
    /// 100 (1 − var(y − ŷ)/var(y)) of each output.
    pub vaf_percent: Vec<Number>,
}

/// A model with its held-out score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Model {
    /// Its name.
    pub model: String,
    /// Its parameters.
    pub parameters: Vec<ModelParameter>,
    /// How it predicts what it has not seen.
    pub held_out: Score,
}

/// A parameter of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModelParameter {
    /// `K_x_y`, or `K` for one axis.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Value.
    pub value: Number,
    /// Standard error, where it was fitted.
    pub std_error: Number,
}

/// The part of the outputs that no model predicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NoiseFloor {
    /// Per output.
    pub nrmse: Vec<Number>,
    /// How it was found.
    pub how: String,
}

/// Where and of what kind the baseline's residual is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Discrepancy {
    /// By frequency.
    pub by_band: Vec<BandShare>,
    /// By time.
    pub by_time: Vec<TimeShare>,
    /// What some linear model would explain.
    pub linear_share: Number,
    /// What repeats and no linear model explains.
    pub nonlinear_share: Number,
    /// What changes with time.
    pub time_varying_share: Number,
    /// The rest; the four sum to one.
    pub noise_share: Number,
    /// Remarks with their numbers.
    pub notes: Vec<String>,
}

/// A share of the discrepancy in one band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BandShare {
    /// Edges.
    pub band_hz: [f64; 2],
    /// The output.
    pub output: String,
    /// Share of this output's residual.
    pub share: Number,
}

/// A share of the held-out error in one stretch of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimeShare {
    /// From and to.
    pub time_s: [f64; 2],
    /// The output.
    pub output: String,
    /// Share of this output's error.
    pub share: Number,
}

/// A named cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Cause {
    /// A name that `ndof list effects` prints.
    pub effect: String,
    /// Where it sits.
    pub site: Site,
    /// Its parameters.
    pub parameters: Vec<CauseParameter>,
    /// That it is this effect and side, among the alternatives of its step.
    pub probability: Number,
    /// Adjusted (Holm) for everything tried in its step.
    pub p_value: Number,
    /// What naming it gains.
    pub gain: Gain,
    /// Sentences with their numbers.
    pub evidence: Vec<String>,
}

/// A parameter of a cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CauseParameter {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// A number, a word, a yes or no, or a matrix.
    pub value: Option<CauseValue>,
    /// 95 % interval of a number.
    pub ci95: Option<[f64; 2]>,
}

/// A number, a word, a yes or no, or a matrix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum CauseValue {
    /// Yes or no.
    Flag(bool),
    /// A number in SI units.
    Number(f64),
    /// A channel or a parameter's name.
    Text(String),
    /// Rows of a matrix.
    Matrix(Vec<Vec<Number>>),
}

/// What naming a cause gains on held-out data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gain {
    /// Without it.
    pub nrmse_before: Vec<Number>,
    /// With it.
    pub nrmse_after: Vec<Number>,
    /// Without it, percent.
    pub vaf_before: Vec<Number>,
    /// With it, percent.
    pub vaf_after: Vec<Number>,
    /// Share of the explainable error that it removes.
    pub explained_fraction: Number,
    /// Its 95 % interval.
    pub explained_fraction_ci95: Option<[f64; 2]>,
    /// BIC without the cause less BIC with it.
    pub delta_bic: Number,
}

/// The baseline with its causes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Extended {
    /// Its name.
    pub model: String,
    /// Its linear parameters.
    pub parameters: Vec<ModelParameter>,
    /// How it predicts what it has not seen.
    pub held_out: Score,
    /// Whether what is left has no structure that the tests see.
    pub residual_white: bool,
    /// What the missing effect had biased.
    pub parameter_shift: Vec<Shift>,
}

/// A parameter of the baseline that the missing effect had biased.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Shift {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Without the causes.
    pub before: Number,
    /// With them.
    pub after: Number,
}

/// A hypothesis that was tried and not named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Where it would sit.
    pub site: Site,
    /// Share of the residual that it removes alone.
    pub explained_fraction: Number,
    /// Adjusted (Holm).
    pub p_value: Number,
    /// Why it was not named.
    pub why_not: String,
}

/// Something significant and immaterial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Minor {
    /// Its name.
    pub effect: String,
    /// Where it sits.
    pub site: Site,
    /// What it removes of the effort's rms or changes of the prediction, whichever is more, as a share.
    pub removed: Number,
    /// Why it is not named.
    pub why: String,
}

/// Causes that this recording cannot tell apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Confusable {
    /// Their names.
    pub effects: Vec<String>,
    /// The experiment that would.
    pub next_experiment: String,
    /// How well experiments would tell the first two apart, simulated, the best first; with `--plan`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predicted: Vec<Prospect>,
}

/// An experiment that was simulated with either of two causes as the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Prospect {
    /// What would be done.
    pub experiment: String,
    /// Penalised log-likelihood by which the true cause leads the other, in the worse of the two cases.
    pub separation: Number,
    /// Whether that decides between them.
    pub decides: bool,
}
