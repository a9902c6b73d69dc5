//! A limb that creeps from its place.

use super::card::mechanical;
use super::drift::Drift;
use super::{Action, Card, Effect, EffectError, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use num_complex::Complex64;
use std::sync::Arc;

const RATE: ParameterCard = mechanical("rate_m_per_s", ("m/s", "rad/s"), -1e3, 1e3, None);
const CARD: Card = Card {
    name: "posture-drift",
    what: "the posture that the limb holds creeps",
    sides: &[Side::Limb],
    parameters: &[RATE],
    signature: "a slow trend of the displacement that the mean force does not explain",
    look_alikes: &["sensor-offset-drift", "stiffness-drift"],
    next_experiment: "the force sensor unloaded before and after the trial: if its zero stayed, the posture crept",
    equation: "f = -K rate (t - T/2)",
    source: "Palazzolo et al. 2007, Stochastic estimation of arm mechanical impedance during robotic stroke rehabilitation",
    trace: Trace::Forms,
};

/// Creeping posture.
pub struct PostureDrift;

impl Effect for PostureDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let rate = parameters.number(CARD.name, &RATE)?;
        let moving = setting.sites();
        let force = setting.stiffness.iter().map(|row| -rate * moving.iter().filter_map(|&j| row.get(j)).sum::<f64>()).collect();
        Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, stiffness: vec![], force })))
    }

    /// Not offered where the displacement is an integral: the sensor's unknown zero moves it alike.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.spring || scale.integrals > 0 {
            return Vec::new();
        }
        let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
        (0..n)
            .map(|axis| {
                let stiffness = Setting::diagonal(&scale.stiffness, axis);
                Form {
                    label: "creep",
                    side: Side::Limb,
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
                    naming: Arc::new(move |_, c| vec![("rate_m_per_s", Value::Number(-c[0] / stiffness))]),
                    floor: (0.01, 0.0),
                }
            })
            .collect()
    }
}
