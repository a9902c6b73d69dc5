//! Why a robot cannot be as asked.

/// Why a robot cannot be as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A place that the robot does not reach.
    #[error("{who} cannot reach {target:?}: {why}; choose another posture")]
    Reach {
        /// Which mechanism.
        who: String,
        /// The point asked for.
        target: Vec<f64>,
        /// What stands against it.
        why: String,
    },
    /// A list of the wrong length.
    #[error("{what} has {found}, expected {expected}")]
    Length {
        /// The list.
        what: &'static str,
        /// What was found.
        found: usize,
        /// What fits the robot.
        expected: usize,
    },
    /// A number with which there is no such robot.
    #[error("{what} is {value}; it must be {must}")]
    Value {
        /// What it is.
        what: String,
        /// What was found.
        value: f64,
        /// What is asked of it.
        must: &'static str,
    },
    /// Bodies that no robot can be made of.
    #[error("{0}")]
    Body(String),
}
