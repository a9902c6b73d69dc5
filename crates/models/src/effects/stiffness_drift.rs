//! Tone that changes during a trial.

use super::card::plain;
use super::drift::{Drift, single};
use super::{Action, Card, Effect, EffectError, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use std::sync::Arc;

const FRACTION: ParameterCard = plain("fraction_per_s", "1/s", -1e3, 1e3, None);
const CARD: Card = Card {
    name: "stiffness-drift",
    what: "stiffness (tone) that changes steadily during the trial",
    sides: &[Side::Limb],
    parameters: &[FRACTION],
    signature: "stiffness of the second half differs from that of the first, coherence is lowered around the resonance",
    look_alikes: &["cubic-stiffness", "posture-drift"],
    next_experiment: "a longer record of the same perturbation, repeated: drift goes on with time, a nonlinearity repeats",
    equation: "f = fraction (t - T/2) K x",
    source: "Lacquaniti, Carrozzo & Borghese 1993, Time-varying mechanical behavior of multijointed arm in man",
    trace: Trace::Forms,
};

/// Drifting stiffness.
pub struct StiffnessDrift;

impl Effect for StiffnessDrift {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let fraction = parameters.number(CARD.name, &FRACTION)?;
        let stiffness = match setting.axis {
            Some(axis) => single(setting.axes, axis, fraction * Setting::diagonal(&setting.stiffness, axis)),
            None => setting.stiffness.iter().map(|row| row.iter().map(|k| fraction * k).collect()).collect(),
        };
        Ok(Injection::Force(Box::new(Drift { middle_s: setting.duration_s / 2.0, stiffness, force: vec![] })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.spring {
            return Vec::new();
        }
        let (n, middle_s) = (scale.axes(), scale.duration_s / 2.0);
        // The fitted stiffness is that of the middle of what is analysed, the fraction is told of the trial's.
        let later_s = middle_s - scale.middle_s;
        let mut forms: Vec<Form> = (0..n)
            .map(|axis| {
                let stiffness = Setting::diagonal(&scale.stiffness, axis);
                Form {
                    label: "one axis",
                    side: Side::Limb,
                    axis: Some(axis),
                    knobs: vec![],
                    grid: vec![vec![]],
                    signs: vec![Sign::Free],
                    action: Action::Force {
                        law: Arc::new(move |_, c| Box::new(Drift { middle_s, stiffness: single(n, axis, c[0]), force: vec![] })),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(move |_, c| vec![("fraction_per_s", Value::Number(c[0] / (stiffness + c[0] * later_s)))]),
                    floor: (0.01, 0.0),
                }
            })
            .collect();
        if n > 1 {
            let whole = scale.stiffness.clone();
            forms.push(Form {
                label: "all axes",
                axis: None,
                action: Action::Force {
                    law: Arc::new(move |_, c| {
                        let stiffness = whole.iter().map(|row| row.iter().map(|k| c[0] * k).collect()).collect();
                        Box::new(Drift { middle_s, stiffness, force: vec![] })
                    }),
                    exact: vec![],
                    tangent: None,
                },
                naming: Arc::new(move |_, c| vec![("fraction_per_s", Value::Number(c[0] / (1.0 + c[0] * later_s)))]),
                ..forms[0].clone()
            });
        }
        forms
    }
}
