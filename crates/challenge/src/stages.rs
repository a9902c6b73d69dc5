//! What stands between a quantity and its channel: latencies, filters, drifts, and the faults that no registry has.

use super::laws::course;
use super::sensors::{late, second_order, smoothed};
use crate::clock::FINE_HZ;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// One stage of a channel, on the grid of the integrator.
#[derive(Clone, Debug)]
pub enum Stage {
    /// Seconds.
    Delay(f64),
    /// A delay that sways by a share of itself.
    SwayingDelay(f64),
    /// A first-order low-pass, so many times in a row.
    LowPass(f64, usize),
    /// A second-order low-pass and its damping ratio.
    Second(f64, f64),
    /// The mean over so many seconds.
    MovingAverage(f64),
    /// Rate in the channel's unit a second, and the course of it.
    Drift(f64, &'static str),
    Scale(f64),
    /// A delay of that amplitude that goes to and fro: a clock that wanders.
    ClockWander(f64),
    /// Largest rate of change.
    Slew(f64),
    /// A delay that grows with the square of the signal's size: seconds at the typical size.
    AmplitudeDelay(f64, f64),
    /// Share of time in which the last value is held.
    Held(f64),
}

impl Stage {
    /// The channel after the stage.
    pub fn apply(&self, fine: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        let h = 1.0 / FINE_HZ;
        let duration = fine.len() as f64 * h;
        let at = |k: usize| k as f64 * h;
        match *self {
            Stage::Delay(delay) => late(fine, delay),
            Stage::SwayingDelay(delay) => warped(fine, |k| delay * (1.0 + 0.4 * (TAU * at(k) / 17.0).sin())),
            Stage::LowPass(cutoff, times) => (0..times).fold(fine.to_vec(), |x, _| smoothed(&x, cutoff)),
            // Too fast for the grid to show.
            Stage::Second(cutoff, _) if cutoff > FINE_HZ / 8.0 => fine.to_vec(),
            Stage::Second(cutoff, ratio) => {
                let mut out = fine.to_vec();
                second_order(&mut out, (PI * cutoff / FINE_HZ).tan(), 2.0 * ratio, fine[0]);
                out
            }
            Stage::MovingAverage(width) => {
                let count = ((width / h) as usize).max(1);
                let mut sum = count as f64 * fine[0];
                (0..fine.len())
                    .map(|k| {
                        sum += fine[k] - fine[k.saturating_sub(count)];
                        sum / count as f64
                    })
                    .collect()
            }
            Stage::Drift(rate, form) => fine.iter().enumerate().map(|(k, v)| v + rate * course(duration, form, at(k))).collect(),
            Stage::Scale(factor) => fine.iter().map(|v| v * factor).collect(),
            Stage::ClockWander(most) => {
                let phase: f64 = rng.random_range(0.0..TAU);
                warped(fine, |k| most * (TAU * at(k) / 6.3 + phase).sin())
            }
            Stage::Slew(most) => {
                let mut y = fine[0];
                fine.iter()
                    .map(|v| {
                        y += (v - y).clamp(-most * h, most * h);
                        y
                    })
                    .collect()
            }
            Stage::AmplitudeDelay(delay, size) => {
                let mut power = 1.0;
                let sizes: Vec<f64> = fine
                    .iter()
                    .map(|v| {
                        power += h / 0.3 * ((v / size).powi(2) - power);
                        power
                    })
                    .collect();
                warped(fine, |k| delay * sizes[k])
            }
            Stage::Held(share) => held(fine, share, rng),
        }
    }
}

/// A series whose delay changes from step to step, in seconds; a negative one looks ahead.
fn warped(fine: &[f64], delay_s: impl Fn(usize) -> f64) -> Vec<f64> {
    let last = fine.len() - 1;
    (0..fine.len())
        .map(|k| {
            let at = (k as f64 - delay_s(k) * FINE_HZ).clamp(0.0, last as f64);
            let (whole, rest) = (at as usize, at.fract());
            (1.0 - rest) * fine[whole] + rest * fine[(whole + 1).min(last)]
        })
        .collect()
}

/// Stretches of 30 to 150 ms in which nothing new comes.
fn held(fine: &[f64], share: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut out = fine.to_vec();
    let mut k = 0;
    while k < out.len() {
        let hold: f64 = rng.random_range(0.03..0.15);
        let flow: f64 = rng.random_range(0.2..1.8) * 0.09 * (1.0 - share) / share.max(1e-3);
        let from = (k + (flow * FINE_HZ) as usize).min(out.len());
        let to = (from + (hold * FINE_HZ) as usize).min(out.len());
        if from > 0 {
            let last = out[from - 1];
            out[from..to].fill(last);
        }
        k = to.max(k + 1);
    }
    out
}
