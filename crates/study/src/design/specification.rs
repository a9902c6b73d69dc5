//! A design with nothing left open.

use super::limbs::LooseLimb;
use super::target::Target;
use crate::command::period_samples;
use crate::error::{StudyError, meaning};
use crate::file::{Excitation, ExperimentFile};
use ndof_devices::Experiment;

/// What is to be designed.
#[derive(Clone, Debug)]
pub(super) struct Specification {
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
pub(super) struct Limits {
    /// Largest displacement of an axis (m, rad).
    pub displacement: Option<f64>,
    /// Largest velocity of an axis (m/s, rad/s).
    pub velocity: Option<f64>,
}

impl Specification {
    /// Samples of what comes before the stretch that is analysed, and of all.
    pub(super) fn samples(&self) -> (usize, usize) {
        let lead = (self.lead_in_s * self.sample_rate_hz).round() as usize;
        (lead, lead + (self.duration_s * self.sample_rate_hz).round() as usize)
    }

    /// Whether it is made of sines on lines of its own.
    pub(super) fn is_multisine(&self) -> bool {
        self.excitation.kind == "multisine" && !self.excitation.replays()
    }

    /// The experiment, of the design's length, rate and number of trials.
    pub(super) fn experiment(&self) -> Option<Experiment> {
        self.experiment.as_ref().map(|file| Experiment {
            duration_s: self.duration_s,
            discard_s: self.lead_in_s,
            sample_rate_hz: self.sample_rate_hz,
            trials: self.trials,
            seed: self.seed,
            ..file.experiment()
        })
    }

    /// Which axes turn.
    pub(super) fn turning(&self) -> Result<Vec<bool>, StudyError> {
        let Some(experiment) = self.experiment() else { return Ok(vec![self.rotational; self.axes.len()]) };
        let bench = experiment.build()?;
        let axes = bench.device.robot.axes();
        let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
        if names != self.axes.iter().map(String::as_str).collect::<Vec<_>>() {
            let what = format!("axes {}, the experiment's device has {}; leave the axes out to take those", self.axes.join(", "), names.join(", "));
            return Err(meaning("the design", what));
        }
        Ok(axes.iter().map(|axis| axis.rotational).collect())
    }

    /// The limits that were asked for, else those of the experiment's hold.
    pub(super) fn limits(&self) -> Limits {
        let safety = self.experiment.as_ref().map(|file| file.controller.safety).unwrap_or_default();
        Limits { displacement: self.limits.displacement.or(safety.distance), velocity: self.limits.velocity.or(safety.speed) }
    }

    /// Noise is what differs from period to period, so a multisine needs two of them.
    pub(super) fn two_periods(&self) -> Result<(), String> {
        let fs = self.sample_rate_hz;
        let (period, samples) = (period_samples(&self.excitation, fs), (self.duration_s * fs).round() as usize);
        if !self.is_multisine() || samples >= 2 * period {
            return Ok(());
        }
        Err(format!(
            "{} s hold {:.2} periods of {} s, and without two there is no telling noise from response; take `duration={}` or more, or `period={}` or less",
            self.duration_s,
            samples as f64 / period as f64,
            self.excitation.period_s,
            2.0 * self.excitation.period_s,
            self.duration_s / 2.0
        ))
    }
}
