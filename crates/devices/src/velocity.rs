//! What a controller takes for velocity: the backward difference of the position, behind a first-order Butterworth low-pass.

use ndof_signal::{Passband, SosFilter, SosStream};

/// Gain g and pole p of the low-pass g (1 + z⁻¹)/(1 − p z⁻¹); no numbers for a corner that is none.
pub(crate) fn velocity_filter(cutoff_hz: f64, sample_rate_hz: f64) -> (f64, f64) {
    let filter = low_pass(cutoff_hz, sample_rate_hz);
    filter.sections().first().map_or((f64::NAN, f64::NAN), |section| (section.b[0], -section.a[0]))
}

fn low_pass(cutoff_hz: f64, sample_rate_hz: f64) -> SosFilter {
    SosFilter::butterworth(1, Passband::Low(cutoff_hz), sample_rate_hz).unwrap_or_else(|_| SosFilter::from_sections(Vec::new()))
}

/// The velocity of one coordinate, sample by sample.
#[derive(Clone)]
pub(crate) struct Velocity {
    sample_rate_hz: f64,
    last: f64,
    low_pass: SosStream,
}

impl Velocity {
    /// At rest at `position`.
    pub(crate) fn at_rest(position: f64, cutoff_hz: f64, sample_rate_hz: f64) -> Self {
        Velocity { sample_rate_hz, last: position, low_pass: low_pass(cutoff_hz, sample_rate_hz).stream() }
    }

    /// The velocity with the next position.
    pub(crate) fn step(&mut self, position: f64) -> f64 {
        let difference = (position - self.last) * self.sample_rate_hz;
        self.last = position;
        self.low_pass.step(difference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_motion_is_seen_after_the_filter_has_settled() {
        let mut velocity = Velocity::at_rest(0.5, 20.0, 500.0);
        let seen: Vec<f64> = (1..=400).map(|k| velocity.step(0.5 + 0.3 * f64::from(k) / 500.0)).collect();
        let (gain, pole) = velocity_filter(20.0, 500.0);
        assert!((seen[0] - 0.3 * gain).abs() < 1e-12 && (seen[399] - 0.3).abs() < 1e-12);
        // Each sample closes in by the pole.
        assert!(((seen[11] - 0.3) / (seen[10] - 0.3) - pole).abs() < 1e-9);
    }
}
