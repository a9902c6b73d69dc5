//! The human arm in the plane: upper arm and forearm with joint inertia, damping and stiffness.

use super::endpoint_linear::{square, vector};
use super::{Impedance, Limb};
use crate::error::DeviceError;
use crate::matrix::is_inertia;
use crate::noise::LimbNoise;
use ndarray::{Array2, array};
use serde::{Deserialize, Serialize};

/// Which arm: it decides to which side the elbow bends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Elbow angle positive.
    #[default]
    Right,
    /// Elbow angle negative.
    Left,
}

/// A planar arm of two segments. Segment figures left out follow from height and mass (Winter's tables), the
/// defaults being Shadmehr and Mussa-Ivaldi's (1994) arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the field's own letters, as the files write them")]
pub struct PlanarTwoLinkConfig {
    /// Which arm.
    #[serde(default)]
    pub arm: Side,
    /// Body height (m); with `body_mass_kg` it sets the segments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Body mass (kg).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_mass_kg: Option<f64>,
    /// Lengths of upper arm and forearm to the hand (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_lengths_m: Option<[f64; 2]>,
    /// Segment masses (kg).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_masses_kg: Option<[f64; 2]>,
    /// Distances from joint to centre of mass (m).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_centres_m: Option<[f64; 2]>,
    /// Moments of inertia about the centres of mass (kg m²).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_inertias_kg_m2: Option<[f64; 2]>,
    /// Joint stiffness (N m/rad), two-joint terms off the diagonal.
    #[serde(default = "default_stiffness")]
    pub K: Vec<Vec<f64>>,
    /// Joint damping (N m s/rad).
    #[serde(default = "default_damping")]
    pub B: Vec<Vec<f64>>,
    /// Force on the hand that holds the arm at the posture; what tone pulls against.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_force_n: Option<Vec<f64>>,
    /// Mass of handle and trough, moving with the hand (kg).
    #[serde(default)]
    pub handle_mass_kg: f64,
    /// Where the shoulder is; with the hand's place it sets the posture. Otherwise `posture.joint_rad` does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shoulder_m: Option<[f64; 2]>,
    /// Force that the limb makes by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<LimbNoise>,
}

fn default_stiffness() -> Vec<Vec<f64>> {
    vec![vec![15.0, 6.0], vec![6.0, 16.0]]
}

fn default_damping() -> Vec<Vec<f64>> {
    vec![vec![2.3, 0.9], vec![0.9, 2.4]]
}

impl Default for PlanarTwoLinkConfig {
    fn default() -> Self {
        PlanarTwoLinkConfig {
            arm: Side::Right,
            height_m: None,
            body_mass_kg: None,
            link_lengths_m: None,
            link_masses_kg: None,
            link_centres_m: None,
            link_inertias_kg_m2: None,
            K: default_stiffness(),
            B: default_damping(),
            mean_force_n: None,
            handle_mass_kg: 0.0,
            shoulder_m: None,
            noise: None,
        }
    }
}

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

struct Segments {
    lengths: [f64; 2],
    masses: [f64; 2],
    centres: [f64; 2],
    inertias: [f64; 2],
}

/// Segment figures from body height and mass: D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed. (2009), table 4.1.
fn segments_of_body(height_m: f64, mass_kg: f64) -> Segments {
    let masses = [0.028 * mass_kg, 0.022 * mass_kg];
    let (upper, to_styloid) = (0.186 * height_m, 0.146 * height_m);
    // To the middle of the hand: half of the hand's 0.108 h beyond the wrist.
    let lengths = [upper, to_styloid + 0.054 * height_m];
    let centres = [0.436 * upper, 0.682 * to_styloid];
    let inertias = [masses[0] * (0.322 * upper).powi(2), masses[1] * (0.468 * to_styloid).powi(2)];
    Segments { lengths, masses, centres, inertias }
}

