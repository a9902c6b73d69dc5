//! Digital filters as cascades of second-order sections.

mod butterworth;
mod sections;
mod zero_phase;

pub use butterworth::Passband;
pub use sections::{Section, SosFilter, SosStream};

/// Why a filter cannot be designed or applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum FilterError {
    /// A filter of order zero does nothing.
    #[error("filter order 0; take 1 or more")]
    Order,
    /// A corner lies outside of the open interval from 0 to Nyquist.
    #[error("corner at {corner_hz} Hz with {sample_rate_hz} Hz samples; it must lie between 0 and {} Hz, both excluded", sample_rate_hz / 2.0)]
    Corner { corner_hz: f64, sample_rate_hz: f64 },
    /// A band whose edges are not in order.
    #[error("pass band from {low_hz} to {high_hz} Hz is empty; give the lower edge first")]
    EmptyBand { low_hz: f64, high_hz: f64 },
    /// Too few samples for the padding that zero-phase filtering needs.
    #[error("{found} samples, zero-phase filtering of this order needs at least {needed}; record longer or lower the order")]
    TooShort { found: usize, needed: usize },
}
