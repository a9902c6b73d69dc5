//! Swept sines.

use super::{ExcitationError, positive};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// How the frequency goes with time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sweep {
    /// f(t) = f₀ + (f₁ − f₀) t/T: equal time for every hertz.
    Linear,
    /// f(t) = f₀ (f₁/f₀)^{t/T}: equal time for every octave.
    #[default]
    Logarithmic,
}

/// A swept sine, amplitude · sin 2π∫f dt (`scipy.signal.chirp` with `phi=-90`).
///
/// ```
/// use ndof_signal::{Chirp, Sweep};
/// let x = Chirp { samples: 1000, sample_rate_hz: 100.0, from_hz: 0.5, to_hz: 10.0, sweep: Sweep::Linear, amplitude: 3.0 }.generate()?;
/// assert_eq!((x.len(), x[0]), (1000, 0.0));
/// # Ok::<(), ndof_signal::ExcitationError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chirp {
    /// Number of samples; the sweep ends where the next one would be.
    pub samples: usize,
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Frequency at the beginning.
    pub from_hz: f64,
    /// Frequency at the end.
    pub to_hz: f64,
    /// How the frequency goes with time.
    pub sweep: Sweep,
    /// Peak, in the unit of the signal.
    pub amplitude: f64,
}

impl Chirp {
    /// The signal.
    ///
    /// # Errors
    /// [`ExcitationError`] if a number is not positive or a frequency not below Nyquist.
    pub fn generate(&self) -> Result<Vec<f64>, ExcitationError> {
        positive("sample rate in Hz", self.sample_rate_hz)?;
        positive("amplitude", self.amplitude)?;
        for frequency_hz in [self.from_hz, self.to_hz] {
            positive("frequency of the sweep in Hz", frequency_hz)?;
            if frequency_hz >= self.sample_rate_hz / 2.0 {
                return Err(ExcitationError::AboveNyquist { frequency_hz, sample_rate_hz: self.sample_rate_hz });
            }
        }
        let duration_s = self.samples as f64 / self.sample_rate_hz;
        let ratio = (self.to_hz / self.from_hz).ln();
        let cycles = |t: f64| match self.sweep {
            Sweep::Logarithmic if ratio != 0.0 => self.from_hz * duration_s * (ratio * t / duration_s).exp_m1() / ratio,
            _ => self.from_hz * t + (self.to_hz - self.from_hz) * t * t / (2.0 * duration_s),
        };
        Ok((0..self.samples).map(|k| self.amplitude * (TAU * cycles(k as f64 / self.sample_rate_hz)).sin()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frequency_between_zero_crossings_is_that_of_the_sweep() {
        let (samples, fs) = (40_000, 1000.0);
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let x = Chirp { samples, sample_rate_hz: fs, from_hz: 1.0, to_hz: 16.0, sweep, amplitude: 1.0 }.generate().expect("valid");
            // Half-way: 8.5 Hz linearly, 4 Hz by octaves; counted over ± 2 s, over which its mean is within 1 %.
            let crossings = (18_000..22_000).filter(|&k| x[k] < 0.0 && x[k + 1] >= 0.0).count() as f64;
            let expected = if sweep == Sweep::Linear { 8.5 } else { 4.0 } * 4.0;
            assert!((crossings - expected).abs() <= 1.0, "{sweep:?}: {crossings}");
        }
    }

    #[test]
    fn sweeps_beyond_nyquist_are_refused() {
        let chirp = Chirp { samples: 10, sample_rate_hz: 10.0, from_hz: 1.0, to_hz: 5.0, sweep: Sweep::Linear, amplitude: 1.0 };
        assert!(matches!(chirp.generate(), Err(ExcitationError::AboveNyquist { .. })));
        assert!(matches!(Chirp { from_hz: 0.0, to_hz: 2.0, ..chirp }.generate(), Err(ExcitationError::NotPositive { .. })));
    }

    #[test]
    fn a_sweep_that_goes_nowhere_is_a_tone() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let x = Chirp { samples: 100, sample_rate_hz: 100.0, from_hz: 3.0, to_hz: 3.0, sweep, amplitude: 2.0 }.generate().expect("valid");
            assert!(x.iter().enumerate().all(|(k, x)| (x - 2.0 * (TAU * 0.03 * k as f64).sin()).abs() < 1e-12), "{sweep:?}");
        }
    }
}
