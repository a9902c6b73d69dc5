//! The force transducer: a stiff coupling between robot and limb, F = k (d − x) + b (ḋ − ẋ) with the robot at d and the limb at x, the same on
//! every axis.

use crate::error::DeviceError;
use ndof_models::Transducer;

/// Smallest stiffness allowed on translational axes: softer ones would show in the identified inertia (+0.3 % at 10 Hz
/// for 1e6 N/m and 2 kg).
const LEAST_STIFFNESS_N_PER_M: f64 = 1e6;

/// A transducer for translations; refuses one that is softer than 1e6 N/m or undamped.
pub(crate) fn translational(stiffness: f64, damping: f64) -> Result<Transducer, DeviceError> {
    if !(stiffness.is_finite() && stiffness >= LEAST_STIFFNESS_N_PER_M) {
        return Err(DeviceError::value("transducer_stiffness_n_per_m", stiffness, "at least 1e6 N/m"));
    }
    DeviceError::positive("transducer_damping_n_s_per_m", damping)?;
    Ok(Transducer { stiffness, damping })
}
