//! A whole study: simulate (or take recordings), estimate, fit, compare with the truth.

use super::riddle::draw_hidden;
use super::sensitivity::sensitivity;
use super::simulate::axis_names;
use super::{Estimated, FitSettings, Fitted, Progress, Simulated, Truth, diagnose_with_pictures, estimate, fit, simulate};
use crate::error::StudyError;
use crate::file::{EstimateSection, HiddenEffect, StudyFile};
use crate::result::{DiagnosisResult, SensitivityResult};
use crate::roles::RoleNames;
use crate::trials::{Trial, Trials};
use crate::trim::Trim;
use ndof_diagnose::Pictures;
use ndof_models::Transducer;
use ndof_signal::Recording;

/// What a study gave.
#[derive(Clone, Debug)]
pub struct StudyOutcome {
    /// The trials that were analysed.
    pub trials: Trials,
    /// What was simulated, unless recordings were given.
    pub simulated: Option<Simulated>,
    /// The estimate.
    pub estimated: Estimated,
    /// The fit to it.
    pub fitted: Fitted,
    /// Other settings of the estimate, by name, each with its fit.
    pub also: Vec<(String, Estimated, Fitted)>,
    /// What pre-compensation by a wrong model does, where the study asks for it and is simulated.
    pub sensitivity: Option<SensitivityResult>,
    /// What a linear model misses, where the study asks for it.
    pub diagnosis: Option<DiagnosisResult>,
    /// The samples that show it.
    pub pictures: Option<Pictures>,
    /// What the study drew and hid for its reader to guess.
    pub riddle: Vec<HiddenEffect>,
}

/// One line of the table: a parameter, what was simulated and what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedParameter {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What was simulated, if that is known.
    pub truth: Option<f64>,
    /// What was found.
    pub value: Option<f64>,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether the data say anything about it.
    pub identifiable: bool,
}

/// Runs a study; `recordings` (with the names of their files) take the place of the simulation.
///
/// # Errors
/// [`StudyError`] from the step that failed.
///
/// ```
/// use ndof_study::{file::StudyFile, run_study};
///
/// let study = StudyFile::parse(r#"
///     [experiment]
///     duration_s = 20.0
///     [experiment.device.robot]
///     schema = "ndof/robot/1"
///     name = "slide"
///     axes = ["x"]
///     joints = [{ name = "carriage", kind = "prismatic", axis = [1.0, 0.0, 0.0], mass_kg = 1.0, gear_ratio = 10.0 }]
///     [experiment.limb]
///     name = "endpoint-linear"
///     M = [[2.0]]
///     B = [[12.0]]
///     K = [[300.0]]
///     [estimate]
///     method = "welch"
///     nperseg = 1024
///     [fit]
///     band_hz = [0.5, 10.0]
/// "#, "slide.toml")?;
/// let outcome = run_study(&study, None, None, &|_, _, _| ())?;
/// let stiffness = outcome.table().into_iter().find(|p| p.name == "K").and_then(|p| p.value);
/// assert!(stiffness.is_some_and(|k| (k - 300.0).abs() < 15.0)); // N/m
/// # Ok::<(), ndof_study::StudyError>(())
/// ```
pub fn run_study(study: &StudyFile, recordings: Option<Vec<Trial>>, seed: Option<u64>, progress: &Progress<'_>) -> Result<StudyOutcome, StudyError> {
    let mut riddle = Vec::new();
    let (simulated, trials) = match recordings {
        Some(trials) => (None, trials),
        None => {
            let mut experiment = study.experiment.clone();
            experiment.seed = seed.unwrap_or(experiment.seed);
            if let Some(count) = study.diagnose.as_ref().map(|section| section.hide).filter(|count| *count > 0) {
                riddle = draw_hidden(count, experiment.seed, &axis_names(&experiment)?);
                experiment.effects.extend(riddle.iter().cloned());
            }
            let simulated = simulate(&experiment, progress)?;
            let trials = simulated.recordings.iter().enumerate().map(|(k, recording)| as_trial(k, recording)).collect();
            (Some(simulated), trials)
        }
    };
    let trials = Trials::new(trials, &RoleNames::default(), &Trim::default())?;
    let mut fit_settings = study.fit_settings();
    fit_settings.transducer = simulated.as_ref().map(|s| Transducer { stiffness: s.linear.transducer.stiffness, damping: s.linear.transducer.damping });
    let steps = 1 + study.also.len();
    let analyse = |k: usize, section: &EstimateSection| -> Result<(Estimated, Fitted), StudyError> {
        let done = analysed(&trials, section, &fit_settings)?;
        progress("estimate", k + 1, steps);
        Ok(done)
    };
    let (estimated, fitted) = analyse(0, &study.estimate)?;
    let mut also = Vec::with_capacity(study.also.len());
    for (k, section) in study.also.iter().enumerate() {
        let (estimated, fitted) = analyse(k + 1, section)?;
        also.push((section.name.clone().unwrap_or_else(|| format!("setting {}", k + 2)), estimated, fitted));
    }
    let diagnosis = study.diagnose.as_ref().map(|section| {
        progress("diagnose", 0, 1);
        diagnose_with_pictures(&trials, &section.settings(), "study", &mut |_| ())
    });
    let (diagnosis, pictures) = diagnosis.transpose()?.unzip();
    let table = study.sensitivity.as_ref().filter(|_| simulated.is_some()).map(|section| sensitivity(study, section, seed, &fit_settings, progress));
    Ok(StudyOutcome { diagnosis, pictures, sensitivity: table.transpose()?, trials, simulated, estimated, fitted, also, riddle })
}

