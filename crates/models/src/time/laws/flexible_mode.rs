//! A mass that hangs on.

use super::vocabulary::*;

/// A mass m on a spring and damper, carried by the axis: a flexible mode of frequency f and damping ratio ζ.
#[derive(Clone, Copy, Debug)]
pub struct FlexibleMode;

impl Equation for FlexibleMode {
    const NAME: &'static str = "flexible-mode";
    const EQUATION: &'static str = "f = m a, a = ω² (x - y) + 2 ζ ω (v - ẏ), ÿ = a";
    const SOURCE: &'static str = "Den Hartog 1934, Mechanical vibrations, ch. 3";
    const STATES: usize = 2;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        let unit = if rotational { "N m s^2/rad" } else { "N s^2/m" };
        vec![
            BlockParameter::new("carried_mass", unit, (0.0, 1e6), &[0.3]),
            BlockParameter::new("frequency_hz", "Hz", (0.05, 1e3), &[4.0, 8.0]),
            BlockParameter::new("damping_ratio", "1", (0.0, 2.0), &[0.05]),
        ]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let omega = theta[1].times(TAU);
        let acceleration = omega * (omega * (at.position - states[0]) + (theta[2] * (at.velocity - states[1])).times(2.0));
        rates[0] = states[1];
        rates[1] = acceleration;
        theta[0] * acceleration
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        let omega = TAU * theta[1];
        let spring = 2.0 * theta[2] * omega * s + omega * omega;
        Some(theta[0] * s * s * spring / (s * s + spring))
    }
}
