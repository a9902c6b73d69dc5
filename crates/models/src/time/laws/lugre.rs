//! Friction with bristles.

use super::vocabulary::*;

/// LuGre: bristles of stiffness σ₀ that bend by z and slip at the level that Stribeck's curve allows; σ₁ = 0.
#[derive(Clone, Copy, Debug)]
pub struct LuGre;

impl Equation for LuGre {
    const NAME: &'static str = "lugre-friction";
    const EQUATION: &'static str = "f = σ₀ z, ż = v - σ₀ |v| z / [F_c + F_e exp(-(v / v_s)²)]";
    const SOURCE: &'static str = "Canudas de Wit, Olsson, Åström & Lischinsky 1995, A new model for control of systems with friction";
    const STATES: usize = 1;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![
            force(rotational, "bristle", 1, (1e-3, 1e7), &[1000.0]),
            force(rotational, "coulomb", 0, (1e-6, 1e6), &[0.5]),
            force(rotational, "excess", 0, (0.0, 1e6), &[0.3]),
            stribeck(rotational),
        ]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let ratio = at.velocity / theta[3];
        let level = theta[1] + theta[2] * (-(ratio * ratio)).exp();
        rates[0] = at.velocity - theta[0] * at.velocity.abs() * states[0] / level;
        theta[0] * states[0]
    }

    fn fastest_rate(&self, theta: &[f64], at: &Local<f64>) -> f64 {
        theta[0] * at.velocity.abs() / (theta[1] + theta[2] * (-(at.velocity / theta[3]).powi(2)).exp())
    }
}
