//! The mechanical model, and its projection to the joints.

use crate::document::Document;
use crate::error::{raise, raise_analysis};
use crate::estimate::from_json;
use crate::recording::{PyRecording, Roles, Stretches, experiment_with, trials_of};
use crate::work;
use ndof::analysis::Fitted;
use ndof::analysis::file::KinematicsFile;
use ndof::analysis::fit::result::FitResult;
use ndof::analysis::result::to_json;
use ndof::models::{self, InertiaDampingStiffnessModel};
use ndof::report::fit_report;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// A fit: the result `ndof/fit/1`, and what its projection needs.
#[pyclass(frozen, module = "ndof._ndof")]
pub struct Fit {
    result: FitResult,
    model: InertiaDampingStiffnessModel,
    fit: models::Fit,
    mean_effort: Vec<f64>,
}

impl From<Fitted> for Fit {
    fn from(fitted: Fitted) -> Self {
        Fit { result: fitted.result, model: fitted.model, fit: fitted.fit, mean_effort: fitted.mean_effort }
    }
}

#[pymethods]
impl Fit {
    /// The result as the command line writes it.
    fn to_json(&self) -> PyResult<String> {
        to_json(&self.result).map_err(raise)
    }

    /// Result and covariance as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = (self.to_json()?, &self.model, &self.fit, &self.mean_effort);
        Ok(PyBytes::new(py, &postcard::to_stdvec(&state).map_err(raise)?))
    }

    /// From those bytes.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        let failed = |error| raise(format!("these bytes are not a fit of this version of ndof: {error}"));
        let (json, model, fit, mean_effort): (String, _, _, _) = postcard::from_bytes(bytes).map_err(failed)?;
        Ok(Fit { result: from_json(&json, "a fit")?, model, fit, mean_effort })
    }
}

/// Estimates and fits; returns the fit and its page. `estimate` and `fit` are the long options of `ndof fit`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "every setting once, as Python writes them")]
pub fn fit(
    py: Python<'_>,
    recordings: Vec<PyRecording<'_>>,
    roles: Roles,
    stretches: Stretches,
    estimate: &str,
    fit: &str,
    kinematics: Document,
    page: bool,
) -> PyResult<(Fit, Option<String>)> {
    let estimate: ndof::Estimate = from_json(estimate, "fit")?;
    let settings = ndof::Fit { kinematics: kinematics.parse("kinematics")?, ..from_json(fit, "fit")? };
    let (trials, samples) = trials_of(&recordings)?;
    let (fitted, page) = work::run(py, samples, None, move |_| {
        let trials = experiment_with(trials, roles, stretches, settings.channels())?;
        let estimated = if page { ndof::analysis::estimate(&trials, &estimate) } else { ndof::analysis::estimate_to_fit(&trials, &estimate, &settings) };
        let estimated = estimated.map_err(raise_analysis)?;
        let fitted = settings.run(&estimated).map_err(raise_analysis)?;
        let report = || fit_report(&estimated, &fitted, "Mechanical impedance", "ndof.fit").map(|report| report.to_html());
        let page = page.then(report).transpose().map_err(raise)?;
        Ok::<_, PyErr>((fitted, page))
    })??;
    Ok((Fit::from(fitted), page))
}

/// The fit with its matrices at the joints too.
#[pyfunction]
pub fn project(fit: &Fit, kinematics: Document) -> PyResult<Fit> {
    let file: KinematicsFile = kinematics.parse("kinematics")?.ok_or_else(|| raise("no kinematics; give a file or a dictionary"))?;
    let (_, joint) = ndof::analysis::project(&file, &fit.model, &fit.fit, &fit.mean_effort).map_err(raise_analysis)?;
    let mut result = FitResult { joint: Some(joint), ..fit.result.clone() };
    if let Some(asked) = &mut result.settings {
        asked.fit.kinematics = Some(file);
    }
    Ok(Fit { result, model: fit.model.clone(), fit: fit.fit.clone(), mean_effort: fit.mean_effort.clone() })
}
