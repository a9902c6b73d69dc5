//! Why a device cannot be built or an experiment not be run.

use ndof_models::robot::RobotError;

/// What is wrong with a device, a limb or an experiment, where, and what to do. Trials count from 0, and are read from 1; time is that since the recording's
/// first sample.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum DeviceError {
    /// No device of that name.
    #[error("no device \"{name}\"; there are: {available}; or give `file = \"robot.toml\"`")]
    UnknownDevice { name: String, available: String },
    /// A parameter that the device does not have.
    #[error("device \"{device}\" has no parameter \"{name}\"; it has: {available}")]
    UnknownParameter { device: String, name: String, available: String },
    /// A number outside of what physics or the simulation allows.
    #[error("{what} is {value}; it must be {must}")]
    Value { what: String, value: f64, must: &'static str },
    /// A list or matrix of the wrong size.
    #[error("{what} has {found}, expected {expected}")]
    Size { what: String, found: String, expected: String },
    /// An inertia that is not symmetric and positive definite.
    #[error("{0} is not symmetric positive definite; an inertia has to be")]
    Inertia(String),
    /// What a robot says of itself: a posture out of its reach, a number with which it cannot be.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Something the experiment leaves open and the device needs.
    #[error("{0}")]
    Missing(String),
    /// The commanded excitation does not fit the experiment.
    #[error("the commanded excitation has {found_axes} axes of {found_samples} samples, the experiment needs {axes} of {samples} (discard included)")]
    Excitation { found_axes: usize, found_samples: usize, axes: usize, samples: usize },
    /// The motion is no number any more.
    #[error(
        "trial {} diverged at {time_s:.3} s; the limb or a hidden effect is unstable under this excitation: lower its amplitude or the effect's size", .trial + 1
    )]
    Diverged { trial: usize, time_s: f64 },
    /// A safety limit was passed.
    #[error(
        "trial {} was stopped at {time_s:.3} s: {what} was {value:.4}, the limit is {limit}; lower the perturbation, hold more firmly, or move the limit under [controller.safety]", .trial + 1
    )]
    Stopped { trial: usize, time_s: f64, what: String, value: f64, limit: f64 },
    /// A joint came to the end of its range.
    #[error(
        "trial {} was stopped at {time_s:.3} s: joint {joint} was at {value:.4}, its range is {lower} to {upper}; lower the perturbation or choose another posture", .trial + 1
    )]
    Range {
        trial: usize,
        time_s: f64,
        /// The joint, from 1.
        joint: usize,
        /// Where it was (rad, m).
        value: f64,
        lower: f64,
        upper: f64,
    },
    /// The samples do not make a recording.
    #[error(transparent)]
    Recording(#[from] ndof_signal::RecordingError),
    /// A file of a robot that cannot be read.
    #[error("{file}: {what}")]
    File { file: String, what: String },
    /// A channel named by an effect that the device does not have.
    #[error("no channel \"{name}\"; the device has: {available}")]
    NoChannel { name: String, available: String },
}

impl DeviceError {
    pub(crate) fn value(what: impl Into<String>, value: f64, must: &'static str) -> Self {
        DeviceError::Value { what: what.into(), value, must }
    }

    pub(crate) fn positive(what: impl Into<String>, value: f64) -> Result<(), Self> {
        if value.is_finite() && value > 0.0 { Ok(()) } else { Err(DeviceError::value(what, value, "positive")) }
    }

    pub(crate) fn not_negative(what: impl Into<String>, value: f64) -> Result<(), Self> {
        if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(DeviceError::value(what, value, "zero or positive")) }
    }

    pub(crate) fn size(what: impl Into<String>, found: impl ToString, expected: impl ToString) -> Self {
        DeviceError::Size { what: what.into(), found: found.to_string(), expected: expected.to_string() }
    }
}
