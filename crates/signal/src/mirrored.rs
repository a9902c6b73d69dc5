//! A record about its ends: mirrored, so that a transform, which repeats it, finds no jump there.

use crate::transform::{forward_transform, inverse_transform, signal_by, spectrum_by};
use num_complex::Complex64;

/// The smallest even number from `n` upward whose only prime factors are 2, 3 and 5: transforms of this length are fast.
///
/// ```
/// assert_eq!([7, 121, 1024].map(ndof_signal::smooth_length), [8, 128, 1024]);
/// ```
pub fn smooth_length(n: usize) -> usize {
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

/// Samples with `pad` more before them, and as many behind as `padded` in all have: each end is a point of symmetry, 2 x(end) − x.
///
/// ```
/// assert_eq!(ndof_signal::mirrored(&[1.0, 2.0, 4.0], 2, 7), [-2.0, 0.0, 1.0, 2.0, 4.0, 6.0, 7.0]);
/// ```
pub fn mirrored(x: &[f64], pad: usize, padded: usize) -> Vec<f64> {
    let n = x.len();
    let mirror = |edge: f64, value: f64| 2.0 * edge - value;
    let mut y = Vec::with_capacity(padded);
    y.extend((1..=pad).rev().map(|k| mirror(x[0], x[k.min(n - 1)])));
    y.extend_from_slice(x);
    y.extend((1..=padded - n - pad).map(|k| mirror(x[n - 1], x[(n - 1).saturating_sub(k)])));
    y
}

/// Takes the straight line from the first sample to the last away: its start and its slope a sample.
pub fn without_line(y: &mut [f64]) -> (f64, f64) {
    let last = y.len() - 1;
    let (start, slope) = (y[0], (y[last] - y[0]) / last as f64);
    y.iter_mut().enumerate().for_each(|(k, v)| *v -= start + slope * k as f64);
    (start, slope)
}

/// Points of the curve between two samples from which cubics are as good as the curve: 4e-5 of a tone at half of the samples' rate.
const BETWEEN: usize = 16;

/// The curve through samples that has nothing above half of their rate, at these places, counted in samples; about the ends that of the [mirrored] record.
///
/// ```
/// let curve = ndof_signal::curve_through(&[0.0, 1.0, 2.0, 3.0], [0.0, 1.5, 2.9].into_iter());
/// assert!(curve.iter().zip([0.0, 1.5, 2.9]).all(|(a, b)| (a - b).abs() < 1e-12));
/// ```
pub fn curve_through(samples: &[f64], places: impl Iterator<Item = f64>) -> Vec<f64> {
    let n = samples.len();
    let pad = n / 4 + 1;
    let length = smooth_length(n + 2 * pad);
    let mut y = mirrored(samples, pad, length);
    let (start, slope) = without_line(&mut y);
    let mut spectrum = spectrum_by(forward_transform(length).as_ref(), &mut y);
    spectrum.iter_mut().for_each(|x| *x /= length as f64);
    spectrum[length / 2] = Complex64::ZERO;
    spectrum.resize(length * BETWEEN / 2 + 1, Complex64::ZERO);
    let fine = signal_by(inverse_transform(length * BETWEEN).as_ref(), &mut spectrum);
    let at = |place: f64| {
        let place = place + pad as f64;
        let from = ((place * BETWEEN as f64) as usize).clamp(1, fine.len() - 3);
        let u = place * BETWEEN as f64 - from as f64;
        // Lagrange's weights of the points at -1, 0, 1 and 2.
        let weights = [-u * (u - 1.0) * (u - 2.0) / 6.0, (u * u - 1.0) * (u - 2.0) / 2.0, -u * (u + 1.0) * (u - 2.0) / 2.0, u * (u * u - 1.0) / 6.0];
        let near: f64 = weights.iter().zip(&fine[from - 1..]).map(|(w, y)| w * y).sum();
        near + start + slope * place
    };
    places.map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_curve_through_samples_is_the_one_they_were_taken_from() {
        let at = |t: f64| (TAU * 31.0 * t).sin() + 0.3 * t;
        let x: Vec<f64> = (0..4000).map(|k| at(k as f64 / 200.0)).collect();
        let fine = curve_through(&x, (0..16_000).map(|k| k as f64 / 4.0));
        // Far from the mirrored ends, whose kinks are felt as 1 / distance.
        for k in 6000..10_000 {
            assert!((fine[k] - at(k as f64 / 800.0)).abs() < 2e-3, "{k}");
            assert!(k % 4 != 0 || (fine[k] - x[k / 4]).abs() < 2e-3);
        }
    }
}
