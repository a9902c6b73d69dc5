//! A clipped command.

use super::vocabulary::*;

const LEVEL: ParameterCard = mechanical("level_n", ("N", "N m"), 1e-12, 1e9, None);
const CARD: Card = Card {
    name: "actuator-saturation",
    what: "the actuator gives no more than a certain force",
    sides: &[Side::Actuator],
    parameters: &[LEVEL],
    signature: "force piles up at one level while the command goes on",
    look_alikes: &["cubic-stiffness", "coulomb-friction"],
    next_experiment: "the same perturbation at half the amplitude: below the level the difference vanishes",
    equation: "applied = clip(command, ± level)",
    source: "Åström & Wittenmark 1997, Computer-controlled systems",
    trace: Trace::Forms,
};

/// Saturation of the actuator.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, _setting: &Setting) -> Result<Injection, EffectError> {
    let level = parameters.number(CARD.name, &LEVEL)?;
    Ok(Injection::Stage(Box::new(move |sample: f64| sample.clamp(-level, level))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.effort_is_command {
        return Vec::new();
    }
    let unit = scale.effort.iter().sum::<f64>() / scale.axes() as f64;
    let form = Form::new("clip", None, Action::Clip)
        .knobs(vec![Knob::log(0.3 * unit, 3.2 * unit)], &[&[0.7, 1.0, 1.4, 1.9, 2.5].map(|q| q * unit)])
        .numbers(|k, _| [("level_n", k[0])]);
    vec![form.at(Side::Actuator)]
}
