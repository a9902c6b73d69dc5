//! From the hand to the joints, as a kinematics file says.

use super::result as schema;
use crate::error::AnalysisError;
use crate::file::{KinematicsFile, MeanForce};
use ndarray::Array2;
use ndof_devices::{anatomical_axes, hand_gravity_stiffness};
use ndof_models::{Arm, Fit, InertiaDampingStiffness, InertiaDampingStiffnessModel, Kinematics, KinematicsSd, Projected, Projection};

/// The name that errors give to kinematics without a file of their own.
const WHERE: &str = "[kinematics]";

/// The matrices of `fit` at the joints, as values and as results hold them; `mean_effort` is what the file may call
/// `"measured"`.
///
/// # Errors
/// [`AnalysisError`] if the file makes no sense, or its mechanism does not fit the axes.
pub fn project(
    file: &KinematicsFile,
    model: &InertiaDampingStiffnessModel,
    fit: &Fit,
    mean_effort: &[f64],
) -> Result<(Projected, schema::Joint), AnalysisError> {
    file.check(if file.origin.is_empty() { WHERE } else { &file.origin })?;
    let (projection, posture_rad, weight) = if file.kind == "wrist" { wrist(file)? } else { (projection(mean_effort, file)?, None, None) };
    let projected = match &weight {
        Some(weight) => projection.fit_to_joints(model, &weight.taken_off(model, fit))?,
        None => projection.fit_to_joints(model, fit)?,
    };
    let own: Vec<String> = projected.matrices.axes.iter().map(|axis| axis.name.clone()).collect();
    let usual = || if weight.is_some() { WRIST.map(str::to_owned).to_vec() } else { own.clone() };
    let joints = file.joints.clone().unwrap_or_else(usual);
    if joints.len() != own.len() {
        return Err(wrong(file)(format!("{} names of joints for {} joints; give one each", joints.len(), own.len())));
    }
    let geometric = match &weight {
        Some(weight) => -projection.kinematics.jacobian().t().dot(&weight.stiffness).dot(&projection.kinematics.jacobian()),
        None => projection.kinematics.geometric_stiffness(&projection.mean_force_n),
    };
    let InertiaDampingStiffness { inertia, damping, stiffness, .. } = &projected.matrices;
    let joint = schema::Joint {
        parameters: projected.parameters.iter().map(|p| renamed(p.into(), &own, &joints)).collect(),
        axes: joints,
        M: inertia.clone().into(),
        B: damping.clone().into(),
        K: stiffness.clone().into(),
        std_error: projected.std_error.clone().into(),
        posture_rad: posture_rad.unwrap_or_else(|| projected.posture_rad.clone()),
        jacobian: projected.jacobian.clone().into(),
        geometric_stiffness: geometric.into(),
        mean_force_n: projection.mean_force_n.clone(),
    };
    Ok((projected, joint))
}

/// The joints of a wrist, in the order of the robot's axes.
const WRIST: [&str; 3] = ["pronation", "flexion", "abduction"];

/// A parameter `K_q1_q2` with the joints' own names.
fn renamed(mut parameter: schema::Parameter, old: &[String], new: &[String]) -> schema::Parameter {
    let word = |word: &str| old.iter().position(|o| o == word).map_or_else(|| word.to_owned(), |k| new[k].clone());
    parameter.name = parameter.name.split('_').map(word).collect::<Vec<_>>().join("_");
    parameter.site.axis = parameter.site.axis.split(',').map(word).collect::<Vec<_>>().join(",");
    parameter
}

/// What the weight of a hand adds to the measured stiffness, and how well that is known.
struct Weight {
    stiffness: Array2<f64>,
    /// Changes by one standard deviation of each uncertain quantity.
    changes: Vec<Array2<f64>>,
}

impl Weight {
    /// The fit without it: its share taken from K, its uncertainty added to the covariance.
    fn taken_off(&self, model: &InertiaDampingStiffnessModel, fit: &Fit) -> Fit {
        let mut bare = fit.clone();
        let entries = model.entries();
        let first = 2 * entries.len();
        for (k, &(i, j)) in entries.iter().enumerate() {
            bare.theta[first + k] -= self.stiffness[[i, j]];
            for (l, &(r, s)) in entries.iter().enumerate() {
                bare.covariance[[first + k, first + l]] += self.changes.iter().map(|change| change[[i, j]] * change[[r, s]]).sum::<f64>();
            }
        }
        bare
    }
}

/// A projection with joint angles and weight, where it has them.
type Placed = (Projection, Option<Vec<f64>>, Option<Weight>);

