//! Latency from command to force.

use super::measurement_delay::delay_line;
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
pub struct ActuationDelay;

impl Effect for ActuationDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn injection(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        Ok(Injection::Stage(Box::new(delay_line(parameters.number(CARD.name, &DELAY)? * setting.sample_rate_hz, 0.0))))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.effort_is_command {
            return Vec::new();
        }
        let unit = scale.time_s;
        let form = Form::new("delay", None, Action::Effort(Arc::new(|s, k| Delay.response(k, s))))
            .knobs(vec![Knob::linear(0.0, 0.05 * unit)], &[&[0.3, 1.0, 3.0, 8.0, 20.0].map(|ms| ms * 1e-3 * unit)])
            .numbers(|k, _| [("delay_s", k[0])]);
        vec![form.floor(0.0).absolute(DELAY.name, 1.5e-4).at(Side::Actuator)]
    }
}
