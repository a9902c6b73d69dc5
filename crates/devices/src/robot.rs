//! What every simulated robot can say about itself.

use crate::error::DeviceError;
use crate::matrix::{cholesky, cholesky_solve};
use crate::sensors::quantise;

/// One coordinate of the end effector that is commanded, held and measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis {
    /// Its name, the suffix of the channels: `x` makes `pos_x` and `force_x`.
    pub name: String,
    /// Whether it is an angle (rad, N m) and not a length (m, N).
    pub rotational: bool,
}

/// Where the end effector is and how joint motion moves it; a workspace that [`Robot::kinematics`] fills.
#[derive(Clone, Debug)]
pub struct Kinematics {
    /// Endpoint coordinates d, one an axis (m, rad).
    pub endpoint: Vec<f64>,
    /// J = ∂d/∂q, row-major, axes × joints.
    pub jacobian: Vec<f64>,
    /// J̇ q̇, the endpoint's acceleration at constant joint rates.
    pub jacobian_rate: Vec<f64>,
}

impl Kinematics {
    /// Room for `axes` endpoint coordinates and `joints` joints.
    pub fn new(axes: usize, joints: usize) -> Self {
        Kinematics { endpoint: vec![0.0; axes], jacobian: vec![0.0; axes * joints], jacobian_rate: vec![0.0; axes] }
    }
}

/// Friction and limits of the joints, one entry a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joints {
    /// Dry friction level (N m, N).
    pub coulomb: Vec<f64>,
    /// Viscous friction (N m s/rad, N s/m).
    pub viscous: Vec<f64>,
    /// Speed over which dry friction builds up: level · tanh(q̇/v).
    pub smoothing: Vec<f64>,
    /// Largest motor torque (N m, N); infinite where there is none.
    pub torque_limit: Vec<f64>,
    /// Range of a full encoder turn in the joint's coordinate (rad, m), which the encoder's bits divide.
    pub encoder_range: Vec<f64>,
    /// Steps of an encoder over that range.
    pub encoder_counts: f64,
}

impl Joints {
    /// `n` frictionless joints without limits and with encoders that divide a full turn.
    pub fn ideal(n: usize) -> Self {
        Joints {
            coulomb: vec![0.0; n],
            viscous: vec![0.0; n],
            smoothing: vec![0.005; n],
            torque_limit: vec![f64::INFINITY; n],
            encoder_range: vec![std::f64::consts::TAU; n],
            encoder_counts: 65_536.0,
        }
    }

    /// Refuses negative friction and limits that are no limits.
    ///
    /// # Errors
    /// [`DeviceError::Value`] naming the list.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        for (what, list) in [("dry friction", &self.coulomb), ("viscous friction", &self.viscous)] {
            if let Some(v) = list.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
                return Err(DeviceError::value(what, *v, "zero or positive"));
            }
        }
        for (what, list) in [("friction velocity", &self.smoothing), ("torque limit", &self.torque_limit), ("encoder range", &self.encoder_range)] {
            if let Some(v) = list.iter().find(|v| v.is_nan() || **v <= 0.0) {
                return Err(DeviceError::value(what, *v, "positive"));
            }
        }
        Ok(())
    }

    /// Friction torque of joint `j` at speed `rate`: τ_c tanh(q̇/v_s) + b q̇.
    pub fn friction(&self, j: usize, rate: f64) -> f64 {
        self.dry_friction(j, rate) + self.viscous[j] * rate
    }

    pub(crate) fn dry_friction(&self, j: usize, rate: f64) -> f64 {
        // tanh |r| by one exponential: as exact as the level asks for, and three times as fast as the library's.
        let decay = (-2.0 * (rate / self.smoothing[j]).abs()).exp();
        (self.coulomb[j] * (1.0 - decay) / (1.0 + decay)).copysign(rate)
    }
}

/// A rigid-body robot: a constant model whose methods compute from joint coordinates.
///
/// H(q) q̈ + h(q, q̇) + τ_f(q̇) = τ − Jᵀ F, with F the force that the robot applies to the limb.
pub trait Robot: Send + Sync {
    /// The commanded and measured coordinates of the end effector.
    fn axes(&self) -> &[Axis];

    /// Friction, limits and encoders; its length is the number of joints.
    fn joints(&self) -> &Joints;

    /// Fills endpoint, Jacobian and J̇ q̇ at joint coordinates `q` and rates `rates`.
    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut Kinematics);

    /// Writes H(q), row-major, joints × joints (kg m², kg).
    fn mass_matrix(&self, q: &[f64], out: &mut [f64]);

    /// Writes h(q, q̇): Coriolis, centrifugal and uncompensated gravity torques.
    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]);

    /// The joint coordinates that put the endpoint at `target`.
    ///
    /// # Errors
    /// [`DeviceError::Reach`] if there are none, [`DeviceError::Missing`] if the robot has no closed form.
    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, DeviceError>;

    /// Writes the joint coordinates that the encoders show; `counts` divide a turn (infinite for ideal encoders).
    fn encode(&self, q: &[f64], counts: f64, out: &mut [f64]) {
        for ((out, q), range) in out.iter_mut().zip(q).zip(&self.joints().encoder_range) {
            *out = quantise(*q, range / counts);
        }
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

    /// The joint coordinates of the posture where an experiment gives none.
    ///
    /// # Errors
    /// [`DeviceError::Reach`] if the robot cannot be there.
    fn home(&self) -> Result<Vec<f64>, DeviceError>;

    /// Writes q̈ = H⁻¹ (torque − h) to `out`; `kinematics` is that of the same `q` and `rates`, `work` has room for joints².
    fn acceleration(&self, q: &[f64], rates: &[f64], kinematics: &Kinematics, torque: &[f64], work: &mut [f64], out: &mut [f64]) {
        let _ = kinematics;
        let n = torque.len();
        self.bias(q, rates, out);
        out.iter_mut().zip(torque).for_each(|(o, t)| *o = t - *o);
        self.mass_matrix(q, work);
        if cholesky(work, n) {
            cholesky_solve(work, n, out);
        } else {
            out.fill(f64::NAN);
        }
    }
}
