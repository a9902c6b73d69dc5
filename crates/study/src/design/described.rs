//! What was made, trial by trial.

use super::result::{DesignedSignal, DesignedTrial};
use super::specification::Specification;
use super::stages::Stages;
use crate::command::Command;
use ndof_analysis::AnalysisError;
use ndof_analysis::result::{Warning, number};
use ndof_signal::{Channel, Quantity, Recording, SignalSize, Unit, power_share};

/// One trial's perturbation, with what the linear model delivers for each.
pub(super) fn described(asked: &Specification, command: &Command, trial: usize, delivered: Option<&[Vec<Vec<f64>>]>, stages: Option<&Stages>) -> DesignedTrial {
    let (fs, (lead, _)) = (asked.sample_rate_hz, asked.samples());
    let signal = |(k, axis): (usize, &String)| {
        let (whole, part) = (SignalSize::of(&command.signals[k], fs), &command.signals[k][lead..]);
        let rms = SignalSize::of(part, fs).rms;
        DesignedSignal {
            axis: axis.clone(),
            rms,
            peak: whole.peak,
            crest_factor: number(whole.peak / rms),
            slew_per_s: whole.slew_per_s,
            power_share: power_share(part, fs, asked.band_hz),
            delivered_rms: delivered.map(|trials| SignalSize::of(&trials[trial][k], fs).rms),
        }
    };
    DesignedTrial {
        seed: command.seed,
        signals: asked.axes.iter().enumerate().map(signal).collect(),
        chance: command.chance,
        coherence: stages.and_then(|stages| stages.trial(trial)),
    }
}

/// Unit of the command of an axis.
pub(super) fn unit(turning: &[bool], axis: usize) -> Unit {
    Unit::si(Quantity::Effort, turning.get(axis).copied().unwrap_or(false))
}

/// The commands as recordings, one a trial.
pub(super) fn recordings(asked: &Specification, commanded: Vec<Vec<Vec<f64>>>, turning: &[bool]) -> Result<Vec<Recording>, AnalysisError> {
    let recording = |signals: Vec<Vec<f64>>| {
        let channels = asked.axes.iter().zip(signals).enumerate();
        let channels = channels.map(|(k, (axis, signal))| Channel::new(format!("cmd_{axis}"), unit(turning, k), signal)).collect();
        Recording::new(asked.sample_rate_hz, channels).map_err(|source| AnalysisError::Recording { file: "the design".to_owned(), source })
    };
    commanded.into_iter().map(recording).collect()
}

/// What the user of the perturbations should know.
pub(super) fn warnings(asked: &Specification, stages: Option<&Stages>) -> Vec<Warning> {
    /// Above this the inputs depend on each other enough to matter for a direct estimate.
    const HIGH: f64 = 0.3;
    let mut warnings = Vec::new();
    let kind = asked.excitation.kind.as_str();
    let axes = asked.axes.len();
    if axes > 1 && matches!(kind, "multisine" | "chirp") && !asked.trials.is_multiple_of(axes) {
        warnings.push(Warning::new(
            "incomplete-round",
            format!("{} trial(s) of a {kind} on {axes} axes: only {axes} together, or a multiple, tell the axes apart", asked.trials),
            format!("make `trials={}`", asked.trials.next_multiple_of(axes)),
        ));
    }
    if let Some(coherence) = stages.and_then(Stages::forces).filter(|coherence| *coherence > HIGH) {
        warnings.push(Warning::new(
            "coherent-forces",
            format!("the forces that arrive at the limb reach a coherence of {coherence:.2} with each other, all trials pooled"),
            "go on with the derived estimate (it does not mind), or pre-compensate with `precompensate`",
        ));
    }
    warnings
}
