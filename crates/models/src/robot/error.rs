//! Why a robot cannot be as asked.

/// Why a robot cannot be as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum RobotError {
    /// A place that the robot does not reach.
    #[error("{who} cannot reach {target:?}: {why}; choose another posture")]
    Reach { who: String, target: Vec<f64>, why: String },
    /// A list of the wrong length.
    #[error("{what} has {found}, expected {expected}")]
    Length { what: &'static str, found: usize, expected: usize },
    /// A number with which there is no such robot.
    #[error("{what} is {value}; it must be {must}")]
    Value { what: String, value: f64, must: &'static str },
    /// Bodies that no robot can be made of.
    #[error("{0}")]
    Body(String),
}
