//! Band-limited kernels: what passes a band, and its derivatives.

use std::f64::consts::PI;

/// A symmetric filter of finite length, or the derivative of what passes it.
///
/// h(τ) = sin(2π f_c τ)/(π τ) · w(τ) for |τ| < L and its derivatives in τ, with half of the amplitude at f_c and Blackman's window
/// w = 0.42 + 0.5 cos(π τ/L) + 0.08 cos(2π τ/L). Its ripple of two parts in ten thousand is what an inertial force, many times that of the
/// spring at the band's upper end, can put on the stiffness; L follows from the width of the transition, 5.5 over the length
/// (A. V. Oppenheim & R. W. Schafer, Discrete-time signal processing).
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    taps: Vec<f64>,
}

/// Width of the transition times the length of a kernel in Blackman's window.
const TRANSITION: f64 = 5.5;
/// Blackman's window: weights of the constant and of one and two turns.
const BLACKMAN: [f64; 3] = [0.42, 0.5, 0.08];

impl Kernel {
    /// Passes what lies below `cutoff_hz` over a transition of this width, differentiated `order` times (0 to 2).
    pub(super) fn new(cutoff_hz: f64, transition_hz: f64, rate_hz: f64, order: usize) -> Self {
        let half = (0.5 * TRANSITION / transition_hz * rate_hz).ceil().max(1.0);
        let length_s = half / rate_hz;
        let values = |order: usize| -> Vec<f64> {
            let count = 2 * half as usize + 1;
            (0..count).map(|k| derivative((k as f64 - half) / rate_hz, 2.0 * PI * cutoff_hz, PI / length_s, order)).collect()
        };
        let plain = values(0);
        let gain: f64 = plain.iter().sum();
        let mut taps = values(order);
        // A constant has no derivative, a ramp the slope one, a parabola the curvature one.
        if order > 0 {
            let left = taps.iter().sum::<f64>() / gain;
            taps.iter_mut().zip(&plain).for_each(|(tap, plain)| *tap -= left * plain);
        }
        let reach = |k: usize| (half - k as f64) / rate_hz;
        let scale: f64 = taps.iter().enumerate().map(|(k, tap)| tap * reach(k).powi(order as i32) / if order == 2 { 2.0 } else { 1.0 }).sum();
        taps.iter_mut().for_each(|tap| *tap /= scale);
        Kernel { taps }
    }

    /// Samples that it reaches to either side.
    pub(super) fn half(&self) -> usize {
        self.taps.len() / 2
    }

    /// Its values, the earliest sample's first: y(t) = Σ taps[k] x(t + half − k).
    pub(super) fn taps(&self) -> &[f64] {
        &self.taps
    }

    /// The filtered signal; NaN within half a length of the ends, where there is none.
    pub(super) fn apply(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![f64::NAN; x.len()];
        for (k, window) in x.windows(self.taps.len()).enumerate() {
            out[k + self.half()] = window.iter().rev().zip(&self.taps).map(|(x, tap)| x * tap).sum();
        }
        out
    }
}

/// The derivative of sin(aτ)/(πτ) times the window of which bτ is one turn.
fn derivative(tau: f64, a: f64, b: f64, order: usize) -> f64 {
    let turn = |order: i32, value: fn(f64) -> f64| -> f64 { (1..3).map(|k| BLACKMAN[k] * (k as f64 * b).powi(order) * value(k as f64 * b * tau)).sum() };
    let window = [BLACKMAN[0] + turn(0, f64::cos), -turn(1, f64::sin), -turn(2, f64::cos)];
    let sinc = if tau == 0.0 {
        [a / PI, 0.0, -a.powi(3) / (3.0 * PI)]
    } else {
        let (sin, cos) = (a * tau).sin_cos();
        let turns = a * tau;
        [sin / (PI * tau), (turns * cos - sin) / (PI * tau * tau), (2.0 * sin - 2.0 * turns * cos - turns * turns * sin) / (PI * tau.powi(3))]
    };
    match order {
        0 => sinc[0] * window[0],
        1 => sinc[1] * window[0] + sinc[0] * window[1],
        _ => sinc[2] * window[0] + 2.0 * sinc[1] * window[1] + sinc[0] * window[2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kernels for a band of 10 Hz, as the regression makes them: sines of the band pass with their derivatives; far above it they do not.
    #[test]
    fn a_sine_of_the_band_keeps_its_derivatives() {
        let (rate, centre) = (500.0, 400);
        for hz in [0.5, 3.0, 10.0, 80.0] {
            let omega = 2.0 * PI * hz;
            let x: Vec<f64> = (0..800).map(|k| (omega * k as f64 / rate + 0.3).sin()).collect();
            let phase = omega * centre as f64 / rate + 0.3;
            for (order, truth) in [phase.sin(), omega * phase.cos(), -omega * omega * phase.sin()].into_iter().enumerate() {
                let found = Kernel::new(25.0, 10.0, rate, order).apply(&x)[centre];
                let scale = omega.powi(order as i32);
                // Blackman's window leaves side lobes of 74 dB of what a derivative is at the edge of 25 Hz.
                if hz <= 10.0 {
                    assert!((found - truth).abs() < 2e-4 * (2.0 * PI * 25.0_f64).powi(order as i32), "{hz} Hz, order {order}: {found} for {truth}");
                } else {
                    assert!(found.abs() < 1e-3 * scale, "{hz} Hz, order {order}: {found}");
                }
            }
        }
        assert!(Kernel::new(25.0, 10.0, rate, 0).apply(&[1.0; 5]).iter().all(|v| v.is_nan()), "shorter than the kernel");
    }
}
