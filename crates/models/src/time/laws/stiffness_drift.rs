//! Tone that changes with time.

use super::vocabulary::*;

/// Time-varying stiffness K(t) = K + r t: f = r t x.
#[derive(Clone, Copy, Debug)]
pub struct StiffnessDrift;

impl Equation for StiffnessDrift {
    const NAME: &'static str = "stiffness-drift";
    const EQUATION: &'static str = "f = rate t x";
    const SOURCE: &'static str = "Lacquaniti, Carrozzo & Borghese 1993, Time-varying mechanical behavior of multijointed arm in man";

    fn parameters(&self, rotational: bool) -> Vec<BlockParameter> {
        let rate = force(rotational, "stiffness_rate", 1, (-1e9, 1e9), &[0.0, 0.1]);
        vec![BlockParameter { name: format!("{}_s", rate.name), unit: format!("{} 1/s", rate.unit), ..rate }]
    }

    fn force<R: Real>(&self, theta: &[R], at: &Local<R>, _states: &[R], _rates: &mut [R]) -> R {
        theta[0] * at.position.times(at.time_s)
    }
}
