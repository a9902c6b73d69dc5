//! Coherence between the axes on the way to the limb.

use super::between::{Between, Lens, excited_lines};
use super::result::{CoherenceSize, CoherenceStages};
use super::specification::Specification;
use crate::Progress;
use crate::command::{Commands, Through, period_samples, simulated};
use crate::error::StudyError;
use crate::file::Excitation;
use ndof_devices::{Experiment, Linearised};
use ndof_signal::InputCoherence;

/// Signals of several trials, `[trial][axis][sample]`.
pub(super) type Signals = [Vec<Vec<f64>>];

/// How coherence is looked at: on the lines of a multisine, else as a recording will be analysed.
pub(super) fn lens(asked: &Specification, commands: &Commands<'_>) -> Result<Lens, StudyError> {
    let (lead, samples) = asked.samples();
    if !asked.is_multisine() {
        return Ok(Lens::welch(samples - lead));
    }
    let fs = asked.sample_rate_hz;
    let period = period_samples(&asked.excitation, fs);
    // The lines of the design itself: fading, compensation and corrections put power beside them.
    let plain = Excitation { fade_s: 0.0, precompensate: false, corrections: 0, ..asked.excitation.clone() };
    let plain = Commands { excitation: &plain, compensation: None, device: None, judge: None, ..*commands };
    let round = (0..asked.trials.min(asked.axes.len())).map(|trial| Ok(plain.trial(trial)?.signals)).collect::<Result<Vec<_>, StudyError>>()?;
    Ok(Lens::Lines { period, lines: excited_lines(&analysed(&round, lead), period, fs)? })
}

/// What is analysed of each signal: what comes behind the lead-in.
pub(super) fn analysed(trials: &Signals, lead: usize) -> Vec<Vec<Vec<f64>>> {
    trials.iter().map(|t| t.iter().map(|s| s[lead.min(s.len())..].to_vec()).collect()).collect()
}

/// Forces that arrive at the limb.
pub(super) struct Delivered {
    /// By the linear model.
    pub linear: Option<Vec<Vec<Vec<f64>>>>,
    /// By the simulated device, its friction and sensors included, on a quiet limb.
    pub simulated: Option<Vec<Vec<Vec<f64>>>>,
    /// The same on a limb that moves by itself, where it does.
    pub restless: Option<Vec<Vec<Vec<f64>>>>,
}

impl Delivered {
    /// Those of the commands; none without an experiment.
    pub(super) fn of(commanded: &Signals, benches: Option<(&Experiment, &Experiment, &Linearised)>, progress: &Progress<'_>) -> Result<Self, StudyError> {
        let Some((experiment, quiet, linear)) = benches else { return Ok(Delivered { linear: None, simulated: None, restless: None }) };
        let through = Through::delivery(linear, commanded.first().and_then(|trial| trial.first()).map_or(0, Vec::len));
        let restless = experiment.limb.noise().is_some();
        Ok(Delivered {
            linear: Some(commanded.iter().map(|trial| through.apply(trial)).collect::<Result<Vec<_>, _>>()?),
            simulated: Some(simulated(quiet, commanded, progress)?),
            restless: if restless { Some(simulated(experiment, commanded, progress)?) } else { None },
        })
    }
}

/// Coherence on the way to the limb.
pub(super) struct Stages {
    commanded: Between,
    delivered_linear: Option<Between>,
    delivered: Option<Between>,
    delivered_restless: Option<Between>,
}

fn size(found: InputCoherence) -> CoherenceSize {
    CoherenceSize { max: found.max, mean: found.mean }
}

impl Stages {
    /// Looks at commands and forces; nothing for one axis, or where the records resolve no frequency of the band.
    pub(super) fn of(asked: &Specification, lens: &Lens, commanded: &Signals, delivered: &Delivered) -> Result<Option<Self>, StudyError> {
        let (fs, (lead, _)) = (asked.sample_rate_hz, asked.samples());
        let resolved = match lens {
            Lens::Welch(welch) => fs / welch.nperseg as f64 <= asked.band_hz.1,
            Lens::Lines { .. } => asked.trials >= asked.axes.len(),
        };
        if asked.axes.len() < 2 || !resolved {
            return Ok(None);
        }
        let look = |trials: &Signals| lens.look(trials, fs, asked.band_hz);
        Ok(Some(Stages {
            commanded: look(&analysed(commanded, lead))?,
            delivered_linear: delivered.linear.as_ref().map(|trials| look(&analysed(trials, lead))).transpose()?,
            delivered: delivered.simulated.as_deref().map(look).transpose()?,
            delivered_restless: delivered.restless.as_deref().map(look).transpose()?,
        }))
    }

    /// The largest coherence between the forces that the simulated device delivers, all trials pooled.
    pub(super) fn forces(&self) -> Option<f64> {
        self.delivered.as_ref().map(|delivered| delivered.pooled.max)
    }

    /// Of all trials together.
    pub(super) fn pooled(&self) -> CoherenceStages {
        let of = |between: &Option<Between>| between.as_ref().map(|b| size(b.pooled));
        CoherenceStages {
            commanded: size(self.commanded.pooled),
            delivered_linear: of(&self.delivered_linear),
            delivered: of(&self.delivered),
            delivered_restless: of(&self.delivered_restless),
        }
    }

    /// Of one trial by itself.
    pub(super) fn trial(&self, trial: usize) -> Option<CoherenceStages> {
        let of = |between: &Between| between.trials.get(trial).copied().flatten().map(size);
        Some(CoherenceStages {
            commanded: of(&self.commanded)?,
            delivered_linear: self.delivered_linear.as_ref().and_then(of),
            delivered: self.delivered.as_ref().and_then(of),
            delivered_restless: self.delivered_restless.as_ref().and_then(of),
        })
    }

    /// The largest at each frequency, by stage.
    pub(super) fn curves(self) -> Vec<(String, Vec<f64>, Vec<f64>)> {
        let named = [
            ("commanded", Some(self.commanded)),
            ("delivered, linear model", self.delivered_linear),
            ("delivered, simulated device", self.delivered),
            ("the same, restless limb", self.delivered_restless),
        ];
        named.into_iter().filter_map(|(name, between)| between.map(|b| (name.to_owned(), b.frequency_hz, b.largest))).collect()
    }
}
