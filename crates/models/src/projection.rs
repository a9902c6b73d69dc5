//! Impedance at the hand and at the joints.

use crate::{Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, Parameter, ParametricModel};
use ndarray::Array2;
use ndof_linear::singular_values;
use serde::{Deserialize, Serialize};

/// Standard deviations of what the projection takes as known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KinematicsSd {
    /// Of each link's length.
    pub link_lengths_m: f64,
    /// Of each joint angle.
    pub posture_rad: f64,
    /// Of each component of the mean force.
    pub mean_force_n: f64,
}

/// A posture with the mean force on the hand.
///
/// D_q(s) = Jᵀ D_x(s) J + Γ, the geometric term Γ from the mean force: without it a push of 10 N is taken for joint
/// stiffness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// The mechanism at its posture.
    pub kinematics: Kinematics,
    /// Mean force on the hand, one an endpoint axis.
    pub mean_force_n: Vec<f64>,
    /// How well all that is known.
    pub sd: KinematicsSd,
}

/// Matrices in other coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Projected {
    /// M, B and K there.
    pub matrices: InertiaDampingStiffness,
    /// Standard errors of their entries.
    pub std_error: InertiaDampingStiffness,
    /// The model whose parameters they are.
    pub model: InertiaDampingStiffnessModel,
    /// Parameters in the model's order, with their intervals.
    pub parameters: Vec<crate::Parameter>,
    /// Covariance of the parameters.
    pub covariance: Array2<f64>,
    /// J at the posture.
    pub jacobian: Array2<f64>,
    /// Joint angles, where the kinematics know them.
    pub posture_rad: Vec<f64>,
}

/// Why impedance cannot be projected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum ProjectionError {
    /// Jacobian and impedance differ in size.
    #[error(
        "the Jacobian has {rows} endpoint axes and {columns} joints, the impedance {axes} axes; give one row for each endpoint axis and one column for each joint"
    )]
    Shape { rows: usize, columns: usize, axes: usize },
    /// More joints than the endpoint can tell apart.
    #[error("{joints} joints move {axes} endpoint axes: many joint impedances give the same impedance at the endpoint; fix joints or measure more axes")]
    Redundant { joints: usize, axes: usize },
    /// Joints move the endpoint in fewer directions than there are axes.
    #[error("the Jacobian's condition number is {condition:.3e} (limit {limit:.0e}): the posture is singular, as a stretched arm is; bend the elbow")]
    Singular {
        /// Largest over smallest singular value.
        condition: f64,
        limit: f64,
    },
    /// The mean force has another number of components than the endpoint has axes.
    #[error("{found} components of mean force, the endpoint has {axes} axes")]
    MeanForce { found: usize, axes: usize },
}

/// Above this condition an error of a percent in geometry or data is an error as large as the result.
pub const LARGEST_JACOBIAN_CONDITION: f64 = 100.0;

impl Projection {
    /// M, B, K of a fit at the hand, taken to the joints: X_q = Jᵀ X_x J, K_q with Γ added. The covariance holds that of
    /// the fit and that of lengths, posture and mean force.
    ///
    /// # Errors
    /// [`ProjectionError`] if sizes differ, joints are redundant or the posture is singular.
    pub fn fit_to_joints(&self, model: &InertiaDampingStiffnessModel, fit: &Fit) -> Result<Projected, ProjectionError> {
        self.project(model, &fit.theta, &fit.covariance, fit.interval_quantile)
    }

    /// M, B, K at the hand taken to the joints, without covariance.
    ///
    /// # Errors
    /// As [`fit_to_joints`](Self::fit_to_joints).
    pub fn matrices_to_joints(&self, endpoint: &InertiaDampingStiffness) -> Result<InertiaDampingStiffness, ProjectionError> {
        let jacobian = self.checked_jacobian(endpoint.axes.len())?;
        let turn = |x: &Array2<f64>| jacobian.t().dot(x).dot(&jacobian);
        Ok(InertiaDampingStiffness {
            axes: self.kinematics.joints(),
            inertia: turn(&endpoint.inertia),
            damping: turn(&endpoint.damping),
            stiffness: turn(&endpoint.stiffness) + self.kinematics.geometric_stiffness(&self.mean_force_n),
        })
    }

