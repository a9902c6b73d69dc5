//! From a recording as it was taken to the stretches and forces that an analysis needs.

mod align;
mod calibrate;
mod handle;
mod lag;
mod tare;

pub use align::{Aligned, align};
pub use calibrate::calibrate;
pub use handle::without_handle;
pub use tare::{negate, tare};

use ndof_signal::RecordingError;

/// Why a recording cannot be prepared so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum PrepareError {
    /// A matrix that does not fit the channels.
    #[error("the matrix has {rows} rows, the shortest of {columns} columns; {outputs} channels from {inputs} need {outputs} rows of {inputs}")]
    MatrixShape { rows: usize, columns: usize, outputs: usize, inputs: usize },
    /// An entry of a matrix, or a mass, is not a number.
    #[error("{what} is {value}; it must be a finite number")]
    NotFinite { what: String, value: f64 },
    /// Units that do not go together.
    #[error("channel \"{channel}\" is in \"{found}\", \"{other}\" in \"{expected}\"; {remedy}")]
    Units { channel: String, found: String, other: String, expected: String, remedy: &'static str },
    /// Two recordings that do not seem to be of one trial.
    #[error("the shared channels correlate by {correlation:.3} at best, {needed} is needed; choose a channel that both files have of the same trial")]
    NoOverlap { correlation: f64, needed: f64 },
    /// Too short to differentiate.
    #[error("{len} samples are too few to differentiate twice; {needed} are needed")]
    TooShort { len: usize, needed: usize },
    /// The recording refuses.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
