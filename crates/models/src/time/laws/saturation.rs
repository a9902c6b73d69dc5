//! A force that is clipped before it arrives.

use super::vocabulary::*;

/// What is applied is clip(F, level): the missing part F − clip(F) resists.
#[derive(Clone, Copy, Debug)]
pub struct Saturation;

impl Equation for Saturation {
    const NAME: &'static str = "saturation";
    const EQUATION: &'static str = "f = F - clip(F, level)";
    const SOURCE: &'static str = "Khalil 2002, Nonlinear systems, ch. 1";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "level", 0, (1e-9, 1e9), &[5.0])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        at.force - at.force.clip(theta[0])
    }
}
