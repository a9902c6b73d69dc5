//! The human wrist: hand and handle in a gimbal, with coupled passive impedance and weight.

use super::endpoint_linear::square;
use super::{EndpointLinear, Impedance, Limb};
use crate::device::LimbEntry;
use crate::error::DeviceError;
use crate::noise::LimbNoise;
use crate::parameters::parameter;
use crate::vector3::{Matrix, Vector, about, cross, dot, product, roll_pitch_yaw, transpose, turn};
use ndarray::Array2;
use ndof_linear::inverse;
use ndof_models::robot::RobotError;
use serde::{Deserialize, Serialize};

/// The registry's entry.
pub(crate) static ENTRY: LimbEntry = LimbEntry {
    name: "wrist",
    description: "hand with handle in a gimbal: coupled passive impedance in pronation, flexion and abduction, and the hand's weight",
    parameters: &[
        parameter("M", "kg m^2", f64::NAN, "inertia matrix of hand and handle in ps, fe, aa"),
        parameter("B", "N m s/rad", f64::NAN, "damping matrix"),
        parameter("K", "N m/rad", f64::NAN, "passive stiffness matrix, gravity not included"),
        parameter("hand_mass_kg", "kg", 0.45, "mass of hand and handle"),
        parameter("hand_centre_m", "m", f64::NAN, "its centre from the wrist along the forearm and across, [0.06, 0, 0]"),
        parameter("gravity_m_per_s2", "m/s^2", f64::NAN, "gravity in the forearm's frame, [0, 0, -9.81]"),
        parameter("misalignment_rpy_rad", "rad", f64::NAN, "turn of the forearm, and so of the axes of M, B, K, in the robot: roll, pitch, yaw"),
        parameter("noise", "", f64::NAN, "torque made by the limb itself: rms_n, cutoff_hz"),
    ],
    source: "Drake and Charles, Ann. Biomed. Eng. 42 (2014), for the order of the passive stiffness; figures to be confirmed",
};

/// Least cosine of flexion at which the three axes count as three.
const REGULAR: f64 = 1e-6;

/// Figures of a wrist, rows and columns in the order pronation (ps), flexion (fe), abduction (aa).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(non_snake_case, reason = "the field's own letters, as the files write them")]
pub struct WristConfig {
    /// Inertia of hand and handle (kg m²).
    pub M: Vec<Vec<f64>>,
    /// Damping (N m s/rad).
    pub B: Vec<Vec<f64>>,
    /// Passive stiffness (N m/rad); gravity comes on top.
    pub K: Vec<Vec<f64>>,
    /// Mass of hand and handle (kg).
    pub hand_mass_kg: f64,
    /// Its centre from the wrist, in the hand's frame (m).
    pub hand_centre_m: [f64; 3],
    /// Gravity in the forearm's frame: x along the forearm, z the flexion axis and y the abduction axis at rest (m/s²).
    pub gravity_m_per_s2: [f64; 3],
    /// How the anatomical axes of M, B and K are turned against the robot's: roll, pitch, yaw of the forearm in the robot (rad).
    pub misalignment_rpy_rad: [f64; 3],
    /// Torque that the limb makes by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<LimbNoise>,
}

impl Default for WristConfig {
    fn default() -> Self {
        WristConfig {
            M: vec![vec![0.0042, 0.0, 0.0], vec![0.0, 0.0049, 0.0002], vec![0.0, 0.0002, 0.0052]],
            B: vec![vec![0.03, 0.002, -0.004], vec![0.002, 0.03, -0.002], vec![-0.004, -0.002, 0.05]],
            K: vec![vec![0.756, 0.018, -0.291], vec![0.018, 0.992, -0.099], vec![-0.291, -0.099, 2.92]],
            hand_mass_kg: 0.45,
            hand_centre_m: [0.06, 0.0, 0.0],
            gravity_m_per_s2: [0.0, 0.0, -9.81],
            misalignment_rpy_rad: [0.0; 3],
            noise: None,
        }
    }
}

