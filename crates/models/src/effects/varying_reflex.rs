//! A stretch reflex whose gain follows a schedule.

use super::card::{mechanical, plain};
use super::reflex_delay::{self, CUTOFF, DELAY, Gain, ONE_DIRECTIONAL, Reflex, search};
use super::scheduled::{CYCLE, Waves};
use super::{Action, Card, Effect, EffectError, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use crate::force_law::ForceLaw;
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

const DAMPING: ParameterCard = mechanical("damping_n_s_per_m", ("N s/m", "N m s/rad"), -1e9, 1e9, None);
const DEPTH: ParameterCard = plain("depth", "", -1.0, 1.0, Some(1.0));
const CARD: Card = Card {
    name: "varying-reflex",
    what: "a reflex whose gain varies with a schedule: the phase of a cycle, a posture, an activation, or time; delay and muscle stay the same",
    sides: &[Side::Limb],
    parameters: &[DELAY, DAMPING, DEPTH, CYCLE, CUTOFF, ONE_DIRECTIONAL],
    signature: "in cycles whose mean movement is taken out, a force that follows the velocity after a delay, large in one part of the cycle and small in another",
    look_alikes: &["reflex-delay", "varying-stiffness", "varying-damping", "hysteresis"],
    next_experiment: "fast and short stretches at several places of the cycle: stiffness answers at once, a reflex after its delay",
    equation: "f = ω²/(s + ω)² [g(u) exp(-s τ) ẋ], one-directional: max(± ẋ, 0); g = g₀ + Σ c_k φ_k(u); hidden: g = damping (1 + depth cos(2π t / cycle))",
    source: "Stein & Capaday 1988, The modulation of human reflexes during functional motor tasks",
    trace: Trace::Forms,
};

/// Directions and numbers of waves that a search tries. Each wave is integrated along the motion for each delay and cut-off, so more are not tried.
const TRIED: [(f64, usize, &str); 9] = [
    (0.0, 2, "both directions, a curve of 2 waves"),
    (0.0, 4, "both directions, a curve of 4 waves"),
    (0.0, 8, "both directions, a curve of 8 waves"),
    (1.0, 2, "positive velocity only, a curve of 2 waves"),
    (1.0, 4, "positive velocity only, a curve of 4 waves"),
    (1.0, 8, "positive velocity only, a curve of 8 waves"),
    (-1.0, 2, "negative velocity only, a curve of 2 waves"),
    (-1.0, 4, "negative velocity only, a curve of 4 waves"),
    (-1.0, 8, "negative velocity only, a curve of 8 waves"),
];

/// A reflex over a schedule.
pub struct VaryingReflex;

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
        reflex_delay::tangent(self.direction, s, knobs)
    }
}

impl Effect for VaryingReflex {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let number = |card: &ParameterCard| parameters.number(CARD.name, card);
        Ok(Injection::Force(Box::new(Reflex {
            axis: setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?,
            delay_s: number(&DELAY)?,
            stiffness: 0.0,
            damping: number(&DAMPING)?,
            omega: TAU * number(&CUTOFF)?,
            direction: number(&ONE_DIRECTIONAL)?,
            gain: Gain::ByClock { depth: number(&DEPTH)?, turn: TAU / number(&CYCLE)? },
        })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let Some(closed) = scale.closed_schedule else { return Vec::new() };
        let (knobs, points) = search(scale);
        let form = |axis: usize, (direction, count, label): (f64, usize, &'static str)| Form {
            label,
            side: Side::Limb,
            axis: Some(axis),
            knobs: knobs.clone(),
            grid: points.clone(),
            signs: std::iter::once(Sign::Positive).chain(std::iter::repeat_n(Sign::Free, count)).collect(),
            action: Action::Reflex(ScheduledReflex { axis, direction, waves: Waves { count, closed } }),
            naming: Arc::new(move |k, c| {
                vec![
                    ("delay_s", Value::Number(k[0])),
                    ("damping_n_s_per_m", Value::Number(c[0])),
                    ("cutoff_hz", Value::Number(k[1])),
                    ("one_directional", Value::Flag(direction != 0.0)),
                ]
            }),
            floor: (0.02, 0.5e-3),
        };
        (0..scale.axes()).flat_map(|axis| TRIED.map(|tried| form(axis, tried))).collect()
    }
}
