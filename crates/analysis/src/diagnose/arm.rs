//! The arm whose geometry a diagnosis weighs.

use crate::error::AnalysisError;
use crate::file::{KinematicsFile, MeanForce};
use crate::fit::projection;
use crate::trials::Trials;
use ndof_diagnose::KnownArm;
use ndof_models::Kinematics;
use ndof_models::effects::CurvedArm;
use ndof_signal::Quantity;

/// The arm that a file describes, its hand at the mean of the displacements: where the file says, or, where recordings follow a schedule and the
/// shoulder is known, where they say.
pub(super) fn known_arm(file: &KinematicsFile, trials: &Trials, moves: bool) -> Result<KnownArm, AnalysisError> {
    let name = if file.origin.is_empty() { "`kinematics`" } else { &file.origin };
    let wrong = |what: String| AnalysisError::Meaning { file: name.to_owned(), what };
    file.check(name)?;
    if file.kind != "planar-two-link" {
        return Err(wrong(format!("kind = \"{}\": a diagnosis follows the curve of an arm of kind \"planar-two-link\"; leave the kinematics out", file.kind)));
    }
    let ports = &trials.roles.ports;
    let channels = trials.trials.first().map_or(&[][..], |trial| trial.recording.channels());
    let turning = ports.outputs.iter().any(|k| channels[*k].unit.is_rotational());
    if (ports.inputs.len(), ports.outputs.len()) != (2, 2) || turning {
        let (inputs, outputs) = (trials.names(&ports.inputs), trials.names(&ports.outputs));
        return Err(wrong(format!("a planar arm has two forces and two displacements at the hand; here are {} and {}", inputs.join(", "), outputs.join(", "))));
    }
    let series = |port: usize| trials.trials.iter().map(move |trial| trial.recording.channels()[port].samples.as_slice());
    let mean = |port: usize| series(port).flatten().sum::<f64>() / series(port).flatten().count().max(1) as f64;
    let outputs = [ports.outputs[0], ports.outputs[1]];
    let centre = outputs.map(mean);
    let displaced = outputs.iter().all(|k| channels[*k].unit.quantity() == Quantity::Displacement);
    let placed = match (&file.shoulder_m, moves && displaced) {
        (Some(_), true) => KinematicsFile { posture_rad: None, hand_m: Some(centre.to_vec()), ..file.clone() },
        _ => file.clone(),
    };
    let found = projection(&ports.inputs.iter().map(|port| mean(*port)).collect::<Vec<_>>(), &placed)?;
    let Kinematics::PlanarTwoLink { link_lengths_m, posture_rad } = found.kinematics else { return Err(wrong("it has no joint angles".to_owned())) };
    let curved = CurvedArm { link_lengths_m, posture_rad, mean_force_n: [0.0; 2] };
    let out_of_reach = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| [x - centre[0], y - centre[1]]).find(|d| curved.displaced(*d).is_none());
    if displaced && let Some([x, y]) = series(outputs[0]).zip(series(outputs[1])).find_map(|(x, y)| out_of_reach(x, y)) {
        return Err(wrong(format!(
            "the hand goes {:.0} mm along the first and {:.0} mm along the second axis from its mean, where an arm of {} and {} m with its elbow at {:.2} rad cannot take it; check lengths and posture",
            1e3 * x,
            1e3 * y,
            link_lengths_m[0],
            link_lengths_m[1],
            posture_rad[1]
        )));
    }
    // What is measured is the mean of what is fitted, which the search knows.
    let measured = matches!(&file.mean_force_n, Some(MeanForce::Word(_)));
    let mean_force_n = <[f64; 2]>::try_from(found.mean_force_n).map_err(|_| wrong("mean_force_n is a force in the plane: two numbers".to_owned()))?;
    Ok(KnownArm { link_lengths_m, posture_rad, mean_force_n: (!measured).then_some(mean_force_n) })
}
