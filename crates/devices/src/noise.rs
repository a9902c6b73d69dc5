//! Random signals of an experiment: force that a limb makes by itself.

use crate::controller::PerAxis;
use ndof_signal::{Passband, SosFilter};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

/// Force that the limb makes by itself: white noise behind a second-order Butterworth low-pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimbNoise {
    /// Its root mean square on each axis (N, N m).
    pub rms_n: PerAxis,
    /// Cut-off frequency (Hz).
    #[serde(default = "default_cutoff_hz")]
    pub cutoff_hz: f64,
}

fn default_cutoff_hz() -> f64 {
    2.0
}

/// `count` samples of filtered noise with expected root mean square `rms`, stationary from the first.
pub(crate) fn low_pass_noise(rng: &mut ChaCha8Rng, rms: f64, cutoff_hz: f64, sample_rate_hz: f64, count: usize) -> Vec<f64> {
    let corner_hz = cutoff_hz.min(0.499 * sample_rate_hz);
    let Ok(filter) = SosFilter::butterworth(2, Passband::Low(corner_hz), sample_rate_hz) else { return vec![f64::NAN; count] };
    // Its impulse response has died away (e⁻³⁰) after ten times √2/(π f_c), hence the warm-up; its energy is the noise gain.
    let settle = (10.0 * std::f64::consts::SQRT_2 / std::f64::consts::PI * sample_rate_hz / cutoff_hz).ceil() as usize;
    let mut impulse = filter.stream();
    let energy: f64 = (0..settle).map(|k| impulse.step(if k == 0 { 1.0 } else { 0.0 }).powi(2)).sum();
    let (gain, mut stream) = (rms / energy.sqrt(), filter.stream());
    let mut next = || stream.step(rng.sample(StandardNormal));
    (0..settle).for_each(|_| {
        next();
    });
    (0..count).map(|_| gain * next()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn the_noise_has_the_level_asked_for() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (rms, count) = (0.5, 500_000);
        let w = low_pass_noise(&mut rng, rms, 2.0, 500.0, count);
        let variance = w.iter().map(|v| v * v).sum::<f64>() / count as f64;
        // 1000 s of noise that is wider than 2 Hz: the variance is that of at least 4000 independent numbers, relative sd √(2/4000).
        assert!((variance / (rms * rms) - 1.0).abs() < 4.0 * (2.0_f64 / 4000.0).sqrt(), "{variance}");
    }
}
