//! One low-pass for torques and for all that is to explain them, so that it changes none of their relations.

use std::f64::consts::{PI, TAU};

/// A windowed sinc of which every `stride`-th value is taken.
#[derive(Clone, Debug)]
pub(crate) struct Band {
    pub pass_hz: f64,
    pub rate_hz: f64,
    /// Samples of the log between two of what is compared.
    pub stride: usize,
    /// Samples on each side that the kernel reaches over.
    reach: usize,
}

/// Share of the motion's corner up to which torques are compared: there the smoothing of the motion has taken 0.3 %. Beyond it a friction would be as
/// sharp as it is, and the acceleration that answers it would not.
const BELOW_CORNER: f64 = 0.7;
/// Multiple of the fastest motion beyond which there is nothing to compare: a friction that changes its sign with the motion has lines that fall with
/// their order, and all beyond the tenth hold a twentieth of its power.
const BEYOND_MOTION: f64 = 10.0;
/// Share of the rate that the kernel's transition leaves below Nyquist.
const HIGHEST: f64 = 0.35;
/// Half width of the kernel in periods of the pass band's edge: its transition is then half of the band wide.
const PERIODS: f64 = 4.0;
/// Samples kept per period of the edge: no more than it takes. What the transition folds back it folds of torques and columns alike, and more samples
/// would leave the noise a gap below their Nyquist frequency that no autoregression of few terms makes white.
const KEPT: f64 = 2.0;

impl Band {
    /// For a motion whose fastest part has one frequency and which is cut off at another.
    pub fn new([fastest_hz, corner_hz]: [f64; 2], rate_hz: f64) -> Self {
        let pass_hz = (BEYOND_MOTION * fastest_hz).min(BELOW_CORNER * corner_hz).min(HIGHEST * rate_hz);
        let stride = ((rate_hz / (KEPT * pass_hz)).floor() as usize).max(1);
        Band { pass_hz, rate_hz, stride, reach: (PERIODS * rate_hz / pass_hz).ceil() as usize }
    }

    /// Rate of what is compared (Hz).
    pub fn kept_hz(&self) -> f64 {
        self.rate_hz / self.stride as f64
    }

    /// Samples of the log that each value is made of.
    pub fn width(&self) -> usize {
        2 * self.reach + 1
    }

    /// Where values are kept of a log of so many samples of which `edge` at each end are not used.
    pub fn places(&self, samples: usize, edge: usize) -> Vec<usize> {
        let margin = edge.max(self.reach + 1);
        (margin..samples.saturating_sub(margin)).step_by(self.stride).collect()
    }

    /// The kernel for a signal that is taken `ahead` samples later than it stands.
    pub fn kernel(&self, ahead: f64) -> Vec<f64> {
        let reach = self.reach as f64;
        let mut weights: Vec<f64> = (0..=2 * self.reach)
            .map(|k| {
                let t = k as f64 - reach - ahead;
                let phase = TAU * self.pass_hz * t / self.rate_hz;
                let sinc = if phase.abs() < 1e-9 { 1.0 } else { phase.sin() / phase };
                if t.abs() < reach + 1.0 { sinc * (0.5 + 0.5 * (PI * t / (reach + 1.0)).cos()) } else { 0.0 }
            })
            .collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        weights
    }

    pub fn apply(&self, kernel: &[f64], x: &[f64], places: &[usize]) -> Vec<f64> {
        places.iter().map(|p| x[p - self.reach..=p + self.reach].iter().zip(kernel).map(|(x, w)| x * w).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Folded back at the rate of what is kept, the kernel's power has no gap: white noise of a torque stays nearly white.
    #[test]
    fn white_noise_stays_nearly_white() {
        let band = Band::new([0.7, 20.0], 200.0);
        let kernel = band.kernel(0.0);
        let lag = |l: usize| kernel.iter().zip(kernel.iter().skip(l * band.stride)).map(|(a, b)| a * b).sum::<f64>();
        for l in 1..6 {
            assert!((lag(l) / lag(0)).abs() < 0.15, "{l}: {}", lag(l) / lag(0));
        }
    }

    #[test]
    fn what_lies_in_the_band_passes_and_may_be_taken_later() {
        let band = Band::new([1.0, 20.0], 200.0);
        let tone = |f: f64, ahead: f64| -> Vec<f64> { (0..4000).map(|k| (TAU * f * (f64::from(k) + ahead) / 200.0).sin()).collect() };
        let places = band.places(4000, 0);
        for ahead in [0.0, 0.7, -2.3] {
            let found = band.apply(&band.kernel(ahead), &tone(1.3, 0.0), &places);
            let expected = tone(1.3, ahead);
            // A Hann window over eight periods of the edge leaves less than a hundredth of a percent far inside the band.
            assert!(found.iter().zip(&places).all(|(x, p)| (x - expected[*p]).abs() < 1e-3), "{ahead}");
        }
        let above = band.apply(&band.kernel(0.0), &tone(15.0, 0.0), &places);
        assert!(above.iter().all(|x| x.abs() < 1e-2));
    }
}
