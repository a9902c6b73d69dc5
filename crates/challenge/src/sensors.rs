//! Noise, sensors and their faults.

use crate::clock::{FINE_HZ, FS};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::{PI, TAU};

/// Uniform noise through a cascade of second-order Butterworth sections, scaled to `rms`.
pub fn band_noise(rng: &mut ChaCha8Rng, n: usize, cutoff: f64, rms: f64, order: usize) -> Vec<f64> {
    let run_in = 2000;
    let mut x: Vec<f64> = (0..n + run_in).map(|_| rng.random_range(-1.0..1.0)).collect();
    let w = (PI * cutoff / FS).tan();
    for q in 0..order / 2 {
        second_order(&mut x, w, 2.0 * (PI * (2 * q + 1) as f64 / (2 * order) as f64).sin(), 0.0);
    }
    let x = &x[run_in..];
    let size = (x.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
    x.iter().map(|v| v / size * rms).collect()
}

/// A low-pass of second order by the bilinear transform, of w the tangent of half the corner's angle and twice the damping ratio, as if what came before
/// had been `before`.
pub fn second_order(x: &mut [f64], w: f64, damping: f64, before: f64) {
    let norm = 1.0 + damping * w + w * w;
    let (g, a1, a2) = (w * w / norm, 2.0 * (w * w - 1.0) / norm, (1.0 - damping * w + w * w) / norm);
    let [mut x1, mut x2, mut y1, mut y2] = [before; 4];
    for v in x {
        let y = g * (*v + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
        (x2, x1, y2, y1) = (x1, *v, y1, y);
        *v = y;
    }
}

/// Means over the samples' intervals of `sub` steps.
pub fn average(fine: &[f64], sub: usize) -> Vec<f64> {
    fine.chunks_exact(sub).map(|c| c.iter().sum::<f64>() / sub as f64).collect()
}

/// A series that comes late.
pub fn late(fine: &[f64], delay_s: f64) -> Vec<f64> {
    let steps = delay_s * FINE_HZ;
    let (whole, rest) = (steps.floor() as usize, steps.fract());
    (0..fine.len())
        .map(|k| {
            let at = |d: usize| fine[k.saturating_sub(d)];
            (1.0 - rest) * at(whole) + rest * at(whole + 1)
        })
        .collect()
}

/// A series through a first-order low-pass.
pub fn smoothed(fine: &[f64], cutoff: f64) -> Vec<f64> {
    let a = 1.0 - (-TAU * cutoff / FINE_HZ).exp();
    let mut y = fine[0];
    fine.iter()
        .map(|x| {
            y += a * (x - y);
            y
        })
        .collect()
}

/// What a channel shows whose steps are not alike: every code ends up to a third of a step beside its place.
pub fn uneven(x: &[f64], quantum: f64) -> Vec<f64> {
    x.iter()
        .map(|v| {
            let code = (v / quantum).round();
            let place = (code * 0.618_033_988_7).fract().abs() - 0.5;
            quantum * (code + 0.66 * place)
        })
        .collect()
}

/// What a noisy channel with steps shows.
pub fn measured(rng: &mut ChaCha8Rng, x: &[f64], noise: f64, quantum: f64) -> Vec<f64> {
    x.iter()
        .map(|v| {
            let e: f64 = rng.sample(StandardNormal);
            ((v + noise * e) / quantum).round() * quantum
        })
        .collect()
}
