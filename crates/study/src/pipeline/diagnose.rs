//! Trials in, diagnosis out.

use super::robot_side::SimulatedRobot;
use crate::error::StudyError;
use crate::file::{BaselineFile, Status};
use crate::result::VERSION;
use crate::result::diagnosis::{DiagnosisResult, SCHEMA};
use crate::trials::Trials;
use ndarray::Array2;
use ndof_devices::{DeviceConfig, Experiment, LimbConfig, Sensors, linearise};
use ndof_diagnose::{Baseline, DiagnoseError, HeldOut, Mechanism, Options, Part, Pictures};
use ndof_signal::{Quantity, Recording};
use ndof_sysid::Ports;

/// What is held out, as a user says it.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum HoldOut {
    /// Of several files the last third, of one the last 30 % of its time.
    #[default]
    Auto,
    /// These files.
    Files(Vec<String>),
    /// This stretch of every file.
    Time(f64, f64),
}

/// How to diagnose.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnoseSettings {
    /// The band that is analysed; found from the data where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// What is held out.
    pub held_out: HoldOut,
    /// Size of a discrepancy that does not matter.
    pub tolerance: f64,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Effects that are not tried.
    pub without: Vec<String>,
    /// Whether the experiment that tells confusable causes apart is looked for by simulating it.
    pub plan: bool,
    /// The simulation that is judged.
    pub baseline: Option<BaselineFile>,
}

impl Default for DiagnoseSettings {
    fn default() -> Self {
        let options = Options::default();
        DiagnoseSettings {
            band_hz: None,
            held_out: HoldOut::Auto,
            tolerance: options.tolerance,
            seed: options.seed,
            without: Vec::new(),
            plan: false,
            baseline: None,
        }
    }
}

/// Says what the baseline gets wrong, and why.
///
/// # Errors
/// [`StudyError`] if the channels do not make a balance of forces, the recording is too short, or the baseline does not fit.
pub fn diagnose(trials: &Trials, settings: &DiagnoseSettings, command: &str, progress: &mut dyn FnMut(&str)) -> Result<DiagnosisResult, StudyError> {
    diagnose_with_pictures(trials, settings, command, progress).map(|(result, _)| result)
}

/// The same with the samples that its pictures are drawn from.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with_pictures(
    trials: &Trials,
    settings: &DiagnoseSettings,
    command: &str,
    progress: &mut dyn FnMut(&str),
) -> Result<(DiagnosisResult, Pictures), StudyError> {
    let held_out = match &settings.held_out {
        HoldOut::Auto => HeldOut::Auto,
        HoldOut::Time(from, to) => HeldOut::Time(*from, *to),
        HoldOut::Files(files) => HeldOut::Trials((0..trials.trials.len()).filter(|&k| files.contains(&trials.trials[k].file)).collect()),
    };
    let options = Options {
        band_hz: settings.band_hz,
        held_out,
        tolerance: settings.tolerance,
        seed: settings.seed,
        without: settings.without.clone(),
        plan: settings.plan,
        ..Options::default()
    };
    let linear = settings.baseline.as_ref().map(baseline).transpose()?;
    let recordings: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
    let ports = &trials.roles.ports;
    let beyond = match &settings.baseline {
        Some(file) => behind_transducer(&recordings, ports, file)?,
        None => None,
    };
    let (mut found, pictures) = ndof_diagnose::diagnose_with_pictures(beyond.as_ref().unwrap_or(&recordings), ports, &options, linear.as_ref(), progress)?;
    if beyond.is_some() {
        let note = "the give of the device's force transducer was taken off the measured displacements; pictures and numbers are of the limb behind it";
        found.discrepancy.notes.push(note.to_owned());
    }
    if let (Some(file), Some(first)) = (&settings.baseline, recordings.first()) {
        found = robot_side(found, file, &recordings, first.sample_rate_hz(), ports, &options, progress)?;
    }
    // Through JSON, where a number that does not exist becomes null.
    let diagnosis = serde_json::to_value(&found).and_then(serde_json::from_value)?;
    let result = DiagnosisResult {
        schema: SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings: trials.warnings.clone(),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        diagnosis,
    };
    Ok((result, pictures))
}

