//! A mass that hangs on.

use super::vocabulary::*;
use crate::blocks;

/// A mass m on a spring and damper, carried by the axis: a flexible mode of frequency f and damping ratio ζ.
#[derive(Clone, Copy, Debug)]
pub struct FlexibleMode;

impl Equation for FlexibleMode {
    const NAME: &'static str = "flexible-mode";
    const EQUATION: &'static str = "f = m a, a = ω² (x - y) + 2 ζ ω (v - ẏ), ÿ = a";
    const SOURCE: &'static str = "Den Hartog 1934, Mechanical vibrations, ch. 3";
    const STATES: usize = 2;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        blocks::FlexibleMode.parameters(rotational)
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let omega = theta[1].times(TAU);
        let acceleration = omega * (omega * (at.position - states[0]) + (theta[2] * (at.velocity - states[1])).times(2.0));
        rates[0] = states[1];
        rates[1] = acceleration;
        theta[0] * acceleration
    }

    fn fastest_rate(&self, theta: &[f64], _at: &Local<f64>) -> f64 {
        TAU * theta[1] * (1.0 + 2.0 * theta[2])
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        Some(blocks::FlexibleMode.response(theta, s))
    }
}
