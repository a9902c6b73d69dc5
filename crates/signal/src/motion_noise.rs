//! Where a motion sinks into the noise of its sensor.

use crate::cross_spectra::CrossSpectra;
use crate::derivatives::RESOLVED;
use crate::segments::Detrend;
use crate::welch::Welch;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What is known of the noise of a sensor of position or angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionNoise {
    /// Highest frequency at which the motion is no less than its noise (Hz).
    pub corner_hz: f64,
    /// One-sided density of that noise (unit²/Hz).
    pub density: f64,
}

/// Fewest samples of which a spectrum says where the noise begins.
const SEGMENT: usize = 256;
/// The part of the band below Nyquist that is taken to hold nothing but noise.
const ABOVE: f64 = 0.75;

impl MotionNoise {
    /// Of one sensor over all trials. The density of its second difference is compared with that of white noise, 16 sin⁴(π f/f_s) S, whose level
    /// S is taken above three quarters of Nyquist; below the corner a Wiener filter passes more than half. `None` for what does not move, and
    /// where trials are too short.
    ///
    /// ```
    /// use ndof_signal::MotionNoise;
    /// use std::f64::consts::TAU;
    ///
    /// // 0.4 Hz, seen by an encoder of 4096 steps a turn at 200 Hz.
    /// let step = TAU / 4096.0;
    /// let angle: Vec<f64> = (0..8000).map(|k| ((TAU * 0.4 * f64::from(k) / 200.0).sin() / step).round() * step).collect();
    /// let noise = MotionNoise::of(&[&angle], 200.0).expect("it moves");
    /// assert!(noise.corner_hz > 0.4 && noise.corner_hz < 40.0);
    /// ```
    pub fn of(trials: &[&[f64]], rate_hz: f64) -> Option<Self> {
        let density = density(trials, rate_hz, |x| x.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect())?;
        let segment = 2 * (density.len() - 1);
        let white = |k: usize| (2.0 * (PI * k as f64 / segment as f64).sin()).powi(4);
        // Half the rate has no line on the other side, and holds half the noise.
        let ratio: Vec<f64> = (1..density.len() - 1).map(|k| density[k] / white(k)).collect();
        let top = (ABOVE * ratio.len() as f64) as usize;
        let noise = ratio[top..].iter().sum::<f64>() / (ratio.len() - top) as f64;
        // Over a quarter of an octave, so that no gap between lines of a periodic movement ends the band; the highest stretch that stands out ends it.
        let stands_out = |k: usize| {
            let (a, b) = (k, ((1.19 * (k + 1) as f64).ceil() as usize).max(k + 3).min(ratio.len()));
            ratio[a..b].iter().sum::<f64>() / (b - a) as f64 > 2.0 * noise
        };
        let highest = (0..top.max(1)).rev().find(|k| stands_out(*k))?;
        let corner_hz = ((highest + 1) as f64 * rate_hz / segment as f64).min(RESOLVED * rate_hz / 2.0);
        (noise.is_finite() && ratio[0] > 0.0).then_some(MotionNoise { corner_hz, density: noise })
    }

    /// rms of the noise in the k-th derivative of the motion below the corner.
    pub fn rms_of_derivative(&self, derivative: i32) -> f64 {
        let f = self.corner_hz;
        (TAU.powi(2 * derivative) * self.density * f.powi(2 * derivative + 1) / f64::from(2 * derivative + 1)).sqrt()
    }

    /// Where this noise, accelerating an inertia, overtakes that of the effort (Hz): m (2πf)² √S_x = √S_F. Below it smoothing would take more from
    /// the motion than noise from the effort, of which `effort` is the density ([`effort_noise`]). Never below the corner, nor beyond what samples resolve.
    pub fn overtakes_hz(&self, inertia: f64, effort: f64, rate_hz: f64) -> f64 {
        let found = (effort / (inertia.powi(2) * self.density)).powf(0.25) / TAU;
        let most = RESOLVED * rate_hz / 2.0;
        if found.is_finite() { found.clamp(self.corner_hz.min(most), most) } else { most }
    }
}

/// One-sided density of all trials together, by Welch's method, of what `prepared` makes of them; `None` where they are too short.
fn density(trials: &[&[f64]], rate_hz: f64, prepared: impl Fn(&[f64]) -> Vec<f64>) -> Option<Vec<f64>> {
    let longest = trials.iter().map(|x| x.len()).max()?;
    let segment = 2 * (longest.clamp(16, 4096).min(SEGMENT.max(trials[0].len() / 8)) / 2);
    let welch = Welch { detrend: Detrend::None, ..Welch::new(segment) };
    let of_trials: Vec<CrossSpectra> = trials.iter().filter_map(|x| welch.spectra(rate_hz, &[&prepared(x)]).ok()).collect();
    let pooled = CrossSpectra::pool(&of_trials).ok()?;
    Some((0..pooled.frequency_hz().len()).map(|f| pooled.power(f, 0)).collect())
}

/// One-sided density (unit²/Hz) of an effort where there is hardly anything but noise: above three quarters of Nyquist, of its first difference, so that
/// what is slow and large does not leak there. `None` where trials are too short.
pub fn effort_noise(trials: &[&[f64]], rate_hz: f64) -> Option<f64> {
    let density = density(trials, rate_hz, |x| x.windows(2).map(|w| w[1] - w[0]).collect())?;
    let n = density.len() - 1;
    let white = |k: usize| (2.0 * (FRAC_PI_2 * k as f64 / n as f64).sin()).powi(2);
    let top = (ABOVE * n as f64) as usize;
    Some((top..n).map(|k| density[k] / white(k)).sum::<f64>() / (n - top) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_is_where_the_movement_sinks_into_the_steps_of_the_encoder() {
        let (rate, step) = (200.0, TAU / 4096.0);
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let x: Vec<f64> = (0..8000).map(|k| ((TAU * 0.4 * f64::from(k) / rate).sin() / step + random() - 0.5).round() * step).collect();
        let found = MotionNoise::of(&[&x], rate).expect("it moves");
        // Steps and the dither before them: twice step²/12 over the band.
        let expected = 2.0 * step * step / 12.0 / (rate / 2.0);
        assert!((found.density / expected - 1.0).abs() < 0.2, "{} {expected}", found.density);
        assert!(found.corner_hz > 0.4 && found.corner_hz < 20.0, "{}", found.corner_hz);
        assert!(MotionNoise::of(&[&vec![1.0; 4000]], rate).is_none());
        // White noise of an effort of variance 1 has the density 2/rate; 3000 lines of 31 segments scatter by 1 %.
        let effort: Vec<f64> = (0..8000).map(|_| 12_f64.sqrt() * (random() - 0.5)).collect();
        assert!((effort_noise(&[&effort], rate).expect("long enough") * rate / 2.0 - 1.0).abs() < 0.05);
    }
}
