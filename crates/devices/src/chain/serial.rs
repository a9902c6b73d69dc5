//! A serial chain of rigid bodies as a robot.

use super::dynamics::{Bodies, Frames};
use super::link::{Link, MAX_JOINTS};
use super::parameters;
use crate::error::DeviceError;
use crate::linearise::rigid_body;
use crate::vector3::Vector;
use ndof_linear::{cholesky_in_place, cholesky_solve, inverse};
use ndof_models::Axis;
use ndof_models::robot::{EndpointKinematics, Joints, Robot, RobotError, RobotParameter};

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
    springs: Vec<[f64; 2]>,
    soft_friction: Vec<[f64; 2]>,
}

impl SerialChain {
    /// Whether a joint slides: its angle is then a way (m), its torque a force (N).
    pub fn slides(&self, joint: usize) -> bool {
        self.links[joint].slides
    }

    /// How far each joint may go (rad, m), as its file says; without end where it says nothing.
    pub fn ranges(&self) -> &[[f64; 2]] {
        &self.range
    }

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
        let nothing = vec![[0.0; 2]; links.len()];
        let chain = SerialChain { links, tip, gravity, space, home, range, axes, joints, springs: nothing.clone(), soft_friction: nothing };
        chain.check()?;
        Ok(chain)
    }

    /// Springs beside the joints: stiffness (N m/rad, N/m) and the angle at which each is at rest. They are no part of the bodies' dynamics.
    pub fn springs(&self) -> &[[f64; 2]] {
        &self.springs
    }

    /// The same chain with these springs, one a joint; joints beyond the list have none.
    #[must_use]
    pub fn with_springs(self, mut springs: Vec<[f64; 2]>) -> Self {
        springs.resize(self.links.len(), [0.0; 2]);
        SerialChain { springs, ..self }
    }

    /// Of each joint's dry friction the time by which it turns before the joint does (s) and the speed over which it turns for each unit of its level
    /// (rad/s/(N m), m/s/N). It is no part of the bodies' dynamics.
    ///
    /// A soft constraint is f = −(b q̇ + q̈)/R within its level F: it crosses zero 1/b before q̇ and reaches F at a speed of F R/b.
    pub fn soft_friction(&self) -> &[[f64; 2]] {
        &self.soft_friction
    }

    /// The same chain with these times and softnesses R/A of its dry friction, A a joint's entry of the inverse of the mass matrix at home.
    #[must_use]
    pub(super) fn with_soft_friction(self, soft: &[[f64; 2]]) -> Self {
        let (mass, _) = rigid_body(&self, &self.home);
        let mobility = inverse(&mass);
        let of = |(j, [ahead_s, softness]): (usize, &[f64; 2])| [*ahead_s, ahead_s * softness * mobility.as_ref().map_or(0.0, |a| a[[j, j]])];
        let soft_friction = soft.iter().enumerate().map(of).collect();
        SerialChain { soft_friction, ..self }
    }

    /// Gravity in the base's axes (m/s²).
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    /// The same chain under another gravity.
    #[must_use]
    pub fn with_gravity(self, gravity: [f64; 3]) -> Self {
        SerialChain { gravity, ..self }
    }

    /// The flange, in the axes of the last joint (m).
    pub fn tip(&self) -> [f64; 3] {
        self.tip
    }

    /// Refuses friction, bodies and a mass matrix that there cannot be.
    fn check(&self) -> Result<(), RobotError> {
        self.joints.check()?;
        self.links.iter().zip(&self.joints.names).try_for_each(|(link, name)| link.check(name))?;
        let n = self.links.len();
        let mut mass = vec![0.0; n * n];
        self.mass_matrix(&self.home, &mut mass);
        if cholesky_in_place(&mut mass, n) {
            return Ok(());
        }
        Err(RobotError::Body("the robot's mass matrix at its home posture is not symmetric positive definite; an inertia has to be".to_owned()))
    }

    /// Where the bodies are.
    pub(super) fn frames(&self, q: &[f64]) -> Frames {
        Frames::of(&self.links, self.tip, q)
    }

    /// Whether the place of the tip shows in how the robot moves.
    fn tip_moves(&self) -> bool {
        matches!(self.space, Space::Tip(_))
    }

    /// Newton's iteration for the tip, minimum-norm steps where there are more joints than axes.
    fn approach(&self, target: &[f64]) -> Result<Vec<f64>, RobotError> {
        let (n, m) = (self.links.len(), self.axes.len());
        let (mut q, still, mut kinematics) = (self.home.clone(), vec![0.0; n], EndpointKinematics::new(m, n));
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
            if !cholesky_in_place(&mut square, m) {
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
        Err(RobotError::Reach { who: "the robot".to_owned(), target: target.to_vec(), why })
    }
}

