//! Limits that end a trial.

use crate::controller::Safety;
use crate::error::DeviceError;

/// What is looked at on each tick.
pub(crate) struct Watch<'a> {
    pub(crate) limits: Safety,
    pub(crate) range: &'a [[f64; 2]],
    pub(crate) trial: usize,
}

fn length(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

impl Watch<'_> {
    /// Refuses the instant `time_s` if a limit is passed; `moved` is the endpoint's distance from the posture, axis by axis.
    pub(crate) fn check(&self, time_s: f64, force: &[f64], speed: &[f64], moved: &[f64], joints: &[f64]) -> Result<(), DeviceError> {
        let trial = self.trial;
        for (what, value, limit) in [
            ("the force on the limb", length(force), self.limits.force),
            ("the speed of the endpoint", length(speed), self.limits.speed),
            ("the distance from the posture", length(moved), self.limits.distance),
        ] {
            if let Some(limit) = limit.filter(|limit| value > *limit) {
                return Err(DeviceError::Stopped { trial, time_s, what: what.to_owned(), value, limit });
            }
        }
        for (k, (&[lower, upper], &value)) in self.range.iter().zip(joints).enumerate() {
            if value < lower || value > upper {
                return Err(DeviceError::Range { trial, time_s, joint: k + 1, value, lower, upper });
            }
        }
        Ok(())
    }
}
