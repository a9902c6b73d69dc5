//! Stiffness that grows or falls with the amplitude.

use super::static_force::{other_shapes, shape};
use super::vocabulary::*;

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
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

/// Stiffness that grows with the squared distance from the posture, in all directions.
fn isotropic(k3: f64) -> impl ForceLaw {
    move |motion: &Motion<'_>, force: &mut [f64]| {
        let square: f64 = motion.position.iter().map(|x| x * x).sum();
        force.iter_mut().zip(motion.position).for_each(|(f, x)| *f += k3 * square * x);
    }
}

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let k3 = parameters.number(CARD.name, &K3)?;
    Ok(Injection::Force(match setting.axis {
        Some(axis) => Box::new(on_axis(axis, laws::CubicStiffness, [k3])),
        None => Box::new(isotropic(k3)),
    }))
}

fn forms(scale: &Scale) -> Vec<Form> {
    let mut forms: Vec<Form> = (0..scale.axes())
        .flat_map(|axis| {
            let of = |label, law| Form::new(label, Some(axis), law).coefficients(vec![Sign::Free]);
            let named = |form: Form, factor: f64| form.numbers(move |_, c| [("k3_n_per_m3", c[0] * factor)]);
            let off_centre = Form::new("(x - x0)³", Some(axis), shape(axis, |_, c, x| c[0] * x.powi(3) + c[1] * x * x));
            // Over a Gaussian x the best cubic through x |x| has the coefficient sqrt(2 / (9 π)) / σ.
            let to_cubic = (2.0 / (9.0 * std::f64::consts::PI)).sqrt() / scale.position[axis];
            [
                named(of("x³", Action::force(move |_, c| on_axis(axis, laws::CubicStiffness, [c[0]]))), 1.0),
                named(off_centre.coefficients(vec![Sign::Free, Sign::Free]), 1.0),
                named(of("x |x|", shape(axis, |_, c, x| c[0] * x * x.abs())), to_cubic).floor(0.1),
            ]
        })
        .collect();
    if scale.axes() > 1 {
        let all = Form::new("|x|² x", None, Action::force(|_, c| isotropic(c[0]))).coefficients(vec![Sign::Free]);
        forms.push(all.numbers(|_, c| [("k3_n_per_m3", c[0])]));
    }
    forms
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    // Over a Gaussian x the rms of x² is √2 σ² about its mean, that of x³ is √6 σ³ about its straight line.
    let even = |form: &&[f64]| matches!(form, [cube, square] if square.abs() * 2f64.sqrt() > cube.abs() * 6f64.sqrt() * evidence.position());
    match other_shapes(CARD.name, evidence) {
        [] if evidence.axis.is_some() && evidence.coefficients.iter().any(even) => &["asymmetric-stiffness"],
        others => others,
    }
}
