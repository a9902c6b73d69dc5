//! A wall.

use super::vocabulary::*;

/// A wall of stiffness k at p: f = k max(x − p, 0), or its mirror image on the negative side.
#[derive(Clone, Copy, Debug)]
pub struct EndStop {
    /// Whether it stops positive motion.
    pub positive: bool,
}

impl Equation for EndStop {
    const NAME: &'static str = "end-stop";
    const EQUATION: &'static str = "f = ± k max(± x - p, 0)";
    const SOURCE: &'static str = "Shaw & Holmes 1983, A periodically forced piecewise linear oscillator";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "wall", 1, (0.0, 1e7), &[500.0]), length(rotational, "position", (-1e3, 1e3), &[5e-3])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        let side = if self.positive { 1.0 } else { -1.0 };
        (theta[0] * (at.position.times(side) - theta[1]).max(R::of(0.0))).times(side)
    }
}
