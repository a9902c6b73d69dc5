//! Samples passed through operators on their spectrum, and what is thought to lie before and after them.

use ndof_signal::{forward_transform, inverse_transform};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// The smallest number from `n` upward whose only prime factors are 2, 3 and 5, and a multiple of 2.
pub(crate) fn smooth_length(n: usize) -> usize {
    (n.max(2)..)
        .find(|&m| {
            let mut rest = m;
            for prime in [2, 3, 5] {
                while rest % prime == 0 {
                    rest /= prime;
                }
            }
            rest == 1 && m % 2 == 0
        })
        .unwrap_or(n)
}

/// Samples mirrored at both ends.
pub(crate) fn mirrored(x: &[f64], pad: usize, padded: usize) -> Vec<f64> {
    let n = x.len();
    let mirror = |edge: f64, value: f64| 2.0 * edge - value;
    let mut y = Vec::with_capacity(padded);
    y.extend((1..=pad).rev().map(|k| mirror(x[0], x[k.min(n - 1)])));
    y.extend_from_slice(x);
    y.extend((1..=padded - n - pad).map(|k| mirror(x[n - 1], x[(n - 1).saturating_sub(k)])));
    y
}

/// What an operator leaves of imaginary parts where a real signal has none.
pub(crate) fn real_at_ends(spectrum: &mut [Complex64]) {
    spectrum[0].im = 0.0;
    if let Some(last) = spectrum.last_mut() {
        last.im = 0.0;
    }
}

/// Takes the straight line from the first sample to the last away: its start and its slope a sample.
pub(crate) fn level(y: &mut [f64]) -> (f64, f64) {
    let last = y.len() - 1;
    let (start, slope) = (y[0], (y[last] - y[0]) / last as f64);
    y.iter_mut().enumerate().for_each(|(k, v)| *v -= start + slope * k as f64);
    (start, slope)
}

/// Samples about a place of rest, passed through an operator that remembers: before the first sample and after the last the motion comes from rest and
/// goes back to it within `ends` samples, and rests as long as the record is.
///
/// What was mirrored repeats itself without end, and creep feels every one of its pasts.
pub(crate) fn remembered(samples: &[f64], ends: usize, rate_hz: f64, operator: impl Fn(Complex64) -> Complex64) -> Vec<f64> {
    let n = samples.len();
    let length = smooth_length(2 * (n + ends));
    let mut y = mirrored(samples, ends, n + 2 * ends);
    let fade = |k: usize| 0.5 - 0.5 * (PI * (k as f64 + 0.5) / ends as f64).cos();
    (0..ends).for_each(|k| y[k] *= fade(k));
    (0..ends).for_each(|k| y[n + 2 * ends - 1 - k] *= fade(k));
    y.resize(length, 0.0);
    passed(y, rate_hz, operator).map_or_else(|| samples.to_vec(), |y| y[ends..ends + n].to_vec())
}

/// Samples of a period passed through an operator.
fn passed(mut y: Vec<f64>, rate_hz: f64, operator: impl Fn(Complex64) -> Complex64) -> Option<Vec<f64>> {
    let length = y.len();
    let (forward, back) = (forward_transform(length), inverse_transform(length));
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut y, &mut spectrum).ok()?;
    for (k, x) in spectrum.iter_mut().enumerate() {
        *x *= operator(Complex64::new(0.0, TAU * k as f64 * rate_hz / length as f64)) / length as f64;
    }
    real_at_ends(&mut spectrum);
    back.process(&mut spectrum, &mut y).ok()?;
    Some(y)
}

/// Samples passed through an operator, mirrored at both ends.
pub(crate) fn filter(samples: &[f64], rate_hz: f64, operator: impl Fn(Complex64) -> Complex64) -> Vec<f64> {
    let n = samples.len();
    let layout = smooth_length(n + n / 2 + 2);
    let pad = (layout - n) / 2;
    let mut y = mirrored(samples, pad, layout);
    let (start, slope) = level(&mut y);
    let Some(y) = passed(y, rate_hz, &operator) else { return samples.to_vec() };
    let (level, rate) = straight(&operator);
    let per_sample = slope * level;
    let offset = level * start + rate * slope * rate_hz;
    y.iter().enumerate().skip(pad).take(n).map(|(k, v)| v + offset + per_sample * k as f64).collect()
}

