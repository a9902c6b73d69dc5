//! Options of the spectral estimate, in SciPy's names.

use super::{Shared, count, positive, whole, words};
use clap::Args;
use ndof_signal::{Detrend, Window};
use ndof_study::{EstimateSettings, MethodName, window_named};
use ndof_sysid::{Direct, ResponseKind};

/// Options of the spectral estimate.
#[derive(Clone, Debug, Args)]
pub struct Analysis {
    /// Spectral estimator; auto says in the result what it chose and why
    #[arg(long, default_value = "auto", value_parser = words::<MethodName>(&MethodName::WORDS), help_heading = "Estimate")]
    pub method: MethodName,
    /// Samples in a segment [default: chosen from the length of the record]
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Estimate")]
    pub nperseg: Option<usize>,
    /// Samples that neighbouring segments share [default: nperseg/2]
    #[arg(long, value_name = "N", value_parser = whole::<usize>, help_heading = "Estimate")]
    pub noverlap: Option<usize>,
    /// Length of the transform; more than nperseg pads with zeros [default: nperseg]
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Estimate")]
    pub nfft: Option<usize>,
    /// Data window: hann, hamming, blackman, blackmanharris, flattop, bartlett, boxcar, tukey[:SHARE]
    #[arg(long, default_value = "hann", value_parser = window_named, help_heading = "Estimate")]
    pub window: Window,
    /// Symmetric instead of periodic window
    #[arg(long, help_heading = "Estimate")]
    pub window_symmetric: bool,
    /// What is taken off each segment
    #[arg(long, default_value = "constant", value_parser = words::<Detrend>(&["none", "constant", "linear"]), help_heading = "Estimate")]
    pub detrend: Detrend,
    /// Multitaper: half-width NW of the spectral window, in units of one over the record's length [default: 4]
    #[arg(long, value_name = "NW", value_parser = positive, help_heading = "Estimate")]
    pub time_bandwidth: Option<f64>,
    /// Multitaper: number of tapers [default: 2 NW − 1]
    #[arg(long, value_name = "K", help_heading = "Estimate", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    pub tapers: Option<usize>,
    /// Multitaper: Thomson's adaptive weights, against leakage from strong bands into weak ones
    #[arg(long, help_heading = "Estimate")]
    pub adaptive: bool,
    /// Local polynomial and rational: degree [default: 2]
    #[arg(long, value_name = "R", help_heading = "Estimate", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(0..=8))]
    pub order: Option<usize>,
    /// Local rational: degree of the common denominator, one a resonance within the window [default: 1]
    #[arg(long, value_name = "D", help_heading = "Estimate", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=2))]
    pub denominator: Option<usize>,
    /// Local polynomial and rational: lines on each side of each line [default: the fewest that leave a usable noise estimate]
    #[arg(long, value_name = "N", help_heading = "Estimate", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    pub half_width: Option<usize>,
    /// Local polynomial: choose that number by how well left-out lines are predicted
    #[arg(long, conflicts_with = "half_width", help_heading = "Estimate")]
    pub leave_one_out: bool,
    /// Welch: leave out segments that a knock or a cough has wrecked, and say which
    #[arg(long, help_heading = "Estimate")]
    pub robust: bool,
    /// Periodic: period of the excitation in seconds [default: found from the commanded signal]
    #[arg(long, value_name = "S", value_parser = positive, help_heading = "Estimate")]
    pub period: Option<f64>,
    /// Where the noise of the direct estimate is thought to be: outputs, inputs, both
    #[arg(long, default_value = "h1", value_parser = words::<Direct>(&["h1", "h2", "hv"]), help_heading = "Estimate")]
    pub estimator: Direct,
    /// Physical quantity to report [default: compliance; dynamic-stiffness with a displacement as input]
    #[arg(long, value_parser = words::<ResponseKind>(&["compliance", "dynamic-stiffness", "impedance", "admittance"]), help_heading = "Estimate")]
    pub response: Option<ResponseKind>,
    /// Add the cross-spectra of all channels to the result
    #[arg(long, help_heading = "Estimate")]
    pub spectra: bool,
}

impl Analysis {
    /// What the options mean.
    pub fn settings(&self, shared: &Shared) -> EstimateSettings {
        EstimateSettings {
            method: self.method,
            nperseg: self.nperseg,
            noverlap: self.noverlap,
            nfft: self.nfft,
            window: self.window,
            window_symmetric: self.window_symmetric,
            detrend: self.detrend,
            time_bandwidth: self.time_bandwidth,
            tapers: self.tapers,
            adaptive: self.adaptive,
            order: self.order,
            denominator: self.denominator,
            half_width: self.half_width,
            leave_one_out: self.leave_one_out,
            robust: self.robust,
            sliding_s: None,
            period_s: self.period,
            estimator: self.estimator,
            response: self.response,
            band_hz: shared.band,
            spectra: self.spectra,
        }
    }
}
