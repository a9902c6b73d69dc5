//! Slack.

use super::card::mechanical;
use super::form::grid;
use super::static_force::{Static, other_shapes};
use super::{
    Action, Card, Effect, EffectError, Evidence, Form, Injection, Knob, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known,
};
use std::sync::Arc;

const HALF_GAP: ParameterCard = mechanical("half_gap_m", ("m", "rad"), 0.0, 1e6, None);
const CARD: Card = Card {
    name: "dead-zone",
    what: "backlash or slack: within a gap the spring does not pull",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[HALF_GAP],
    signature: "apparent stiffness falls strongly as the amplitude falls, inertia stays",
    look_alikes: &["cubic-stiffness", "hysteresis", "coulomb-friction"],
    next_experiment: "the same perturbation at a third of the amplitude: inside the gap the stiffness vanishes",
    equation: "f = K dz(x) - K x = -K clip(x, ± half_gap)",
    source: "Nordin & Gutman 2002, Controlling mechanical systems with backlash: a survey",
    trace: Trace::Forms,
};

/// A gap of this many standard deviations of the displacement to either side is a spring that hardens.
const WIDE: f64 = 0.9;

/// A gap in the stiffness of one axis.
pub struct DeadZone;

impl Effect for DeadZone {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let gap = parameters.number(CARD.name, &HALF_GAP)?;
        let axis = setting.axis.ok_or(EffectError::Setting { effect: CARD.name, what: "an axis" })?;
        let stiffness = Setting::diagonal(&setting.stiffness, axis);
        if stiffness <= 0.0 {
            return Err(EffectError::Setting { effect: CARD.name, what: "a plant with stiffness on its axis" });
        }
        Ok(Injection::Force(Box::new(Static { axis, force: move |x: f64| -stiffness * x.clamp(-gap, gap) })))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        if !scale.spring {
            return Vec::new();
        }
        (0..scale.axes())
            .flat_map(|axis| {
                let spread = scale.position[axis];
                let knobs = vec![
                    Knob { lo: 0.05 * spread, hi: 1.8 * spread, log: true, telling: false },
                    Knob { lo: -0.8 * spread, hi: 0.8 * spread, log: false, telling: false },
                ];
                let hard = Form {
                    label: "gap",
                    side: Side::Limb,
                    axis: Some(axis),
                    knobs: knobs.clone(),
                    grid: grid(&[&[0.1, 0.2, 0.4, 0.7, 1.1].map(|q| q * spread), &[0.0]]),
                    signs: vec![Sign::Negative],
                    action: Action::Force {
                        law: Arc::new(move |k, c| {
                            let (gap, centre, k) = (k[0], k[1], c[0]);
                            Box::new(Static { axis, force: move |x: f64| k * (x - centre).clamp(-gap, gap) })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(|k, _| vec![("half_gap_m", Value::Number(k[0]))]),
                    floor: (0.02, 0.0),
                };
                let soft = Form {
                    label: "soft gap",
                    action: Action::Force {
                        law: Arc::new(move |k, c| {
                            let (gap, centre, k) = (k[0], k[1], c[0]);
                            Box::new(Static {
                                axis,
                                force: move |x: f64| {
                                    let u = (x - centre) / gap;
                                    k * gap * u / (1.0 + u * u).sqrt()
                                },
                            })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    floor: (0.1, 0.0),
                    ..hard.clone()
                };
                [hard, soft]
            })
            .collect()
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        match other_shapes(CARD.name, evidence) {
            [] if evidence.number(&HALF_GAP).is_some_and(|gap| gap > WIDE * evidence.position()) => &["cubic-stiffness"],
            others => others,
        }
    }
}
