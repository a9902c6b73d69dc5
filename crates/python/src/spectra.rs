//! Cross-spectra: computed from arrays in place, merged exactly, pickled as bytes.

use crate::error::raise;
use crate::work;
use ndarray::Array3;
use ndof::signal::{CrossSpectra, Welch, WelchPartial, Window};
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyReadonlyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Settings of Welch's method from SciPy's words.
pub fn settings(nperseg: usize, noverlap: Option<usize>, nfft: Option<usize>, window: &str, window_symmetric: bool, detrend: &str) -> PyResult<Welch> {
    let window = window.parse::<Window>().map_err(raise)?;
    let detrend = serde_json::from_value(serde_json::Value::String(detrend.to_owned()))
        .map_err(|_| raise(format!("detrend=\"{detrend}\"; there are none, constant and linear")))?;
    Ok(Welch { nperseg, noverlap: noverlap.unwrap_or(nperseg / 2), nfft: nfft.unwrap_or(nperseg), window, window_symmetric, detrend })
}

/// What is known of one trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Part {
    /// All of it.
    Whole(CrossSpectra),
    /// Some of its blocks.
    Blocks(WelchPartial),
}

impl Part {
    fn merge(self, other: Part, trial: u64, sample_rate_hz: f64) -> PyResult<Part> {
        match (self, other) {
            (Part::Blocks(a), Part::Blocks(b)) => Part::of(a.merge(b).map_err(raise)?, sample_rate_hz),
            _ => Err(raise(format!("trial {trial} is whole in one of them and there again in the other; give each trial a number of its own with trial=…"))),
        }
    }

    /// Finished as soon as no block is missing, which is as far as memory need go.
    fn of(blocks: WelchPartial, sample_rate_hz: f64) -> PyResult<Part> {
        if blocks.is_complete() { blocks.spectra(sample_rate_hz).map(Part::Whole).map_err(raise) } else { Ok(Part::Blocks(blocks)) }
    }
}

/// What merges: named channels at one rate, trial by trial in the order of their numbers, so that no order of merging shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct State {
    names: Vec<String>,
    sample_rate_hz: f64,
    parts: BTreeMap<u64, Part>,
}

/// Auto- and cross-spectral densities of all channels.
#[pyclass(frozen, module = "ndof._ndof")]
pub struct Spectra {
    state: State,
    /// All trials together, where there are several and none is in pieces.
    pooled: Option<CrossSpectra>,
}

impl Spectra {
    fn new(state: State) -> PyResult<Self> {
        let whole = |part: &Part| match part {
            Part::Whole(spectra) => Some(spectra.clone()),
            Part::Blocks(_) => None,
        };
        let several = if state.parts.len() > 1 { state.parts.values().map(whole).collect::<Option<Vec<_>>>() } else { None };
        let pooled = several.map(|all| CrossSpectra::pool(&all).map_err(raise)).transpose()?;
        Ok(Spectra { state, pooled })
    }

    /// The spectra of all trials together.
    fn pooled(&self) -> PyResult<&CrossSpectra> {
        if let Some(pooled) = &self.pooled {
            return Ok(pooled);
        }
        match self.state.parts.values().next() {
            Some(Part::Whole(only)) if self.state.parts.len() == 1 => Ok(only),
            _ => {
                let pieces = self.state.parts.iter().filter(|(_, part)| matches!(part, Part::Blocks(_)));
                let trials: Vec<String> = pieces.map(|(trial, _)| trial.to_string()).collect();
                Err(raise(format!("blocks of trial {} are missing; merge the shares of all workers first", trials.join(", "))))
            }
        }
    }
}

