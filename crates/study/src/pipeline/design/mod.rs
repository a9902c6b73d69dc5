//! Perturbations for a robot, with what they will do before anyone is shaken.

mod between;
mod delivered;
mod length;
mod limbs;
mod motion;
mod replay;
mod through;

pub(crate) use between::{Lens, excited_lines};
pub(crate) use delivered::{delivery, forces_of};
pub use length::Target;
pub(crate) use limbs::with_limb;
pub use motion::LooseLimb;
pub(crate) use replay::replay;
pub(crate) use through::Through;

use super::Progress;
use super::command::{Command, Commands, Judge, period_samples};
use crate::error::StudyError;
use crate::file::{Excitation, ExperimentFile};
use crate::limits;
use crate::result::design::{CoherenceAnalysis, CoherenceSize, CoherenceStages, DesignResult, DesignedSignal, DesignedTrial, SCHEMA};
use crate::result::{VERSION, Warning, number};
use between::Between;
use delivered::simulated;
use ndof_devices::{Experiment, linearise};
use ndof_signal::{Channel, InputCoherence, Quantity, Recording, SignalSize, Unit, power_share};

/// What is to be designed.
#[derive(Clone, Debug)]
pub struct DesignSettings {
    /// What it is made of.
    pub excitation: Excitation,
    /// Names of the axes, in the order of the experiment's where there is one.
    pub axes: Vec<String>,
    /// Whether the axes turn, without an experiment.
    pub rotational: bool,
    /// Number of perturbations.
    pub trials: usize,
    /// Length of the stretch that is analysed (s).
    pub duration_s: f64,
    /// Length of what comes before it (s).
    pub lead_in_s: f64,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// Of all random signals.
    pub seed: u64,
    /// Band over which coherence between the axes is judged (Hz).
    pub band_hz: (f64, f64),
    /// Robot, hold and limb for which it is meant.
    pub experiment: Option<ExperimentFile>,
    /// The soft and the stiff limb of the prediction, without an experiment.
    pub limbs: [LooseLimb; 2],
    /// What the motion must keep.
    pub limits: Limits,
    /// Intervals that are wanted.
    pub targets: Vec<Target>,
    /// Band of the fit for which they are wanted (Hz).
    pub fit_band_hz: [f64; 2],
}

