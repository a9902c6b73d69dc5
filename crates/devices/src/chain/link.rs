//! One joint of a chain with its body.

use crate::vector3::{IDENTITY, Matrix, Vector};
use ndof_models::robot::RobotError;

/// Longest chain: workspaces live on the stack.
pub const MAX_JOINTS: usize = 16;

/// A joint and the body that it moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Link {
    /// Whether the joint slides along its axis in place of turning about it.
    pub(crate) slides: bool,
    /// Unit vector of the joint in its own frame.
    pub(crate) axis: Vector,
    /// Joint frame in the frame of the body before it.
    pub(crate) rotation: Matrix,
    /// Its origin there (m).
    pub(crate) origin: Vector,
    /// Mass of the body (kg).
    pub(crate) mass: f64,
    /// Its centre of mass in the joint frame (m).
    pub(crate) centre: Vector,
    /// Its inertia about the centre of mass, axes of the joint frame (kg m²).
    pub(crate) inertia: Matrix,
    /// Inertia of the motor's rotor as the joint feels it (kg m², kg).
    pub(crate) rotor: f64,
}

impl Default for Link {
    /// A massless body that turns about z where the body before it ends.
    fn default() -> Self {
        Link { slides: false, axis: [0.0, 0.0, 1.0], rotation: IDENTITY, origin: [0.0; 3], mass: 0.0, centre: [0.0; 3], inertia: [[0.0; 3]; 3], rotor: 0.0 }
    }
}

impl Link {
    /// Refuses what no body is made of; `name` is the joint's.
    pub(crate) fn check(&self, name: &str) -> Result<(), RobotError> {
        let named = |what: &str| format!("{what} of joint \"{name}\"");
        for (what, value) in [("mass_kg", self.mass), ("rotor_inertia_kg_m2", self.rotor)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(RobotError::Value { what: named(what), value, must: "zero or positive" });
            }
        }
        let [xx, yy, zz] = [0, 1, 2].map(|k| self.inertia[k][k]);
        // Principal moments are those of a body where none exceeds the other two's sum; necessary for the diagonal in any frame.
        let exceeds = |a: f64, b: f64, c: f64| a > (b + c) * (1.0 + 1e-9);
        if [xx, yy, zz].iter().any(|v| !(v.is_finite() && *v >= 0.0)) || exceeds(xx, yy, zz) || exceeds(yy, xx, zz) || exceeds(zz, xx, yy) {
            let what = named("inertia_kg_m2 (no diagonal moment may exceed the sum of the other two)");
            return Err(RobotError::Body(format!("{what} is not symmetric positive definite; an inertia has to be")));
        }
        Ok(())
    }
}
