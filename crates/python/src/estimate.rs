//! The frequency response: settings in, the contract's result and its arrays out.

use crate::error::{raise, raise_study};
use crate::recording::{PyRecording, Roles, Stretches, experiment, trials_of};
use crate::work;
use ndarray::{Array2, Array3, Array4};
use ndof::study::file::EstimateSection;
use ndof::study::result::estimate::{Coherence, IntervalSpectrum, Response, Spectrum};
use ndof::study::result::{EstimateResult, Number, to_json};
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

/// `[output][input][frequency]`, NaN where there is no number.
fn cube(values: &Spectrum) -> Array3<f64> {
    let (p, q) = (values.len(), values.first().map_or(0, Vec::len));
    let frequencies = values.first().and_then(|row| row.first()).map_or(0, Vec::len);
    Array3::from_shape_fn((p, q, frequencies), |(i, j, f)| values[i][j][f].unwrap_or(f64::NAN))
}

/// `[output][input][frequency][end]`, NaN where there is no interval.
fn intervals(values: &IntervalSpectrum) -> Array4<f64> {
    let (p, q) = (values.len(), values.first().map_or(0, Vec::len));
    let frequencies = values.first().and_then(|row| row.first()).map_or(0, Vec::len);
    Array4::from_shape_fn((p, q, frequencies, 2), |(i, j, f, end)| values[i][j][f].map_or(f64::NAN, |ends| ends[end]))
}

fn table(values: &[Vec<Number>]) -> Array2<f64> {
    Array2::from_shape_fn((values.len(), values.first().map_or(0, Vec::len)), |(i, f)| values[i][f].unwrap_or(f64::NAN))
}

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
        self.0.response.clone()
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
        self.0.warnings.iter().map(|w| (w.code.clone(), w.message.clone(), w.action.clone())).collect()
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
        cube(&self.0.input_coherence).into_pyarray(py).into_any()
    }

    /// An array of the response `which` (`direct`, `derived`) by the name that the contract gives it.
    fn array<'py>(&self, py: Python<'py>, which: &str, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let response = self.response(which)?;
        Ok(match name {
            "re" => cube(&response.re).into_pyarray(py).into_any(),
            "im" => cube(&response.im).into_pyarray(py).into_any(),
            "gain_std_error" => cube(&response.gain_std_error).into_pyarray(py).into_any(),
            "phase_std_error_rad" => cube(&response.phase_std_error_rad).into_pyarray(py).into_any(),
            "gain_ci95" => intervals(&response.gain_ci95).into_pyarray(py).into_any(),
            "phase_ci95_rad" => intervals(&response.phase_ci95_rad).into_pyarray(py).into_any(),
            _ => return Err(raise(format!("no array \"{name}\""))),
        })
    }

    /// A coherence of `direct`, `derived` (consistent with the instrumental variables) or `derived-paper`.
    fn coherence_array<'py>(&self, py: Python<'py>, which: &str, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let coherence = self.coherence(which)?;
        Ok(match name {
            "ordinary" => cube(&coherence.ordinary).into_pyarray(py).into_any(),
            "partial" => cube(&coherence.partial).into_pyarray(py).into_any(),
            "multiple" => table(&coherence.multiple).into_pyarray(py).into_any(),
            _ => return Err(raise(format!("no coherence \"{name}\"; there are ordinary, partial and multiple"))),
        })
    }
}

/// Estimates the frequency response of the outputs to the inputs; `settings` are the long options of `ndof estimate`.
#[pyfunction]
pub fn frequency_response(py: Python<'_>, recordings: Vec<PyRecording<'_>>, roles: Roles, stretches: Stretches, settings: &str) -> PyResult<Estimate> {
    let settings = from_json::<EstimateSection>(settings, "frequency_response")?.settings("frequency_response").map_err(raise_study)?;
    let (trials, samples) = trials_of(&recordings)?;
    let result = work::run(py, samples, None, move |_| {
        let trials = experiment(trials, roles, stretches)?;
        ndof::study::estimate(&trials, &settings, "estimate").map(|estimated| estimated.result).map_err(raise_study)
    })??;
    Ok(Estimate(Arc::new(result)))
}
