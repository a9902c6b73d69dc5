//! What a search has found of an effect.

use super::card::{ParameterCard, rotational_name};
use super::form::Scale;

/// A cause that a search has chosen: what its effect needs to say which others would make the same response.
pub struct Evidence<'a> {
    /// Fitted parameters, each under the start of its name.
    pub parameters: &'a [(&'a str, f64)],
    /// Coefficients of each of its forms that were chosen.
    pub coefficients: &'a [&'a [f64]],
    /// The axis that it acts on, if it acts on one.
    pub axis: Option<usize>,
    /// Sizes of things in the recording.
    pub scale: &'a Scale,
    /// Other effects that were found at the same site.
    pub beside: &'a [&'a str],
    /// Log-likelihood that the gain of its operator is worth: by how much the operator explains more than its phase alone.
    /// None where it has no operator. A refit is made for it.
    pub gain_worth: &'a dyn Fn() -> Option<f64>,
}

impl Evidence<'_> {
    /// A fitted parameter.
    pub fn number(&self, parameter: &ParameterCard) -> Option<f64> {
        self.parameters.iter().find(|(name, _)| *name == parameter.name || *name == rotational_name(parameter.name)).map(|(_, value)| *value)
    }

    /// Standard deviation of the displacement that it sees.
    pub fn position(&self) -> f64 {
        self.scale.position[self.axis.unwrap_or(0)]
    }
}
