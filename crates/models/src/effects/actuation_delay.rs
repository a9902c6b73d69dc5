//! Latency from command to force.

use super::measurement_delay::{delay_line, delays_s, most_s};
use super::vocabulary::*;
use crate::blocks::{Block, Delay};

const DELAY: ParameterCard = plain("delay_s", "s", 0.0, 10.0, None);
const CARD: Card = Card {
    name: "actuation-delay",
    what: "latency from command to applied force",
    sides: &[Side::Actuator],
    parameters: &[DELAY],
    signature: "the force follows the command late; what lies between force and motion is untouched",
    look_alikes: &["actuator-saturation", "channel-filter"],
    next_experiment: "a step of the command against a fixed handle: the force begins after the delay",
    equation: "applied(t) = command(t - delay)",
    source: "Åström & Wittenmark 1997, Computer-controlled systems",
    trace: Trace::Forms,
};

/// Latency of the actuator.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    Ok(Injection::Stage(Box::new(delay_line(parameters.number(CARD.name, &DELAY)? * setting.sample_rate_hz, 0.0))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.effort_is_command {
        return Vec::new();
    }
    let most = most_s(scale).max(0.05 * scale.time_s);
    let form = Form::new("delay", None, Action::Effort(Arc::new(|s, k| Delay.response(k, s))))
        .knobs(vec![Knob::linear(0.0, most)], &[&delays_s(scale, &[0.3, 1.0, 3.0, 8.0, 20.0])])
        .numbers(|k, _| [("delay_s", k[0])]);
    vec![form.floor(0.0).absolute(DELAY.name, 1.5e-4).at(Side::Actuator)]
}
