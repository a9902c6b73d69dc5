//! The table `[estimate]` of a study: how the response is estimated.

use crate::error::StudyError;
use crate::pipeline::{EstimateSettings, MethodName};
use crate::suggest::window_named;
use ndof_signal::{Detrend, Window};
use ndof_sysid::{Direct, ResponseKind};
use serde::{Deserialize, Serialize};

/// Keys are the long options of `ndof estimate`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct EstimateSection {
    /// What tables call it.
    pub name: Option<String>,
    /// The spectral method.
    pub method: MethodName,
    /// Samples in a segment.
    pub nperseg: Option<usize>,
    /// Samples that neighbours share.
    pub noverlap: Option<usize>,
    /// Length of the transform.
    pub nfft: Option<usize>,
    /// Data window.
    pub window: Option<String>,
    /// Symmetric instead of periodic.
    pub window_symmetric: bool,
    /// What is taken off each segment.
    pub detrend: Detrend,
    /// Half-width of the multitaper's spectral window.
    pub time_bandwidth: Option<f64>,
    /// Number of tapers.
    pub tapers: Option<usize>,
    /// Thomson's adaptive weights.
    pub adaptive: bool,
    /// Degree of the local polynomials.
    pub order: Option<usize>,
    /// Degree of the local rational method's denominators.
    pub denominator: Option<usize>,
    /// Lines on each side that the local methods look at.
    pub half_width: Option<usize>,
    /// Choose that number by prediction of left-out lines.
    pub leave_one_out: bool,
    /// Leave out wrecked segments.
    pub robust: bool,
    /// Length of a window that slides along the trials, in seconds.
    pub sliding: Option<f64>,
    /// Its step; half of its length.
    pub sliding_step: Option<f64>,
    /// Period of the excitation.
    pub period: Option<f64>,
    /// Where the noise of the direct estimate is thought to be.
    pub estimator: Direct,
    /// The physical quantity to report.
    pub response: Option<ResponseKind>,
    /// Cuts the arrays, never the computation.
    pub band: Option<[f64; 2]>,
    /// Add the cross-spectra.
    pub spectra: bool,
}

impl EstimateSection {
    /// What the keys mean.
    ///
    /// # Errors
    /// [`StudyError::Meaning`] if there is no such window.
    pub fn settings(&self, file: &str) -> Result<EstimateSettings, StudyError> {
        let window = match &self.window {
            Some(name) => window_named(name).map_err(|what| StudyError::Meaning { file: file.to_owned(), what })?,
            None => Window::default(),
        };
        Ok(EstimateSettings {
            method: self.method,
            nperseg: self.nperseg,
            noverlap: self.noverlap,
            nfft: self.nfft,
            window,
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
            sliding_s: self.sliding.map(|window_s| (window_s, self.sliding_step.unwrap_or(window_s / 2.0))),
            period_s: self.period,
            estimator: self.estimator,
            response: self.response,
            band_hz: self.band.map(|[low, high]| (low, high)),
            spectra: self.spectra,
        })
    }
}
