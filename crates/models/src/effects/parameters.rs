//! Named values of an effect's parameters.

use super::card::{Card, ParameterCard, rotational_name};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A number, a word (a channel, a name), a yes or no, or a matrix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// Yes or no.
    Flag(bool),
    /// A number in SI units.
    Number(f64),
    /// A channel or a parameter's name.
    Text(String),
    /// Rows of a matrix.
    Matrix(Vec<Vec<f64>>),
}

/// Values by parameter name, in SI units; rotational names (`level_nm`) stand for their translational twins.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Parameters(pub BTreeMap<String, Value>);

/// Why an effect cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum EffectError {
    /// A parameter that has no default is missing.
    #[error("effect \"{effect}\" needs the parameter \"{parameter}\"")]
    Missing { effect: &'static str, parameter: &'static str },
    /// A parameter's value makes no sense.
    #[error("effect \"{effect}\": {parameter} = {value} lies outside of {lo} to {hi}")]
    OutOfBounds { effect: &'static str, parameter: &'static str, value: f64, lo: f64, hi: f64 },
    /// A name that the effect does not have.
    #[error("effect \"{effect}\" has no parameter \"{given}\"; it has: {}", known.join(", "))]
    Unknown { effect: &'static str, given: String, known: Vec<String> },
    /// The value is of the wrong kind.
    #[error("effect \"{effect}\": {parameter} must be {expected}")]
    Kind { effect: &'static str, parameter: &'static str, expected: &'static str },
    /// The effect needs to know something about the plant that the setting lacks.
    #[error("effect \"{effect}\" needs {what}")]
    Setting { effect: &'static str, what: &'static str },
}

impl Parameters {
    /// Values from pairs.
    pub fn new<'a>(pairs: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        Parameters(pairs.into_iter().map(|(name, value)| (name.to_owned(), Value::Number(value))).collect())
    }

    /// The value called `name`, or its rotational twin.
    pub fn find(&self, name: &str) -> Option<&Value> {
        self.0.get(name).or_else(|| self.0.get(&rotational_name(name)))
    }

    /// The number of a parameter, its default where it is not given.
    ///
    /// # Errors
    /// [`EffectError`] if it is missing without a default, no number, or out of bounds.
    pub fn number(&self, effect: &'static str, card: &ParameterCard) -> Result<f64, EffectError> {
        let value = match self.find(card.name) {
            Some(Value::Number(value)) => *value,
            Some(Value::Flag(flag)) => f64::from(u8::from(*flag)),
            Some(_) => return Err(EffectError::Kind { effect, parameter: card.name, expected: "a number" }),
            None => return card.default.ok_or(EffectError::Missing { effect, parameter: card.name }),
        };
        let (lo, hi) = card.bounds;
        if (lo..=hi).contains(&value) { Ok(value) } else { Err(EffectError::OutOfBounds { effect, parameter: card.name, value, lo, hi }) }
    }

    /// The text of a parameter, if it is given.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.find(name) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// The matrix of a parameter, if it is given.
    pub fn matrix(&self, name: &str) -> Option<&[Vec<f64>]> {
        match self.find(name) {
            Some(Value::Matrix(rows)) => Some(rows),
            _ => None,
        }
    }

    /// Refuses names that the effect does not have.
    pub(super) fn require_known(&self, card: &'static Card) -> Result<(), EffectError> {
        let known: Vec<String> = card.parameters.iter().map(|p| p.name.to_owned()).collect();
        match self.0.keys().find(|given| !known.iter().any(|k| *given == k || **given == rotational_name(k))) {
            Some(given) => Err(EffectError::Unknown { effect: card.name, given: given.clone(), known }),
            None => Ok(()),
        }
    }
}
