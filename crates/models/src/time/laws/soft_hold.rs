//! What is held by a spring.

use super::vocabulary::*;
use crate::blocks::parameter::{STIFF, damping};

/// What has an impedance Z of its own behind a spring k and a damper c, as a limb behind a soft hold has, less the stiffness and the damping of the axis
/// that go with it: (k + c s) Z / (Z + k + c s) = k' + c' s - (g + h s) ω² / (s² + 2 ζ ω s + ω²). Those of the axis are found with its inertia; g, h, the
/// frequency and the damping ratio are all that a motion in front of the hold shows beside them.
#[derive(Clone, Copy, Debug)]
pub struct SoftHold;

impl Equation for SoftHold {
    const NAME: &'static str = "soft-hold";
    const EQUATION: &'static str = "f = -(g y + h ẏ), ÿ = ω² (x - y) - 2 ζ ω ẏ";
    const SOURCE: &'static str = "Den Hartog 1934, Mechanical vibrations, ch. 3";
    const STATES: usize = 2;

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        vec![
            force(rotational, "behind_stiffness", 1, (0.0, STIFF), &[0.0, 300.0]),
            damping(rotational, "behind_damping", (-STIFF, STIFF), &[1.0]),
            BlockParameter::new("frequency_hz", "Hz", (0.05, 1e3), &[4.0, 8.0, 16.0]),
            BlockParameter::new("damping_ratio", "1", (0.0, 2.0), &[0.1]),
        ]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, states: &[R], rates: &mut [R]) -> R {
        second_order(at.position, [theta[2].times(TAU), theta[3]], states, rates);
        R::of(0.0) - theta[0] * states[0] - theta[1] * states[1]
    }

    fn fastest_rate(&self, theta: &[f64], _at: &Local<f64>) -> f64 {
        TAU * theta[2] * (1.0 + 2.0 * theta[3])
    }

    fn response(&self, theta: &[f64], s: Complex64) -> Option<Complex64> {
        let omega = TAU * theta[2];
        Some(-(theta[0] + theta[1] * s) * omega * omega / (s * s + 2.0 * theta[3] * omega * s + omega * omega))
    }
}
