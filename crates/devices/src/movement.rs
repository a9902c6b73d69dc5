//! A movement to and fro, as the robot's reference makes it.

use crate::error::DeviceError;
use serde::{Deserialize, Serialize};

/// The reference goes from the posture to its far end and back within each cycle, each way with the least jerk.
///
/// d_des(t) = d₀ + d₁ (10 s³ − 15 s⁴ + 6 s⁵), s = 1 − |2 φ − 1| with φ the phase of the cycle (T. Flash & N. Hogan (1985), The coordination of arm
/// movements). Phase 0 is at the recording's first sample. A planar arm of two segments wants the same: its springs rest where the reference is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Movement {
    /// Duration of a cycle (s).
    pub cycle_s: f64,
    /// The far end, seen from the posture (m, rad), an axis.
    pub to: Vec<f64>,
}

impl Movement {
    /// Checks what the types do not.
    pub(crate) fn check(&self, axes: usize) -> Result<(), DeviceError> {
        DeviceError::positive("controller.movement.cycle_s", self.cycle_s)?;
        if self.to.len() != axes {
            return Err(DeviceError::size("controller.movement.to", self.to.len(), axes));
        }
        self.to.iter().find(|to| !to.is_finite()).map_or(Ok(()), |to| Err(DeviceError::value("controller.movement.to", *to, "finite")))
    }

    /// Phase of the cycle at a time since the recording's first sample, 0 to 1.
    pub fn phase(&self, time_s: f64) -> f64 {
        (time_s / self.cycle_s).rem_euclid(1.0)
    }

    /// Which share of the way the reference has gone.
    pub fn share(&self, phase: f64) -> f64 {
        let s = 1.0 - (2.0 * phase - 1.0).abs();
        s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    }
}
