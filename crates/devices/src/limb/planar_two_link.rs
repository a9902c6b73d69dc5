//! The human arm in the plane: upper arm and forearm with joint inertia, damping and stiffness.

use super::arm_figures::{PlanarTwoLinkConfig, Segments};
use super::endpoint_linear::{mean_force, square};
use super::{Impedance, Limb};
use crate::device::LimbEntry;
use crate::error::DeviceError;
use crate::parameters::parameter;
use ndarray::{Array2, array};
use ndof_linear::{inverse, is_positive_definite};
use ndof_models::robot::RobotError;
use ndof_models::{Arm, Kinematics, planar_angles, planar_jacobian, planar_links};

/// The registry's entry.
pub(crate) static ENTRY: LimbEntry = LimbEntry {
    name: "planar-two-link",
    description: "upper arm and forearm with joint inertia, damping and stiffness, nonlinear geometry",
    parameters: &[
        parameter("height_m", "m", f64::NAN, "body height, sets the segments with body_mass_kg"),
        parameter("body_mass_kg", "kg", f64::NAN, "body mass"),
        parameter("link_lengths_m", "m", f64::NAN, "upper arm and forearm; 0.33 and 0.34 without height and mass"),
        parameter("link_masses_kg", "kg", f64::NAN, "1.93 and 1.52 without height and mass"),
        parameter("link_centres_m", "m", f64::NAN, "joint to centre of mass; 0.165 and 0.19 without height and mass"),
        parameter("link_inertias_kg_m2", "kg m^2", f64::NAN, "about the centre of mass; 0.0141 and 0.0188 without height and mass"),
        parameter("K", "N m/rad", f64::NAN, "joint stiffness matrix, [[15, 6], [6, 16]] by default"),
        parameter("B", "N m s/rad", f64::NAN, "joint damping matrix, [[2.3, 0.9], [0.9, 2.4]] by default"),
        parameter("mean_force_n", "N", f64::NAN, "force on the hand that holds the arm at the posture; by default that of the tone"),
        parameter("tone", "", f64::NAN, "\"normal\", \"mild-hypertonia\" (K x 2, B x 1.5, pull 4 N) or \"severe-hypertonia\" (K x 4, B x 2, pull 10 N)"),
        parameter("handle_mass_kg", "kg", 0.0, "mass moving with the hand"),
        parameter("shoulder_m", "m", f64::NAN, "place of the shoulder, in place of posture.joint_rad"),
        parameter("arm", "", f64::NAN, "\"right\" or \"left\""),
        parameter("noise", "", f64::NAN, "force made by the limb itself: rms_n, cutoff_hz"),
    ],
    source: "Shadmehr and Mussa-Ivaldi, J. Neurosci. 14 (1994) 3208; Winter, Biomechanics and Motor Control of Human Movement (2009), table 4.1",
};

/// The arm built from [`PlanarTwoLinkConfig`] at a posture.
///
/// M(φ) φ̈ + h(φ, φ̇) + B φ̇ + K (φ − φ₀) + J₀ᵀF₀ = Jᵀ F with relative joint angles; the hand's mass is part of M.
#[derive(Clone, Debug)]
pub struct PlanarTwoLink {
    lengths: [f64; 2],
    posture: [f64; 2],
    shoulder: [f64; 2],
    elbow_sign: f64,
    // α, β, δ of M = [α + 2β cos φ₂, δ + β cos φ₂; ·, δ], the handle's mass included.
    alpha: f64,
    beta: f64,
    delta: f64,
    stiffness: Array2<f64>,
    damping: Array2<f64>,
    mean_force: Vec<f64>,
    mean_torque: [f64; 2],
}

