//! A planar arm that moves, and whose joint impedance changes on the way.

use super::planar_two_link::PlanarTwoLink;
use super::{Impedance, Limb, PlanarTwoLinkConfig};
use crate::error::DeviceError;
use crate::limb::endpoint_linear::square;
use crate::movement::Movement;
use ndarray::{Array2, array};
use ndof_models::schedule::Splines;
use ndof_models::{ForceLaw, Kinematics, Motion};

/// The arm of [`PlanarTwoLink`] with the torque K(s) (φ − φ₀(s)) + B(s) φ̇ in place of its own springs and dampers.
///
/// s is the phase of the movement, φ₀ the posture that has the hand at the reference. K and B are sums of closed cubic B-splines with the given
/// matrices as coefficients, so that they lie between these, and are positive definite if all of these are.
#[derive(Clone, Debug)]
pub struct MovingArm {
    arm: PlanarTwoLink,
    movement: Movement,
    stiffness: Vec<Array2<f64>>,
    damping: Vec<Array2<f64>>,
}

impl MovingArm {
    /// `arm`, built from `config`, that moves along.
    ///
    /// # Errors
    /// [`DeviceError`] if matrices are missing or impossible, or the reference is out of reach.
    pub(crate) fn new(arm: PlanarTwoLink, config: &PlanarTwoLinkConfig, movement: &Movement) -> Result<Self, DeviceError> {
        movement.check(2)?;
        let matrices = |name: &str, given: &Option<Vec<Vec<Vec<f64>>>>, own: &Array2<f64>| match given {
            Some(list) if list.len() < Splines::FEWEST => Err(DeviceError::size(name, list.len(), format!("{} matrices at least", Splines::FEWEST))),
            Some(list) => list.iter().map(|rows| square(name, rows, 2)).collect(),
            None => Ok(vec![own.clone(); Splines::FEWEST]),
        };
        let [own_stiffness, own_damping] = arm.springs_and_dampers();
        let stiffness = matrices("limb.K_over_cycle", &config.K_over_cycle, own_stiffness)?;
        let damping = matrices("limb.B_over_cycle", &config.B_over_cycle, own_damping)?;
        arm.angles([movement.to[0], movement.to[1]])
            .map(|_| ())
            .ok_or_else(|| DeviceError::value("controller.movement.to", movement.to[0].hypot(movement.to[1]), "within the arm's reach"))?;
        Ok(MovingArm { arm, movement: movement.clone(), stiffness, damping })
    }

    /// Joint angles with the hand displaced by `x`, where it is in reach (rad).
    pub fn joint_angles(&self, x: [f64; 2]) -> Option<[f64; 2]> {
        self.arm.angles(x)
    }

    /// Posture and mean force at a place of the movement as the projection of a stiffness takes them.
    pub fn kinematics(&self, angles: [f64; 2]) -> Kinematics {
        Kinematics::PlanarTwoLink { link_lengths_m: self.arm.link_lengths_m(), posture_rad: angles }
    }

    /// The limb in its joints at a phase, in the posture `angles`.
    pub fn joints(&self, phase: f64, angles: [f64; 2]) -> Impedance {
        let [stiffness, damping] = self.joint_matrices(phase);
        Impedance { inertia: self.arm.mass_matrix(angles[1]), damping, stiffness }
    }

    /// What the movement's own velocity and acceleration add to damping and stiffness: ∂h/∂φ̇ and ∂(M φ̈ + h)/∂φ.
    pub fn inertial(&self, angles: [f64; 2], rate: [f64; 2], acceleration: [f64; 2]) -> [Array2<f64>; 2] {
        // M₁₂ = δ + β cos φ₂.
        let (straight, (sin, cos)) = (self.arm.mass_matrix(0.0), angles[1].sin_cos());
        let beta = straight[[0, 1]] - straight[[1, 1]];
        let ([w1, w2], [a1, a2]) = (rate, acceleration);
        let damping = array![[-2.0 * w2, -2.0 * (w1 + w2)], [2.0 * w1, 0.0]] * (beta * sin);
        let bent = [-beta * cos * (2.0 * w1 * w2 + w2 * w2) - beta * sin * (2.0 * a1 + a2), beta * cos * w1 * w1 - beta * sin * a1];
        [damping, array![[0.0, bent[0]], [0.0, bent[1]]]]
    }

    /// Joint stiffness (N m/rad) and damping (N m s/rad) at a phase.
    pub fn joint_matrices(&self, phase: f64) -> [Array2<f64>; 2] {
        [&self.stiffness, &self.damping].map(|matrices| {
            let splines = Splines::new(matrices.len(), true);
            splines.at(phase).into_iter().map(|(k, value)| &matrices[k] * value).fold(Array2::zeros((2, 2)), |sum, part| sum + part)
        })
    }
}

