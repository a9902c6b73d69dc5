//! Inertia that the baseline lacks.

use super::card::mechanical;
use super::{Action, Card, Effect, EffectError, Form, Injection, Matrix, ParameterCard, Parameters, Scale, Setting, Side, Sign, Trace, Value, require_known};
use std::sync::Arc;

const MASS: ParameterCard = mechanical("mass_kg", ("kg", "kg m^2"), 0.0, 1e6, None);
const CARD: Card = Card {
    name: "added-mass",
    what: "inertia that the baseline lacks: a handle, a trough, a cuff beyond the sensor",
    sides: &[Side::Limb],
    parameters: &[MASS],
    signature: "the inertia is too large by the same amount in every direction, nothing else changes",
    look_alikes: &["parameter-error", "extra-resonance", "sensor-scale"],
    next_experiment: "a run with the empty handle: its mass is seen alone",
    equation: "f = m ẍ in every direction",
    source: "Newton's second law",
    trace: Trace::Forms,
};

/// Mass beyond the sensor.
pub struct AddedMass;

impl Effect for AddedMass {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn inject(&self, parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
        require_known(&CARD, parameters)?;
        Ok(Injection::Mass(parameters.number(CARD.name, &MASS)?))
    }

    /// Only against a baseline whose whole inertia is given: a fitted one absorbs it.
    fn forms(&self, scale: &Scale) -> Vec<Form> {
        let given = |i: usize| scale.nominal.iter().chain(&scale.held).any(|e| (e.0, e.1, e.2) == (Matrix::Mass, i, i));
        if !(0..scale.axes()).all(given) {
            return Vec::new();
        }
        vec![Form {
            label: "point mass",
            side: Side::Limb,
            axis: None,
            knobs: vec![],
            grid: vec![vec![]],
            signs: vec![Sign::Positive],
            action: Action::Entries { matrix: Matrix::Mass, entries: (0..scale.axes()).map(|i| (i, i, 1.0)).collect() },
            naming: Arc::new(|_, c| vec![("mass_kg", Value::Number(c[0]))]),
            floor: (0.005, 0.0),
        }]
    }
}