/// The wrist built from [`WristConfig`]: M q̈ + B q̇ + K (q − q₀) + ∂U/∂q = τ with U = −m gᵀ R(q) c; M, B and K are brought from
/// the anatomical axes to the robot's, X_q = J⁻ᵀ X J⁻¹ with the Jacobian J of [`anatomical_axes`].
#[derive(Clone, Debug)]
pub struct Wrist {
    passive: EndpointLinear,
    anatomical: Impedance,
    jacobian: Array2<f64>,
    posture: [f64; 3],
    weight: Vector,
    centre: Vector,
    gravity_stiffness: Array2<f64>,
    mean_torque: Vec<f64>,
}

impl Wrist {
    /// The wrist at rest at the angles `posture`.
    ///
    /// # Errors
    /// [`DeviceError`] if a size does not fit or M is no inertia.
    pub fn new(config: &WristConfig, posture: [f64; 3]) -> Result<Self, DeviceError> {
        DeviceError::not_negative("limb.hand_mass_kg", config.hand_mass_kg)?;
        if let Some(v) = config.hand_centre_m.iter().chain(&config.gravity_m_per_s2).find(|v| !v.is_finite()) {
            return Err(DeviceError::value("limb.hand_centre_m or limb.gravity_m_per_s2", *v, "finite"));
        }
        let passive = Impedance { inertia: square("M", &config.M, 3)?, damping: square("B", &config.B, 3)?, stiffness: square("K", &config.K, 3)? };
        let (_, jacobian) = anatomical_axes(posture, config.misalignment_rpy_rad)?;
        let back = inverse(&jacobian).ok_or_else(|| singular(posture))?;
        let carried = |x: &Array2<f64>| back.t().dot(x).dot(&back);
        let turned = Impedance { inertia: carried(&passive.inertia), damping: carried(&passive.damping), stiffness: carried(&passive.stiffness) };
        let mut wrist = Wrist {
            passive: EndpointLinear::from_matrices(turned, vec![0.0; 3])?,
            anatomical: passive,
            jacobian,
            posture,
            weight: config.gravity_m_per_s2.map(|g| config.hand_mass_kg * g),
            centre: config.hand_centre_m,
            gravity_stiffness: Array2::zeros((3, 3)),
            mean_torque: vec![0.0; 3],
        };
        wrist.mean_torque = wrist.gravity_torque(posture).iter().map(|t| -t).collect();
        wrist.gravity_stiffness = hand_gravity_stiffness(config.hand_mass_kg, config.hand_centre_m, config.gravity_m_per_s2, posture);
        Ok(wrist)
    }

    /// Torque of the hand's weight, −∂U/∂q (N m): each gimbal axis times the moment of the weight.
    pub fn gravity_torque(&self, q: [f64; 3]) -> [f64; 3] {
        let (axes, hand) = gimbal(q);
        let moment = cross(turn(&hand, self.centre), self.weight);
        axes.map(|a| dot(a, moment))
    }
}