impl PlanarTwoLink {
    /// The arm with its hand at the origin of displacements, in posture `joint_rad` or, where the shoulder's place is
    /// given, in that which puts the hand at `hand_m`.
    ///
    /// # Errors
    /// [`DeviceError`] if figures are missing or impossible, or the hand is out of reach.
    pub fn new(config: &PlanarTwoLinkConfig, hand_m: [f64; 2], joint_rad: Option<[f64; 2]>) -> Result<Self, DeviceError> {
        let body = match (config.height_m, config.body_mass_kg) {
            (Some(height), Some(mass)) if height > 0.0 && mass > 0.0 => segments_of_body(height, mass),
            (None, None) => Segments { lengths: [0.33, 0.34], masses: [1.93, 1.52], centres: [0.165, 0.19], inertias: [0.0141, 0.0188] },
            (Some(height), Some(mass)) => {
                return Err(DeviceError::value("limb.height_m × limb.body_mass_kg", height * mass, "the product of two positive numbers"));
            }
            _ => return Err(DeviceError::Missing("limb.height_m and limb.body_mass_kg set the segments together; give both or none".to_owned())),
        };
        let lengths = config.link_lengths_m.unwrap_or(body.lengths);
        let masses = config.link_masses_kg.unwrap_or(body.masses);
        let centres = config.link_centres_m.unwrap_or(body.centres);
        let inertias = config.link_inertias_kg_m2.unwrap_or(body.inertias);
        for (name, values) in [("link_lengths_m", lengths), ("link_masses_kg", masses), ("link_inertias_kg_m2", inertias)] {
            if let Some(v) = values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
                return Err(DeviceError::value(format!("limb.{name}"), *v, "positive"));
            }
        }
        if !(config.handle_mass_kg.is_finite() && config.handle_mass_kg >= 0.0) {
            return Err(DeviceError::value("limb.handle_mass_kg", config.handle_mass_kg, "zero or positive"));
        }
        let elbow_sign = if config.arm == Side::Right { 1.0 } else { -1.0 };
        let posture = match (config.shoulder_m, joint_rad) {
            (Some(shoulder), None) => angles(lengths, elbow_sign, [hand_m[0] - shoulder[0], hand_m[1] - shoulder[1]]).ok_or_else(|| {
                let why = format!("its shoulder is at {shoulder:?} and its segments are {} m and {} m long", lengths[0], lengths[1]);
                DeviceError::Reach { who: "the arm".to_owned(), target: hand_m.to_vec(), why }
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
        let mean_force = vector("mean_force_n", config.mean_force_n.as_deref(), 2)?;
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
            stiffness: square("K", &config.K, 2)?,
            damping: square("B", &config.B, 2)?,
            mean_torque: [0.0; 2],
            mean_force,
        };
        if !is_inertia(&arm.mass_matrix(posture[1])) {
            return Err(DeviceError::Inertia("the arm's joint inertia".to_owned()));
        }
        let hand = arm.hand(posture);
        arm.shoulder = [-hand[0], -hand[1]];
        let [[j00, j01], [j10, j11]] = arm.jacobian(posture);
        let f = &arm.mean_force;
        arm.mean_torque = [j00 * f[0] + j10 * f[1], j01 * f[0] + j11 * f[1]];
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

    fn hand(&self, phi: [f64; 2]) -> [f64; 2] {
        let [l1, l2] = self.lengths;
        let sum = phi[0] + phi[1];
        [l1 * phi[0].cos() + l2 * sum.cos(), l1 * phi[0].sin() + l2 * sum.sin()]
    }

    fn jacobian(&self, phi: [f64; 2]) -> [[f64; 2]; 2] {
        let [l1, l2] = self.lengths;
        let ((s1, c1), (s2, c2)) = (phi[0].sin_cos(), (phi[0] + phi[1]).sin_cos());
        [[-l1 * s1 - l2 * s2, -l2 * s2], [l1 * c1 + l2 * c2, l2 * c2]]
    }

    fn mass_matrix(&self, elbow: f64) -> Array2<f64> {
        let coupling = self.beta * elbow.cos();
        array![[self.alpha + 2.0 * coupling, self.delta + coupling], [self.delta + coupling, self.delta]]
    }
}

/// Joint angles that put the hand at `target` seen from the shoulder.
fn angles(lengths: [f64; 2], elbow_sign: f64, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let [l1, l2] = lengths;
    let cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
    if cosine.is_nan() || cosine.abs() >= 1.0 {
        return None;
    }
    let elbow = elbow_sign * cosine.acos();
    Some([y.atan2(x) - (l2 * elbow.sin()).atan2(l1 + l2 * cosine), elbow])
}

impl Limb for PlanarTwoLink {
    fn axes(&self) -> usize {
        2
    }

    fn mean_force(&self) -> &[f64] {
        &self.mean_force
    }

    fn acceleration(&self, x: &[f64], v: &[f64], force: &[f64], out: &mut [f64]) {
        let Some(phi) = angles(self.lengths, self.elbow_sign, [x[0] - self.shoulder[0], x[1] - self.shoulder[1]]) else {
            return out.fill(f64::NAN);
        };
        let [l1, l2] = self.lengths;
        let ((s1, c1), (s2, c2)) = (phi[0].sin_cos(), (phi[0] + phi[1]).sin_cos());
        let (x1, y1, x2, y2) = (l1 * c1, l1 * s1, l2 * c2, l2 * s2);
        let [[j00, j01], [j10, j11]] = [[-y1 - y2, -y2], [x1 + x2, x2]];
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
        let [[j00, j01], [j10, j11]] = self.jacobian(self.posture);
        let determinant = j00 * j11 - j01 * j10;
        let j = array![[j11, -j01], [-j10, j00]] / determinant;
        let outward = |a: &Array2<f64>| j.t().dot(a).dot(&j);
        Impedance {
            inertia: outward(&self.mass_matrix(self.posture[1])),
            damping: outward(&self.damping),
            stiffness: outward(&(&self.stiffness - &self.geometric_stiffness())),
        }
    }

    fn joint_impedance(&self) -> Option<(Impedance, Array2<f64>)> {
        let [[j00, j01], [j10, j11]] = self.jacobian(self.posture);
        let joints = Impedance { inertia: self.mass_matrix(self.posture[1]), damping: self.damping.clone(), stiffness: self.stiffness.clone() };
        Some((joints, array![[j00, j01], [j10, j11]]))
    }
}

impl PlanarTwoLink {
    /// Γ, what the mean force adds to J_xᵀ K_x J_x in the joints (N m/rad).
    fn geometric_stiffness(&self) -> Array2<f64> {
        let [l1, l2] = self.lengths;
        let (a, b) = (self.posture[0], self.posture[0] + self.posture[1]);
        let (x1, y1, x2, y2) = (l1 * a.cos(), l1 * a.sin(), l2 * b.cos(), l2 * b.sin());
        let (fx, fy) = (self.mean_force[0], self.mean_force[1]);
        let far = -(fx * x2 + fy * y2);
        array![[far - fx * x1 - fy * y1, far], [far, far]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::inverse;

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
        let back = jacobian.t().dot(&limb.linearised().stiffness).dot(&jacobian) + limb.geometric_stiffness();
        for (found, expected) in back.iter().zip(&joint.stiffness) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn energy_of_a_free_undamped_arm_is_kept() {
        let config = PlanarTwoLinkConfig { B: vec![vec![0.0; 2]; 2], ..Default::default() };
        let limb = PlanarTwoLink::new(&config, [0.0; 2], None).expect("valid");
        let energy = |x: [f64; 2], v: [f64; 2]| {
            let phi = angles(limb.lengths, 1.0, [x[0] - limb.shoulder[0], x[1] - limb.shoulder[1]]).expect("reach");
            let [[j00, j01], [j10, j11]] = limb.jacobian(phi);
            let area = j00 * j11 - j01 * j10;
            let w = array![(j11 * v[0] - j01 * v[1]) / area, (j00 * v[1] - j10 * v[0]) / area];
            let d = array![phi[0] - limb.posture[0], phi[1] - limb.posture[1]];
            0.5 * w.dot(&limb.mass_matrix(phi[1]).dot(&w)) + 0.5 * d.dot(&limb.stiffness.dot(&d))
        };
        let (mut x, mut v, h) = ([0.03, -0.02], [0.2, 0.3], 1e-3);
        let start = energy(x, v);
        let slope = |x: [f64; 2], v: [f64; 2]| {
            let mut a = [0.0; 2];
            limb.acceleration(&x, &v, &[0.0; 2], &mut a);
            a
        };
        let add = |a: [f64; 2], b: [f64; 2], s: f64| [a[0] + s * b[0], a[1] + s * b[1]];
        for _ in 0..1000 {
            let (k1, a1) = (v, slope(x, v));
            let (k2, a2) = (add(v, a1, h / 2.0), slope(add(x, k1, h / 2.0), add(v, a1, h / 2.0)));
            let (k3, a3) = (add(v, a2, h / 2.0), slope(add(x, k2, h / 2.0), add(v, a2, h / 2.0)));
            let (k4, a4) = (add(v, a3, h), slope(add(x, k3, h), add(v, a3, h)));
            for i in 0..2 {
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                v[i] += h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
            }
        }
        // Runge-Kutta of order 4 at ω h ≈ 0.025 drifts by about (ωh)⁵/72 a step, 1e-7 over 1000 steps.
        assert!((energy(x, v) / start - 1.0).abs() < 1e-7, "{} from {start}", energy(x, v));
    }
}
