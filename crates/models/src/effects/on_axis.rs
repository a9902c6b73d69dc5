//! An equation on one axis: what simulation and diagnosis see of a law.

use crate::force_law::{ForceLaw, Motion};
use crate::time::{Equation, Local};
use num_complex::Complex64;

/// An [`Equation`] that acts along one axis, with numbers for its parameters. A motion has neither an applied force nor ends of steps: a law
/// that feels a force (saturation, latency), or whose states [settle](Equation::settle) (play, slip), is not itself here.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::laws::{Coulomb, LinearReflex, NO_MUSCLE_HZ, StiffnessDrift, Stribeck};
    use std::f64::consts::TAU;

    #[test]
    fn a_law_feels_and_pushes_its_own_axis_and_nothing_else() {
        let (x, v, ago, speed) = ([9.0, 0.5], [9.0, -0.3], [9.0, 0.25], [9.0, 0.5]);
        let motion = Motion { delayed_position: &ago, delayed_velocity: &speed, ..Motion::now(2.0, &x, &v) };
        let evaluate = |law: &dyn ForceLaw, states: &[f64]| {
            let (mut force, mut rates) = ([1.0, 1.0], vec![0.0; states.len()]);
            law.evaluate(&motion, states, &mut force, &mut rates);
            (force, rates)
        };
        // rate · t · x.
        assert_eq!(evaluate(&on_axis(1, StiffnessDrift, [50.0]), &[]).0, [1.0, 1.0 + 50.0 * 2.0 * 0.5]);
        let (reflex, omega) = (on_axis(1, LinearReflex, [30.0, 3.0, 0.04, 2.0]), TAU * 2.0);
        let (force, rates) = evaluate(&reflex, &[0.5, 0.25]);
        let want = omega * omega * (30.0 * 0.25 + 3.0 * 0.5 - 0.5) - 2.0 * omega * 0.25;
        assert!(force == [1.0, 1.5] && rates[0] == 0.25 && (rates[1] - want).abs() < 1e-12 * want, "{rates:?} {want}");
        assert_eq!((reflex.states(), reflex.delay_s(), reflex.jumps(), reflex.fastest_rate(&motion)), (2, 0.04, false, 2.0 * omega));
        // Without the muscle its force is what drives it, and its states rest.
        let direct = on_axis(1, LinearReflex, [30.0, 3.0, 0.04, NO_MUSCLE_HZ]);
        assert_eq!(evaluate(&direct, &[0.0, 0.0]), ([1.0, 1.0 + 30.0 * 0.25 + 3.0 * 0.5], vec![0.0, 0.0]));
        assert_eq!((direct.delay_s(), direct.fastest_rate(&motion)), (0.04, 0.0));
        let turn_velocity = 1e-3;
        assert!(on_axis(0, Coulomb { turn_velocity }, [1.0]).jumps() && on_axis(0, Stribeck { turn_velocity }, [1.0, 0.5, 0.1]).jumps());
    }
}
