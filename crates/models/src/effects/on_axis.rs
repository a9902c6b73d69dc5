//! An equation on one axis: what simulation and diagnosis see of a law.

use crate::force_law::{ForceLaw, Motion};
use crate::time::{Equation, Local};
use num_complex::Complex64;

/// An [`Equation`] that acts along one axis, with numbers for its parameters. Along a motion there is no applied force that it could feel.
#[derive(Clone, Copy, Debug)]
pub struct OnAxis<E, const P: usize> {
    axis: usize,
    equation: E,
    theta: [f64; P],
}

/// The law on an axis, with its parameters in their order.
///
/// ```
/// use ndof_models::{ForceLaw, effects::on_axis, time::laws::BoucWen};
/// assert_eq!(on_axis(0, BoucWen, [300.0, 2e-3, 1.0]).states(), 1);
/// ```
pub fn on_axis<E: Equation, const P: usize>(axis: usize, equation: E, theta: [f64; P]) -> OnAxis<E, P> {
    OnAxis { axis, equation, theta }
}

/// What a law on an axis feels of a motion.
pub(super) fn local(motion: &Motion<'_>, axis: usize) -> Local<f64> {
    Local {
        time_s: motion.time_s,
        position: motion.position[axis],
        velocity: motion.velocity[axis],
        delayed_position: motion.delayed_position[axis],
        delayed_velocity: motion.delayed_velocity[axis],
        force: 0.0,
        delayed_force: 0.0,
    }
}

impl<E: Equation, const P: usize> ForceLaw for OnAxis<E, P> {
    fn states(&self) -> usize {
        E::STATES
    }

    fn delay_s(&self) -> f64 {
        E::DELAY.map_or(0.0, |parameter| self.theta[parameter])
    }

    fn fastest_rate(&self, motion: &Motion<'_>) -> f64 {
        self.equation.fastest_rate(&self.theta, &local(motion, self.axis))
    }

    fn jumps(&self) -> bool {
        E::JUMPS
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        force[self.axis] += self.equation.force(&self.theta, &local(motion, self.axis), states, rates);
    }

    fn response(&self, s: Complex64) -> Option<Complex64> {
        self.equation.response(&self.theta, s)
    }
}
