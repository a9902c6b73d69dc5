//! Spectral system identification with any number of inputs and outputs.
//!
//! [`Ports`] says which channels are inputs, outputs and references; estimators turn
//! [`CrossSpectra`](ndof_signal::CrossSpectra) into a [`FrequencyResponse`] with its covariance. [`estimate`] does it all
//! from recordings.

mod conditioned;
mod estimate;
mod hermitian;
mod interval;
mod labels;
mod matrix;
mod ports;
mod response;
mod warning;

pub use conditioned::{Conditioned, conditioned};
pub use estimate::{
    Choice, Coherence, DerivedEstimate, Detection, Direct, DirectEstimate, Distortion, EstimateError, Estimates, LARGEST_CONDITION, LocalPolynomial,
    RejectedSegment, Significance, SpectralMethod, ToReference, WEAK_INSTRUMENT, choose_method, derived, direct, estimate, estimate_from_spectra,
    robust_spectra,
};
pub use interval::{Confidence, GainPhase, paper_random_error};
pub use labels::Labels;
pub use ports::{Ports, PortsError};
pub use response::{FrequencyResponse, ResponseError, ResponseKind, Uncertainty};
pub use warning::Warning;
