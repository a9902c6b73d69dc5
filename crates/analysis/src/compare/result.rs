//! `ndof/compare/1`: fits beside each other.

use crate::result::{Head, Number};
use serde::{Deserialize, Serialize};

/// Several fits of one model beside each other: before and after, left and right, session by session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CompareResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// How many fits there are.
    pub fits: usize,
    /// Parameters that all of them have.
    pub parameters: Vec<ParameterComparison>,
    /// The same over the sessions of several subjects, where the fits are such; empty otherwise.
    pub reliability: Vec<Reliability>,
}

impl CompareResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/compare/1";
}

/// One parameter over repeated sessions of several subjects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Reliability {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Subjects whose every session has it.
    pub subjects: usize,
    /// Sessions of each.
    pub sessions: usize,
    /// Mean over all.
    pub mean: Number,
    /// Intraclass correlation ICC(2,1): two-way random effects, absolute agreement, one session.
    pub icc: Number,
    /// Its 95 % interval.
    pub icc_ci95: Option<[f64; 2]>,
    /// Standard error of measurement: between sessions of one subject.
    pub standard_error_of_measurement: Number,
    /// Smallest change of one subject that is more than the scatter between sessions, 1.96 √2 SEM.
    pub minimal_detectable_change: Number,
    /// From the first session to each later one, over all subjects.
    pub changes: Vec<Change>,
}

/// What changed from the first session to another, over all subjects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Change {
    /// Number of the later session.
    pub session: usize,
    /// Mean of the subjects' differences.
    pub mean: Number,
    /// Its standard error.
    pub std_error: Number,
    /// 95 % interval (Student's t).
    pub ci95: Option<[f64; 2]>,
    /// That chance alone makes such a change (paired t-test), adjusted (Holm) for all parameters and sessions.
    pub p_value: Number,
}

/// One parameter in every fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ParameterComparison {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Its value in each fit.
    pub values: Vec<Number>,
    /// Its 95 % interval in each fit.
    pub ci95: Vec<Option<[f64; 2]>>,
    /// Each later fit less the first.
    pub differences: Vec<Difference>,
    /// Standard error of measurement: the standard deviation between fits, of three or more.
    pub standard_error_of_measurement: Number,
    /// Smallest change between two fits that is more than their scatter, 1.96 √2 SEM.
    pub minimal_detectable_change: Number,
}

/// A fit less the first one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Difference {
    /// Value.
    pub value: Number,
    /// Standard error, the fits being independent.
    pub std_error: Number,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// That chance alone makes such a difference, adjusted (Holm) for all parameters and fits.
    pub p_value: Number,
}
