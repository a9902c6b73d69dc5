//! Experiments, perturbations and whole studies.

use crate::document::Document;
use crate::error::{raise, raise_study};
use crate::estimate::{Estimate, from_json};
use crate::fit::Fit;
use crate::recording::{Parts, PyRecording, parts, trials_of};
use crate::work;
use ndof::analysis::result::to_json;
use ndof::analysis::{ComparedParameter, did_you_mean, nearest};
use ndof::devices::{DEVICES, LIMBS};
use ndof::joints::CAUSES;
use ndof::models::effects::EFFECTS;
use ndof::signal::Recording;
use ndof::studies::STUDIES;
use ndof::study::file::{ExperimentFile, StudyFile};
use ndof::study::{Design, RobotMotion, StudyOutcome, cases_report, run_cases, study_report, study_result};
use pyo3::prelude::*;
use std::collections::BTreeSet;
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
    let known: Vec<&str> = STUDIES.iter().map(|(known, _)| *known).collect();
    let suggestion = did_you_mean(nearest(&name, known.iter().copied()).as_deref());
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
        diagnosis_json: outcome.diagnosed.as_ref().map(|diagnosed| to_json(&diagnosed.result)).transpose().map_err(raise)?,
        truth_json: outcome.simulated.as_ref().map(|simulated| to_json(&simulated.truth)).transpose().map_err(raise)?,
    };
    let recordings = match outcome.simulated {
        Some(simulated) => named(py, "trial", simulated.recordings),
        None => outcome.trials.trials.iter().map(|trial| parts(py, &trial.file, trial.recording.clone(), Vec::new())).collect(),
    };
    Ok((done, recordings))
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
        let several = if outcomes.len() > 1 { cases_report(&outcomes, &result, &file.report, &heading, COMMAND).map_err(raise)? } else { None };
        let page = match (several, outcomes.first()) {
            (Some(report), _) => report.to_html(),
            (None, Some((_, outcome))) => study_report(outcome, &heading, COMMAND).map_err(raise)?.to_html(),
            (None, None) => String::new(),
        };
        Ok::<_, PyErr>((outcomes, to_json(&result).map_err(raise)?, page))
    })??;
    let cases = outcomes.into_iter().map(|(name, outcome)| case(py, name, outcome)).collect::<PyResult<_>>()?;
    Ok((title, result, page, cases))
}

/// What pages name as their command.
const COMMAND: &str = "ndof.study";

fn named<'py>(py: Python<'py>, what: &str, recordings: Vec<Recording>) -> Vec<Parts<'py>> {
    recordings.into_iter().enumerate().map(|(k, recording)| parts(py, &format!("{what} {}", k + 1), recording, Vec::new())).collect()
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
    Ok((named(py, "trial", simulated.recordings), truth))
}

/// Designs the perturbation of each trial, one channel `cmd_…` an axis; with it the result `ndof/design/1` as JSON. `settings` are the
/// long options of `ndof design`.
#[pyfunction]
pub fn design<'py>(py: Python<'py>, settings: &str, experiment: Option<Document>, progress: Option<Bound<'py, PyAny>>) -> PyResult<(Vec<Parts<'py>>, String)> {
    let experiment = experiment.map(|document| document.experiment()).transpose()?;
    let settings = Design { experiment, ..from_json(settings, "design")? };
    let designed = work::run(py, usize::MAX, progress.as_ref(), move |reporter| {
        ndof::study::design(&settings, &|what, done, total| reporter.report(what, done, total)).map_err(raise_study)
    })??;
    Ok((named(py, "perturbation", designed.recordings), to_json(&designed.result).map_err(raise)?))
}

/// Designs the motion of a robot's joints, one recording; with it the result `ndof/excitation/1` as JSON.
#[pyfunction]
pub fn excite<'py>(py: Python<'py>, settings: &str, progress: Option<Bound<'py, PyAny>>) -> PyResult<(Vec<Parts<'py>>, String)> {
    let settings: RobotMotion = from_json(settings, "design")?;
    let excited = work::run(py, usize::MAX, progress.as_ref(), move |_| settings.run().map_err(raise_study))??;
    Ok((named(py, "motion", vec![excited.recording]), to_json(&excited.result).map_err(raise)?))
}

/// The keys of a task's settings: `estimate`, `fit`, `diagnose` or `design`.
#[pyfunction]
pub fn settings(task: &str) -> PyResult<Vec<String>> {
    let settings = match task {
        "estimate" => serde_json::to_value(ndof::Estimate::default()),
        "fit" => serde_json::to_value(ndof::Fit::default()),
        "diagnose" => serde_json::to_value(ndof::Diagnose::default()),
        "design" => serde_json::to_value((Design::default(), RobotMotion::default())),
        _ => return Err(raise(format!("no task \"{task}\"; there are estimate, fit, diagnose and design"))),
    };
    let settings = settings.map_err(raise)?;
    // Two structs where a task has two kinds.
    let structs = settings.as_array().cloned().unwrap_or_else(|| vec![settings]);
    let keys: BTreeSet<String> = structs.iter().filter_map(|one| one.as_object()).flat_map(|keys| keys.keys().cloned()).collect();
    Ok(keys.into_iter().collect())
}

/// Names with a line on each, of `effects`, `joints`, `devices`, `limbs` or `studies`.
#[pyfunction]
pub fn registry(what: &str) -> PyResult<Vec<(String, String)>> {
    let pair = |name: &str, what: &str| (name.to_owned(), what.to_owned());
    Ok(match what {
        "effects" => EFFECTS.iter().map(|effect| pair(effect.card.name, effect.card.what)).collect(),
        "joints" => CAUSES.iter().map(|cause| pair(cause.card.name, cause.card.what)).collect(),
        "devices" => DEVICES.iter().map(|device| pair(device.name, device.description)).collect(),
        "limbs" => LIMBS.iter().map(|limb| pair(limb.name, limb.description)).collect(),
        "studies" => STUDIES.iter().map(|(name, text)| pair(name, text.lines().next().unwrap_or_default().trim_start_matches("# "))).collect(),
        _ => return Err(raise(format!("no list \"{what}\"; there are effects, joints, devices, limbs and studies"))),
    })
}