/// The estimate of trials with a section's settings, and the fit to it.
pub(super) fn analysed(trials: &Trials, section: &EstimateSection, fit_settings: &FitSettings) -> Result<(Estimated, Fitted), StudyError> {
    let estimated = estimate(trials, &section.settings("the study")?, "study")?;
    let fitted = fit(trials, &estimated, fit_settings, "study")?;
    Ok((estimated, fitted))
}

pub(super) fn as_trial(k: usize, recording: &Recording) -> Trial {
    Trial { file: format!("trial {}", k + 1), recording: recording.clone(), warnings: Vec::new() }
}

impl StudyOutcome {
    /// The table of the study: endpoint parameters, then those of the joints.
    pub fn table(&self) -> Vec<ComparedParameter> {
        compare(&self.fitted, self.simulated.as_ref().map(|s| &s.truth))
    }
}

/// The parameters of a fit, those at the joints last, beside the truth.
pub fn compare(fitted: &Fitted, truth: Option<&Truth>) -> Vec<ComparedParameter> {
    let joint = fitted.result.joint.iter().flat_map(|joint| &joint.parameters);
    let compared = |p: &crate::result::fit::Parameter| ComparedParameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        truth: truth.and_then(|truth| truth.parameter(&p.name)),
        value: p.value,
        ci95: p.ci95,
        identifiable: p.identifiable,
    };
    fitted.result.parameters.iter().chain(joint).map(compared).collect()
}

impl Truth {
    /// The simulated value of the parameter called `K_x_y` (`K` for one axis), at the endpoint or at the joints.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        let joint = self.joint.as_ref().map(|joint| (&joint.axes, &joint.matrices));
        std::iter::once((&self.axes, &self.endpoint)).chain(joint).find_map(|(axes, matrices)| {
            let (matrix, entry) = name.split_at_checked(1)?;
            let matrix = match matrix {
                "M" => &matrices.M,
                "B" => &matrices.B,
                "K" => &matrices.K,
                _ => return None,
            };
            let n = axes.len();
            let index = (0..n * n).find(|k| entry == format!("_{}_{}", axes[k / n], axes[k % n]) || (n == 1 && entry.is_empty()))?;
            Some(matrix[index / n][index % n])
        })
    }
}
