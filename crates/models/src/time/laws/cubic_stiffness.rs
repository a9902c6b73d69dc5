//! A spring that hardens or softens.

use super::vocabulary::*;

/// k₃ x³.
#[derive(Clone, Copy, Debug)]
pub struct CubicStiffness;

impl Equation for CubicStiffness {
    const NAME: &'static str = "cubic-stiffness";
    const EQUATION: &'static str = "f = k3 x³";
    const SOURCE: &'static str = "Duffing 1918, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "k3", 3, (-1e12, 1e12), &[0.0, 1e5])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        theta[0] * at.position * at.position * at.position
    }
}
