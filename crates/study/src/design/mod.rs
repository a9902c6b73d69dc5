//! Perturbations for a robot, with what they will do before anyone is shaken.

mod between;
mod described;
pub mod excitation;
mod length;
mod limbs;
mod motion;
pub mod result;
mod robot;
mod settings;
mod specification;
mod stages;
mod target;
mod theory;

pub(crate) use between::Lens;
pub use limbs::LooseLimb;
pub(crate) use limbs::with_limb;
pub use robot::ExcitedRobot;
pub use settings::{Design, RobotMotion};
pub use target::Target;

use crate::Progress;
use crate::command::{Commands, Judge, Through, delivery, simulated};
use crate::error::{self, StudyError};
use described::{described, recordings, unit, warnings};
use ndof_analysis::result::Head;
use ndof_devices::{Experiment, Linearised, linearise};
use ndof_signal::Recording;
use result::{DesignResult, LengthPlan, Motion};
use specification::Specification;
use stages::{Delivered, Signals, Stages, analysed, lens};

/// Perturbations with the result that describes them.
#[derive(Clone, Debug)]
pub struct Designed {
    /// One a trial, channels `cmd_…`, the lead-in first.
    pub recordings: Vec<Recording>,
    /// What they are and will do.
    pub result: DesignResult,
    /// Largest coherence between the axes at each frequency, all trials pooled, by stage.
    pub curves: Vec<(String, Vec<f64>, Vec<f64>)>,
}

/// Designs perturbations.
///
/// With an experiment, the linear model of its robot, hold and limb says which forces arrive and how a soft, the nominal and a
/// stiff limb move, and a simulation of the device says how coherent the delivered forces are.
///
/// # Errors
/// [`StudyError`] if settings make no sense, axes differ from the experiment's, or the predicted motion passes a limit.
pub fn design(settings: &Design, progress: &Progress<'_>) -> Result<Designed, StudyError> {
    let asked = settings.specification()?;
    let (fs, (lead, samples)) = (asked.sample_rate_hz, asked.samples());
    let experiment = asked.experiment();
    let linear = experiment.as_ref().map(linearise).transpose()?;
    let turning = asked.turning()?;
    let compensation = compensation(&asked, linear.as_ref(), samples)?;
    let quiet = experiment.as_ref().map(|experiment| Experiment { limb: experiment.limb.clone().silent(), ..experiment.clone() });
    let device = quiet.as_ref().map(delivery).transpose()?;
    let judge = |signals: &[Vec<f64>]| -> Result<f64, StudyError> {
        let Some(quiet) = &quiet else { return Ok(f64::INFINITY) };
        let forces = simulated(quiet, &[signals.to_vec()], &|_, _, _| ())?;
        Ok(Lens::welch(samples - lead).look(&forces, fs, asked.band_hz)?.pooled.max)
    };
    let commands = Commands {
        excitation: &asked.excitation,
        axes: &asked.axes,
        samples,
        lead,
        unseen: lead,
        sample_rate_hz: fs,
        seed: asked.seed,
        compensation: compensation.as_ref(),
        device: device.as_deref(),
        judge: quiet.is_some().then_some(&judge as &Judge<'_>),
    };
    let mut made = Vec::with_capacity(asked.trials);
    for trial in 0..asked.trials {
        made.push(commands.trial(trial)?);
        progress("design", trial + 1, asked.trials);
    }
    let commanded: Vec<Vec<Vec<f64>>> = made.iter().map(|command| command.signals.clone()).collect();
    let motion = motion(&asked, experiment.as_ref(), &turning, &commanded)?;
    motion::refuse(&motion, &asked.limits())?;
    let benches = experiment.as_ref().zip(quiet.as_ref()).zip(linear.as_ref()).map(|((experiment, quiet), linear)| (experiment, quiet, linear));
    let delivered = Delivered::of(&commanded, benches, progress)?;
    let lens = lens(&asked, &commands)?;
    let stages = Stages::of(&asked, &lens, &commanded, &delivered)?;
    let delivered = delivered.linear.as_deref().map(|trials| analysed(trials, lead));
    let result = DesignResult {
        head: Head::new(DesignResult::SCHEMA, "design", warnings(&asked, stages.as_ref())),
        settings: settings.clone(),
        kind: asked.excitation.kind.clone(),
        axes: asked.axes.clone(),
        unit: unit(&turning, 0).symbol().to_owned(),
        sample_rate_hz: fs,
        duration_s: asked.duration_s,
        lead_in_s: asked.lead_in_s,
        precompensated: asked.excitation.precompensate,
        trials: made.iter().enumerate().map(|(k, command)| described(&asked, command, k, delivered.as_deref(), stages.as_ref())).collect(),
        analysis: lens.describe(asked.band_hz),
        pooled: stages.as_ref().map(Stages::pooled),
        motion,
        length: length(&asked, experiment.as_ref(), &analysed(&commanded, lead))?,
    };
    Ok(Designed { recordings: recordings(&asked, commanded, &turning)?, result, curves: stages.map_or_else(Vec::new, Stages::curves) })
}

impl Design {
    /// Designs the perturbations.
    ///
    /// # Errors
    /// As [`design`].
    pub fn run(&self) -> Result<Designed, StudyError> {
        design(self, &|_, _, _| ())
    }
}

/// T⁻¹, where it goes before the commands.
fn compensation(asked: &Specification, linear: Option<&Linearised>, samples: usize) -> Result<Option<Through>, StudyError> {
    match (linear, asked.excitation.precompensate) {
        (Some(linear), true) => Ok(Some(Through::compensation(linear, samples))),
        (None, true) => Err(error::meaning("the design", "pre-compensation needs an experiment: robot, hold and limb")),
        (_, false) => Ok(None),
    }
}

/// What will move: the experiment's limb, else a loose one where all axes are of one kind.
fn motion(asked: &Specification, experiment: Option<&Experiment>, turning: &[bool], commanded: &Signals) -> Result<Vec<Motion>, StudyError> {
    match experiment {
        Some(experiment) => motion::held(commanded, experiment, &asked.axes),
        None if turning.iter().all(|turns| *turns == turning[0]) => motion::loose(commanded, &asked.limbs, &asked.axes, asked.sample_rate_hz),
        None => Ok(Vec::new()),
    }
}

/// How long to measure, where intervals are wanted.
fn length(asked: &Specification, experiment: Option<&Experiment>, commanded: &Signals) -> Result<Option<LengthPlan>, StudyError> {
    match (experiment, asked.targets.is_empty()) {
        (_, true) => Ok(None),
        (Some(experiment), false) => length::plan(asked, experiment, commanded).map(Some),
        (None, false) => Err(error::meaning("the design", "the length for an interval needs an experiment: robot, limb and noise")),
    }
}