/// The recordings with the give of the device's transducer taken off the displacements: what the limb did and not the robot.
///
/// A transducer of stiffness k and damping b gives by F / (k + b s), a first-order low-pass of F / k.
fn behind_transducer(recordings: &[Recording], ports: &Ports, file: &BaselineFile) -> Result<Option<Vec<Recording>>, StudyError> {
    let Some(config) = &file.device else { return Ok(None) };
    let transducer = config.build()?.transducer;
    let displaced = |r: &Recording| ports.outputs.iter().all(|&o| r.channels()[o].unit.quantity() == Quantity::Displacement);
    if ports.inputs.len() != ports.outputs.len() || !recordings.iter().all(displaced) {
        return Ok(None);
    }
    let corrected = recordings.iter().map(|recording| {
        let share = 1.0 - (-transducer.stiffness / (transducer.damping.max(f64::MIN_POSITIVE) * recording.sample_rate_hz())).exp();
        let mut channels = recording.channels().to_vec();
        for (&input, &output) in ports.inputs.iter().zip(&ports.outputs) {
            let force = &recording.channels()[input].samples;
            let mut give = force.first().copied().unwrap_or(0.0) / transducer.stiffness;
            for (place, f) in channels[output].samples.iter_mut().zip(force) {
                give += share * (f / transducer.stiffness - give);
                *place -= give;
            }
        }
        Recording::new(recording.sample_rate_hz(), channels).map_err(|source| StudyError::Recording { file: "the recording".to_owned(), source })
    });
    corrected.collect::<Result<Vec<_>, _>>().map(Some)
}

/// The diagnosis with the robot's side beside it, where the baseline has a device and the recordings show both of its ends.
fn robot_side(
    mut found: ndof_diagnose::Diagnosis,
    file: &BaselineFile,
    recordings: &[Recording],
    sample_rate_hz: f64,
    ports: &Ports,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<ndof_diagnose::Diagnosis, StudyError> {
    if file.device.is_none() {
        return Ok(found);
    }
    progress("the robot's side");
    let judged = match SimulatedRobot::new(file, sample_rate_hz)? {
        Some(robot) if robot.parameters().is_empty() => {
            let note = "the robot's side is not judged: a robot described in a file has no named parameters to correct; take a device of `ndof list devices`";
            found.discrepancy.notes.push(note.to_owned());
            return Ok(found);
        }
        Some(robot) => ndof_diagnose::diagnose_robot(recordings, ports, options, &robot),
        None => Err(DiagnoseError::NoRobotSide),
    };
    match judged {
        Ok(robot) => Ok(found.with_robot(robot)),
        Err(DiagnoseError::NoRobotSide) => {
            found.discrepancy.notes.push(
                "the robot's side is not judged: that takes commanded force, measured force and displacement on every axis, and joints that follow from them"
                    .to_owned(),
            );
            Ok(found)
        }
        Err(error) => Err(error.into()),
    }
}

/// The matrices of a baseline file, those of its limb as nominal values; what it does not give is fitted.
fn baseline(file: &BaselineFile) -> Result<Baseline, StudyError> {
    file.check("the baseline")?;
    let limb = match (&file.device, &file.limb) {
        (Some(device), Some(limb)) => Some(linearise(&held(device, limb, file))?.limb),
        _ => None,
    };
    let part = |name: &str, simulated: Option<&Array2<f64>>| {
        let written = file.parameters.get(name).map(|parameter| Part {
            value: parameter.value.rows(),
            status: match parameter.status {
                Status::Fixed => ndof_diagnose::Status::Fixed,
                Status::Nominal => ndof_diagnose::Status::Nominal,
                Status::Free => ndof_diagnose::Status::Free,
            },
            symmetric: parameter.symmetric,
        });
        let nominal = |matrix: &Array2<f64>| Part {
            value: matrix.rows().into_iter().map(|row| row.to_vec()).collect(),
            status: ndof_diagnose::Status::Nominal,
            symmetric: true,
        };
        written.or_else(|| simulated.map(nominal))
    };
    let limb = limb.as_ref();
    Ok(Baseline {
        mass: part("M", limb.map(|limb| &limb.inertia)),
        damping: part("B", limb.map(|limb| &limb.damping)),
        stiffness: part("K", limb.map(|limb| &limb.stiffness)),
    })
}

/// An experiment that only holds the limb at its posture: enough to linearise it.
fn held(device: &DeviceConfig, limb: &LimbConfig, file: &BaselineFile) -> Experiment {
    Experiment {
        seed: 1,
        trials: 1,
        duration_s: 1.0,
        sample_rate_hz: 500.0,
        discard_s: 0.0,
        device: device.clone(),
        limb: limb.clone(),
        posture: file.posture.clone(),
        controller: file.controller.clone(),
        sensors: Sensors::default(),
    }
}
