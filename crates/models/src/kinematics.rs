//! How joints move the hand.

use crate::Axis;
use ndarray::{Array2, arr2};
use serde::{Deserialize, Serialize};

/// Which arm: the elbow flexes counter-clockwise (φ₂ > 0) on the right, clockwise on the left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arm {
    /// φ₂ > 0.
    #[default]
    Right,
    /// φ₂ < 0.
    Left,
}

/// Kinematics at one posture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Kinematics {
    /// Upper arm and forearm in a plane: φ₁ of the upper arm from +x, φ₂ of the forearm from the upper arm.
    PlanarTwoLink {
        /// l₁ and l₂ (m).
        link_lengths_m: [f64; 2],
        /// φ₁ and φ₂ (rad).
        posture_rad: [f64; 2],
    },
    /// Any mechanism whose Jacobian does not change within the motion.
    Jacobian {
        /// ∂f/∂q: endpoint axes × joints.
        matrix: Array2<f64>,
    },
}

/// Why kinematics cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum KinematicsError {
    /// A length that is none.
    #[error("link {link} has length {length_m} m; lengths are positive")]
    Length {
        /// 1 or 2.
        link: usize,
        length_m: f64,
    },
    /// The hand is where the arm cannot take it.
    #[error("the hand is {distance_m:.3} m from the shoulder, links of {} and {} m reach from {:.3} to {:.3} m; check lengths and positions", lengths_m[0], lengths_m[1], (lengths_m[0] - lengths_m[1]).abs(), lengths_m[0] + lengths_m[1])]
    OutOfReach { distance_m: f64, lengths_m: [f64; 2] },
    /// Angles on the wrong side for this arm.
    #[error("elbow angle {elbow_rad} rad is that of the other arm: φ₂ is positive on a right arm, negative on a left one")]
    WrongArm { elbow_rad: f64 },
}

impl Kinematics {
    /// A planar arm with known joint angles.
    ///
    /// # Errors
    /// [`KinematicsError`] if a length is not positive or the elbow bends the other way.
    pub fn planar_two_link(arm: Arm, link_lengths_m: [f64; 2], posture_rad: [f64; 2]) -> Result<Self, KinematicsError> {
        check_lengths(link_lengths_m)?;
        let elbow_rad = posture_rad[1];
        let right = arm == Arm::Right;
        if (right && elbow_rad < 0.0) || (!right && elbow_rad > 0.0) {
            return Err(KinematicsError::WrongArm { elbow_rad });
        }
        Ok(Kinematics::PlanarTwoLink { link_lengths_m, posture_rad })
    }

    /// A planar arm with known positions of shoulder and hand (m), by [`planar_angles`].
    ///
    /// # Errors
    /// [`KinematicsError`] if a length is not positive or the hand is out of reach.
    pub fn planar_two_link_at(arm: Arm, link_lengths_m: [f64; 2], shoulder_m: [f64; 2], hand_m: [f64; 2]) -> Result<Self, KinematicsError> {
        check_lengths(link_lengths_m)?;
        let seen = [0, 1].map(|k| hand_m[k] - shoulder_m[k]);
        let out_of_reach = KinematicsError::OutOfReach { distance_m: seen[0].hypot(seen[1]), lengths_m: link_lengths_m };
        let posture_rad = planar_angles(link_lengths_m, if arm == Arm::Right { 1.0 } else { -1.0 }, seen).ok_or(out_of_reach)?;
        Ok(Kinematics::PlanarTwoLink { link_lengths_m, posture_rad })
    }

    /// The joints: `shoulder` and `elbow`, or `q1`, `q2` …
    pub fn joints(&self) -> Vec<Axis> {
        match self {
            Kinematics::PlanarTwoLink { .. } => vec![Axis::rotational("shoulder"), Axis::rotational("elbow")],
            Kinematics::Jacobian { matrix } => (1..=matrix.ncols()).map(|k| Axis::rotational(&format!("q{k}"))).collect(),
        }
    }

