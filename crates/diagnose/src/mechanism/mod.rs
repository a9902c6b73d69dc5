//! The robot's side as a plant of its own: commanded force less measured force → motion, by a simulation with parameters.
//!
//! F_needed(d, ḋ, d̈; θ) + hold(d) = F_command − F_measured, on every axis. The left side is the simulation's; what it lacks is a force on
//! the endpoint, and every parameter that may be wrong is tried as the one that makes it.

mod balance;
mod run;
mod search;
mod write;

pub use write::RobotSide;

use crate::DiagnoseError;
use crate::baseline::Status;
use crate::options::Options;
use crate::samples::{Meaning, Samples};
use crate::split::divide;
use crate::subject::find_band;
use ndof_signal::Recording;
use ndof_sysid::Ports;
use num_complex::Complex64;

/// A number of the simulated robot.
#[derive(Clone, Debug, PartialEq)]
pub struct MechanismParameter {
    /// Its name, unit last: `link_1_m`.
    pub name: String,
    /// Its SI unit.
    pub unit: String,
    /// What the simulation takes it to be.
    pub value: f64,
    /// Whether it may be wrong.
    pub status: Status,
    /// Whether it is a length or an angle of the kinematics.
    pub geometry: bool,
}

/// A simulated robot whose parameters may be wrong.
pub trait Mechanism: Sync {
    /// What it takes from its file, in a fixed order.
    fn parameters(&self) -> &[MechanismParameter];

    /// The robot with these values, in the order of [`Mechanism::parameters`]; `None` where there is no such robot.
    fn with(&self, values: &[f64]) -> Option<Box<dyn Endpoint + '_>>;

    /// The force per displacement with which the controller holds an axis, at s = j 2 π f (N/m, N m/rad).
    fn hold(&self, axis: usize, s: Complex64) -> Complex64;
}

/// A robot with its numbers, seen at its endpoint.
pub trait Endpoint {
    /// Writes the force on each axis that the motion needs, J⁻ᵀ (H q̈ + h + τ_f) (N, N m); false where the robot cannot be there.
    fn needed(&mut self, position: &[f64], velocity: &[f64], acceleration: &[f64], force: &mut [f64]) -> bool;
}

/// Says which parameters of a simulated robot are wrong, from commanded force, measured force and motion.
///
/// `references` of the ports are the commanded forces, `inputs` the measured ones, `outputs` the endpoint's displacement.
///
/// # Errors
/// [`DiagnoseError::NoRobotSide`] where one of the three is missing, and what [`diagnose`](crate::diagnose) refuses.
pub fn diagnose_robot(trials: &[Recording], ports: &Ports, options: &Options, mechanism: &dyn Mechanism) -> Result<RobotSide, DiagnoseError> {
    let first = trials.first().ok_or(DiagnoseError::NoTrial)?;
    ports.validate(first.channels().len())?;
    let meaning = Meaning::new(first, ports)?;
    if meaning.motion_imposed || meaning.order != 0 || !meaning.reference_is_effort || ports.references.len() != ports.inputs.len() {
        return Err(DiagnoseError::NoRobotSide);
    }
    let samples = Samples::new(trials, ports, &meaning)?;
    let (estimation, held, _) = divide(&samples, &options.held_out)?;
    let band_hz = options.band_hz.unwrap_or_else(|| find_band(&samples, &meaning));
    let balance = balance::Balance::new(&estimation, band_hz, mechanism);
    let found = search::search(&balance).ok_or(DiagnoseError::RobotFailed)?;
    let judged = run::Held::new(&held, band_hz, mechanism);
    Ok(write::write(&balance, &found, &judged, &meaning, options))
}
