//! Derivatives of sampled signals.

use crate::transform::{forward_transform, inverse_transform, signal_by, spectrum_by};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Share of Nyquist beyond which samples tell nothing of what is between them: a corner for [`derivatives`] lies below.
pub const RESOLVED: f64 = 0.8;

/// Order of the low-pass: at seven tenths of the corner it takes 0.3 %.
const ORDER: i32 = 16;

/// What passes of frequency f.
fn gain(f: f64, corner_hz: f64) -> f64 {
    1.0 / (1.0 + (f / corner_hz).powi(ORDER))
}

/// Samples at each end of [`derivatives`] that feel where the signal ends: the low-pass rings for some four periods of its corner.
pub fn smoothing_edge(corner_hz: f64, rate_hz: f64) -> usize {
    (4.0 * rate_hz / corner_hz).ceil() as usize
}

/// A signal smoothed below a corner, its first and its second derivative, each as long as the signal.
///
/// x̂(t) = x₀ + (x_N − x₀) t/T + Σ b_k G(f_k) sin(π k t/T) with G(f) = 1 / (1 + (f/f_c)¹⁶): the sine series of what is left beside the line from
/// the first to the last sample, which continues it oddly at both ends. Exact for what lies below seven tenths of the corner; the ends ring
/// ([`smoothing_edge`]). In the signal's unit, the same per second, and per second squared; what is shorter than three samples is given back with
/// derivatives of zero.
///
/// ```
/// use ndof_signal::{derivatives, smoothing_edge};
/// use std::f64::consts::TAU;
///
/// let angle: Vec<f64> = (0..2000).map(|k| (TAU * 0.7 * f64::from(k) / 100.0).sin()).collect();
/// let [_, rate, _] = derivatives(&angle, 100.0, 10.0);
/// let k = 1000;
/// assert!(k > smoothing_edge(10.0, 100.0));
/// assert!((rate[k] - TAU * 0.7).abs() < 1e-3); // rad/s
/// ```
pub fn derivatives(x: &[f64], rate_hz: f64, corner_hz: f64) -> [Vec<f64>; 3] {
    let n = x.len();
    if n < 3 {
        return [x.to_vec(), vec![0.0; n], vec![0.0; n]];
    }
    let (first, last) = (x[0], x[n - 1]);
    let slope = (last - first) / (n - 1) as f64;
    let rest: Vec<f64> = x.iter().enumerate().map(|(k, x)| x - first - slope * k as f64).collect();
    let m = 2 * (n - 1);
    let mut odd: Vec<f64> = rest.iter().copied().chain(rest[1..n - 1].iter().rev().map(|x| -x)).collect();
    let (lines, backward) = (spectrum_by(forward_transform(m).as_ref(), &mut odd), inverse_transform(m));
    let mut out = [0, 1, 2].map(|order| {
        let mut part: Vec<Complex64> = lines
            .iter()
            .enumerate()
            .map(|(k, line)| {
                let f = k as f64 * rate_hz / m as f64;
                line * Complex64::new(0.0, TAU * f).powi(order) * gain(f, corner_hz) / m as f64
            })
            .collect();
        let mut samples = signal_by(backward.as_ref(), &mut part);
        samples.truncate(n);
        samples
    });
    out[0].iter_mut().enumerate().for_each(|(k, x)| *x += first + slope * k as f64);
    out[1].iter_mut().for_each(|v| *v += slope * rate_hz);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_movement() {
        let (rate, f) = (100.0, 0.7);
        let x: Vec<f64> = (0..2000).map(|k| 0.3 + 0.01 * f64::from(k) + (TAU * f * f64::from(k) / rate).sin()).collect();
        let [q, v, a] = derivatives(&x, rate, 10.0);
        let edge = smoothing_edge(10.0, rate);
        for k in edge..2000 - edge {
            let phase = TAU * f * k as f64 / rate;
            // What the ends leave at four periods of the corner.
            assert!((q[k] - x[k]).abs() < 1e-4, "{k}: {} {}", q[k], x[k]);
            assert!((v[k] - 1.0 - TAU * f * phase.cos()).abs() < 1e-3, "{k}");
            assert!((a[k] + (TAU * f).powi(2) * phase.sin()).abs() < 3e-2, "{k}: {}", a[k]);
        }
    }
}
