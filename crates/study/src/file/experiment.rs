//! `ndof/experiment/1`: what is simulated.

use super::excitation::Excitation;
use crate::error::{StudyError, meaning};
use ndof_analysis::file::{check_schema, read};
use ndof_devices::{Controller, DeviceConfig, Experiment, LimbConfig, Posture, Sensors};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Device, limb, excitation, controller, sensors and hidden effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentFile {
    /// `ndof/experiment/1`.
    pub schema: Option<String>,
    /// Of all random signals.
    #[serde(default = "given::<1, _>")]
    pub seed: u64,
    /// Repeated trials.
    #[serde(default = "given::<1, _>")]
    pub trials: usize,
    /// Length of a trial's recording.
    #[serde(default = "given::<50, _>")]
    pub duration_s: f64,
    /// Rate of controller and recording.
    #[serde(default = "given::<500, _>")]
    pub sample_rate_hz: f64,
    /// Simulated before the recording begins.
    #[serde(default = "given::<2, _>")]
    pub discard_s: f64,
    /// The robot.
    pub device: DeviceConfig,
    /// The limb.
    pub limb: LimbConfig,
    /// Where both are held.
    #[serde(default)]
    pub posture: Posture,
    /// What is commanded.
    #[serde(default)]
    pub excitation: Excitation,
    /// The hold.
    #[serde(default)]
    pub controller: Controller,
    /// The sensors.
    #[serde(default)]
    pub sensors: Sensors,
    /// Hidden in the data.
    #[serde(default)]
    pub effects: Vec<HiddenEffect>,
}

/// An effect that the simulation hides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HiddenEffect {
    /// A name that `ndof list effects` prints.
    pub name: String,
    /// `robot`, `limb`, `sensor`, `actuator` or `environment`.
    pub side: String,
    /// The axis, all where absent.
    pub axis: Option<String>,
    /// By the names that `ndof list effects` prints.
    #[serde(default)]
    pub parameters: BTreeMap<String, toml::Value>,
}

/// Samples below which there is nothing to analyse, whatever the method.
const FEWEST_SAMPLES: f64 = 64.0;

impl ExperimentFile {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/experiment/1";

    /// Checks what the types do not.
    ///
    /// # Errors
    /// [`StudyError`] in the name of `file`.
    pub fn check(&self, file: &str) -> Result<(), StudyError> {
        check_schema(self.schema.as_deref(), Self::SCHEMA, file)?;
        let wrong = |what: String| Err(meaning(file, what));
        if self.trials == 0 {
            return wrong("trials = 0; at least one trial is needed".to_owned());
        }
        let samples = self.duration_s * self.sample_rate_hz;
        if !(samples.is_finite() && self.duration_s > 0.0 && samples >= FEWEST_SAMPLES) {
            return wrong(format!(
                "duration_s = {} at sample_rate_hz = {} makes {samples:.0} samples; at least {FEWEST_SAMPLES} are needed, tens of seconds are usual",
                self.duration_s, self.sample_rate_hz
            ));
        }
        crate::limits::simulation(self.trials, self.duration_s + self.discard_s.max(0.0), self.sample_rate_hz, 1).or_else(wrong)?;
        self.excitation.check().or_else(wrong)
    }

    /// Reads and checks an experiment; a perturbation that it replays is looked for beside it.
    ///
    /// # Errors
    /// [`StudyError`] with file and line.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let experiment: ExperimentFile = read(path)?;
        experiment.check(&path.display().to_string())?;
        Ok(experiment.beside(path.parent().unwrap_or_else(|| Path::new(""))))
    }

    /// The same with the robot's file and a perturbation that is replayed looked for beside `folder`, where the experiment's own file is.
    pub fn beside(mut self, folder: &Path) -> Self {
        self.excitation.folder = folder.to_owned();
        if let Some(file) = &mut self.device.file {
            *file = folder.join(file.as_str()).display().to_string();
        }
        self
    }

    /// The part that devices simulate.
    pub fn experiment(&self) -> Experiment {
        Experiment {
            seed: self.seed,
            trials: self.trials,
            duration_s: self.duration_s,
            sample_rate_hz: self.sample_rate_hz,
            discard_s: self.discard_s,
            device: self.device.clone(),
            limb: self.limb.clone(),
            posture: self.posture.clone(),
            controller: self.controller.clone(),
            sensors: self.sensors.clone(),
        }
    }
}

/// What holds where the file gives nothing.
fn given<const VALUE: u16, T: From<u16>>() -> T {
    VALUE.into()
}
