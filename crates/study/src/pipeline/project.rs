//! From the hand to the joints, as a kinematics file says.

use super::fit::{parameter, rows, std_errors};
use crate::error::StudyError;
use crate::file::{KinematicsFile, MeanForce};
use crate::result::fit as schema;
use ndarray::Array2;
use ndof_models::{Arm, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, Projected, Projection};

/// The name that errors give to the kinematics.
const WHERE: &str = "kinematics";

/// The matrices of `fit` at the joints, as values and as results hold them; `mean_effort` is what the file may call
/// `"measured"`.
///
/// # Errors
/// [`StudyError`] if the file makes no sense, or its mechanism does not fit the axes.
pub fn project(file: &KinematicsFile, model: &InertiaDampingStiffnessModel, fit: &Fit, mean_effort: &[f64]) -> Result<(Projected, schema::Joint), StudyError> {
    let projection = projection(mean_effort, file)?;
    let projected = projection.fit_to_joints(model, fit)?;
    let joints = file.joints.clone().unwrap_or_else(|| projected.matrices.axes.iter().map(|axis| axis.name.clone()).collect());
    if joints.len() != projected.matrices.axes.len() {
        return Err(wrong(format!("{} names of joints for {} joints; give one each", joints.len(), projected.matrices.axes.len())));
    }
    let geometric = projection.kinematics.geometric_stiffness(&projection.mean_force_n);
    let InertiaDampingStiffness { inertia, damping, stiffness, .. } = &projected.matrices;
    let joint = schema::Joint {
        axes: joints,
        M: rows(inertia),
        B: rows(damping),
        K: rows(stiffness),
        std_error: std_errors(&projected.std_error),
        parameters: projected.parameters.iter().map(parameter).collect(),
        posture_rad: projected.posture_rad.clone(),
        jacobian: plain(&projected.jacobian),
        geometric_stiffness: plain(&geometric),
        mean_force_n: projection.mean_force_n.clone(),
    };
    Ok((projected, joint))
}

fn plain(matrix: &Array2<f64>) -> Vec<Vec<f64>> {
    matrix.rows().into_iter().map(|row| row.to_vec()).collect()
}

fn wrong(what: String) -> StudyError {
    StudyError::Meaning { file: WHERE.to_owned(), what }
}

/// What the file says, with the mean force measured where it asks for that.
fn projection(mean_effort: &[f64], file: &KinematicsFile) -> Result<Projection, StudyError> {
    file.check(WHERE)?;
    let kinematics = kinematics(file)?;
    let mean_force_n = match &file.mean_force_n {
        Some(MeanForce::Known(force)) => force.clone(),
        Some(MeanForce::Word(word)) if word == "measured" => mean_effort.to_vec(),
        Some(MeanForce::Word(word)) => return Err(wrong(format!("mean_force_n = \"{word}\"; write newtons, such as [0.0, 0.0], or \"measured\""))),
        None => vec![0.0; kinematics.jacobian().nrows()],
    };
    let sd = KinematicsSd { link_lengths_m: file.sd.link_lengths_m, posture_rad: file.sd.posture_rad, mean_force_n: file.sd.mean_force_n };
    Ok(Projection { kinematics, mean_force_n, sd })
}

fn kinematics(file: &KinematicsFile) -> Result<Kinematics, StudyError> {
    let two = |what: &str, list: &Option<Vec<f64>>| -> Result<[f64; 2], StudyError> {
        match list.as_deref() {
            Some(&[a, b]) => Ok([a, b]),
            Some(list) => Err(wrong(format!("{what} has {} numbers; it needs 2", list.len()))),
            None => Err(wrong(format!("{what} is missing; give it as two numbers"))),
        }
    };
    match file.kind.as_str() {
        "planar-two-link" => {
            let arm = match file.arm.as_deref() {
                Some("right") | None => Arm::Right,
                Some("left") => Arm::Left,
                Some(other) => return Err(wrong(format!("arm = \"{other}\"; write \"right\" or \"left\""))),
            };
            let lengths = two("link_lengths_m", &file.link_lengths_m)?;
            Ok(match (&file.posture_rad, &file.shoulder_m) {
                (Some(_), _) => Kinematics::planar_two_link(arm, lengths, two("posture_rad", &file.posture_rad)?)?,
                (None, Some(_)) => Kinematics::planar_two_link_at(arm, lengths, two("shoulder_m", &file.shoulder_m)?, two("hand_m", &file.hand_m)?)?,
                (None, None) => return Err(wrong("the posture is missing; give posture_rad = [...], or shoulder_m = [...] with hand_m = [...]".to_owned())),
            })
        }
        "jacobian" => {
            let matrix = file.matrix.as_ref().ok_or_else(|| wrong("matrix is missing; give the Jacobian, one row an endpoint axis".to_owned()))?;
            let columns = matrix.first().map_or(0, Vec::len);
            let flat: Vec<f64> = matrix.iter().flatten().copied().collect();
            let matrix = Array2::from_shape_vec((matrix.len(), columns), flat).map_err(|_| wrong("matrix has rows of different lengths".to_owned()))?;
            Ok(Kinematics::Jacobian { matrix })
        }
        other => Err(wrong(format!("kind = \"{other}\"; write \"planar-two-link\" or \"jacobian\""))),
    }
}
