//! What a diagnosis says. Field names are those of `ndof/diagnosis/1`.

mod cause;

pub use cause::{Cause, CauseParameter, Gain, Site, UNSURE};

use ndof_models::effects::Value;
use serde::{Deserialize, Deserializer, Serialize};

/// A number that does not exist is `null` in JSON and NaN here.
fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

fn value_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Value, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(Value::Number(f64::NAN)))
}

/// How JSON shows a [`Value`].
#[cfg(feature = "schema")]
#[derive(schemars::JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "its schema is all that is wanted")]
enum AnyValue {
    /// Yes or no.
    Flag(bool),
    /// A number in SI units.
    Number(f64),
    /// A channel or a parameter's name.
    Text(String),
    /// Rows of a matrix.
    Matrix(Vec<Vec<Option<f64>>>),
}

/// The answer: what the baseline gets wrong, why, and what naming it gains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Diagnosis {
    /// What was fitted and what was held out.
    pub split: Split,
    /// The model that was judged.
    pub baseline: Model,
    /// What no model can predict.
    pub noise_floor: NoiseFloor,
    /// Where the baseline is wrong.
    pub discrepancy: Discrepancy,
    /// The verdict.
    pub verdict: Verdict,
    /// Named causes, strongest first.
    pub causes: Vec<Cause>,
    /// The baseline with its causes.
    pub extended: Extended,
    /// What else was tried in the first step.
    pub considered: Vec<Considered>,
    /// What is significant but immaterial.
    pub minor: Vec<Minor>,
    /// Causes that this recording cannot tell apart.
    pub confusable: Vec<Confusable>,
}

/// What was fitted and what was held out, in words.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Split {
    /// What was fitted.
    pub estimation: String,
    /// What was held out.
    pub held_out: String,
    /// Length of the windows that the held-out part is cut into, where the plant has no restoring force.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub windows_s: Option<f64>,
}

/// How well the held-out outputs are predicted by free run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Score {
    /// rms(y - ŷ) / std(y) of each output, a constant of each trial taken off where the whole is one run; `None` where the prediction diverges.
    pub nrmse: Vec<Option<f64>>,
    /// 100 (1 - var(y - ŷ) / var(y)) of each output.
    pub vaf_percent: Vec<Option<f64>>,
}

/// A parameter of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ModelParameter {
    /// Its name: `K_x_y`, or `K` for one axis.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// Its value.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub value: f64,
    /// Its standard error, where it was fitted.
    pub std_error: Option<f64>,
    /// What is wrong with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flag: Option<ParameterFlag>,
}

/// Why an inertia or a stiffness is not to be used: by more than two standard errors, no body has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum ParameterFlag {
    /// Along one axis it is below zero: a sign, the band or the model is wrong.
    BelowZero,
    /// Between two axes it is larger than the inertias along them allow: two channels may stand in each other's place.
    OfNoBody,
}

/// A model with its held-out score.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Model {
    /// Its name.
    pub model: String,
    /// Its parameters.
    pub parameters: Vec<ModelParameter>,
    /// How it predicts what it has not seen.
    pub held_out: Score,
}

/// The part of the outputs that no model predicts from the input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NoiseFloor {
    /// Per output.
    pub nrmse: Vec<Option<f64>>,
    /// How it was found.
    pub how: String,
}

impl NoiseFloor {
    /// Adds what is too slow for blocks to tell of: the shares of each output's variance that a model's error, and the output itself, have there.
    pub(crate) fn add_what_is_slow(&mut self, slow: &[[f64; 2]]) {
        for (floor, [error, output]) in self.nrmse.iter_mut().zip(slow) {
            *floor = floor.map(|floor| (floor * floor * (1.0 - output).max(0.0) + error).sqrt().min(1.0));
        }
        if !slow.is_empty() {
            self.how += "; slower than its blocks, what the named causes leave";
        }
    }

    /// What a model has reached is no less than what remains at best.
    pub(crate) fn below(&mut self, score: &Score) {
        for (floor, reached) in self.nrmse.iter_mut().zip(&score.nrmse) {
            *floor = floor.map(|floor| reached.map_or(floor, |reached| floor.min(reached)));
        }
    }

    /// Its mean square over all outputs.
    pub(crate) fn variance(&self) -> f64 {
        self.nrmse.iter().map(|f| f.map_or(0.0, |f| f * f)).sum::<f64>() / self.nrmse.len() as f64
    }

    /// What is left where a stretch has matrices of its own.
    pub(crate) fn beside_another_plant(&mut self, score: &Score) {
        self.below(score);
        self.how += "; where the plant is as another, what matrices of its own leave";
    }

