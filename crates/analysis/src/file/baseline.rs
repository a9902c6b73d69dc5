//! The simulation that a diagnosis judges, in its simplest form.

use crate::error::AnalysisError;
use crate::fit::MODEL;
use ndof_devices::{Controller, DeviceConfig, LimbConfig, Posture, device};
pub use ndof_models::Status;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A model with values, each fixed, nominal or free.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BaselineFile {
    /// The model's name, `inertia-damping-stiffness`.
    pub model: Option<String>,
    /// A device, as in an experiment: the robot's side is judged by it. Its lengths, inertias and frictions are nominal, its settings fixed.
    pub device: Option<DeviceConfig>,
    /// The limb, as in an experiment; its matrices about the posture are nominal. Without it the limb is fitted.
    pub limb: Option<LimbConfig>,
    /// The posture, as in an experiment.
    pub posture: Posture,
    /// The hold, as in an experiment.
    pub controller: Controller,
    /// By the name of the matrix or scalar, or of the device's parameter.
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

impl BaselineFile {
    /// Checks what the types do not.
    ///
    /// # Errors
    /// [`AnalysisError::Meaning`] in the name of `file`.
    pub fn check(&self, file: &str) -> Result<(), AnalysisError> {
        const KNOWN: [&str; 3] = ["M", "B", "K"];
        let wrong = |what: String| Err(AnalysisError::Meaning { file: file.to_owned(), what });
        if let Some(model) = self.model.as_deref().filter(|model| *model != MODEL) {
            return wrong(format!("model = \"{model}\"; there is \"{MODEL}\""));
        }
        if self.limb.is_some() && self.device.is_none() {
            return wrong("[limb] needs a [device] that holds it; give both, or [parameters] alone".to_owned());
        }
        let table = match &self.device {
            Some(config) if !config.name.is_empty() => device(&config.name)?.parameters,
            _ => &[],
        };
        if let Some(name) = self.parameters.keys().find(|name| !KNOWN.contains(&name.as_str()) && table.iter().all(|p| p.name != name.as_str())) {
            let device = if table.is_empty() { "" } else { ", and the device what `ndof list devices` prints" };
            return wrong(format!("[parameters.{name}]; the model has M, B and K{device}"));
        }
        for (name, parameter) in &self.parameters {
            let rows = parameter.value.rows();
            if !KNOWN.contains(&name.as_str()) && !matches!(parameter.value, Value::Scalar(_)) {
                return wrong(format!("parameters.{name}.value is a matrix; a device's parameter is one number"));
            }
            if rows.iter().any(|row| row.len() != rows.len()) || rows.iter().flatten().any(|v| !v.is_finite()) {
                return wrong(format!("parameters.{name}.value is not a square matrix of numbers; write one row for each output"));
            }
        }
        Ok(())
    }
}

impl Value {
    /// The entries, row by row.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        match self {
            Value::Scalar(value) => vec![vec![*value]],
            Value::Matrix(rows) => rows.clone(),
        }
    }
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

fn yes() -> bool {
    true
}
