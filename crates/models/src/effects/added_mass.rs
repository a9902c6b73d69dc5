//! Inertia that the baseline lacks.

use super::vocabulary::*;

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
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
    Ok(Injection::Mass(parameters.number(CARD.name, &MASS)?))
}

/// Only against a baseline whose whole inertia is given: a fitted one absorbs it.
fn forms(scale: &Scale) -> Vec<Form> {
    let n = scale.axes();
    if !(0..n).all(|i| scale.is_given(Matrix::Mass, i, i)) {
        return Vec::new();
    }
    let form = Form::new("point mass", None, Action::Entries { matrix: Matrix::Mass, entries: (0..n).map(|i| (i, i, 1.0)).collect() });
    vec![form.coefficients(vec![Sign::Positive]).numbers(|_, c| [("mass_kg", c[0])]).floor(0.005)]
}