    fn project(&self, model: &InertiaDampingStiffnessModel, theta: &[f64], covariance: &Array2<f64>, quantile: f64) -> Result<Projected, ProjectionError> {
        let target = InertiaDampingStiffnessModel::new(self.kinematics.joints(), model.symmetry());
        let at = |theta: &[f64], own: &Projection| own.matrices_to_joints(&model.matrices(theta)).map(|m| target.theta(&m));
        let projected = at(theta, self)?;
        let (k, n) = (theta.len(), projected.len());
        // The map is affine in θ, so unit steps are exact.
        let mut slopes = Array2::zeros((n, k));
        for c in 0..k {
            let mut moved = theta.to_vec();
            moved[c] += 1.0;
            at(&moved, self)?.iter().zip(&projected).enumerate().for_each(|(r, (a, b))| slopes[[r, c]] = a - b);
        }
        let undetermined: Vec<bool> = (0..k).map(|c| !covariance[[c, c]].is_finite()).collect();
        let finite = Array2::from_shape_fn((k, k), |(r, c)| if undetermined[r] || undetermined[c] { 0.0 } else { covariance[[r, c]] });
        let mut total = slopes.dot(&finite).dot(&slopes.t());
        for [above, below] in self.uncertain() {
            let change: Vec<f64> = at(theta, &above)?.iter().zip(at(theta, &below)?).map(|(a, b)| 0.5 * (a - b)).collect();
            (0..n).for_each(|r| (0..n).for_each(|c| total[[r, c]] += change[r] * change[c]));
        }
        for r in 0..n {
            if (0..k).any(|c| undetermined[c] && slopes[[r, c]] != 0.0) {
                total.row_mut(r).fill(0.0);
                total.column_mut(r).fill(0.0);
                total[[r, r]] = f64::INFINITY;
            }
        }
        let errors: Vec<f64> = (0..n).map(|r| total[[r, r]].sqrt()).collect();
        Ok(Projected {
            matrices: target.matrices(&projected),
            std_error: target.matrices(&errors),
            parameters: Parameter::describe(&target.parameters(), &projected, &total, |_| quantile, &target.scales(&projected)),
            model: target,
            covariance: total,
            jacobian: self.kinematics.jacobian(),
            posture_rad: self.kinematics.posture_rad(),
        })
    }

    fn checked_jacobian(&self, axes: usize) -> Result<Array2<f64>, ProjectionError> {
        let jacobian = self.kinematics.jacobian();
        let (rows, columns) = jacobian.dim();
        if rows != axes || rows == 0 || columns == 0 {
            return Err(ProjectionError::Shape { rows, columns, axes });
        }
        if self.mean_force_n.len() != rows {
            return Err(ProjectionError::MeanForce { found: self.mean_force_n.len(), axes: rows });
        }
        if columns > rows {
            return Err(ProjectionError::Redundant { joints: columns, axes: rows });
        }
        check_condition(&jacobian)?;
        Ok(jacobian)
    }

    /// For each uncertain quantity, the projection one standard deviation above and below.
    fn uncertain(&self) -> Vec<[Projection; 2]> {
        let mut out = Vec::new();
        if matches!(self.kinematics, Kinematics::PlanarTwoLink { .. }) {
            for link in 0..2 {
                out.push([1.0, -1.0].map(|times| self.shifted(link, times * self.sd.link_lengths_m, 0.0)));
                out.push([1.0, -1.0].map(|times| self.shifted(link, 0.0, times * self.sd.posture_rad)));
            }
        }
        for k in 0..self.mean_force_n.len() {
            out.push([1.0, -1.0].map(|times| {
                let mut moved = self.clone();
                moved.mean_force_n[k] += times * self.sd.mean_force_n;
                moved
            }));
        }
        out
    }

    fn shifted(&self, link: usize, length_m: f64, angle_rad: f64) -> Projection {
        let mut moved = self.clone();
        if let Kinematics::PlanarTwoLink { link_lengths_m, posture_rad } = &mut moved.kinematics {
            link_lengths_m[link] += length_m;
            posture_rad[link] += angle_rad;
        }
        moved
    }
}