impl PlanarTwoLink {
    /// The arm with its hand at the origin of displacements, in posture `joint_rad` or, where the shoulder's place is
    /// given, in that which puts the hand at `hand_m`.
    ///
    /// # Errors
    /// [`DeviceError`] if figures are missing or impossible, or the hand is out of reach.
    pub fn new(config: &PlanarTwoLinkConfig, hand_m: [f64; 2], joint_rad: Option<[f64; 2]>) -> Result<Self, DeviceError> {
        let Segments { lengths, masses, centres, inertias } = config.segments()?;
        DeviceError::not_negative("limb.handle_mass_kg", config.handle_mass_kg)?;
        let elbow_sign = if config.arm == Arm::Right { 1.0 } else { -1.0 };
        let posture = match (config.shoulder_m, joint_rad) {
            (Some(shoulder), None) => planar_angles(lengths, elbow_sign, [hand_m[0] - shoulder[0], hand_m[1] - shoulder[1]]).ok_or_else(|| {
                let why = format!("its shoulder is at {shoulder:?} and its segments are {} m and {} m long", lengths[0], lengths[1]);
                RobotError::Reach { who: "the arm".to_owned(), target: hand_m.to_vec(), why }
            })?,
            (None, Some(joint_rad)) => joint_rad,
            (None, None) => [std::f64::consts::FRAC_PI_4, elbow_sign * std::f64::consts::FRAC_PI_2],
            (Some(_), Some(_)) => {
                return Err(DeviceError::Missing("limb.shoulder_m and posture.joint_rad both set the arm's posture; give one of them".to_owned()));
            }
        };
        if !(posture[1] * elbow_sign).sin().is_normal() || (posture[1] * elbow_sign).sin() < 0.0 {
            return Err(DeviceError::value("posture.joint_rad[1]", posture[1], "an elbow angle within (0, π), negative for a left arm"));
        }
        let [m1, m2] = masses;
        let handle = config.handle_mass_kg;
        let (l1, l2) = (lengths[0], lengths[1]);
        let (stiffer, slower, pull) = config.tone.figures();
        let beta = m2 * l1 * centres[1] + handle * l1 * l2;
        let delta = inertias[1] + m2 * centres[1].powi(2) + handle * l2 * l2;
        let alpha = inertias[0] + m1 * centres[0].powi(2) + m2 * l1 * l1 + handle * l1 * l1 + delta;
        let mut arm = PlanarTwoLink {
            lengths,
            posture,
            shoulder: [0.0; 2],
            elbow_sign,
            alpha,
            beta,
            delta,
            stiffness: square("K", &config.K, 2)? * stiffer,
            damping: square("B", &config.B, 2)? * slower,
            mean_torque: [0.0; 2],
            mean_force: vec![0.0; 2],
        };
        if !is_positive_definite(&arm.mass_matrix(posture[1])) {
            return Err(DeviceError::Inertia("the arm's joint inertia".to_owned()));
        }
        let hand = arm.hand(posture);
        arm.shoulder = [-hand[0], -hand[1]];
        // Tone pulls the hand towards the shoulder; the force that holds it points away.
        let reach = hand[0].hypot(hand[1]);
        arm.mean_force = match &config.mean_force_n {
            Some(given) => mean_force(Some(given), 2)?,
            None => hand.iter().map(|h| pull * h / reach).collect(),
        };
        let j = arm.kinematics().jacobian();
        arm.mean_torque = [0, 1].map(|k| j[[0, k]] * arm.mean_force[0] + j[[1, k]] * arm.mean_force[1]);
        Ok(arm)
    }

    /// Shoulder and elbow angle of the posture (rad).
    pub fn posture_rad(&self) -> [f64; 2] {
        self.posture
    }

    /// Lengths of the two segments (m).
    pub fn link_lengths_m(&self) -> [f64; 2] {
        self.lengths
    }

    /// Its joints' own stiffness and damping.
    pub(super) fn springs_and_dampers(&self) -> [&Array2<f64>; 2] {
        [&self.stiffness, &self.damping]
    }

    /// Joint angles with the hand displaced by `x`, where it is in reach.
    pub(super) fn angles(&self, x: [f64; 2]) -> Option<[f64; 2]> {
        planar_angles(self.lengths, self.elbow_sign, [x[0] - self.shoulder[0], x[1] - self.shoulder[1]])
    }

