//! Fitting parametric models to frequency responses.

mod information;
mod jackknife;
mod loop_model;
mod paper;
mod prediction;
mod result;
mod start;
mod vaf;
mod weighted;

pub use loop_model::{LoopModel, LoopModelError};
pub use paper::PaperFit;
pub(crate) use prediction::Prediction;
pub use prediction::{Smoothing, Transducer};
pub use result::{Fit, FitError, Parameter};
pub use start::linear_start;
pub use vaf::{Agreement, agreement};
pub use weighted::{CovarianceKind, WeightedFit};

use crate::ParametricModel;
use ndof_sysid::{FrequencyResponse, ResponseKind};

/// Number of axes, if response, model and start values belong together.
fn check_shape<M: ParametricModel + ?Sized>(model: &M, response: &FrequencyResponse, start: &[f64]) -> Result<usize, FitError> {
    let n = model.axes().len();
    let (outputs, inputs) = response.shape();
    if (outputs, inputs) != (n, n) {
        return Err(FitError::Shape { outputs, inputs, axes: n });
    }
    if response.kind == ResponseKind::Transfer {
        return Err(FitError::NotMechanical);
    }
    let expected = model.parameters().len();
    if start.len() == expected { Ok(n) } else { Err(FitError::StartLength { found: start.len(), expected }) }
}

/// What part of an independent bin each frequency is: its distance to the next over the independent spacing, at most 1.
fn shares(frequency_hz: &[f64], independent_spacing_hz: f64) -> Vec<f64> {
    let gap = |a: usize, b: usize| frequency_hz.get(b).zip(frequency_hz.get(a)).map_or(f64::INFINITY, |(b, a)| b - a);
    (0..frequency_hz.len())
        .map(|k| {
            let gap = gap(k, k + 1).min(if k > 0 { gap(k - 1, k) } else { f64::INFINITY });
            if independent_spacing_hz > 0.0 { (gap / independent_spacing_hz).min(1.0) } else { 1.0 }
        })
        .collect()
}