/// Anatomical angles a of a hand that the robot holds at the angles `device_rad`, and the Jacobian ∂q/∂a from them to the robot's axes:
///
/// R(a) = Aᵀ R(q) A,  J_w(q) q̇ = A J_w(a) ȧ,
///
/// with A the turn of the forearm in the robot (roll, pitch, yaw) and J_w the axes of the gimbal. Without a turn it is the identity.
/// Impedance at the anatomical axes is Jᵀ D J.
///
/// # Errors
/// [`RobotError::Reach`] where the gimbal or the joint is singular (flexion of ±90°), [`DeviceError::Value`] for an angle that is none.
pub fn anatomical_axes(device_rad: [f64; 3], misalignment_rpy_rad: [f64; 3]) -> Result<([f64; 3], Array2<f64>), DeviceError> {
    if let Some(v) = device_rad.iter().chain(&misalignment_rpy_rad).find(|v| !v.is_finite()) {
        return Err(DeviceError::value("an angle of the wrist", *v, "finite"));
    }
    if misalignment_rpy_rad == [0.0; 3] {
        return Ok((device_rad, Array2::eye(3)));
    }
    let turned = roll_pitch_yaw(misalignment_rpy_rad);
    let (axes, hand) = gimbal(device_rad);
    let seen = product(&transpose(&turned), &product(&hand, &turned));
    let angles = [seen[2][1].atan2(seen[1][1]), (-seen[0][1]).clamp(-1.0, 1.0).asin(), seen[0][2].atan2(seen[0][0])];
    let own = gimbal(angles).0.map(|axis| turn(&turned, axis));
    let columns = |axes: [Vector; 3]| Array2::from_shape_fn((3, 3), |(i, j)| axes[j][i]);
    // The axes' determinant is the cosine of flexion, here of the gimbal and of the joint.
    if device_rad[1].cos().abs() < REGULAR || angles[1].cos().abs() < REGULAR {
        return Err(singular(device_rad));
    }
    let back = inverse(&columns(axes)).ok_or_else(|| singular(device_rad))?;
    Ok((angles, back.dot(&columns(own))))
}

/// ∂²U/∂q² of a hand of `mass_kg` with its centre at `centre_m` in the hand, at the robot's angles `device_rad` (N m/rad): what has to be
/// taken from a measured stiffness.
pub fn hand_gravity_stiffness(mass_kg: f64, centre_m: [f64; 3], gravity_m_per_s2: [f64; 3], device_rad: [f64; 3]) -> Array2<f64> {
    let (axes, hand) = gimbal(device_rad);
    let (lever, weight) = (turn(&hand, centre_m), gravity_m_per_s2.map(|g| mass_kg * g));
    // A turn about axis i carries the axes after it and the hand: ∂²U/∂q_i∂q_j = −w · (a_i × (a_j × R c)) for i ≤ j.
    Array2::from_shape_fn((3, 3), |(i, j)| -dot(weight, cross(axes[i.min(j)], cross(axes[i.max(j)], lever))))
}

fn singular(posture: [f64; 3]) -> DeviceError {
    RobotError::Reach { who: "the wrist's gimbal".to_owned(), target: posture.to_vec(), why: "flexion of ±90° lines up two of its axes".to_owned() }.into()
}

/// The gimbal's axes in the forearm's frame and the hand's orientation R = R_x R_z R_y.
fn gimbal([ps, fe, aa]: [f64; 3]) -> ([Vector; 3], Matrix) {
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let first = about(x, ps);
    let second = product(&first, &about(z, fe));
    ([x, turn(&first, z), turn(&second, y)], product(&second, &about(y, aa)))
}

impl Limb for Wrist {
    fn mean_force(&self) -> &[f64] {
        &self.mean_torque
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        let q = [self.posture[0] + x[0], self.posture[1] + x[1], self.posture[2] + x[2]];
        let weight = self.gravity_torque(q);
        let net = [force[0] + weight[0], force[1] + weight[1], force[2] + weight[2]];
        self.passive.acceleration(x, v, &net, out);
    }

    fn linearised(&self) -> Impedance {
        let mut all = self.passive.linearised();
        all.stiffness += &self.gravity_stiffness;
        all
    }