#[pymethods]
impl Spectra {
    /// Names of the channels.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.state.names.clone()
    }

    #[getter]
    fn sample_rate_hz(&self) -> f64 {
        self.state.sample_rate_hz
    }

    /// Numbers of the trials.
    #[getter]
    fn trials(&self) -> Vec<u64> {
        self.state.parts.keys().copied().collect()
    }

    /// Whether no block is missing.
    #[getter]
    fn is_complete(&self) -> bool {
        self.pooled().is_ok()
    }

    #[getter]
    fn segments(&self) -> PyResult<usize> {
        Ok(self.pooled()?.segments())
    }

    #[getter]
    fn effective_averages(&self) -> PyResult<f64> {
        Ok(self.pooled()?.effective_averages())
    }

    #[getter]
    fn independent_spacing_hz(&self) -> PyResult<f64> {
        Ok(self.pooled()?.independent_spacing_hz())
    }

    #[getter]
    fn frequency_hz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.pooled()?.frequency_hz().to_pyarray(py))
    }

    /// ⟨A B*⟩ of channels `a` and `b` at every frequency.
    fn pair<'py>(&self, py: Python<'py>, a: usize, b: usize) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        let spectra = self.pooled()?;
        if a.max(b) >= spectra.channels() {
            return Err(raise(format!("there is no channel {}; there are {}", a.max(b), spectra.channels())));
        }
        Ok(if a >= b { spectra.pair(a, b).to_pyarray(py) } else { spectra.pair(b, a).iter().map(Complex64::conj).collect::<Vec<_>>().into_pyarray(py) })
    }

    /// The power density of channel `a`.
    fn power<'py>(&self, py: Python<'py>, a: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let spectra = self.pooled()?;
        if a >= spectra.channels() {
            return Err(raise(format!("there is no channel {a}; there are {}", spectra.channels())));
        }
        Ok(spectra.pair(a, a).iter().map(|s| s.re).collect::<Vec<_>>().into_pyarray(py))
    }

    /// The Hermitian matrix, `[a][b][frequency]`.
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
        let spectra = self.pooled()?;
        let (n, bins) = (spectra.channels(), spectra.frequency_hz().len());
        Ok(Array3::from_shape_fn((n, n, bins), |(a, b, f)| spectra.at(f, a, b)).into_pyarray(py))
    }

    /// Both together.
    fn merge(&self, py: Python<'_>, other: &Spectra) -> PyResult<Spectra> {
        if self.state.names != other.state.names || self.state.sample_rate_hz != other.state.sample_rate_hz {
            return Err(raise(format!(
                "channels {} at {} Hz and {} at {} Hz; merge only spectra of the same channels at one rate",
                self.state.names.join(", "),
                self.state.sample_rate_hz,
                other.state.names.join(", "),
                other.state.sample_rate_hz
            )));
        }
        py.detach(|| {
            let mut state = self.state.clone();
            for (&trial, part) in &other.state.parts {
                match state.parts.entry(trial) {
                    Entry::Vacant(place) => {
                        place.insert(part.clone());
                    }
                    Entry::Occupied(mut place) => {
                        let merged = place.get().clone().merge(part.clone(), trial, state.sample_rate_hz)?;
                        place.insert(merged);
                    }
                }
            }
            Spectra::new(state)
        })
    }

    /// All of it as bytes; the same spectra give the same bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &postcard::to_stdvec(&self.state).map_err(raise)?))
    }

    /// From those bytes.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Spectra::new(postcard::from_bytes(bytes).map_err(|error| raise(format!("these bytes are not spectra of this version of ndof: {error}")))?)
    }

    fn __eq__(&self, other: &Spectra) -> bool {
        self.state == other.state
    }
}

/// Cross-spectra of all `channels` by Welch's method; contiguous arrays are read where they lie.
///
/// With `share` = (first block, block past the last, samples of the whole record), `channels` are the stretch that these
/// blocks need, and the result is their part of the sum.
#[pyfunction]
#[pyo3(signature = (channels, names, sample_rate_hz, nperseg, noverlap, nfft, window, window_symmetric, detrend, trial, share))]
#[expect(clippy::too_many_arguments, reason = "every setting once, as Python writes them")]
pub fn cross_spectra(
    py: Python<'_>,
    channels: Vec<PyReadonlyArray1<'_, f64>>,
    names: Vec<String>,
    sample_rate_hz: f64,
    nperseg: usize,
    noverlap: Option<usize>,
    nfft: Option<usize>,
    window: &str,
    window_symmetric: bool,
    detrend: &str,
    trial: u64,
    share: Option<(usize, usize, usize)>,
) -> PyResult<Spectra> {
    let welch = settings(nperseg, noverlap, nfft, window, window_symmetric, detrend)?;
    if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
        return Err(raise(ndof::signal::RecordingError::SampleRate(sample_rate_hz)));
    }
    // Strided arrays are copied, contiguous ones borrowed.
    let copies: Vec<Option<Vec<f64>>> = channels.iter().map(|c| c.as_slice().is_err().then(|| c.as_array().to_vec())).collect();
    let slices: Vec<&[f64]> = channels.iter().zip(&copies).map(|(channel, copy)| copy.as_deref().or(channel.as_slice().ok()).unwrap_or_default()).collect();
    let part = py.detach(|| {
        work::in_pool(|| match share {
            None => welch.spectra(sample_rate_hz, &slices).map(Part::Whole).map_err(raise),
            Some((first, end, samples)) => Part::of(welch.partial(first..end, samples, &slices).map_err(raise)?, sample_rate_hz),
        })?
    })?;
    py.check_signals()?;
    Spectra::new(State { names, sample_rate_hz, parts: BTreeMap::from([(trial, part)]) })
}
