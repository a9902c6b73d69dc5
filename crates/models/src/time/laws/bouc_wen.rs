//! A smooth hysteresis loop.

use super::vocabulary::*;

/// Bouc-Wen of exponent 1: f = k z, ż = v − (|v| z + a v |z|)/(2 y).
#[derive(Clone, Copy, Debug)]
pub struct BoucWen;

/// Widths beyond which a state has run away.
const FAR: f64 = 1e3;

impl Equation for BoucWen {
    const NAME: &'static str = "bouc-wen";
    const EQUATION: &'static str = "f = k z, ż = v - (|v| z + shape v |z|) / (2 yield)";
    const SOURCE: &'static str = "Wen 1976, Method for random vibration of hysteretic systems";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![
            force(rotational, "loop", 1, (0.0, 1e7), &[150.0]),
            length(rotational, "yield", (1e-6, 1e3), &[2e-3]),
            BlockParameter::new("shape", "1", (-0.95, 3.0), &[0.5]),
        ]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let (v, z, width) = (at.velocity, states[0], theta[1].times(2.0));
        // A loop of shape −1 and below opens without end: far beyond its yield it is led back.
        let far = z.value().abs() > FAR * width.value();
        rates[0] = if far { -z * v.abs() / width } else { v - (v.abs() * z + theta[2] * v * z.abs()) / width };
        theta[0] * z
    }

    fn fastest_rate(&self, theta: &[f64], at: &Local<f64>) -> f64 {
        at.velocity.abs() * (1.0 + theta[2].abs()) / (2.0 * theta[1])
    }
}
