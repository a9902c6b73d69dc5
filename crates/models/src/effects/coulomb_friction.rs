//! Dry friction.

use super::vocabulary::*;

const LEVEL: ParameterCard = mechanical("level_n", ("N", "N m"), 0.0, 1e6, None);
const STATIC_LEVEL: ParameterCard = mechanical("stribeck_level_n", ("N", "N m"), 0.0, 1e6, Some(0.0));
const STRIBECK_VELOCITY: ParameterCard = mechanical("stribeck_velocity_m_per_s", ("m/s", "rad/s"), 1e-9, 1e6, Some(0.01));
const SMOOTHING: ParameterCard = plain("smoothing_m_per_s", "m/s", 1e-12, 1e3, Some(1e-3));
const CARD: Card = Card {
    name: "coulomb-friction",
    what: "dry friction, with Stribeck's higher level at rest where the data show it",
    sides: &[Side::Limb, Side::Robot],
    parameters: &[LEVEL, STATIC_LEVEL, STRIBECK_VELOCITY, SMOOTHING],
    signature: "a residual force of one size whose sign is the velocity's; apparent damping rises as the amplitude falls",
    look_alikes: &["hysteresis", "quantisation", "dead-zone"],
    next_experiment: "the same perturbation at half the amplitude: friction doubles the apparent extra damping, hysteresis changes the stiffness",
    equation: "f = [F_c + (F_s - F_c) exp(-(v/v_s)²)] sign(v)",
    source: "Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, A survey of models for the control of machines with friction",
    trace: Trace::Forms,
};

/// Dry friction of one axis.
pub(super) const EFFECT: Effect = Effect { forms, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let level = parameters.number(CARD.name, &LEVEL)?;
    let at_rest = parameters.number(CARD.name, &STATIC_LEVEL)?;
    let excess = if at_rest > 0.0 { at_rest - level } else { 0.0 };
    let law = laws::Stribeck { turn_velocity: parameters.number(CARD.name, &SMOOTHING)? };
    let stribeck_velocity = parameters.number(CARD.name, &STRIBECK_VELOCITY)?;
    Ok(Injection::Force(Box::new(on_axis(setting.one_axis(&CARD)?, law, [level, excess, stribeck_velocity]))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    (0..scale.axes())
        .flat_map(|axis| {
            let v = scale.velocity[axis];
            let narrowest = 0.05 * v;
            // Both forms turn around well within the narrowest excess near rest.
            let turn_velocity = 0.2 * narrowest;
            let plain = Form::new("Coulomb", Some(axis), Action::force(move |_, c| on_axis(axis, laws::Coulomb { turn_velocity }, [c[0]])))
                .coefficients(vec![Sign::Positive])
                .numbers(|_, c| [("level_n", c[0])])
                .floor(0.015);
            let law = move |k: &[f64], c: &[f64]| on_axis(axis, laws::Stribeck { turn_velocity }, [c[0], c[1], k[0]]);
            let stribeck = Form::new("Stribeck", Some(axis), Action::force(law))
                .knobs(vec![Knob::log(narrowest, 0.8 * v)], &[&[0.1 * v, 0.3 * v]])
                .coefficients(vec![Sign::Positive, Sign::Positive])
                .numbers(|k, c| [("level_n", c[0]), ("stribeck_level_n", c[0] + c[1]), ("stribeck_velocity_m_per_s", k[0])])
                .floor(0.03);
            [plain, stribeck]
        })
        .collect()
}
