//! What a simulated robot is to the diagnosis.

use crate::baseline::Status;
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
