//! Where the window was too wide for the response.

use crate::response::{FrequencyResponse, places};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A resonance that the estimate could not resolve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unresolved {
    /// Row of the response.
    pub output: usize,
    /// Column.
    pub input: usize,
    /// Where the bias is largest.
    pub frequency_hz: f64,
    /// About how far the gain is off there, relative to it: negative where a peak is flattened.
    pub relative_bias: f64,
    /// The same over the standard error of the gain.
    pub bias_over_std_error: f64,
}

/// Entries whose bias by the window's width exceeds both `share` of the gain (0.1) and three of its
/// standard errors, where the gain is known to within `share` at all, at their
/// worst frequency in `low_hz..=high_hz`.
///
/// The estimate has been seen through the kernel |W|² once; seen through it once more it loses about as much again
/// (b ≈ ½σ_W² H″ both times, Bendat & Piersol 2010, section 8.5), so that the second loss measures the first. Estimates
/// without a window (local polynomials, periods) have none.
pub fn unresolved(response: &FrequencyResponse, share: f64, low_hz: f64, high_hz: f64) -> Vec<Unresolved> {
    let Some(uncertainty) = &response.uncertainty else { return Vec::new() };
    let kernel = &uncertainty.kernel;
    // Without a window there is nothing to lose, nor need the grid be even: excited lines are not.
    if kernel.offset_hz.iter().all(|offset| *offset == 0.0) {
        return Vec::new();
    }
    let (p, q) = response.shape();
    let spacing_hz = if response.len() > 1 { response.frequency_hz[1] - response.frequency_hz[0] } else { f64::INFINITY };
    let at = |f_hz: f64, i: usize, j: usize| -> Option<Complex64> {
        let x = (f_hz - response.frequency_hz[0]) / spacing_hz;
        let k = if x >= 0.0 { x.floor() as usize } else { return None };
        let share = x - k as f64;
        let value = |k: usize| (k < response.len()).then(|| response.value[[k, i, j]]).filter(|v| v.is_finite());
        if share < 1e-9 { value(k) } else { Some(value(k)? * (1.0 - share) + value(k + 1)? * share) }
    };
    let mut found = Vec::new();
    for (i, j) in places(p, q) {
        let mut worst: Option<Unresolved> = None;
        for f in 0..response.len() {
            let f_hz = response.frequency_hz[f];
            let gain = response.value[[f, i, j]].norm();
            if !(low_hz..=high_hz).contains(&f_hz) || !gain.is_finite() || gain == 0.0 {
                continue;
            }
            let std_error = (response.variance(f, i, j) / 2.0).sqrt();
            if std_error > share * gain {
                continue;
            }
            let seen: Option<Complex64> = kernel.offset_hz.iter().zip(&kernel.weight).map(|(o, w)| Some(at(f_hz + o, i, j)? * *w)).sum();
            let Some(seen) = seen else { continue };
            let relative_bias = (seen.norm() - gain) / gain;
            let bias_over_std_error = relative_bias * gain / std_error;
            let larger = worst.is_none_or(|w| relative_bias.abs() > w.relative_bias.abs());
            if relative_bias.abs() > share && bias_over_std_error.abs() > 3.0 && larger {
                worst = Some(Unresolved { output: i, input: j, frequency_hz: f_hz, relative_bias, bias_over_std_error });
            }
        }
        found.extend(worst);
    }
    found
}
