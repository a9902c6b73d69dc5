//! `ndof/excitation/1`: a motion of a robot's joints to be commanded, and what it will tell.

use super::settings::RobotMotion;
use ndof_analysis::result::{Head, Number, number};
use ndof_joints::PredictedParameter;
use serde::{Deserialize, Serialize};

/// What was designed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ExcitationResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// What was asked for.
    pub settings: RobotMotion,
    /// The robot.
    pub robot: String,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// Length of the motion (s).
    pub duration_s: f64,
    /// Length of a period (s).
    pub period_s: f64,
    /// Condition number of the regressor of base parameters and friction, rows divided by the torque noise, columns of length one.
    pub condition: f64,
    /// The mean of that of random motions within the same limits.
    pub condition_random_mean: Number,
    /// The smallest of them.
    pub condition_random_best: Number,
    /// Joint by joint.
    pub joints: Vec<ExcitedJoint>,
    /// Base parameters of the bodies, then viscous and dry friction of each joint.
    pub parameters: Vec<ExcitedParameter>,
}

impl ExcitationResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/excitation/1";
}

/// Limits of a joint and what is used of them: rad, rad/s, rad/s² and N m, of sliding joints m, m/s, m/s² and N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ExcitedJoint {
    /// The joint.
    pub name: String,
    /// Unit of its angle.
    pub unit: String,
    /// Where the motion begins and ends.
    pub start: f64,
    /// Its range.
    pub range: [f64; 2],
    /// Least and greatest angle.
    pub range_used: [f64; 2],
    /// Largest speed allowed.
    pub speed_limit: f64,
    /// Largest speed.
    pub speed: f64,
    /// Largest acceleration allowed; null where none is.
    pub acceleration_limit: Number,
    /// Largest acceleration.
    pub acceleration: f64,
    /// Largest torque allowed; null where none is.
    pub torque_limit: Number,
    /// Largest torque of the nominal model, friction included.
    pub torque: f64,
    /// Root mean square torque noise for which errors are predicted.
    pub torque_noise: f64,
}

/// A parameter and how well the motion determines it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ExcitedParameter {
    /// A combination of inertial parameters in words, or `viscous_…` and `coulomb_…` of a joint.
    pub name: String,
    /// Its value in the nominal model (SI).
    pub value: f64,
    /// Its standard error, if torque noise is white from sample to sample.
    pub standard_error: f64,
    /// The same as a share of the value; null for a value of zero.
    pub relative_standard_error: Number,
    /// Whether it is one of those of interest.
    pub of_interest: bool,
}

impl ExcitedParameter {
    /// From this many samples.
    pub(super) fn of(predicted: &PredictedParameter, samples: f64) -> Self {
        let standard_error = predicted.error_of_one_sample / samples.sqrt();
        ExcitedParameter {
            name: predicted.name.clone(),
            value: predicted.value,
            standard_error,
            relative_standard_error: number(standard_error / predicted.value.abs()),
            of_interest: predicted.of_interest,
        }
    }
}
