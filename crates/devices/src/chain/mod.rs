//! Serial chains of rigid bodies: any robot without closed loops.

mod dynamics;
mod robot_file;
mod urdf;
mod xml;

pub use robot_file::{EndEffectorConfig, HoldConfig, JointConfig, JointKind, RobotConfig, TransducerConfig};
pub(crate) use robot_file::{FileChoices, read_robot};

use crate::error::DeviceError;
use crate::matrix::{cholesky, cholesky_solve};
use crate::robot::{Axis, Joints, Kinematics, Robot};
use crate::vector3::{Matrix, Vector};

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

/// Which coordinates are commanded and measured.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Space {
    /// Components 0, 1, 2 (x, y, z) of the end effector's place.
    Tip(Vec<usize>),
    /// The joints themselves.
    Joints,
}

/// A serial chain with its end effector.
#[derive(Clone, Debug, PartialEq)]
pub struct SerialChain {
    pub(crate) links: Vec<Link>,
    pub(crate) tip: Vector,
    pub(crate) gravity: Vector,
    pub(crate) space: Space,
    pub(crate) home: Vec<f64>,
    pub(crate) range: Vec<[f64; 2]>,
    axes: Vec<Axis>,
    joints: Joints,
}

impl SerialChain {
    pub(crate) fn new(
        links: Vec<Link>,
        tip: Vector,
        gravity: Vector,
        (space, axes): (Space, Vec<Axis>),
        (home, range): (Vec<f64>, Vec<[f64; 2]>),
        joints: Joints,
    ) -> Result<Self, DeviceError> {
        if links.is_empty() || links.len() > MAX_JOINTS {
            return Err(DeviceError::size("the robot", format!("{} moving joints", links.len()), format!("1 to {MAX_JOINTS}")));
        }
        if axes.is_empty() || axes.len() > links.len() {
            return Err(DeviceError::size("axes", axes.len(), format!("1 to {}, the number of joints", links.len())));
        }
        joints.check()?;
        let chain = SerialChain { links, tip, gravity, space, home, range, axes, joints };
        let n = chain.links.len();
        let mut mass = vec![0.0; n * n];
        chain.mass_matrix(&chain.home, &mut mass);
        if !cholesky(&mut mass, n) {
            return Err(DeviceError::Inertia("the robot's mass matrix at its home posture".to_owned()));
        }
        Ok(chain)
    }

    /// Newton's iteration for the tip, minimum-norm steps where there are more joints than axes.
    fn approach(&self, target: &[f64]) -> Result<Vec<f64>, DeviceError> {
        let (n, m) = (self.links.len(), self.axes.len());
        let (mut q, still, mut kinematics) = (self.home.clone(), vec![0.0; n], Kinematics::new(m, n));
        for _ in 0..100 {
            self.kinematics(&q, &still, &mut kinematics);
            let mut gap: Vec<f64> = target.iter().zip(&kinematics.endpoint).map(|(t, d)| t - d).collect();
            let distance = gap.iter().map(|g| g * g).sum::<f64>().sqrt();
            if distance < 1e-13 {
                return Ok(q);
            }
            let j = &kinematics.jacobian;
            let mut square: Vec<f64> = (0..m * m).map(|k| (0..n).map(|i| j[k / m * n + i] * j[k % m * n + i]).sum()).collect();
            let trace: f64 = (0..m).map(|i| square[i * m + i]).sum();
            // Damped far away, where the Jacobian may be singular, and pure Newton near the goal.
            (0..m).for_each(|i| square[i * m + i] += 1e-2 * trace * distance * distance + 1e-15 * trace);
            if !cholesky(&mut square, m) {
                break;
            }
            cholesky_solve(&square, m, &mut gap);
            for i in 0..n {
                q[i] += (0..m).map(|a| j[a * n + i] * gap[a]).sum::<f64>();
            }
        }
        self.kinematics(&q, &still, &mut kinematics);
        let distance = target.iter().zip(&kinematics.endpoint).map(|(t, d)| (t - d).powi(2)).sum::<f64>().sqrt();
        if distance < 1e-9 {
            return Ok(q);
        }
        let why = format!("the nearest place found from its home posture is {distance:.4} m away");
        Err(DeviceError::Reach { who: "the robot".to_owned(), target: target.to_vec(), why })
    }
}

impl Robot for SerialChain {
    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn joints(&self) -> &Joints {
        &self.joints
    }

    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut Kinematics) {
        let n = self.links.len();
        match &self.space {
            Space::Joints => {
                out.endpoint.copy_from_slice(q);
                out.jacobian.fill(0.0);
                (0..n).for_each(|i| out.jacobian[i * n + i] = 1.0);
                out.jacobian_rate.fill(0.0);
            }
            Space::Tip(components) => {
                let frames = self.frames(q);
                let drift = self.tip_drift(&frames, rates);
                for (row, &c) in components.iter().enumerate() {
                    out.endpoint[row] = frames.tip[c];
                    out.jacobian_rate[row] = drift[c];
                    for j in 0..n {
                        out.jacobian[row * n + j] = self.tip_column(&frames, j)[c];
                    }
                }
            }
        }
    }

    fn mass_matrix(&self, q: &[f64], out: &mut [f64]) {
        let frames = self.frames(q);
        self.composite_inertia(&frames, &self.bodies(&frames), out);
    }

    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]) {
        let frames = self.frames(q);
        self.inverse_dynamics(&frames, &self.bodies(&frames), rates, out);
    }

    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, DeviceError> {
        if target.len() != self.axes.len() {
            return Err(DeviceError::size("posture.hand_m", target.len(), self.axes.len()));
        }
        match self.space {
            Space::Joints => Ok(target.to_vec()),
            Space::Tip(_) => self.approach(target),
        }
    }

    fn range(&self) -> &[[f64; 2]] {
        &self.range
    }

    fn home(&self) -> Result<Vec<f64>, DeviceError> {
        Ok(self.home.clone())
    }

    fn acceleration(&self, q: &[f64], rates: &[f64], _kinematics: &Kinematics, torque: &[f64], work: &mut [f64], out: &mut [f64]) {
        let (n, frames) = (torque.len(), self.frames(q));
        let bodies = self.bodies(&frames);
        self.inverse_dynamics(&frames, &bodies, rates, out);
        out.iter_mut().zip(torque).for_each(|(o, t)| *o = t - *o);
        self.composite_inertia(&frames, &bodies, work);
        if cholesky(work, n) {
            cholesky_solve(work, n, out);
        } else {
            out.fill(f64::NAN);
        }
    }
}
