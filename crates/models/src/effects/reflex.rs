//! The force law of a stretch reflex.

use super::waves::Waves;
use crate::force_law::{ForceLaw, Motion};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Delayed feedback through critically damped activation of second order.
pub(super) struct Reflex {
    pub axis: usize,
    pub delay_s: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub omega: f64,
    /// 0: both directions; ±1: positive or negative velocity only.
    pub direction: f64,
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
        self.delay_s
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        let (x, v) = (motion.delayed_position[self.axis], motion.delayed_velocity[self.axis]);
        let drive = if self.direction == 0.0 { self.stiffness * x + self.damping * v } else { self.damping * self.direction * (self.direction * v).max(0.0) };
        force[self.axis] += states[0];
        rates[0] = states[1];
        rates[1] = self.omega * (self.omega * (self.gain.at(motion) * drive - states[0]) - 2.0 * states[1]);
    }

    fn fastest_rate(&self, _motion: &Motion<'_>) -> f64 {
        2.0 * self.omega
    }
}

/// From displacement to the force of the velocity: half of a Gaussian velocity passes a rectifier (Bussgang).
pub(super) fn tangent(direction: f64, s: Complex64, knobs: &[f64]) -> Complex64 {
    if direction == 0.0 { s * activation(s, knobs) } else { 0.5 * s * activation(s, knobs) }
}

pub(super) fn activation(s: Complex64, knobs: &[f64]) -> Complex64 {
    let omega = TAU * knobs[1];
    (-s * knobs[0]).exp() * omega * omega / ((s + omega) * (s + omega))
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
        Box::new(Reflex { axis: self.axis, delay_s: knobs[0], stiffness: 0.0, damping: 1.0, omega: TAU * knobs[1], direction: self.direction, gain })
    }

    /// The best linear approximation of the mean's force, as of a constant reflex; that of a wave about the mean is left to the data.
    pub fn tangent(&self, s: Complex64, knobs: &[f64]) -> Complex64 {
        tangent(self.direction, s, knobs)
    }
}
