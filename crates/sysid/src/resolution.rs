//! Where the window was too wide for the response.

use crate::response::{FrequencyResponse, places};
use ndof_signal::Kernel;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    let lines = by_lines(kernel, spacing_hz);
    let mut found = Vec::new();
    for (i, j) in places(p, q) {
        let value: Vec<Complex64> = (0..response.len()).map(|f| response.value[[f, i, j]]).collect();
        let mut worst: Option<Unresolved> = None;
        for (f, &f_hz) in response.frequency_hz.iter().enumerate() {
            let gain = value[f].norm();
            if !(low_hz..=high_hz).contains(&f_hz) || !gain.is_finite() || gain == 0.0 {
                continue;
            }
            let std_error = (response.variance(f, i, j) / 2.0).sqrt();
            if std_error > share * gain {
                continue;
            }
            let seen: Option<Complex64> = lines.iter().map(|(m, w)| Some(value.get(f.checked_add_signed(*m)?)? * *w)).sum();
            let Some(seen) = seen.filter(|seen| seen.is_finite()) else { continue };
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

/// The kernel on the lines of the estimate, so many away, between which a response is taken as straight.
fn by_lines(kernel: &Kernel, spacing_hz: f64) -> Vec<(isize, f64)> {
    let mut lines: BTreeMap<isize, f64> = BTreeMap::new();
    for (offset, weight) in kernel.offset_hz.iter().zip(&kernel.weight) {
        let x = offset / spacing_hz;
        let near = x.round();
        if (x - near).abs() < 1e-9 {
            *lines.entry(near as isize).or_default() += weight;
        } else {
            let (below, share) = (x.floor(), x - x.floor());
            *lines.entry(below as isize).or_default() += weight * (1.0 - share);
            *lines.entry(below as isize + 1).or_default() += weight * share;
        }
    }
    lines.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_lines_is_shared_by_them() {
        let kernel = Kernel { offset_hz: vec![-0.75, 0.0, 0.125, 1.0], weight: vec![4.0, 2.0, 8.0, 1.0] };
        // A spacing of half a hertz: one and a half lines below, a quarter of one above, two above.
        assert_eq!(by_lines(&kernel, 0.5), [(-2, 2.0), (-1, 2.0), (0, 8.0), (1, 2.0), (2, 1.0)]);
        assert_eq!(by_lines(&kernel, f64::INFINITY), [(0, 15.0)]);
    }
}
