//! The stretch reflex.

use super::card::{mechanical, plain};
use super::form::grid;
use super::scheduled::Waves;
use super::{
    Action, Card, Effect, EffectError, Evidence, Form, Injection, Knob, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known,
};
use crate::force_law::{ForceLaw, Motion};
use num_complex::Complex64;
use std::f64::consts::TAU;
use std::sync::Arc;

pub(super) const DELAY: ParameterCard = plain("delay_s", "s", 0.0, 10.0, None);
const STIFFNESS: ParameterCard = mechanical("stiffness_n_per_m", ("N/m", "N m/rad"), -1e9, 1e9, Some(0.0));
const DAMPING: ParameterCard = mechanical("damping_n_s_per_m", ("N s/m", "N m s/rad"), -1e9, 1e9, Some(0.0));
pub(super) const CUTOFF: ParameterCard = plain("cutoff_hz", "Hz", 1e-6, 1e6, Some(3.0));
pub(super) const ONE_DIRECTIONAL: ParameterCard = plain("one_directional", "", -1.0, 1.0, Some(0.0));
const CARD: Card = Card {
    name: "reflex-delay",
    what: "a reflex inside the limb: delayed feedback of position and velocity through the muscle's activation, in one or both directions",
    sides: &[Side::Limb],
    parameters: &[DELAY, STIFFNESS, DAMPING, CUTOFF, ONE_DIRECTIONAL],
    signature: "from 0.5 to 5 Hz stiffness up and damping down, a sharper resonance; no phase roll-off above 5 Hz",
    look_alikes: &["hysteresis", "viscoelastic", "measurement-delay", "asymmetric-stiffness"],
    next_experiment: "single ramps to either side, slow and fast: a reflex answers after its delay, and a one-directional one to one side only",
    equation: "f = exp(-s τ) ω²/(s + ω)² [(k + b s) x], one-directional: [b max(± v, 0)]",
    source: "Kearney, Stein & Parameswaran 1997, Identification of intrinsic and reflex contributions to human ankle stiffness dynamics",
    trace: Trace::Forms,
};

/// A delay beyond this (s) is none of a reflex, and a muscle that follows beyond this (Hz) is none: a mode or a filter answers so.
const LATE_S: f64 = 0.1;
const FAST_HZ: f64 = 15.0;

/// Delayed feedback of one axis.
pub struct ReflexDelay;

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

fn constant(axis: usize, knobs: &[f64], [stiffness, damping]: [f64; 2], direction: f64) -> Reflex {
    Reflex { axis, delay_s: knobs[0], stiffness, damping, omega: TAU * knobs[1], direction, gain: Gain::Constant }
}

/// Delay and cut-off, and where a search starts.
pub(super) fn search(scale: &Scale) -> (Vec<Knob>, Vec<Vec<f64>>) {
    let unit = scale.human_time_s();
    let knobs = vec![Knob { lo: 0.012 * unit, hi: 0.13 * unit, log: true, telling: true }, Knob { lo: 1.0 / unit, hi: 20.0 / unit, log: true, telling: false }];
    (knobs, grid(&[&[0.03 * unit, 0.06 * unit], &[1.5 / unit, 3.0 / unit, 6.0 / unit]]))
}

fn activation(s: Complex64, knobs: &[f64]) -> Complex64 {
    let omega = TAU * knobs[1];
    (-s * knobs[0]).exp() * omega * omega / ((s + omega) * (s + omega))
}

impl Effect for ReflexDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        Ok(Injection::Force(Box::new(Reflex {
            axis: setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?,
            delay_s: parameters.number(CARD.name, &DELAY)?,
            stiffness: parameters.number(CARD.name, &STIFFNESS)?,
            damping: parameters.number(CARD.name, &DAMPING)?,
            omega: TAU * parameters.number(CARD.name, &CUTOFF)?,
            direction: parameters.number(CARD.name, &ONE_DIRECTIONAL)?,
            gain: Gain::Constant,
        })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let (knobs, points) = search(scale);
        let mut forms = Vec::new();
        for axis in 0..scale.axes() {
            forms.push(Form {
                label: "both directions",
                side: Side::Limb,
                axis: Some(axis),
                knobs: knobs.clone(),
                grid: points.clone(),
                signs: vec![Sign::Positive, Sign::Positive],
                action: Action::Force {
                    law: Arc::new(move |k, c| Box::new(constant(axis, k, [c[0], c[1]], 0.0))),
                    exact: vec![Arc::new(activation), Arc::new(|s, k| s * activation(s, k))],
                    tangent: None,
                },
                naming: Arc::new(|k, c| {
                    vec![
                        ("delay_s", Value::Number(k[0])),
                        ("stiffness_n_per_m", Value::Number(c[0])),
                        ("damping_n_s_per_m", Value::Number(c[1])),
                        ("cutoff_hz", Value::Number(k[1])),
                        ("one_directional", Value::Flag(false)),
                    ]
                }),
                floor: (0.02, 0.5e-3),
            });
            // Beside a gain that may follow a schedule stands the constant one, which does not pay for a position that plays no part.
            let alone = scale.closed_schedule.map(|_| (0.0, "velocity in both directions"));
            for (direction, label) in [(1.0, "positive velocity only"), (-1.0, "negative velocity only")].into_iter().chain(alone) {
                forms.push(Form {
                    label,
                    side: Side::Limb,
                    axis: Some(axis),
                    knobs: knobs.clone(),
                    grid: points.clone(),
                    signs: vec![Sign::Positive],
                    action: Action::Force {
                        law: Arc::new(move |k, c| Box::new(constant(axis, k, [0.0, c[0]], direction))),
                        exact: vec![],
                        tangent: Some(Arc::new(move |s, k| tangent(direction, s, k))),
                    },
                    naming: Arc::new(move |k, c| {
                        vec![
                            ("delay_s", Value::Number(k[0])),
                            ("stiffness_n_per_m", Value::Number(0.0)),
                            ("damping_n_s_per_m", Value::Number(c[0])),
                            ("cutoff_hz", Value::Number(k[1])),
                            ("one_directional", Value::Flag(direction != 0.0)),
                        ]
                    }),
                    floor: (0.02, 0.5e-3),
                });
            }
        }
        forms
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        let unit = evidence.scale.human_time_s();
        let late = evidence.number(&DELAY).is_some_and(|delay| delay > LATE_S * unit);
        let fast = evidence.number(&CUTOFF).is_some_and(|cutoff| cutoff * unit > FAST_HZ);
        if late || fast { &["extra-resonance", "channel-filter"] } else { &[] }
    }
}
