//! A robot seen at its endpoint.

use super::rigid_body::{EndpointKinematics, Robot};
use ndof_linear::square::{add_transposed, invert_into, multiply};

/// The force on the endpoint that a motion needs,
///
/// F = J⁻ᵀ (H q̈ + h − c h₀ + τ_f),
///
/// with q from the inverse kinematics, q̇ = J⁻¹ ḋ, q̈ = J⁻¹ (d̈ − J̇ q̇), and c h₀ the share of its own weight that the controller carries.
pub struct EndpointForce {
    robot: Box<dyn Robot>,
    place: EndpointKinematics,
    rates: Vec<f64>,
    accelerations: Vec<f64>,
    torque: Vec<f64>,
    carried: Vec<f64>,
    work: Vec<f64>,
    inverse: Vec<f64>,
}

impl EndpointForce {
    /// The view of a robot with as many joints as axes; `None` with others, whose joints do not follow from the endpoint.
    pub fn new(robot: Box<dyn Robot>) -> Option<Self> {
        let n = robot.joints().count();
        (robot.axes().len() == n).then(|| EndpointForce {
            robot,
            place: EndpointKinematics::new(n, n),
            rates: vec![0.0; n],
            accelerations: vec![0.0; n],
            torque: vec![0.0; n],
            carried: vec![0.0; n],
            work: vec![0.0; n * n],
            inverse: vec![0.0; n * n],
        })
    }

    /// Writes the force on each axis that the endpoint's motion needs (N, N m); false where the robot cannot be there.
    pub fn needed(&mut self, position: &[f64], velocity: &[f64], acceleration: &[f64], force: &mut [f64]) -> bool {
        let Ok(q) = self.robot.inverse_kinematics(position) else { return false };
        self.rates.fill(0.0);
        self.robot.kinematics(&q, &self.rates, &mut self.place);
        let share = self.robot.gravity_compensation();
        if share > 0.0 {
            self.robot.bias(&q, &self.rates, &mut self.carried);
        }
        self.work.copy_from_slice(&self.place.jacobian);
        if invert_into(&mut self.work, &mut self.inverse, q.len()).is_none() {
            return false;
        }
        multiply(&self.inverse, velocity, &mut self.rates);
        self.robot.kinematics(&q, &self.rates, &mut self.place);
        let unturned: Vec<f64> = acceleration.iter().zip(&self.place.jacobian_rate).map(|(a, turning)| a - turning).collect();
        multiply(&self.inverse, &unturned, &mut self.accelerations);
        self.robot.inverse_dynamics(&q, &self.rates, &self.accelerations, &mut self.torque);
        let joints = self.robot.joints();
        for (j, torque) in self.torque.iter_mut().enumerate() {
            *torque += joints.friction(j, self.rates[j]) - share * self.carried[j];
        }
        force.fill(0.0);
        add_transposed(&self.inverse, &self.torque, 1.0, force);
        true
    }
}
