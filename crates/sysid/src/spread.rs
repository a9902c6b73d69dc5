//! The spread between trials beside the spread within them.

use crate::response::FrequencyResponse;
use ndarray::Array3;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// What repeated trials say about an error that each of them predicts for itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Standard deviation of the mean over trials, from their scatter, √(E|δ|²), `[f][p][q]`.
    pub between: Array3<f64>,
    /// The same as the trials' own covariances predict it, `[f][p][q]`.
    pub within: Array3<f64>,
    /// √(Σ between² / within²) over the band and all entries: 1 where a trial is like the next; above it the subject or
    /// the robot has changed from trial to trial, and the pooled intervals are too narrow by about this factor.
    pub ratio: f64,
    /// The standard error of that ratio by chance alone.
    pub ratio_std_error: f64,
}

/// Compares single-trial estimates of one response over `low_hz..=high_hz`; `None` for fewer than two trials, or other
/// grids or shapes.
pub fn spread(trials: &[FrequencyResponse], low_hz: f64, high_hz: f64) -> Option<Spread> {
    let first = trials.first()?;
    let (p, q) = first.shape();
    if trials.len() < 2 || trials.iter().any(|t| t.shape() != (p, q) || t.frequency_hz != first.frequency_hz) {
        return None;
    }
    let n = trials.len() as f64;
    let mut between = Array3::from_elem((first.len(), p, q), f64::NAN);
    let mut within = between.clone();
    let spacing_hz = first.uncertainty.as_ref()?.independent_spacing_hz;
    let (mut sum, mut count) = (0.0, 0.0);
    let independent = apart(first.frequency_hz.iter().copied(), [low_hz, high_hz], spacing_hz);
    for f in 0..first.len() {
        let counts = independent.binary_search(&f).is_ok();
        for i in 0..p {
            for j in 0..q {
                let mean = trials.iter().map(|t| t.value[[f, i, j]]).sum::<Complex64>() / n;
                let scatter = trials.iter().map(|t| (t.value[[f, i, j]] - mean).norm_sqr()).sum::<f64>() / (n - 1.0) / n;
                let own = trials.iter().map(|t| t.variance(f, i, j)).sum::<f64>() / n / n;
                between[[f, i, j]] = scatter.sqrt();
                within[[f, i, j]] = own.sqrt();
                if counts && (scatter / own).is_finite() {
                    sum += scatter / own;
                    count += 1.0;
                }
            }
        }
    }
    let ratio = (sum / count).sqrt();
    // A scatter of n complex values has 2(n−1) degrees of freedom: relative variance 1/(n−1), halved by the root.
    Some(Spread { between, within, ratio, ratio_std_error: 0.5 / ((n - 1.0) * count).sqrt() })
}

/// Which frequencies of a band are independent: the first, and each that is `spacing_hz` beyond the one before.
pub(crate) fn apart(frequency_hz: impl Iterator<Item = f64>, [low_hz, high_hz]: [f64; 2], spacing_hz: f64) -> Vec<usize> {
    let mut next_hz = low_hz;
    let mut found = Vec::new();
    for (f, hz) in frequency_hz.enumerate() {
        if hz >= next_hz && hz <= high_hz {
            found.push(f);
            next_hz = hz + spacing_hz;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    /// Every half hertz, at least 1.2 Hz apart, within 2 to 7 Hz.
    #[test]
    fn each_independent_frequency_is_beyond_the_one_before_and_within_the_band() {
        assert_eq!(super::apart((0..20).map(|k| 0.5 * f64::from(k)), [2.0, 7.0], 1.2), [4, 7, 10, 13]);
        assert_eq!(super::apart((0..20).map(|k| 0.5 * f64::from(k)), [1.9, 3.0], 0.5), [4, 5, 6]);
    }
}
