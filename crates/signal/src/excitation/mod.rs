//! Signals that one commands on a robot to find out what it holds.

mod filtered_noise;
mod input_coherence;
mod ramp;

pub use filtered_noise::{FilteredNoise, SeedCriterion, SeedSearch};
pub use input_coherence::{InputCoherence, input_coherence};
pub use ramp::ramp;

use crate::{FilterError, WelchError};

/// Why an excitation cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// A number that must be positive is not.
    #[error("{what} is {value}; it must be positive and finite")]
    NotPositive {
        /// Its name.
        what: &'static str,
        /// The value given.
        value: f64,
    },
    /// No seed was to be tried.
    #[error("no seed to try; ask for at least one candidate")]
    NoCandidates,
    /// The analysis band holds no bin.
    #[error("no frequency of the analysis lies within {low_hz} to {high_hz} Hz; widen the band or lengthen the segments")]
    EmptyBand {
        /// Lower edge.
        low_hz: f64,
        /// Upper edge.
        high_hz: f64,
    },
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
