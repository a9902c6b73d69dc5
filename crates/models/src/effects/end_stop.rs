//! A wall within the range of motion.

use super::card::mechanical;
use super::form::grid;
use super::static_force::{Static, other_shapes};
use super::{
    Action, Card, Effect, EffectError, Evidence, Form, Injection, Knob, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known,
};
use std::sync::Arc;

const POSITION: ParameterCard = mechanical("position_m", ("m", "rad"), -1e6, 1e6, None);
const STIFFNESS: ParameterCard = mechanical("stiffness_n_per_m", ("N/m", "N m/rad"), 0.0, 1e12, None);
const CARD: Card = Card {
    name: "end-stop",
    what: "a wall inside the range of motion",
    sides: &[Side::Limb, Side::Environment],
    parameters: &[POSITION, STIFFNESS],
    signature: "a force that is there only beyond one position, the displacement's distribution is cut on that side",
    look_alikes: &["asymmetric-stiffness", "cubic-stiffness"],
    next_experiment: "the same perturbation at half the amplitude, away from the wall: it disappears",
    equation: "f = k max(x - p, 0) for p > 0, -k max(p - x, 0) for p < 0",
    source: "Nayfeh & Mook 1979, Nonlinear oscillations; Hunt & Crossley 1975 for the soft contact",
    trace: Trace::Forms,
};

/// A wall on one side of one axis.
pub struct EndStop;

/// The force of a wall at `position` whose side is the position's sign.
fn wall(x: f64, position: f64, side: f64, exponent: f64) -> f64 {
    side * (side * (x - position)).max(0.0).powf(exponent)
}

impl Effect for EndStop {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let (position, stiffness) = (parameters.number(CARD.name, &POSITION)?, parameters.number(CARD.name, &STIFFNESS)?);
        let axis = setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?;
        let side = position.signum();
        Ok(Injection::Force(Box::new(Static { axis, force: move |x: f64| stiffness * wall(x, position, side, 1.0) })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let mut forms = Vec::new();
        for axis in 0..scale.axes() {
            let (spread, centre) = (scale.position[axis], scale.centre[axis]);
            for side in [1.0, -1.0] {
                for (label, exponent) in [("wall", 1.0), ("soft wall", 1.5)] {
                    forms.push(Form {
                        label,
                        side: Side::Limb,
                        axis: Some(axis),
                        knobs: vec![Knob { lo: 0.5 * spread, hi: 2.6 * spread, log: false, telling: false }],
                        grid: grid(&[&[0.6, 1.0, 1.4, 1.8].map(|q| q * spread)]),
                        signs: vec![Sign::Positive],
                        action: Action::Force {
                            law: Arc::new(move |k, c| {
                                let (position, k) = (side * k[0], c[0]);
                                Box::new(Static { axis, force: move |x: f64| k * wall(x, position, side, exponent) })
                            }),
                            exact: vec![],
                            tangent: None,
                        },
                        naming: Arc::new(move |k, c| {
                            let stiffness = c[0] * spread.powf(exponent - 1.0);
                            vec![("position_m", Value::Number(side * k[0] + centre)), ("stiffness_n_per_m", Value::Number(stiffness))]
                        }),
                        floor: (0.02, 0.0),
                    });
                }
            }
        }
        forms
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        other_shapes(CARD.name, evidence)
    }
}
