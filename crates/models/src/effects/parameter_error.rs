//! A wrong nominal parameter.

use super::vocabulary::*;

pub(super) const NAME: ParameterCard = plain("name", "", 0.0, 0.0, None);
pub(super) const VALUE: ParameterCard = plain("value", "", f64::MIN, f64::MAX, None);
const CARD: Card = Card {
    name: "parameter-error",
    what: "a nominal parameter of the baseline is wrong",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[NAME, VALUE],
    signature: "the residual force is proportional to the acceleration, velocity or displacement that the parameter multiplies",
    look_alikes: &["added-mass", "sensor-scale", "cross-coupling"],
    next_experiment: "a perturbation with its power where the parameter matters: low for stiffness, high for inertia",
    equation: "f = (value - nominal) x, ẋ or ẍ",
    source: "the baseline's own equation M ẍ + B ẋ + K x = F",
    trace: Trace::Forms,
};

/// Another value for the named parameter of the plant.
pub(super) fn replaced(card: &'static Card, parameters: &Parameters) -> Result<Injection, EffectError> {
    let name = parameters.text("name").ok_or(EffectError::Missing { effect: card.name, parameter: NAME.name })?;
    Ok(Injection::Parameter { name: name.to_owned(), value: parameters.number(card.name, &VALUE)? })
}

/// A parameter whose nominal value is wrong.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, |parameters, _| replaced(&CARD, parameters)) };

fn forms(scale: &Scale) -> Vec<Form> {
    scale
        .nominal
        .iter()
        .filter(|entry| entry.1 <= entry.2 || entry.0 != Matrix::Mass)
        .map(|&(matrix, i, j, value)| {
            let letter = match matrix {
                Matrix::Mass => "M",
                Matrix::Damping => "B",
                Matrix::Stiffness => "K",
            };
            let axis = |k: usize| scale.motion_names.get(k).map_or("", |n| n.split_once('_').map_or(n.as_str(), |(_, axis)| axis)).to_owned();
            let name = if scale.axes() == 1 { letter.to_owned() } else { format!("{letter}_{}_{}", axis(i), axis(j)) };
            let entries = if matrix == Matrix::Mass && i != j { vec![(i, j, 1.0), (j, i, 1.0)] } else { vec![(i, j, 1.0)] };
            Form::new("entry of a matrix", Some(i), Action::Entries { matrix, entries })
                .coefficients(vec![Sign::Free])
                .naming(move |_, c| vec![("name", Value::Text(name.clone())), ("value", Value::Number(value + c[0]))])
        })
        .collect()
}
