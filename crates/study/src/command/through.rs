//! Signals through a linear response, tabulated once for records of one length.

use crate::error::StudyError;
use ndarray::Array2;
use ndof_devices::Linearised;
use ndof_signal::{ExcitationError, apply_response};
use num_complex::Complex64;
use rayon::prelude::*;

/// Silence behind a record, which receives what rings on.
const PADDING_S: f64 = 5.0;

/// A response at the frequencies of records of one length.
pub(crate) struct Through {
    sample_rate_hz: f64,
    step_hz: f64,
    channels: usize,
    values: Vec<Array2<Complex64>>,
}

impl Through {
    /// `response` at every frequency of records of `samples`; where it does not exist nothing passes.
    pub(crate) fn new(sample_rate_hz: f64, samples: usize, channels: usize, response: impl Fn(f64) -> Option<Array2<Complex64>> + Sync) -> Self {
        let padded = samples + (PADDING_S * sample_rate_hz).ceil() as usize;
        let step_hz = sample_rate_hz / padded as f64;
        let none = || Array2::zeros((channels, channels));
        let values = (0..padded / 2 + 1).into_par_iter().map(|k| response(k as f64 * step_hz).unwrap_or_else(none)).collect();
        Through { sample_rate_hz, step_hz, channels, values }
    }

    /// T: forces on the limb from commands, between recorded samples.
    pub(crate) fn delivery(linear: &Linearised, samples: usize) -> Self {
        Through::new(linear.hold.sample_rate_hz, samples, linear.robot_inertia.nrows(), |hz| Some(linear.sampled_responses(hz)?.0))
    }

    /// T⁻¹: commands that deliver given forces.
    pub(crate) fn compensation(linear: &Linearised, samples: usize) -> Self {
        Through::new(linear.hold.sample_rate_hz, samples, linear.robot_inertia.nrows(), |hz| linear.precompensation(hz))
    }

    /// The signals behind it; they begin from rest.
    pub(crate) fn apply(&self, signals: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, StudyError> {
        if signals.len() != self.channels {
            return Err(ExcitationError::Shape { expected: (self.channels, self.channels), found: (signals.len(), signals.len()) }.into());
        }
        let at = |hz: f64| self.values[((hz / self.step_hz).round() as usize).min(self.values.len() - 1)].clone();
        Ok(apply_response(signals, self.sample_rate_hz, PADDING_S, at)?)
    }
}
