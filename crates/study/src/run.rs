//! A whole study: simulate (or take recordings), estimate, fit, compare with the truth.

use crate::Progress;
use crate::analysed::{COMMAND, analysed};
use crate::error::StudyError;
use crate::file::{HiddenEffect, StudyDocument, StudyFile};
use crate::moving::beside_the_truth;
use crate::sensitivity::result::SensitivityResult;
use crate::sensitivity::sensitivity;
use crate::simulate::{Simulated, draw_hidden, simulate};
use ndof_analysis::{ComparedParameter, Diagnosed, Estimate, Estimated, Fitted, RoleNames, Trial, Trials, Trim, diagnose};

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
    pub diagnosed: Option<Diagnosed>,
    /// What the study drew and hid for its reader to guess.
    pub hidden: Vec<HiddenEffect>,
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
    let mut hidden = Vec::new();
    let (simulated, trials) = match recordings {
        Some(trials) => (None, trials),
        None => {
            let mut experiment = study.experiment.clone();
            experiment.seed = seed.unwrap_or(experiment.seed);
            if let Some(count) = study.diagnose.as_ref().map(|asked| asked.hide).filter(|count| *count > 0) {
                hidden = draw_hidden(count, experiment.seed, &experiment.experiment().axes()?);
                experiment.effects.extend(hidden.iter().cloned());
            }
            let simulated = simulate(&experiment, progress)?;
            let trials = Trial::numbered("trial", simulated.recordings.iter().cloned());
            (Some(simulated), trials)
        }
    };
    let trials = Trials::new(trials, &RoleNames::default(), &Trim::default())?;
    let mut study = StudyFile { fit: study.fit_settings(), ..study.clone() };
    if let (Some(simulated), None) = (&simulated, study.fit.transducer_stiffness) {
        let transducer = &simulated.linear.transducer;
        (study.fit.transducer_stiffness, study.fit.transducer_damping) = (Some(transducer.stiffness), Some(transducer.damping));
    }
    let mut outcome = analyse(&study, trials, progress)?;
    let table = study.sensitivity.as_ref().filter(|_| simulated.is_some()).map(|section| sensitivity(&study, section, seed, progress));
    if let (Some(found), true) = (&mut outcome.fitted.result.schedule, simulated.is_some()) {
        beside_the_truth(found, &study.experiment)?;
    }
    (outcome.sensitivity, outcome.simulated, outcome.hidden) = (table.transpose()?, simulated, hidden);
    Ok(outcome)
}

/// Estimates, fits and diagnoses trials as a study asks.
///
/// # Errors
/// [`StudyError`] from the step that failed.
///
/// ```
/// use ndof_study::{analyse, file::StudyDocument};
/// # use ndof_analysis::{Trial, Trials};
/// # let force = ndof_signal::FilteredNoise::default().generate(1)?.remove(0);
/// # let mut state = [0.0; 2];
/// # let step = |f: &f64| {
/// #     let [x, v] = state;
/// #     let v = v + 0.002 * (f - 12.0 * v - 200.0 * x) / 2.0;
/// #     state = [x + 0.002 * v, v];
/// #     x
/// # };
/// # let motion: Vec<f64> = force.iter().map(step).collect();
/// let trial = Trial::new(500.0).effort("x", force).displacement("x", motion)?;
/// let study = StudyDocument::<()>::default();
/// let outcome = analyse(&study, Trials::of([&trial])?, &|_, _, _| ())?;
/// let stiffness = outcome.table().into_iter().find(|p| p.name.starts_with('K')).and_then(|p| p.value);
/// assert!(stiffness.is_some_and(|k| (k - 200.0).abs() < 10.0), "{stiffness:?}"); // N/m
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn analyse<E>(study: &StudyDocument<E>, trials: Trials, progress: &Progress<'_>) -> Result<StudyOutcome, StudyError> {
    let (steps, fit) = (1 + study.also.len(), study.fit_settings());
    let step = |k: usize, settings: &Estimate| -> Result<(Estimated, Fitted), StudyError> {
        let done = analysed(&trials, settings, &fit)?;
        progress("estimate", k + 1, steps);
        Ok(done)
    };
    let (estimated, fitted) = step(0, &study.estimate)?;
    let mut also = Vec::with_capacity(study.also.len());
    for (k, settings) in study.also.iter().enumerate() {
        let (estimated, fitted) = step(k + 1, settings)?;
        also.push((settings.name.clone().unwrap_or_else(|| format!("setting {}", k + 2)), estimated, fitted));
    }
    let diagnosed = study.diagnosis_settings().map(|settings| {
        progress("diagnose", 0, 1);
        let mut diagnosed = diagnose(&trials, &settings, &mut |_| ())?;
        diagnosed.result.head.command = COMMAND.to_owned();
        Ok::<_, StudyError>(diagnosed)
    });
    Ok(StudyOutcome { diagnosed: diagnosed.transpose()?, sensitivity: None, trials, simulated: None, estimated, fitted, also, hidden: Vec::new() })
}

impl StudyOutcome {
    /// What was simulated, where a limb's constant matrices are true of it: not of one whose matrices change as it moves.
    pub fn constants(&self) -> Option<&Simulated> {
        self.simulated.as_ref().filter(|simulated| !simulated.moves)
    }

    /// The table of the study: endpoint parameters, then those of the joints.
    pub fn table(&self) -> Vec<ComparedParameter> {
        self.fitted.table(|name| self.constants()?.truth.parameter(name))
    }
}
