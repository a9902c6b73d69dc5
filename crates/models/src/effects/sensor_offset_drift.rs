//! A sensor's zero that wanders.

use super::card::plain;
use super::drift::Drift;
use super::{Action, Card, Effect, EffectError, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use crate::force_law::Stage;
use num_complex::Complex64;
use std::sync::Arc;

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
        let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
        (0..n)
            .map(|axis| {
                let channel = scale.effort_names.get(axis).cloned().unwrap_or_default();
                Form {
                    label: "ramp of an effort channel",
                    side: Side::Sensor,
                    axis: Some(axis),
                    knobs: vec![],
                    grid: vec![vec![]],
                    signs: vec![Sign::Free],
                    action: Action::Force {
                        law: Arc::new(move |_, c| {
                            let force = (0..n).map(|i| if i == axis { c[0] } else { 0.0 }).collect();
                            Box::new(Drift { middle_s, stiffness: vec![], force })
                        }),
                        exact: vec![],
                        // It follows time, whatever the motion does.
                        tangent: Some(Arc::new(|_, _| Complex64::ZERO)),
                    },
                    naming: Arc::new(move |_, c| vec![("rate_per_s", Value::Number(c[0])), ("channel", Value::Text(channel.clone()))]),
                    floor: (0.01, 0.0),
                }
            })
            .collect()
    }
}
