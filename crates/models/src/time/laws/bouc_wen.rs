//! A smooth hysteresis loop.

use super::vocabulary::*;

/// Bouc-Wen of exponent 1: f = k z, ż = v − (|v| z + a v |z|)/(2 y).
#[derive(Clone, Copy, Debug)]
pub struct BoucWen;

/// Widths beyond which a state has run away: with a shape of −0.95, the least that a fit tries, it ends at 20.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A shape of −2 opens the loop in the direction of its motion until it is a thousand widths wide.
    #[test]
    fn a_state_that_has_run_away_is_led_back_whatever_the_motion() {
        let growth = |widths: f64, velocity: f64| {
            let (z, mut rates) = (widths * 4e-3, [0.0]);
            let at = Local { time_s: 0.0, position: 0.0, velocity, delayed_position: 0.0, delayed_velocity: 0.0, force: 0.0, delayed_force: 0.0 };
            BoucWen.force(&[300.0, 2e-3, -2.0], &at, &[z], &mut rates);
            rates[0] * z
        };
        assert!([(10.0, 0.1), (-10.0, -0.1)].into_iter().all(|(widths, velocity)| growth(widths, velocity) > 0.0));
        assert!([(2.0 * FAR, 0.1), (2.0 * FAR, -0.1), (-2.0 * FAR, 0.1), (-2.0 * FAR, -0.1)].into_iter().all(|(widths, v)| growth(widths, v) < 0.0));
    }
}
