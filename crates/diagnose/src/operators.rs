//! Samples passed through operators on their spectrum, and what is thought to lie before and after them.

use ndof_signal::{forward_transform, inverse_transform, mirrored, signal_by, smooth_length, spectrum_by, without_line};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

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
    passed(y, rate_hz, operator)[ends..ends + n].to_vec()
}

/// Samples of a period passed through an operator.
pub(crate) fn passed(mut y: Vec<f64>, rate_hz: f64, operator: impl Fn(Complex64) -> Complex64) -> Vec<f64> {
    let length = y.len();
    let mut spectrum = spectrum_by(forward_transform(length).as_ref(), &mut y);
    for (k, x) in spectrum.iter_mut().enumerate() {
        *x *= operator(Complex64::new(0.0, TAU * k as f64 * rate_hz / length as f64)) / length as f64;
    }
    signal_by(inverse_transform(length).as_ref(), &mut spectrum)
}

/// Samples passed through an operator, mirrored at both ends.
pub(crate) fn filter(samples: &[f64], rate_hz: f64, operator: impl Fn(Complex64) -> Complex64) -> Vec<f64> {
    let n = samples.len();
    let layout = smooth_length(n + n / 2 + 2);
    let pad = (layout - n) / 2;
    let mut y = mirrored(samples, pad, layout);
    let (start, slope) = without_line(&mut y);
    let y = passed(y, rate_hz, &operator);
    let (level, rate) = straight(&operator);
    let per_sample = slope * level;
    let offset = level * start + rate * slope * rate_hz;
    y.iter().enumerate().skip(pad).take(n).map(|(k, v)| v + offset + per_sample * k as f64).collect()
}

/// The value at a place among samples, by Lagrange's polynomial through the eight around it; beyond an end the value there.
pub(crate) fn between(samples: &[f64], place: f64) -> f64 {
    // (−1)^k times the binomial coefficients of 7: the barycentric weights of equal steps (Berrut & Trefethen 2004).
    const WEIGHTS: [f64; 8] = [1.0, -7.0, 21.0, -35.0, 35.0, -21.0, 7.0, -1.0];
    let place = place.clamp(0.0, (samples.len() - 1) as f64);
    let first = (place as usize).saturating_sub(3).min(samples.len().saturating_sub(8));
    let near = &samples[first..samples.len().min(first + 8)];
    let u = place - first as f64;
    if u.fract() == 0.0 || near.len() < 8 {
        return near[(u as usize).min(near.len() - 1)];
    }
    let (above, below) = near.iter().zip(WEIGHTS).enumerate().fold((0.0, 0.0), |(a, b), (k, (y, w))| (a + w * y / (u - k as f64), b + w / (u - k as f64)));
    above / below
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
    fn between_samples_polynomials_of_seventh_degree_are_exact() {
        let at = |t: f64| (0..8).fold(0.0, |sum, k| sum * (0.1 * t - 1.0) + f64::from(k - 3));
        let samples: Vec<f64> = (0..20).map(|k| at(f64::from(k))).collect();
        for place in [0.0, 0.3, 3.5, 7.0, 11.9, 18.6, 19.0] {
            assert!((between(&samples, place) - at(place)).abs() < 1e-9, "{place}");
        }
        assert_eq!((between(&samples, -2.0), between(&samples, 25.0)), (samples[0], samples[19]));
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
}
