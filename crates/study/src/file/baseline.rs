//! The simulation that a diagnosis judges, in its simplest form.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A model with values, each fixed, nominal or free.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaselineFile {
    /// The model's name, `inertia-damping-stiffness`.
    pub model: String,
    /// By the name of the matrix or scalar.
    #[serde(default)]
    pub parameters: BTreeMap<String, BaselineParameter>,
}

/// One matrix or scalar of the baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaselineParameter {
    /// A number for one degree of freedom, else a matrix.
    pub value: Value,
    /// Whether the diagnosis may touch it.
    #[serde(default)]
    pub status: Status,
    /// Whether the matrix stays symmetric.
    #[serde(default = "yes")]
    pub symmetric: bool,
}

/// A number or a matrix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// One degree of freedom.
    Scalar(f64),
    /// Rows and columns in the order of the outputs.
    Matrix(Vec<Vec<f64>>),
}

/// What a diagnosis may do with a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Known and right.
    Fixed,
    /// Assumed; the diagnosis may say that it is wrong.
    Nominal,
    /// To be fitted.
    #[default]
    Free,
}

fn yes() -> bool {
    true
}
