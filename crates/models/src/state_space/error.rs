//! Why there is no state-space model.

/// Why there is no subspace fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SubspaceError {
    /// Channels or lengths do not agree.
    #[error("trial {trial} does not have the first trial's channels, or channels of unequal length; give the same inputs and outputs in every trial")]
    Shape {
        /// Number of the trial, from 1.
        trial: usize,
    },
    /// Not enough samples for the predictor.
    #[error("{samples} samples for {unknowns} coefficients of the predictor; record longer or see less of the past")]
    TooShort {
        /// Usable samples.
        samples: usize,
        /// Coefficients an output.
        unknowns: usize,
    },
    /// The inputs do not move the plant in enough ways.
    #[error("the inputs and outputs of the past determine each other; perturb more strongly or over a wider band")]
    NotExcited,
}
