//! Coarse steps of a channel.

use super::vocabulary::*;

const STEP: ParameterCard = plain("step", "", 0.0, 1e6, None);
const CARD: Card = Card {
    name: "quantisation",
    what: "a channel that moves in coarse steps",
    sides: &[Side::Sensor],
    parameters: &[STEP, CHANNEL],
    signature: "all values are multiples of one step; coherence falls where the signal is small",
    look_alikes: &["coulomb-friction", "hysteresis", "limb-noise"],
    next_experiment: "the same perturbation at twice the amplitude: the steps' share falls to a quarter of its power",
    equation: "measured = step × round(true / step)",
    source: "Widrow & Kollár 2008, Quantization noise",
    trace: Trace::Levels,
};

/// Quantisation of channels.
pub(super) const EFFECT: Effect = Effect::new(&CARD, injection);

fn injection(parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
    let step = parameters.number(CARD.name, &STEP)?;
    Ok(Injection::Stage(Box::new(move |sample: f64| if step > 0.0 { (sample / step).round() * step } else { sample })))
}
