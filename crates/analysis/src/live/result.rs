//! `ndof/live/1`: how far a measurement has come.

use crate::fit::result::Parameter;
use crate::nested::{IntervalSpectrum, Spectrum};
use crate::result::{Head, Number};
use ndof_sysid::ResponseKind;
use serde::{Deserialize, Serialize};

/// How far a measurement has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LiveResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// What has been measured so far, gaps left out.
    pub duration_s: f64,
    /// Stretches without a gap that are long enough to be used.
    pub stretches: usize,
    /// Whether enough has been measured.
    pub enough: bool,
    /// Share of the frequencies and entries judged whose interval is as narrow as wanted.
    pub share: f64,
    /// How long the measurement has to be in all, as things stand.
    pub needed_s: Number,
    /// Wanted half width of the 95 % interval of the gain, as a share of the gain.
    pub wanted_half_width: f64,
    /// The band that is judged.
    pub band_hz: [f64; 2],
    /// Independent averages so far.
    pub effective_averages: f64,
    /// `direct`, or `derived` where there are references.
    pub estimate: String,
    /// The physical quantity of `gain`.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub response: ResponseKind,
    /// Columns.
    pub inputs: Vec<String>,
    /// Rows.
    pub outputs: Vec<String>,
    /// The grid within the band.
    pub frequency_hz: Vec<f64>,
    /// Magnitude of the response.
    pub gain: Spectrum,
    /// Its 95 % interval.
    pub gain_ci95: IntervalSpectrum,
    /// Partial coherence (magnitude-squared) of the same pairs of channels.
    pub partial_coherence: Spectrum,
    /// Parameters of the inertia-damping-stiffness model in the band, where it can be fitted.
    pub parameters: Vec<Parameter>,
}

impl LiveResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/live/1";
}
