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
    /// What of the measurement counts here: all of it, or the last seconds that were asked for.
    pub used_s: f64,
    /// Stretches without a gap that are long enough to be used.
    pub stretches: usize,
    /// Whether enough has been measured.
    pub enough: bool,
    /// Share of the frequencies and entries judged whose interval is as narrow as wanted.
    pub share: f64,
    /// How long the measurement has to be in all, as things stand; null where that is unknown, or where the last seconds, if only they count,
    /// never suffice.
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
    /// Inertia, damping and stiffness as a fit of what counts here finds them: in the band asked for, else in the one that is excited. Numbers are
    /// null where the fit fails, and nothing stands here where there is no impedance.
    pub parameters: Vec<Parameter>,
    /// The band in which inertia, damping and stiffness were fitted; null where that fails.
    pub fitted_hz: Option<[f64; 2]>,
}

impl LiveResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/live/1";
}
