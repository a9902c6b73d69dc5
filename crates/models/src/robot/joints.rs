//! What a robot's joints are called, how they rub and where they end.

use super::error::RobotError;

/// Friction, limits and encoders of the joints, one entry a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joints {
    /// What each is called: the suffix of its channels, `elbow` of `torque_elbow`.
    pub names: Vec<String>,
    /// Dry friction level (N m, N).
    pub coulomb: Vec<f64>,
    /// Viscous friction (N m s/rad, N s/m).
    pub viscous: Vec<f64>,
    /// Speed over which dry friction builds up: level · tanh(q̇/v).
    pub smoothing: Vec<f64>,
    /// Largest motor torque (N m, N); infinite where there is none.
    pub torque_limit: Vec<f64>,
    /// Range of a full encoder turn in the joint's coordinate (rad, m), which the encoder's bits divide.
    pub encoder_range: Vec<f64>,
    /// Steps of an encoder over that range.
    pub encoder_counts: f64,
}

impl Joints {
    /// Frictionless joints of these names, without limits and with encoders that divide a full turn.
    pub fn ideal<S: ToString>(names: &[S]) -> Self {
        let n = names.len();
        Joints {
            names: names.iter().map(S::to_string).collect(),
            coulomb: vec![0.0; n],
            viscous: vec![0.0; n],
            smoothing: vec![0.005; n],
            torque_limit: vec![f64::INFINITY; n],
            encoder_range: vec![std::f64::consts::TAU; n],
            encoder_counts: 65_536.0,
        }
    }

    /// Number of joints.
    pub fn count(&self) -> usize {
        self.names.len()
    }

    /// Refuses negative friction and limits that are no limits.
    ///
    /// # Errors
    /// [`RobotError::Value`] naming the list.
    pub fn check(&self) -> Result<(), RobotError> {
        for (what, list) in [("dry friction", &self.coulomb), ("viscous friction", &self.viscous)] {
            if let Some(v) = list.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
                return Err(RobotError::Value { what: what.to_owned(), value: *v, must: "zero or positive" });
            }
        }
        for (what, list) in [("friction velocity", &self.smoothing), ("torque limit", &self.torque_limit), ("encoder range", &self.encoder_range)] {
            if let Some(v) = list.iter().find(|v| v.is_nan() || **v <= 0.0) {
                return Err(RobotError::Value { what: what.to_owned(), value: *v, must: "positive" });
            }
        }
        Ok(())
    }

    /// Friction torque of joint `j` at speed `rate`: τ_c tanh(q̇/v_s) + b q̇.
    #[inline]
    pub fn friction(&self, j: usize, rate: f64) -> f64 {
        // tanh |r| by one exponential: as exact as the level asks for, and three times as fast as the library's.
        let decay = (-2.0 * (rate / self.smoothing[j]).abs()).exp();
        (self.coulomb[j] * (1.0 - decay) / (1.0 + decay)).copysign(rate) + self.viscous[j] * rate
    }

    /// Writes what encoders of `counts` steps over each joint's range show.
    pub fn encode(&self, q: &[f64], counts: f64, out: &mut [f64]) {
        for ((out, q), range) in out.iter_mut().zip(q).zip(&self.encoder_range) {
            *out = quantise(*q, range / counts);
        }
    }
}

/// Rounds to a multiple of `quantum`; 0 leaves the value as it is.
pub fn quantise(value: f64, quantum: f64) -> f64 {
    if quantum > 0.0 { (value / quantum).round() * quantum } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_is_the_smoothed_step_and_the_slope() {
        let joints = Joints { coulomb: vec![0.3], viscous: vec![0.01], ..Joints::ideal(&["elbow"]) };
        for rate in [-2.0, -0.003, 0.0, 1e-6, 0.004, 1.0] {
            let want = 0.3 * (rate / 0.005_f64).tanh() + 0.01 * rate;
            assert!((joints.friction(0, rate) - want).abs() < 1e-16 + 4.0 * f64::EPSILON * want.abs(), "{rate}");
        }
    }

    #[test]
    fn encoders_round_to_their_step() {
        let (joints, mut seen) = (Joints::ideal(&["a"]), [0.0]);
        joints.encode(&[1.0], 8.0, &mut seen);
        assert!((seen[0] - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
        joints.encode(&[1.0], f64::INFINITY, &mut seen);
        assert_eq!(seen, [1.0]);
    }
}
