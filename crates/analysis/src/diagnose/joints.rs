//! A robot's joints, judged by its file.

use super::result::DiagnosisResult;
use super::{AddedEffort, Diagnose, Diagnosed};
use crate::error::AnalysisError;
use crate::result::Head;
use crate::trials::{Trial, Trials, axis_of};
use ndof_devices::RobotConfig;
use ndof_diagnose::UNSURE;
use ndof_models::robot::Robot;
use ndof_signal::{Amplitudes, Channel, Quantity, Recording, Warning};
use ndof_sysid::Ports;

/// What only spectra suffer from; and an encoder that stands still at a turn is not clipped.
const OF_SPECTRA: [&str; 3] = ["inputs-together", "unsteady-input", "rest"];

/// What the file of a robot, or a simulator that logged the same commands, gets wrong in these joint logs.
pub(super) fn diagnose(
    trials: &Trials,
    simulated: Option<&Trials>,
    robot: &RobotConfig,
    settings: &Diagnose,
    progress: &mut dyn FnMut(&str),
) -> Result<Diagnosed, AnalysisError> {
    let options = settings.of_joints(trials)?;
    let chain = robot.chain()?;
    let (ports, warning) = by_joint(&trials.roles.ports, &trials.trials[0].recording, &chain.joints().names);
    let names = [trials.names(&ports.inputs), trials.names(&ports.outputs)].concat();
    let [measured, simulated] = [of_channels(trials, &names)?, simulated.map_or(Ok(vec![]), |own| of_channels(own, &names))?];
    let own = Ports { references: vec![], inputs: (0..ports.inputs.len()).collect(), outputs: (ports.inputs.len()..names.len()).collect() };
    let (mut diagnosis, mut pictures) = ndof_joints::diagnose(&chain, &measured, &simulated, &own, &options, progress)?;
    let beside = moving_beside(trials, (&robot.held, options.tolerance), &ports);
    if beside.is_some() {
        diagnosis.causes.iter_mut().for_each(|cause| cause.believe_at_most(UNSURE));
    }
    let efforts = trials.names(&ports.inputs);
    let added = AddedEffort::new(trials, settings, efforts, trials.sample_rate_hz(), std::mem::take(&mut pictures.added))?;
    let corrections = ndof_joints::corrections(&chain, &measured, &own, &diagnosis, &options)?;
    let angles = trials.names(&ports.outputs);
    let concerns_others = |w: &Warning| OF_SPECTRA.contains(&w.code.as_str()) || w.code == "clipped" && angles.iter().any(|a| w.message.contains(a));
    let warnings = trials.warnings.iter().filter(|w| !concerns_others(w)).cloned().chain(warning);
    let warnings = warnings.chain(robot.notes.iter().map(of_file)).chain(beside).collect();
    let result = DiagnosisResult {
        head: Head::new(DiagnosisResult::SCHEMA, "diagnose", warnings),
        settings: settings.recorded(),
        inputs: trials.names(&ports.outputs),
        outputs: trials.names(&ports.inputs),
        diagnosis,
    };
    Ok(Diagnosed { trials: trials.clone(), result, pictures, corrections: Some(corrections), added })
}

/// What the robot's file has and is not read as it stands.
fn of_file(note: &String) -> Warning {
    Warning::new("robot-file", note, "look whether it is so, or choose the end of the chain with `tip`")
}

