//! The force law of a stretch reflex.

use super::on_axis::local;
use super::waves::Waves;
use crate::force_law::{ForceLaw, Motion};
use crate::time::Equation;
use crate::time::laws::{LinearReflex, OneDirectionalReflex};
use num_complex::Complex64;

/// The reflex of one axis under a gain.
pub(super) struct Reflex {
    pub axis: usize,
    /// 0: both directions; ±1: positive or negative velocity only, which leaves the stiffness out.
    pub direction: f64,
    /// Stiffness, damping, delay and cut-off, as those of [`LinearReflex`].
    pub theta: [f64; 4],
    pub gain: Gain,
}

/// What multiplies the stretch where it arrives: behind the delay of the nerves, before the muscle.
pub(super) enum Gain {
    Constant,
    /// The mean, then a coefficient of each wave.
    Follows(Waves, Vec<f64>),
    /// 1 + depth cos(turn t).
    ByClock {
        depth: f64,
        turn: f64,
    },
}

impl Gain {
    fn at(&self, motion: &Motion<'_>) -> f64 {
        match self {
            Gain::Constant => 1.0,
            Gain::Follows(_, coefficients) if !motion.schedule.is_finite() => coefficients[0],
            Gain::Follows(waves, coefficients) => coefficients[0] + waves.sum(&coefficients[1..], motion.schedule),
            Gain::ByClock { depth, turn } => 1.0 + depth * (turn * motion.time_s).cos(),
        }
    }
}

impl ForceLaw for Reflex {
    fn states(&self) -> usize {
        2
    }

    fn delay_s(&self) -> f64 {
        self.theta[2]
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let (at, gain, [stiffness, damping, delay, cutoff]) = (local(motion, self.axis), self.gain.at(motion), self.theta);
        force[self.axis] += if self.direction == 0.0 {
            LinearReflex.force(&[gain * stiffness, gain * damping, delay, cutoff], &at, states, rates)
        } else {
            OneDirectionalReflex { positive: self.direction > 0.0 }.force(&[gain * damping, delay, cutoff], &at, states, rates)
        };
    }

    fn fastest_rate(&self, motion: &Motion<'_>) -> f64 {
        LinearReflex.fastest_rate(&self.theta, &local(motion, self.axis))
    }

    fn response(&self, s: Complex64) -> Option<Complex64> {
        if self.direction == 0.0 && matches!(self.gain, Gain::Constant) { LinearReflex.response(&self.theta, s) } else { None }
    }
}

/// From displacement to the force of the velocity: half of a Gaussian velocity passes a rectifier (Bussgang).
pub(super) fn tangent(direction: f64, s: Complex64, [delay, cutoff]: [f64; 2]) -> Complex64 {
    let share = if direction == 0.0 { 1.0 } else { 0.5 };
    LinearReflex.response(&[0.0, share, delay, cutoff], s).unwrap_or_default()
}

/// A reflex of one axis whose gain follows the schedule, by knobs (delay, cut-off) and coefficients (mean, then those of the waves).
///
/// What the course of a movement changes is how the motoneurons answer when the afferent volley arrives, not how long it takes or what the muscle makes
/// of it: the gain is that of the present place of the schedule, on a stretch of one delay ago.
#[derive(Clone, Debug, PartialEq)]
pub struct ScheduledReflex {
    /// The axis that it feels and acts on.
    pub axis: usize,
    /// 0: both directions; ±1: positive or negative velocity only.
    pub direction: f64,
    /// The gain's curve about its mean.
    pub waves: Waves,
}

impl ScheduledReflex {
    /// The force law; where there is no schedule, it has the mean gain.
    pub fn law(&self, knobs: &[f64], coefficients: &[f64]) -> Box<dyn ForceLaw> {
        let gain = Gain::Follows(self.waves, coefficients.to_vec());
        Box::new(Reflex { axis: self.axis, direction: self.direction, theta: [0.0, 1.0, knobs[0], knobs[1]], gain })
    }

    /// The best linear approximation of the mean's force, as of a constant reflex; that of a wave about the mean is left to the data.
    pub fn tangent(&self, s: Complex64, knobs: &[f64]) -> Complex64 {
        tangent(self.direction, s, [knobs[0], knobs[1]])
    }
}
