//! Dry friction that falls with velocity.

use super::vocabulary::*;

/// [F_c + F_e e^(−(v/v_s)²)] tanh(v/v_t): a level F_c and an excess F_e near rest.
#[derive(Clone, Copy, Debug)]
pub struct Stribeck {
    /// v_t (m/s, rad/s).
    pub turn_velocity: f64,
}

impl Equation for Stribeck {
    const NAME: &'static str = "stribeck-friction";
    const EQUATION: &'static str = "f = [F_c + F_e exp(-(v / v_s)²)] tanh(v / v_t)";
    const SOURCE: &'static str = "Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, A survey of models for the control of machines with friction";
    const JUMPS: bool = true;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![force(rotational, "coulomb", 0, (0.0, 1e6), &[0.5]), force(rotational, "excess", 0, (0.0, 1e6), &[0.3]), stribeck(rotational)]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        let ratio = at.velocity / theta[2];
        (theta[0] + theta[1] * (-(ratio * ratio)).exp()) * at.velocity.times(1.0 / self.turn_velocity).tanh()
    }
}
