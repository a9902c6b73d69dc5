//! Stiffness that muscle has only within a short range of where it was.

use super::vocabulary::*;

/// A spring k that yields beyond a range r of stretch and holds again from where the motion turns.
#[derive(Clone, Copy, Debug)]
pub struct ShortRangeStiffness;

impl Equation for ShortRangeStiffness {
    const NAME: &'static str = "short-range-stiffness";
    const EQUATION: &'static str = "f = k clip(x - p, range); p follows while the spring yields";
    const SOURCE: &'static str = "Rack & Westbury 1974, The short range stiffness of active mammalian muscle";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "short_range", 1, (0.0, 1e7), &[150.0]), length(rotational, "range", (1e-6, 1e3), &[2e-3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        rates[0] = R::of(0.0);
        theta[0] * (at.position - states[0]).clip(theta[1])
    }

    fn settle<R: Real>(&self, theta: &[R], position: R, states: &mut [R]) {
        states[0] = position - (position - states[0]).clip(theta[1]);
    }
}
