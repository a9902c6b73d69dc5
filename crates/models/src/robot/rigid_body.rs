//! The trait of every robot.

use super::error::RobotError;
use super::joints::Joints;
use super::parameter::RobotParameter;
use crate::Axis;
use ndof_linear::{cholesky_in_place, cholesky_solve};

/// Where the end effector is and how joint motion moves it; a workspace that [`Robot::kinematics`] fills.
#[derive(Clone, Debug)]
pub struct EndpointKinematics {
    /// Endpoint coordinates d, one an axis (m, rad).
    pub endpoint: Vec<f64>,
    /// J = ∂d/∂q, row-major, axes × joints.
    pub jacobian: Vec<f64>,
    /// J̇ q̇, the endpoint's acceleration at constant joint rates.
    pub jacobian_rate: Vec<f64>,
}

impl EndpointKinematics {
    /// Room for `axes` endpoint coordinates and `joints` joints.
    pub fn new(axes: usize, joints: usize) -> Self {
        EndpointKinematics { endpoint: vec![0.0; axes], jacobian: vec![0.0; axes * joints], jacobian_rate: vec![0.0; axes] }
    }
}

/// A rigid-body robot: a constant model whose methods compute from joint coordinates and write into the caller's buffers.
pub trait Robot: Send + Sync {
    /// The commanded and measured coordinates of the end effector.
    fn axes(&self) -> &[Axis];

    /// Names, friction, limits and encoders of the joints.
    fn joints(&self) -> &Joints;

    /// Fills endpoint, Jacobian and J̇ q̇ at joint coordinates `q` and rates `rates`.
    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut EndpointKinematics);

    /// Writes H(q), row-major, joints × joints (kg m², kg).
    fn mass_matrix(&self, q: &[f64], out: &mut [f64]);

    /// Writes h(q, q̇): Coriolis, centrifugal and uncompensated gravity torques.
    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]);

    /// Where the endpoint is at joint coordinates `q` (m, rad).
    fn endpoint(&self, q: &[f64]) -> Vec<f64> {
        let mut place = EndpointKinematics::new(self.axes().len(), q.len());
        self.kinematics(q, &vec![0.0; q.len()], &mut place);
        place.endpoint
    }

    /// The joint coordinates that put the endpoint at `target`.
    ///
    /// # Errors
    /// [`RobotError::Reach`] if there are none.
    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, RobotError>;

    /// The joint coordinates of the posture where nothing says otherwise.
    ///
    /// # Errors
    /// [`RobotError::Reach`] if the robot cannot be there.
    fn home(&self) -> Result<Vec<f64>, RobotError>;

    /// What the robot is described by, in a fixed order.
    fn parameters(&self) -> Vec<RobotParameter>;

    /// The same robot with other values of its parameters, in the order of [`Robot::parameters`].
    ///
    /// # Errors
    /// [`RobotError`] if the list has another length or there is no such robot.
    fn with_parameters(&self, values: &[f64]) -> Result<Box<dyn Robot>, RobotError>;

    /// Writes H(q) q̈ + h(q, q̇), the torques without friction that a motion needs (N m, N).
    fn inverse_dynamics(&self, q: &[f64], rates: &[f64], accelerations: &[f64], out: &mut [f64]) {
        let n = q.len();
        let mut mass = vec![0.0; n * n];
        self.mass_matrix(q, &mut mass);
        self.bias(q, rates, out);
        for (torque, row) in out.iter_mut().zip(mass.chunks_exact(n)) {
            *torque += row.iter().zip(accelerations).map(|(h, a)| h * a).sum::<f64>();
        }
    }

    /// Writes q̈ = H⁻¹ (torque − h) to `out`; `kinematics` is that of the same `q` and `rates`, `work` has room for joints².
    fn acceleration(&self, q: &[f64], rates: &[f64], kinematics: &EndpointKinematics, torque: &[f64], work: &mut [f64], out: &mut [f64]) {
        let _ = kinematics;
        let n = torque.len();
        self.bias(q, rates, out);
        out.iter_mut().zip(torque).for_each(|(o, t)| *o = t - *o);
        self.mass_matrix(q, work);
        if cholesky_in_place(work, n) {
            cholesky_solve(work, n, out);
        } else {
            out.fill(f64::NAN);
        }
    }

    /// Writes the joint coordinates that the encoders show; `counts` divide a turn (infinite for ideal encoders).
    fn encode(&self, q: &[f64], counts: f64, out: &mut [f64]) {
        self.joints().encode(q, counts, out);
    }

    /// Cuts the torques off at what the motors can give.
    fn limit_torque(&self, torque: &mut [f64]) {
        for (torque, limit) in torque.iter_mut().zip(&self.joints().torque_limit) {
            *torque = torque.clamp(-limit, *limit);
        }
    }

    /// Lower and upper end of each joint's range; empty where there is none.
    fn range(&self) -> &[[f64; 2]] {
        &[]
    }

    /// Share of the robot's own gravity torque that the controller takes off; 0 where there is none.
    fn gravity_compensation(&self) -> f64 {
        1.0
    }
}
