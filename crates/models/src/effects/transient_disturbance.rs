//! A knock or a voluntary reaction.

use super::outside_force::timed;
use super::vocabulary::*;
use std::f64::consts::PI;

const TIME: ParameterCard = plain("time_s", "s", 0.0, 1e6, None);
const IMPULSE: ParameterCard = mechanical("impulse_n_s", ("N s", "N m s"), -1e6, 1e6, None);
const DURATION: ParameterCard = plain("duration_s", "s", 1e-4, 1e3, Some(0.2));
const CARD: Card = Card {
    name: "transient-disturbance",
    what: "a voluntary reaction or a knock",
    sides: &[Side::Environment, Side::Limb],
    parameters: &[TIME, IMPULSE, DURATION],
    signature: "a short burst in the residual force, nothing before and after",
    look_alikes: &["limb-noise"],
    next_experiment: "another record: a knock does not come back at its time",
    equation: "f = -(2 impulse / duration) sin²(π (t - time) / duration) while it lasts",
    source: "the raised cosine pulse",
    trace: Trace::Burst,
};

/// A short pulse of force.
pub(super) const EFFECT: Effect = Effect::new(&CARD, injection);

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let number = |card| parameters.number(CARD.name, card);
    let (start_s, duration_s, impulse) = (number(&TIME)?, number(&DURATION)?, number(&IMPULSE)?);
    let force = move |time_s: f64| {
        let phase = (time_s - start_s) / duration_s;
        if (0.0..1.0).contains(&phase) { 2.0 * impulse / duration_s * (PI * phase).sin().powi(2) } else { 0.0 }
    };
    Ok(Injection::Force(Box::new(timed(setting.sites(), force))))
}
