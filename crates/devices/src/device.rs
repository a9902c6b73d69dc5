//! What a device and a limb of the registry are.

use crate::error::DeviceError;
use crate::parameters::{DeviceParameter, DeviceParameters};
use ndof_models::Transducer;
use ndof_models::robot::Robot;

/// What an experiment takes from its device where it says nothing itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopDefaults {
    /// Stiffness of the hold (N/m, N m/rad).
    pub kp: f64,
    /// Damping of the hold (N s/m, N m s/rad).
    pub kd: f64,
    /// Largest commanded force (N, N m).
    pub force_limit: f64,
    /// Noise of the force channels (N rms, N m rms).
    pub force_noise_rms: f64,
    /// Resolution of the force channels (N, N m).
    pub force_quantum: f64,
    /// Largest force that the transducer shows on an axis (N, N m).
    pub force_range: f64,
    /// Largest stiffness of the hold that the robot is made for (N/m, N m/rad).
    pub stiffness_limit: f64,
}

/// A robot with its transducer and its habits.
pub struct Device {
    /// The rigid-body model.
    pub robot: Box<dyn Robot>,
    /// The force transducer.
    pub transducer: Transducer,
    /// Settings that an experiment may leave out.
    pub defaults: LoopDefaults,
}

/// One entry of [`DEVICES`](crate::DEVICES).
pub struct DeviceEntry {
    /// The name in an experiment.
    pub name: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Its parameters.
    pub parameters: &'static [DeviceParameter],
    /// Where its numbers come from.
    pub source: &'static str,
    /// Builds it.
    pub build: fn(&DeviceParameters) -> Result<Device, DeviceError>,
}

/// One entry of [`LIMBS`](crate::LIMBS).
pub struct LimbEntry {
    /// The name in an experiment.
    pub name: &'static str,
    /// What it is.
    pub description: &'static str,
    /// Its keys; the default is NaN where a key must be given or is a matrix.
    pub parameters: &'static [DeviceParameter],
    /// Where its numbers come from.
    pub source: &'static str,
}
