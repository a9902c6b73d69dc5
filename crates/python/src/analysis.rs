//! Checking recordings, and what a simulation gets wrong.

use crate::document::Document;
use crate::error::{raise, raise_analysis};
use crate::estimate::from_json;
use crate::recording::{PyRecording, Roles, Stretches, experiment_with, role_names, trials_of, trim};
use crate::work;
use ndof::analysis::result::to_json;
use ndof::analysis::{AddedEffort, RoleNames, Trials};
use ndof::diagnose::Stretch;
use ndof::report::diagnosis_report;
use ndof::{Diagnose, Trial};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use std::path::Path;

/// Looks at every channel of every recording: the result `ndof/check/1` as JSON.
#[pyfunction]
pub fn check(py: Python<'_>, recordings: Vec<PyRecording<'_>>, roles: Roles, stretches: Stretches) -> PyResult<String> {
    let (trials, samples) = trials_of(&recordings)?;
    let trim = trim(stretches);
    work::run(py, samples, None, move |_| {
        let mut looked_at = Vec::new();
        for Trial { recording, file, warnings } in trials {
            let parts = trim.apply(recording, &file).map_err(raise_analysis)?;
            looked_at.extend(parts.into_iter().map(|recording| Trial { recording, file: file.clone(), warnings: warnings.clone() }));
        }
        to_json(&ndof::analysis::check(&looked_at, &role_names(roles))).map_err(raise)
    })?
}

/// Channels of effort, what a simulator is to be given along each trial `[trial][axis]`, and what was held out: trial, first sample, end.
type Added<'py> = (Vec<String>, Vec<Vec<Bound<'py, PyArray1<f64>>>>, Vec<(usize, usize, usize)>);

/// Says what the baseline gets wrong, and why: the result `ndof/diagnosis/1` as JSON, and the page; `settings` are the long options of
/// `ndof diagnose`. Of a simulator also the effort with which its next run is to show it.
#[pyfunction]
pub fn diagnose<'py>(
    py: Python<'py>,
    recordings: Vec<PyRecording<'_>>,
    roles: Roles,
    stretches: Stretches,
    settings: &str,
    baseline: Document,
    kinematics: Document,
    robot: Option<(String, Option<String>)>,
    simulated: Vec<PyRecording<'_>>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(String, String, Option<Added<'py>>)> {
    let mut settings = Diagnose { baseline: baseline.parse("baseline")?, kinematics: kinematics.parse("kinematics")?, ..from_json(settings, "diagnose")? };
    let (trials, samples) = trials_of(&recordings)?;
    settings.robot = robot.map(|(file, tip)| ndof::analysis::file::robot(Path::new(&file), tip.as_deref())).transpose().map_err(raise_analysis)?;
    let (simulated, _) = trials_of(&simulated)?;
    // Even a short record takes seconds.
    let (result, page, added) = work::run(py, samples + work::SMALL, progress.as_ref(), move |reporter| {
        let channels = settings.channels();
        let logged = |own| Trials::simulated(own, &RoleNames { kept: channels.clone(), ..role_names(roles.clone()) }, &trim(stretches.clone()));
        let simulated = if simulated.is_empty() { None } else { Some(logged(simulated).map_err(raise_analysis)?) };
        let trials = experiment_with(trials, roles, stretches, channels)?;
        let mut progress = |what: &str| reporter.report(what, 0, 0);
        let diagnosed = match &simulated {
            Some(simulated) => ndof::analysis::diagnose_simulator(&trials, simulated, &settings, &mut progress),
            None => ndof::analysis::diagnose(&trials, &settings, &mut progress),
        };
        let diagnosed = diagnosed.map_err(raise_analysis)?;
        let page = diagnosis_report(&diagnosed, "What the simulation gets wrong", "ndof.diagnose").map_err(raise)?;
        Ok::<_, PyErr>((to_json(&diagnosed.result).map_err(raise)?, page.to_html(), diagnosed.added))
    })??;
    Ok((result, page, added.map(|added| for_python(py, added))))
}

fn for_python(py: Python<'_>, AddedEffort { channels, efforts, held_out }: AddedEffort) -> Added<'_> {
    let whole = |t: usize| efforts[t].first().map_or(0, Vec::len);
    let held = match held_out {
        Stretch::Trials(trials) => trials.into_iter().map(|t| (t, 0, whole(t))).collect(),
        Stretch::Samples(range) => (0..efforts.len()).map(|t| (t, range.start, range.end.min(whole(t)))).collect(),
    };
    (channels, efforts.into_iter().map(|trial| trial.into_iter().map(|series| series.into_pyarray(py)).collect()).collect(), held)
}
