//! The mechanical model, and its projection to the joints.

use crate::error::{raise, raise_study};
use crate::estimate::from_json;
use crate::recording::{PyRecording, Roles, Stretches, experiment, trials_of};
use crate::work;
use ndof::models::{self, InertiaDampingStiffnessModel, Transducer};
use ndof::study::file::{EstimateSection, KinematicsFile};
use ndof::study::result::{FitResult, to_json};
use ndof::study::{FitSettings, Fitted, fit_report};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

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

/// A file that people write, given as a path, or as the JSON of a dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Document {
    json: Option<String>,
    path: Option<PathBuf>,
}

impl Document {
    /// The path, where that is how it was given.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// What it says; `what` is its name in errors.
    pub fn parse<T: DeserializeOwned>(&self, what: &str) -> PyResult<Option<T>> {
        match (&self.json, &self.path) {
            (Some(text), _) => from_json(text, what).map(Some),
            (None, Some(path)) => ndof::study::file::read(path).map(Some).map_err(raise_study),
            (None, None) => Ok(None),
        }
    }
}

/// What a fit is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Model {
    model: Option<String>,
    band: Option<[f64; 2]>,
    cost: String,
    vaf_weight: String,
    transducer_stiffness: Option<f64>,
    transducer_damping: f64,
    kinematics: Document,
    compare: bool,
}

/// A word of an option as the enum that it stands for.
fn word<T: DeserializeOwned>(word: &str, option: &str) -> PyResult<T> {
    let parsed: Result<T, serde_json::Error> = serde_json::from_value(serde_json::Value::String(word.to_owned()));
    parsed.map_err(|error| raise(format!("{option}: {error}")))
}

impl Model {
    fn settings(self) -> PyResult<FitSettings> {
        Ok(FitSettings {
            model: self.model,
            band_hz: self.band,
            cost: word(&self.cost, "cost")?,
            vaf_weight: word(&self.vaf_weight, "vaf_weight")?,
            transducer: self.transducer_stiffness.map(|stiffness| Transducer { stiffness, damping: self.transducer_damping }),
            kinematics: self.kinematics.parse("kinematics")?,
            compare: self.compare,
            ..FitSettings::default()
        })
    }
}

/// Estimates and fits; returns the fit and its page.
#[pyfunction]
pub fn fit(
    py: Python<'_>,
    recordings: Vec<PyRecording<'_>>,
    roles: Roles,
    stretches: Stretches,
    settings: &str,
    model: Model,
    page: bool,
) -> PyResult<(Fit, Option<String>)> {
    let estimate = from_json::<EstimateSection>(settings, "fit")?.settings("fit").map_err(raise_study)?;
    let settings = FitSettings { estimator: estimate.estimator, ..model.settings()? };
    let (trials, samples) = trials_of(&recordings)?;
    let (fitted, page) = work::run(py, samples, None, move |_| {
        let trials = experiment(trials, roles, stretches)?;
        let estimated = ndof::study::estimate(&trials, &estimate, "fit").map_err(raise_study)?;
        let fitted = ndof::study::fit(&trials, &estimated, &settings, "fit").map_err(raise_study)?;
        let report = || fit_report(&trials, &estimated, &fitted, "Mechanical impedance", "ndof.fit").map(|report| report.to_html());
        let page = page.then(report).transpose().map_err(raise_study)?;
        Ok::<_, PyErr>((fitted, page))
    })??;
    Ok((Fit::from(fitted), page))
}

/// The fit with its matrices at the joints too.
#[pyfunction]
pub fn project(fit: &Fit, kinematics: Document) -> PyResult<Fit> {
    let file: KinematicsFile = kinematics.parse("kinematics")?.ok_or_else(|| raise("no kinematics; give a file or a dictionary"))?;
    let (_, joint) = ndof::study::project(&file, &fit.model, &fit.fit, &fit.mean_effort).map_err(raise_study)?;
    let result = FitResult { joint: Some(joint), ..fit.result.clone() };
    Ok(Fit { result, model: fit.model.clone(), fit: fit.fit.clone(), mean_effort: fit.mean_effort.clone() })
}