/// The samples at `factor` times their rate, band-limited, mirrored at both ends.
pub(crate) fn finer(samples: &[f64], factor: usize) -> Vec<f64> {
    let n = samples.len();
    let pad = n / 4 + 1;
    let length = smooth_length(n + 2 * pad);
    let mut y = mirrored(samples, pad, length);
    let (start, slope) = level(&mut y);
    let (forward, back) = (forward_transform(length), inverse_transform(length * factor));
    let mut spectrum = forward.make_output_vec();
    let mut fine = back.make_output_vec();
    if forward.process(&mut y, &mut spectrum).is_err() {
        return vec![f64::NAN; n * factor];
    }
    spectrum.iter_mut().for_each(|x| *x /= length as f64);
    spectrum[length / 2] = Complex64::ZERO;
    spectrum.resize(length * factor / 2 + 1, Complex64::ZERO);
    if back.process(&mut spectrum, &mut fine).is_err() {
        return vec![f64::NAN; n * factor];
    }
    (0..n * factor).map(|k| fine[pad * factor + k] + start + slope * (pad as f64 + k as f64 / factor as f64)).collect()
}

/// H(0) and dH/ds at 0, which is what an operator does to a ramp; a derivative without bound counts as none.
pub(crate) fn straight(operator: &impl Fn(Complex64) -> Complex64) -> (f64, f64) {
    let level = operator(Complex64::ZERO).re;
    let small = Complex64::new(0.0, 1e-6);
    let rate = ((operator(small) - level) / small).re;
    (if level.is_finite() { level } else { 0.0 }, if rate.abs() < 1e2 { rate } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finer_samples_lie_on_the_same_curve() {
        let at = |t: f64| (TAU * 31.0 * t).sin() + 0.3 * t;
        let x: Vec<f64> = (0..4000).map(|k| at(k as f64 / 200.0)).collect();
        let fine = finer(&x, 4);
        // Far from the mirrored ends, whose kinks are felt as 1 / distance.
        for k in 6000..10_000 {
            assert!((fine[k] - at(k as f64 / 800.0)).abs() < 2e-3, "{k}");
            assert!(k % 4 != 0 || (fine[k] - x[k / 4]).abs() < 2e-3);
        }
    }

    /// The fractional derivative of ramps (Caputo): D^a of t is t^(1 - a) / Γ(2 - a).
    #[test]
    fn what_rested_before_the_record_creeps_by_what_was_recorded_alone() {
        let (fs, n, order) = (100.0, 4000, 0.3);
        // Up at 1, down through zero at 8, up again at 15 s: what is felt after the record has no area.
        let ramps = [(1.0, 1.0), (3.0, -1.0), (8.0, -2.0), (10.0, 2.0), (15.0, 1.0), (17.0, -1.0)];
        let sum = |t: f64, power: f64| -> f64 { ramps.iter().map(|(at, rate)| rate * f64::powf((t - at).max(0.0), power)).sum() };
        let x: Vec<f64> = (0..n).map(|k| sum(k as f64 / fs, 1.0)).collect();
        let power = |s: Complex64| if s.norm() > 0.0 { s.powf(order) } else { Complex64::ZERO };
        let creep = remembered(&x, 50, fs, power);
        // The line at 0 Hz is taken as nought.
        let level = creep[50];
        for k in (50..n - 100).step_by(7) {
            let want = sum(k as f64 / fs, 1.0 - order) / statrs::function::gamma::gamma(2.0 - order);
            // What is left of the record a period ago is 1e-3 of it, as its area is none; a band-limited kink rings.
            assert!((creep[k] - level - want).abs() < 5e-3, "{k}: {} {want}", creep[k]);
        }
    }

    #[test]
    fn lengths_have_small_factors_only() {
        assert_eq!([smooth_length(7), smooth_length(121), smooth_length(1024)], [8, 128, 1024]);
    }
}
