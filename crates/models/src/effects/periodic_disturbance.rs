//! Tremor, mains, ripple.

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
pub struct PeriodicDisturbance;

/// One sine on some axes.
struct Sine {
    axes: Vec<usize>,
    frequency_hz: f64,
    amplitude: f64,
}

impl ForceLaw for Sine {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        for &axis in &self.axes {
            force[axis] -= self.amplitude * (TAU * self.frequency_hz * motion.time_s).sin();
        }
    }
}

impl Effect for PeriodicDisturbance {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        Ok(Injection::Force(Box::new(Sine {
            axes: setting.sites(),
            frequency_hz: parameters.number(CARD.name, &FREQUENCY)?,
            amplitude: parameters.number(CARD.name, &AMPLITUDE)?,
        })))
    }
}
