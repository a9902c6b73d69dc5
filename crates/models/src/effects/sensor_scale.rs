//! A wrong gain or unit of a channel.

use super::Matrix;
use super::card::plain;
use super::form::grid;
use super::{Action, Card, Effect, EffectError, Form, Injection, Knob, ParameterCard, Parameters, Scale, Setting, Side, Trace, Value, require_known};
use crate::force_law::Stage;
use std::sync::Arc;

const FACTOR: ParameterCard = plain("factor", "", -1e6, 1e6, None);
const CHANNEL: ParameterCard = plain("channel", "", 0.0, 0.0, None);
const CARD: Card = Card {
    name: "sensor-scale",
    what: "a wrong gain or unit of a channel",
    sides: &[Side::Sensor],
    parameters: &[FACTOR, CHANNEL],
    signature: "inertia, damping and stiffness wrong by one factor",
    look_alikes: &["parameter-error", "added-mass"],
    next_experiment: "a known weight on the sensor, a known distance for the encoder",
    equation: "measured = factor × true",
    source: "calibration of a linear sensor",
    trace: Trace::Forms,
};

/// A factor on channels.
pub struct SensorScale;

/// A gain.
struct Gain(f64);

impl Stage for Gain {
    fn step(&mut self, sample: f64) -> f64 {
        self.0 * sample
    }
}

impl Effect for SensorScale {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        Ok(Injection::Stage(Box::new(Gain(parameters.number(CARD.name, &FACTOR)?))))
    }

    /// Only against a baseline whose inertia is given on the axis: a fitted one absorbs it.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let n = scale.axes();
        (0..n)
            .filter(|&i| scale.nominal.iter().chain(&scale.held).any(|e| (e.0, e.1, e.2) == (Matrix::Mass, i, i)))
            .map(|axis| {
                let channel = scale.effort_names.get(axis).cloned().unwrap_or_default();
                Form {
                    label: "gain of an effort channel",
                    side: Side::Sensor,
                    axis: Some(axis),
                    knobs: vec![Knob { lo: 0.1, hi: 10.0, log: true, telling: false }],
                    grid: grid(&[&[0.2, 0.6, 0.9, 1.1, 1.6, 4.45]]),
                    signs: vec![],
                    action: Action::Mix(Arc::new(move |k| {
                        (0..n)
                            .map(|r| {
                                (0..n)
                                    .map(|c| {
                                        if r != c {
                                            0.0
                                        } else if r == axis {
                                            1.0 / k[0]
                                        } else {
                                            1.0
                                        }
                                    })
                                    .collect()
                            })
                            .collect()
                    })),
                    naming: Arc::new(move |k, _| vec![("factor", Value::Number(k[0])), ("channel", Value::Text(channel.clone()))]),
                    floor: (0.005, 0.0),
                }
            })
            .collect()
    }
}
