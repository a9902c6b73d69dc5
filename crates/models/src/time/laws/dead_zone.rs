//! A spring with a gap.

use super::vocabulary::*;

/// A spring k beyond a gap of half width g: f = k (x − clip(x, g)).
#[derive(Clone, Copy, Debug)]
pub struct DeadZone;

impl Equation for DeadZone {
    const NAME: &'static str = "dead-zone";
    const EQUATION: &'static str = "f = k (x - clip(x, half gap))";
    const SOURCE: &'static str = "Nordin & Gutman 2002, Controlling mechanical systems with backlash: a survey";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "beyond", 1, (0.0, 1e7), &[150.0]), length(rotational, "half_gap", (1e-6, 1e3), &[2e-3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        theta[0] * (at.position - at.position.clip(theta[1]))
    }
}
