//! Fractional damping in time.

use crate::blocks::{Block, BlockParameter, Fractional};
use crate::time::{LOCAL_VARIABLES, Law, Local};
use num_complex::Complex64;
use std::f64::consts::{LN_2, PI};

/// c s^α, between a spring (α = 0) and a damper (α = 1), as Maxwell elements whose times double from 2⁻⁹ s to 2⁶ s:
///
/// s^α = (sin απ/π) ∫ s τ/(1 + s τ) τ^(−α−1) dτ;
///
/// shorter times together are a damper, longer ones a spring. Within [`FractionalDamping::ERROR`] of c s^α from 0.1 to 20 Hz; the
/// error grows towards the upper end (1 % at 12 Hz), where the shortest time, which a Runge-Kutta step must resolve, ends the sum.
#[derive(Clone, Copy, Debug)]
pub struct FractionalDamping;

const FIRST: i32 = -9;
const ELEMENTS: usize = 16;

impl FractionalDamping {
    /// Largest relative error of the sum over that band, for α from 0.1 to 0.9.
    pub const ERROR: f64 = 0.02;

    /// Weight of an element of time τ and its slope in α, for c = 1.
    fn weight(order: f64, time: f64) -> (f64, f64) {
        let w = (order * PI).sin() / PI * LN_2 * time.powf(-order);
        (w, LN_2 * (order * PI).cos() * time.powf(-order) - w * time.ln())
    }

    /// The damper of all shorter times and the spring of all longer ones, with slopes in α, for c = 1.
    fn ends(order: f64) -> [(f64, f64); 2] {
        let end = |time: f64, power: f64, turn: f64, by_time: bool| {
            let (w, slope) = Self::weight(order, time);
            let ratio = 2f64.powf(-power);
            let sum = 1.0 / (1.0 - ratio);
            let size = if by_time { time } else { 1.0 };
            (w * size * sum, size * (slope * sum - w * sum * sum * turn * LN_2 * ratio))
        };
        [end(2f64.powi(FIRST - 1), 1.0 - order, -1.0, true), end(2f64.powi(FIRST + ELEMENTS as i32), order, 1.0, false)]
    }
}

impl Law for FractionalDamping {
    fn name(&self) -> &'static str {
        "fractional"
    }

    fn equation(&self) -> &'static str {
        "f = c s^order x, as Maxwell elements"
    }

    fn source(&self) -> &'static str {
        "Oustaloup et al. 2000, Frequency-band complex noninteger differentiator"
    }

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        Fractional.parameters(rotational)
    }

    fn states(&self) -> usize {
        ELEMENTS
    }

    fn delay(&self) -> Option<usize> {
        None
    }

    fn evaluate(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64]) -> f64 {
        let [damper, spring] = Self::ends(theta[1]);
        let mut f = damper.0 * at.velocity + spring.0 * at.position;
        for (k, &z) in states.iter().enumerate() {
            let time = 2f64.powi(FIRST + k as i32);
            rates[k] = (at.position - z) / time;
            f += Self::weight(theta[1], time).0 * (at.position - z);
        }
        theta[0] * f
    }

    fn linearise(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64], slopes: &mut [f64]) -> f64 {
        let columns = LOCAL_VARIABLES + ELEMENTS + 2;
        slopes[..(1 + ELEMENTS) * columns].fill(0.0);
        let [damper, spring] = Self::ends(theta[1]);
        let (mut f, mut turn) = (damper.0 * at.velocity + spring.0 * at.position, damper.1 * at.velocity + spring.1 * at.position);
        slopes[0] = theta[0] * spring.0;
        slopes[1] = theta[0] * damper.0;
        for (k, &z) in states.iter().enumerate() {
            let time = 2f64.powi(FIRST + k as i32);
            let (w, slope) = Self::weight(theta[1], time);
            let stretch = at.position - z;
            rates[k] = stretch / time;
            f += w * stretch;
            turn += slope * stretch;
            slopes[0] += theta[0] * w;
            slopes[LOCAL_VARIABLES + k] = -theta[0] * w;
            slopes[(1 + k) * columns] = 1.0 / time;
            slopes[(1 + k) * columns + LOCAL_VARIABLES + k] = -1.0 / time;
        }
        slopes[LOCAL_VARIABLES + ELEMENTS] = f;
        slopes[LOCAL_VARIABLES + ELEMENTS + 1] = theta[0] * turn;
        theta[0] * f
    }

    fn settle(&self, _theta: &[f64], _position: f64, _states: &mut [f64], _slopes: Option<&mut [f64]>) {}

    fn settles(&self) -> bool {
        false
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        Some(Fractional.evaluate(theta, s, &mut [Complex64::default(); 2]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_sum_of_elements_is_the_power_within_its_stated_error() {
        let mut worst = 0.0f64;
        for order in (1..=18).map(|k| 0.05 * f64::from(k)).filter(|o| *o > 0.09) {
            for hz in (0..=100).map(|k| 0.1 * 200f64.powf(f64::from(k) / 100.0)) {
                let s = Complex64::new(0.0, TAU * hz);
                let [damper, spring] = FractionalDamping::ends(order);
                let mut sum = damper.0 * s + spring.0;
                for k in 0..ELEMENTS {
                    let time = 2f64.powi(FIRST + k as i32);
                    sum += FractionalDamping::weight(order, time).0 * s * time / (1.0 + s * time);
                }
                let error = (sum / s.powf(order) - 1.0).norm();
                // Half of it below 10 Hz.
                assert!(error < FractionalDamping::ERROR * if hz < 10.0 { 0.5 } else { 1.0 }, "{order} {hz}: {error}");
                worst = worst.max(error);
            }
        }
        // What is stated is what it is, not a wide margin.
        assert!(worst > 0.9 * FractionalDamping::ERROR, "{worst}");
    }
}
