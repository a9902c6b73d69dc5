//! Slack that follows.

use super::vocabulary::*;

/// A spring k driven through a gap of half width g: the play follows once the gap is closed.
#[derive(Clone, Copy, Debug)]
pub struct Backlash;

impl Equation for Backlash {
    const NAME: &'static str = "backlash";
    const EQUATION: &'static str = "f = k p, p = x - clip(x - p, half gap)";
    const SOURCE: &'static str = "Nordin & Gutman 2002, Controlling mechanical systems with backlash: a survey";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "driven", 1, (0.0, 1e7), &[150.0]), length(rotational, "half_gap", (1e-6, 1e3), &[2e-3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        rates[0] = R::of(0.0);
        theta[0] * (at.position - (at.position - states[0]).clip(theta[1]))
    }

    fn settle<R: Real>(&self, theta: &[R], position: R, states: &mut [R]) {
        states[0] = position - (position - states[0]).clip(theta[1]);
    }
}
