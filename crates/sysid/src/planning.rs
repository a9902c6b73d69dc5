//! How long to measure, and when to stop.

use crate::interval::Confidence;
use crate::response::{FrequencyResponse, places};
use serde::{Deserialize, Serialize};

/// Effective averages at which the gain's interval is ± `relative_half_width` (0.1 for 10 %):
///
/// t(2(n − q)) · √((1 − γ²) / (2 γ² (n − q))) = half width, γ² the partial coherence of the entry.
///
/// NaN for a coherence or a width outside of 0 to 1 (a width above 1 has no meaning as an interval of a gain).
///
/// ```
/// use ndof_sysid::averages_for_interval;
/// let (loose, tight) = (averages_for_interval(0.9, 2, 0.1, 0.95), averages_for_interval(0.9, 2, 0.05, 0.95));
/// assert!(loose > 20.0 && tight > 3.5 * (loose - 2.0));
/// ```
pub fn averages_for_interval(partial_coherence: f64, inputs: usize, relative_half_width: f64, level: f64) -> f64 {
    let valid = partial_coherence > 0.0 && partial_coherence < 1.0 && relative_half_width > 0.0 && relative_half_width < 1.0;
    if !valid {
        return f64::NAN;
    }
    let noise = (1.0 - partial_coherence) / (2.0 * partial_coherence);
    // The width falls with ν in both factors: bisection on the logarithm of ν.
    let too_wide = |freedom: f64| {
        let unit = Confidence::new(level, freedom).gain_phase(1.0.into(), 2.0 * noise / freedom);
        unit.gain_interval[1] - 1.0 > relative_half_width
    };
    let (mut low, mut high) = (0.25_f64, 0.5_f64);
    while too_wide(high) && high < 1e12 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if too_wide(middle) { low = middle } else { high = middle }
    }
    high + inputs as f64
}

/// What a measurement in progress still lacks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Whether every judged entry has the wanted interval.
    pub reached: bool,
    /// Share of frequencies and entries that have it.
    pub share: f64,
    /// How many times the present length is needed in all for the worst of the judged entries, at least 1.
    pub times_present_length: f64,
}

/// When to stop: the gain's interval of every entry in a band is within ± a share of the gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoppingRule {
    /// Wanted half width over gain.
    pub relative_half_width: f64,
    /// Level of the interval.
    pub level: f64,
    /// Lowest frequency that counts.
    pub low_hz: f64,
    /// Highest frequency that counts.
    pub high_hz: f64,
    /// Share of frequencies of each entry that must have it; below 1 lets a notch go.
    pub share: f64,
    /// Whether only the diagonal counts: entries that are zero never reach a relative interval.
    pub diagonal_only: bool,
}

impl StoppingRule {
    /// Judges a response so far; `None` where it has no covariance or nothing in the band.
    pub fn judge(&self, response: &FrequencyResponse) -> Option<Progress> {
        let freedom = response.uncertainty.as_ref()?.degrees_of_freedom;
        let confidence = Confidence::new(self.level, freedom);
        let (p, q) = response.shape();
        let (mut reached, mut good, mut all, mut times) = (true, 0, 0, 1.0_f64);
        for (i, j) in places(p, q).filter(|(i, j)| !self.diagonal_only || i == j) {
            let mut widths: Vec<f64> = (0..response.len())
                .filter(|&f| (self.low_hz..=self.high_hz).contains(&response.frequency_hz[f]))
                .map(|f| {
                    let entry = confidence.gain_phase(response.value[[f, i, j]], response.variance(f, i, j));
                    (entry.gain_interval[1] - entry.gain) / entry.gain
                })
                .filter(|w| !w.is_nan())
                .collect();
            if widths.is_empty() {
                return None;
            }
            widths.sort_by(f64::total_cmp);
            good += widths.iter().filter(|w| **w <= self.relative_half_width).count();
            all += widths.len();
            let judged = widths[((self.share * widths.len() as f64).ceil() as usize).clamp(1, widths.len()) - 1];
            reached &= judged <= self.relative_half_width;
            times = times.max((judged / self.relative_half_width).powi(2));
        }
        Some(Progress { reached, share: f64::from(good as u32) / f64::from(all as u32), times_present_length: times })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coherence_near_nothing_is_answered_at_once() {
        // Found by fuzzing: quantiles for some 10^8 degrees of freedom never ended.
        assert!(averages_for_interval(1e-9, 1, 0.1, 0.95) > 1e10);
        for (coherence, width, level) in [(4.7e-10, 7.3e-239, 7.3e-239), (0.5, 1e-300, 1e-3), (f64::MIN_POSITIVE, 0.1, 0.95)] {
            assert!(averages_for_interval(coherence, 1, width, level).is_finite(), "{coherence} {width} {level}");
        }
    }

    #[test]
    fn what_is_no_coherence_or_no_width_has_no_length() {
        for (coherence, width) in [(0.0, 0.1), (1.0, 0.1), (-0.1, 0.1), (1.1, 0.1), (0.5, 0.0), (0.5, 1.0), (0.5, -0.1), (0.5, 1.1)] {
            assert!(averages_for_interval(coherence, 1, width, 0.95).is_nan(), "{coherence} {width}");
        }
    }

    #[test]
    fn progress_is_that_of_the_widest_interval() {
        use crate::{Direct, Labels, Ports, ResponseKind, direct};
        use ndof_signal::Welch;
        let x: Vec<f64> = (0..4000).map(|k| (f64::from(k) * f64::from(k) * 0.01).sin()).collect();
        let y: Vec<f64> = x.iter().enumerate().map(|(k, x)| 50.0 * x + (k as f64 * k as f64 * 0.37).cos()).collect();
        let spectra = Welch::new(200).spectra(100.0, &[&x, &y]).expect("valid");
        let ports = Ports { references: vec![], inputs: vec![0], outputs: vec![1] };
        let response = direct(&spectra, &ports, &Labels::numbered(&ports, ResponseKind::Compliance), Direct::default()).expect("valid").response;
        let rule = StoppingRule { level: 0.95, relative_half_width: 0.1, low_hz: 5.0, high_hz: 20.0, share: 1.0, diagonal_only: false };
        let progress = rule.judge(&response).expect("in the band");
        let confidence = Confidence::new(0.95, response.uncertainty.as_ref().expect("noise").degrees_of_freedom);
        let widths: Vec<f64> = (0..response.len())
            .filter(|&f| (5.0..=20.0).contains(&response.frequency_hz[f]))
            .map(|f| confidence.gain_phase(response.value[[f, 0, 0]], response.variance(f, 0, 0)))
            .map(|entry| entry.gain_interval[1] / entry.gain - 1.0)
            .collect();
        let widest = widths.iter().copied().fold(0.0, f64::max);
        assert!((progress.times_present_length / (widest / 0.1).powi(2).max(1.0) - 1.0).abs() < 1e-9, "{progress:?} {widest}");
        let narrow = widths.iter().filter(|w| **w <= 0.1).count() as f64 / widths.len() as f64;
        assert!((progress.share - narrow).abs() < 1e-12 && progress.reached == (widest <= 0.1));
        assert!(StoppingRule { low_hz: 60.0, high_hz: 70.0, ..rule }.judge(&response).is_none());
    }
}
