//! What an estimate can be asked.

use crate::error::AnalysisError;
#[cfg(feature = "clap")]
use crate::options::{count, positive, whole, words};
use crate::schedule::{Cycles, Events};
use crate::suggest::window_named;
use crate::trials::Trials;
use ndof_signal::{Detrend, Welch, Window};
use ndof_sysid::{Direct, FrequencyResponse, ResponseKind};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The words that name a spectral method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Chosen from the records, with the reason in the result.
    #[default]
    Auto,
    /// Averages over windowed, overlapping segments.
    Welch,
    /// Averages over orthogonal tapers of the whole record.
    Multitaper,
    /// Response and leakage as polynomials around each line of the whole record.
    LocalPolynomial,
    /// The same with a common denominator around each line.
    LocalRational,
    /// Averages over the periods of a periodic excitation.
    Periodic,
}

impl MethodName {
    /// The words, in the order of the variants.
    pub const WORDS: [&'static str; 6] = ["auto", "welch", "multitaper", "local-polynomial", "local-rational", "periodic"];
}

/// How a response is estimated; what is not given follows from the records.
///
/// The fields are the long options of `ndof estimate`, the keys of the table `[estimate]` of a study and the keywords in Python.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct Estimate {
    /// What the tables of a study call these settings.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub name: Option<String>,
    /// Spectral estimator; auto says in the result what it chose and why
    #[cfg_attr(feature = "clap", arg(long, default_value = "auto", value_parser = words::<MethodName>(&MethodName::WORDS)))]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub method: MethodName,
    /// Samples in a segment [default: chosen from the length of the record]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = count))]
    pub nperseg: Option<usize>,
    /// Samples that neighbouring segments share [default: nperseg/2]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = whole::<usize>))]
    pub noverlap: Option<usize>,
    /// Length of the transform; more than nperseg pads with zeros [default: nperseg]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = count))]
    pub nfft: Option<usize>,
    /// Data window: hann, hamming, blackman, blackmanharris, flattop, bartlett, boxcar, tukey, tukey:SHARE
    #[cfg_attr(feature = "clap", arg(long, default_value = "hann", value_parser = window_named))]
    #[serde(serialize_with = "window_text", deserialize_with = "window_of_text")]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub window: Window,
    /// Symmetric window in place of the periodic one
    #[cfg_attr(feature = "clap", arg(long))]
    pub window_symmetric: bool,
    /// What is removed from each segment
    #[cfg_attr(feature = "clap", arg(long, default_value = "constant", value_parser = words::<Detrend>(&["none", "constant", "linear"])))]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub detrend: Detrend,
    /// Multitaper: half the bandwidth, times the length of the record [default: 4]
    #[cfg_attr(feature = "clap", arg(long, value_name = "NW", value_parser = positive))]
    pub time_bandwidth: Option<f64>,
    /// Multitaper: number of tapers [default: 2 NW − 1]
    #[cfg_attr(feature = "clap", arg(long, value_name = "K", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..)))]
    pub tapers: Option<usize>,
    /// Multitaper: use Thomson's adaptive weights, which lower leakage from strong bands into weak ones
    #[cfg_attr(feature = "clap", arg(long))]
    pub adaptive: bool,
    /// Local polynomial and rational: degree of the polynomials [default: 2]
    #[cfg_attr(feature = "clap", arg(long, value_name = "R", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(0..=8)))]
    pub order: Option<usize>,
    /// Local rational: degree of the common denominator, 1 for each resonance within the window [default: 1]
    #[cfg_attr(feature = "clap", arg(long, value_name = "D", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=2)))]
    pub denominator: Option<usize>,
    /// Local polynomial and rational: frequencies used on each side of each frequency [default: the fewest that leave a usable noise estimate]
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..)))]
    pub half_width: Option<usize>,
    /// Local polynomial: choose the half-width that best predicts frequencies left out
    #[cfg_attr(feature = "clap", arg(long, conflicts_with = "half_width"))]
    pub leave_one_out: bool,
    /// Welch: leave out segments that a knock or a cough has disturbed, and say which
    #[cfg_attr(feature = "clap", arg(long))]
    pub robust: bool,
    /// Also estimate in a window of S seconds that slides along the trials, to show what changes with time; with cycles along the cycle, by default of a quarter of it
    #[cfg_attr(feature = "clap", arg(long = "sliding", value_name = "S"))]
    #[serde(rename = "sliding")]
    pub sliding_s: Option<f64>,
    /// Seconds from one such window to the next [default: half a window]
    #[cfg_attr(feature = "clap", arg(long = "sliding-step", value_name = "S"))]
    #[serde(rename = "sliding-step")]
    pub sliding_step_s: Option<f64>,
    /// Duration of a cycle in seconds: the response over the phase of a movement's cycle, from windows at the same phase of all cycles.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "cycle")]
    pub cycle_s: Option<f64>,
    /// Channel that tells where cycles begin: by its rising edges, or as a phase that wraps there.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub cycle_by: Option<String>,
    /// When cycles begin, in seconds: one list for every trial, or one for each.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "event")]
    pub event_s: Option<Events>,
    /// Periodic: period of the excitation in seconds [default: found from the commanded signal]
    #[cfg_attr(feature = "clap", arg(long = "period", value_name = "S", value_parser = positive))]
    #[serde(rename = "period")]
    pub period_s: Option<f64>,
    /// Direct estimate: h1 assumes noise at the outputs, h2 at the inputs, hv at both
    #[cfg_attr(feature = "clap", arg(long, default_value = "h1", value_parser = words::<Direct>(&["h1", "h2", "hv"])))]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub estimator: Direct,
    /// Physical quantity to report [default: compliance; dynamic-stiffness with a displacement as input]
    #[cfg_attr(feature = "clap", arg(long, value_parser = words::<ResponseKind>(&["compliance", "dynamic-stiffness", "impedance", "admittance"])))]
    #[cfg_attr(feature = "schema", schemars(with = "Option<String>"))]
    pub response: Option<ResponseKind>,
    /// Frequencies to report, in Hz: cuts the arrays, never the computation.
    #[cfg_attr(feature = "clap", arg(skip))]
    #[serde(rename = "band")]
    pub band_hz: Option<[f64; 2]>,
    /// Add the cross-spectra of all channels to the result
    #[cfg_attr(feature = "clap", arg(long))]
    pub spectra: bool,
}

