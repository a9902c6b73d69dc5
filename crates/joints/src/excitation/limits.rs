//! What a motion of joints must keep.

use super::ExcitationError;
use ndof_devices::{JointConfig, JointKind, RobotConfig};
use std::f64::consts::PI;

/// Limits of the joints, one entry a joint; infinite where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLimits {
    /// Least and greatest angle (rad, m).
    pub range: Vec<[f64; 2]>,
    /// Largest rate (rad/s, m/s).
    pub rate: Vec<f64>,
    /// Largest acceleration (rad/s², m/s²).
    pub acceleration: Vec<f64>,
    /// Largest torque (N m, N).
    pub torque: Vec<f64>,
}

impl JointLimits {
    /// The limits of a robot's file, and the joints without a range, for which ±π is assumed.
    ///
    /// `rate` and `acceleration` are limits of one's own, one for all joints or one a joint, or none: of a rate, the lower of it and the
    /// file's holds.
    ///
    /// # Errors
    /// [`ExcitationError::Joint`] for a range of zero, a sliding joint without a range, or a joint without a rate limit;
    /// [`ExcitationError::Count`] and [`ExcitationError::Value`] for lists of another length or values that limit nothing.
    pub fn of(robot: &RobotConfig, rate: Option<&[f64]>, acceleration: Option<&[f64]>) -> Result<(Self, Vec<String>), ExcitationError> {
        let joints = &robot.joints;
        let of_file: Vec<f64> = joints.iter().map(|joint| joint.rate_limit_rad_per_s.unwrap_or(f64::INFINITY)).collect();
        let own = each("speed_limit", rate, joints.len())?;
        let rate: Vec<f64> = own.iter().zip(of_file).map(|(own, of_file)| own.min(of_file)).collect();
        if let Some((joint, _)) = joints.iter().zip(&rate).find(|(_, rate)| !rate.is_finite()) {
            return Err(refused(joint, "has no speed limit in the file; give one with `speed_limit`"));
        }
        let assumed = joints.iter().filter(|joint| joint.range_rad.is_none()).map(|joint| joint.name.clone()).collect();
        let limits = JointLimits {
            range: joints.iter().map(range).collect::<Result<_, _>>()?,
            rate,
            acceleration: each("acceleration_limit", acceleration, joints.len())?,
            torque: joints.iter().map(|joint| joint.torque_limit_nm.unwrap_or(f64::INFINITY)).collect(),
        };
        Ok((limits, assumed))
    }

    /// What is left when `margin` of each limit stays free, half of a range's at each end.
    pub(super) fn within(&self, margin: f64) -> Self {
        let share = 1.0 - margin;
        let times = |list: &[f64]| list.iter().map(|v| share * v).collect();
        let shrunk = |&[low, high]: &[f64; 2]| [low + 0.5 * margin * (high - low), high - 0.5 * margin * (high - low)];
        JointLimits {
            range: self.range.iter().map(shrunk).collect(),
            rate: times(&self.rate),
            acceleration: times(&self.acceleration),
            torque: times(&self.torque),
        }
    }
}

fn refused(joint: &JointConfig, what: impl Into<String>) -> ExcitationError {
    ExcitationError::Joint { joint: joint.name.clone(), what: what.into() }
}

fn range(joint: &JointConfig) -> Result<[f64; 2], ExcitationError> {
    match (joint.range_rad, joint.kind) {
        (Some([low, high]), _) if high > low => Ok([low, high]),
        (Some([low, high]), _) => {
            Err(refused(joint, format!("cannot move: its range in the file is {low} to {high}; correct the range, or make the joint fixed")))
        }
        (None, JointKind::Revolute) => Ok([-PI, PI]),
        (None, JointKind::Prismatic) => Err(refused(joint, "slides and has no range in the file; give it one there")),
    }
}

/// One value a joint from none, one for all, or one a joint.
fn each(what: &'static str, values: Option<&[f64]>, joints: usize) -> Result<Vec<f64>, ExcitationError> {
    let Some(values) = values else { return Ok(vec![f64::INFINITY; joints]) };
    if let Some(value) = values.iter().find(|v| v.is_nan() || **v <= 0.0) {
        return Err(ExcitationError::Value { what, value: *value, must: "above zero" });
    }
    match values.len() {
        1 => Ok(vec![values[0]; joints]),
        n if n == joints => Ok(values.to_vec()),
        found => Err(ExcitationError::Count { what, found, joints }),
    }
}
