//! What can go wrong between an experiment's file and its results.

use ndof_analysis::AnalysisError;

/// Why a job could not be done: what is wrong, where, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum StudyError {
    /// Files, recordings and what is made of them.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// An effect cannot be hidden.
    #[error("hiding an effect: {0}")]
    Effect(#[from] ndof_models::effects::EffectError),
    /// The simulation is not possible.
    #[error("simulating: {0}")]
    Device(#[from] ndof_devices::DeviceError),
    /// The excitation is not possible.
    #[error("designing the perturbation: {0}")]
    Excitation(#[from] ndof_signal::ExcitationError),
    /// No motion of the robot's joints can be made.
    #[error("designing the motion: {0}")]
    Joints(#[from] ndof_joints::ExcitationError),
    /// The predicted motion passes a limit.
    #[error("the {limb} limb's {what} on axis {axis} would reach {value:.4}, the limit is {limit:.4}; lower `rms` to {:.3} of what it is, or raise the limit", (1000.0 * limit / value).floor() / 1000.0)]
    Motion { limb: String, axis: String, what: &'static str, value: f64, limit: f64 },
}

/// What `file` says is understood and makes no sense: what is wrong and what to do.
pub(crate) fn meaning(file: &str, what: impl Into<String>) -> StudyError {
    AnalysisError::Meaning { file: file.to_owned(), what: what.into() }.into()
}
