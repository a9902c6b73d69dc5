//! Checking recordings, and what a simulation gets wrong.

use crate::error::{raise, raise_study};
use crate::estimate::from_json;
use crate::recording::{PyRecording, Roles, Stretches, experiment, role_names, trials_of};
use crate::work;
use ndof::study::file::BaselineFile;
use ndof::study::result::to_json;
use ndof::study::{DiagnoseSettings, HoldOut, diagnose_with_pictures, diagnosis_report};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Looks at every channel of every recording: the result `ndof/check/1` as JSON.
#[pyfunction]
pub fn check(py: Python<'_>, recordings: Vec<PyRecording<'_>>, roles: Roles) -> PyResult<String> {
    let (trials, samples) = trials_of(&recordings)?;
    work::run(py, samples, None, move |_| to_json(&ndof::study::check(&trials, &role_names(roles), "check")).map_err(raise))?
}

/// What a diagnosis is asked.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Question {
    band: Option<(f64, f64)>,
    held_out_files: Vec<String>,
    held_out_s: Option<(f64, f64)>,
    tolerance: Option<f64>,
    seed: Option<u64>,
    without: Vec<String>,
    baseline_json: Option<String>,
    baseline_file: Option<PathBuf>,
}

impl Question {
    fn settings(self) -> PyResult<DiagnoseSettings> {
        let default = DiagnoseSettings::default();
        let baseline = match (self.baseline_json, self.baseline_file) {
            (Some(text), _) => Some(from_json::<BaselineFile>(&text, "baseline")?),
            (None, Some(path)) => Some(ndof::study::file::read::<BaselineFile>(&path).map_err(raise_study)?),
            (None, None) => None,
        };
        Ok(DiagnoseSettings {
            band_hz: self.band,
            held_out: match self.held_out_s {
                Some((from, to)) => HoldOut::Time(from, to),
                None if self.held_out_files.is_empty() => HoldOut::Auto,
                None => HoldOut::Files(self.held_out_files),
            },
            tolerance: self.tolerance.unwrap_or(default.tolerance),
            seed: self.seed.unwrap_or(default.seed),
            without: self.without,
            plan: default.plan,
            baseline,
        })
    }
}

/// Says what the baseline gets wrong, and why: the result `ndof/diagnosis/1` as JSON, and the page.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    recordings: Vec<PyRecording<'_>>,
    roles: Roles,
    stretches: Stretches,
    question: Question,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<(String, String)> {
    let settings = question.settings()?;
    let (trials, samples) = trials_of(&recordings)?;
    // Even a short record takes seconds.
    work::run(py, samples + work::SMALL, progress.as_ref(), move |reporter| {
        let trials = experiment(trials, roles, stretches)?;
        let (result, pictures) = diagnose_with_pictures(&trials, &settings, "diagnose", &mut |what| reporter.report(what, 0, 0)).map_err(raise_study)?;
        let page = diagnosis_report(&trials, &result, &pictures, "What the simulation gets wrong", "ndof.diagnose").map_err(raise_study)?;
        Ok((to_json(&result).map_err(raise)?, page.to_html()))
    })?
}
