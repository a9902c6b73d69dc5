//! Trials turned round: from motion to effort, with the motion that the command foretells as the instrument.

use super::settings::Estimate;
use crate::error::AnalysisError;
use crate::schedule::Schedule;
use crate::trials::{Roles, Trial, Trials};
use ndof_models::schedule::{ScheduledFit, Splines, Stretch};
use ndof_signal::Channel;
use ndof_sysid::{Ports, ResponseKind};

/// The widest band over the sample rate in which a motion is foretold, and in which a scheduled fit is made where none is asked for.
pub(crate) const WIDEST: f64 = 1.0 / 6.0;
/// Splines of the mean over a period of the band's upper end, which they follow within a hundredth.
pub(crate) const MEAN_KNOTS: f64 = 4.0;

impl Roles {
    /// From motions to efforts without a reference, where each effort has its motion; else as they are.
    fn turned_round(&self) -> Self {
        let Ports { inputs, outputs, .. } = self.ports.clone();
        let none = Vec::new();
        match self.natural_kind() {
            ResponseKind::DynamicStiffness => Roles { ports: Ports { references: none, inputs, outputs }, ..self.clone() },
            ResponseKind::Compliance if inputs.len() == outputs.len() => Roles {
                ports: Ports { references: none, inputs: outputs, outputs: inputs },
                input_motion: self.output_motion.clone(),
                output_motion: self.input_motion.clone(),
                ..self.clone()
            },
            _ => self.clone(),
        }
    }
}

/// The trials from motion to effort; where a command pushes, with what it foretells of each motion as references.
pub(super) fn from_motion(trials: &Trials, schedule: &Schedule, (settings, explained): (&Estimate, f64)) -> Result<Trials, AnalysisError> {
    let mut roles = trials.roles.turned_round();
    // Where the motion is imposed there is nothing to correct.
    if roles.ports.inputs == trials.roles.ports.inputs || trials.roles.ports.references.is_empty() {
        return Ok(Trials { roles, ..trials.clone() });
    }
    let (rate_hz, cycle_s) = (trials.sample_rate_hz(), schedule.cycle_s.unwrap_or(f64::NAN));
    let high_hz = settings.band_hz.map_or(explained, |band| band[1]).min(WIDEST * rate_hz);
    let fit = ScheduledFit {
        rate_hz,
        high_hz,
        knots: Splines::FEWEST,
        mean_knots: (MEAN_KNOTS * high_hz * cycle_s).ceil() as usize,
        closed: true,
        stiffness: false,
        damping: false,
        inertia: false,
    };
    let stretches = trials.trials.iter().zip(schedule.values.iter().zip(&schedule.blocks)).map(|(trial, (values, blocks))| Stretch {
        effort: trial.recording.columns(&roles.ports.outputs),
        motion: trial.recording.columns(&roles.ports.inputs),
        command: trial.recording.columns(&trials.roles.ports.references),
        schedule: values.clone(),
        block: blocks.clone(),
    });
    let told = fit.foretold(&stretches.collect::<Vec<_>>())?;
    let channels = trials.trials.first().map_or(0, |trial| trial.recording.channels().len());
    let with = |(trial, told): (&Trial, Vec<Vec<f64>>)| {
        let own = trial.recording.channels();
        let named = roles.ports.inputs.iter().zip(told).map(|(&input, told)| {
            // Before a first cycle there is no phase, and no window either.
            let samples = told.into_iter().map(|x| if x.is_finite() { x } else { 0.0 }).collect();
            Channel { name: format!("{} as foretold", own[input].name), samples, ..own[input].clone() }
        });
        trial.with_channels(own.iter().cloned().chain(named).collect())
    };
    let with_told: Result<Vec<Trial>, AnalysisError> = trials.trials.iter().zip(told.motion).map(with).collect();
    roles.ports.references = (channels..channels + roles.ports.inputs.len()).collect();
    Ok(Trials { trials: with_told?.into(), roles, ..trials.clone() })
}
