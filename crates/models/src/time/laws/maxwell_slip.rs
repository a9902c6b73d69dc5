//! Springs that slip.

use super::vocabulary::*;

/// Generalised Maxwell-slip: three equal springs in parallel that slip at 0.4, 1 and 1.6 of one yield.
///
/// The states are the places at which the springs hang; they follow once a spring is stretched to its yield.
#[derive(Clone, Copy, Debug)]
pub struct MaxwellSlip;

/// Yields of the elements in terms of the parameter.
const SPREAD: [f64; 3] = [0.4, 1.0, 1.6];

impl Equation for MaxwellSlip {
    const NAME: &'static str = "maxwell-slip";
    const EQUATION: &'static str = "f = k/3 Σ clip(x - p_j, a_j yield), a = 0.4, 1, 1.6; p_j follows when its spring slips";
    const SOURCE: &'static str =
        "Iwan 1966, A distributed-element model for hysteresis; Al-Bender, Lampaert & Swevers 2005, The generalized Maxwell-slip model";
    const STATES: usize = 3;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "loop", 1, (0.0, 1e7), &[150.0]), length(rotational, "yield", (1e-6, 1e3), &[2e-3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let mut stretch = R::of(0.0);
        for (k, (&place, share)) in states.iter().zip(SPREAD).enumerate() {
            rates[k] = R::of(0.0);
            stretch = stretch + (at.position - place).clip(theta[1].times(share));
        }
        theta[0].times(1.0 / 3.0) * stretch
    }

    fn settle<R: Real>(&self, theta: &[R], position: R, states: &mut [R]) {
        for (place, share) in states.iter_mut().zip(SPREAD) {
            *place = position - (position - *place).clip(theta[1].times(share));
        }
    }
}
