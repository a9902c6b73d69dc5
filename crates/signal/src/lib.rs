//! Recordings, filters, spectra and excitation signals.
//!
//! Everything in `ndof` starts from a [`Recording`]: channels of equal length at one sample rate, in SI units.
//! A spectral estimator turns recordings into [`CrossSpectra`]: the Hermitian matrix of all channels at each
//! frequency, from which every response, coherence and error in `ndof-sysid` is algebra.
//!
//! **The convention that bites**: `S[a][b] = ⟨A B*⟩`, the conjugate is on the *second* channel, and densities are
//! one-sided. It is the conjugate-transposed order of SciPy: `S[a][b] = scipy.signal.csd(b, a)`.

#![cfg_attr(docsrs, feature(doc_cfg))]

mod amplitudes;
mod cache;
mod cross_spectra;
mod derivatives;
mod excitation;
mod filter;
mod frozen;
mod interpolated;
mod lone_samples;
mod mirrored;
mod motion_noise;
mod multitaper;
mod periodic;
mod quantity;
mod recording;
mod segments;
#[cfg(test)]
mod shared_tests;
mod slepian;
mod spread;
mod stationarity;
mod totals;
mod transform;
mod vectorized;
mod warning;
mod welch;
mod window;

pub use amplitudes::Amplitudes;
pub use cross_spectra::{CrossSpectra, Kernel, SpectraError};
pub use derivatives::{RESOLVED, derivatives, smoothing_edge};
pub use excitation::{
    AxisPlan, Chirp, Decorrelated, Decorrelation, ExcitationError, ExpectedMotion, FilteredNoise, InputCoherence, Limits, Lines, Multisine, MultisineSet, Prbs,
    SeedCriterion, SeedSearch, SignalSize, Sweep, apply_response, expected_motion, input_coherence, input_coherence_at, power_share, ramp,
};
pub use filter::{FilterError, Passband, Section, SosFilter, SosStream};
pub use frozen::frozen;
pub use interpolated::interpolated;
pub use lone_samples::lone_samples;
pub use mirrored::{curve_through, mirrored, smooth_length, without_line};
pub use motion_noise::{MotionNoise, effort_noise};
pub use multitaper::{Multitaper, MultitaperError};
pub use periodic::{DetectedPeriod, PeriodSpectra, Periodic, PeriodicError, detect_period};
pub use quantity::{Quantity, Unit, UnknownUnit};
pub use recording::{Channel, Recording, RecordingError};
pub use segments::{Detrend, SamplesError, effective_averages};
pub use slepian::{SlepianError, SlepianTapers, slepian_tapers};
pub use spread::{deviation, rms, robust_spread};
pub use stationarity::{Normality, ReverseArrangements, StationarityError, normality, reverse_arrangements};
pub use transform::{ComplexToReal, RealToComplex, forward_transform, inverse_transform, signal_by, spectrum_by};
pub use vectorized::vectorized;
pub use warning::Warning;
pub use welch::{Welch, WelchError, WelchPartial, WelchStream};
pub use window::{ParseWindowError, Window};