    /// The Jacobian at joint angles, row by row.
    pub(super) fn jacobian(&self, phi: [f64; 2]) -> [[f64; 2]; 2] {
        planar_jacobian(planar_links(self.lengths, phi))
    }

    fn hand(&self, phi: [f64; 2]) -> [f64; 2] {
        let [[x1, y1], [x2, y2]] = planar_links(self.lengths, phi);
        [x1 + x2, y1 + y2]
    }

    /// How the joints move the hand at the posture.
    fn kinematics(&self) -> Kinematics {
        Kinematics::PlanarTwoLink { link_lengths_m: self.lengths, posture_rad: self.posture }
    }

    pub(super) fn mass_matrix(&self, elbow: f64) -> Array2<f64> {
        let coupling = self.beta * elbow.cos();
        array![[self.alpha + 2.0 * coupling, self.delta + coupling], [self.delta + coupling, self.delta]]
    }
}

impl Limb for PlanarTwoLink {
    fn mean_force(&self) -> &[f64] {
        &self.mean_force
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        let Some(phi) = self.angles([x[0], x[1]]) else { return out.fill(f64::NAN) };
        let [l1, l2] = self.lengths;
        let links = planar_links(self.lengths, phi);
        let ([[x1, y1], [x2, y2]], [[j00, j01], [j10, j11]]) = (links, planar_jacobian(links));
        // φ̇ = J⁻¹ v; det J = l₁ l₂ sin φ₂ = x₁y₂ − y₁x₂, and l₁ l₂ cos φ₂ = x₁x₂ + y₁y₂.
        let (area, along) = (x1 * y2 - y1 * x2, x1 * x2 + y1 * y2);
        let (w1, w2) = ((j11 * v[0] - j01 * v[1]) / area, (j00 * v[1] - j10 * v[0]) / area);
        let h = self.beta * area / (l1 * l2);
        let coupling = self.beta * along / (l1 * l2);
        let (d1, d2) = (phi[0] - self.posture[0], phi[1] - self.posture[1]);
        let (k, b) = (&self.stiffness, &self.damping);
        let t1 = j00 * force[0] + j10 * force[1] - self.mean_torque[0] - k[[0, 0]] * d1 - k[[0, 1]] * d2 - b[[0, 0]] * w1 - b[[0, 1]] * w2
            + h * w2 * (2.0 * w1 + w2);
        let t2 = j01 * force[0] + j11 * force[1] - self.mean_torque[1] - k[[1, 0]] * d1 - k[[1, 1]] * d2 - b[[1, 0]] * w1 - b[[1, 1]] * w2 - h * w1 * w1;
        let (m11, m12, m22) = (self.alpha + 2.0 * coupling, self.delta + coupling, self.delta);
        let determinant = m11 * m22 - m12 * m12;
        let (a1, a2) = ((m22 * t1 - m12 * t2) / determinant, (m11 * t2 - m12 * t1) / determinant);
        let (r1, r2) = (w1 * w1, (w1 + w2) * (w1 + w2));
        out[0] = j00 * a1 + j01 * a2 - x1 * r1 - x2 * r2;
        out[1] = j10 * a1 + j11 * a2 - y1 * r1 - y2 * r2;
    }

    /// M = J⁻ᵀ M_q J⁻¹, B likewise, K = J⁻ᵀ (K_q − Γ) J⁻¹ with Γ_ij = Σ_k F₀ₖ ∂²f_k/∂φ_i∂φ_j.
    fn linearised(&self) -> Impedance {
        let kinematics = self.kinematics();
        // The elbow is neither straight nor folded, which the constructor saw to.
        let back = inverse(&kinematics.jacobian()).unwrap_or_else(|| Array2::from_elem((2, 2), f64::NAN));
        let outward = |a: &Array2<f64>| back.t().dot(a).dot(&back);
        Impedance {
            inertia: outward(&self.mass_matrix(self.posture[1])),
            damping: outward(&self.damping),
            stiffness: outward(&(&self.stiffness - &kinematics.geometric_stiffness(&self.mean_force))),
        }
    }

