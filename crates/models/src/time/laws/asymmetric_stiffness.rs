//! A spring that is stiffer to one side.

use super::vocabulary::*;

/// k₂ x².
#[derive(Clone, Copy, Debug)]
pub struct AsymmetricStiffness;

impl Equation for AsymmetricStiffness {
    const NAME: &'static str = "asymmetric-stiffness";
    const EQUATION: &'static str = "f = k2 x²";
    const SOURCE: &'static str = "Nayfeh & Mook 1979, Nonlinear oscillations, ch. 2";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "k2", 2, (-1e12, 1e12), &[0.0, 1e3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        theta[0] * at.position * at.position
    }
}