fn check_condition(jacobian: &Array2<f64>) -> Result<(), ProjectionError> {
    let values = singular_values(jacobian).unwrap_or_default();
    let (largest, smallest) = values.iter().fold((0.0f64, f64::INFINITY), |(l, s), v| (l.max(*v), s.min(*v)));
    let condition = largest / smallest;
    if condition <= LARGEST_JACOBIAN_CONDITION { Ok(()) } else { Err(ProjectionError::Singular { condition, limit: LARGEST_JACOBIAN_CONDITION }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared_tests::{arm as hand, difference};
    use crate::{Arm, Axis, Symmetry};
    use ndarray::arr2;

    fn endpoint() -> Vec<Axis> {
        vec![Axis::linear("x"), Axis::linear("y")]
    }

    fn arm(mean_force_n: [f64; 2]) -> Projection {
        let kinematics = Kinematics::planar_two_link(Arm::Right, [0.33, 0.34], [45f64.to_radians(), 90f64.to_radians()]).expect("valid");
        Projection { kinematics, mean_force_n: mean_force_n.to_vec(), sd: KinematicsSd::default() }
    }

    /// The static arm of reference c11: joint torques balance a mean force, and the hand's stiffness is differentiated.
    #[test]
    fn joint_stiffness_is_recovered_from_the_hand_of_an_arm_under_load() {
        let joint = arr2(&[[29.5, 14.3], [14.3, 39.3]]);
        let rest = [45f64.to_radians(), 90f64.to_radians()];
        let load = [8.0, -5.0];
        let at = |q: [f64; 2]| Kinematics::planar_two_link(Arm::Right, [0.33, 0.34], q).expect("valid").jacobian();
        let resting = at(rest).t().dot(&ndarray::arr1(&load));
        let force = |q: [f64; 2]| -> [f64; 2] {
            let torque = &resting + &joint.dot(&ndarray::arr1(&[q[0] - rest[0], q[1] - rest[1]]));
            let j = at(q);
            let determinant = j[[0, 0]] * j[[1, 1]] - j[[0, 1]] * j[[1, 0]];
            [(j[[1, 1]] * torque[0] - j[[1, 0]] * torque[1]) / determinant, (-j[[0, 1]] * torque[0] + j[[0, 0]] * torque[1]) / determinant]
        };
        let slope = Array2::from_shape_fn((2, 2), |(i, j)| difference(&rest, j, 1e-5, |q| force([q[0], q[1]]).to_vec())[i]);
        let j = at(rest);
        let determinant = j[[0, 0]] * j[[1, 1]] - j[[0, 1]] * j[[1, 0]];
        let inverse = arr2(&[[j[[1, 1]], -j[[0, 1]]], [-j[[1, 0]], j[[0, 0]]]]) / determinant;
        let hand = InertiaDampingStiffness { axes: endpoint(), inertia: Array2::eye(2), damping: Array2::eye(2), stiffness: slope.dot(&inverse) };
        let with = arm(load).matrices_to_joints(&hand).expect("regular").stiffness;
        assert!((&with - &joint).iter().all(|d| d.abs() < 1e-5), "{with}");
        let without = arm([0.0; 2]).matrices_to_joints(&hand).expect("regular").stiffness;
        assert!((without[[0, 0]] - 27.1).abs() < 0.05 && (without[[0, 1]] - 11.2).abs() < 0.05 && (without[[1, 1]] - 36.2).abs() < 0.05, "{without}");
    }

    #[test]
    fn a_third_joint_cannot_be_read_from_the_hand() {
        let jacobian = arr2(&[[0.3, 0.1, 0.05], [0.2, 0.4, 0.1]]);
        let own = Projection { kinematics: Kinematics::Jacobian { matrix: jacobian }, mean_force_n: vec![0.0; 2], sd: KinematicsSd::default() };
        assert_eq!(own.matrices_to_joints(&hand()), Err(ProjectionError::Redundant { joints: 3, axes: 2 }));
    }

    #[test]
    fn singular_postures_and_wrong_sizes_are_refused() {
        let mut own = arm([0.0; 2]);
        own.kinematics = Kinematics::planar_two_link(Arm::Right, [0.33, 0.34], [0.5, 0.01]).expect("valid");
        assert!(matches!(own.matrices_to_joints(&hand()), Err(ProjectionError::Singular { .. })));
        let mut forgetful = arm([0.0; 2]);
        forgetful.mean_force_n.pop();
        assert!(matches!(forgetful.matrices_to_joints(&hand()), Err(ProjectionError::MeanForce { found: 1, axes: 2 })));
    }

    #[test]
    fn covariance_follows_the_kronecker_form_and_counts_the_geometry() {
        let model = InertiaDampingStiffnessModel::new(endpoint(), Symmetry::Free);
        let theta = model.theta(&hand());
        let covariance = Array2::from_shape_fn((12, 12), |(r, c)| if r == c { 1.0 + r as f64 } else { 0.1 });
        let mut own = arm([8.0, -5.0]);
        let plain = own.project(&model, &theta, &covariance, 1.96).expect("regular");
        // vec(Jᵀ X J) = (Jᵀ ⊗ Jᵀ) vec X, row by row.
        let j = own.kinematics.jacobian();
        let map = Array2::from_shape_fn((4, 4), |(a, b)| j[[b / 2, a / 2]] * j[[b % 2, a % 2]]);
        let last = |a: &Array2<f64>| Array2::from_shape_fn((4, 4), |(r, c)| a[[8 + r, 8 + c]]);
        let expected = map.dot(&last(&covariance)).dot(&map.t());
        let found = last(&plain.covariance);
        assert!((&found - &expected).iter().all(|d| d.abs() < 1e-9), "{found} {expected}");
        own.sd = KinematicsSd { link_lengths_m: 0.01, posture_rad: 0.05, mean_force_n: 0.5 };
        let uncertain = own.project(&model, &theta, &covariance, 1.96).expect("regular");
        // Γ_22 = −(F · second link): its part of the variance of K_22 is known.
        let second = [0.34 * 135f64.to_radians().cos(), 0.34 * 135f64.to_radians().sin()];
        let from_force = 0.25 * (second[0] * second[0] + second[1] * second[1]);
        assert!(uncertain.covariance[[11, 11]] > plain.covariance[[11, 11]] + from_force);
    }
}
