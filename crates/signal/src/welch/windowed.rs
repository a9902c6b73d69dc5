//! The transform of a segment: detrended, windowed, padded with noughts.

use super::padded::{Buffers, PaddedTransform};
use crate::segments::Detrend;
use num_complex::Complex64;

/// Window, detrending and transform of a segment.
pub(super) struct WindowedTransform {
    pub(super) window: Vec<f64>,
    pub(super) detrend: Detrend,
    /// Frequencies from 0 Hz to half the rate.
    pub(super) bins: usize,
    pub(super) padded: PaddedTransform,
}

impl WindowedTransform {
    pub(super) fn new(window: Vec<f64>, detrend: Detrend, nfft: usize) -> Self {
        WindowedTransform { bins: nfft / 2 + 1, padded: PaddedTransform::new(window.len(), nfft), window, detrend }
    }

    /// Writes the spectrum of `samples` to the first bins of `out`.
    pub(super) fn spectrum(&self, samples: &[f64], buffers: &mut Buffers, out: &mut [Complex64]) {
        let n = self.window.len();
        self.detrend.apply_windowed(samples, &self.window, &mut buffers.input[..n]);
        buffers.input[n..].fill(0.0);
        self.padded.process(buffers, &mut out[..self.bins]);
    }
}
