//! The robot's side as a plant of its own: commanded force less measured force → motion, by a simulation with parameters.
//!
//! F_needed(d, ḋ, d̈; θ) + hold(d) = F_command − F_measured, on every axis. The left side is the simulation's; what it lacks is a force on
//! the endpoint, and every parameter that may be wrong is tried as the one that makes it.

mod balance;
mod run;
mod search;
mod simulated;
mod write;

pub use simulated::{Endpoint, Mechanism, MechanismParameter};
pub use write::RobotSide;

use crate::DiagnoseError;
use crate::options::Options;
use crate::samples::{Meaning, Samples};
use crate::split::divide;
use crate::subject::find_band;
use ndof_signal::Recording;
use ndof_sysid::Ports;

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
