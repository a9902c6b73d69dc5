//! Fractional damping in time.

use crate::blocks::{Block, BlockParameter, Fractional};
use crate::time::{LOCAL_VARIABLES, Law, Local};
use num_complex::Complex64;
use std::f64::consts::{LN_2, PI};

/// c s^α, between a spring (α = 0) and a damper (α = 1), as Maxwell elements whose times double from 2⁻⁹ s to 2⁶ s:
///
/// s^α = (sin απ/π) ∫ s τ/(1 + s τ) τ^(−α−1) dτ;
///
/// shorter times together are a damper and more of the first element, so that their answers to s and s² are exact; longer ones a
/// spring and more of the last element, exact in 1 and 1/s. Within [`FractionalDamping::ERROR`] of c s^α from 0.1 to 20 Hz; the error
/// grows towards the upper end (0.07 % at 10 Hz), where the shortest time, which a Runge-Kutta step must resolve, ends the sum.
#[derive(Clone, Copy, Debug)]
pub struct FractionalDamping;

const FIRST: i32 = -9;
const ELEMENTS: usize = 16;

/// A number and its slope in α.
type Sloped = (f64, f64);

/// The sum for c = 1: a damper, a spring and the weight of each element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FractionalSum {
    damper: Sloped,
    spring: Sloped,
    weights: [Sloped; ELEMENTS],
}

impl FractionalSum {
    /// States of the sum.
    pub(crate) const STATES: usize = ELEMENTS;
    /// Fastest rate of change of a state (1/s).
    pub(crate) const FASTEST_RATE: f64 = (1 << -FIRST) as f64;

    /// The sum's force at a position and velocity, with the rates of its states.
    pub(crate) fn force(&self, (position, velocity): (f64, f64), states: &[f64], rates: &mut [f64]) -> f64 {
        let mut f = self.damper.0 * velocity + self.spring.0 * position;
        for (k, (&z, weight)) in states.iter().zip(&self.weights).enumerate() {
            rates[k] = (position - z) / time_of(k as i32);
            f += weight.0 * (position - z);
        }
        f
    }
}

fn time_of(element: i32) -> f64 {
    2f64.powi(FIRST + element)
}

impl FractionalDamping {
    /// Largest relative error of the sum over that band, for α from 0.1 to 0.9.
    pub const ERROR: f64 = 0.003;

    /// The sum for an order.
    pub(crate) fn sum(order: f64) -> FractionalSum {
        let (sine, cosine) = ((order * PI).sin() * LN_2 / PI, (order * PI).cos() * LN_2);
        let (first, ratio) = (2f64.powf(-order * f64::from(FIRST)), 2f64.powf(-order));
        let weight = |element: i32| -> Sloped {
            let power = first * ratio.powi(element);
            (sine * power, cosine * power - sine * power * time_of(element).ln())
        };
        // Σ w τ^m from an element on, towards shorter times (a ratio of 2^(α − m) each) or longer ones (2^(m − α)).
        let tail = |element: i32, moment: i32, shorter: bool| -> Sloped {
            let turn = if shorter { LN_2 } else { -LN_2 };
            let next = (turn * (order - f64::from(moment))).exp();
            let (w, slope) = weight(element);
            let (size, sum) = (time_of(element).powi(moment), 1.0 / (1.0 - next));
            (w * size * sum, size * (slope * sum + w * sum * sum * turn * next))
        };
        let both = |a: Sloped, b: Sloped, by: f64| -> Sloped { (a.0 + by * b.0, a.1 + by * b.1) };
        let last = ELEMENTS as i32 - 1;
        let (short, long) = (time_of(0), time_of(last));
        let (second, inverse) = (tail(-1, 2, true), tail(last + 1, -1, false));
        let mut weights = std::array::from_fn(|k| weight(k as i32));
        weights[0] = both(weights[0], second, short.powi(-2));
        weights[ELEMENTS - 1] = both(weights[ELEMENTS - 1], inverse, long);
        FractionalSum { damper: both(tail(-1, 1, true), second, -1.0 / short), spring: both(tail(last + 1, 0, false), inverse, -long), weights }
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
        theta[0] * Self::sum(theta[1]).force((at.position, at.velocity), states, rates)
    }

    fn linearise(&self, theta: &[f64], at: &Local<f64>, states: &[f64], rates: &mut [f64], slopes: &mut [f64]) -> f64 {
        let columns = LOCAL_VARIABLES + ELEMENTS + 2;
        slopes[..(1 + ELEMENTS) * columns].fill(0.0);
        let FractionalSum { damper, spring, weights } = Self::sum(theta[1]);
        let (mut f, mut turn) = (damper.0 * at.velocity + spring.0 * at.position, damper.1 * at.velocity + spring.1 * at.position);
        slopes[0] = theta[0] * spring.0;
        slopes[1] = theta[0] * damper.0;
        for (k, (&z, (w, slope))) in states.iter().zip(weights).enumerate() {
            let time = time_of(k as i32);
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
        Some(Fractional.response(theta, s))
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
                let FractionalSum { damper, spring, weights } = FractionalDamping::sum(order);
                let mut sum = damper.0 * s + spring.0;
                for (k, weight) in weights.iter().enumerate() {
                    let time = time_of(k as i32);
                    sum += weight.0 * s * time / (1.0 + s * time);
                }
                let error = (sum / s.powf(order) - 1.0).norm();
                // A quarter of it below 10 Hz.
                assert!(error < FractionalDamping::ERROR * if hz < 10.0 { 0.25 } else { 1.0 }, "{order} {hz}: {error}");
                worst = worst.max(error);
            }
        }
        // What is stated is what it is, not a wide margin.
        assert!(worst > 0.9 * FractionalDamping::ERROR, "{worst}");
    }
}
