//! Trials in, diagnosis out.

mod added;
mod arm;
mod joints;
mod linear_fit;
pub mod result;
mod robot_side;
mod settings;
mod simulator;

pub use added::AddedEffort;
pub use settings::{Diagnose, HeldOut};

use crate::error::AnalysisError;
use crate::file::BaselineFile;
use crate::fit::turned_round;
use crate::result::{Head, word};
use crate::trials::{Trial, Trials};
use linear_fit::linear_fit;
use ndarray::Array2;
use ndof_devices::linearise;
use ndof_diagnose::{Baseline, DiagnoseError, Diagnosis, Mechanism, Options, Part, Pictures};
use ndof_joints::Corrections;
use ndof_models::Hold;
use ndof_signal::{Quantity, Recording, Warning};
use ndof_sysid::Ports;
use result::DiagnosisResult;
use robot_side::{SimulatedRobot, held};
use simulator::Simulator;

/// Any rate will do to linearise a limb.
const RATE_HZ: f64 = 500.0;

/// What a simulation gets wrong, with the samples that its pictures are drawn from.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The trials that were looked at.
    pub trials: Trials,
    /// The result.
    pub result: DiagnosisResult,
    /// The samples that show it.
    pub pictures: Pictures,
    /// What it corrects in the robot's file; `None` without one.
    pub corrections: Option<Corrections>,
    /// What a simulator would have to be given beside its own forces; `None` where none is judged by its log, or it cannot be computed.
    pub added: Option<AddedEffort>,
}

/// Says what a simulator gets wrong, and why, that logged the same commands: one of its recordings for each trial, with the same channels. How its
/// force changes where the measured motion is not its own is what a robot's file says, in [`Diagnose::robot`], or the inertia, damping and stiffness
/// of its own recordings.
///
/// # Errors
/// [`AnalysisError`] if trials and recordings do not match, or beside a baseline.
pub fn diagnose_simulator(trials: &Trials, simulated: &Trials, settings: &Diagnose, progress: &mut dyn FnMut(&str)) -> Result<Diagnosed, AnalysisError> {
    if let Some(robot) = &settings.robot {
        return joints::diagnose(trials, Some(simulated), robot, settings, progress);
    }
    if settings.baseline.is_some() {
        let what = "a `baseline` is a simulation itself; give one of the two";
        return Err(AnalysisError::Meaning { file: "`simulated`".to_owned(), what: what.to_owned() });
    }
    settings.refuse_hold_beside("a simulator's log")?;
    let mut options = Options { added: true, ..settings.options(trials)? };
    progress("fitting the simulator's own response");
    let own = Simulator::new(trials, simulated, &options)?;
    options.known = own.known;
    let (found, mut pictures) = ndof_diagnose::diagnose_with_pictures(&own.measured, &trials.roles.ports, &options, Some(&own.baseline), progress)?;
    let efforts = own.pairs.into_iter().map(|[effort, _]| effort).collect();
    let added = AddedEffort::new(trials, settings, efforts, pictures.sample_rate_hz, std::mem::take(&mut pictures.added))?;
    Ok(Diagnosed { added, ..answered(trials, settings, found, pictures, own.warnings) })
}

/// Says what the baseline gets wrong, and why; `progress` is told in words what is being done.
///
/// # Errors
/// [`AnalysisError`] if the channels do not make a balance of forces, the recording is too short, or the baseline does not fit.
pub fn diagnose(trials: &Trials, settings: &Diagnose, progress: &mut dyn FnMut(&str)) -> Result<Diagnosed, AnalysisError> {
    if let Some(robot) = &settings.robot {
        return joints::diagnose(trials, None, robot, settings, progress);
    }
    let mut options = settings.options(trials)?;
    let linear = settings.baseline.as_ref().map(baseline).transpose()?;
    let mut notes = Vec::new();
    let mut turned = None;
    if linear.is_none() {
        progress("fitting the baseline");
        match linear_fit(trials, settings, &options) {
            Ok(found) => {
                notes.extend(found.linear.hold.and_then(at_ticks));
                if let Some(hold) = found.linear.hold.filter(|_| found.hold_of_whole) {
                    let hold = word(&hold);
                    notes.push(format!("how forces go between samples the whole recording shows, and the part that is fitted does not: `hold` is {hold}"));
                }
                options.linear = Some(found.linear);
                // A schedule is judged where `fit` finds its curves; the inertia that rules beyond it follows none.
                options.band_hz = options.band_hz.or_else(|| options.schedule.as_ref().map(|_| (0.0, found.band_hz[1])));
                if !found.opposed.is_empty() {
                    turned = Some(turned_round(trials, &found.opposed)?);
                    let names = found.opposed.join(", ");
                    notes.push(format!("{names} and the motion along it are counted in opposite directions: the effort was turned round (force-sign)"));
                }
            }
            Err(error) => notes.push(format!("the baseline is the one that balances the forces best, for `fit` finds none: {error}")),
        }
    }
    let trials = turned.as_ref().unwrap_or(trials);
    let recordings: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
    let ports = &trials.roles.ports;
    let beyond = settings.baseline.as_ref().map(|file| behind_transducer(&recordings, ports, file)).transpose()?.flatten();
    let (mut found, pictures) = ndof_diagnose::diagnose_with_pictures(beyond.as_ref().unwrap_or(&recordings), ports, &options, linear.as_ref(), progress)?;
    found.discrepancy.notes.extend(notes);
    if beyond.is_some() {
        let note = "the give of the device's force transducer was taken off the measured displacements; pictures and numbers are of the limb behind it";
        found.discrepancy.notes.push(note.to_owned());
    }
    if let Some(file) = &settings.baseline {
        found = robot_side(found, file, &recordings, trials.sample_rate_hz(), ports, &options, progress)?;
    }
    let warning = joints::no_robot(trials).filter(|_| settings.baseline.is_none() && settings.kinematics.is_none());
    Ok(answered(trials, settings, found, pictures, warning.into_iter().collect()))
}

