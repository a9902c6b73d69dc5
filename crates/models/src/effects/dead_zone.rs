//! Slack.

use super::static_force::{of_place, other_shapes, shape};
use super::vocabulary::*;

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
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let gap = parameters.number(CARD.name, &HALF_GAP)?;
    let axis = setting.one_axis(&CARD)?;
    let stiffness = Setting::diagonal(&setting.stiffness, axis);
    if stiffness <= 0.0 {
        return Err(EffectError::Setting { effect: CARD.name, what: "a plant with stiffness on its axis" });
    }
    Ok(Injection::Force(Box::new(of_place(axis, move |x: f64| -stiffness * x.clamp(-gap, gap)))))
}

fn forms(scale: &Scale) -> Vec<Form> {
    if !scale.spring {
        return Vec::new();
    }
    (0..scale.axes())
        .flat_map(|axis| {
            let (spread, far) = (scale.position[axis], scale.far[axis]);
            let hard = Form::new("gap", Some(axis), shape(axis, |k, c, x| c[0] * (x - k[1]).clamp(-k[0], k[0]))).floor(0.02);
            let soft = shape(axis, |k, c, x| {
                let u = (x - k[1]) / k[0];
                c[0] * k[0] * u / (1.0 + u * u).sqrt()
            });
            [hard, Form::new("soft gap", Some(axis), soft).floor(0.1)].map(|form| {
                form.knobs(
                    vec![Knob::log(0.05 * spread, far), Knob::linear(-0.8 * spread, 0.8 * spread)],
                    &[&[0.1, 0.2, 0.4, 0.7, 1.1].map(|q| (q * spread).min(far)), &[0.0]],
                )
                .coefficients(vec![Sign::Negative])
                .numbers(|k, _| [("half_gap_m", k[0])])
            })
        })
        .collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    match other_shapes(CARD.name, evidence) {
        [] if evidence.number(&HALF_GAP).is_some_and(|gap| gap > WIDE * evidence.position()) => &["cubic-stiffness"],
        others => others,
    }
}
