//! Spectral system identification with any number of inputs and outputs.
//!
//! [`Ports`] says which channels are inputs, outputs and references; estimators turn
//! [`CrossSpectra`](ndof_signal::CrossSpectra) into a [`FrequencyResponse`] with its covariance.

mod matrix;
mod ports;
mod response;

pub use ports::{Ports, PortsError};
pub use response::{FrequencyResponse, ResponseError, ResponseKind, Uncertainty};