/// What is said of channels that are read at the ticks of a loop.
fn at_ticks(hold: Hold) -> Option<String> {
    let when = match hold {
        Hold::ReadAfter => "after it writes the command",
        Hold::ReadBefore => "before it writes the next command",
        Hold::BandLimited | Hold::Zero | Hold::Linear => return None,
    };
    Some(format!(
        "channels look as a loop reads them just {when} that it holds (`fit`): a channel that is late by half a sample looks the same, and is not named"
    ))
}

/// The answer to a question of forces and motions.
fn answered(trials: &Trials, settings: &Diagnose, diagnosis: Diagnosis, pictures: Pictures, more: Vec<Warning>) -> Diagnosed {
    let ports = &trials.roles.ports;
    let result = DiagnosisResult {
        head: Head::new(DiagnosisResult::SCHEMA, "diagnose", trials.warnings.iter().cloned().chain(more).collect()),
        settings: settings.recorded(),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        diagnosis,
    };
    Diagnosed { trials: trials.clone(), result, pictures, corrections: None, added: None }
}

/// A diagnosis that is being asked for.
#[derive(Clone, Debug)]
pub struct Question<'a> {
    trials: Vec<&'a Trial>,
    settings: Diagnose,
}

impl<'a> Question<'a> {
    /// What a linear model misses in these trials.
    pub fn new(trials: impl IntoIterator<Item = &'a Trial>) -> Self {
        Question { trials: trials.into_iter().collect(), settings: Diagnose::default() }
    }

    /// With these settings.
    #[must_use]
    pub fn settings(self, settings: Diagnose) -> Self {
        Question { settings, ..self }
    }

    /// What the simulation that this file describes misses.
    #[must_use]
    pub fn baseline(self, baseline: BaselineFile) -> Self {
        Question { settings: Diagnose { baseline: Some(baseline), ..self.settings }, ..self }
    }

    /// The answer.
    ///
    /// # Errors
    /// As [`Trials::new`] and [`diagnose`].
    pub fn run(self) -> Result<Diagnosed, AnalysisError> {
        diagnose(&Trials::of(self.trials)?, &self.settings, &mut |_| ())
    }
}

/// The recordings with the give of the device's transducer taken off the displacements: what the limb did and not the robot.
///
/// A transducer of stiffness k and damping b gives by F / (k + b s), a first-order low-pass of F / k.
fn behind_transducer(recordings: &[Recording], ports: &Ports, file: &BaselineFile) -> Result<Option<Vec<Recording>>, AnalysisError> {
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
        recording.with_channels(channels).map_err(|source| AnalysisError::Recording { file: "the recording".to_owned(), source })
    });
    corrected.collect::<Result<Vec<_>, _>>().map(Some)
}

/// The diagnosis with the robot's side beside it, where the baseline has a device and the recordings show both of its ends.
fn robot_side(
    mut found: Diagnosis,
    file: &BaselineFile,
    recordings: &[Recording],
    sample_rate_hz: f64,
    ports: &Ports,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Diagnosis, AnalysisError> {
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
fn baseline(file: &BaselineFile) -> Result<Baseline, AnalysisError> {
    file.check("the baseline")?;
    let limb = match (&file.device, &file.limb) {
        (Some(device), Some(limb)) => Some(linearise(&held(device.clone(), limb.clone(), file, RATE_HZ))?.limb),
        _ => None,
    };
    let part = |name: &str, simulated: Option<&Array2<f64>>| {
        let written =
            file.parameters.get(name).map(|parameter| Part { value: parameter.value.rows(), status: parameter.status, symmetric: parameter.symmetric });
        written.or_else(|| simulated.map(Part::nominal))
    };
    let limb = limb.as_ref();
    Ok(Baseline {
        mass: part("M", limb.map(|limb| &limb.inertia)),
        damping: part("B", limb.map(|limb| &limb.damping)),
        stiffness: part("K", limb.map(|limb| &limb.stiffness)),
    })
}
