//! What a fit returns.

use super::Width;
use crate::{MinimiseError, ParameterInfo, StopReason};
use ndarray::Array2;
use ndof_sysid::two_sided_t;
use serde::{Deserialize, Serialize};

/// A fitted parameter with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// `M_x_y` and the like.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// The axes or channel that it belongs to.
    pub site: String,
    /// The estimate.
    pub value: f64,
    /// Standard error, infinite where the data do not determine it.
    pub std_error: f64,
    /// 95 % confidence interval.
    pub ci95: [f64; 2],
    /// Whether the data determine it: the interval is narrower than the size at which the parameter would matter.
    pub identifiable: bool,
}

/// A fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Name of the model.
    pub model: String,
    /// The parameter vector, in the model's order.
    pub theta: Vec<f64>,
    /// The parameters with their uncertainty.
    pub parameters: Vec<Parameter>,
    /// Covariance of `theta`; rows of undetermined parameters are infinite on the diagonal and zero beside it.
    pub covariance: Array2<f64>,
    /// Where the width of the intervals comes from.
    pub width: Width,
    /// What the disagreement of the trials, or a misfit, multiplied that covariance with; 1 where there is neither.
    pub covariance_scale: f64,
    /// Half width of a 95 % interval in standard errors.
    pub interval_quantile: f64,
    /// Lowest and highest frequency that was used.
    pub band_hz: [f64; 2],
    /// Number of frequencies that were used.
    pub bins: usize,
    /// Sum of squared whitened residuals, each independent bin counted once, corrected for the estimated covariance.
    pub chi2: f64,
    /// Real data less parameters.
    pub degrees_of_freedom: f64,
    /// `chi2 / degrees_of_freedom`: 1 for a model that is right.
    pub chi2_reduced: f64,
    /// Condition number of the information matrix, each parameter scaled to its own column.
    pub condition: f64,
    /// Why the minimiser stopped.
    pub reason: StopReason,
    /// Accepted steps.
    pub iterations: u64,
}

/// Why a fit is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum FitError {
    /// The response does not have the model's shape.
    #[error("the response has {outputs} outputs and {inputs} inputs, the model {axes} axes; choose channels so that they agree")]
    Shape { outputs: usize, inputs: usize, axes: usize },
    /// A response that is no mechanical one.
    #[error("the response relates quantities that are not effort and motion; set the channels' units or prefixes")]
    NotMechanical,
    /// Nothing is left to fit.
    #[error(
        "{bins} usable frequencies between {low_hz:.4} and {high_hz:.4} Hz (0 Hz and gaps never count) are worth {independent:.1} independent ones, {needed} are needed; widen the band, use longer windows or record longer"
    )]
    TooFewBins {
        bins: usize,
        /// Those that say something of their own; windows and padding make neighbours alike.
        independent: f64,
        needed: usize,
        low_hz: f64,
        high_hz: f64,
    },
    /// No covariance to weight with.
    #[error("the response has no covariance to weight the fit with; estimate it from a recording, or fit with the paper's cost")]
    NoCovariance,
    /// Start values do not fit the model.
    #[error("{found} start values, the model has {expected} parameters")]
    StartLength { found: usize, expected: usize },
    /// The response cannot be turned into an impedance.
    #[error(transparent)]
    Response(#[from] ndof_sysid::ResponseError),
    /// The minimiser refused.
    #[error(transparent)]
    Minimise(#[from] MinimiseError),
}

impl Fit {
    /// The parameter of that name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// Adds `more` to the covariance, by row and column: errors that the data do not show. Standard errors and
    /// intervals follow; whether a parameter is identifiable stays what the data say.
    pub fn add_covariance(&mut self, more: impl Fn(usize, usize) -> f64) {
        self.covariance.indexed_iter_mut().for_each(|((r, c), entry)| *entry += more(r, c));
        for (k, p) in self.parameters.iter_mut().enumerate() {
            p.std_error = self.covariance[[k, k]].sqrt();
            let half = self.interval_quantile * p.std_error;
            p.ci95 = [p.value - half, p.value + half];
        }
    }

    /// The fit seen as one of its first `count` parameters alone, whatever the others are: their marginal covariance. χ² and its
    /// degrees of freedom stay those of the whole fit.
    pub fn marginal(&self, count: usize) -> Fit {
        let count = count.min(self.theta.len());
        Fit {
            theta: self.theta[..count].to_vec(),
            parameters: self.parameters[..count].to_vec(),
            covariance: Array2::from_shape_fn((count, count), |(r, c)| self.covariance[[r, c]]),
            ..self.clone()
        }
    }
}

impl Parameter {
    /// Values, standard errors and intervals of `quantile` standard errors to each side, from a covariance; `scales` are how
    /// large each would have to be to matter. The quantile is asked for by index.
    pub(crate) fn describe(
        infos: &[ParameterInfo],
        theta: &[f64],
        covariance: &Array2<f64>,
        quantile: impl Fn(usize) -> f64,
        scales: &[f64],
    ) -> Vec<Parameter> {
        infos
            .iter()
            .enumerate()
            .map(|(k, info)| {
                let (value, std_error) = (theta[k], covariance[[k, k]].sqrt());
                let half = quantile(k) * std_error;
                Parameter {
                    name: info.name.clone(),
                    unit: info.unit.clone(),
                    site: info.site.clone(),
                    value,
                    std_error,
                    ci95: [value - half, value + half],
                    identifiable: half <= scales[k],
                }
            })
            .collect()
    }
}

/// The 97.5 % quantile of Student's t; the normal one where there are no degrees of freedom to speak of.
pub(crate) fn t_quantile(degrees_of_freedom: f64) -> f64 {
    let quantile = two_sided_t(0.95, degrees_of_freedom);
    if quantile.is_nan() { 1.959_963_984_540_054 } else { quantile }
}
