//! Spectral system identification with any number of inputs and outputs.
//!
//! [`Ports`] says which channels are inputs, outputs and references; estimators turn
//! [`CrossSpectra`](ndof_signal::CrossSpectra) into a [`FrequencyResponse`] with its covariance. [`estimate()`] does it all
//! from recordings.

mod estimate;
mod filling;
mod interval;
mod labels;
mod lanes;
mod ordered_coherence;
mod planning;
mod ports;
mod quantile;
mod resolution;
mod response;
mod spread;
mod steadiness;
mod uncertainty;

pub use estimate::{
    Choice, Coherence, DerivedEstimate, Detection, Direct, DirectEstimate, Distortion, EstimateError, Estimates, LARGEST_CONDITION, LocalPolynomial,
    LocalRational, Pieces, RejectedSegment, Significance, SpectralMethod, ToReference, WEAK_INSTRUMENT, choose_method, derived, direct, estimate,
    estimate_from_spectra, estimate_up_to, instrumented, repeats, response, robust_spectra, sliding,
};
pub use interval::{Confidence, GainPhase};
pub use labels::Labels;
pub use ndof_signal::Warning;
pub use ordered_coherence::ordered_coherence;
pub use planning::{Progress, StoppingRule, averages_for_interval};
pub use ports::{Ports, PortsError};
pub use quantile::two_sided_t;
pub use resolution::{Unresolved, unresolved};
pub use response::{FrequencyResponse, ResponseError, ResponseKind};
pub use spread::{Spread, spread};
pub use steadiness::{Steadiness, steadiness};
pub use uncertainty::Uncertainty;
