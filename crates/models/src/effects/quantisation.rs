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
pub struct Quantisation;

/// Rounding to a multiple of a step.
struct Steps(f64);

impl Stage for Steps {
    fn step(&mut self, sample: f64) -> f64 {
        if self.0 > 0.0 { (sample / self.0).round() * self.0 } else { sample }
    }
}

impl Effect for Quantisation {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
        Ok(Injection::Stage(Box::new(Steps(parameters.number(CARD.name, &STEP)?))))
    }
}
