//! Why there is no free-run fit.

use crate::MinimiseError;
use ndof_signal::FilterError;

/// Why a free-run fit is not possible.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum FreeRunError {
    /// Channels or lengths do not agree.
    #[error("trial {trial}: {force} force and {motion} motion channels for {axes} axes, or channels of unequal length; give one of each for every axis")]
    Shape {
        /// Number of the trial, from 1.
        trial: usize,
        force: usize,
        motion: usize,
        axes: usize,
    },
    /// Nothing to fit.
    #[error("no trial, or none as long as two samples")]
    Empty,
    /// Start values do not fit.
    #[error("{found} start values, the mechanism has {expected} parameters")]
    StartLength { found: usize, expected: usize },
    /// A disturbance that cannot be told.
    #[error("a disturbance as a force needs a fit with given force that compares every sample; leave out the low-pass of the output and imposed motion")]
    Disturbance,
    /// A low-pass that cannot be.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// The minimiser refused.
    #[error(transparent)]
    Minimise(#[from] MinimiseError),
}
