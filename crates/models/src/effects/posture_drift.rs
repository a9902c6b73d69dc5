//! A limb that creeps from its place.

use super::drift::{Drift, SETTLING_RATE, wander};
use super::vocabulary::*;

const RATE: ParameterCard = mechanical("rate_m_per_s", ("m/s", "rad/s"), -1e3, 1e3, None);
const CARD: Card = Card {
    name: "posture-drift",
    what: "the posture that the limb holds creeps",
    sides: &[Side::Limb],
    parameters: &[RATE, SETTLING_RATE],
    signature: "a slow trend of the displacement that the mean force does not explain",
    look_alikes: &["sensor-offset-drift", "stiffness-drift"],
    next_experiment: "the force sensor unloaded before and after the trial: if its zero stayed, the posture crept",
    equation: "f = -K rate g(t), g = t - T/2, or (exp(-λ T/2) - exp(-λ t)) / λ where it settles at the rate λ",
    source: "Palazzolo et al. 2007, Stochastic estimation of arm mechanical impedance during robotic stroke rehabilitation",
    trace: Trace::Forms,
};

/// Creeping posture.
pub(super) const EFFECT: Effect = Effect {
    forms,
    // K x₀(t) is a force that drifts, whoever makes it.
    twins: &["sensor-offset-drift"],
    ..Effect::new(&CARD, injection)
};

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let rate = parameters.number(CARD.name, &RATE)?;
    let moving = setting.sites();
    let force = setting.stiffness.iter().map(|row| -rate * moving.iter().filter_map(|&j| row.get(j)).sum::<f64>()).collect();
    let settling_per_s = parameters.number(CARD.name, &SETTLING_RATE)?;
    Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, settling_per_s, stiffness: vec![], force })))
}

/// Not offered where the displacement is an integral: the sensor's unknown zero moves it alike.
fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.spring || scale.integrals > 0 {
        return Vec::new();
    }
    let of_axis = |axis: usize| {
        let stiffness = Setting::diagonal(&scale.stiffness, axis);
        wander(axis, scale, move |slope, settling| {
            let rate = ("rate_m_per_s", Value::Number(-slope / stiffness));
            std::iter::once(rate).chain(settling.map(|rate| ("settling_per_s", Value::Number(rate)))).collect()
        })
    };
    (0..scale.axes()).flat_map(of_axis).collect()
}
