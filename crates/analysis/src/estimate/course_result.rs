//! A response that changes with time, or over a cycle, as it is written.

use super::result::Response;
use crate::nested::Matrix;
use crate::result::Number;
use serde::{Deserialize, Serialize};

/// A response that changes with time, or over a cycle; arrays by window first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Course {
    /// Length of the window.
    pub window_s: f64,
    /// From one window to the next.
    pub step_s: f64,
    /// `direct` or `derived`.
    pub estimate: String,
    /// The spectral method within each window.
    pub method: String,
    /// Duration of a cycle, where the windows lie about the same phase of all cycles.
    pub cycle_s: Option<f64>,
    /// How many cycles there are.
    pub cycles: Option<usize>,
    /// Middle of each window since the trials' beginning, or the cycle's.
    pub time_s: Vec<f64>,
    /// Independent averages in each window.
    pub effective_averages: Vec<Number>,
    /// The grid within each window.
    pub frequency_hz: Vec<f64>,
    /// One response a window.
    pub response: Vec<Response>,
    /// Of all inputs with one output as they were measured, `[output][frequency]`, one a window.
    pub multiple_coherence: Vec<Matrix>,
}

impl Course {
    /// Frequencies above zero at which most windows have a gain whose interval does not reach zero, in any entry.
    pub fn known(&self) -> Vec<usize> {
        let entries = || self.response.first().into_iter().flat_map(|r| ndarray::indices((r.re.dim().0, r.re.dim().1)));
        let most = |(i, j): (usize, usize), f: usize| 2 * self.response.iter().filter(|r| r.gain_ci95[[i, j, f, 0]] > 0.0).count() >= self.response.len();
        (0..self.frequency_hz.len()).filter(|&f| self.frequency_hz[f] > 0.0 && entries().into_iter().any(|entry| most(entry, f))).collect()
    }
}
