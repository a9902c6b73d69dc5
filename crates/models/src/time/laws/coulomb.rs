//! Dry friction.

use super::vocabulary::*;

/// F_c tanh(v/v_t): dry friction that turns around within a small velocity.
#[derive(Clone, Copy, Debug)]
pub struct Coulomb {
    /// v_t (m/s, rad/s).
    pub turn_velocity: f64,
}

impl Equation for Coulomb {
    const NAME: &'static str = "coulomb-friction";
    const EQUATION: &'static str = "f = F_c tanh(v / v_t)";
    const SOURCE: &'static str = "Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, A survey of models for the control of machines with friction";
    const JUMPS: bool = true;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "coulomb", 0, (0.0, 1e6), &[0.5])]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        theta[0] * at.velocity.times(1.0 / self.turn_velocity).tanh()
    }
}