/// Limits on the motion that is predicted for any of the limbs; none where absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Largest displacement of an axis (m, rad).
    pub displacement: Option<f64>,
    /// Largest velocity of an axis (m/s, rad/s).
    pub velocity: Option<f64>,
}

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
pub fn design(settings: &DesignSettings, command: &str, progress: &Progress<'_>) -> Result<Designed, StudyError> {
    let meaning = |what: String| StudyError::Meaning { file: "the design".to_owned(), what };
    settings.excitation.check().map_err(meaning)?;
    limits::simulation(settings.trials, settings.duration_s + settings.lead_in_s, settings.sample_rate_hz, settings.axes.len()).map_err(meaning)?;
    let fs = settings.sample_rate_hz;
    let lead = (settings.lead_in_s * fs).round() as usize;
    let samples = lead + (settings.duration_s * fs).round() as usize;
    if settings.excitation.kind == "multisine" && !settings.excitation.replays() {
        two_periods(settings).map_err(meaning)?;
    }
    let experiment = settings.experiment.as_ref().map(|file| Experiment {
        duration_s: settings.duration_s,
        discard_s: settings.lead_in_s,
        sample_rate_hz: fs,
        trials: settings.trials,
        seed: settings.seed,
        ..file.experiment()
    });
    let linear = experiment.as_ref().map(linearise).transpose()?;
    let rotational = rotational(settings, experiment.as_ref())?;
    let excitation = &settings.excitation;
    let compensation = match (&linear, excitation.precompensate) {
        (Some(linear), true) => Some(Through::compensation(linear, samples)),
        (None, true) => {
            return Err(meaning("pre-compensation needs an experiment: robot, hold and limb".to_owned()));
        }
        (_, false) => None,
    };
    let quiet = experiment.as_ref().map(|experiment| Experiment { limb: experiment.limb.clone().silent(), ..experiment.clone() });
    let device = quiet.as_ref().map(delivery).transpose()?;
    let judge = |signals: &[Vec<f64>]| -> Result<f64, StudyError> {
        let Some(quiet) = &quiet else { return Ok(f64::INFINITY) };
        let forces = simulated(quiet, &[signals.to_vec()], &|_, _, _| ())?;
        Ok(Lens::welch(samples - lead).look(&forces, fs, settings.band_hz)?.pooled.max)
    };
    let commands = Commands {
        excitation,
        axes: &settings.axes,
        samples,
        lead,
        unseen: lead,
        sample_rate_hz: fs,
        seed: settings.seed,
        compensation: compensation.as_ref(),
        device: device.as_deref(),
        judge: quiet.is_some().then_some(&judge as &Judge<'_>),
    };
    let mut made: Vec<Command> = Vec::with_capacity(settings.trials);
    for trial in 0..settings.trials {
        made.push(commands.trial(trial)?);
        progress("design", trial + 1, settings.trials);
    }
    let commanded: Vec<Vec<Vec<f64>>> = made.iter().map(|command| command.signals.clone()).collect();

    let motion = match &experiment {
        Some(experiment) => motion::held(&commanded, experiment, &settings.axes)?,
        None if rotational.iter().all(|r| *r == rotational[0]) => motion::loose(&commanded, &settings.limbs, &settings.axes, fs)?,
        None => Vec::new(),
    };
    motion::refuse(&motion, &limits(settings))?;

    let analysed =
        |trials: &[Vec<Vec<f64>>]| -> Vec<Vec<Vec<f64>>> { trials.iter().map(|t| t.iter().map(|s| s[lead.min(s.len())..].to_vec()).collect()).collect() };
    let delivery = linear.as_ref().map(|linear| Through::delivery(linear, samples));
    let delivered_linear = delivery.map(|delivery| commanded.iter().map(|trial| delivery.apply(trial)).collect::<Result<Vec<_>, _>>()).transpose()?;
    let delivered = quiet.as_ref().map(|quiet| simulated(quiet, &commanded, progress)).transpose()?;
    let restless = experiment.as_ref().filter(|experiment| experiment.limb.noise().is_some());
    let delivered_restless = restless.map(|experiment| simulated(experiment, &commanded, progress)).transpose()?;

    let commanded_part = analysed(&commanded);
    let multisine = excitation.kind == "multisine" && !excitation.replays();
    let lens = if multisine {
        let period = period_samples(excitation, fs);
        // The lines of the design itself: fading, compensation and corrections put power beside them.
        let plain = Excitation { fade_s: 0.0, precompensate: false, corrections: 0, ..excitation.clone() };
        let plain = Commands { excitation: &plain, compensation: None, device: None, judge: None, ..commands };
        let round = (0..settings.trials.min(settings.axes.len())).map(|trial| Ok(plain.trial(trial)?.signals)).collect::<Result<Vec<_>, StudyError>>()?;
        Lens::Lines { period, lines: excited_lines(&analysed(&round), period, fs)? }
    } else {
        Lens::welch(samples - lead)
    };
    // A record too short for a frequency within the band has no coherence to show.
    let resolved = match &lens {
        Lens::Welch(welch) => fs / welch.nperseg as f64 <= settings.band_hz.1,
        Lens::Lines { .. } => settings.trials >= settings.axes.len(),
    };
    let several = settings.axes.len() > 1 && resolved;
    let look = |trials: &[Vec<Vec<f64>>]| lens.look(trials, fs, settings.band_hz);
    let linear_part = delivered_linear.as_deref().map(analysed);
    let stages = if several {
        Some(Stages {
            commanded: look(&commanded_part)?,
            delivered_linear: linear_part.as_deref().map(look).transpose()?,
            delivered: delivered.as_deref().map(look).transpose()?,
            delivered_restless: delivered_restless.as_deref().map(look).transpose()?,
        })
    } else {
        None
    };

    let length = match (&experiment, settings.targets.is_empty()) {
        (Some(experiment), false) => Some(length::plan(settings, experiment, &commanded_part)?),
        (None, false) => {
            return Err(StudyError::Meaning {
                file: "the design".to_owned(),
                what: "the length for an interval needs an experiment: robot, limb and noise".to_owned(),
            });
        }
        (_, true) => None,
    };
    let unit = Unit::si(Quantity::Effort, rotational.first().copied().unwrap_or(settings.rotational));
    let result = DesignResult {
        schema: SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings: warnings(settings, stages.as_ref()),
        kind: if excitation.replays() { Excitation::FILE.to_owned() } else { excitation.kind.clone() },
        axes: settings.axes.clone(),
        unit: unit.symbol().to_owned(),
        sample_rate_hz: fs,
        duration_s: settings.duration_s,
        lead_in_s: settings.lead_in_s,
        precompensated: excitation.precompensate,
        trials: (0..made.len()).map(|trial| described(settings, &made[trial], trial, linear_part.as_deref(), stages.as_ref(), lead)).collect(),
        analysis: lens.describe(settings.band_hz),
        pooled: stages.as_ref().map(Stages::pooled),
        motion,
        length,
    };
    let recordings = commanded
        .into_iter()
        .map(|signals| {
            let unit = |axis: usize| Unit::si(Quantity::Effort, rotational.get(axis).copied().unwrap_or(settings.rotational));
            let channels =
                settings.axes.iter().zip(signals).enumerate().map(|(k, (axis, signal))| Channel::new(format!("cmd_{axis}"), unit(k), signal)).collect();
            Recording::new(fs, channels).map_err(|source| StudyError::Recording { file: "the design".to_owned(), source })
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Designed { recordings, result, curves: stages.map_or_else(Vec::new, Stages::curves) })
}

/// Which axes turn.
fn rotational(settings: &DesignSettings, experiment: Option<&Experiment>) -> Result<Vec<bool>, StudyError> {
    let Some(experiment) = experiment else { return Ok(vec![settings.rotational; settings.axes.len()]) };
    let bench = experiment.build()?;
    let axes = bench.device.robot.axes();
    let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
    if names != settings.axes.iter().map(String::as_str).collect::<Vec<_>>() {
        let what = format!("axes {}, the experiment's device has {}; leave the axes out to take those", settings.axes.join(", "), names.join(", "));
        return Err(StudyError::Meaning { file: "the design".to_owned(), what });
    }
    Ok(axes.iter().map(|axis| axis.rotational).collect())
}

/// The limits that were asked for, else those of the experiment's hold.
fn limits(settings: &DesignSettings) -> Limits {
    let safety = settings.experiment.as_ref().map(|file| file.controller.safety).unwrap_or_default();
    Limits { displacement: settings.limits.displacement.or(safety.distance), velocity: settings.limits.velocity.or(safety.speed) }
}

/// Coherence on the way to the limb.
struct Stages {
    commanded: Between,
    delivered_linear: Option<Between>,
    delivered: Option<Between>,
    delivered_restless: Option<Between>,
}

fn size(found: InputCoherence) -> CoherenceSize {
    CoherenceSize { max: found.max, mean: found.mean }
}

impl Stages {
    fn pooled(&self) -> CoherenceStages {
        let of = |between: &Option<Between>| between.as_ref().map(|b| size(b.pooled));
        CoherenceStages {
            commanded: size(self.commanded.pooled),
            delivered_linear: of(&self.delivered_linear),
            delivered: of(&self.delivered),
            delivered_restless: of(&self.delivered_restless),
        }
    }

    fn trial(&self, trial: usize) -> Option<CoherenceStages> {
        let of = |between: &Between| between.trials.get(trial).copied().flatten().map(size);
        Some(CoherenceStages {
            commanded: of(&self.commanded)?,
            delivered_linear: self.delivered_linear.as_ref().and_then(of),
            delivered: self.delivered.as_ref().and_then(of),
            delivered_restless: self.delivered_restless.as_ref().and_then(of),
        })
    }

    fn curves(self) -> Vec<(String, Vec<f64>, Vec<f64>)> {
        let named = [
            ("commanded", Some(self.commanded)),
            ("delivered, linear model", self.delivered_linear),
            ("delivered, simulated device", self.delivered),
            ("the same, restless limb", self.delivered_restless),
        ];
        named.into_iter().filter_map(|(name, between)| between.map(|b| (name.to_owned(), b.frequency_hz, b.largest))).collect()
    }
}

impl Lens {
    fn describe(&self, band_hz: (f64, f64)) -> CoherenceAnalysis {
        let band_hz = [band_hz.0, band_hz.1];
        match self {
            Lens::Welch(w) => CoherenceAnalysis { name: "welch".to_owned(), nperseg: w.nperseg, noverlap: w.noverlap, nfft: w.nfft, band_hz },
            Lens::Lines { period, .. } => CoherenceAnalysis { name: "lines".to_owned(), nperseg: *period, noverlap: 0, nfft: *period, band_hz },
        }
    }
}

fn described(
    settings: &DesignSettings,
    command: &Command,
    trial: usize,
    delivered: Option<&[Vec<Vec<f64>>]>,
    stages: Option<&Stages>,
    lead: usize,
) -> DesignedTrial {
    let fs = settings.sample_rate_hz;
    let signal = |(k, axis): (usize, &String)| {
        let (whole, part) = (SignalSize::of(&command.signals[k], fs), &command.signals[k][lead..]);
        let rms = SignalSize::of(part, fs).rms;
        DesignedSignal {
            axis: axis.clone(),
            rms,
            peak: whole.peak,
            crest_factor: number(whole.peak / rms),
            slew_per_s: whole.slew_per_s,
            power_share: power_share(part, fs, settings.band_hz),
            delivered_rms: delivered.map(|trials| SignalSize::of(&trials[trial][k], fs).rms),
        }
    };
    DesignedTrial {
        seed: command.seed,
        signals: settings.axes.iter().enumerate().map(signal).collect(),
        chance: command.chance,
        coherence: stages.and_then(|stages| stages.trial(trial)),
    }
}

/// Noise is what differs from period to period, so a multisine needs two of them.
fn two_periods(settings: &DesignSettings) -> Result<(), String> {
    let fs = settings.sample_rate_hz;
    let (period, samples) = (period_samples(&settings.excitation, fs), (settings.duration_s * fs).round() as usize);
    if samples >= 2 * period {
        return Ok(());
    }
    Err(format!(
        "{} s hold {:.2} periods of {} s, and without two there is no telling noise from response; take --duration {} or more, or --period {} or less",
        settings.duration_s,
        samples as f64 / period as f64,
        settings.excitation.period_s,
        2.0 * settings.excitation.period_s,
        settings.duration_s / 2.0
    ))
}

fn warnings(settings: &DesignSettings, stages: Option<&Stages>) -> Vec<Warning> {
    /// Above this the inputs depend on each other enough to matter for a direct estimate.
    const HIGH: f64 = 0.3;
    let mut warnings = Vec::new();
    let kind = settings.excitation.kind.as_str();
    let axes = settings.axes.len();
    if axes > 1 && matches!(kind, "multisine" | "chirp") && !settings.trials.is_multiple_of(axes) {
        warnings.push(Warning::new(
            "incomplete-round",
            format!("{} trial(s) of a {kind} on {axes} axes: only {axes} together, or a multiple, tell the axes apart", settings.trials),
            format!("make --trials {}", settings.trials.next_multiple_of(axes)),
        ));
    }
    if let Some(delivered) = stages.and_then(|stages| stages.delivered.as_ref()).filter(|delivered| delivered.pooled.max > HIGH) {
        warnings.push(Warning::new(
            "coherent-forces",
            format!("the forces that arrive at the limb reach a coherence of {:.2} with each other, all trials pooled", delivered.pooled.max),
            "go on with the derived estimate (it does not mind), or pre-compensate with --precompensate",
        ));
    }
    warnings
}
