//! Relaxation.

use super::vocabulary::*;
use crate::blocks::StandardLinearSolid;

/// The Maxwell arm of a standard linear solid: a spring k in series with a damper k τ.
#[derive(Clone, Copy, Debug)]
pub struct Relaxation;

impl Equation for Relaxation {
    const NAME: &'static str = "standard-linear-solid";
    const EQUATION: &'static str = "f = k (x - z), ż = (x - z) / τ";
    const SOURCE: &'static str = "Fung 1993, Biomechanics, ch. 2";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        StandardLinearSolid.parameters(rotational)
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let stretch = at.position - states[0];
        rates[0] = stretch / theta[1];
        theta[0] * stretch
    }

    fn fastest_rate(&self, theta: &[f64], _at: &Local<f64>) -> f64 {
        1.0 / theta[1]
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        Some(StandardLinearSolid.response(theta, s))
    }
}
