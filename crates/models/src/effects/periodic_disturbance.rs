//! Tremor, mains, ripple.

use super::outside_force::timed;
use super::vocabulary::*;
use std::f64::consts::TAU;

const FREQUENCY: ParameterCard = plain("frequency_hz", "Hz", 1e-9, 1e6, None);
const AMPLITUDE: ParameterCard = mechanical("amplitude_n", ("N", "N m"), 0.0, 1e6, None);
const CARD: Card = Card {
    name: "periodic-disturbance",
    what: "tremor, mains or a motor's ripple: a force at one frequency that the perturbation did not cause",
    sides: &[Side::Environment, Side::Limb],
    parameters: &[FREQUENCY, AMPLITUDE],
    signature: "a narrow line in the residual, a dip of coherence at its frequency, not coherent with the command",
    look_alikes: &["extra-resonance", "limb-noise"],
    next_experiment: "a record without perturbation: the line is still there",
    equation: "f = -amplitude sin(2 π frequency t)",
    source: "Elble & Koller 1990, Tremor",
    trace: Trace::Tone,
};

/// A sinusoidal force from outside.
pub(super) const EFFECT: Effect = Effect::new(&CARD, injection);

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let (frequency_hz, amplitude) = (parameters.number(CARD.name, &FREQUENCY)?, parameters.number(CARD.name, &AMPLITUDE)?);
    let force = move |time_s: f64| amplitude * (TAU * frequency_hz * time_s).sin();
    Ok(Injection::Force(Box::new(timed(setting.sites(), force))))
}
