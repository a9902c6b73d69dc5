//! Joint motion and its derivatives from encoders, as far as they rise above their noise.

use ndof_signal::{RESOLVED, forward_transform};
use std::f64::consts::TAU;

/// Joint angles and what follows from them, `[joint][sample]`, at the rate of the log.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    /// Number of its trial.
    pub trial: usize,
    /// Angle (rad, m).
    pub q: Vec<Vec<f64>>,
    /// Its rate.
    pub v: Vec<Vec<f64>>,
    /// Its acceleration.
    pub a: Vec<Vec<f64>>,
    /// Its rate up to higher frequencies, where only the sign counts.
    pub sharp: Vec<Vec<f64>>,
    /// Torque as it was logged (N m, N).
    pub torque: Vec<Vec<f64>>,
    /// Torque that the file's bodies need for it, without friction.
    pub rigid: Vec<Vec<f64>>,
    /// Torque that a simulator logged beyond the file's, along its own motion; empty where the file is the simulation.
    pub beyond: Vec<Vec<f64>>,
    /// Where it moves: at rest dry friction holds a joint at any torque, and nothing is compared.
    pub moves: Vec<Vec<bool>>,
}

/// Share of a joint's rms speed below which it is as good as at rest, three times what its sign is smoothed over.
const AT_REST: f64 = 0.03;

/// Where a joint of that rms speed moves: all but what is slow for longer than `longest` samples.
pub(crate) fn moves(v: &[f64], speed: f64, longest: usize) -> Vec<bool> {
    let mut out = vec![true; v.len()];
    let mut from = 0;
    for to in 0..=v.len() {
        if to == v.len() || v[to].abs() >= AT_REST * speed {
            if to - from > longest {
                out[from..to].fill(false);
            }
            from = to + 1;
        }
    }
    out
}

/// What is known of the angles of one joint over all trials.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Encoder {
    /// Highest frequency at which the angle is no less than its noise (Hz).
    pub corner_hz: f64,
    /// One-sided density of that noise (rad²/Hz).
    pub noise: f64,
}

impl Encoder {
    /// rms of the noise in the k-th derivative of the smoothed angle.
    pub fn noise_of(&self, derivative: i32) -> f64 {
        let f = self.corner_hz;
        (TAU.powi(2 * derivative) * self.noise * f.powi(2 * derivative + 1) / f64::from(2 * derivative + 1)).sqrt()
    }
}

/// Fewest samples of which a spectrum says where the noise begins.
const SEGMENT: usize = 256;
/// The part of the band below Nyquist that is taken to hold nothing but noise.
const ABOVE: f64 = 0.75;

/// One-sided density of all trials together, by Welch's method with half-overlapping Hann segments, of what `prepared` makes of them; `None` where they
/// are too short.
fn density(trials: &[&[f64]], rate_hz: f64, prepared: impl Fn(&[f64]) -> Vec<f64>) -> Option<Vec<f64>> {
    let longest = trials.iter().map(|x| x.len()).max()?;
    let segment = 2 * (longest.clamp(16, 4096).min(SEGMENT.max(trials[0].len() / 8)) / 2);
    let forward = forward_transform(segment);
    let mut density = vec![0.0; segment / 2 + 1];
    let mut count = 0.0;
    let taper: Vec<f64> = (0..segment).map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / segment as f64).cos()).collect();
    let power: f64 = taper.iter().map(|w| w * w).sum();
    for x in trials {
        let x = prepared(x);
        let mut from = 0;
        while from + segment <= x.len() {
            let mut part: Vec<f64> = x[from..from + segment].iter().zip(&taper).map(|(x, w)| x * w).collect();
            let mut lines = forward.make_output_vec();
            forward.process(&mut part, &mut lines).ok()?;
            density.iter_mut().zip(&lines).for_each(|(d, l)| *d += 2.0 * l.norm_sqr() / (power * rate_hz));
            count += 1.0;
            from += segment / 2;
        }
    }
    // 0 Hz and half the rate have no line on the other side.
    let last = segment / 2;
    density.iter_mut().enumerate().for_each(|(k, d)| *d /= if k == 0 || k == last { 2.0 * count } else { count });
    (count > 0.0).then_some(density)
}

/// Density of a torque where there is hardly anything but noise: above three quarters of Nyquist, of its first difference, so that what is slow and
/// large does not leak there.
pub(crate) fn top_density(trials: &[&[f64]], rate_hz: f64) -> Option<f64> {
    let density = density(trials, rate_hz, |x| x.windows(2).map(|w| w[1] - w[0]).collect())?;
    let n = density.len() - 1;
    let white = |k: usize| (2.0 * (std::f64::consts::FRAC_PI_2 * k as f64 / n as f64).sin()).powi(2);
    let top = (ABOVE * n as f64) as usize;
    Some((top..=n).map(|k| density[k] / white(k)).sum::<f64>() / (n + 1 - top) as f64)
}

/// Where the angle of a joint sinks into its noise: the density of its second difference is compared with that of white noise, whose level is
/// taken above three quarters of Nyquist. Below the corner the Wiener filter passes more than half. `None` for a joint that does not move.
pub(crate) fn encoder(trials: &[&[f64]], rate_hz: f64) -> Option<Encoder> {
    let density = density(trials, rate_hz, |x| x.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect())?;
    let segment = 2 * (density.len() - 1);
    // What white noise of the angle is in its second difference.
    let white = |k: usize| (2.0 * (std::f64::consts::PI * k as f64 / segment as f64).sin()).powi(4);
    let ratio: Vec<f64> = density.iter().enumerate().skip(1).map(|(k, d)| d / white(k)).collect();
    let top = (ABOVE * ratio.len() as f64) as usize;
    let noise = ratio[top..].iter().sum::<f64>() / (ratio.len() - top) as f64;
    // Over a quarter of an octave, so that no gap between lines of a periodic movement ends the band; the highest stretch that stands out ends it.
    let stands_out = |k: usize| {
        let (a, b) = (k, ((1.19 * (k + 1) as f64).ceil() as usize).max(k + 3).min(ratio.len()));
        ratio[a..b].iter().sum::<f64>() / (b - a) as f64 > 2.0 * noise
    };
    let highest = (0..top.max(1)).rev().find(|k| stands_out(*k))?;
    let corner_hz = ((highest + 1) as f64 * rate_hz / segment as f64).min(RESOLVED * rate_hz / 2.0);
    (noise.is_finite() && ratio[0] > 0.0).then_some(Encoder { corner_hz, noise })
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
        let found = encoder(&[&x], rate).expect("it moves");
        // Steps and the dither before them: twice step²/12 over the band.
        let expected = 2.0 * step * step / 12.0 / (rate / 2.0);
        assert!((found.noise / expected - 1.0).abs() < 0.2, "{} {expected}", found.noise);
        assert!(found.corner_hz > 0.4 && found.corner_hz < 20.0, "{}", found.corner_hz);
        assert!(encoder(&[&vec![1.0; 4000]], rate).is_none());
    }
}
