//! Fitting parametric models to frequency responses.

mod information;
mod jackknife;
mod loop_model;
mod prediction;
mod result;
mod start;
mod weighted;

pub use loop_model::{LoopModel, LoopModelError};
pub(crate) use prediction::Prediction;
pub use prediction::{Smoothing, Transducer};
pub use result::{Fit, FitError, Parameter};
pub use start::linear_start;
pub use weighted::{CovarianceKind, WeightedFit};
