//! `ndof/check/1`: whether the data are fit to judge by.

use crate::result::{Head, Number};
use serde::{Deserialize, Serialize};

/// Data quality before numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CheckResult {
    /// Which result this is.
    #[serde(flatten)]
    pub head: Head,
    /// `good`, `usable` (remarks only) or `faulty`.
    pub verdict: String,
    /// One a file, in their order.
    pub trials: Vec<TrialCheck>,
    /// Everything found.
    pub findings: Vec<Finding>,
    /// Stationarity, normality and likeness of trials, one a channel with a role.
    pub assumptions: Vec<ChannelAssumptions>,
}

impl CheckResult {
    /// The schema's name.
    pub const SCHEMA: &str = "ndof/check/1";
}

/// What spectral estimates take for granted of one channel; by trial first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChannelAssumptions {
    /// Its name.
    pub name: String,
    /// Probability of as many or as few reverse arrangements among its means over 20 equal intervals by chance.
    #[serde(default)]
    pub drift_p_value: Vec<Number>,
    /// Mean squares over 20 equal intervals, the mean taken off.
    pub mean_squares: Vec<Vec<f64>>,
    /// Probability of as many or as few reverse arrangements among them by chance.
    pub trend_p_value: Vec<Number>,
    /// Third standardised moment.
    pub skewness: Vec<Number>,
    /// Fourth standardised moment less 3.
    pub excess_kurtosis: Vec<Number>,
    /// Probability of both for a Gaussian process of the same autocovariance.
    pub normal_p_value: Vec<Number>,
    /// Normal probability: quantiles of a standard Gaussian at 1, 5, 10, 25, 50, 75, 90, 95 and 99 %.
    pub gaussian_quantiles: Vec<f64>,
    /// Those of the channel, over its standard deviation.
    pub quantiles: Vec<Vec<Number>>,
    /// R² of the samples of each pair of trials: 1 where a trial repeats another.
    pub squared_correlation: Vec<Vec<Number>>,
    /// R² of the mean squares of each pair of trials.
    pub squared_correlation_of_mean_squares: Vec<Vec<Number>>,
}

/// What one file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TrialCheck {
    /// The file, as it was named.
    pub file: String,
    /// Samples a second.
    pub sample_rate_hz: f64,
    /// Length.
    pub duration_s: f64,
    /// Its channels.
    pub channels: Vec<ChannelCheck>,
    /// How late channels come that should come together: an input after its reference, a velocity after its position.
    pub lags: Vec<Lag>,
}

/// By how much one channel comes after another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Lag {
    /// The earlier channel, differentiated as often as it takes.
    pub from: String,
    /// The other.
    pub to: String,
    /// The lag, from the slope of the phase; positive where `to` is late.
    pub lag_s: Number,
    /// Mean coherence of the frequencies that were used.
    pub coherence: f64,
}

/// What one channel holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChannelCheck {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// `reference`, `input`, `output` or `none`.
    pub role: String,
    /// Samples that are no number.
    pub missing: usize,
    /// Mean.
    pub mean: Number,
    /// Standard deviation.
    pub std: Number,
    /// Smallest and largest.
    pub range: Option<[f64; 2]>,
    /// Smallest difference between two values: the resolution.
    pub step: Number,
    /// The band that holds 98 % of its power.
    pub band_hz: Option<[f64; 2]>,
}

/// Something that is wrong, or worth knowing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Finding {
    /// A word that programs can match, e.g. `clipped`.
    pub code: String,
    /// `fault` or `remark`.
    pub severity: String,
    /// Number of the file, from 1.
    pub trial: usize,
    /// The channel, if it is about one.
    pub channel: Option<String>,
    /// What was seen, with its numbers.
    pub message: String,
    /// What to do.
    pub action: String,
}

impl Finding {
    /// Something about a trial, counted from 0, and perhaps one of its channels.
    pub(crate) fn new(code: &str, severity: &str, trial: usize, channel: Option<&str>, message: impl Into<String>, action: &str) -> Self {
        let (message, channel) = (message.into(), channel.map(str::to_owned));
        Finding { code: code.to_owned(), severity: severity.to_owned(), trial: trial + 1, channel, message, action: action.to_owned() }
    }
}
