//! The frequency response: settings in, the contract's result and its arrays out.

use crate::error::{raise, raise_analysis};
use crate::recording::{PyRecording, Roles, Stretches, experiment_with, trials_of};
use crate::work;
use ndof::analysis::estimate::result::{Coherence, EstimateResult, Response};
use ndof::analysis::result::{to_json, word};
use numpy::{IntoPyArray, PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyAny;
use serde::de::DeserializeOwned;
use std::sync::Arc;

/// A value of settings that Python wrote as JSON; `what` is their name in errors.
pub fn from_json<T: DeserializeOwned>(text: &str, what: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| {
        // The place in a text that nobody wrote says nothing.
        let message = error.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
        raise(format!("{what}: {message}"))
    })
}

/// A frequency response with its coherences and confidence, as the result `ndof/estimate/1`.
#[pyclass(frozen, module = "ndof._ndof")]
pub struct Estimate(pub Arc<EstimateResult>);

impl Estimate {
    fn response(&self, which: &str) -> PyResult<&Response> {
        match (which, &self.0.derived) {
            ("direct", _) => Ok(&self.0.direct.response),
            ("derived", Some(derived)) => Ok(&derived.response),
            ("derived", None) => Err(raise("there is no derived estimate: the recordings have no reference channels (cmd_…)")),
            _ => Err(raise(format!("no estimate \"{which}\"; there are direct and derived"))),
        }
    }

    fn coherence(&self, which: &str) -> PyResult<&Coherence> {
        self.response(which.split('-').next().unwrap_or(which))?;
        match (which, &self.0.derived) {
            ("derived-paper", Some(derived)) => Ok(&derived.coherence_paper),
            ("derived", Some(derived)) => Ok(&derived.coherence_iv),
            _ => Ok(&self.0.direct.coherence),
        }
    }
}

#[pymethods]
impl Estimate {
    /// The result as the command line writes it.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| to_json(&*self.0)).map_err(raise)
    }

    /// From that text.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Ok(Estimate(Arc::new(from_json(text, "an estimate")?)))
    }

    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.0.inputs.clone()
    }

    #[getter]
    fn outputs(&self) -> Vec<String> {
        self.0.outputs.clone()
    }

    #[getter]
    fn references(&self) -> Vec<String> {
        self.0.references.clone()
    }

    #[getter]
    fn units(&self) -> (Vec<String>, Vec<String>) {
        (self.0.units.inputs.clone(), self.0.units.outputs.clone())
    }

    #[getter]
    fn kind(&self) -> String {
        word(&self.0.response)
    }

    #[getter]
    fn has_derived(&self) -> bool {
        self.0.derived.is_some()
    }

    #[getter]
    fn effective_averages(&self) -> f64 {
        self.0.method.effective_averages
    }

    #[getter]
    fn warnings(&self) -> Vec<(String, String, String)> {
        self.0.head.warnings.iter().map(|w| (w.code.clone(), w.message.clone(), w.action.clone())).collect()
    }

    /// Coherences that chance alone exceeds once in twenty: ordinary, partial, multiple.
    #[getter]
    fn significance_95(&self) -> (Option<f64>, Option<f64>, Option<f64>) {
        let s = &self.0.significance_95;
        (s.ordinary, s.partial, s.multiple)
    }

    #[getter]
    fn frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.frequency_hz.to_pyarray(py)
    }

    #[getter]
    fn input_condition_number<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.input_condition_number.iter().map(|v| v.unwrap_or(f64::NAN)).collect::<Vec<_>>().into_pyarray(py)
    }

    #[getter]
    fn input_coherence<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.0.input_coherence.to_pyarray(py).into_any()
    }

    /// An array of the response `which` (`direct`, `derived`) by the name that the contract gives it.
    fn array<'py>(&self, py: Python<'py>, which: &str, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let response = self.response(which)?;
        Ok(match name {
            "re" => response.re.to_pyarray(py).into_any(),
            "im" => response.im.to_pyarray(py).into_any(),
            "gain_std_error" => response.gain_std_error.to_pyarray(py).into_any(),
            "phase_std_error_rad" => response.phase_std_error_rad.to_pyarray(py).into_any(),
            "gain_ci95" => response.gain_ci95.to_pyarray(py).into_any(),
            "phase_ci95_rad" => response.phase_ci95_rad.to_pyarray(py).into_any(),
            _ => return Err(raise(format!("no array \"{name}\""))),
        })
    }

    /// A coherence of `direct`, `derived` (consistent with the instrumental variables) or `derived-paper`.
    fn coherence_array<'py>(&self, py: Python<'py>, which: &str, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let coherence = self.coherence(which)?;
        Ok(match name {
            "ordinary" => coherence.ordinary.to_pyarray(py).into_any(),
            "partial" => coherence.partial.to_pyarray(py).into_any(),
            "multiple" => coherence.multiple.to_pyarray(py).into_any(),
            _ => return Err(raise(format!("no coherence \"{name}\"; there are ordinary, partial and multiple"))),
        })
    }
}

/// Estimates the frequency response of the outputs to the inputs; `settings` are the long options of `ndof estimate`.
#[pyfunction]
pub fn frequency_response(py: Python<'_>, recordings: Vec<PyRecording<'_>>, roles: Roles, stretches: Stretches, settings: &str) -> PyResult<Estimate> {
    let settings: ndof::Estimate = from_json(settings, "frequency_response")?;
    let (trials, samples) = trials_of(&recordings)?;
    let result = work::run(py, samples, None, move |_| {
        let trials = experiment_with(trials, roles, stretches, settings.channels())?;
        ndof::analysis::estimate(&trials, &settings).map(|estimated| estimated.result).map_err(raise_analysis)
    })??;
    Ok(Estimate(Arc::new(result)))
}