impl Estimate {
    /// Welch's method with segments of so many samples.
    pub fn welch(nperseg: usize) -> Self {
        Estimate { method: MethodName::Welch, nperseg: Some(nperseg), ..Estimate::default() }
    }

    /// The channel that tells cycles, which has no role.
    pub fn channels(&self) -> Vec<String> {
        self.cycle_by.iter().cloned().collect()
    }

    /// Where cycles begin.
    pub(super) fn cycles(&self) -> Cycles<'_> {
        Cycles { cycle_s: self.cycle_s, cycle_by: self.cycle_by.as_deref(), event_s: self.event_s.as_ref() }
    }

    /// The band that is reported; all frequencies where none is given.
    pub(crate) fn reported_hz(&self) -> [f64; 2] {
        self.band_hz.unwrap_or([0.0, f64::INFINITY])
    }

    /// Which frequencies of a response are told.
    pub(super) fn reported_of(&self, response: &FrequencyResponse, trials: &Trials) -> Result<Vec<usize>, AnalysisError> {
        let [low_hz, high_hz] = self.reported_hz();
        let keep = response.within([low_hz, high_hz]);
        let nyquist_hz = trials.sample_rate_hz() / 2.0;
        if keep.is_empty() { Err(AnalysisError::EmptyBand { low_hz, high_hz, nyquist_hz }) } else { Ok(keep) }
    }

    /// Welch's method with segments of `nperseg` samples and what else is asked for.
    pub(crate) fn segments_of(&self, nperseg: usize) -> Welch {
        Welch {
            nperseg,
            noverlap: self.noverlap.unwrap_or(nperseg / 2),
            nfft: self.nfft.unwrap_or(nperseg),
            window: self.window,
            window_symmetric: self.window_symmetric,
            detrend: self.detrend,
        }
    }
}

/// Windows are written as `tukey:0.25`, as a person writes them.
fn window_text<S: Serializer>(window: &Window, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(window)
}

fn window_of_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Window, D::Error> {
    window_named(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
}