    /// Joint angles, where the kinematics know them.
    pub fn posture_rad(&self) -> Vec<f64> {
        match self {
            Kinematics::PlanarTwoLink { posture_rad, .. } => posture_rad.to_vec(),
            Kinematics::Jacobian { .. } => Vec::new(),
        }
    }

    /// J = ∂f/∂q, endpoint axes × joints.
    pub fn jacobian(&self) -> Array2<f64> {
        match self {
            Kinematics::PlanarTwoLink { .. } => arr2(&planar_jacobian(self.links())),
            Kinematics::Jacobian { matrix } => matrix.clone(),
        }
    }

    /// J̇ = dJ/dt at the given joint rates (rad/s).
    pub fn jacobian_rate(&self, rate_rad_per_s: &[f64]) -> Array2<f64> {
        match (self, rate_rad_per_s) {
            (Kinematics::PlanarTwoLink { .. }, &[first, second]) => {
                let [[x1, y1], [x2, y2]] = self.links();
                let both = first + second;
                arr2(&[[-x1 * first - x2 * both, -x2 * both], [-y1 * first - y2 * both, -y2 * both]])
            }
            _ => Array2::zeros(self.jacobian().dim()),
        }
    }

    /// Γ_ij = Σ_k F_k ∂²f_k/∂q_i∂q_j for a mean force F **on** the hand: what turning the Jacobian adds to the joints'
    /// stiffness. Zero where the Jacobian is constant.
    pub fn geometric_stiffness(&self, mean_force_n: &[f64]) -> Array2<f64> {
        match (self, mean_force_n) {
            (Kinematics::PlanarTwoLink { .. }, &[fx, fy]) => {
                let [[x1, y1], [x2, y2]] = self.links();
                let (first, second) = (fx * x1 + fy * y1, fx * x2 + fy * y2);
                arr2(&[[-first - second, -second], [-second, -second]])
            }
            _ => Array2::zeros((self.jacobian().ncols(), self.jacobian().ncols())),
        }
    }

    /// Both links as vectors.
    fn links(&self) -> [[f64; 2]; 2] {
        match self {
            Kinematics::PlanarTwoLink { link_lengths_m, posture_rad } => planar_links(*link_lengths_m, *posture_rad),
            Kinematics::Jacobian { .. } => [[0.0; 2]; 2],
        }
    }
}

/// Upper arm and forearm of a planar arm as vectors (m), by lengths (m) and angles of shoulder and elbow (rad). The hand is their sum.
///
/// ```
/// assert_eq!(ndof_models::planar_links([0.3, 0.4], [0.0, 0.0]), [[0.3, 0.0], [0.4, 0.0]]);
/// ```
pub fn planar_links([l1, l2]: [f64; 2], [shoulder, elbow]: [f64; 2]) -> [[f64; 2]; 2] {
    let ((s1, c1), (s2, c2)) = (shoulder.sin_cos(), (shoulder + elbow).sin_cos());
    [[l1 * c1, l1 * s1], [l2 * c2, l2 * s2]]
}

/// J, hand by angles, of the [links](planar_links) of a planar arm.
///
/// ```
/// assert_eq!(ndof_models::planar_jacobian([[0.3, 0.0], [0.4, 0.0]]), [[0.0, 0.0], [0.7, 0.4]]);
/// ```
pub fn planar_jacobian([[x1, y1], [x2, y2]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[-y1 - y2, -y2], [x1 + x2, x2]]
}

