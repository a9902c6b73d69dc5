//! The force transducer: a stiff coupling between robot and limb.

use crate::error::DeviceError;

/// Smallest stiffness allowed on translational axes: softer ones would show in the identified inertia (+0.3 % at 10 Hz
/// for 1e6 N/m and 2 kg).
const LEAST_STIFFNESS_N_PER_M: f64 = 1e6;

/// F = k (d − x) + b (ḋ − ẋ): the force that the robot at d applies to the limb at x, the same on every axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transducer {
    /// k (N/m, N m/rad).
    pub stiffness: f64,
    /// b (N s/m, N m s/rad).
    pub damping: f64,
}

impl Transducer {
    /// A transducer for translations.
    ///
    /// # Errors
    /// [`DeviceError::Value`] if it is softer than 1e6 N/m or undamped.
    pub fn new(stiffness: f64, damping: f64) -> Result<Self, DeviceError> {
        if !(stiffness.is_finite() && stiffness >= LEAST_STIFFNESS_N_PER_M) {
            return Err(DeviceError::value("transducer_stiffness_n_per_m", stiffness, "at least 1e6 N/m"));
        }
        if !(damping.is_finite() && damping > 0.0) {
            return Err(DeviceError::value("transducer_damping_n_s_per_m", damping, "positive"));
        }
        Ok(Transducer { stiffness, damping })
    }
}
