//! A named cause, and what naming it gains.

#[cfg(feature = "schema")]
use super::AnyValue;
use super::{Curve, Score, or_nan, together, value_or_nan};
use crate::probability::Features;
use ndof_models::effects::Value;
use serde::{Deserialize, Serialize};

/// Where a cause sits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Site {
    /// `robot`, `limb`, `sensor`, `actuator` or `environment`.
    pub side: String,
    /// The axis, empty where the effect has none.
    pub axis: String,
}

/// A parameter of a cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CauseParameter {
    /// Its name.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// Its value.
    #[serde(deserialize_with = "value_or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<AnyValue>"))]
    pub value: Value,
    /// Its 95 % interval, for numbers that the data determine.
    pub ci95: Option<[f64; 2]>,
}

impl CauseParameter {
    /// Takes another interval of the same parameter into its own.
    pub(crate) fn widen(&mut self, other: &CauseParameter) {
        self.ci95 = self.ci95.zip(other.ci95).map(|([a, b], [c, d])| [a.min(c), b.max(d)]);
    }

    /// A number the other way round, with its interval.
    pub(crate) fn negate(&mut self) {
        if let Value::Number(value) = &mut self.value {
            *value = -*value;
            self.ci95 = self.ci95.map(|[low, high]| [-high, -low]);
        }
    }
}

/// What naming a cause gains on held-out data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Gain {
    /// Without it.
    pub nrmse_before: Vec<Option<f64>>,
    /// With it.
    pub nrmse_after: Vec<Option<f64>>,
    /// Without it, percent.
    pub vaf_before: Vec<Option<f64>>,
    /// With it, percent.
    pub vaf_after: Vec<Option<f64>>,
    /// Log-likelihood of the held-out part that it gains, beside the causes that gain more: of the balance of forces along the measured motion, so that
    /// the limb's own force is no error of it. Null where nothing is predicted, or the part has no likelihood.
    #[serde(default)]
    pub log_likelihood: Option<f64>,
    /// Its 95 % interval, from neighbouring frequencies of blocks of time drawn anew.
    #[serde(default)]
    pub log_likelihood_ci95: Option<[f64; 2]>,
    /// This gain as a share of all that the best model gains over the baseline, and what a model without physics gains beyond it. Null where there may
    /// be nothing to gain.
    pub explained_fraction: Option<f64>,
    /// Its 95 % interval; null where it is all that there is to explain in each draw.
    pub explained_fraction_ci95: Option<[f64; 2]>,
    /// BIC without the cause less BIC with it; positive speaks for the cause.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub delta_bic: f64,
}

impl Gain {
    /// Scores of free runs before and after, and nothing else that is known but the BIC.
    pub fn of_runs([before, after]: [&Score; 2], delta_bic: f64) -> Self {
        Gain {
            nrmse_before: before.nrmse.clone(),
            nrmse_after: after.nrmse.clone(),
            vaf_before: before.vaf_percent.clone(),
            vaf_after: after.vaf_percent.clone(),
            log_likelihood: None,
            log_likelihood_ci95: None,
            explained_fraction: None,
            explained_fraction_ci95: None,
            delta_bic,
        }
    }

    /// Whether the free run has a smaller error with the cause, over all outputs together.
    pub(crate) fn helps_free_run(&self) -> bool {
        together(&self.nrmse_after) < together(&self.nrmse_before)
    }
}

/// Probability of a name that is in doubt by itself, and not for its rivals: one that helps little on held-out data while a large error stays, say.
pub const UNSURE: f64 = 0.6;

impl Cause {
    /// Lets its probability be no more than this.
    ///
    /// ```
    /// # fn doubted(mut cause: ndof_diagnose::Cause) -> ndof_diagnose::Cause {
    /// cause.believe_at_most(ndof_diagnose::UNSURE);
    /// assert!(cause.probability <= 0.6);
    /// # cause
    /// # }
    /// ```
    pub fn believe_at_most(&mut self, most: f64) {
        self.at_most = self.at_most.min(most);
        self.probability = self.probability.min(most);
    }
}

/// A named cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Cause {
    /// Its name in the registry.
    pub effect: String,
    /// Where it sits.
    pub site: Site,
    /// Its parameters.
    pub parameters: Vec<CauseParameter>,
    /// Probability of this effect at this side.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub probability: f64,
    /// Of the likelihood ratio, adjusted (Holm) for everything that was tried in the step.
    #[serde(deserialize_with = "or_nan")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<f64>"))]
    pub p_value: f64,
    /// What naming it gains.
    pub gain: Gain,
    /// Sentences with their numbers.
    pub evidence: Vec<String>,
    /// What each entry of a matrix is over the schedule that it follows; of causes that follow one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub over_schedule: Vec<Curve>,
    /// What the probability was computed from, where a search found the cause.
    #[serde(skip)]
    pub features: Option<Features>,
    /// What the gate of the generic model, or little gain on held-out data, lets the probability be at most.
    #[serde(skip)]
    pub at_most: f64,
    /// Its place among the hypotheses that the search found.
    #[serde(skip)]
    pub lead: Option<usize>,
}
