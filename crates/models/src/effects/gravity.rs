//! Gravity that the baseline lacks.

use super::static_force::{of_place, shape};
use super::vocabulary::*;

const TORQUE: ParameterCard = plain("torque_nm", "N m", 0.0, 1e6, None);
const DIRECTION: ParameterCard = plain("direction_rad", "rad", -7.0, 7.0, Some(0.0));
const CARD: Card = Card {
    name: "gravity",
    what: "tilt or a gravity torque that the baseline lacks",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[TORQUE, DIRECTION],
    signature: "an offset and a stiffness that change with the angle of the posture",
    look_alikes: &["asymmetric-stiffness", "cubic-stiffness", "parameter-error"],
    next_experiment: "the same perturbation about a second posture: gravity's torque follows the sine of the angle",
    equation: "f = torque sin(angle - direction)",
    source: "Krebs et al. 2007, Robot-aided neurorehabilitation: a robot for wrist rehabilitation",
    trace: Trace::Forms,
};

/// Gravity torque of one angular axis.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let (torque, direction) = (parameters.number(CARD.name, &TORQUE)?, parameters.number(CARD.name, &DIRECTION)?);
    let axis = setting.one_axis(&CARD)?;
    Ok(Injection::Force(Box::new(of_place(axis, move |angle: f64| torque * (angle - direction).sin()))))
}

/// Only for angles that move enough for the sine to bend; its straight part belongs to the baseline's stiffness.
fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.rotational {
        return Vec::new();
    }
    (0..scale.axes())
        .filter(|&axis| scale.position[axis] > 0.1)
        .map(|axis| {
            let centre = scale.centre[axis];
            let law = shape(axis, move |_, c, x| c[0] * (x + centre).sin() - c[1] * (x + centre).cos());
            Form::new("sine of the angle", Some(axis), law)
                .coefficients(vec![Sign::Free, Sign::Free])
                .numbers(|_, c| [("torque_nm", c[0].hypot(c[1])), ("direction_rad", c[1].atan2(c[0]))])
                .floor(0.02)
        })
        .collect()
}
