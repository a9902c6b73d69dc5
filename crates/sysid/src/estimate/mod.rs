//! From spectra, or straight from recordings, to a response with its coherences and covariance.

pub(crate) mod check;
mod coherence;
mod derived;
mod direct;
mod error;
mod method;

pub use coherence::{Coherence, Significance};
pub use derived::{DerivedEstimate, ToReference, WEAK_INSTRUMENT, derived};
pub use direct::{Direct, DirectEstimate, LARGEST_CONDITION, direct};
pub use error::EstimateError;
pub use method::{Estimates, SpectralMethod, estimate};
