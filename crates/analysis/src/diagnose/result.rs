//! `ndof/diagnosis/1`: what the simulation gets wrong, the cause by name, the extended model, the gain.

use super::settings::Diagnose;
use crate::result::Head;
use ndof_diagnose::Diagnosis;
use serde::{Deserialize, Serialize};

/// What a simulation gets wrong, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DiagnosisResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// What was asked for.
    #[serde(default)]
    pub settings: Diagnose,
    /// Inputs of the data.
    pub inputs: Vec<String>,
    /// Outputs of the data.
    pub outputs: Vec<String>,
    /// The diagnosis itself.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
}

impl DiagnosisResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/diagnosis/1";
}
