//! Stiffness that grows or falls with the amplitude.

use super::card::mechanical;
use super::static_force::{Static, other_shapes};
use super::{Action, Card, Effect, EffectError, Evidence, Form, Injection, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use crate::force_law::{ForceLaw, Motion};
use std::sync::Arc;

const K3: ParameterCard = mechanical("k3_n_per_m3", ("N/m^3", "N m/rad^3"), -1e15, 1e15, None);
const CARD: Card = Card {
    name: "cubic-stiffness",
    what: "a spring that hardens (+) or softens (-) with the amplitude, alike in both directions",
    sides: &[Side::Limb],
    parameters: &[K3],
    signature: "apparent stiffness changes with the square of the amplitude; odd lines in a multisine; hardly visible in coherence",
    look_alikes: &["dead-zone", "hysteresis", "stiffness-drift", "actuator-saturation"],
    next_experiment: "the same perturbation at half and at twice the amplitude: a cubic law changes the stiffness by the square of the ratio",
    equation: "f = k3 x³",
    source: "Duffing 1918, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz",
    trace: Trace::Forms,
};

/// Cubic stiffness of one axis.
pub struct CubicStiffness;

/// Stiffness that grows with the squared distance from the posture, in all directions.
struct Isotropic {
    k3: f64,
}

impl ForceLaw for Isotropic {
    fn evaluate(&self, motion: &Motion<'_>, _states: &[f64], force: &mut [f64], _rates: &mut [f64]) {
        let square: f64 = motion.position.iter().map(|x| x * x).sum();
        for (f, x) in force.iter_mut().zip(motion.position) {
            *f += self.k3 * square * x;
        }
    }
}

impl Effect for CubicStiffness {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        let k3 = parameters.number(CARD.name, &K3)?;
        Ok(Injection::Force(match setting.axis {
            Some(axis) => Box::new(Static { axis, force: move |x: f64| k3 * x.powi(3) }),
            None => Box::new(Isotropic { k3 }),
        }))
    }

    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let mut forms: Vec<Form> = (0..scale.axes())
            .flat_map(|axis| {
                let spread = scale.position[axis];
                let cubic = Form {
                    label: "x³",
                    side: Side::Limb,
                    axis: Some(axis),
                    knobs: vec![],
                    grid: vec![vec![]],
                    signs: vec![Sign::Free],
                    action: Action::Force {
                        law: Arc::new(move |_, c| {
                            let k3 = c[0];
                            Box::new(Static { axis, force: move |x: f64| k3 * x.powi(3) })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(|_, c| vec![("k3_n_per_m3", Value::Number(c[0]))]),
                    floor: (0.01, 0.0),
                };
                let off_centre = Form {
                    label: "(x - x0)³",
                    signs: vec![Sign::Free, Sign::Free],
                    action: Action::Force {
                        law: Arc::new(move |_, c| {
                            let (k3, k2) = (c[0], c[1]);
                            Box::new(Static { axis, force: move |x: f64| k3 * x.powi(3) + k2 * x * x })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    ..cubic.clone()
                };
                // Over a Gaussian x the best cubic through x |x| has the coefficient sqrt(2 / (9 π)) / σ.
                let to_cubic = (2.0 / (9.0 * std::f64::consts::PI)).sqrt() / spread;
                let square = Form {
                    label: "x |x|",
                    action: Action::Force {
                        law: Arc::new(move |_, c| {
                            let k = c[0];
                            Box::new(Static { axis, force: move |x: f64| k * x * x.abs() })
                        }),
                        exact: vec![],
                        tangent: None,
                    },
                    naming: Arc::new(move |_, c| vec![("k3_n_per_m3", Value::Number(c[0] * to_cubic))]),
                    floor: (0.1, 0.0),
                    ..cubic.clone()
                };
                [cubic, off_centre, square]
            })
            .collect();
        if scale.axes() > 1 {
            forms.push(Form {
                label: "|x|² x",
                side: Side::Limb,
                axis: None,
                knobs: vec![],
                grid: vec![vec![]],
                signs: vec![Sign::Free],
                action: Action::Force { law: Arc::new(|_, c| Box::new(Isotropic { k3: c[0] })), exact: vec![], tangent: None },
                naming: Arc::new(|_, c| vec![("k3_n_per_m3", Value::Number(c[0]))]),
                floor: (0.01, 0.0),
            });
        }
        forms
    }

    fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        // Over a Gaussian x the rms of x² is √2 σ² about its mean, that of x³ is √6 σ³ about its straight line.
        let even = |form: &&[f64]| matches!(form, [cube, square] if square.abs() * 2f64.sqrt() > cube.abs() * 6f64.sqrt() * evidence.position());
        match other_shapes(CARD.name, evidence) {
            [] if evidence.axis.is_some() && evidence.coefficients.iter().any(even) => &["asymmetric-stiffness"],
            others => others,
        }
    }
}