    fn joint_impedance(&self) -> Option<(Impedance, Array2<f64>)> {
        let joints = Impedance { inertia: self.mass_matrix(self.posture[1]), damping: self.damping.clone(), stiffness: self.stiffness.clone() };
        Some((joints, self.kinematics().jacobian()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::arm_figures::Tone;
    use super::*;
    use ndof_models::effects::CurvedArm;

    fn arm(mean: [f64; 2], handle: f64) -> PlanarTwoLink {
        let config = PlanarTwoLinkConfig { mean_force_n: Some(mean.to_vec()), handle_mass_kg: handle, ..Default::default() };
        PlanarTwoLink::new(&config, [0.0; 2], None).expect("valid")
    }

    #[test]
    fn the_standard_arm_has_the_endpoint_matrices_of_the_literature_set() {
        // Shadmehr & Mussa-Ivaldi's arm at (45°, 90°) with a 0.6 kg trough: test arm N1, to the printed digits.
        let m = arm([0.0; 2], 0.6).linearised();
        for (found, expected) in [
            (&m.inertia, array![[1.985, -0.747], [-0.747, 1.985]]),
            (&m.damping, array![[10.33, -2.93], [-2.93, 37.06]]),
            (&m.stiffness, array![[67.31, -18.03], [-18.03, 245.57]]),
        ] {
            for (f, e) in found.iter().zip(&expected) {
                assert!((f - e).abs() <= 0.006, "{found} instead of {expected}");
            }
        }
    }

    #[test]
    fn the_linearised_arm_is_the_derivative_of_the_nonlinear_one() {
        for limb in [arm([6.0, -7.0], 0.4), arm([0.0; 2], 0.0)] {
            let matrices = limb.linearised();
            let mobility = inverse(&matrices.inertia).expect("regular");
            let (step, f0) = (1e-5, [limb.mean_force()[0], limb.mean_force()[1]]);
            let at = |x: [f64; 2], v: [f64; 2], f: [f64; 2]| {
                let mut a = [0.0; 2];
                limb.acceleration(&x, &v, &f, &mut a);
                a
            };
            assert!(at([0.0; 2], [0.0; 2], f0).iter().all(|a| a.abs() < 1e-12));
            for j in 0..2 {
                let e = |s: f64| if j == 0 { [s, 0.0] } else { [0.0, s] };
                let slope = |plus: [f64; 2], minus: [f64; 2], i: usize| (plus[i] - minus[i]) / (2.0 * step);
                let force =
                    (at([0.0; 2], [0.0; 2], [f0[0] + e(step)[0], f0[1] + e(step)[1]]), at([0.0; 2], [0.0; 2], [f0[0] - e(step)[0], f0[1] - e(step)[1]]));
                let position = (at(e(step), [0.0; 2], f0), at(e(-step), [0.0; 2], f0));
                let velocity = (at([0.0; 2], e(step), f0), at([0.0; 2], e(-step), f0));
                for i in 0..2 {
                    // Central differences at step h err by h²f‴/6 ≈ 1e-10 of the largest entry, and by round-off ε/h ≈ 1e-11.
                    assert!((slope(force.0, force.1, i) - mobility[[i, j]]).abs() < 1e-8);
                    assert!((slope(position.0, position.1, i) + mobility.dot(&matrices.stiffness)[[i, j]]).abs() < 1e-5);
                    assert!((slope(velocity.0, velocity.1, i) + mobility.dot(&matrices.damping)[[i, j]]).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn joint_and_endpoint_stiffness_differ_by_the_geometric_term() {
        let limb = arm([6.0, -7.0], 0.0);
        let (joint, jacobian) = limb.joint_impedance().expect("has joints");
        let back = jacobian.t().dot(&limb.linearised().stiffness).dot(&jacobian) + limb.kinematics().geometric_stiffness(limb.mean_force());
        for (found, expected) in back.iter().zip(&joint.stiffness) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn hypertonia_stiffens_the_arm_and_pulls_it_towards_the_shoulder() {
        let of = |tone| PlanarTwoLink::new(&PlanarTwoLinkConfig { tone, ..Default::default() }, [0.0; 2], None).expect("valid");
        let (normal, severe) = (of(Tone::Normal), of(Tone::SevereHypertonia));
        assert_eq!(normal.mean_force(), [0.0, 0.0]);
        let f = severe.mean_force();
        let hand = severe.hand(severe.posture);
        assert!((f[0].hypot(f[1]) - 10.0).abs() < 1e-12 && (f[0] * hand[1] - f[1] * hand[0]).abs() < 1e-12 && f[1] > 0.0);
        let ratio = severe.joint_impedance().expect("joints").0.stiffness / normal.joint_impedance().expect("joints").0.stiffness;
        assert!(ratio.iter().all(|r| (r - 4.0).abs() < 1e-15));
    }

    #[test]
    fn the_arm_that_a_diagnosis_weighs_is_this_arm() {
        // CurvedArm's force along the motion of this file's equations, from the endpoint matrices at the posture alone.
        let limb = arm([5.0, -6.0], 0.6);
        let Impedance { inertia, damping, stiffness } = limb.linearised();
        let curved = CurvedArm { link_lengths_m: limb.lengths, posture_rad: limb.posture, mean_force_n: [5.0, -6.0] };
        for (x, v, force) in [([0.0, 0.0], [0.0, 0.0], [7.0, -3.0]), ([0.04, -0.03], [0.5, 0.2], [9.0, 1.0]), ([-0.1, 0.06], [-0.8, 1.1], [-20.0, 12.0])] {
            let mut a = [0.0; 2];
            limb.acceleration(&x, &v, &force, &mut a);
            let displaced = curved.displaced(x).expect("reach");
            let moving = displaced.moving(v, a);
            let own = [&stiffness, &damping, &inertia].into_iter().zip(moving.order).map(|(m, w)| m.dot(&array![w[0], w[1]])).reduce(|a, b| a + b);
            let own = own.expect("three matrices");
            let turned = displaced.carried([own[0], own[1]]);
            for k in 0..2 {
                let found = turned[k] + limb.beta * moving.coupling[k] + displaced.held[k] + curved.mean_force_n[k];
                // An identity: some twenty products of numbers up to 10³.
                assert!((found - force[k]).abs() < 1e-10, "{x:?} {v:?}: {found} for {}", force[k]);
            }
        }
        assert!(curved.displaced([0.0, 0.3]).is_none(), "out of reach");
    }

    #[test]
    fn height_and_mass_set_the_segments() {
        let config = PlanarTwoLinkConfig { height_m: Some(1.75), body_mass_kg: Some(75.0), ..Default::default() };
        let arm = PlanarTwoLink::new(&config, [0.0; 2], None).expect("valid");
        // 0.186 h, and 0.146 h to the ulnar styloid with half a hand of 0.108 h.
        assert!((arm.link_lengths_m()[0] - 0.3255).abs() < 1e-12 && (arm.link_lengths_m()[1] - 0.35).abs() < 1e-12);
        // δ = I₂ + m₂ c₂² with m₂ = 1.65 kg, c₂ = 0.682, ρ = 0.468 of 0.2555 m.
        assert!((arm.delta - 1.65 * 0.2555_f64.powi(2) * (0.682_f64.powi(2) + 0.468_f64.powi(2))).abs() < 1e-12);
        let half = PlanarTwoLinkConfig { height_m: Some(1.75), ..Default::default() };
        assert!(PlanarTwoLink::new(&half, [0.0; 2], None).is_err());
    }
}