    /// The anatomical joint alone, without the weight's stiffness.
    fn joint_impedance(&self) -> Option<(Impedance, Array2<f64>)> {
        Some((self.anatomical.clone(), self.jacobian.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrist(posture: [f64; 3]) -> Wrist {
        let config = WristConfig { hand_centre_m: [0.06, 0.01, -0.02], gravity_m_per_s2: [1.0, -6.0, -7.7], ..WristConfig::default() };
        Wrist::new(&config, posture).expect("valid")
    }

    fn potential(wrist: &Wrist, q: [f64; 3]) -> f64 {
        -dot(wrist.weight, turn(&gimbal(q).1, wrist.centre))
    }

    #[test]
    fn gravity_torque_and_stiffness_are_slopes_of_the_potential() {
        let q = [0.4, -0.5, 0.3];
        let (wrist, h) = (wrist(q), 1e-4);
        let moved = |i: usize, s: f64, q: [f64; 3]| std::array::from_fn(|k| if k == i { q[k] + s } else { q[k] });
        for i in 0..3 {
            let slope = (potential(&wrist, moved(i, h, q)) - potential(&wrist, moved(i, -h, q))) / (2.0 * h);
            // h² U‴/6 with |U‴| ≤ m g |c| = 0.3.
            assert!((wrist.gravity_torque(q)[i] + slope).abs() < 1e-8);
            for j in 0..3 {
                let slope = (wrist.gravity_torque(moved(j, h, q))[i] - wrist.gravity_torque(moved(j, -h, q))[i]) / (2.0 * h);
                assert!((wrist.gravity_stiffness[[i, j]] + slope).abs() < 1e-8, "({i}, {j})");
            }
        }
    }

    #[test]
    fn the_hand_of_the_literature_hangs_with_a_quarter_newton_metre() {
        let wrist = Wrist::new(&WristConfig::default(), [0.0; 3]).expect("valid");
        // m g |c| = 0.45 · 9.81 · 0.06 about the abduction axis.
        let torque = wrist.gravity_torque([0.0; 3]);
        assert!((torque[2] - 0.45 * 9.81 * 0.06).abs() < 1e-12 && torque[0].abs() < 1e-15 && torque[1].abs() < 1e-15, "{torque:?}");
    }

    #[test]
    fn the_jacobian_is_the_slope_of_the_robot_s_angles_in_the_anatomical_ones() {
        let (q, turn_rad, h) = ([0.3, -0.4, 0.2], [0.1, -0.15, 0.2], 1e-6);
        let (_, jacobian) = anatomical_axes(q, turn_rad).expect("regular");
        let mut slopes = Array2::zeros((3, 3));
        for j in 0..3 {
            let at = |s: f64| anatomical_axes(std::array::from_fn(|k| if k == j { q[k] + s } else { q[k] }), turn_rad).expect("regular").0;
            let (plus, minus) = (at(h), at(-h));
            (0..3).for_each(|i| slopes[[i, j]] = (plus[i] - minus[i]) / (2.0 * h));
        }
        // ∂a/∂q by central differences: h² and ε/h.
        assert!((jacobian.dot(&slopes) - Array2::<f64>::eye(3)).iter().all(|v| v.abs() < 1e-9), "{jacobian} {slopes}");
        assert!((jacobian - Array2::<f64>::eye(3)).iter().any(|v| v.abs() > 0.05));
        assert!(anatomical_axes([0.0, std::f64::consts::FRAC_PI_2, 0.0], turn_rad).is_err());
    }

    #[test]
    fn a_turned_forearm_is_seen_at_the_robot_s_axes_and_carried_back_by_the_jacobian() {
        let config = WristConfig { misalignment_rpy_rad: [0.1, -0.15, 0.2], hand_mass_kg: 0.0, ..WristConfig::default() };
        let wrist = Wrist::new(&config, [0.2, 0.1, -0.1]).expect("valid");
        let (own, jacobian) = wrist.joint_impedance().expect("a joint");
        let back = jacobian.t().dot(&wrist.linearised().stiffness).dot(&jacobian);
        assert!((&back - &own.stiffness).iter().all(|v| v.abs() < 1e-12) && (&own.stiffness - &wrist.linearised().stiffness).iter().any(|v| v.abs() > 0.05));
    }

    #[test]
    fn at_rest_under_its_weight_the_hand_stays() {
        let wrist = wrist([0.2, 0.1, -0.3]);
        let mut a = [1.0; 3];
        let mean: Vec<f64> = wrist.mean_force().to_vec();
        wrist.acceleration(&[0.0; 3], &[0.0; 3], &mean, &mut a);
        assert!(a.iter().all(|a| a.abs() < 1e-12), "{a:?}");
    }
}
