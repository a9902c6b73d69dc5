//! Stiffness that differs with the direction.

use super::static_force::{other_shapes, shape};
use super::vocabulary::*;

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
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let k2 = parameters.number(CARD.name, &K2)?;
    Ok(Injection::Force(Box::new(on_axis(setting.one_axis(&CARD)?, laws::AsymmetricStiffness, [k2]))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    (0..scale.axes())
        .flat_map(|axis| {
            let spread = scale.position[axis];
            let square = Form::new("x²", Some(axis), Action::force(move |_, c| on_axis(axis, laws::AsymmetricStiffness, [c[0]])));
            // Over a Gaussian x the best parabola through |x| has the coefficient 1 / (sqrt(2 π) σ).
            let to_square = 1.0 / ((2.0 * std::f64::consts::PI).sqrt() * spread);
            let kink = Form::new("kink", Some(axis), shape(axis, |k, c, x| c[0] * ((x - k[0]).abs() - k[0].abs())))
                .knobs(vec![Knob::linear(-0.6 * spread, 0.6 * spread)], &[&[-0.3 * spread, 0.0, 0.3 * spread]])
                .floor(0.1);
            [(square, 1.0), (kink, to_square)].map(|(form, factor)| form.coefficients(vec![Sign::Free]).numbers(move |_, c| [("k2_n_per_m2", c[0] * factor)]))
        })
        .collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    other_shapes(CARD.name, evidence)
}
