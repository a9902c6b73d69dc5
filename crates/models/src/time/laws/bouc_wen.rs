//! A smooth hysteresis loop.

use super::vocabulary::*;

/// Bouc-Wen of exponent 1: f = k z, ż = v − (|v| z + a v |z|)/(2 y).
#[derive(Clone, Copy, Debug)]
pub struct BoucWen;

impl Equation for BoucWen {
    const NAME: &'static str = "bouc-wen";
    const EQUATION: &'static str = "f = k z, ż = v - (|v| z + shape v |z|) / (2 yield)";
    const SOURCE: &'static str = "Wen 1976, Method for random vibration of hysteretic systems";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        let ((stiffness, unit), (width, metre)) = (mechanical(rotational, "loop", 1), length(rotational, "yield"));
        vec![
            BlockParameter::new(stiffness, unit, (0.0, 1e7), &[150.0]),
            BlockParameter::new(width, metre, (1e-6, 1e3), &[2e-3]),
            BlockParameter::new("shape", "1", (-0.95, 3.0), &[0.5]),
        ]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let (v, z) = (at.velocity, states[0]);
        rates[0] = v - (v.abs() * z + theta[2] * v * z.abs()) / theta[1].times(2.0);
        theta[0] * z
    }
}
