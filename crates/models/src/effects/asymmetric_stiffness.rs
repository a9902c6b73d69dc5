//! Stiffness that differs with the direction.

use super::card::mechanical;
use super::form::grid;
use super::static_force::{Static, other_shapes};
use super::{
    Action, Card, Effect, EffectError, Evidence, Form, Injection, Knob, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known,
};
use std::sync::Arc;

const K2: ParameterCard = mechanical("k2_n_per_m2", ("N/m^2", "N m/rad^2"), -1e12, 1e12, None);
const CARD: Card = Card {
    name: "asymmetric-stiffness",
    what: "a spring that is stiffer in one direction than in the other",
    sides: &[Side::Limb],
    parameters: &[K2],
    signature: "even lines in a multisine, a mean displacement that grows with the amplitude",
    look_alikes: &["cubic-stiffness", "end-stop", "posture-drift"],
    next_experiment: "the same perturbation about a posture moved by one standard deviation to either side: the stiffness changes with the side",
    equation: "f = k2 x²",
    source: "Nayfeh & Mook 1979, Nonlinear oscillations, ch. 4",
    trace: Trace::Forms,
};

/// Even stiffness of one axis.
pub struct AsymmetricStiffness;

impl Effect for AsymmetricStiffness {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let k2 = parameters.number(CARD.name, &K2)?;
        let axis = setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?;
        Ok(Injection::Force(Box::new(Static { axis, force: move |x: f64| k2 * x * x })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        (0..scale.axes())
            .flat_map(|axis| {
                let spread = scale.position[axis];
                let square = Form {
                    label: "x²",
                    side: Side::Limb,
                    axis: Some(axis),
                    knobs: vec![],
                    grid: vec![vec![]],
                    signs: vec![Sign::Free],
                    action: Action::Force {
                        law: Arc::new(move |_, c| {
                            let k2 = c[0];
                            Box::new(Static { axis, force: move |x: f64| k2 * x * x })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(|_, c| vec![("k2_n_per_m2", Value::Number(c[0]))]),
                    floor: (0.01, 0.0),
                };
                // Over a Gaussian x the best parabola through |x| has the coefficient 1 / (sqrt(2 π) σ).
                let to_square = 1.0 / ((2.0 * std::f64::consts::PI).sqrt() * spread);
                let kink = Form {
                    label: "kink",
                    knobs: vec![Knob { lo: -0.6 * spread, hi: 0.6 * spread, log: false, telling: false }],
                    grid: grid(&[&[-0.3 * spread, 0.0, 0.3 * spread]]),
                    action: Action::Force {
                        law: Arc::new(move |k, c| {
                            let (centre, k) = (k[0], c[0]);
                            Box::new(Static { axis, force: move |x: f64| k * ((x - centre).abs() - centre.abs()) })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(move |_, c| vec![("k2_n_per_m2", Value::Number(c[0] * to_square))]),
                    floor: (0.1, 0.0),
                    ..square.clone()
                };
                [square, kink]
            })
            .collect()
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        other_shapes(CARD.name, evidence)
    }
}
