//! A stretch reflex whose gain follows a schedule.

use super::reflex::{Gain, Reflex, ScheduledReflex};
use super::reflex_delay::{CUTOFF, DELAY, ONE_DIRECTIONAL, searched};
use super::scheduled::CYCLE;
use super::vocabulary::*;
use super::waves::Waves;
use std::f64::consts::TAU;

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
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let number = |card: &ParameterCard| parameters.number(CARD.name, card);
    Ok(Injection::Force(Box::new(Reflex {
        axis: setting.one_axis(&CARD)?,
        direction: number(&ONE_DIRECTIONAL)?,
        theta: [0.0, number(&DAMPING)?, number(&DELAY)?, number(&CUTOFF)?],
        gain: Gain::ByClock { depth: number(&DEPTH)?, turn: TAU / number(&CYCLE)? },
    })))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let Some(closed) = scale.closed_schedule else { return Vec::new() };
    let form = |axis: usize, (direction, count, label): (f64, usize, &'static str)| {
        let action = Action::Reflex(ScheduledReflex { axis, direction, waves: Waves { count, closed } });
        let form = Form::new(label, Some(axis), action)
            .coefficients(std::iter::once(Sign::Positive).chain(std::iter::repeat_n(Sign::Free, count)).collect())
            .naming(move |k, c| {
                let number = Value::Number;
                let direction = Value::Flag(direction != 0.0);
                vec![("delay_s", number(k[0])), ("damping_n_s_per_m", number(c[0])), ("cutoff_hz", number(k[1])), ("one_directional", direction)]
            });
        searched(form, scale)
    };
    (0..scale.axes()).flat_map(|axis| TRIED.map(|tried| form(axis, tried))).collect()
}