/// Angles of shoulder and elbow (rad) that have the hand at r, seen from the shoulder (m); `side` is the elbow's sign, 1 or −1:
///
/// cos φ₂ = (r² − l₁² − l₂²)/(2 l₁ l₂),  φ₁ = ∠r − atan2(l₂ sin φ₂, l₁ + l₂ cos φ₂)
///
/// Nothing where the hand is out of reach, or the elbow straight or folded.
///
/// ```
/// assert_eq!(ndof_models::planar_angles([0.3, 0.4], 1.0, [0.0, 0.8]), None);
/// ```
pub fn planar_angles([l1, l2]: [f64; 2], side: f64, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
    if cosine.is_nan() || cosine.abs() >= 1.0 {
        return None;
    }
    let elbow = side * cosine.acos();
    Some([y.atan2(x) - (l2 * elbow.sin()).atan2(l1 + l2 * cosine), elbow])
}

fn check_lengths(lengths: [f64; 2]) -> Result<(), KinematicsError> {
    match lengths.iter().position(|l| !(l.is_finite() && *l > 0.0)) {
        Some(link) => Err(KinematicsError::Length { link: link + 1, length_m: lengths[link] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTHS: [f64; 2] = [0.33, 0.34];

    fn hand(q: [f64; 2]) -> [f64; 2] {
        [0, 1].map(
            |k| if k == 0 { LENGTHS[0] * q[0].cos() + LENGTHS[1] * (q[0] + q[1]).cos() } else { LENGTHS[0] * q[0].sin() + LENGTHS[1] * (q[0] + q[1]).sin() },
        )
    }

    #[test]
    fn posture_and_hand_are_inverse_to_each_other_on_both_arms() {
        for (arm, posture) in [(Arm::Right, [0.8, 1.5]), (Arm::Left, [2.2, -1.1]), (Arm::Right, [-2.5, 0.4])] {
            let own = hand(posture);
            let found = Kinematics::planar_two_link_at(arm, LENGTHS, [0.1, -0.4], [own[0] + 0.1, own[1] - 0.4]).expect("in reach");
            let angle = |d: f64| d.sin().hypot(1.0 - d.cos());
            assert!(found.posture_rad().iter().zip(posture).all(|(a, b)| angle(a - b) < 1e-12), "{found:?}");
        }
    }

    #[test]
    fn jacobian_and_its_derivatives_are_those_of_the_hand() {
        let at = |q: [f64; 2]| Kinematics::planar_two_link(Arm::Right, LENGTHS, q).expect("valid");
        let (q, h) = ([0.7, 1.4], 1e-5);
        let (jacobian, force, rate) = (at(q).jacobian(), [3.0, -5.0], [0.6, -0.9]);
        let shifted = |j: usize, by: f64| [q[0] + if j == 0 { by } else { 0.0 }, q[1] + if j == 1 { by } else { 0.0 }];
        let mut moved = Array2::<f64>::zeros((2, 2));
        for j in 0..2 {
            let (up, down) = (shifted(j, h), shifted(j, -h));
            let slope = (at(up).jacobian() - at(down).jacobian()) / (2.0 * h);
            moved = moved + &slope * rate[j];
            for i in 0..2 {
                assert!((jacobian[[i, j]] - (hand(up)[i] - hand(down)[i]) / (2.0 * h)).abs() < 1e-9);
                let geometric = slope[[0, i]] * force[0] + slope[[1, i]] * force[1];
                assert!((at(q).geometric_stiffness(&force)[[i, j]] - geometric).abs() < 1e-8);
            }
        }
        assert!((at(q).jacobian_rate(&rate) - moved).iter().all(|v| v.abs() < 1e-8));
    }

    #[test]
    fn impossible_arms_are_refused_with_the_reason() {
        assert!(matches!(Kinematics::planar_two_link_at(Arm::Right, LENGTHS, [0.0; 2], [0.7, 0.0]), Err(KinematicsError::OutOfReach { .. })));
        assert!(matches!(Kinematics::planar_two_link(Arm::Left, LENGTHS, [0.1, 0.5]), Err(KinematicsError::WrongArm { .. })));
        assert!(matches!(Kinematics::planar_two_link(Arm::Left, [0.3, 0.0], [0.1, -0.5]), Err(KinematicsError::Length { link: 2, .. })));
    }
}
