//! A sensor's zero that wanders.

use super::drift::{SETTLING_RATE, course, wander};
use super::vocabulary::*;

const RATE: ParameterCard = plain("rate_per_s", "1/s", -1e6, 1e6, None);
const CARD: Card = Card {
    name: "sensor-offset-drift",
    what: "the zero of a channel wanders",
    sides: &[Side::Sensor],
    parameters: &[RATE, SETTLING_RATE, CHANNEL],
    signature: "a slow trend in one channel alone",
    look_alikes: &["posture-drift"],
    next_experiment: "the force sensor unloaded before and after the trial shows its zero",
    equation: "measured = true + rate g(t), in the channel's unit; g = t - T/2, or (exp(-λ T/2) - exp(-λ t)) / λ where it settles at the rate λ",
    source: "calibration of a linear sensor",
    trace: Trace::Forms,
};

/// A wandering zero.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let (rate, settling_per_s) = (parameters.number(CARD.name, &RATE)?, parameters.number(CARD.name, &SETTLING_RATE)?);
    let (middle_s, step_s) = (0.5 * setting.duration_s, 1.0 / setting.sample_rate_hz);
    let mut samples = 0_usize;
    Ok(Injection::Stage(Box::new(move |sample: f64| {
        samples += 1;
        sample + rate * course(settling_per_s, middle_s, samples as f64 * step_s)
    })))
}

/// Beside a spring only the creeping posture is offered: the balance of forces cannot tell the two.
fn forms(scale: &Scale) -> Vec<Form> {
    if scale.spring || scale.integrals > 1 {
        return Vec::new();
    }
    let of_axis = |axis: usize| {
        let channel = scale.effort_names.get(axis).cloned().unwrap_or_default();
        let forms = wander(axis, scale, move |slope, settling| {
            let rates = std::iter::once(("rate_per_s", slope)).chain(settling.map(|rate| ("settling_per_s", rate)));
            rates.map(|(name, rate)| (name, Value::Number(rate))).chain([("channel", Value::Text(channel.clone()))]).collect()
        });
        forms.map(|form| form.at(Side::Sensor))
    };
    (0..scale.axes()).flat_map(of_axis).collect()
}
