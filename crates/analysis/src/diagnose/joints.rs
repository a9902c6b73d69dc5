//! A robot's joints, judged by its file.

use super::result::DiagnosisResult;
use super::{Diagnose, Diagnosed};
use crate::error::AnalysisError;
use crate::result::Head;
use crate::trials::{Trials, axis_of};
use ndof_devices::RobotConfig;
use ndof_models::robot::Robot;
use ndof_signal::{Recording, Warning};
use ndof_sysid::Ports;

/// What the file of a robot gets wrong in these joint logs.
pub(super) fn diagnose(trials: &Trials, robot: &RobotConfig, settings: &Diagnose, progress: &mut dyn FnMut(&str)) -> Result<Diagnosed, AnalysisError> {
    let options = settings.of_joints(trials)?;
    let chain = robot.chain()?;
    let recordings: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
    let (ports, warning) = by_joint(&trials.roles.ports, &recordings[0], &chain.joints().names);
    let (diagnosis, pictures) = ndof_joints::diagnose(&chain, &recordings, &ports, &options, progress)?;
    let corrections = ndof_joints::corrections(&chain, &recordings, &ports, &diagnosis)?;
    let warnings = trials.warnings.iter().cloned().chain(warning).collect();
    let result = DiagnosisResult {
        head: Head::new(DiagnosisResult::SCHEMA, "diagnose", warnings),
        settings: settings.recorded(),
        inputs: trials.names(&ports.outputs),
        outputs: trials.names(&ports.inputs),
        diagnosis,
    };
    Ok(Diagnosed { trials: trials.clone(), result, pictures, corrections: Some(corrections) })
}

/// Torques and angles in the order of the robot's joints: by their names where these are the joints', else as they stand, with a warning.
fn by_joint(ports: &Ports, recording: &Recording, joints: &[String]) -> (Ports, Option<Warning>) {
    let name = |channel: &usize| recording.channels()[*channel].name.as_str();
    let ordered =
        |channels: &[usize]| -> Option<Vec<usize>> { joints.iter().map(|joint| channels.iter().copied().find(|c| axis_of(name(c)) == joint)).collect() };
    match (ordered(&ports.inputs), ordered(&ports.outputs)) {
        (Some(inputs), Some(outputs)) => (Ports { references: vec![], inputs, outputs }, None),
        _ => {
            let list = |channels: &[usize]| channels.iter().map(name).collect::<Vec<_>>().join(", ");
            let message = format!(
                "{} and {} do not carry the names of the joints {}; they are taken in this order",
                list(&ports.inputs),
                list(&ports.outputs),
                joints.join(", ")
            );
            let action = "name them torque_JOINT and angle_JOINT, or check the order with `input` and `output`".to_owned();
            (Ports { references: vec![], ..ports.clone() }, Some(Warning::new("paired-by-order", message, action)))
        }
    }
}