/// Says that joints which are taken as held still move in the log, by as much as matters beside what the chain's joints do.
fn moving_beside(trials: &Trials, (held, tolerance): (&[String], f64), ports: &Ports) -> Option<Warning> {
    let spread = |concerns: &dyn Fn(&Channel) -> bool| {
        let channels = trials.trials.iter().flat_map(|trial| trial.recording.channels());
        channels.filter(|channel| concerns(channel)).map(|channel| Amplitudes::of(&channel.samples).std).fold(0.0, f64::max)
    };
    let angles = trials.names(&ports.outputs);
    let widest = spread(&|channel| angles.contains(&channel.name));
    let of = |joint: &str, channel: &Channel| {
        channel.unit.quantity() == Quantity::Displacement && !angles.contains(&channel.name) && (axis_of(&channel.name) == joint || tells(&channel.name, joint))
    };
    let moving: Vec<&str> = held.iter().filter(|joint| spread(&|channel| of(joint, channel)) > tolerance * widest).map(String::as_str).collect();
    let them = moving.join(", ");
    (!moving.is_empty()).then(|| {
        let message =
            format!("{them}: taken as held still, and moving in the log: what hangs there pulls at the joints before it, and no name is surer than {UNSURE}");
        Warning::new("moves-beside", message, "record with it at rest, or judge a file that ends before it branches")
    })
}

/// That these are the torques and angles of several joints, which are judged by a robot's file where there is one.
pub(super) fn no_robot(trials: &Trials) -> Option<Warning> {
    let recording = &trials.trials[0].recording;
    let joints =
        |channels: &[usize], prefix: &str| -> Option<Vec<&str>> { channels.iter().map(|c| recording.channels()[*c].name.strip_prefix(prefix)).collect() };
    let [torques, angles] = [joints(&trials.roles.ports.inputs, "torque_")?, joints(&trials.roles.ports.outputs, "angle_")?];
    let message = || format!("torques and angles of the joints {}, and no robot: joints are taken as axes of a limb about one posture", torques.join(", "));
    (torques.len() > 1 && torques == angles).then(|| Warning::new("no-robot", message(), "give the robot's URDF, MJCF or TOML with `robot`"))
}

/// Recordings of these channels alone, in this order.
pub(super) fn of_channels(trials: &Trials, names: &[String]) -> Result<Vec<Recording>, AnalysisError> {
    let one = |trial: &Trial| -> Result<Recording, AnalysisError> {
        let own = &trial.recording;
        let channels = names.iter().map(|name| own.channel(name).cloned()).collect::<Result<_, _>>();
        let recording = channels.and_then(|channels| own.with_channels(channels));
        recording.map_err(|why| AnalysisError::Meaning { file: trial.file.clone(), what: format!("{why}; what was measured has it") })
    };
    trials.trials.iter().map(one).collect()
}

/// Whether a channel's name has that of a joint in it, as in `j1_effort` or `/joint_states/j1/position`.
fn tells(channel: &str, joint: &str) -> bool {
    let part = |c: char| !c.is_alphanumeric() && c != '_';
    channel.split(part).any(|word| {
        word == joint || word.strip_prefix(joint).is_some_and(|rest| rest.starts_with('_')) || word.strip_suffix(joint).is_some_and(|rest| rest.ends_with('_'))
    })
}

/// Torques and angles in the order of the robot's joints: by their names where these are the joints', else as they stand, with a warning.
fn by_joint(ports: &Ports, recording: &Recording, joints: &[String]) -> (Ports, Option<Warning>) {
    let name = |channel: &usize| recording.channels()[*channel].name.as_str();
    let ordered = |channels: &[usize]| -> Option<Vec<usize>> {
        let of = |joint: &String| {
            let named = channels.iter().copied().find(|c| axis_of(name(c)) == joint);
            let mut telling = channels.iter().copied().filter(|c| tells(name(c), joint));
            named.or_else(|| telling.next().filter(|_| telling.next().is_none()))
        };
        joints.iter().map(of).collect()
    };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_tells_its_joint_by_a_whole_word() {
        for channel in ["j1_effort", "effort_j1", "/joint_states/j1/position", "j1"] {
            assert!(tells(channel, "j1") && !tells(channel, "j"), "{channel}");
        }
        assert!(!tells("j10_effort", "j1") && !tells("myj1", "j1") && tells("left_arm_q", "left_arm"));
    }
}
