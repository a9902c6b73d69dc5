//! A sensor's zero that wanders.

use super::drift::ramp;
use super::vocabulary::*;

const RATE: ParameterCard = plain("rate_per_s", "1/s", -1e6, 1e6, None);
const CHANNEL: ParameterCard = plain("channel", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "sensor-offset-drift",
    what: "the zero of a channel wanders",
    sides: &[Side::Sensor],
    parameters: &[RATE, CHANNEL],
    signature: "a slow trend in one channel alone",
    look_alikes: &["posture-drift"],
    next_experiment: "the force sensor unloaded before and after the trial shows its zero",
    equation: "measured = true + rate (t - T/2), in the channel's unit",
    source: "calibration of a linear sensor",
    trace: Trace::Forms,
};

/// A wandering zero.
pub struct SensorOffsetDrift;

/// A ramp added to a channel.
struct Ramp {
    step: f64,
    offset: f64,
}

impl Stage for Ramp {
    fn step(&mut self, sample: f64) -> f64 {
        self.offset += self.step;
        sample + self.offset
    }
}

impl Effect for SensorOffsetDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let step = parameters.number(CARD.name, &RATE)? / setting.sample_rate_hz;
        Ok(Injection::Stage(Box::new(Ramp { step, offset: -0.5 * step * setting.duration_s * setting.sample_rate_hz })))
    }

    /// Beside a spring only the creeping posture is offered: the balance of forces cannot tell the two.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if scale.spring || scale.integrals > 1 {
            return Vec::new();
        }
        (0..scale.axes())
            .map(|axis| {
                let channel = scale.effort_names.get(axis).cloned().unwrap_or_default();
                let form = Form::new("ramp of an effort channel", Some(axis), ramp(axis, scale))
                    .coefficients(vec![Sign::Free])
                    .naming(move |_, c| vec![("rate_per_s", Value::Number(c[0])), ("channel", Value::Text(channel.clone()))]);
                Form { side: Side::Sensor, ..form }
            })
            .collect()
    }
}
