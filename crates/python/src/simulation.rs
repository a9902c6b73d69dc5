//! Experiments, perturbations and whole studies.

use crate::error::{raise, raise_study};
use crate::estimate::{Estimate, from_json};
use crate::fit::{Document, Fit};
use crate::recording::{Parts, PyRecording, parts, trials_of};
use crate::work;
use ndof::devices::{DEVICES, LIMBS};
use ndof::models::effects::EFFECTS;
use ndof::signal::Recording;
use ndof::studies::STUDIES;
use ndof::study::file::{Excitation, ExperimentFile, StudyFile};
use ndof::study::result::design::DesignedTrial;
use ndof::study::result::to_json;
use ndof::study::{ComparedParameter, DesignSettings, Limits, LooseLimb, StudyOutcome, Trial, cases_report, nearest, run_cases, study_report, study_result};
use pyo3::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// The text of the built-in study called `name`.
fn built_in(name: &Path) -> Option<(&'static str, &'static str)> {
    STUDIES.iter().find(|(known, _)| name.as_os_str() == *known).copied()
}

/// The error for a study that is neither built in nor a file.
fn unknown(name: &Path) -> Option<PyErr> {
    if name.exists() || name.extension().is_some() {
        return None;
    }
    let name = name.display().to_string();
    let suggestion = nearest(&name, STUDIES.iter().map(|(known, _)| *known)).map(|s| format!(" (did you mean \"{s}\"?)")).unwrap_or_default();
    let known: Vec<&str> = STUDIES.iter().map(|(known, _)| *known).collect();
    Some(raise(format!("no study \"{name}\"{suggestion}; built in: {}; or give a file, STUDY.toml", known.join(", "))))
}

impl Document {
    fn experiment(&self) -> PyResult<ExperimentFile> {
        if let Some((name, text)) = self.path().and_then(built_in) {
            return StudyFile::parse(text, name).map(|study| study.experiment).map_err(raise_study);
        }
        if let Some(error) = self.path().and_then(unknown) {
            return Err(error);
        }
        let file: ExperimentFile = self.parse("experiment")?.ok_or_else(|| raise("no experiment; give a name, a file or a dictionary"))?;
        file.check("experiment").map_err(raise_study)?;
        Ok(file)
    }

    fn study(&self) -> PyResult<StudyFile> {
        match self.path() {
            Some(path) => match built_in(path) {
                Some((name, text)) => StudyFile::parse(text, name).map_err(raise_study),
                None => unknown(path).map_or_else(|| StudyFile::read(path).map_err(raise_study), Err),
            },
            None => {
                let study: StudyFile = self.parse("study")?.ok_or_else(|| raise("no study; give a name, a file or a dictionary"))?;
                study.experiment.check("study").map_err(raise_study)?;
                Ok(study)
            }
        }
    }
}

/// One case of a study: its results, and its table.
#[pyclass(frozen, module = "ndof._ndof", get_all)]
pub struct Case {
    name: String,
    estimate: Py<Estimate>,
    fit: Py<Fit>,
    diagnosis_json: Option<String>,
    truth_json: Option<String>,
    table: Vec<Row>,
}

/// Name, unit, truth, value, interval, whether the data say anything about it.
type Row = (String, String, Option<f64>, Option<f64>, Option<[f64; 2]>, bool);

fn row(p: ComparedParameter) -> Row {
    (p.name, p.unit, p.truth, p.value, p.ci95, p.identifiable)
}

/// A case with its recordings.
type CaseParts<'py> = (Case, Vec<Parts<'py>>);

fn case<'py>(py: Python<'py>, name: String, outcome: StudyOutcome) -> PyResult<CaseParts<'py>> {
    let done = Case {
        name,
        table: outcome.table().into_iter().map(row).collect(),
        estimate: Py::new(py, Estimate(Arc::new(outcome.estimated.result)))?,
        fit: Py::new(py, Fit::from(outcome.fitted))?,
        diagnosis_json: outcome.diagnosis.as_ref().map(to_json).transpose().map_err(raise)?,
        truth_json: outcome.simulated.as_ref().map(|simulated| to_json(&simulated.truth)).transpose().map_err(raise)?,
    };
    let trials = match outcome.simulated {
        Some(simulated) => named("trial", simulated.recordings),
        None => outcome.trials.trials,
    };
    Ok((done, recordings_of(py, trials)))
}

/// Runs a study: its title, its result `ndof/study/1` as JSON, its page, and its cases. `recordings` take the place of
/// the simulation.
#[pyfunction]
pub fn study<'py>(
    py: Python<'py>,
    document: Document,
    recordings: Option<Vec<PyRecording<'py>>>,
    seed: Option<u64>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(String, String, String, Vec<CaseParts<'py>>)> {
    let file = document.study()?;
    let given = recordings.map(|recordings| trials_of(&recordings)).transpose()?.map(|(trials, _)| trials);
    let title = file.title.clone().unwrap_or_else(|| "A study".to_owned());
    let heading = title.clone();
    let (outcomes, result, page) = work::run(py, usize::MAX, progress.as_ref(), move |reporter| {
        let outcomes = run_cases(&file, given, seed, &|what, done, total| reporter.report(what, done, total)).map_err(raise_study)?;
        let result = study_result(&file, &outcomes).map_err(raise_study)?;
        let several = if outcomes.len() > 1 { cases_report(&outcomes, &result, &file.report, &heading, COMMAND).map_err(raise_study)? } else { None };
        let page = match (several, outcomes.first()) {
            (Some(report), _) => report.to_html(),
            (None, Some((_, outcome))) => study_report(outcome, &heading, COMMAND).map_err(raise_study)?.to_html(),
            (None, None) => String::new(),
        };
        Ok::<_, PyErr>((outcomes, to_json(&result).map_err(raise)?, page))
    })??;
    let cases = outcomes.into_iter().map(|(name, outcome)| case(py, name, outcome)).collect::<PyResult<_>>()?;
    Ok((title, result, page, cases))
}

