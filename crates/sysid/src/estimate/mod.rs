//! From spectra, or straight from recordings, to a response with its coherences and covariance.

mod beginning;
pub(crate) mod check;
mod choose;
mod coherence;
mod derived;
mod derived_batch;
mod derived_fit;
mod derived_line;
mod direct;
mod equation_error;
mod error;
mod fitted;
mod instrument;
mod instrumented;
mod judged;
mod local_fit;
mod local_lines;
mod local_polynomial;
mod local_rational;
mod method;
mod multisine;
mod robust;
mod sliding;

pub use choose::{Choice, choose_method, repeats};
pub use coherence::{Coherence, Significance};
pub use derived::{DerivedEstimate, ToReference, derived};
pub use direct::{Direct, DirectEstimate, LARGEST_CONDITION, direct};
pub use error::EstimateError;
pub use instrument::WEAK_INSTRUMENT;
pub use instrumented::instrumented;
pub use local_polynomial::LocalPolynomial;
pub use local_rational::LocalRational;
pub use method::{Estimates, SpectralMethod, estimate, estimate_from_spectra, estimate_up_to, response};
pub use multisine::{Detection, Distortion};
pub use robust::{RejectedSegment, robust_spectra};
pub use sliding::sliding;
