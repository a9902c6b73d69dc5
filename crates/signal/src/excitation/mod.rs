//! Signals that one commands on a robot to find out what it holds.

mod chirp;
mod crest;
mod decorrelate;
mod filtered_noise;
mod input_coherence;
mod limits;
mod multisine;
mod prbs;
mod ramp;

pub use chirp::{Chirp, Sweep};
pub use decorrelate::{Decorrelated, Decorrelation};
pub use filtered_noise::{FilteredNoise, SeedCriterion, SeedSearch};
pub use input_coherence::{InputCoherence, input_coherence, input_coherence_at};
pub use limits::{ExpectedMotion, Limits, SignalSize, apply_response, expected_motion, power_share};
pub use multisine::{AxisPlan, Lines, Multisine, MultisineSet};
pub use prbs::Prbs;
pub use ramp::ramp;

use crate::{FilterError, WelchError};

/// Why an excitation cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum ExcitationError {
    /// A number that must be positive is not.
    #[error("{what} is {value}; it must be positive and finite")]
    NotPositive { what: &'static str, value: f64 },
    /// No seed was to be tried.
    #[error("no seed to try; ask for at least one candidate")]
    NoCandidates,
    /// The analysis band holds no bin.
    #[error("no frequency of the analysis lies within {low_hz} to {high_hz} Hz; widen the band or lengthen the segments")]
    EmptyBand { low_hz: f64, high_hz: f64 },
    /// A multisine has no line to carry an axis.
    #[error("lines {step_hz} Hz apart leave none for each of {axes} axes within {low_hz} to {high_hz} Hz; lengthen the period or widen the band")]
    NoLines { low_hz: f64, high_hz: f64, step_hz: f64, axes: usize },
    /// There is no shift register of that length here.
    #[error("binary sequence of order {0}; take 2 to 20 (3 to 1 048 575 bits)")]
    PrbsOrder(usize),
    /// A frequency that the sample rate cannot hold.
    #[error("{frequency_hz} Hz with {sample_rate_hz} Hz samples; stay below {} Hz", sample_rate_hz / 2.0)]
    AboveNyquist { frequency_hz: f64, sample_rate_hz: f64 },
    /// Signals differ in length.
    #[error("signal {axis} has {found} samples, the first has {expected}")]
    Length { axis: usize, expected: usize, found: usize },
    /// A response does not fit the signals.
    #[error("the response is {} × {}, expected {} × {} (outputs × inputs)", found.0, found.1, expected.0, expected.1)]
    Shape { expected: (usize, usize), found: (usize, usize) },
    /// The filter of the noise cannot be made.
    #[error("filtering the noise: {0}")]
    Filter(#[from] FilterError),
    /// The analysis with which signals are compared cannot be done.
    #[error("analysing the coherence between the axes: {0}")]
    Analysis(#[from] WelchError),
}

fn positive(what: &'static str, value: f64) -> Result<(), ExcitationError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(ExcitationError::NotPositive { what, value }) }
}