/// A wrist in its robot: the Jacobian to the anatomical axes, and the hand's weight.
fn wrist(file: &KinematicsFile) -> Result<Placed, AnalysisError> {
    let device: [f64; 3] = match file.posture_rad.as_deref() {
        None => [0.0; 3],
        Some(list) => list.try_into().map_err(|_| wrong(file)(format!("posture_rad has {} numbers; a wrist has 3", list.len())))?,
    };
    let gravity = file.gravity_m_per_s2.unwrap_or([0.0, 0.0, -9.81]);
    let (angles, jacobian) = anatomical_axes(device, file.misalignment_rpy_rad)?;
    let stiffness = |mass: f64, centre: [f64; 3]| hand_gravity_stiffness(mass, centre, gravity, device);
    let (mass, centre) = (file.hand_mass_kg, file.hand_centre_m);
    // Linear in the mass and in each coordinate of the centre.
    let mut changes = vec![stiffness(file.sd.hand_mass_kg, centre)];
    changes.extend((0..3).map(|k| stiffness(mass, std::array::from_fn(|j| if j == k { file.sd.hand_centre_m } else { 0.0 }))));
    let projection = Projection { kinematics: Kinematics::Jacobian { matrix: jacobian }, mean_force_n: vec![0.0; 3], sd: KinematicsSd::default() };
    Ok((projection, Some(angles.to_vec()), Some(Weight { stiffness: stiffness(mass, centre), changes })))
}

/// What is wrong with the kinematics, in the name of their file.
fn wrong(file: &KinematicsFile) -> impl Fn(String) -> AnalysisError {
    let name = if file.origin.is_empty() { WHERE } else { &file.origin };
    move |what| AnalysisError::Meaning { file: name.to_owned(), what }
}

/// What the file says, with the mean force measured where it asks for that.
pub(crate) fn projection(mean_effort: &[f64], file: &KinematicsFile) -> Result<Projection, AnalysisError> {
    let wrong = wrong(file);
    let kinematics = kinematics(file)?;
    let mean_force_n = match &file.mean_force_n {
        Some(MeanForce::Known(force)) => force.clone(),
        Some(MeanForce::Word(word)) if word == "measured" && mean_effort.is_empty() => {
            return Err(wrong("mean_force_n = \"measured\" needs recordings, and this is a response, which holds no mean force; write newtons".to_owned()));
        }
        Some(MeanForce::Word(word)) if word == "measured" => mean_effort.to_vec(),
        Some(MeanForce::Word(word)) => return Err(wrong(format!("mean_force_n = \"{word}\"; write newtons, such as [0.0, 0.0], or \"measured\""))),
        None => vec![0.0; kinematics.jacobian().nrows()],
    };
    let sd = KinematicsSd { link_lengths_m: file.sd.link_lengths_m, posture_rad: file.sd.posture_rad, mean_force_n: file.sd.mean_force_n };
    Ok(Projection { kinematics, mean_force_n, sd })
}

fn kinematics(file: &KinematicsFile) -> Result<Kinematics, AnalysisError> {
    let wrong = wrong(file);
    let possible = |kinematics: Result<Kinematics, ndof_models::KinematicsError>| kinematics.map_err(|error| wrong(error.to_string()));
    let two = |what: &str, list: &Option<Vec<f64>>| -> Result<[f64; 2], AnalysisError> {
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
            match (&file.posture_rad, &file.shoulder_m) {
                (Some(_), _) => possible(Kinematics::planar_two_link(arm, lengths, two("posture_rad", &file.posture_rad)?)),
                (None, Some(_)) => possible(Kinematics::planar_two_link_at(arm, lengths, two("shoulder_m", &file.shoulder_m)?, two("hand_m", &file.hand_m)?)),
                (None, None) => Err(wrong("the posture is missing; give posture_rad = [...], or shoulder_m = [...] with hand_m = [...]".to_owned())),
            }
        }
        "jacobian" => {
            let matrix = file.matrix.as_ref().ok_or_else(|| wrong("matrix is missing; give the Jacobian, one row an endpoint axis".to_owned()))?;
            let columns = matrix.first().map_or(0, Vec::len);
            let flat: Vec<f64> = matrix.iter().flatten().copied().collect();
            let matrix = Array2::from_shape_vec((matrix.len(), columns), flat).map_err(|_| wrong("matrix has rows of different lengths".to_owned()))?;
            Ok(Kinematics::Jacobian { matrix })
        }
        other => Err(wrong(format!("kind = \"{other}\"; write \"planar-two-link\", \"wrist\" or \"jacobian\""))),
    }
}
