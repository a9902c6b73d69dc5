//! The stretch reflex.

use super::vocabulary::*;
use crate::blocks::Reflex;

/// A cut-off (Hz) from which on there is no muscle: the force is what drives it, at once.
pub const NO_MUSCLE_HZ: f64 = 1e6;

/// Delayed feedback of position and velocity through critically damped muscle of second order.
#[derive(Clone, Copy, Debug)]
pub struct LinearReflex;

impl Equation for LinearReflex {
    const NAME: &'static str = "reflex";
    const EQUATION: &'static str = "f = exp(-s τ) ω² / (s + ω)² (k + b s) x";
    const SOURCE: &'static str = "Kearney, Stein & Parameswaran 1997, Identification of intrinsic and reflex contributions to human ankle stiffness dynamics";
    const STATES: usize = 2;
    const DELAY: Option<usize> = Some(2);

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        Reflex.parameters(rotational)
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        muscle(theta[0] * at.delayed_position + theta[1] * at.delayed_velocity, theta[3], states, rates)
    }

    fn fastest_rate(&self, theta: &[f64], _at: &Local<f64>) -> f64 {
        rate(theta[3])
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        Some(Reflex.response(theta, s))
    }
}

/// Delayed feedback of velocity in one direction only, through the same muscle.
#[derive(Clone, Copy, Debug)]
pub struct OneDirectionalReflex {
    /// Whether positive velocity sets it off.
    pub positive: bool,
}

impl Equation for OneDirectionalReflex {
    const NAME: &'static str = "one-directional-reflex";
    const EQUATION: &'static str = "f = exp(-s τ) ω² / (s + ω)² [± b max(± v, 0)]";
    const SOURCE: &'static str = "Kearney, Stein & Parameswaran 1997, Identification of intrinsic and reflex contributions to human ankle stiffness dynamics";
    const STATES: usize = 2;
    const DELAY: Option<usize> = Some(1);

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        Reflex.parameters(rotational).split_off(1)
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        let side = if self.positive { 1.0 } else { -1.0 };
        let drive = at.delayed_velocity.times(side).max(R::of(0.0)).times(side);
        muscle(theta[0] * drive, theta[2], states, rates)
    }

    fn fastest_rate(&self, theta: &[f64], _at: &Local<f64>) -> f64 {
        rate(theta[2])
    }
}

/// What critically damped muscle makes of a drive.
fn muscle<R: Real>(drive: R, cutoff_hz: R, states: &[R], rates: &mut [R]) -> R {
    if cutoff_hz.value() >= NO_MUSCLE_HZ {
        rates.fill(R::of(0.0));
        return drive;
    }
    second_order(drive, [cutoff_hz.times(TAU), R::of(1.0)], states, rates);
    states[0]
}

/// The fastest rate of such a muscle.
fn rate(cutoff_hz: f64) -> f64 {
    if cutoff_hz < NO_MUSCLE_HZ { 2.0 * TAU * cutoff_hz } else { 0.0 }
}