impl Robot for SerialChain {
    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn joints(&self) -> &Joints {
        &self.joints
    }

    fn kinematics(&self, q: &[f64], rates: &[f64], out: &mut EndpointKinematics) {
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
                let drift = frames.tip_drift(&self.links, rates);
                for (row, &c) in components.iter().enumerate() {
                    out.endpoint[row] = frames.tip[c];
                    out.jacobian_rate[row] = drift[c];
                    for j in 0..n {
                        out.jacobian[row * n + j] = frames.tip_column(&self.links, j)[c];
                    }
                }
            }
        }
    }

    fn mass_matrix(&self, q: &[f64], out: &mut [f64]) {
        let frames = self.frames(q);
        Bodies::of(&self.links, &frames).composite_inertia(&self.links, &frames, out);
    }

    fn bias(&self, q: &[f64], rates: &[f64], out: &mut [f64]) {
        let frames = self.frames(q);
        Bodies::of(&self.links, &frames).inverse_dynamics(self.gravity, &self.links, &frames, rates, |_| 0.0, out);
    }

    fn inverse_dynamics(&self, q: &[f64], rates: &[f64], accelerations: &[f64], out: &mut [f64]) {
        let frames = self.frames(q);
        Bodies::of(&self.links, &frames).inverse_dynamics(self.gravity, &self.links, &frames, rates, |i| accelerations[i], out);
    }

    fn inverse_kinematics(&self, target: &[f64]) -> Result<Vec<f64>, RobotError> {
        if target.len() != self.axes.len() {
            return Err(RobotError::Length { what: "posture.hand_m", found: target.len(), expected: self.axes.len() });
        }
        match self.space {
            Space::Joints => Ok(target.to_vec()),
            Space::Tip(_) => self.approach(target),
        }
    }

    fn parameters(&self) -> Vec<RobotParameter> {
        parameters::told(&self.links, self.tip_moves().then_some(self.tip), &self.joints)
    }

    fn with_parameters(&self, values: &[f64]) -> Result<Box<dyn Robot>, RobotError> {
        let mut other = self.clone();
        let mut tip = self.tip_moves().then_some(self.tip);
        parameters::taken(values, &mut other.links, &mut tip, &mut other.joints)?;
        other.tip = tip.unwrap_or(self.tip);
        other.check()?;
        Ok(Box::new(other))
    }

    fn range(&self) -> &[[f64; 2]] {
        &self.range
    }

    fn home(&self) -> Result<Vec<f64>, RobotError> {
        Ok(self.home.clone())
    }

    fn acceleration(&self, q: &[f64], rates: &[f64], _kinematics: &EndpointKinematics, torque: &[f64], work: &mut [f64], out: &mut [f64]) {
        let (n, frames) = (torque.len(), self.frames(q));
        let bodies = Bodies::of(&self.links, &frames);
        bodies.inverse_dynamics(self.gravity, &self.links, &frames, rates, |_| 0.0, out);
        out.iter_mut().zip(torque).for_each(|(o, t)| *o = t - *o);
        bodies.composite_inertia(&self.links, &frames, work);
        if cholesky_in_place(work, n) {
            cholesky_solve(work, n, out);
        } else {
            out.fill(f64::NAN);
        }
    }
}
