//! The stretch reflex.

use super::reflex::{Gain, Reflex, tangent};
use super::vocabulary::*;
use crate::time::laws::NO_MUSCLE_HZ;

pub(super) const DELAY: ParameterCard = plain("delay_s", "s", 0.0, 10.0, None);
const STIFFNESS: ParameterCard = mechanical("stiffness_n_per_m", ("N/m", "N m/rad"), -1e9, 1e9, Some(0.0));
const DAMPING: ParameterCard = mechanical("damping_n_s_per_m", ("N s/m", "N m s/rad"), -1e9, 1e9, Some(0.0));
pub(super) const CUTOFF: ParameterCard = plain("cutoff_hz", "Hz", 1e-6, NO_MUSCLE_HZ, Some(3.0));
pub(super) const ONE_DIRECTIONAL: ParameterCard = plain("one_directional", "", -1.0, 1.0, Some(0.0));
const CARD: Card = Card {
    name: "reflex-delay",
    what: "a reflex inside the limb: delayed feedback of position and velocity through the muscle's activation, in one or both directions",
    sides: &[Side::Limb],
    parameters: &[DELAY, STIFFNESS, DAMPING, CUTOFF, ONE_DIRECTIONAL],
    signature: "from 0.5 to 5 Hz stiffness up and damping down, a sharper resonance; no phase roll-off above 5 Hz",
    look_alikes: &["hysteresis", "viscoelastic", "measurement-delay", "asymmetric-stiffness"],
    next_experiment: "single ramps to either side, slow and fast: a reflex answers after its delay, and a one-directional one to one side only",
    equation: "f = exp(-s τ) ω²/(s + ω)² [(k + b s) x], one-directional: [b max(± v, 0)]; a cut-off of 1e6 Hz, or none where a cause is named: without the muscle",
    source: "Kearney, Stein & Parameswaran 1997, Identification of intrinsic and reflex contributions to human ankle stiffness dynamics",
    trace: Trace::Forms,
};

/// A delay beyond this (s) is none of a reflex, and a muscle that follows beyond this (Hz) is none: a mode or a filter answers so.
const LATE_S: f64 = 0.1;
const FAST_HZ: f64 = 15.0;

/// Delayed feedback of one axis.
pub(super) const EFFECT: Effect = Effect { forms, stands_for, ..Effect::new(&CARD, injection) };

fn named([delay, cutoff]: [f64; 2], [stiffness, damping]: [f64; 2], one_directional: bool) -> Vec<(&'static str, Value)> {
    let muscle = (cutoff < NO_MUSCLE_HZ).then_some(("cutoff_hz", Value::Number(cutoff)));
    let rest = [("stiffness_n_per_m", Value::Number(stiffness)), ("damping_n_s_per_m", Value::Number(damping))];
    let of = [("one_directional", Value::Flag(one_directional))];
    std::iter::once(("delay_s", Value::Number(delay))).chain(rest).chain(muscle).chain(of).collect()
}

/// Knobs delay and cut-off, where a search starts, and what a fit to a wrong muscle leaves.
pub(super) fn searched(form: Form, scale: &Scale) -> Form {
    let unit = scale.human_time_s();
    let starts: [&[f64]; 2] = [&[0.03 * unit, 0.06 * unit], &[1.5 / unit, 3.0 / unit, 6.0 / unit]];
    told_by_delay(form.knobs(vec![delay(0.012 * unit, unit), Knob::log(1.0 / unit, 20.0 / unit)], &starts))
}

/// The same of one without a muscle: the delay alone, from somewhat less than what the fastest reflexes take (30 ms). A feedback that answers sooner shows in
/// no such band: inertia, damping and stiffness together do what it does.
/// Up to 0.1 s any delay is nearer to a start than a quarter of a period at the band's end (21 ms).
fn searched_without_muscle(form: Form, scale: &Scale) -> Form {
    let unit = scale.human_time_s();
    told_by_delay(form.knobs(vec![delay(0.02 * unit, unit)], &[&[0.03, 0.05, 0.09].map(|delay| delay * unit)]))
}

fn delay(least_s: f64, unit: f64) -> Knob {
    Knob { telling: true, ..Knob::log(least_s, 0.13 * unit) }
}

fn told_by_delay(form: Form) -> Form {
    form.floor(0.02).absolute(DELAY.name, 0.5e-3)
}

/// Forms of position and velocity, of positive and negative velocity, and of velocity.
const THROUGH_MUSCLE: [&str; 4] = ["both directions", "positive velocity only", "negative velocity only", "velocity in both directions"];
const WITHOUT_MUSCLE: [&str; 4] = [
    "both directions, without a muscle",
    "positive velocity only, without a muscle",
    "negative velocity only, without a muscle",
    "velocity in both directions, without a muscle",
];

/// What the knobs of a form are.
type DelayAndCutoff = fn(&[f64]) -> [f64; 2];

fn injection(parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
    let number = |card| parameters.number(CARD.name, card);
    let theta = [number(&STIFFNESS)?, number(&DAMPING)?, number(&DELAY)?, number(&CUTOFF)?];
    Ok(Injection::Force(Box::new(Reflex { axis: setting.one_axis(&CARD)?, direction: number(&ONE_DIRECTIONAL)?, theta, gain: Gain::Constant })))
}

fn forms(scale: &Scale) -> Vec<Form> {
    // Beside a gain that may follow a schedule stands the constant one, which does not pay for a position that plays no part.
    let velocities = if scale.closed_schedule.is_some() { &[1.0, -1.0, 0.0][..] } else { &[1.0, -1.0] };
    let law = |axis, [delay, cutoff]: [f64; 2], [stiffness, damping]: [f64; 2], direction| {
        let theta = [stiffness, damping, delay, cutoff];
        Reflex { axis, direction, theta, gain: Gain::Constant }
    };
    let of_axis = |axis: usize, at: DelayAndCutoff, [of_both, positive, negative, of_velocity]: [&'static str; 4]| {
        let both = Form::new(of_both, Some(axis), Action::force(move |k, c| law(axis, at(k), [c[0], c[1]], 0.0)))
            .coefficients(vec![Sign::Positive, Sign::Positive])
            .naming(move |k, c| named(at(k), [c[0], c[1]], false));
        let velocity = velocities.iter().map(move |&direction| {
            let label = if direction > 0.0 {
                positive
            } else if direction < 0.0 {
                negative
            } else {
                of_velocity
            };
            let action = Action::tangent(move |k, c| law(axis, at(k), [0.0, c[0]], direction), move |s, k| tangent(direction, s, at(k)));
            Form::new(label, Some(axis), action).coefficients(vec![Sign::Positive]).naming(move |k, c| named(at(k), [0.0, c[0]], direction != 0.0))
        });
        std::iter::once(both).chain(velocity)
    };
    (0..scale.axes())
        .flat_map(|axis| {
            let muscle = of_axis(axis, |k| [k[0], k[1]], THROUGH_MUSCLE).map(|form| searched(form, scale));
            muscle.chain(of_axis(axis, |k| [k[0], NO_MUSCLE_HZ], WITHOUT_MUSCLE).map(|form| searched_without_muscle(form, scale)))
        })
        .collect()
}

fn stands_for(evidence: &Evidence<'_>) -> &'static [&'static str] {
    let unit = evidence.scale.human_time_s();
    let late = evidence.number(&DELAY).is_some_and(|delay| delay > LATE_S * unit);
    let fast = evidence.number(&CUTOFF).is_some_and(|cutoff| cutoff * unit > FAST_HZ);
    if late || fast { &["extra-resonance", "channel-filter"] } else { &[] }
}