    /// What a model leaves in which nothing was found to follow from the inputs.
    pub(crate) fn of_the_rest(score: &Score) -> Self {
        NoiseFloor { nrmse: score.nrmse.clone(), how: "what the model leaves: nothing in it was found to follow from the inputs".to_owned() }
    }
}

/// A share of the discrepancy in one band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BandShare {
    /// Edges.
    pub band_hz: [f64; 2],
    /// The output.
    pub output: String,
    /// Share of this output's residual.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub share: f64,
}

/// A share of the held-out error in one stretch of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TimeShare {
    /// From and to, in seconds since the held-out part began.
    pub time_s: [f64; 2],
    /// The output.
    pub output: String,
    /// Share of this output's error.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub share: f64,
}

/// Where and of what kind the baseline's residual is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Discrepancy {
    /// By frequency band and output.
    pub by_band: Vec<BandShare>,
    /// By time and output.
    pub by_time: Vec<TimeShare>,
    /// What some linear model of the same signals explains.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub linear_share: f64,
    /// What no linear model explains but a nonlinear one does.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub nonlinear_share: f64,
    /// What changes with time.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub time_varying_share: f64,
    /// The rest.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub noise_share: f64,
    /// The stretch of the held-out part that is as of another plant than what was fitted, if one is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub another_plant: Option<AnotherPlant>,
    /// Remarks with their numbers.
    pub notes: Vec<String>,
}

/// A stretch that matrices and factors of its own foretell better, beyond chance and by more than the tolerance: the plant changed, or the form of the model is
/// not the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AnotherPlant {
    /// Which, in words.
    pub stretch: String,
    /// The error of the free run over it with them, per output.
    pub nrmse: Vec<Option<f64>>,
}

/// The verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nothing beyond the tolerance is missing.
    Adequate,
    /// The named causes explain what is missing.
    Explained,
    /// The named causes explain part of it.
    PartlyExplained,
    /// Something is missing that no known cause explains.
    Unexplained,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.serialize(f)
    }
}

impl Score {
    /// Whether its errors are larger than another's, over all outputs together.
    pub fn is_worse_than(&self, other: &Score) -> bool {
        together(&self.nrmse) > together(&other.nrmse)
    }
}

/// Sum of squares; infinite where there is no error that is finite.
fn together(errors: &[Option<f64>]) -> f64 {
    errors.iter().map(|e| e.map_or(f64::INFINITY, |e| e * e)).sum()
}

/// A parameter of the baseline that the missing effect had biased.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Shift {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Without the causes.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub before: f64,
    /// With them.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub after: f64,
}

/// The baseline with its causes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Extended {
    /// Its name.
    pub model: String,
    /// Its linear parameters.
    pub parameters: Vec<ModelParameter>,
    /// How it predicts what it has not seen.
    pub held_out: Score,
    /// Whether what is left has no structure that the tests see.
    pub residual_white: bool,
    /// Entries of the baseline that are others with the causes.
    pub parameter_shift: Vec<Shift>,
}

/// A hypothesis that was tried and not named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Considered {
    /// Its name.
    pub effect: String,
    /// Where it would sit.
    pub site: Site,
    /// Share of the whitened residual that it removes alone.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub explained_fraction: f64,
    /// Adjusted (Holm).
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub p_value: f64,
    /// Why it was not named.
    pub why_not: String,
}

/// Something significant and immaterial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Minor {
    /// Its name.
    pub effect: String,
    /// Where it sits.
    pub site: Site,
    /// What it removes of the effort's rms, or of the prediction's error as a share of the output's, whichever is more.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub removed: f64,
    /// Why it is not named.
    pub why: String,
}

/// Causes that this recording cannot tell apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Confusable {
    /// Their names.
    pub effects: Vec<String>,
    /// The experiment that would.
    pub next_experiment: String,
    /// How well experiments would tell the first two apart, simulated; the best first. Empty unless it was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub predicted: Vec<Prospect>,
}

/// An experiment that was simulated with either of two causes as the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Prospect {
    /// What would be done.
    pub experiment: String,
    /// Penalised log-likelihood by which the true cause leads the other, in the worse of the two cases.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub separation: f64,
    /// Whether that decides between them.
    pub decides: bool,
}

/// An entry of a matrix, or the gain of a reflex, over a schedule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Curve {
    /// `K_x_y`: matrix, row axis, column axis; `K` for one axis. `gain_x`, or `gain`: the velocity gain of a reflex.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// What it follows, in words.
    pub over: String,
    /// The unit of that; empty for a phase, which goes from 0 to 1.
    pub over_unit: String,
    /// Where the curve is given.
    pub at: Vec<f64>,
    /// Its value at each place.
    pub value: Vec<f64>,
    /// Lower and upper end of the 95 % interval at each place by itself.
    pub ci95: [Vec<f64>; 2],
}