/// The difference between the torques that follow the phase and those of the arm at rest, as a force at the hand.
impl ForceLaw for MovingArm {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let phase = self.movement.phase(motion.time_s);
        let share = self.movement.share(phase);
        let hand = [motion.position[0], motion.position[1]];
        let wanted = [share * self.movement.to[0], share * self.movement.to[1]];
        let (Some(angles), Some(rest)) = (self.arm.angles(hand), self.arm.angles(wanted)) else { return force.fill(f64::NAN) };
        let [[j00, j01], [j10, j11]] = self.arm.jacobian(angles);
        let area = j00 * j11 - j01 * j10;
        let v = motion.velocity;
        let rates = [(j11 * v[0] - j01 * v[1]) / area, (j00 * v[1] - j10 * v[0]) / area];
        let ([k, b], [own_k, own_b], posture) = (self.joint_matrices(phase), self.arm.springs_and_dampers(), self.arm.posture_rad());
        let torque = [0, 1].map(|i| {
            let of = |j: usize| k[[i, j]] * (angles[j] - rest[j]) - own_k[[i, j]] * (angles[j] - posture[j]) + (b[[i, j]] - own_b[[i, j]]) * rates[j];
            of(0) + of(1)
        });
        // Jᵀ f = τ.
        force[0] += (j11 * torque[0] - j10 * torque[1]) / area;
        force[1] += (j00 * torque[1] - j01 * torque[0]) / area;
    }
}

impl Limb for MovingArm {
    fn mean_force(&self) -> &[f64] {
        self.arm.mean_force()
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        self.arm.acceleration(x, v, force, out);
    }

    fn linearised(&self) -> Impedance {
        self.arm.linearised()
    }

    fn joint_impedance(&self) -> Option<(Impedance, Array2<f64>)> {
        self.arm.joint_impedance()
    }

    fn moving(&self) -> Option<&MovingArm> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(config: &PlanarTwoLinkConfig) -> Result<MovingArm, DeviceError> {
        let movement = Movement { cycle_s: 2.0, to: vec![0.05, 0.08] };
        MovingArm::new(PlanarTwoLink::new(config, [0.0; 2], None)?, config, &movement)
    }

    fn force(limb: &MovingArm, time_s: f64, position: [f64; 2], velocity: [f64; 2]) -> [f64; 2] {
        let mut force = [0.0; 2];
        let motion = Motion::now(time_s, &position, &velocity);
        limb.evaluate(&motion, &[], &mut force, &mut []);
        force
    }

    /// At the posture and phase 0 nothing is added; where the reference is, the springs are slack, whatever they are: what is added takes
    /// the arm's own springs away.
    #[test]
    fn springs_rest_where_the_reference_is() {
        let limb = moving(&PlanarTwoLinkConfig::default()).expect("valid");
        assert!(force(&limb, 0.0, [0.01, -0.02], [0.1, 0.2]).iter().all(|f| f.abs() < 1e-12));
        let stiff = PlanarTwoLinkConfig { K_over_cycle: Some(vec![vec![vec![40.0, 5.0], vec![5.0, 30.0]]; 4]), ..Default::default() };
        let [limb, stiff] = [&PlanarTwoLinkConfig::default(), &stiff].map(|config| moving(config).expect("valid"));
        let [a, b] = [&limb, &stiff].map(|limb| force(limb, 1.0, [0.05, 0.08], [0.0; 2]));
        assert!(a[0].abs() > 1.0 && (a[0] - b[0]).abs() < 1e-10 && (a[1] - b[1]).abs() < 1e-10, "{a:?} {b:?}");
    }

    #[test]
    fn matrices_lie_between_those_that_are_given() {
        let of = |k: f64| vec![vec![k, 1.0], vec![1.0, k]];
        let config = PlanarTwoLinkConfig { K_over_cycle: Some([20.0, 20.0, 60.0, 20.0].map(of).to_vec()), ..Default::default() };
        let limb = moving(&config).expect("valid");
        let k: Vec<f64> = (0..100).map(|p| limb.joint_matrices(f64::from(p) / 100.0)[0][[0, 0]]).collect();
        assert!(k.iter().all(|k| (20.0 - 1e-12..=60.0).contains(k)) && k.iter().fold(0.0_f64, |m, k| m.max(*k)) > 40.0);
        assert!((0..100).all(|p| (limb.joint_matrices(f64::from(p) / 100.0)[0][[0, 1]] - 1.0).abs() < 1e-12));
        let few = PlanarTwoLinkConfig { K_over_cycle: Some(vec![of(20.0)]), ..Default::default() };
        assert!(moving(&few).is_err_and(|error| error.to_string().contains("K_over_cycle")));
    }
}