/// What pages name as their command.
const COMMAND: &str = "ndof.study";

fn recordings_of(py: Python<'_>, trials: Vec<Trial>) -> Vec<Parts<'_>> {
    trials.into_iter().map(|Trial { file, recording, .. }| parts(py, &file, recording, Vec::new())).collect()
}

fn named(what: &str, recordings: Vec<Recording>) -> Vec<Trial> {
    recordings.into_iter().enumerate().map(|(k, recording)| Trial { file: format!("{what} {}", k + 1), recording, warnings: Vec::new() }).collect()
}

/// Simulates every trial of an experiment: recordings and the truth as JSON.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    document: Document,
    seed: Option<u64>,
    trials: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Vec<Parts<'py>>, String)> {
    let mut file = document.experiment()?;
    file.seed = seed.unwrap_or(file.seed);
    file.trials = trials.unwrap_or(file.trials);
    file.check("experiment").map_err(raise_study)?;
    let simulated = work::run(py, usize::MAX, progress.as_ref(), move |reporter| {
        ndof::study::simulate(&file, &|what, done, total| reporter.report(what, done, total)).map_err(raise_study)
    })??;
    let truth = to_json(&simulated.truth).map_err(raise)?;
    Ok((recordings_of(py, named("trial", simulated.recordings)), truth))
}

/// Seed of a perturbation, and the largest coherence between its axes where there was a search.
type Drawn = (u64, Option<f64>);

/// Designs the perturbation of each trial, one channel `cmd_…` an axis; with it, the seeds and the coherences found.
#[pyfunction]
#[pyo3(signature = (excitation, axes, rotational, trials, duration_s, sample_rate_hz, fade_s, seed, progress))]
#[expect(clippy::too_many_arguments, reason = "every setting once, as Python writes them")]
pub fn design<'py>(
    py: Python<'py>,
    excitation: &str,
    axes: Vec<String>,
    rotational: bool,
    trials: usize,
    duration_s: f64,
    sample_rate_hz: f64,
    fade_s: f64,
    seed: u64,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Vec<Parts<'py>>, Vec<Drawn>)> {
    let excitation: Excitation = from_json(excitation, "design")?;
    let samples = (duration_s * sample_rate_hz).round();
    if !(samples.is_finite() && samples >= 1.0) {
        return Err(raise(format!("duration_s={duration_s} at sample_rate_hz={sample_rate_hz}: nothing to design; give positive numbers")));
    }
    let [low, high] = excitation.search_band_hz;
    let searched = excitation.candidates > 1;
    let settings = DesignSettings {
        excitation: Excitation { fade_s, ..excitation },
        axes,
        rotational,
        trials,
        duration_s,
        lead_in_s: 0.0,
        sample_rate_hz,
        seed,
        band_hz: (low, high),
        experiment: None,
        limbs: LooseLimb::soft_and_stiff(rotational),
        limits: Limits::default(),
        targets: Vec::new(),
        fit_band_hz: [0.5, 8.0],
    };
    let designed = work::run(py, usize::MAX, progress.as_ref(), move |reporter| {
        ndof::study::design(&settings, "design", &|what, done, total| reporter.report(what, done, total)).map_err(raise_study)
    })??;
    let coherence = |trial: &DesignedTrial| trial.coherence.as_ref().filter(|_| searched).map(|c| c.commanded.max);
    let found = designed.result.trials.iter().map(|trial| (trial.seed.unwrap_or(seed), coherence(trial))).collect();
    Ok((recordings_of(py, named("perturbation", designed.recordings)), found))
}

/// Names with a line on each, of `effects`, `devices`, `limbs` or `studies`.
#[pyfunction]
pub fn registry(what: &str) -> PyResult<Vec<(String, String)>> {
    let pair = |name: &str, what: &str| (name.to_owned(), what.to_owned());
    Ok(match what {
        "effects" => EFFECTS.iter().map(|effect| pair(effect.card().name, effect.card().what)).collect(),
        "devices" => DEVICES.iter().map(|device| pair(device.name, device.description)).collect(),
        "limbs" => LIMBS.iter().map(|limb| pair(limb.name, limb.description)).collect(),
        "studies" => STUDIES.iter().map(|(name, text)| pair(name, text.lines().next().unwrap_or_default().trim_start_matches("# "))).collect(),
        _ => return Err(raise(format!("no list \"{what}\"; there are effects, devices, limbs and studies"))),
    })
}
